"""A comb that holds lines of several rotors: at a common fraction of their spacings, or at any finer spacing.

Lines of rotors of unlike rates stand all over the band. If a fifth of one spacing is a sixth of another, a comb of that
spacing holds the lines of both rotors and scores more than either. Any fine comb also meets some of many lines by
chance. But of a rotor's own comb nearly all lines are there, far more than of the places between them; of a comb that
holds several rotors few are.
"""

from collections.abc import Iterable
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lines import from_whole
from .comb_scores import heights, loudest_of_each
from .comb_search import FLASH_SHARE, Candidate, fine_factors, spacing_limits
from .flashes import flash_evidence
from .folding import may_come_back
from .periodogram import Periodogram

#: A comb may hold several rotors if no more than FEW_THERE of its lines are there and these have LOUD_NATS or more on
#: average [nats]: of any comb near the noise many are missing.
FEW_THERE, LOUD_NATS = 0.75, 1.6

#: Then a whole multiple of its spacing, to OFF_BINS [bins at the PRF], is the rotor's if more than WHOLE_THERE of its
#: lines are there, if a line has more than WHOLE_MEAN_NATS on average [nats] (at most `LINE_CAP`), and if it scores
#: more than WHOLE_SHARE of the comb found: a comb that holds two rotors' lines among others scores hardly twice the
#: louder rotor's, and outer lines met by chance add a far smaller share. Unlike blades leave the comb as it is.
OFF_BINS, WHOLE_THERE, WHOLE_MEAN_NATS, WHOLE_SHARE = 4, 0.85, 2.5, 0.65

#: Any other spacing, or a multiple above FEW_TIMES (near which one in twenty lies by chance), is the rotor's if a share
#: MOST_THERE of the lines is there, with LEAST_MEAN_NATS on average [nats]; if they reach SHARE_OF_REACH as far as the
#: comb found; if the evidence of presence is LEAST_TOLD [nats] and MORE_TOLD times that of the comb found; and if this
#: evidence times the score is SHARE_OF_BOTH of that product.
FEW_TIMES = 4
MOST_THERE, LEAST_MEAN_NATS = 0.78, 2.0
SHARE_OF_REACH, LEAST_TOLD, MORE_TOLD, SHARE_OF_BOTH = 0.75, 10.0, 1.08, 0.6

#: COARSER: least spacing of the combs tried, in spacings of that found; LOUDEST: how many of the best are examined.
COARSER, LOUDEST = 1.3, 60


def of_one_rotor(data: Periodogram, found: Candidate) -> Candidate:
    """The comb of one rotor, if the comb found holds the lines of several; else the comb found.

    Parameters
    ----------
    data : Periodogram
        The record.
    found : Candidate
        The comb found in it.
    """
    low, high = COARSER * found.spacing, spacing_limits(data.pulses, data.prf_hz)[1]
    if data.one_channel or low >= high:
        return found
    own = _told_by_presence(data, found)
    if own.there > FEW_THERE or own.mean_there < LOUD_NATS:
        return found
    # the outermost line within the span moves by half a bin from one to the next
    spacings = np.geomspace(low, high, int(np.ceil(np.log(high / low) * data.pulses)))
    # such a comb may count about any of its lines, or about a place at rest where none is seen
    centres = np.array(sorted({found.centre, *data.strong.centres}))
    about, tried = np.repeat(centres, len(spacings)), np.tile(spacings, len(centres))
    loudest = np.argsort(-heights(data.contrast, tried, about), kind="stable")[:LOUDEST]
    steps = fine_factors(data.pulses)
    spacings, (scores, lows, highs) = loudest_of_each(data, tried[loudest, None] * steps, about[loudest])
    each = zip(*(values.tolist() for values in (spacings, about[loudest], lows, highs, scores)), strict=True)
    coarser = _apart((Candidate(*values) for values in each), OFF_BINS / data.pulses)
    # the lines of the comb found may all lie on one side of its centre
    sides = (_told_by_presence(data, side) for side in (replace(found, low=0), replace(found, high=0)))
    told = max(one.told for one in (own, *sides))
    rotors = (_with_its_flashes(data, one) for one in coarser)
    return max((one for one in rotors if _is_rotors(data, one, found, told)), key=attrgetter("score"), default=found)


