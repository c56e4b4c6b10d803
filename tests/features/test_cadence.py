"""The power over time: noise is flat, flashes stand at their rate, and what does not change the power does nothing."""

import numpy as np
import pytest
from bladewing.features import doppler_spectrum, model_inputs
from bladewing.features.axis import UNSEEN_DB
from bladewing.features.cadence import cadence_db, cadence_edges_hz, cadence_plan, power_over_time
from bladewing.features.notch import notch_mask, strongest_bin
from bladewing.features.schema import CADENCE_BINS, FEATURES
from bladewing.features.window import HANN
from hypothesis import given, settings
from hypothesis import strategies as st

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, cell_of, rotors, tone, white

EDGES_HZ = cadence_edges_hz()


def cadence(iq, **radar):
    return model_inputs(iq, **(RADAR | radar), names=("cadence",))["cadence"]


@pytest.mark.parametrize("pulses", [1024, 2048, PULSES])
def test_white_noise_is_flat_at_0_db(pulses):
    records = 300
    found = 10 ** (cadence(white(np.random.default_rng(0), records, pulses)) / 10)
    plan = cadence_plan(pulses, PRF_HZ, HANN)
    mean = found[:, 0, plan.seen].mean(axis=0)
    # one line is an exponential, one that all samples share has a longer tail; the clip and the notches take the rest
    assert np.all(np.abs(mean - 0.96) < 7.5 / np.sqrt(records))
    assert np.abs(mean.mean() - 0.96) < 0.02
    assert np.all(np.abs(found[:, 1, plan.seen].mean(axis=0) - 1) < 0.5)  # the largest over what is expected of it


@pytest.mark.parametrize("rate_hz", [47.0, 58.6, 91.0])
def test_flashes_stand_at_their_rate_and_its_multiples(rate_hz):
    iq = rotors([rate_hz], velocity_mps=-7.0) + white(np.random.default_rng(1), PULSES)
    peak = cadence(iq)[1]
    lines = {cell_of(order * 2 * rate_hz, EDGES_HZ) for order in (1, 2, 3)}
    around = {cell_of(1.5 * 2 * rate_hz, EDGES_HZ), cell_of(2.5 * 2 * rate_hz, EDGES_HZ)}
    assert min(peak[sorted(lines)]) > max(peak[sorted(around)]) + 6


def test_flashes_stand_out_where_the_cepstrum_sees_half_as_many():
    strength = [feature.name for feature in FEATURES].index("chopping_strength")

    def told(iq):
        inputs = model_inputs(iq, **RADAR, names=("features", "cadence"))
        return inputs["features"][:, strength], inputs["cadence"][:, 1, cell_of(60, EDGES_HZ) :].max(axis=-1)

    rng = np.random.default_rng(2)
    count = 120
    rates_hz = rng.uniform(45, 75, count)
    blades = np.stack([rotors([rate], body=1.0) for rate in rates_hz])
    noise = told(white(rng, count, PULSES))
    uav = told(blades * 10 ** (-12 / 20) + white(rng, count, PULSES))
    found = [np.mean(seen > np.quantile(empty, 0.98)) for seen, empty in zip(uav, noise, strict=True)]
    assert found[0] < 0.45
    assert found[1] > 0.6


def test_a_strong_body_line_changes_little():
    rng = np.random.default_rng(3)
    noise = white(rng, PULSES)
    plain, under = (cadence(rotors([58.6], body=body) + noise) for body in (3.0, 300.0))
    strong = plain[0] > 0
    assert np.abs(plain[0] - under[0])[strong].max() < 0.5


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32), rate_hz=st.floats(30, 100), angle=st.floats(0, 6.28))
def test_neither_the_sign_of_the_velocity_nor_the_phase_matters(seed, rate_hz, angle):
    iq = rotors([rate_hz], velocity_mps=5.0) + white(np.random.default_rng(seed), PULSES)
    reference = cadence(iq)
    for changed in (iq.conj(), iq * np.exp(1j * angle)):
        np.testing.assert_allclose(cadence(changed), reference, atol=0.05)


