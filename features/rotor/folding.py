"""Tips faster than the unambiguous velocity: their lines come back from the other end of the span."""

import numpy as np
from numpy.typing import NDArray

from ..lines import from_whole
from .periodogram import Periodogram

#: No blade's tip is faster [m/s]; a radar of a wide span sees further, but what stands there is another's or noise.
FASTEST_TIP_MPS = 250.0

#: Lines up to so many times the unambiguous velocity are told from the others where they fall further than so many bins
#: from these. (A comb of a fraction of the spacing finds some of them among its own.)
FOLDED_TIMES, FOLDED_BINS = 4, 2.0

#: Where lines reach so far from the body, further ones may come back [cycles a sample]: noise hides the outermost.
FILLED = 0.42


def comes_back(
    order: NDArray[np.intp] | int, spacing: NDArray[np.float64] | float
) -> NDArray[np.bool_] | np.bool_ | bool:
    """True where a line so many orders from the body, so far apart [cycles a sample], lies past the end of the span."""
    return order * spacing > 0.5


def may_come_back(order: int, spacing: float) -> bool:
    """True where lines out to so many orders, so far apart [cycles a sample], fill the span."""
    return order * spacing >= FILLED


def fastest_tip(data: Periodogram) -> float:
    """How far from the body lines of the fastest tip are [cycles a sample]."""
    return 2 * FASTEST_TIP_MPS / (data.wavelength_m * data.prf_hz)


def _beside_bins(ends: NDArray[np.float64], turns: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """How far ends of spans lie from a line of a comb [bins]: given in its spacings, as `turns`, one span, is."""
    return np.asarray(np.abs(from_whole(ends)) / turns * pulses, np.float64)


def comes_round(spacing: float, pulses: int, within_bins: float = FOLDED_BINS) -> bool:
    """True where the lines of a comb, so far apart [cycles a sample], fall on its own where they come back."""
    turns = np.asarray(1 / spacing)
    return bool(_beside_bins(turns, turns, pulses) <= within_bins)


def outermost_orders(data: Periodogram, spacings: NDArray[np.float64] | float) -> NDArray[np.intp]:
    """The outermost orders whose lines can be told from the others, of combs of these spacings.

    Those of one side fill half a span after the other, each so much beside the lines before as the span makes no whole
    spacings.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacings : ndarray or float
        [cycles a sample].

    Returns
    -------
    ndarray of int, same shape
        Of lines within half a span at least, and of none that would be a faster tip's than any.
    """
    turns = np.asarray(1 / np.asarray(spacings), np.float64)
    spans = np.multiply.outer(np.arange(1, FOLDED_TIMES), turns)
    beside_bins = _beside_bins(spans, turns, data.pulses)
    halves = 1 + np.logical_and.accumulate(beside_bins > FOLDED_BINS, axis=0).sum(axis=0)
    # the outermost of both sides meet where a half span ends
    ends = halves / 2 - np.where(halves > 1, FOLDED_BINS / 2 / data.pulses, 0.0)
    furthest = np.minimum(ends, max(fastest_tip(data), 0.5))
    return np.asarray(furthest * turns, np.float64).astype(np.intp)
