"""Folded lines: those of tips faster than the unambiguous velocity come back from the other end of the span."""

import numpy as np
from numpy.typing import NDArray

from ..lines import from_whole
from .periodogram import Periodogram

#: No blade tip is faster than this [m/s]; what a wide span shows beyond is another target's or noise.
FASTEST_TIP_MPS = 250.0

#: Folded lines up to FOLDED_TIMES the unambiguous velocity are told from the comb's other lines if they fall further
#: than FOLDED_BINS from these [bins]. (A comb of a fraction of the spacing finds some of them among its own.)
FOLDED_TIMES, FOLDED_BINS = 4, 2.0

#: If lines reach this far from the body, further ones may be folded [cycles a sample]: noise hides the outermost.
FILLED = 0.42


def comes_back(
    order: NDArray[np.intp] | int, spacing: NDArray[np.float64] | float
) -> NDArray[np.bool_] | np.bool_ | bool:
    """True where the line of this order, at this spacing [cycles a sample], lies past the end of the span."""
    return order * spacing > 0.5


def may_come_back(order: int, spacing: float) -> bool:
    """True where lines out to this order, at this spacing [cycles a sample], fill the span, so that more may fold."""
    return order * spacing >= FILLED


def fastest_tip(data: Periodogram) -> float:
    """How far from the body the lines of the fastest tip reach, unfolded [cycles a sample]."""
    return 2 * FASTEST_TIP_MPS / (data.wavelength_m * data.prf_hz)


def _beside_bins(ends: NDArray[np.float64], turns: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """How far ends of spans lie from the nearest line of a comb [bins]; `ends` and `turns`, one span, in spacings."""
    return np.asarray(np.abs(from_whole(ends)) / turns * pulses, np.float64)


def comes_round(spacing: float, pulses: int, within_bins: float = FOLDED_BINS) -> bool:
    """True where the folded lines of a comb of this spacing [cycles a sample] fall on its other lines."""
    turns = np.asarray(1 / spacing)
    return bool(_beside_bins(turns, turns, pulses) <= within_bins)


def outermost_orders(data: Periodogram, spacings: NDArray[np.float64] | float) -> NDArray[np.intp]:
    """The outermost orders whose lines can be told from the others, for combs of these spacings.

    The lines of one side fill one half span after another. Folded ones lie beside those before by what the spans are
    longer or shorter than whole spacings.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacings : ndarray or float
        [cycles a sample].

    Returns
    -------
    ndarray of int, same shape
        All orders within half a span, and none beyond the fastest tip's.
    """
    turns = np.asarray(1 / np.asarray(spacings), np.float64)
    spans = np.multiply.outer(np.arange(1, FOLDED_TIMES), turns)
    beside_bins = _beside_bins(spans, turns, data.pulses)
    halves = 1 + np.logical_and.accumulate(beside_bins > FOLDED_BINS, axis=0).sum(axis=0)
    # at the end of a half span the outermost lines of both sides meet
    ends = halves / 2 - np.where(halves > 1, FOLDED_BINS / 2 / data.pulses, 0.0)
    furthest = np.minimum(ends, max(fastest_tip(data), 0.5))
    return np.asarray(furthest * turns, np.float64).astype(np.intp)
