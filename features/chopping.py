"""The chopping frequency from the cepstrum: lines a chopping frequency apart are one peak at its period."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .spectrum import Spectrum

#: Range in which a chopping frequency is sought [Hz]: a slow main rotor to a small propeller of four blades.
CHOPPING_RANGE_HZ = (18.0, 1600.0)

#: Lines nearer than this cannot be told apart behind the window [bins].
MIN_SPACING_BINS = 3.5

#: A peak at a multiple of the period is passed over for one at the period itself if that has this share of it.
FUNDAMENTAL_SHARE = 0.6

#: Lines stand out of the spectrum by no more than this [dB], so that one strong line does not become the cepstrum.
CLIP_DB = 30.0


@dataclass(frozen=True)
class Chopping:
    """Cepstral estimate of the chopping frequency.

    Parameters
    ----------
    frequency_hz : ndarray of float32, shape (...)
        Chopping frequency [Hz]; NaN where the dwell holds no range to search.
    strength : ndarray of float32, shape (...)
        Height of its peak over the rms of the cepstrum in the range searched [1]; about 3 for noise.
    repeats : ndarray of float32, shape (...)
        Mean height at two and three times the period over the height at the period [1]: a comb of narrow lines repeats.
    """

    frequency_hz: NDArray[np.float32]
    strength: NDArray[np.float32]
    repeats: NDArray[np.float32]


def cepstrum(spectrum: Spectrum, mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Magnitude of the cepstrum of the notched, floored log spectrum, shape (..., bins // 2 + 1).

    Index k is a period of k / PRF. Both signs of Doppler count, and a one-sided comb is one too, hence the magnitude.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool, shape (..., bins)
        True where the spectrum counts.

    Returns
    -------
    ndarray of float32
        In dB of ripple amplitude.
    """
    level = np.clip(spectrum.level_db, 0, np.float32(CLIP_DB))
    count = np.maximum(mask.sum(axis=-1, keepdims=True), 1)
    mean = np.where(mask, level, np.float32(0)).sum(axis=-1, keepdims=True) / count
    ripple = np.where(mask, level - mean.astype(np.float32), np.float32(0))
    transform = fft.rfft(ripple, axis=-1)
    return np.hypot(transform.real, transform.imag) * np.float32(2 / spectrum.bins)


def cepstral_chopping(spectrum: Spectrum, mask: NDArray[np.bool_]) -> Chopping:
    """Estimate the chopping frequency (the paper's eq. 25) from the cepstrum.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool, shape (..., bins)
        From `notch_mask`: the body line must not take part.

    Returns
    -------
    Chopping
        An estimate is always given where there is a range to search; `strength` says whether to believe it.
    """
    heights = cepstrum(spectrum, mask)
    shape = heights.shape[:-1]
    low, high = CHOPPING_RANGE_HZ
    first = max(2, int(np.ceil(spectrum.prf_hz / high)))
    last = int(min(spectrum.prf_hz / low, spectrum.bins / MIN_SPACING_BINS))
    if last - first < 4:
        nothing = np.zeros(shape, np.float32)
        return Chopping(np.full(shape, np.nan, np.float32), nothing, nothing)
    flat = heights.reshape(-1, heights.shape[-1])
    rows = np.arange(len(flat))
    window = flat[:, first : last + 1]
    rms = np.sqrt(np.mean(window**2, axis=-1))
    peak = window.max(axis=-1)
    top = first + window.argmax(axis=-1)
    best = top.copy()
    for divisor in (2, 3, 4):  # the smallest strong one wins, so later divisors overrule
        near = np.rint(top / divisor).astype(np.intp)
        around = np.stack([flat[rows, np.clip(near + shift, 0, flat.shape[1] - 1)] for shift in (-1, 0, 1)])
        ok = (near >= first) & (around.max(axis=0) >= FUNDAMENTAL_SHARE * peak)
        best = np.where(ok, near - 1 + around.argmax(axis=0), best)
    best = np.clip(best, 1, flat.shape[1] - 2)
    left, middle, right = (flat[rows, best + shift] for shift in (-1, 0, 1))
    curve = 2 * middle - left - right
    offset = np.where(curve > 0, (right - left) / np.where(curve > 0, 2 * curve, 1), 0)
    period = best + np.clip(offset, -0.5, 0.5)
    again = [flat[rows, np.minimum(np.rint(n * period).astype(np.intp), flat.shape[1] - 1)] for n in (2, 3)]
    strength = middle / np.where(rms > 0, rms, 1)
    repeats = (again[0] + again[1]) / 2 / np.where(middle > 0, middle, 1)
    frequency = (spectrum.prf_hz / period).astype(np.float32)
    frequency = np.where(rms > 0, frequency, np.float32(np.nan))
    return Chopping(
        frequency.reshape(shape), strength.astype(np.float32).reshape(shape), repeats.astype(np.float32).reshape(shape)
    )
