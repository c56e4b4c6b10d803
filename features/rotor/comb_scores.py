"""Scores of combs: the evidence of their lines, summed order by order out to where the sum is highest."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..evidence import MOST_SNRS, Evidence
from .periodogram import Periodogram

#: LINES_AT_ONCE: lines summed at once, which must fit into the cache; ORDERS_AT_ONCE: orders at least and at most.
LINES_AT_ONCE, ORDERS_AT_ONCE = 16000, (6, 64)

#: Penalty on a comb whose sides reach unequally far [nats].
UNEVEN_COST = 4.0


def running_sums(
    evidence: Evidence, starts: NDArray[np.float64], steps: NDArray[np.float64], reach: float
) -> Iterator[NDArray[np.float32]]:
    """Sum the evidence of the lines of combs, from the first order to each further one.

    Parameters
    ----------
    evidence : Evidence
        Evidence of each bin; indices past the last bin wrap around.
    starts : ndarray, shape (sides, combs)
        Place of each comb's order 0 [bins], so high that no line lies below bin 0.
    steps : ndarray, shape (sides, combs)
        Signed spacing [bins]; magnitudes rise from comb to comb and are the same on every side.
    reach : float
        Lines up to this far from order 0 count [bins].

    Yields
    ------
    ndarray of float32, shape (orders, sides, combs, MOST_SNRS)
        Sums out to each of the next orders, only of the first combs, which still have lines within reach. Past its
        last line a comb's sums stay constant; columns without a line SNR are 0.
    """
    nearest = starts + 0.5
    outermost = reach / np.abs(steps[0])
    before = np.zeros((*starts.shape, MOST_SNRS), np.float32)
    falling = -outermost
    first, last = 1, int(outermost.max(initial=0))
    while first <= last:
        some = int(falling.searchsorted(-first, side="right"))
        count = min(max(LINES_AT_ONCE // (len(starts) * some), ORDERS_AT_ONCE[0]), ORDERS_AT_ONCE[1])
        order = np.arange(first, min(first + count, last + 1))[:, None, None]
        first += len(order)
        every = int(falling.searchsorted(-order[-1, 0, 0], side="right"))
        place = order * steps[:, :some]
        place += nearest[:, :some]
        seen = evidence.table.take(place.astype(np.intp), mode="wrap")
        np.copyto(seen[..., every:], 0, where=order > outermost[every:some])  # to multiply takes twice the time
        sums = seen.view(np.float32).reshape(*seen.shape, MOST_SNRS)
        for inner, outer in zip((before[:, :some], *sums[:-1]), sums, strict=True):
            outer += inner
        before = sums[-1]
        yield sums


def score(
    evidence: Evidence,
    spacings: NDArray[np.float64],
    centres: NDArray[np.float64],
    outermost: NDArray[np.intp] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Score combs by their lines, on each side of the centre out to the order where the sum is highest.

    Parameters
    ----------
    evidence : Evidence
        Evidence of each bin.
    spacings, centres : ndarray, shape (candidates,)
        [cycles a sample].
    outermost : ndarray of int, shape (candidates,), optional
        Lines up to this order count, and both sides reach equally far. Without it lines within half a span of the
        centre count.

    Returns
    -------
    score : ndarray of float64, shape (candidates,)
        [nats]
    low, high : ndarray of int, shape (candidates,)
        Outermost orders.
    """
    size = evidence.rows.shape[-1]
    widest = (0.5 / spacings).astype(np.intp) if outermost is None else outermost
    order = np.arange(1, widest.max(initial=0) + 1)
    beyond = order > widest[:, None]
    step = (spacings * size)[:, None] * order
    middle = (centres * size)[:, None]
    places = [np.rint(middle + sign * step).astype(np.intp) for sign in (-1, 1)]
    number = np.arange(len(spacings))
    best = np.full(len(spacings), -np.inf, np.float32)
    reach = np.zeros((2, len(spacings)), np.intp)
    for row in evidence.rows:
        sides = [row.take(place, mode="wrap") for place in places]
        for side in sides:
            side[beyond] = 0.0
        for side in sides:
            side.cumsum(axis=1, out=side)
        # a rotor's lines reach equally far to both sides; unequal reaches cost what free choice of two ends may gain
        both = sides[0] + sides[1]
        last = both.argmax(axis=1)
        total = np.maximum(both[number, last], 0)
        ends = np.stack([last, last]) + 1
        if outermost is None:
            apart = np.stack([side.argmax(axis=1) for side in sides])
            peaks = np.stack([np.maximum(side[number, end], 0) for side, end in zip(sides, apart, strict=True)])
            uneven = peaks.sum(axis=0) - np.float32(UNEVEN_COST)
            ends = np.where(uneven > total, np.where(peaks > 0, apart + 1, 0), ends)
            total = np.maximum(total, uneven)
        better = total > best
        best[better] = total[better]
        reach[:, better] = ends[:, better]
    return best.astype(np.float64), -reach[0], reach[1]


