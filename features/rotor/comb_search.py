"""Search for combs: spacings from the autocorrelation of band-limited spectra, scored by the likelihood of lines."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..chopping import CHOPPING_RANGE_HZ
from ..evidence import Evidence
from ..lines import from_whole
from .comb_scores import Scored, heights, loudest_of_each, score
from .flashes import flash_evidence
from .folding import FOLDED_TIMES, comes_back, fastest_tip, outermost_orders
from .octaves import MULTIPLE_SHARE, coarsest
from .periodogram import Periodogram

#: Lines nearer than this are not told apart [bins].
MIN_SPACING_BINS = 3.0

#: FASTEST_HZ: highest chopping frequency of a rotor [Hz], four blades at 60 000 rpm, as the smallest drones have them.
#: Beyond the cepstrum's range a comb is believed if it scores more than the one found within. That one may be a
#: fraction of it, a fifth or more: a clear comb below LEAST_FRACTION_HZ needs no search beyond the range [Hz].
FASTEST_HZ, LEAST_FRACTION_HZ = 4000.0, 300.0

#: Largest spacing of a comb, as a share of the PRF: five lines fit into the span.
MOST_SPACING = 0.2

#: The largest spacing sought must exceed this many times the smallest, or no comb is sought.
SEARCHED_RATIO = 1.5

#: Shares of the whole span within which lines are sought: noise outside a comb's band only hides it.
BANDS = (1.0, 0.5, 0.25, 0.125)

#: Most multiples of a period at which the autocorrelation is summed.
MAX_PERIODS = 12

#: PER_BAND: spacings taken from each band; OCTAVES: multiples tried of each.
PER_BAND = 4
OCTAVES = (1.0, 0.5, 2.0, 1 / 3, 3.0)

#: The evidence of flashes counts up to FLASH_SHARE times that of the line powers: flashes alone must not make a comb.
#: Beside a static background, where supplies click, it counts up to REST_FLASH_SHARE times.
FLASH_SHARE, REST_FLASH_SHARE = 2.0, 1.0

#: Folded lines, of tips faster than the unambiguous velocity, count if they add more than this to the score [nats]:
#: noise there lowers it.
FOLDED_NATS = 8.0

#: SAME_BINS: folded lines belong to the comb found without them if the spacings differ by less [bins at the PRF].
#: UNFOLDED_SHARE: another folded comb is believed if no comb without folded lines has this share of its score. FINER:
#: least spacing of a folded comb, in spacings of that found: any finer one meets some of several rotors' lines all over
#: the span.
SAME_BINS, UNFOLDED_SHARE, FINER = 4.0, 0.88, 0.9

#: SAME_LINES_SHARE: a comb at an odd multiple of the spacing found needs this many times the best score, as its folded
#: lines may be the lines in between. HELD_SHARE: if the comb found has folded lines itself, any other one needs its
#: score over this share (at an even multiple over UNFOLDED_SHARE).
SAME_LINES_SHARE, HELD_SHARE = 1.01, 0.92

#: If a comb's lines lie further than this from those of its mirror image about velocity zero, both are distinct [bins].
MIRROR_BINS = 1.5

#: COARSE_STEPS: steps to each side of a coarse spacing, of one bin at the PRF; FINE_STEPS: finer ones about the best
#: FAMILIES.
COARSE_STEPS = 4
FAMILIES = 8
FINE_STEPS = 4

#: FOLDED_STEPS: the same for folded combs, whose lines lie further out, if the best score exceeds REFINED_FROM [nats]:
#: near the noise the best of many would pass for a comb. FILLS_SPAN: folded lines fill the span. With such a score and
#: a comb that reaches less far than this [cycles a sample] none are sought (of 311 folded combs, lines reached 0.426
#: and more). CENTRE_SHIFTS: tried about centres that only a correlation's phase tells [bins].
FOLDED_STEPS, REFINED_FROM, FILLS_SPAN = 48, 50.0, 0.4
CENTRE_SHIFTS = (-0.3, 0.0, 0.3)


@dataclass(frozen=True)
class Candidate:
    """A comb as the search sees it.

    Parameters
    ----------
    spacing : float
        Chopping frequency [cycles a sample].
    centre : float
        The line about which the orders count [cycles a sample].
    low, high : int
        Outermost orders that count in its score, low <= 0 <= high.
    score : float
        Log likelihood ratio against noise [nats].
    """

    spacing: float
    centre: float
    low: int
    high: int
    score: float

    @property
    def last(self) -> int:
        """Outermost order of either side."""
        return max(self.high, -self.low)

    @property
    def reach(self) -> float:
        """How far its lines reach from the centre [cycles a sample]."""
        return self.last * self.spacing

    @property
    def is_folded(self) -> bool:
        """Whether its outer lines are folded, back from the other end of the span."""
        return bool(comes_back(self.last, self.spacing))


@dataclass(frozen=True)
class _Grid:
    """Periods tried, and for each the lags that are summed, from `starts` on."""

    periods: NDArray[np.float64]
    lags: NDArray[np.intp]
    starts: NDArray[np.intp]
    weight: NDArray[np.float64]

    def near(self, pulses: int) -> Callable[[int], NDArray[np.bool_]]:
        """Which periods hardly differ from one, by its place."""
        return lambda index: np.abs(self.periods / self.periods[index] - 1) <= 2 * MAX_PERIODS / pulses


@lru_cache(maxsize=16)
def _grid(pulses: int, low: float, high: float) -> _Grid:
    """Periods of spacings from `low` to `high` [cycles a sample], in relative steps of `MAX_PERIODS` / (4 pulses)."""
    shortest, longest = 1 / high, 1 / low
    count = int(np.ceil(np.log(longest / shortest) * 2 * pulses / MAX_PERIODS * 2)) + 1
    periods = np.geomspace(shortest, longest, count)
    summed = np.clip((0.9 * pulses / periods).astype(np.intp), 1, MAX_PERIODS)
    starts = np.concatenate([[0], np.cumsum(summed)[:-1]])
    number = np.arange(summed.sum()) - np.repeat(starts, summed) + 1
    lags = np.minimum(np.rint(number * np.repeat(periods, summed)).astype(np.intp), pulses - 1)
    # of noise a lag sums pulses - lag terms; its real part has half the variance of its complex value
    variance = np.add.reduceat((pulses - lags) / 2.0, starts)
    return _Grid(periods, lags, starts, 1 / np.sqrt(variance))


def factors_about(pulses: int, steps: int, per_bin: int) -> NDArray[np.float64]:
    """Factors of the spacings tried about one: `steps` to each side, `per_bin` of them to a bin at the PRF."""
    return np.asarray(1 + np.arange(-steps, steps + 1) / (per_bin * pulses), np.float64)


def fine_factors(pulses: int) -> NDArray[np.float64]:
    """Factors of the spacings tried last about one, in steps fine enough for its fit to begin from."""
    return factors_about(pulses, FINE_STEPS, 2 * FINE_STEPS)


def spacing_limits(pulses: int, prf_hz: float) -> tuple[float, float]:
    """Smallest and largest spacing sought [cycles a sample]; none is sought if the first is not below the second."""
    low, high = CHOPPING_RANGE_HZ
    return max(low / prf_hz, MIN_SPACING_BINS / pulses), min(high / prf_hz, MOST_SPACING)


def fastest_chopping(data: Periodogram) -> float:
    """The highest chopping frequency that is sought [cycles a sample]."""
    return min(FASTEST_HZ / data.prf_hz, MOST_SPACING)


def coarse_spacings(
    data: Periodogram, evidence: Evidence, centre: float, limits: tuple[float, float]
) -> NDArray[np.float64]:
    """Candidate spacings within limits [cycles a sample]: the best of every band, with their octaves."""
    low, high = limits
    grid = _grid(data.pulses, low, high)
    size = len(data.power)
    distance = np.abs(from_whole(np.arange(size) / size - centre))
    turn = np.exp(-2j * np.pi * centre * np.arange(data.pulses))
    found: list[float] = []
    for correlation in _correlations(evidence.rows[0], distance, BANDS, data.pulses):
        sums = np.add.reduceat((correlation * turn).real[grid.lags], grid.starts) * grid.weight
        found += grid.periods[_highest(sums, PER_BAND, grid.near(data.pulses))].tolist()
    spacings = (1 / np.array(found))[:, None] * np.array(OCTAVES)
    spacings = np.unique(spacings.ravel())
    spacings = spacings[(spacings >= low) & (spacings <= high)]
    return spacings[np.diff(np.log(spacings), prepend=-np.inf) > 1 / data.pulses]


def _correlations(
    ripple: NDArray[np.float32], distance: NDArray[np.float64], shares: tuple[float, ...], lags: int
) -> NDArray[np.complex64]:
    """Autocorrelations of a spectrum within shares of the span about a place, shape (shares, lags)."""
    inside = distance <= np.array(shares)[:, None] / 2
    part = np.where(inside, ripple, np.float32(0))
    part -= inside * (part.sum(axis=1, keepdims=True) / inside.sum(axis=1, keepdims=True, dtype=np.float32))
    return np.asarray(fft.rfft(part)[:, :lags].conj() / np.float32(len(ripple)), np.complex64)


def free_spacings(data: Periodogram, evidence: Evidence, limits: tuple[float, float]) -> list[tuple[float, float]]:
    """Spacings and centres of combs whose body line hides in the static background [cycles a sample each].

    The phase of the autocorrelation at multiples of the period tells the centre, up to whole spacings.
    """
    grid = _grid(data.pulses, *limits)
    size = len(data.power)
    distance = np.abs(from_whole(np.arange(size) / size))
    number = np.arange(1, MAX_PERIODS + 1)
    steering = np.exp(-2j * np.pi * np.outer(np.arange(48) / 48, number))
    found = []
    for correlation in _correlations(evidence.rows[0], distance, BANDS[1:], data.pulses):
        sums = np.add.reduceat(np.abs(correlation[grid.lags]), grid.starts) * grid.weight
        for period in grid.periods[_highest(sums, PER_BAND, grid.near(data.pulses))].tolist():
            used = number[: max(1, int(0.9 * data.pulses / period))]
            lags = np.rint(used * period).astype(np.intp)
            turn = int((steering[:, : len(used)] @ correlation[lags]).real.argmax()) / 48
            found.append((1 / period, (turn - round(turn)) / period))
    return found


def _highest(scores: NDArray[np.float64], most: int, near: Callable[[int], NDArray[np.bool_]]) -> list[int]:
    """Places of the highest finite scores, the highest first, none of them near one before it."""
    taken: list[int] = []
    left = scores.copy()
    while len(taken) < most and np.isfinite(left[index := int(left.argmax())]):
        taken.append(index)
        left[near(index)] = -np.inf
    return taken


def _loudness(data: Periodogram, spacings: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scores of combs [nats]: of their lines and, in one channel, of those about the body's mirror image."""
    return heights(data.contrast, spacings, centres) + _mirrored(data, spacings, centres)


