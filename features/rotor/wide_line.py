"""A comb that was counted from the top of a wide body line: its true centre lies beside that top.

A slowly turning body of several echoes has a line up to some bins wide, whose top is not its mean. Counted from the
top, a comb of slightly wrong spacing meets the lines of one side and misses those of the other: half a comb is found,
and its middle is not the body.
"""

import numpy as np

from .comb_scores import loudest_of_each
from .comb_search import FINE_STEPS, Candidate, factors_about
from .folding import outermost_orders
from .periodogram import Periodogram

#: How far from the line's top the centre of a comb is sought, and in what steps [bins]. For four points within 0.15 m
#: turning at 0.2 rad/s it lay up to 0.5 bins off at 24 and 35 GHz, for a line 1.5 bins wide up to 1.2.
BESIDE_BINS, STEP_BINS = 1.5, 0.25

#: The spacing of half a comb is wrong by some bins at the PRF: OFF_BINS are tried to each side, up to PASSES times.
OFF_BINS, PASSES = 2, 2

#: A comb is sought beside the line if its shorter side has no more than this share of the longer one's orders.
EVEN_SHARE = 0.6

#: A comb beside the line must score this much more [nats]: the best of as many trials gains up to four by chance.
MORE_NATS = 8.0


def beside_line(data: Periodogram, found: Candidate) -> Candidate:
    """The comb counted from a place near its line, where that scores enough more; else the same comb.

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
    """The best comb counted from a place near a comb's centre; the same comb if none scores `MORE_NATS` more."""
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
    """Whether a line [cycles a sample], not the background's, is near enough to a comb's centre to be its wide line."""
    return abs(line) >= data.rest_half and abs(line - comb.centre) * data.pulses <= BESIDE_BINS
