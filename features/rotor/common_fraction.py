"""A comb that holds several rotors' lines among its own: at a common fraction of their rates.

In a long dwell the lines of rotors some hertz apart part at the lowest orders: nothing lies at one spacing for all of
them. A fifth of one rate is then a sixth of another's, and a comb at that holds the lines of both, more than those of
either. But a rotor's comb has nearly all of its lines, and of such a one most are not there.
"""

from dataclasses import replace
from itertools import starmap

import numpy as np
from numpy.typing import NDArray

from .comb_search import FINE_STEPS, FLASH_SHARE, Candidate, factors_about, loudest_of_each, spacing_limits
from .flashes import flash_evidence
from .folding import may_come_back
from .periodogram import Periodogram

#: A comb may be such a fraction where fewer of its lines are there than the one share: then a multiple is the rotor's
#: of which more than the other share are there. Of rotors' combs near the noise fewer are there, but of no multiple
#: more.
FEW_THERE, MOST_THERE = 0.75, 0.85

#: And where a line of that multiple speaks for it by so much on average [nats], of `LINE_CAP` at most.
LEAST_MEAN_NATS = 2.5

#: And where so large a share of what speaks for the comb found speaks for it: one that holds two rotors' lines among
#: others is hardly twice as loud as the louder one, some outer lines by chance are a far smaller share.
WHOLE_SHARE = 0.65

#: Multiples tried.
MULTIPLES = range(2, 10)

#: Rates of which a comb is nearly a fraction are off from its multiple by up to so many bins at the PRF.
OFF_BINS = 4


def of_one_rotor(data: Periodogram, found: Candidate) -> Candidate:
    """The comb of one rotor, where that found holds the lines of several at a common fraction; else the same.

    Parameters
    ----------
    data : Periodogram
        The record.
    found : Candidate
        The comb found in it.
    """
    # lines that come back from the other end of the span lie between a comb's own
    if data.one_channel or may_come_back(max(found.high, -found.low), found.spacing):
        return found
    there, _ = _lines_there(data, found)
    highest = spacing_limits(data.pulses, data.prf_hz)[1]
    multiples = np.array([multiple for multiple in MULTIPLES if multiple * found.spacing <= highest])
    if there > FEW_THERE or not len(multiples):
        return found
    steps = factors_about(data.pulses, OFF_BINS * FINE_STEPS, FINE_STEPS)
    # such a comb may count about any of its lines, or about a place at rest where none is seen
    centres = np.array(sorted({found.centre, *data.strong.centres}))
    tried = np.tile(found.spacing * multiples[:, None] * steps, (len(centres), 1))
    about = np.repeat(centres, len(multiples))
    spacings, (scores, lows, highs) = loudest_of_each(data, tried, about)
    each = zip(*(values.tolist() for values in (spacings, about, lows, highs, scores)), strict=True)
    whole = [one for one in starmap(Candidate, each) if _is_whole(data, one)]
    best = max((_with_its_flashes(data, one) for one in whole), key=lambda one: one.score, default=found)
    return best if best.score > WHOLE_SHARE * found.score else found


def _lines_there(data: Periodogram, comb: Candidate) -> tuple[float, float]:
    """Share of a comb's lines, of those that can be seen, that are there; and what one speaks for on average [nats]."""
    order = np.arange(comb.low, comb.high + 1)
    frequency = comb.centre + comb.spacing * order[order != 0]
    nats: NDArray[np.float32] = data.contrast.rows[:, data.bins_of(frequency[data.usable(frequency)])]
    if not nats.size:
        return 1.0, 0.0
    best = nats[nats.sum(axis=1).argmax()]
    return float((best > 0).mean()), float(best.mean())


def _is_whole(data: Periodogram, comb: Candidate) -> bool:
    """True where nearly all lines of a comb are there, and speak for it loudly."""
    there, nats = _lines_there(data, comb)
    return there > MOST_THERE and nats > LEAST_MEAN_NATS


def _with_its_flashes(data: Periodogram, comb: Candidate) -> Candidate:
    """The same comb, its flashes counted in its score."""
    reach = (np.array([comb.low]), np.array([comb.high]))
    flashes = flash_evidence(data, np.array([comb.spacing]), np.array([comb.centre]), *reach)
    total = comb.score + min(float(flashes[0]), FLASH_SHARE * comb.score)
    return replace(comb, score=total)
