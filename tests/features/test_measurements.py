"""The four measurements: cepstral chopping, bandwidth, smearing, notch residual, on signals of known answers."""

import numpy as np
import pytest
from bladewing.features import doppler_spectrum
from bladewing.features.bandwidth import energy_band_mps, threshold_band_hz
from bladewing.features.chopping import cepstral_chopping, noise_shape
from bladewing.features.notch import LOBE_BINS, body_line, notch_mask, notch_residual_db, residual, strongest_bin
from bladewing.features.smearing import smearing_index
from bladewing.features.window import HANN, KAISER
from hypothesis import given, settings
from hypothesis import strategies as st

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, tone, white


def measured(iq):
    spectrum = doppler_spectrum(iq, **RADAR)
    body = body_line(spectrum)
    mask = notch_mask(spectrum, body.index)
    return spectrum, body, mask


@settings(max_examples=25, deadline=None)
@given(rate_hz=st.floats(45, 130), velocity_mps=st.floats(-25, 25), seed=st.integers(0, 99))
def test_the_cepstrum_finds_an_off_bin_chopping_frequency(rate_hz, velocity_mps, seed):
    noise = white(np.random.default_rng(seed), PULSES) * 0.1
    spectrum, _, mask = measured(rotors([rate_hz], velocity_mps=velocity_mps) + noise)
    found = cepstral_chopping(spectrum, mask)
    # The period is read off a cepstrum sampled at 1 / PRF and refined: 1 % is 1.5 samples at 230 Hz.
    assert float(found.frequency_hz) == pytest.approx(2 * rate_hz, rel=0.01)
    assert found.strength > 5


def test_noise_and_a_lone_line_have_no_comb():
    rng = np.random.default_rng(0)
    noise, _, mask = measured(white(rng, 200, PULSES))
    strengths = cepstral_chopping(noise, mask).strength
    # Of some 860 periods searched the largest of Rayleigh heights exceeds 4.5 rms in 860 exp(-20) of the records.
    assert strengths.max() < 4.5
    line, _, mask = measured(1000 * tone(1234.0) + white(rng, 50, PULSES))
    assert cepstral_chopping(line, mask).strength.max() < 4.5


def test_no_range_to_search_gives_nan():
    iq = white(np.random.default_rng(0), 2, 16)
    spectrum = doppler_spectrum(iq, carrier_hz=CARRIER_HZ, prf_hz=2e3)
    found = cepstral_chopping(spectrum, notch_mask(spectrum, strongest_bin(spectrum)))
    assert np.isnan(found.frequency_hz).all()
    assert not found.strength.any()


@pytest.mark.parametrize(
    # Types 1-3 and 6 of the paper's table II, off the bin: blade [m], rate [Hz], theory of eq. 26 [Hz].
    ("length_m", "rpm"),
    [(0.15, 3517), (0.30, 3517), (0.15, 7013), (0.075, 3517)],
)
def test_threshold_bandwidth_is_near_eq_26(length_m, rpm):
    rate_hz = rpm / 60
    iq = rotors([rate_hz], length_m=length_m) + 0.03 * white(np.random.default_rng(1), PULSES)
    spectrum, _, _ = measured(iq)
    low, high = threshold_band_hz(spectrum, 30.0)
    theory_hz = 2 * 2 / WAVELENGTH_M * 2 * np.pi * rate_hz * length_m
    # The rule counts lines: it is right to a few chopping frequencies, and the paper's own is 3 % high.
    assert high - low == pytest.approx(theory_hz, abs=0.04 * theory_hz + 5 * 2 * rate_hz)
    assert low < 0 < high


def test_threshold_band_shifts_with_the_body():
    velocity_mps = -20.0
    still, moving = (threshold_band_hz(measured(rotors([58.6], velocity_mps=v))[0], 60.0) for v in (0.0, velocity_mps))
    shift_hz = -2 * velocity_mps / WAVELENGTH_M
    for a, b in zip(still, moving, strict=True):
        # the rule counts lines, so an edge may fall one line further
        assert b - a == pytest.approx(shift_hz, abs=2 * 58.6 + 2 * PRF_HZ / PULSES)


def test_nothing_over_the_threshold_has_no_band():
    low, high = threshold_band_hz(measured(white(np.random.default_rng(0), PULSES))[0], 40.0)
    assert low == high == 0