#: Score of each comb [nats] and its outermost orders, low <= 0 <= high.
Scored = tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]


def loudest_of_each(
    data: Periodogram,
    tried: NDArray[np.float64],
    centres: NDArray[np.float64],
    outermost: NDArray[np.intp] | None = None,
) -> tuple[NDArray[np.float64], Scored]:
    """The best of the spacings tried for each comb, shape (combs, spacings), and what `score` gives for it."""
    scores, lows, highs = score(data.contrast, tried.ravel(), np.repeat(centres, tried.shape[1]), outermost)
    loudest = scores.reshape(tried.shape).argmax(axis=1) + np.arange(0, tried.size, tried.shape[1])
    return tried.ravel()[loudest], (scores[loudest], lows[loudest], highs[loudest])


def even_scores(
    evidence: Evidence, spacings: NDArray[np.float64], centres: NDArray[np.float64], furthest: float = 0.5
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Score combs whose two sides reach equally far.

    Parameters
    ----------
    evidence : Evidence
        Evidence of each bin.
    spacings, centres : ndarray, shape (candidates,)
        [cycles a sample]; the spacings rise.
    furthest : float
        Lines up to this far from the centre count [cycles a sample].

    Returns
    -------
    score : ndarray of float64, shape (candidates,)
        [nats]
    reach : ndarray of int, shape (candidates,)
        Outermost order.
    """
    best = np.full((len(spacings), MOST_SNRS), -np.inf, np.float32)
    reach = np.ones(best.shape, np.intp)
    first = 1
    for sums in _sums_of_sides(evidence, spacings, centres, furthest):
        both = sums[:, 0] + sums[:, 1]
        highest = both.max(axis=0)
        held, ends = best[: len(highest)], reach[: len(highest)]
        better = highest > held
        held[better], ends[better] = highest[better], both[:, better].argmax(axis=0) + first
        first += len(both)
    best = best[:, : len(evidence.rows)]
    row = best.argmax(axis=1)[:, None]
    scores = np.maximum(np.take_along_axis(best, row, axis=1)[:, 0], 0)
    return scores.astype(np.float64), np.take_along_axis(reach, row, axis=1)[:, 0]


def _sums_of_sides(
    evidence: Evidence, spacings: NDArray[np.float64], centres: NDArray[np.float64], furthest: float = 0.5
) -> Iterator[NDArray[np.float32]]:
    """`running_sums` to both sides of combs of rising spacings."""
    size = evidence.rows.shape[-1]
    # a line beyond half the PRF aliases to the other side; whole spans are added so that no place is below 0
    start, step = (np.ceil(furthest) + centres % 1.0) * size, spacings * size
    return running_sums(evidence, np.stack([start, start]), np.stack([-step, step]), furthest * size)


def heights(evidence: Evidence, spacings: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """The scores of many combs, as `score` gives them, without their reaches, shape (candidates,) [nats]."""
    rising = np.argsort(spacings)
    sides = np.zeros((2, len(rising), MOST_SNRS), np.float32)
    both = np.zeros((len(rising), MOST_SNRS), np.float32)
    for sums in _sums_of_sides(evidence, spacings[rising], centres[rising]):
        some = sums.shape[2]
        np.maximum(sides[:, :some], sums.max(axis=0), out=sides[:, :some])
        np.maximum(both[:some], (sums[:, 0] + sums[:, 1]).max(axis=0), out=both[:some])
    best = np.maximum(both, sides.sum(axis=0) - np.float32(UNEVEN_COST)).max(axis=1)
    out = np.empty(len(best))
    out[rising] = best
    return out