def test_a_scene_of_other_wavelength_and_the_same_doppler_is_the_same():
    """Rates know nothing of the carrier: the notches alone depend on it, and here they are as wide in lines."""
    iq = rotors([58.6]) + white(np.random.default_rng(4), PULSES)
    slow = model_inputs(iq, carrier_hz=CARRIER_HZ / 2, prf_hz=PRF_HZ / 2, names=("cadence",))["cadence"]
    fast = cadence(iq)
    octave = round(np.log(2) / np.log(EDGES_HZ[1] / EDGES_HZ[0]))  # 8.02 bins of the axis
    for one, other in zip(fast[:, octave:], slow[:, :-octave], strict=True):
        told = (one != UNSEEN_DB) & (other != UNSEEN_DB)
        assert np.corrcoef(one[told], other[told])[0, 1] > 0.9


def test_it_is_what_its_definition_says():
    """Every step again in float64, sample by sample and line by line."""
    iq = rotors([58.6, 61.0], velocity_mps=4.0) + 0.7 * white(np.random.default_rng(5), PULSES)
    spectrum = doppler_spectrum(iq, **RADAR, window=HANN)
    mask = notch_mask(spectrum, strongest_bin(spectrum))
    plan = cadence_plan(PULSES, PRF_HZ, HANN)
    window = HANN.taper(PULSES)
    kept = np.fft.ifftshift(mask) * np.fft.fft(np.asarray(iq, np.complex64) * window, spectrum.bins)
    power = np.abs(np.fft.ifft(kept)[plan.span]) ** 2 / window[plan.span] ** 2
    power /= power.mean()
    np.testing.assert_allclose(power_over_time(spectrum, mask), power, rtol=1e-2, atol=1e-3)
    power = np.minimum(power, 16)
    hann = np.hanning(len(power) + 2)[1:-1]
    lines = np.abs(np.fft.rfft((power - power.mean()) * hann)) ** 2 / np.sum(hann**2)
    line_hz = np.arange(len(lines)) * PRF_HZ / len(power)
    found = cadence_db(spectrum, mask)
    for number in range(CADENCE_BINS):
        low_hz, high_hz = EDGES_HZ[number : number + 2]
        middle_hz = np.sqrt(low_hz * high_hz)
        if not PRF_HZ / len(power) <= middle_hz <= PRF_HZ / 2:
            assert (found[:, number] == UNSEEN_DB).all()
            continue
        inside = (line_hz >= low_hz) & (line_hz < high_hz)
        if not inside.any():
            inside[np.argmin(np.abs(line_hz - middle_hz))] = True
        expected = max(np.log(max(inside.sum() / 1.5, 1)) + np.euler_gamma, 1)
        wanted = 10 * np.log10(np.maximum([lines[inside].mean(), lines[inside].max() / expected], 1e-2))
        np.testing.assert_allclose(found[:, number], wanted, atol=0.05)


@pytest.mark.parametrize("iq", [np.zeros(PULSES, complex), np.full(PULSES, 2 - 1j), tone(1234.5)])
def test_a_lone_line_or_silence_has_no_cadence(iq):
    """What rounding leaves outside the notches is no signal; the window's side lobes come and go slowly."""
    assert cadence(iq)[:, cell_of(100, EDGES_HZ) : cell_of(5000, EDGES_HZ)].max() <= -6


def test_one_spoilt_pulse_is_no_flash():
    rng = np.random.default_rng(6)
    iq = white(rng, 100, PULSES)
    spoilt = iq.copy()
    spoilt[np.arange(100), rng.integers(700, PULSES - 700, 100)] += 300
    rise = cadence(spoilt)[:, 0] - cadence(iq)[:, 0]
    assert np.median(rise) < 1.0


@pytest.mark.parametrize(("pulses", "prf_hz"), [(16, 1e5), (64, 1e3), (500, 1e5), (65536, 2e4)])
def test_rates_that_the_dwell_does_not_tell_are_marked(pulses, prf_hz):
    found = cadence(white(np.random.default_rng(7), 5, pulses), prf_hz=prf_hz)
    plan = cadence_plan(pulses, prf_hz, HANN)
    middle_hz = np.sqrt(EDGES_HZ[:-1] * EDGES_HZ[1:])
    told = (middle_hz >= prf_hz / len(plan.hann)) & (middle_hz <= prf_hz / 2)
    np.testing.assert_array_equal((found == UNSEEN_DB).all(axis=(0, 1)), ~told)
    assert told.any() == (prf_hz / len(plan.hann) < EDGES_HZ[-1])