def test_energy_band_holds_two_lines():
    spectrum, body, mask = measured(100 * tone(0.0) + 10 * tone(3000.0) + 10 * tone(-5000.0) + 0.01 * tone(9.0))
    low, high, occupancy = energy_band_mps(spectrum, residual(spectrum, mask))
    assert low == pytest.approx(-3000 * WAVELENGTH_M / 2, abs=0.5)
    assert high == pytest.approx(5000 * WAVELENGTH_M / 2, abs=0.5)
    assert 0 < occupancy <= 1
    assert body.velocity_mps == pytest.approx(0, abs=0.05)


def test_one_rotor_is_narrow_and_four_unlike_ones_smear():
    rng = np.random.default_rng(4)

    def index(rates_hz):
        noise = 0.1 * white(rng, PULSES)
        spectrum, body, mask = measured(rotors(rates_hz, velocity_mps=rng.uniform(-20, 20)) + noise)
        energy = residual(spectrum, mask)
        return float(smearing_index(spectrum, energy, body, cepstral_chopping(spectrum, mask)))

    ones = [index([rate]) for rate in rng.uniform(55, 60, 12)]
    fours = [index(rate * (1 + 0.03 * np.array([0, 0.35, 0.66, 1]))) for rate in rng.uniform(55, 58, 12)]
    assert max(ones) < min(fours)
    assert np.median(ones) < 0.004
    # Rates 3 % apart at the ends have a relative standard deviation of 1.1 %.
    assert 0.005 < np.median(fours) < 0.025


def test_smearing_without_a_comb_is_not_a_number():
    spectrum, body, mask = measured(100 * tone(0.0))
    nothing = np.zeros_like(spectrum.relative_power)
    assert np.isnan(smearing_index(spectrum, nothing, body, cepstral_chopping(spectrum, mask)))


def test_the_notch_takes_the_body_and_rest_and_nothing_else():
    velocity_mps = 15.0
    spectrum, _, mask = measured(1000 * tone(-2 * velocity_mps / WAVELENGTH_M) + 500)
    velocity = spectrum.velocity_mps
    assert not mask[abs(velocity) < 2.9].any()
    assert not mask[abs(velocity - velocity_mps) < 2.7].any()
    sided = np.arange(spectrum.bins) >= (spectrum.bins + 1) % 2  # half the PRF is on neither side
    assert mask[sided & (abs(velocity) > 3.4) & (abs(velocity - velocity_mps) > 3.4)].all()


def test_the_notch_is_as_wide_as_the_main_lobe_at_coarse_resolution():
    iq = white(np.random.default_rng(0), 128)
    spectrum = doppler_spectrum(iq, carrier_hz=3e9, prf_hz=20e3)
    mask = notch_mask(spectrum, strongest_bin(spectrum))
    centre = spectrum.bins // 2
    assert not mask[centre - LOBE_BINS : centre + LOBE_BINS + 1].any()


def test_notch_residual_is_the_power_outside_the_notch():
    rng = np.random.default_rng(7)
    noise, _, mask = measured(white(rng, 100, PULSES))
    assert np.median(notch_residual_db(noise, mask)) == pytest.approx(0, abs=0.4)
    for snr_db in (0, 10, 20):
        blades = rotors([58.6], body=0.0) * 10 ** (snr_db / 20)
        spectrum, _, mask = measured(blades + white(rng, PULSES) + 300)
        # Rotor power spreads over +-55 m/s of +-266 m/s; what the notches take of it is under 1 dB.
        expected = 10 * np.log10(1 + 10 ** (snr_db / 10))
        assert float(notch_residual_db(spectrum, mask)) == pytest.approx(expected, abs=1.3)


@pytest.mark.parametrize("window", [HANN, KAISER])
def test_the_cepstrum_of_noise_is_as_high_as_is_told_at_every_period(window):
    pulses, records = 128, 40_000
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((records, 2 * pulses)).view(complex)
    power = np.abs(np.fft.fft(noise * window.taper(pulses))) ** 2
    seen = np.mean(np.abs(np.fft.rfft(np.log(power) + np.euler_gamma)) ** 2, axis=0)[1:]  # 0 holds the mean itself
    told = noise_shape(pulses, pulses, window)[1:] ** 2
    ratio = (seen / told).reshape(-1, 8).mean(axis=1)
    # a mean square of exponentials, eight neighbouring periods together, of which two are alike
    np.testing.assert_allclose(ratio / ratio.mean(), 1, atol=5 / np.sqrt(records * 4))
