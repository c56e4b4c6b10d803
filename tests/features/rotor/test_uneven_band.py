"""Receivers whose band is not flat: what their noise does past a rotor's lines must not pass for more of them."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.measure_record import ONE_CHANNEL
from bladewing.features.one_channel import half_empty, made_analytic, one_channel
from scipy.signal import hilbert

from ..signals import PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, white

SEEDS = 6


def bell(fall_db: float) -> np.ndarray:
    """Amplitudes of a band that falls smoothly by so much from its middle to its ends, in FFT order."""
    return 10 ** (-fall_db / 20 * np.sin(np.pi * np.fft.fftfreq(PULSES)) ** 2)


def hump(height_db: float) -> np.ndarray:
    """Amplitudes of a band with a swell of so much half way out, on either side."""
    return 10 ** (height_db / 20 * np.exp(-(((np.abs(np.fft.fftfreq(PULSES)) - 0.25) / 0.06) ** 2)))


def tips(band: np.ndarray, apart_rpm: float, snr_db: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """Tips of two rotors over the faster one's, and how many of them their deviations are, shape (SEEDS,) each."""
    iq, truth = [], []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        rpm = rng.uniform(3300, 3600) + np.array([0.0, apart_rpm])
        echo = 10 ** (snr_db / 20) * rotors(rpm / 60, velocity_mps=rng.uniform(-10, 10)) + white(rng, PULSES)
        iq.append(np.fft.ifft(np.fft.fft(echo) * band))
        truth.append(2 * np.pi * rpm[1] / 60 * 0.15)
    found = measure(np.array(iq), **RADAR, beta_rad=0.0)
    assert not found.rotors_resolved.all()
    return found.tip_speed_mps / truth - 1, (found.tip_speed_mps - truth) / found.tip_speed_mps_std


@pytest.mark.parametrize("apart_rpm", [3.0, 6.0])
@pytest.mark.parametrize("band", [bell(0.0), bell(12.0), bell(25.0), hump(6.0)], ids=["flat", "12 dB", "25 dB", "hump"])
def test_the_tips_of_rotors_that_are_not_told_apart_stand_in_any_band(band, apart_rpm):
    error, normalised = tips(band, apart_rpm)
    assert np.isfinite(error).all()
    # noise that falls outwards passed for lines up to where it was lowest, the span's end: tips a third too fast
    assert np.abs(error).max() < 0.06
    assert np.median(np.abs(normalised)) < 2


@pytest.mark.parametrize("velocity_mps", [-4.0, 0.0, 12.0])
def test_one_channel_made_analytic_has_no_band(velocity_mps):
    """Both sides of the body lie on one side of the spectrum: a tip came out a third too slow, 0.1 % stated."""
    rng = np.random.default_rng(3)
    both = rotors([57.3], velocity_mps=velocity_mps) * 3 + white(rng, PULSES)
    folded = hilbert(both.real)
    found = measure(np.array([both, folded]), **RADAR, blades=2)
    assert np.isfinite(found.tip_speed_mps).tolist() == [True, False]
    assert np.isnan([found.bandwidth_hz[1], found.tip_speed_mps_std[1], found.blade_length_m[1]]).all()
    assert found.band_reason.tolist() == ["", ONE_CHANNEL]
    assert found.chopping_hz == pytest.approx(114.6, rel=0.01)
    # nothing is even about the body any more: its own line tells, whose side is anyone's guess
    assert np.abs(found.body_velocity_mps) == pytest.approx(abs(velocity_mps), abs=0.05)


@pytest.mark.parametrize("velocity_mps", [-8.0, 5.0])
@pytest.mark.parametrize("channel", [1.0, 1j, 1 - 1j], ids=["I alone", "Q alone", "I and Q alike"])
@pytest.mark.parametrize("gain", [1e-18, 1.0, 1e36])
def test_one_channel_is_measured_as_if_made_analytic(velocity_mps, channel, gain):
    """A body at -15 m/s came out at rest, the band a half too wide, tips with a deviation of 1 %."""
    both = 3 * rotors([57.3], velocity_mps=velocity_mps) + white(np.random.default_rng(3), PULSES)
    given = np.stack([gain * channel * both.real, both])
    found = measure(given, **RADAR, blades=2)
    assert one_channel(given.astype(np.complex64)).tolist() == [True, False]
    assert found.band_reason.tolist() == [ONE_CHANNEL, ""]
    assert np.isnan([found.bandwidth_hz[0], found.tip_speed_mps[0]]).all()
    assert np.abs(found.body_velocity_mps[0]) == pytest.approx(abs(velocity_mps), abs=0.05)
    assert found.chopping_hz[0] == pytest.approx(114.6, rel=0.01)
    made = measure(hilbert(both.real), **RADAR, blades=2)
    assert found.chopping_hz[0] == pytest.approx(float(made.chopping_hz), rel=1e-4)


