import numpy as np
import pytest
from bladewing.features.stft import (
    HERM_WINDOW_S,
    PAPER_SETTINGS,
    cadence_velocity,
    cepstrogram,
    flash_bandwidth_hz,
    flash_period_s,
    herm_lines_db,
    stft,
)
from scipy.signal import ShortTimeFFT
from scipy.signal.windows import hann

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, tone, white

RATE_HZ = 57.7


@pytest.fixture(scope="module")
def drone():
    return rotors([RATE_HZ]) + 0.05 * white(np.random.default_rng(1), PULSES)


def test_the_power_is_that_of_scipys_stft():
    iq = white(np.random.default_rng(2), 500).astype(np.complex64)
    ours = stft(iq, **RADAR, window_s=40 / PRF_HZ, overlap=0.75)
    theirs = ShortTimeFFT(hann(40, sym=False), ours.hop, PRF_HZ, fft_mode="centered")
    whole = theirs.stft(iq, p0=2, p1=2 + ours.power.shape[-2])
    np.testing.assert_allclose(ours.power, np.abs(whole.T) ** 2, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(("window_s", "overlap"), [(4e-3, 1.0), (4e-3, -0.1), (1e-6, 0.5), (1.0, 0.5)])
def test_bad_settings_are_refused(window_s, overlap):
    with pytest.raises(ValueError, match=r"overlap|window_s"):
        stft(np.ones(PULSES, complex), **RADAR, window_s=window_s, overlap=overlap)


@pytest.mark.parametrize("blades", [1, 2, 3])
def test_flashes_are_a_chopping_period_apart(blades):
    frames = stft(rotors([RATE_HZ], amplitudes=(1.0,) * blades, velocity_mps=-7.0), **RADAR, window_s=1e-3)
    assert 1 / flash_period_s(frames) == pytest.approx(blades * RATE_HZ, rel=0.005)


def test_the_band_is_that_of_the_tips():
    frames = stft(rotors([RATE_HZ]) + 1e-2 * white(np.random.default_rng(3), PULSES), **RADAR)
    theory_hz = 8 * np.pi * RATE_HZ * 0.15 / WAVELENGTH_M
    # the window's lobe is two bins to each side
    assert flash_bandwidth_hz(frames) == pytest.approx(theory_hz, abs=4.5 * PRF_HZ / frames.power.shape[-1])


@pytest.mark.parametrize(("window_s", "overlap"), PAPER_SETTINGS)
def test_neither_noise_nor_silence_nor_a_line_flashes(window_s, overlap):
    rng = np.random.default_rng(4)
    iq = np.concatenate([white(rng, 6, PULSES), np.zeros((1, PULSES)), tone([1234.5]) + 0.01 * white(rng, 1, PULSES)])
    frames = stft(iq, **RADAR, window_s=window_s, overlap=overlap)
    assert np.isnan(flash_period_s(frames)).all()
    assert (flash_bandwidth_hz(frames)[:7] == 0).all()
    assert np.isfinite(cadence_velocity(frames)[0]).all()
    assert np.isfinite(cepstrogram(frames)[0]).all()


def test_the_cadence_of_a_swinging_line_is_its_own():
    times_s = np.arange(PULSES) / PRF_HZ
    iq = tone(4000.0) * (1 + 0.5 * np.cos(2 * np.pi * 58.0 * times_s))
    frames = stft(iq, **RADAR)
    diagram, cadence_hz = cadence_velocity(frames)
    row, column = np.unravel_index(diagram.argmax(), diagram.shape)
    assert cadence_hz[row] == pytest.approx(58.0, abs=cadence_hz[1])
    assert frames.frequency_hz[column] == pytest.approx(4000.0, abs=PRF_HZ / frames.power.shape[-1])
    assert cadence_velocity(stft(tone(4000.0), **RADAR))[0].max() < 1e-4


def test_a_comb_is_a_cepstral_peak_at_its_period():
    comb = sum(tone(200.0 * n + 37.0) for n in range(-40, 41)) + 0.1 * white(np.random.default_rng(5), PULSES)
    heights, period_s = cepstrogram(stft(comb, **RADAR, window_s=HERM_WINDOW_S))
    searched = period_s > 1e-3
    peaks = period_s[searched][heights[:, searched].argmax(axis=-1)]
    ratio = peaks * 200.0
    np.testing.assert_allclose(ratio, np.rint(ratio), atol=0.02)
    assert np.median(ratio) == pytest.approx(1, abs=0.02)


def test_herm_lines_stand_at_the_chopping_frequency(drone):
    frames = stft(drone, **RADAR, window_s=HERM_WINDOW_S, overlap=0.9)
    level = herm_lines_db(frames)

    def at(frequency_hz):
        return level[np.abs(frames.frequency_hz[:, None] - frequency_hz).argmin(axis=0)]

    orders = np.arange(3, 15) * 2 * RATE_HZ
    assert at(orders).mean() > at(orders + RATE_HZ).mean() + 10


def test_a_batch_is_a_loop(drone):
    batch = np.stack([drone, white(np.random.default_rng(6), PULSES)])[:, None]
    together = stft(batch, **RADAR)
    for index in range(2):
        alone = stft(batch[index, 0], **RADAR)
        np.testing.assert_allclose(together.power[index, 0], alone.power, rtol=1e-6)
        np.testing.assert_allclose(flash_period_s(together)[index, 0], flash_period_s(alone), rtol=1e-6)
        np.testing.assert_allclose(flash_bandwidth_hz(together)[index, 0], flash_bandwidth_hz(alone))
        np.testing.assert_allclose(cadence_velocity(together)[0][index, 0], cadence_velocity(alone)[0], atol=1e-6)
        np.testing.assert_allclose(cepstrogram(together)[0][index, 0], cepstrogram(alone)[0], atol=1e-4)
        np.testing.assert_allclose(herm_lines_db(together)[index, 0], herm_lines_db(alone), atol=1e-4)


def test_gain_phase_and_scale_do_not_matter(drone):
    frames = stft(drone, **RADAR)
    louder = stft(300 * drone * np.exp(0.7j), **RADAR)
    assert flash_period_s(louder) == pytest.approx(flash_period_s(frames), rel=1e-4)
    assert flash_bandwidth_hz(louder) == flash_bandwidth_hz(frames)
    scaled = stft(drone, carrier_hz=2 * CARRIER_HZ, prf_hz=2 * PRF_HZ, window_s=2e-3)
    assert 2 * flash_period_s(scaled) == pytest.approx(flash_period_s(frames), rel=1e-6)
    assert flash_bandwidth_hz(scaled) == pytest.approx(2 * flash_bandwidth_hz(frames))
    backwards = stft(drone[::-1], **RADAR)
    assert flash_period_s(backwards) == pytest.approx(flash_period_s(frames), rel=1e-3)
