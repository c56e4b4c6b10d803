"""A comb that was counted from a body's line of some width: its middle lies beside that line's top.

A body of several echoes that turns slowly has a line up to some bins wide, of which the top is not the mean. Counted
from there the lines on one side are met by a spacing that is a little off, and those on the other are missed: what is
found is half a comb, and its middle no body's.
"""

import numpy as np

from .comb_scores import loudest_of_each
from .comb_search import FINE_STEPS, Candidate, factors_about
from .folding import outermost_orders
from .periodogram import Periodogram

#: How far beside the line's top the middle of a comb is sought [bins], and in what steps. Of four points within 0.15 m
#: that turned by 0.2 rad/s it lay up to 0.5 beside at 24 and 35 GHz, of a line 1.5 bins wide up to 1.2.
BESIDE_BINS, STEP_BINS = 1.5, 0.25

#: Half a comb's spacing is off by some bins at the PRF: so many to each side are tried, twice where that is not enough.
OFF_BINS, PASSES = 2, 2

#: A comb is sought beside the line where its shorter side has less than this share of the orders of the longer one.
EVEN_SHARE = 0.6

#: So much more must speak for it there [nats]: chance makes up to four of as many as are tried.
MORE_NATS = 8.0


def beside_line(data: Periodogram, found: Candidate) -> Candidate:
    """The comb about a place near the line that it was counted from, where more speaks for that; else the same.

    Parameters
    ----------
    data : Periodogram
        The record.
    found : Candidate
        The comb found in it.
    """
    if data.one_channel or abs(found.centre) < data.rest_half:  # a background's line has no comb beside it
        return found
    for _ in range(PASSES):
        if min(found.high, -found.low) > EVEN_SHARE * found.last:
            break
        found = _moved(data, found)
    return found


def _moved(data: Periodogram, found: Candidate) -> Candidate:
    """The loudest comb about places near the one that a comb counts from; the same where none is much louder."""
    centres = found.centre + np.arange(-BESIDE_BINS, BESIDE_BINS + STEP_BINS / 2, STEP_BINS) / data.pulses
    steps = factors_about(data.pulses, 2 * FINE_STEPS * OFF_BINS, 2 * FINE_STEPS)
    tried = np.tile(found.spacing * steps, (len(centres), 1))
    outermost = outermost_orders(data, tried.ravel()) if found.is_folded else None
    spacings, (scores, lows, highs) = loudest_of_each(data, tried, centres, outermost)
    best = int(scores.argmax())
    more = float(scores[best] - scores[len(centres) // 2])
    if more < MORE_NATS:
        return found
    return Candidate(float(spacings[best]), float(centres[best]), int(lows[best]), int(highs[best]), found.score + more)


def is_beside(data: Periodogram, comb: Candidate, line: float) -> bool:
    """Whether a line [cycles a sample] is so near to where a comb counts from that this may be sought beside it."""
    return abs(line) >= data.rest_half and abs(line - comb.centre) * data.pulses <= BESIDE_BINS
