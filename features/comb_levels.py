"""Comb levels: evidence of lines that are a chopping frequency apart, for every chopping frequency at once.

The cepstrum takes the logarithm of each bin, so that noise without any line weighs most. Here each bin counts by its
evidence of a line (`evidence`), and each spacing by the sum of the peaks at its period and at multiples of that. Rotors
are told from noise at 2 to 3 dB less than by the cepstral peak alone.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import laguerre
from numpy.typing import NDArray
from scipy import fft

from .axis import UNSEEN_DB
from .chopping import CHOPPING_RANGE_HZ, MIN_SPACING_BINS
from .evidence import line_log_ratio
from .fast import as_ordered, at_most, power_of, sums, to_db
from .notch import Mask, weights
from .schema import COMB_BINS
from .spectrum import SPEED_OF_LIGHT_MPS, Spectrum, bins_alike, per_floor
from .window import BROAD_HANN, NEIGHBOUR_SHARE

#: Lines are looked for up to this speed [m/s]: beyond it lie the ends of few rotors' bands, and noise.
REACH_MPS = 80.0

#: Power over the floor is clipped at this: the evidence of a line reaches its cap at less.
MOST_POWER = 20.0

#: SNR in its bin of a weak line, as is looked for.
WEAK_SNR = 0.7

#: Peaks at the first 1, 2, 4 or 6 multiples of the period are summed; the sum that is highest over its noise counts.
ENDS = (1, 2, 4, 6)

#: The evidence's mean over each block of the spectrum is taken out, as it tells of no comb. A block is at least
#: BLOCK_HZ wide [Hz], and at least BLOCK_BINS.
BLOCK_HZ, BLOCK_BINS = 800.0, 64

_HANN_BINS = (-0.25, 0.5, -0.25)  # amplitudes of a line in its bin and both beside it, through Hann's window
_BROAD_BINS = np.convolve(_HANN_BINS, (NEIGHBOUR_SHARE, 1.0, NEIGHBOUR_SHARE))

#: Noise power of a bin through `BROAD_HANN`, made by adding both bins beside it, over that through Hann's window.
NOISE_GAIN = np.float32(np.sum(_BROAD_BINS**2) / np.sum(np.square(_HANN_BINS)))

#: Number of Laguerre coefficients of the evidence that its covariance between neighbouring bins is computed from.
_TERMS = 24

#: Mean and standard deviation of a Rayleigh magnitude of unit mean square.
MEAN_HEIGHT, HEIGHT_DEVIATION = float(np.sqrt(np.pi) / 2), float(np.sqrt(1 - np.pi / 4))


@dataclass(frozen=True)
class CombPlan:
    """What the comb levels of one radar's dwell need besides the spectrum.

    Parameters
    ----------
    band : slice
        Bins used.
    blocks : int
        Number of blocks of these bins.
    length : int
        Length of the transform of the bins' evidence.
    per_noise : ndarray of float32, shape (length // 2 + 1,)
        One over the root mean square, in white noise, of that transform for a single bin.
    lags : ndarray of int, shape (ENDS[-1], spacings)
        Index in the transform of the multiples of each period; periods rise in steps of half an index.
    held : tuple of int
        Number of spacings, from the shortest period, of which each multiple lies within the transform.
    per_deviation : ndarray of float32, shape (len(ENDS), spacings)
        One over the standard deviation, in noise, of the sums that end at each of `ENDS`.
    spans : tuple of ndarray of int, shape (seen,) each
        First spacing of each bin of the axis and how many it holds, in falling rate.
    seen : slice
        Bins of the axis, in falling rate, that hold any spacing.
    """

    band: slice
    blocks: int
    length: int
    per_noise: NDArray[np.float32]
    lags: NDArray[np.intp]
    held: tuple[int, ...]
    per_deviation: NDArray[np.float32]
    spans: tuple[NDArray[np.intp], NDArray[np.intp]]
    seen: slice


def comb_edges_hz() -> NDArray[np.float64]:
    """Edges of the axis of chopping frequencies [Hz], rising by equal ratios, shape (COMB_BINS + 1,)."""
    return np.geomspace(*CHOPPING_RANGE_HZ, COMB_BINS + 1)


def line_nats(relative_power: NDArray[np.floating]) -> NDArray[np.floating]:
    """Evidence of a weak line in each bin [nats]."""
    return line_log_ratio(at_most(relative_power, MOST_POWER), WEAK_SNR)


@lru_cache(maxsize=1)
def _covariance_series() -> NDArray[np.float64]:
    """Squares of the Laguerre coefficients of `line_nats` under the exponential law, from the first order on.

    If the amplitudes of two bins of noise correlate by r, the covariance of their evidences is the sum over k of the
    k-th of these squares times |r|^2k.
    """
    power = np.linspace(0, 60, 60_001)
    weight = np.exp(-power) * (power[1] - power[0])
    weight[0] /= 2
    held = line_nats(power) * weight
    return np.array([float(held @ laguerre.lagval(power, np.eye(_TERMS + 1)[k])) ** 2 for k in range(1, _TERMS + 1)])


def _noise_rms(pulses: int, bins: int, length: int) -> NDArray[np.float64]:
    """Root mean square of the transform of the evidence of white noise, of a single bin, shape (length // 2 + 1,)."""
    alike = bins_alike(pulses, bins, BROAD_HANN)[: bins // 2]
    covariance = np.polynomial.polynomial.polyval(alike, np.concatenate([[0], _covariance_series()]))
    near = np.arange(1, min(len(covariance), 64))
    turn = 2 * np.pi * np.arange(length // 2 + 1) / length
    variance = covariance[0] + 2 * np.cos(np.outer(turn, near)) @ covariance[near]
    return np.sqrt(np.maximum(variance, 1e-3 * variance.max()))


@lru_cache(maxsize=64)
def comb_plan(bins: int, pulses: int, carrier_hz: float, prf_hz: float) -> CombPlan | None:
    """Plan for a dwell; None where it holds no range to search.

    Parameters
    ----------
    bins, pulses : int
        Bins of the spectrum, pulses of the dwell.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    """
    step_mps = prf_hz / bins * SPEED_OF_LIGHT_MPS / carrier_hz / 2
    most = 2 * min(int(REACH_MPS / step_mps), (bins - 1) // 2) + 1
    # an odd number of blocks of an odd number of bins: the same for a mirrored spectrum
    blocks = (max(1, most // max(BLOCK_BINS, round(BLOCK_HZ * bins / prf_hz))) - 1) // 2 * 2 + 1
    count = blocks * ((most // blocks - 1) // 2 * 2 + 1)
    first = bins // 2 - count // 2
    length = fft.next_fast_len(count, real=True)
    # a period of p samples lies at index p x length / bins
    shortest = max(prf_hz / CHOPPING_RANGE_HZ[1] * length / bins, 2.0)
    longest = min(prf_hz / CHOPPING_RANGE_HZ[0] * length / bins, length / MIN_SPACING_BINS, length / 2)
    places = np.arange(np.ceil(2 * shortest), np.floor(2 * longest) + 1) / 2
    if len(places) < 4:
        return None
    multiple = np.arange(1, ENDS[-1] + 1)[:, None]
    lags = np.rint(multiple * places).astype(np.intp)
    within = lags <= length // 2
    summed = np.minimum(np.array(ENDS)[:, None], within.sum(axis=0))
    edges = prf_hz * length / bins / comb_edges_hz()[::-1]  # in places, rising
    middle = np.sqrt(edges[:-1] * edges[1:])
    told = np.flatnonzero((middle >= places[0]) & (middle <= places[-1]))
    if not len(told):
        return None
    seen = slice(int(told[0]), int(told[-1]) + 1)
    low, high = (np.searchsorted(places, part) for part in (edges[:-1][seen], edges[1:][seen]))
    nearest = np.clip(np.rint(2 * (middle[seen] - places[0])), 0, len(places) - 1).astype(np.intp)
    starts = np.where(high > low, low, nearest)
    high[-1] = len(places)  # the slowest bin holds all periods left, up to half a bin's
    return CombPlan(
        slice(first, first + count),
        blocks,
        length,
        (1 / _noise_rms(pulses, bins, length)).astype(np.float32),
        lags,
        tuple(within.sum(axis=1).tolist()),
        (1 / (HEIGHT_DEVIATION * np.sqrt(summed))).astype(np.float32),
        (starts, np.maximum(high - starts, 1)),
        seen,
    )


def comb_levels_db(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Level over noise of the evidence of lines at each chopping frequency.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins), through Hann's window.
    mask : ndarray of bool or float32, shape (..., bins)
        From `notch_mask`, or its `weights`: the body line is no comb.

    Returns
    -------
    ndarray of float32, shape (..., 1, COMB_BINS)
        Largest sum of each bin of the axis, rising in rate, over its standard deviation in noise [dB], not below 0;
        `UNSEEN_DB` at rates for which the dwell is too short or the PRF too low, or of which two lines do not fit
        within `REACH_MPS`. Multiples of a period are periods as well: a comb shows at the fractions of its chopping
        frequency too.
    """
    out = np.full((*spectrum.relative_power.shape[:-1], 1, COMB_BINS), UNSEEN_DB, np.float32)
    plan = comb_plan(spectrum.bins, spectrum.pulses, spectrum.carrier_hz, spectrum.prf_hz)
    if plan is not None:
        heights = comb_heights(broad_power(spectrum, plan.band), weights(mask[..., plan.band]), plan)
        # `as_ordered` misorders values below 0, which does not matter: all of them become 0 dB
        loudest = np.maximum.reduceat(as_ordered(_loudest_sums(heights, plan)), plan.spans[0], axis=-1)
        out[..., 0, ::-1][..., plan.seen] = to_db(loudest.view(np.float32), 0.0)
    return out


def broad_power(spectrum: Spectrum, band: slice) -> NDArray[np.float32]:
    """Power over the floor through `BROAD_HANN`, from spectra through Hann's window.

    To multiply a window by a cosine of one turn a dwell is to add, to each bin of the transform, the two beside it.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    band : slice
        Bins that are wanted.

    Returns
    -------
    ndarray of float32, shape (..., bins of the band)
    """
    lines = np.ascontiguousarray(spectrum.transform)
    if band.start and band.stop < spectrum.bins:
        beside = lines[..., band.start - 1 : band.stop - 1] + lines[..., band.start + 1 : band.stop + 1]
    else:  # the spectrum is circular: beyond one end lies the other
        beside = (np.roll(lines, 1, axis=-1) + np.roll(lines, -1, axis=-1))[..., band]
    parts = beside.view(np.float32)  # real and imaginary parts one by one: half the time of a complex product
    parts *= np.float32(NEIGHBOUR_SHARE)
    beside += lines[..., band]
    power = power_of(beside)
    power *= per_floor(spectrum.transform_floor * NOISE_GAIN)[..., None]
    return power


def comb_heights(power: NDArray[np.floating], kept: NDArray[np.floating], plan: CombPlan) -> NDArray[np.floating]:
    """Magnitude of the evidence's transform in units of its rms in noise, less the mean of that in noise.

    Parameters
    ----------
    power : ndarray, shape (..., bins of the band)
        Power over the floor.
    kept : ndarray, same shape
        1 where a bin counts, else 0.
    plan : CombPlan
        Of the radar and the dwell.

    Returns
    -------
    ndarray, shape (..., plan.length // 2 + 1)
        Noise has mean 0 and standard deviation `HEIGHT_DEVIATION`. Where there are several blocks, whose means take a
        part of the noise, both are less at the shortest periods, up to about as many indices as there are blocks.
    """
    counts = kept.reshape(*power.shape[:-1], plan.blocks, power.shape[-1] // plan.blocks)
    nats = line_nats(power).reshape(counts.shape)
    nats *= counts
    number = sums(counts)
    nats -= (sums(nats) / np.maximum(number, np.float32(1)))[..., None]
    nats *= counts
    heights = np.abs(fft.rfft(nats.reshape(power.shape), plan.length, overwrite_x=True))
    heights *= plan.per_noise
    heights *= np.reciprocal(np.sqrt(np.maximum(sums(number), np.float32(1))))[..., None]
    heights -= np.float32(MEAN_HEIGHT)
    return heights


def _loudest_sums(heights: NDArray[np.float32], plan: CombPlan) -> NDArray[np.float32]:
    """The largest of the sums of each spacing over its standard deviation in noise, shape (..., spacings)."""
    first = plan.lags[1, 0]
    total = heights.take(plan.lags[0], axis=-1, mode="wrap")
    best = total * plan.per_deviation[0]
    ended = 1
    for number in range(2, ENDS[-1] + 1):
        held = plan.held[number - 1]  # longer periods have no such multiple
        if number % 2:
            total[..., :held] += heights.take(plan.lags[number - 1, :held], axis=-1, mode="wrap")
        else:  # even multiples of periods in half indices lie at whole indices, evenly spaced
            step = number // 2
            total[..., :held] += heights[..., step * first : step * (first + held) : step]
        if number in ENDS:
            fresh = plan.held[ended]  # spacings whose sum has grown since the last end
            level = total[..., :fresh] * plan.per_deviation[ENDS.index(number), :fresh]
            np.maximum(best[..., :fresh], level, out=best[..., :fresh])
            ended = number
    return best
