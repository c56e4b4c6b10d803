import numpy as np
import pytest
from bladewing.features import doppler_spectrum
from bladewing.features.notch import body_line
from bladewing.features.samples import unit_scale
from bladewing.features.spectrum import centred_power, noise_floor
from bladewing.features.window import HANN, KAISER
from hypothesis import given, settings
from hypothesis import strategies as st

from .signals import PRF_HZ, RADAR, WAVELENGTH_M, tone, white


@pytest.mark.parametrize("window", [HANN, KAISER])
@pytest.mark.parametrize("pulses", [64, 101, 1000, 3000, 4099])
def test_noise_of_unit_power_has_mean_one_and_floor_one(pulses, window):
    rng = np.random.default_rng(pulses)
    records = 40_000 // pulses + 20
    spectrum = doppler_spectrum(white(rng, records, pulses), **RADAR, window=window)
    values = records * pulses / window.noise_bandwidth_bins
    mean = centred_power(white(rng, records, pulses).astype(np.complex64), pulses, window=window).mean()
    assert mean == pytest.approx(1, abs=5 / np.sqrt(values))
    # The floor is a lower quartile of block means, the larger of two sides: within 1 dB even of 64 pulses.
    assert np.median(10 * np.log10(spectrum.floor)) == pytest.approx(0, abs=1.0)


@pytest.mark.parametrize("window", [HANN, KAISER])
@pytest.mark.parametrize(
    ("pulses", "most_db"), [(64, 0.6), (128, 0.3), (256, 0.3), (500, 0.3), (1000, 0.1), (3000, 0.1)]
)
def test_the_floor_of_noise_is_hardly_biased(pulses, most_db, window):
    rng = np.random.default_rng(pulses)
    records = 600_000 // pulses
    floor = doppler_spectrum(white(rng, records, pulses), **RADAR, window=window).floor
    # the deviation of a record's floor is 1.5 dB of 64 pulses and falls with their root: 0.02 dB of the mean
    assert abs(10 * np.log10(floor.mean())) < most_db


@given(frequency_hz=st.floats(-17e3, 17e3))
@settings(max_examples=50, deadline=None)
def test_a_line_is_found_where_it_is(frequency_hz):
    spectrum = doppler_spectrum(tone(frequency_hz), **RADAR)
    body = body_line(spectrum)
    # 2 % of a bin of 11.7 Hz
    assert float(body.velocity_mps) == pytest.approx(
        -frequency_hz * WAVELENGTH_M / 2, abs=0.02 * 11.7 * WAVELENGTH_M / 2
    )


def test_a_receding_body_has_a_negative_doppler_and_a_positive_velocity():
    times_s = np.arange(2000) / PRF_HZ
    iq = np.exp(-4j * np.pi * 20.0 * times_s / WAVELENGTH_M)  # range grows by 20 m/s
    spectrum = doppler_spectrum(iq, **RADAR)
    top = spectrum.relative_power.argmax()
    assert spectrum.frequency_hz[top] == pytest.approx(-2 * 20 / WAVELENGTH_M, abs=PRF_HZ / 2000)
    assert spectrum.velocity_mps[top] == pytest.approx(20, abs=0.3)


@pytest.mark.parametrize("gain", [1e-37, 1e-20, 1e-3, 7.0, 1e15, 1e37])
def test_gain_does_not_matter(gain):
    iq = white(np.random.default_rng(3), 2, 500) + 5 * tone(1000.0, 500)
    reference = doppler_spectrum(iq, **RADAR)
    scaled = doppler_spectrum((iq * gain).astype(np.complex64), **RADAR)
    np.testing.assert_allclose(scaled.level_db, reference.level_db, atol=2e-3)


def test_a_gain_of_a_power_of_two_changes_no_bit():
    iq = white(np.random.default_rng(3), 500).astype(np.complex64)
    a, b = doppler_spectrum(iq, **RADAR), doppler_spectrum(iq * np.float32(2.0**-40), **RADAR)
    np.testing.assert_array_equal(a.relative_power, b.relative_power)


