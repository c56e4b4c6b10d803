"""Running sums of what speaks for the lines of many combs, order by order."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..evidence import MOST_SNRS, Evidence

#: Lines summed at once: they must stay in the cache. And orders at least and at most.
LINES_AT_ONCE, ORDERS_AT_ONCE = 16000, (6, 64)


def running_sums(
    evidence: Evidence, starts: NDArray[np.float64], steps: NDArray[np.float64], reach: float
) -> Iterator[NDArray[np.float32]]:
    """Sum the evidence of the lines of combs, from the first order to each further one.

    Parameters
    ----------
    evidence : Evidence
        Of each bin; past the last one it begins anew.
    starts : ndarray, shape (sides, combs)
        Place of each comb's order 0 [bins], so high that no line's is below 0.
    steps : ndarray, shape (sides, combs)
        From line to line [bins]; their sizes rise, and are the same on every side.
    reach : float
        Lines up to so far from order 0 count [bins].

    Yields
    ------
    ndarray of float32, shape (orders, sides, combs, MOST_SNRS)
        Sums out to each of the next orders, of the first combs only: of those that still have lines within reach.
        Past its last line a comb's sums stay as they are; 0 where there is no such line SNR.
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
