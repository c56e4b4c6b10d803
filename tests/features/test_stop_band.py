"""Outer ends of the spectrum that a filter took out: found, filled as high as within, and told from a rotor's band."""

import numpy as np
import pytest
from bladewing.features import model_inputs
from bladewing.features.spectrum import Spectrum, doppler_spectrum
from bladewing.features.stop_band import MOST_BLOCKS, filled_ends
from bladewing.features.window import HANN
from bladewing.simulate import Radar, draw_records
from scipy import signal

from .signals import RADAR, rotors, white


def spectrum_of(iq: np.ndarray) -> Spectrum:
    """What models read."""
    return doppler_spectrum(iq, **RADAR, window=HANN)


def filtered(iq: np.ndarray, share: float) -> np.ndarray:
    """Samples behind a low pass that leaves so much of the span, without its ends."""
    taps = signal.firwin(201, share)
    return signal.fftconvolve(iq, taps[None], mode="valid", axes=-1).astype(np.complex64)


def records(seed: int, pulses: int = 2048, count: int = 6) -> np.ndarray:
    """White noise of unit power and a moving line, some records of it."""
    rng = np.random.default_rng(seed)
    line = 10 * np.exp(2j * np.pi * 0.03 * np.arange(pulses + 200))
    return white(rng, count * (pulses + 200)).reshape(count, -1) + line


@pytest.mark.parametrize("share", [0.9, 0.75, 0.5, 0.3])
@pytest.mark.parametrize("pulses", [513, 1024, 2048, 9001])
@pytest.mark.parametrize("gain", [1.0, 1e-25j])
def test_what_a_filter_took_out_is_filled_as_high_as_it_is_within(share: float, pulses: int, gain: complex) -> None:
    iq = filtered(records(pulses, pulses), share) * np.complex64(gain)
    spectrum = spectrum_of(iq)
    rows, filled = filled_ends(iq, spectrum)
    assert len(rows) >= (5 if pulses > 1000 else 3)  # of short ones blocks of few bins are not always alike
    after = spectrum_of(filled)
    away = np.abs(after.frequency_hz) / (RADAR["prf_hz"] / 2)
    past = min(share + 1 / min(MOST_BLOCKS, pulses // 32), 0.95)  # noise begins with a block
    beyond, within = (np.median(after.relative_power[:, part]) for part in (away > past, (away > 0.1) & (away < share)))
    # one noise fills all records, and of a short one few of its bins lie there
    assert beyond / within == pytest.approx(1.0, abs=0.25 if pulses > 2000 else 0.6)
    narrow = away < share - 4 / min(MOST_BLOCKS, pulses // 32)  # as many blocks as there are
    before = np.abs(spectrum.transform[rows][:, narrow] / spectrum.scale[rows])
    np.testing.assert_allclose(
        np.abs(after.transform[:, narrow] / after.scale), before, atol=0.05 * float(before.mean())
    )
    for row, one in zip(rows, filled, strict=True):  # each as if it were alone
        alone, same = filled_ends(iq[row : row + 1], spectrum_of(iq[row : row + 1]))
        assert list(alone) == [0]
        np.testing.assert_allclose(same[0], one, rtol=1e-5, atol=1e-6 * float(np.abs(one).max()))


def test_whole_spectra_are_left_as_they_are() -> None:
    noise = records(1)
    tone = np.exp(2j * np.pi * 0.1 * np.arange(2048))[None]
    rotor = np.stack([rotors([59.3], length_m=0.2) + 0.01 * white(np.random.default_rng(2), 3000) for _ in range(2)])
    for whole in (noise, noise.real + 0j, tone, np.ones((1, 2048)), np.zeros((2, 2048)), rotor, noise[:, :200]):
        iq = np.ascontiguousarray(whole, np.complex64)
        rows, filled = filled_ends(iq, spectrum_of(iq))
        assert not len(rows)
        assert filled.shape == (0, iq.shape[-1])


def test_the_band_of_a_rotor_is_left_as_it_is() -> None:
    """Of 640 records at two radars one in four hundred UAVs is filled at most, where its blades hardly flash."""
    fired = 0
    for carrier_hz, prf_hz, pulses in ((9.85e9, 25e3, 2048), (24e9, 60e3, 1500)):
        drawn = draw_records(Radar(carrier_hz, prf_hz, pulses), 320, 5, purpose="bench")
        rows, _ = filled_ends(drawn.iq, doppler_spectrum(drawn.iq, carrier_hz=carrier_hz, prf_hz=prf_hz, window=HANN))
        fired += len(rows)
    assert fired <= 4


@pytest.mark.parametrize("share", [0.75, 0.5])
def test_ends_of_one_channel_are_filled_before_it_is_made_analytic(share: float) -> None:
    """One side alone tells nothing of them: noise so filtered was UAV in 39 of 40."""
    noise = white(np.random.default_rng(4), 6 * 2248).reshape(6, -1)
    levels, whole = (
        model_inputs(one.real.astype(np.complex64), **RADAR, names=("levels",))["levels"][:, 0]
        for one in (filtered(noise, share), noise[:, :2048])
    )
    assert np.abs(levels - whole).mean() < 1.5
    assert np.abs(levels - whole).max() < 12.0  # next to nothing was 20 below and more