@pytest.mark.parametrize("offset", [3j, -1e-3j])
def test_a_channel_that_its_converter_holds_off_zero_is_none(offset):
    """Its sides alike, a rotor came out as four that were not told apart, with a blade a quarter too long."""
    both = 3 * rotors([57.3], velocity_mps=5.0) + white(np.random.default_rng(3), PULSES)
    given = np.stack([both.real + offset, both.real + 0j, 1j * both.real - offset.imag]).astype(np.complex64)
    assert one_channel(given).all()
    found = measure(given, **RADAR, blades=2)
    assert found.band_reason.tolist() == [ONE_CHANNEL] * 3
    np.testing.assert_array_equal(found.chopping_hz, found.chopping_hz[1])


@pytest.mark.parametrize("body_db", [26.0, 50.0, 60.0])
def test_a_strong_body_leaves_one_channel_its_comb(body_db):
    """What jumps from a record's end to its beginning hid all lines: a comb in 4 of 24 at 60 dB."""
    right, body = 0, 10 ** (body_db / 20)
    for seed in range(8):
        rng = np.random.default_rng(seed)
        both = 4 * rotors([57.3], velocity_mps=-4.0, body=body / 4) + white(rng, PULSES)
        right += abs(measure(both.real + 0j, **RADAR, blades=2).chopping_hz / 114.6 - 1) < 0.01
    assert right >= 6


def test_what_stands_still_is_no_single_channel():
    """A strong line at rest, or one so slow that it hardly turns, is nearly a straight one in I and Q, not quite."""
    noise, slow = white(np.random.default_rng(5), PULSES), np.exp(2j * np.pi * 1e-6 * np.arange(PULSES))
    two_blades = rotors([57.3]).real
    records = [1000 + noise, 1000 * slow + noise, 1e4 * slow, np.exp(0.7j) * two_blades, 0 * noise]
    assert not one_channel(np.array(records, np.complex64)).any()
    records = np.array([*records, two_blades], np.complex64)
    assert one_channel(records)[-1]  # but without any noise: nobody recorded that
    assert made_analytic(records) is records


@pytest.mark.parametrize("velocity_mps", [0.3, 2.0, 4.0, -5.0, 9.0])
@pytest.mark.parametrize("blades", [2, 3])
def test_one_channel_has_the_chopping_frequency_and_no_fraction_of_it(velocity_mps, blades):
    """About the body's mirror image lies a second comb: every third line of a third of the spacing was one of these."""
    right = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        iq = rotors([61.3], velocity_mps=velocity_mps, amplitudes=np.ones(blades), body=10.0) * 5 + white(rng, PULSES)
        found = measure(hilbert(iq.real), **RADAR)
        right += abs(found.chopping_hz / (61.3 * blades) - 1) < 0.01
    assert right >= 5  # before, in some of these places none


@pytest.mark.parametrize("away", [0.31, -0.31])
def test_a_fast_body_whose_lines_all_lie_on_one_side_is_no_single_channel(away):
    rng = np.random.default_rng(8)
    velocity_mps = away * PRF_HZ * WAVELENGTH_M / 2
    iq = 30 * rotors([61.3], velocity_mps=velocity_mps, length_m=0.1) + white(rng, PULSES)
    found = measure(iq, **RADAR, blades=2, beta_rad=0.0)
    assert found.band_reason == ""
    assert found.blade_length_m == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize("bins", [1, 2, 7, 8, 64, 4096])
def test_a_side_is_empty_only_if_all_of_it_is(bins):
    power = np.random.default_rng(bins).exponential(size=(6, bins)).astype(np.float32)
    assert not half_empty(power).any()
    power[..., : bins // 2] *= np.float32(1e-6)
    assert half_empty(power).all() == (bins >= 64)
    assert half_empty(power[:, ::-1]).all() == (bins >= 64)
    if bins >= 64:
        power[::2, bins // 4] = 1.0  # one line is enough to show that it is not
        assert half_empty(power).tolist() == [False, True] * 3
        assert half_empty(power[1]) == half_empty(power)[1]


@pytest.mark.parametrize("passed", [0.75, 0.8, 0.9])
def test_past_a_receivers_filter_there_is_no_noise_to_compare_with(passed):
    """Decimation leaves the ends of the span empty: the noise within stood out, and tips were four times too fast."""
    iq, rng = [], np.random.default_rng(2)
    for _ in range(4):
        echo = rotors([rng.uniform(55, 60)], velocity_mps=3.3) * 3 + white(rng, PULSES)
        iq.append(np.fft.ifft(np.fft.fft(echo) * (np.abs(np.fft.fftfreq(PULSES)) < passed / 2)))
    found = measure(np.array(iq), **RADAR, blades=2, beta_rad=0.0)
    assert found.rotors_resolved.all()
    np.testing.assert_allclose(found.blade_length_m, 0.15, rtol=0.02)