def _apart(combs: Iterable[Candidate], least: float) -> list[Candidate]:
    """The best combs, each more than `least` off better ones, relative: of many alike one is whole by chance."""
    taken: list[Candidate] = []
    for comb in sorted(combs, key=attrgetter("score"), reverse=True):
        if all(abs(comb.spacing / other.spacing - 1) > least for other in taken):
            taken.append(comb)
    return taken


def _is_rotors(data: Periodogram, comb: Candidate, found: Candidate, found_told: float) -> bool:
    """Whether a coarser comb is one rotor's and the one found holds the lines of several."""
    there, mean, _, told = _told_by_presence(data, comb)
    multiple = comb.spacing / found.spacing
    if abs(multiple / round(multiple) - 1) * data.pulses <= OFF_BINS:
        # folded lines lie between a comb's other lines
        comes_back = may_come_back(found.last, found.spacing)
        is_whole = there > WHOLE_THERE and mean > WHOLE_MEAN_NATS
        if is_whole and not comes_back and comb.score > WHOLE_SHARE * found.score:
            return True
        if round(multiple) <= FEW_TIMES:
            return False
    if there < MOST_THERE or mean < LEAST_MEAN_NATS or told < max(LEAST_TOLD, MORE_TOLD * found_told):
        return False
    reaches = comb.reach > SHARE_OF_REACH * min(found.reach, 0.5)
    return reaches and told * comb.score > SHARE_OF_BOTH * found_told * found.score


class _Presence(NamedTuple):
    """How many of a comb's lines are there (have positive evidence), of those that can be seen.

    Parameters
    ----------
    there : float
        Share of the lines that are there.
    mean : float
        Mean evidence of a line, there or not [nats].
    mean_there : float
        Mean evidence of the lines that are there [nats].
    told : float
        Evidence of that share against chance, out to the order where it is highest [nats], at least 0.
    """

    there: float
    mean: float
    mean_there: float
    told: float


def _told_by_presence(data: Periodogram, comb: Candidate) -> _Presence:
    """Presence of a comb's lines and its evidence.

    By chance the share of lines that are there is that of all places as near to the centre. The evidence is the
    binomial log likelihood ratio of the share found against that one.
    """
    order = np.arange(comb.low, comb.high + 1)
    frequency = comb.centre + comb.spacing * order
    seen = data.usable(frequency) & (order != 0)
    nats: NDArray[np.float32] = data.contrast.rows[:, data.bins_of(frequency[seen])]
    if not nats.size:
        return _Presence(1.0, 0.0, 0.0, 0.0)
    loudest = int(nats.sum(axis=1).argmax())
    row, own = data.contrast.rows[loudest], nats[loudest]
    there = own > 0
    lines, of_lines = _up_to_order(np.abs(order[seen]), there, comb.last)
    size = len(row)
    turns = from_whole(np.arange(size) / size - comb.centre) / comb.spacing
    near = data.seen & (turns > comb.low - 0.5) & (turns < comb.high + 0.5)
    places, of_places = _up_to_order(np.rint(np.abs(turns[near])).astype(np.intp), row[near] > 0, comb.last)
    least = 0.5 / np.maximum(lines, 1)
    share = of_lines / np.maximum(lines, 1)
    chance = np.clip(of_places / np.maximum(places, 1), least, 1 - least)
    some = np.clip(share, least, 1 - least)
    told = lines * (some * np.log(some / chance) + (1 - some) * np.log((1 - some) / (1 - chance)))
    most = float(np.where(share > chance, told, 0.0).max())
    return _Presence(float(share[-1]), float(own.mean()), float(own[there].sum() / max(there.sum(), 1)), most)


def _up_to_order(
    orders: NDArray[np.intp], there: NDArray[np.bool_], last: int
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Number of these places up to each order, and how many of them are there, shape (last + 1,)."""
    orders = np.minimum(orders, last)
    count, held = (np.bincount(orders, weights, last + 1).cumsum() for weights in (None, there))
    return count, held


def _with_its_flashes(data: Periodogram, comb: Candidate) -> Candidate:
    """The same comb with the evidence of its flashes added to its score."""
    reach = (np.array([comb.low]), np.array([comb.high]))
    flashes = flash_evidence(data, np.array([comb.spacing]), np.array([comb.centre]), *reach)
    total = comb.score + min(float(flashes[0]), FLASH_SHARE * comb.score)
    return replace(comb, score=total)