@given(exponent=st.integers(-120, 120))
def test_unit_scale_is_the_power_of_two_that_normalises(exponent):
    iq = np.array([[0.7 + 0.1j, -0.2j]], np.complex64) * np.float32(2.0**exponent)
    scaled = iq * unit_scale(iq)
    assert 0.5 <= max(abs(scaled.real).max(), abs(scaled.imag).max()) < 1


def test_the_floor_ignores_a_band_of_lines_and_an_empty_side():
    rng = np.random.default_rng(5)
    noise = white(rng, 3000)
    lines = sum(30 * tone(f) for f in range(-6000, 6001, 117))
    assert 10 * np.log10(doppler_spectrum(noise + lines, **RADAR).floor) == pytest.approx(0, abs=0.8)
    analytic = np.fft.fft(noise.real)
    analytic[1501:] = 0
    one_sided = np.fft.ifft(2 * analytic)
    # All the power (2 x 1/2 x 2) of the real part now stands on one side: a floor of 2, not of the empty side's 0.
    assert 10 * np.log10(doppler_spectrum(one_sided, **RADAR).floor) == pytest.approx(3.0, abs=0.8)


@pytest.mark.parametrize("window", [HANN, KAISER])
@pytest.mark.parametrize(("by_db", "floor"), [(0, 1.0), (3, 0.75), (10, 1.0), (20, 1.0), (25, 1.0), (60, 1.0)])
def test_the_floor_is_the_mean_of_like_sides_and_that_of_the_fuller_one_of_unlike_sides(window, by_db, floor):
    sides = np.fft.fft(white(np.random.default_rng(4), 40, 2048))
    sides[:, 1024:] *= 10 ** (-by_db / 20)
    power = centred_power(np.fft.ifft(sides).astype(np.complex64), window=window)
    assert noise_floor(power, window).mean() == pytest.approx(floor, rel=0.03)


def test_noise_floor_is_monotone_in_the_power():
    power = np.random.default_rng(1).exponential(size=(4, 512)).astype(np.float32)
    np.testing.assert_allclose(noise_floor(power * 8, HANN), noise_floor(power, HANN) * 8)


def test_an_all_zero_record_has_no_floor_and_no_power():
    spectrum = doppler_spectrum(np.zeros((2, 64), complex), **RADAR)
    assert not spectrum.floor.any()
    assert not spectrum.relative_power.any()


def test_batch_equals_loop():
    iq = white(np.random.default_rng(2), 3, 4, 250)
    batch = doppler_spectrum(iq, **RADAR)
    for i in np.ndindex(3, 4):
        one = doppler_spectrum(iq[i], **RADAR)
        np.testing.assert_allclose(batch.relative_power[i], one.relative_power, rtol=2e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("iq", "radar", "match"),
    [
        (np.ones(1, complex), RADAR, "at least 2 pulses"),
        (np.ones(9, complex), RADAR | {"prf_hz": 0}, "prf_hz"),
        (np.ones(9, complex), RADAR | {"carrier_hz": np.nan}, "carrier_hz"),
        (np.ones(9), RADAR, "samples must be complex"),
        (np.ma.array(np.ones(9, complex), mask=np.arange(9) == 3), RADAR, "masked samples"),
    ],
)
def test_impossible_input_is_refused(iq, radar, match):
    with pytest.raises(ValueError, match=match):
        doppler_spectrum(iq, **radar)


@pytest.mark.parametrize("gain", [1e-30, 1e-9, 1.0, 1e9, 1e25])
def test_a_record_is_the_same_whatever_stands_beside_it(gain):
    """Faint or loud neighbours make a batch that is scaled first: a power of two, so no digit changes."""
    iq = white(np.random.default_rng(4), 2, 500).astype(np.complex64)
    alone = doppler_spectrum(iq[0], **RADAR)
    beside = doppler_spectrum(np.stack([iq[0], iq[1] * np.float32(gain)]), **RADAR)
    np.testing.assert_array_equal(beside.relative_power[0], alone.relative_power)
    np.testing.assert_array_equal(beside.transform[0], alone.transform)
    assert beside.scale[0] == alone.scale
    np.testing.assert_array_equal(beside.floor[0], alone.floor)
