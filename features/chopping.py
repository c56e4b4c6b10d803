"""The chopping frequency from the cepstrum: lines a chopping frequency apart are one peak at its period."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from .fast import at_least, sums
from .notch import Mask, parabola_offset, weights
from .spectrum import Spectrum, bins_alike
from .window import Window

#: Range in which a chopping frequency is sought [Hz]: a slow main rotor to a small propeller of four blades.
CHOPPING_RANGE_HZ = (18.0, 1600.0)

#: Lines nearer to each other than this cannot be told apart through the window [bins].
MIN_SPACING_BINS = 3.5

#: The best peak may be at a multiple of the period. It gives way to a peak at a fraction of its period that has at
#: least FUNDAMENTAL_SHARE of its height and FUNDAMENTAL_STRENGTH times the rms of noise. (Unlike rotor rates blur the
#: high orders, and with them the first peak.)
FUNDAMENTAL_SHARE, FUNDAMENTAL_STRENGTH = 0.4, 3.5

#: A period's score is its own peak plus REPEAT_SHARE of the peak at twice the period (a comb repeats, a ripple of the
#: band's envelope does not), times the period to the power LENGTH_POWER: such ripples crowd the short periods.
REPEAT_SHARE, LENGTH_POWER = 0.5, 0.15

#: Levels are clipped this far over the floor [dB], so that one strong line does not dominate the cepstrum.
CLIP_DB = 30.0

#: Median of Rayleigh heights, as those of noise are, over their rms: sqrt(ln 2).
MEDIAN_OVER_RMS = 0.8326

_LEAST = np.float32(1e-30)  # least divisor, in place of 0
_BLOCK = 32
_BEFORE = np.triu(np.ones((_BLOCK, _BLOCK), np.float32), 1)

#: Most blocks in one product: larger products are split among threads, which on a busy machine wait for one another for
#: 30 ms.
_MOST_BLOCKS = 128

#: A peak and those beside it; fractions of a peak's period that may be the period; multiples at which a comb repeats.
NEIGHBOURS, DIVISORS, MULTIPLES = (np.array(numbers)[:, None] for numbers in ((-1, 0, 1), (2, 3, 4), (2, 3)))


@dataclass(frozen=True)
class Chopping:
    """Cepstral estimate of the chopping frequency.

    Parameters
    ----------
    frequency_hz : ndarray of float32, shape (...)
        Chopping frequency [Hz]; NaN where the dwell holds no range to search, or the record is 0.
    strength : ndarray of float32, shape (...)
        Prominence of its peak over the rms of the cepstrum of noise [1]; seldom over 4 in noise.
    repeats : ndarray of float32, shape (...)
        Mean height at two and three times the period over the height at the period [1]: a comb of narrow lines repeats.
    """

    frequency_hz: NDArray[np.float32]
    strength: NDArray[np.float32]
    repeats: NDArray[np.float32]


@lru_cache(maxsize=64)
def noise_shape(pulses: int, bins: int, window: Window) -> NDArray[np.float32]:
    """RMS of the cepstrum of white noise, up to a factor, shape (bins // 2 + 1,): what makes all periods comparable.

    The window couples neighbouring bins, so the log spectrum of noise is coloured. Two bins whose amplitudes correlate
    by r have log powers of covariance Li2(|r|^2); its transform is the variance of the cepstrum.

    Parameters
    ----------
    pulses : int
        Pulses of the dwell.
    bins : int
        Length of the spectrum.
    window : Window
        Its window.
    """
    variance = fft.rfft(special.spence(1 - bins_alike(pulses, bins, window))).real  # Li2(x) is scipy's spence(1 - x)
    return np.sqrt(np.maximum(variance, 1e-3 * variance.max())).astype(np.float32)


def cepstrum(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Magnitude of the cepstrum of the notched, floored log spectrum, shape (..., bins // 2 + 1).

    Index k is a period of k / PRF. The magnitude is taken because lines of both signs of Doppler count, also where the
    comb lies on one side alone. At each period it is divided by what noise gives there (`noise_shape`).

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool or float32, shape (..., bins)
        True (or 1) where the spectrum counts.

    Returns
    -------
    ndarray of float32
        Any scale, the same for all periods.
    """
    level = spectrum.level_db.clip(np.float32(0), np.float32(CLIP_DB))
    kept = weights(mask)
    level -= (np.vecdot(level, kept) / np.maximum(sums(kept), np.float32(1)))[..., None]
    level *= kept
    magnitude = np.abs(fft.rfft(level, axis=-1, overwrite_x=True))
    magnitude *= _per_noise(spectrum.pulses, spectrum.bins, spectrum.window)
    return magnitude


@lru_cache(maxsize=64)
def _per_noise(pulses: int, bins: int, window: Window) -> NDArray[np.float32]:
    """One over `noise_shape`."""
    return np.reciprocal(noise_shape(pulses, bins, window))


def prominence(heights: NDArray[np.float32]) -> NDArray[np.float32]:
    """Height of each period over its surroundings: a band's envelope falls smoothly with the period, a comb does not.

    Parameters
    ----------
    heights : ndarray, shape (..., periods)
        From `cepstrum`.

    Returns
    -------
    ndarray of float32, same shape
        Height less the larger of the means over 0.6-0.85 and 1.15-1.4 times the period, plus the mean of all, so that
        noise keeps its level; 0 at periods too short to have surroundings.
    """
    count = heights.shape[-1]
    edges, shares = surroundings(count)
    before = _sums_before(heights)
    means = before.take(edges[1], axis=-1, mode="wrap")  # no index is out of range: this mode is the fastest
    means -= before.take(edges[0], axis=-1, mode="wrap")
    means *= shares
    out = heights - np.maximum(means[..., 0, :], means[..., 1, :])
    out += before[..., count : count + 1] * np.float32(1 / count)
    at_least(out, 0, out=out)
    out[..., :2] = 0
    return out


def _sums_before(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sum of all values before each index, shape (..., more than values); the sum of all is at index `count`.

    Within blocks it is a product with a triangle of ones: half the time of a running sum, and no long chain of
    roundings.
    """
    lead, count = values.shape[:-1], values.shape[-1]
    blocks = count // _BLOCK + 1
    products = -(-blocks // _MOST_BLOCKS)
    each = -(-blocks // products)
    padded = np.zeros((*lead, products * each * _BLOCK), np.float32)
    padded[..., :count] = values
    within = padded.reshape(*lead, products, each, _BLOCK) @ _BEFORE
    whole = sums(padded.reshape(*lead, products * each, _BLOCK)[..., :-1, :])
    out = within.reshape(*lead, products * each, _BLOCK)
    out[..., 1:, :] += np.add.accumulate(whole, axis=-1)[..., None]
    return out.reshape(padded.shape)


@lru_cache(maxsize=64)
def surroundings(count: int) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Ranges below and above each period: start and stop, shape (2, 2, count), and 1 / length, shape (2, count)."""
    period = np.arange(count)
    low, high = (np.array(shares)[:, None] for shares in ((0.6, 1.15), (0.85, 1.4)))
    start = np.minimum((low * period).astype(np.intp), count - 1)
    stop = np.minimum(np.maximum((high * period).astype(np.intp), start + 1), count)
    return np.stack([start, stop]), (1 / (stop - start)).astype(np.float32)


def searched_periods(spectrum: Spectrum) -> tuple[int, int]:
    """First and last period of a chopping frequency that is sought [samples]; none is sought among fewer than 5."""
    low, high = CHOPPING_RANGE_HZ
    first = max(2, int(np.ceil(spectrum.prf_hz / high)))
    return first, int(min(spectrum.prf_hz / low, spectrum.bins / MIN_SPACING_BINS))


def cepstral_chopping(spectrum: Spectrum, mask: Mask) -> Chopping:
    """Estimate the chopping frequency (the paper's eq. 25) from the cepstrum.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool or float32, shape (..., bins)
        From `notch_mask` (or its `weights`): the body line must not take part.

    Returns
    -------
    Chopping
        An estimate is always given where there is a range to search; `strength` says whether to believe it.
    """
    heights = cepstrum(spectrum, mask)
    shape = heights.shape[:-1]
    first, last = searched_periods(spectrum)
    if last - first < 4:
        nothing = np.zeros(shape, np.float32)
        return Chopping(np.full(shape, np.nan, np.float32), nothing, nothing)
    flat = prominence(heights.reshape(-1, heights.shape[-1]))
    count = flat.shape[1]
    begin = np.arange(0, flat.size, count)  # index of each record in the flattened array
    every = flat.reshape(-1)
    # a comb's own peaks do not move the median
    rms = _median(heights.reshape(flat.shape)[:, first : last + 1]) * np.float32(1 / MEDIAN_OVER_RMS)
    best = _evidence(flat, first, last).argmax(axis=-1)
    best += first
    least = np.maximum(every[begin + best] * np.float32(FUNDAMENTAL_SHARE), rms * np.float32(FUNDAMENTAL_STRENGTH))
    near = np.rint(best / DIVISORS).astype(np.intp)
    around = every[begin + near + NEIGHBOURS[:, None]]  # (neighbours, divisors, records)
    ok = (near >= first) & (np.maximum.reduce(around, axis=0) >= least)
    if ok.any():
        found = near - 1 + around.argmax(axis=0)
        for number in range(len(DIVISORS)):  # the smallest strong one wins, so later divisors overrule
            best = np.where(ok[number], found[number], best)
    np.minimum(best, count - 2, out=best)
    left, middle, right = every[begin + best + NEIGHBOURS]
    period = best + parabola_offset(left, middle, right)
    again = np.minimum(np.rint(MULTIPLES * period).astype(np.intp), count - 1)
    repeats = np.add.reduce(every[begin + again], axis=0) * np.float32(0.5) / np.maximum(middle, _LEAST)
    strength = middle / np.maximum(rms, _LEAST)
    frequency = (spectrum.prf_hz / period).astype(np.float32)
    frequency[rms <= 0] = np.nan
    return Chopping(frequency.reshape(shape), strength.reshape(shape), repeats.reshape(shape))


def _evidence(peaks: NDArray[np.float32], first: int, last: int) -> NDArray[np.float32]:
    """Score of each period from `first` to `last` as that of a comb, shape (records, last - first + 1)."""
    out = peaks[:, first : last + 1].copy()
    stop = min(last, (peaks.shape[1] - 2) // 2)
    if stop >= first:  # twice the period, or a sample beside it: the true period need not be a whole number
        twice = peaks[:, 2 * first - 1 : 2 * stop + 2]
        again = np.maximum(twice[:, :-2:2], twice[:, 2::2])
        np.maximum(again, twice[:, 1:-1:2], out=again)
        again *= np.float32(REPEAT_SHARE)
        out[:, : stop - first + 1] += again
    out *= length_weights(first, last)
    return out


@lru_cache(maxsize=64)
def length_weights(first: int, last: int) -> NDArray[np.float32]:
    """How much a period counts for its length alone, 1 for the longest."""
    return ((np.arange(first, last + 1) / last) ** LENGTH_POWER).astype(np.float32)


def _median(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Median along the last axis, without NumPy's care for NaN."""
    count = values.shape[-1]
    high = count // 2
    ordered = np.sort(values, axis=-1)
    if count % 2:
        return ordered[..., high]
    return (ordered[..., high - 1] + ordered[..., high]) * np.float32(0.5)
