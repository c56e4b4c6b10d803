"""Where a comb may be: spacings from the autocorrelation of band-limited spectra, scored by the likelihood of lines."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .chopping import CHOPPING_RANGE_HZ
from .periodogram import BLOCK_BINS, NEIGHBOUR_SHARE, Periodogram

#: Lines nearer than this are not told apart [bins].
MIN_SPACING_BINS = 3.0

#: Shares of the whole span within which lines are sought: noise outside a comb's band only hides it.
BANDS = (1.0, 0.5, 0.25, 0.125)

#: Multiples of the period that are summed at most.
MAX_PERIODS = 12

#: Candidates taken from each band, and the other octaves tried for each.
PER_BAND = 4
OCTAVES = (1.0, 0.5, 2.0, 1 / 3, 3.0)

#: Line powers over noise that a comb may have, and the share of its lines that may be missing.
LINE_SNRS = (1.2, 6.0, 40.0)
MISSING_SHARE = 0.15

#: No single line speaks for more than this [nats]: a lone line is no comb.
LINE_CAP = 5.0

#: What a comb whose sides reach unequally far must have more [nats].
UNEVEN_COST = 4.0

#: A comb counted from a stronger line a whole number of spacings away must keep this share of the evidence.
SAME_COMB_SHARE = 0.6

#: Fine steps to each side of a coarse spacing.
FINE_STEPS = 8


@dataclass(frozen=True)
class Candidate:
    """A comb as the search sees it.

    Parameters
    ----------
    spacing : float
        Chopping frequency [cycles a sample].
    score : float
        Log likelihood ratio against noise [nats].
    low, high : int
        Outermost orders that speak for it, low <= 0 <= high.
    centre : float
        The line about which the orders count [cycles a sample].
    """

    spacing: float
    score: float
    low: int
    high: int
    centre: float


@dataclass(frozen=True)
class _Grid:
    """Periods tried, and the lags each one sums."""

    periods: NDArray[np.float64]
    lags: NDArray[np.intp]
    starts: NDArray[np.intp]
    weight: NDArray[np.float64]


@lru_cache(maxsize=16)
def _grid(pulses: int, shortest: float, longest: float) -> _Grid:
    """Periods in geometric steps of half a bin at the edge of the span."""
    count = int(np.ceil(np.log(longest / shortest) * 2 * pulses / MAX_PERIODS * 2)) + 1
    periods = np.geomspace(shortest, longest, count)
    summed = np.clip((0.9 * pulses / periods).astype(np.intp), 1, MAX_PERIODS)
    starts = np.concatenate([[0], np.cumsum(summed)[:-1]])
    number = np.arange(summed.sum()) - np.repeat(starts, summed) + 1
    lags = np.minimum(np.rint(number * np.repeat(periods, summed)).astype(np.intp), pulses - 1)
    # the real part of a lag of noise has half the variance of its complex value, pulses - lag terms make it up
    variance = np.add.reduceat((pulses - lags) / 2.0, starts)
    return _Grid(periods, lags, starts, 1 / np.sqrt(variance))


def spacing_limits(pulses: int, prf_hz: float) -> tuple[float, float]:
    """Smallest and largest spacing sought [cycles a sample]; empty where the first is not below the second."""
    low, high = CHOPPING_RANGE_HZ
    return max(low / prf_hz, MIN_SPACING_BINS / pulses), min(high / prf_hz, 0.2)


def line_evidence(power: NDArray[np.float64], block: int) -> NDArray[np.float32]:
    """Log likelihood ratio of a line against noise in every bin [nats], shape (len(LINE_SNRS), bins).

    Line and noise are complex Gaussian of the variances 1 + snr and 1, or the line is missing. Lines far below the
    strongest of their neighbourhood are leaks or an imbalance of the blades and count less.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power over noise, FFT order.
    block : int
        Bins of a neighbourhood.
    """
    from scipy.ndimage import maximum_filter1d  # here, because predicting needs no such import

    strongest = maximum_filter1d(power, block, mode="wrap")
    held = power / (1 + NEIGHBOUR_SHARE * np.maximum(strongest - 10, 0))
    held = np.minimum(held, 60.0).astype(np.float32)
    out = np.empty((len(LINE_SNRS), len(power)), np.float32)
    for row, snr in zip(out, LINE_SNRS, strict=True):
        present = np.exp(held * np.float32(snr / (1 + snr))) * np.float32((1 - MISSING_SHARE) / (1 + snr))
        row[:] = np.minimum(np.log(np.float32(MISSING_SHARE) + present), LINE_CAP)
    return out


def coarse_spacings(data: Periodogram, evidence: NDArray[np.float32], centre: float) -> NDArray[np.float64]:
    """Spacings worth a closer look [cycles a sample], best of every band first, with their octaves."""
    low, high = spacing_limits(data.pulses, data.prf_hz)
    grid = _grid(data.pulses, 1 / high, 1 / low)
    size = len(data.power)
    offset = np.arange(size) / size - centre
    distance = np.abs(offset - np.rint(offset))
    ripple = evidence[0]
    turn = np.exp(-2j * np.pi * centre * np.arange(data.pulses))
    found: list[float] = []
    for share in BANDS:
        inside = distance <= share / 2
        part = np.where(inside, ripple - ripple[inside].mean(), 0.0)
        correlation = fft.ifft(part)[: data.pulses] * turn
        sums = np.add.reduceat(correlation.real[grid.lags], grid.starts) * grid.weight
        found += _apart(grid.periods, sums, 2 * MAX_PERIODS / data.pulses)
    spacings = (1 / np.array(found))[:, None] * np.array(OCTAVES)
    spacings = np.unique(spacings.ravel())
    spacings = spacings[(spacings >= low) & (spacings <= high)]
    return spacings[np.diff(np.log(spacings), prepend=-np.inf) > 1 / data.pulses]


def free_spacings(data: Periodogram, evidence: NDArray[np.float32]) -> list[tuple[float, float]]:
    """Spacings and centres of combs whose body line hides in the static background [cycles a sample each].

    The phase of the autocorrelation at multiples of the period tells the centre, up to whole spacings.
    """
    low, high = spacing_limits(data.pulses, data.prf_hz)
    grid = _grid(data.pulses, 1 / high, 1 / low)
    size = len(data.power)
    offset = np.arange(size) / size
    distance = np.abs(offset - np.rint(offset))
    number = np.arange(1, MAX_PERIODS + 1)
    steering = np.exp(-2j * np.pi * np.outer(np.arange(48) / 48, number))
    found = []
    for share in BANDS[1:]:
        inside = distance <= share / 2
        part = np.where(inside, evidence[0] - evidence[0][inside].mean(), 0.0)
        correlation = fft.ifft(part)[: data.pulses]
        sums = np.add.reduceat(np.abs(correlation[grid.lags]), grid.starts) * grid.weight
        for period in _apart(grid.periods, sums, 2 * MAX_PERIODS / data.pulses):
            used = number[: max(1, int(0.9 * data.pulses / period))]
            lags = np.rint(used * period).astype(np.intp)
            turn = int((steering[:, : len(used)] @ correlation[lags]).real.argmax()) / 48
            found.append((1 / period, (turn - round(turn)) / period))
    return found


def _apart(periods: NDArray[np.float64], sums: NDArray[np.float64], least: float) -> list[float]:
    """Periods of the highest sums, each further from the others than `least`, relative."""
    taken: list[float] = []
    for index in np.argsort(sums)[:-400:-1]:
        period = periods[index]
        if all(abs(period / other - 1) > least for other in taken):
            taken.append(float(period))
            if len(taken) == PER_BAND:
                break
    return taken


def score(
    data: Periodogram, evidence: NDArray[np.float32], spacings: NDArray[np.float64], centre: float
) -> list[Candidate]:
    """Score spacings by their lines, each side of the centre out to where its lines stop.

    Parameters
    ----------
    data : Periodogram
        The record.
    evidence : ndarray of float32, shape (line SNRs, bins)
        From `line_evidence`; 0 where a line cannot be seen.
    spacings : ndarray, shape (candidates,)
        [cycles a sample].
    centre : float
        The comb's centre [cycles a sample].
    """
    size = evidence.shape[-1]
    rows = np.arange(len(evidence))
    out = []
    for spacing in spacings:
        order = np.arange(1, int(0.5 / spacing) + 1)
        sides = [
            np.cumsum(evidence[:, np.rint((centre + sign * spacing * order) * size).astype(np.intp) % size], axis=1)
            for sign in (-1, 1)
        ]
        # a rotor's lines reach equally far to both sides; other reaches cost as much as the choice of two ends gives
        even = sides[0] + sides[1]
        last = even.argmax(axis=1)
        best = np.maximum(even[rows, last], 0)
        reach = [last + 1, last + 1]
        apart = [side.argmax(axis=1) for side in sides]
        heights = [np.maximum(side[rows, end], 0) for side, end in zip(sides, apart, strict=True)]
        uneven = heights[0] + heights[1] - UNEVEN_COST
        better = uneven > best
        best = np.where(better, uneven, best)
        for number in (0, 1):
            reach[number] = np.where(better, np.where(heights[number] > 0, apart[number] + 1, 0), reach[number])
        row = int(best.argmax())
        out.append(Candidate(float(spacing), float(best[row]), -int(reach[0][row]), int(reach[1][row]), centre))
    return out


def best_candidate(data: Periodogram) -> Candidate | None:
    """The spacing whose lines speak loudest; None where the dwell is too short to search."""
    low, high = spacing_limits(data.pulses, data.prf_hz)
    if low * 1.5 >= high:
        return None
    evidence = line_evidence(data.power, int(BLOCK_BINS * len(data.power) / data.pulses))
    bins = np.arange(len(data.power)) / len(data.power)
    evidence[:, ~data.usable(bins)] = 0.0
    factors = 1 + 0.5 / data.pulses * np.arange(-FINE_STEPS, FINE_STEPS + 1)
    found: list[Candidate] = []
    for centre in data.centres:
        coarse = coarse_spacings(data, evidence, centre)
        found += score(data, evidence, (coarse[:, None] * factors).ravel(), centre)
    if data.rest_half > 0:
        for spacing, centre in free_spacings(data, evidence):
            if abs(centre) < data.rest_half:
                octaves = spacing * np.array(OCTAVES)
                octaves = octaves[(octaves >= low) & (octaves <= high)]
                for shift in np.arange(-1, 2) * 0.3 / data.pulses:
                    found += score(data, evidence, (octaves[:, None] * factors[::2]).ravel(), centre + shift)
    best = max(found, key=lambda c: c.score, default=None)
    if best is None:
        return None
    # any line of a comb may pass for its centre: of lines a whole number of spacings apart the strongest is the body's
    for centre in data.centres:
        if centre == best.centre:
            break
        orders = (centre - best.centre) / best.spacing
        if abs(orders - round(orders)) * best.spacing * data.pulses > 1.5:
            continue
        same = [c for c in found if c.centre == centre and abs(c.spacing / best.spacing - 1) < 0.01]
        other = max(same, key=lambda c: c.score, default=best)
        if other.score > SAME_COMB_SHARE * best.score:
            return other
    return best