def from_mirror_bins(
    spacing: NDArray[np.float64] | float, centre: NDArray[np.float64] | float, pulses: int
) -> NDArray[np.float64]:
    """How far a comb's lines lie from those of its mirror image about velocity zero [bins]."""
    off = 2 * np.asarray(centre) / spacing
    return np.asarray(np.abs(from_whole(off)) * spacing * pulses)


def _mirrored(data: Periodogram, spacings: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Additional score of combs in one channel, whose lines stand about the body's mirror image as well [nats].

    Without it a third or a fourth of the spacing, which holds nearly all of these lines and others, scores higher.
    """
    if not data.one_channel:
        return np.zeros(len(spacings))
    apart = from_mirror_bins(spacings, centres, data.pulses) > MIRROR_BINS
    return np.where(apart, heights(data.contrast, spacings, -centres), 0.0)


def _families(
    spacings: NDArray[np.float64], scores: NDArray[np.float64], centres: NDArray[np.float64], pulses: int
) -> list[int]:
    """The best of each family of neighbouring spacings about one centre, best family first."""

    def near(index: int) -> NDArray[np.bool_]:
        alike = np.abs(spacings / spacings[index] - 1) <= 6 / pulses
        return np.asarray(alike & (np.abs(centres - centres[index]) * pulses <= 2), np.bool_)

    return _highest(scores, FAMILIES, near)


def best_candidate(data: Periodogram) -> Candidate | None:
    """The best comb of a spacing in the cepstrum's range; None where the dwell is too short to search.

    Any line of the comb may pass for its centre: see `comb_centre`.
    """
    return _best_within(data, spacing_limits(data.pulses, data.prf_hz))


def with_faster(data: Periodogram, found: Candidate) -> Candidate:
    """The best comb beyond the cepstrum's range if it scores more than the comb found; else the comb found."""
    low, _ = spacing_limits(data.pulses, data.prf_hz)
    faster = _best_within(data, (max(low, CHOPPING_RANGE_HZ[1] / data.prf_hz), fastest_chopping(data)))
    return faster if faster is not None and faster.score > found.score else found


def _best_within(data: Periodogram, limits: tuple[float, float]) -> Candidate | None:
    """The best comb of a spacing within limits; None where the limits lie too near to each other."""
    low, high = limits
    if low * SEARCHED_RATIO >= high:
        return None
    evidence = data.contrast
    tried = [(coarse_spacings(data, evidence, centre, limits), centre) for centre in data.strong.centres]
    if data.rest_half > 0:
        for spacing, centre in free_spacings(data, evidence, limits):
            if abs(centre) < data.rest_half:
                octaves = spacing * np.array(OCTAVES)
                octaves = octaves[(octaves >= low) & (octaves <= high)]
                tried.append((octaves, centre))
    factors = factors_about(data.pulses, COARSE_STEPS, 1)
    spacings = np.concatenate([np.outer(s, factors).ravel() for s, _ in tried])
    centres = np.concatenate([np.full(len(s) * len(factors), c) for s, c in tried])
    scores = _loudness(data, spacings, centres)
    if not len(scores):
        return None
    chosen = _families(spacings, scores, centres, data.pulses)
    fine = fine_factors(data.pulses)
    # a line's frequency is known to a hundredth of a bin; a centre from the phase of a correlation less well
    shifts = [(0.0,) if centres[i] in data.strong.centres else CENTRE_SHIFTS for i in chosen]
    family = np.repeat(np.arange(len(chosen)), [len(fine) * len(s) for s in shifts])
    centres = np.concatenate(
        [np.repeat(centres[i] + np.array(s) / data.pulses, len(fine)) for i, s in zip(chosen, shifts, strict=True)]
    )
    spacings = np.concatenate([np.tile(spacings[i] * fine, len(s)) for i, s in zip(chosen, shifts, strict=True)])
    scores = _loudness(data, spacings, centres)
    loudest_first = np.argsort(-scores, kind="stable")
    finest = loudest_first[np.unique(family[loudest_first], return_index=True)[1]]
    spacings, centres = spacings[finest], centres[finest]
    scored = score(evidence, spacings, centres)
    mirrored = _mirrored(data, spacings, centres)
    totals = _with_flashes(data, spacings, centres, scored, mirrored)
    all_totals = np.where(totals > 0, totals + mirrored, 0.0)
    best = coarsest(spacings, all_totals)
    low, high = int(scored[1][best]), int(scored[2][best])
    found = Candidate(float(spacings[best]), float(centres[best]), low, high, float(totals[best]))
    if data.one_channel:
        return found
    return _folded(data, spacings, centres, scored[0], float(all_totals.max()), found) or found


def _with_flashes(
    data: Periodogram,
    spacings: NDArray[np.float64],
    centres: NDArray[np.float64],
    scored: Scored,
    mirrored: NDArray[np.float64] | float = 0.0,
) -> NDArray[np.float64]:
    """Scores of combs with their flashes, shape (combs,) [nats]; 0 where these cannot bring a comb near the best."""
    scores, lows, highs = scored
    all_scores = scores + mirrored
    share = REST_FLASH_SHARE if data.rest_half > 0 else FLASH_SHARE
    near = np.flatnonzero((1 + share) * all_scores >= MULTIPLE_SHARE * all_scores.max())
    flashes = flash_evidence(data, spacings[near], centres[near], lows[near], highs[near])
    totals = np.zeros(len(spacings))
    totals[near] = scores[near] + np.minimum(flashes, share * scores[near])
    return totals


def _folded(
    data: Periodogram,
    spacings: NDArray[np.float64],
    centres: NDArray[np.float64],
    within: NDArray[np.float64],
    most: float,
    found: Candidate,
) -> Candidate | None:
    """The best comb with folded lines, if one is believed beside those without.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacings, centres, within : ndarray, shape (candidates,)
        Combs [cycles a sample] and their scores within the span [nats].
    most : float
        The highest score of any of these, with flashes [nats].
    found : Candidate
        The one chosen of these.
    """
    is_loud = most > REFINED_FROM
    ends_within = found.reach < FILLS_SPAN
    if fastest_tip(data) <= 0.5 or (is_loud and ends_within):
        return None
    # folded lines lie up to FOLDED_TIMES as far out, so the spacing must be tried in steps as much finer
    count = FOLDED_STEPS if is_loud else 0
    tried = spacings[:, None] * factors_about(data.pulses, count, 2 * FINE_STEPS * FOLDED_TIMES)
    spacings, (scores, lows, highs) = loudest_of_each(data, tried, centres, outermost_orders(data, tried.ravel()))
    own = (scores > within + FOLDED_NATS) & comes_back(highs, spacings) & (spacings > FINER * found.spacing)
    if not own.any():
        return None
    totals = np.zeros(len(spacings))
    totals[own] = _with_flashes(data, spacings[own], centres[own], (scores[own], lows[own], highs[own]))
    same = np.abs(spacings / found.spacing - 1) * data.pulses < SAME_BINS
    # the folded lines of a multiple may be all other lines of the comb found: it then needs hardly more than that
    # score. But an even multiple scores nearly as much where an odd number of blades flashes twice a period
    times = np.rint(spacings / found.spacing)
    off = np.abs(spacings / np.maximum(times, 1) / found.spacing - 1) * data.pulses
    whole = (times > 2) & (times % 2 == 1) & (off < SAME_BINS)
    least = np.where(whole, SAME_LINES_SHARE * most, most / UNFOLDED_SHARE)
    held = own & same
    if held.any():
        least = np.maximum(least, float(totals[held].max()) / np.where(times % 2 == 0, UNFOLDED_SHARE, HELD_SHARE))
    believed = held | (own & (totals > least))
    if not believed.any():
        return None
    best = int(np.where(believed, totals, 0.0).argmax())
    low, high = int(lows[best]), int(highs[best])
    return Candidate(float(spacings[best]), float(centres[best]), low, high, float(totals[best]))
