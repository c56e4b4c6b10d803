"""The body's own to and fro: found with its rate and amplitude, and nothing found where there is none."""

import numpy as np
import pytest
from bladewing.features.heave import LEAST_M, heave
from bladewing.features.wingbeat import wingbeat

from .signals import white

RADAR = {"carrier_hz": 10e9, "prf_hz": 4e3}
WAVELENGTH_M = 299_792_458 / RADAR["carrier_hz"]
PULSES = 10_000
TIME_S = np.arange(PULSES) / RADAR["prf_hz"]


def body(velocity_mps, rate_hz=5.0, amplitude_m=0.0, *, snr_db=10.0, acceleration_mps2=0.0, seed=0):
    """A reflector that goes to and fro on its way, in noise of unit power."""
    path = velocity_mps * TIME_S + acceleration_mps2 / 2 * TIME_S**2
    path += amplitude_m * np.sin(2 * np.pi * rate_hz * TIME_S)
    echo = 10 ** (snr_db / 20) * np.exp(-4j * np.pi / WAVELENGTH_M * path)
    return echo + white(np.random.default_rng(seed), PULSES)


@pytest.mark.parametrize("background_db", [-np.inf, 45.0])
@pytest.mark.parametrize(
    ("velocity_mps", "rate_hz", "amplitude_m", "walks"),
    [(8.0, 5.3, 3e-3, False), (-1.6, 3.4, 12e-3, True), (-1.6, 7.0, 4e-3, False), (6.0, 3.4, 12e-3, False)],
)
def test_rate_amplitude_and_whether_it_walks(velocity_mps, rate_hz, amplitude_m, walks, background_db):
    iq = body(velocity_mps, rate_hz, amplitude_m, acceleration_mps2=0.4) + 10 ** (background_db / 20)
    found = heave(iq, **RADAR)
    assert found.heave_hz == pytest.approx(rate_hz, abs=0.05)
    assert found.amplitude_m == pytest.approx(amplitude_m, rel=0.15)
    assert found.walks == walks


def test_what_does_not_go_to_and_fro_has_no_heave():
    rng = np.random.default_rng(5)
    fading = np.exp(0.8 * np.sin(2 * np.pi * 5.3 * TIME_S))  # of the level, not of the path
    rates = np.fft.rfftfreq(PULSES, 1 / RADAR["prf_hz"])
    wander = np.where((rates > 1.6) & (rates < 18), rng.normal(size=rates.shape) + 1j * rng.normal(size=rates.shape), 0)
    path = np.fft.irfft(wander, PULSES)
    wanders, little = (np.exp(-4j * np.pi / WAVELENGTH_M * path * rms_m / path.std()) for rms_m in (3e-3, 1e-3))
    several = sum(3e-2 / rate * np.sin(2 * np.pi * rate * TIME_S) for rate in (5.3, 7.7, 11.9, 13.3))
    records = {
        "wanders": body(8.0) * wanders,
        "not sure of the rate": body(8.0, 5.3, 3e-3) * little,
        "several rates at once": body(8.0, snr_db=30.0) * np.exp(-4j * np.pi / WAVELENGTH_M * several / 2),
        "steady": body(8.0),
        "fading": body(8.0) * fading,
        "shaken": body(8.0, 12.0, LEAST_M / 3, snr_db=30.0),
        "faster than birds": body(28.0, 5.3, 3e-3),
        "slower than steps": body(1.0, 1.0, 20e-3),
        "faster than wings": body(8.0, 25.0, 3e-3),
        "noise": white(rng, PULSES),
        "zeros": np.zeros(PULSES),
        "one value": np.full(PULSES, 6.2281365 + 14.947527j),
    }
    found = heave(np.stack(list(records.values())).astype(np.complex64), **RADAR)
    assert dict(zip(records, np.isfinite(found.heave_hz), strict=True)) == dict.fromkeys(records, False)
    assert not found.walks.any()
    assert np.isfinite(heave(body(8.0, 5.3, 3e-3), **RADAR).heave_hz)
    assert np.isnan(heave(body(8.0, 5.3, 3e-3)[:5900], **RADAR).heave_hz)  # less than 1.5 s


def test_a_batch_is_what_its_records_are_and_the_gain_does_not_matter():
    batch = np.stack([body(8.0, 5.3, 3e-3), body(-1.6, 3.4, 12e-3), body(8.0)])
    together = heave(batch[:, None], **RADAR)
    assert together.walks.tolist() == [[False], [True], [False]]
    for row, iq in enumerate(batch):
        most = 2.0 ** (127 - np.ceil(np.log2(abs(iq).max())))  # parts are float32, the size of some samples is none
        for gain in (2.0**-40, most):
            one = heave(iq * gain, **RADAR)
            np.testing.assert_array_equal(one.heave_hz, together.heave_hz[row, 0])
            np.testing.assert_array_equal(one.amplitude_m, together.amplitude_m[row, 0])
        weak = heave((iq * 1e-40 / abs(iq).max()).astype(np.complex64), **RADAR)  # 17 bits are left
        np.testing.assert_allclose(weak.heave_hz, together.heave_hz[row, 0], rtol=1e-2)


def test_a_radar_too_slow_to_follow_a_body_sees_no_heave():
    for prf_hz in (1.0, 4.0, 12.0, 100.0):
        assert np.isnan(heave(np.ones(600, np.complex64), carrier_hz=10e9, prf_hz=prf_hz).heave_hz)


@pytest.mark.parametrize("value", [6.2281365 + 14.947527j, 1.0])
def test_a_recording_of_one_value_has_no_wingbeat(value):
    # a converter of few bits leaves nothing else of a strong background
    found = wingbeat(np.full(6769, value, np.complex64), carrier_hz=2.215e9, prf_hz=2707.5)
    assert found.reason == "no wingbeat: nothing moves"
