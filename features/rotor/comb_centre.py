"""Which line of a comb is the body's: orders are counted from that line."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..bodies import LINE_DB
from ..notch import parabola_offset
from .comb_scores import even_scores
from .comb_search import Candidate, fine_factors
from .folding import may_come_back, outermost_orders
from .half_comb import Extent
from .one_sided import Sides
from .periodogram import Periodogram
from .wide_line import BESIDE_BINS, is_beside

#: Bonus of a strong line as the body's: STRONG_LINE [nats] if it stands STRONG_OVER_DB [dB] over all lines of the comb,
#: in proportion below that, and STRONG_LINE_DB [nats] for each further dB. If blades are stronger than the body, their
#: outermost lines are the strongest, which tell nothing of the body.
STRONG_LINE, STRONG_OVER_DB = 10.0, 6.0
STRONG_LINE_DB = 1.0

#: A line with this bonus or more tells the body: one-sided lines about it must not outvote it [nats].
TELLS = 5.0

#: No line of blades stands ALONE_DB over all others [dB]: where lines fill the span, so that neither their ends nor
#: their symmetry tell the body, a line that does is the body's if it moves. Else it may be a background's, and the body
#: anywhere: with the standard deviation ANYWHERE [cycles a sample].
ALONE_DB, ANYWHERE = 15.0, 0.29

#: If a comb, counted from its outermost line, covers the whole span but for this many orders, it has no middle and
#: every line may be the body's.
AROUND_ORDERS = 4

#: EVEN: bonus of the order about which levels are symmetric [nats]. All within ENDS_DB of the strongest line counts
#: [dB], provided that line is more than CLEAR_DB over the noise [dB], so that both ends of the comb show.
EVEN, ENDS_DB, CLEAR_DB = 20.0, 20.0, 30.0

#: LEAST_UNEVEN: added to the variance of level differences between both sides, which are never more alike [nats^2].
#: UNEVEN_WEIGHT: factor on the log likelihood ratio of two orders by Gaussian levels, those of several rotors' lines.
LEAST_UNEVEN, UNEVEN_WEIGHT = 0.05, 3.0

#: Variance of the difference between unrelated levels on both sides [nats^2]. From half of it on, the bonus EVEN of the
#: most symmetric order is reduced.
UNRELATED = np.pi**2 / 3

#: ENDS_GAP: a line family continues across up to this many orders that do not show. MIDDLE_REACH: its order of symmetry
#: is sought up to this many orders from the middle of its ends.
ENDS_GAP, MIDDLE_REACH = 2, 3

#: If no line tells the body, all that stands over SHOWS times the level is compared with its mirror image about each
#: order. The image may be shifted by up to BESIDE bins of the padded spectrum; a line and its image fill PAIR_BINS.
SHOWS, BESIDE, PAIR_BINS = 3.0, 8, 12

#: This many of the most symmetric orders are tried as the body's.
EVENEST = 8

#: REST: highest bonus of a line at rest [nats]. A background is strong whatever hovers in it, and a line of the comb
#: may lie there by chance. HOVERS: what the bonus of a moving line lacks to this raises that limit, as many bodies
#: hover. If the strongest line is at rest and none moves, the body hides in the band taken out: REST is then added.
REST, HOVERS = 14.0, 5.0

#: Symmetry evidence up to FLAT does not rule out that all lines lie on one side of a strong body line; LEAST_EVEN
#: limits how far asymmetry counts against the middle, so that both stay possible [nats].
FLAT, LEAST_EVEN = 5.0, -2.0

#: A line nearer than this to velocity zero is at rest [bins].
AT_REST_BINS = 1.0

#: OWN_SHARE: a strong line is another target's if the comb counted from it scores no more than this share of the comb
#: counted from its own nearest line. ON_COMB_BINS: a line nearer than this to one of the comb lies on it [bins].
OWN_SHARE, ON_COMB_BINS = 0.15, 0.5

#: In the skirt of a static background, only what exceeds this many times the local level is a line.
OUT_OF_SKIRT = 12.0

#: OPEN_NATS: orders up to this far below the best one leave the choice open [nats]. NEAR_ORDERS: orders up to this far
#: from the best one are always compared with it.
OPEN_NATS, NEAR_ORDERS = 3.0, 3


def centred(data: Periodogram, found: Candidate) -> tuple[Candidate, float, float]:
    """Count a comb from the line that is most likely the body's.

    A rotor's lines reach equally far to both sides of the body and are as strong on both, and the body's own line is
    strong.

    Parameters
    ----------
    data : Periodogram
        The record.
    found : Candidate
        The comb, counted from any of its lines.

    Returns
    -------
    best : Candidate
        The same comb, counted from that line.
    open_orders : float
        Standard deviation of the body's order about the chosen one, over all that may be the body's; else 0.
    line_nats : float
        Bonus of the line at its centre, by how far that stands out as a body's does; `TELLS` or more tells the body.
    """
    evidence = data.contrast
    best, most = found, -np.inf
    totals: dict[int, float] = {}
    bonuses, even = _bonuses(data, found)
    alone = _alone(data, found)
    told = {place: nats for place, nats in bonuses.items() if nats > TELLS and _is_moving_one(data, alone, place)}
    if told:  # all other evidence is as good about any order
        bonuses, even = told, {}
    shifts = [round((centre - found.centre) / found.spacing) for centre in bonuses]
    # a comb that merges several rotors may miss the body's line a little: the better of both places counts
    either = np.stack([list(bonuses), found.centre + found.spacing * np.array(shifts)], axis=1)
    within, furthest = _furthest(data, found)
    steps, scores = _scores_about(data, found, either)
    scores = scores.max(axis=2)
    for shift, (centre, bonus), own in zip(shifts, bonuses.items(), scores.T, strict=True):
        index = int(own.argmax())
        total = float(own[index]) + bonus + even.get(shift, 0.0)
        totals[shift] = max(totals.get(shift, -np.inf), total)
        if total > most:
            most = total
            best = found if centre == found.centre else _counted_from(found, float(steps[index]), centre, shift, within)
    # a strong line that has the whole comb on one side, or of whose two sides only one was found, inherits that score
    halves = dict.fromkeys(totals, 0.0) if told else _half_found(data, found, best, bonuses)
    for shift, nats in (_one_sided(data, found, best, bonuses) | halves).items():
        totals[shift] = max(totals.get(shift, -np.inf), most + nats)
    shift = max(totals, key=totals.__getitem__)
    if totals[shift] > most or told:
        most = totals[shift]
        best = _counted_from(found, best.spacing, found.centre + found.spacing * shift, shift, within)
        if shift in halves:
            best = replace(best, low=-best.last, high=best.last)
    line_nats = _line_nats(bonuses, best)
    chosen = round((best.centre - found.centre) / found.spacing)
    near = chosen + np.arange(-NEAR_ORDERS, NEAR_ORDERS + 1)
    others = np.setdiff1d(np.append(near, list(even)).astype(np.intp), list(totals))
    places = best.centre + best.spacing * (others - chosen)
    scores, _ = even_scores(evidence, np.full(len(others), best.spacing), places, furthest)
    scores += [even.get(int(order), 0.0) for order in others]
    away = np.append(others, list(totals)) - chosen
    likely = np.exp(np.append(scores, list(totals.values())) - most)
    likely[likely < np.exp(-OPEN_NATS)] = 0.0
    if found.is_folded:
        _, (reach,) = even_scores(evidence, np.array([best.spacing]), np.array([best.centre]), furthest)
        best = replace(best, centre=best.centre - round(best.centre), low=-int(reach), high=int(reach))
        if not best.is_folded:  # it seemed folded only because it was counted from its end
            return centred(data, best)
    if alone and line_nats < TELLS:
        return best, ANYWHERE / best.spacing, line_nats
    return best, float(np.sqrt((likely * away**2).sum() / likely.sum())), line_nats


def _alone(data: Periodogram, found: Candidate) -> list[float]:
    """Lines that stand `ALONE_DB` over all else, if the comb's lines fill the span; else none [cycles a sample]."""
    if not may_come_back(found.last, found.spacing):
        return []
    highest = float((data.power * data.level * data.seen).max())
    return [place for place, level_db in data.strong.lines if level_db > 10 * np.log10(highest) + ALONE_DB]


def _is_moving_one(data: Periodogram, lines: list[float], place: float) -> bool:
    """Whether one of the lines that moves lies at a place, or beside it where it is wide."""
    return any(moves(data, line) and abs(place - line) * data.pulses <= BESIDE_BINS for line in lines)


def _counted_from(found: Candidate, spacing: float, centre: float, order: int, within: int) -> Candidate:
    """A comb counted from one of its orders, at most `within` orders far; spacing and centre [cycles a sample]."""
    low, high = max(min(found.low - order, 0), -within), min(max(found.high - order, 0), within)
    return Candidate(spacing, centre, low, high, found.score)


def _line_nats(bonuses: dict[float, float], comb: Candidate) -> float:
    """Bonus of the line that a comb is counted from; at least 0 [nats]."""
    own = (nats for place, nats in bonuses.items() if abs(place - comb.centre) < comb.spacing / 2)
    return max(own, default=0.0)


def _one_sided(data: Periodogram, found: Candidate, best: Candidate, bonuses: dict[float, float]) -> dict[int, float]:
    """Lead over the best order of strong lines that have the whole comb on one side, by order [nats].

    Symmetry about the best order counts against them. There are none if too little shows to judge that symmetry, if a
    filter took out the line of the best order, or if that order lies within the background.
    """
    if found.is_folded or data.one_channel or abs(best.centre) < data.rest_half:
        return {}
    strong = [place for place, level_db in data.strong.lines if level_db > LINE_DB and place in bonuses]
    rivals, span = {}, best.high - best.low
    for place in strong:
        order = round((place - best.centre) / best.spacing)
        sides = Sides(data, replace(best, centre=best.centre + best.spacing * order, low=-span, high=span))
        if order != 0 and sides.one_sided:
            rivals[place] = sides
    if not rivals:
        return {}
    own = Sides(data, best)
    if own.filtered_out or not own.compares:
        return {}
    even = max(own.even_nats() - FLAT, LEAST_EVEN) + _line_nats(bonuses, best)
    out: dict[int, float] = {}
    for place, sides in rivals.items():
        nats = bonuses[place] + max(sides.even_nats() - FLAT, 0.0) - even
        out[round((place - found.centre) / found.spacing)] = nats
    return out


def _half_found(data: Periodogram, found: Candidate, best: Candidate, bonuses: dict[float, float]) -> dict[int, float]:
    """Lead over the best order of lines that tell a moving body, of whose two sides the comb met one, by order [nats].

    The family ends as far to both sides of such a line, and surely not about the best order.
    """
    own = _line_nats(bonuses, best)
    lines = {place: nats for place, nats in bonuses.items() if nats > max(own, TELLS) and moves(data, place)}
    extent = None if found.is_folded or data.one_channel or not lines else Extent.of(data, found)
    if extent is None:
        return {}
    orders = {round((place - found.centre) / found.spacing): nats - own for place, nats in lines.items()}
    chosen = round((best.centre - found.centre) / found.spacing)
    return {order: nats for order, nats in orders.items() if extent.tells(order, chosen)}


def _furthest(data: Periodogram, found: Candidate) -> tuple[int, float]:
    """Outermost order that the body may have, and how far from it lines are looked for [cycles a sample]."""
    # lines past the end of the span are looked for only where folded ones were found
    within = int(outermost_orders(data, found.spacing)) if found.is_folded else int(0.5 / found.spacing)
    return within, within * found.spacing if found.is_folded else 0.5


def _scores_about(
    data: Periodogram, found: Candidate, places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spacings tried about that of a comb [cycles a sample], and scores with each, counted from each place [nats].

    The scores are of shape (spacings, *places.shape).
    """
    steps = found.spacing * fine_factors(data.pulses)
    tried = np.repeat(steps, places.size), np.tile(places.ravel(), len(steps))
    scores, _ = even_scores(data.contrast, *tried, _furthest(data, found)[1])
    return steps, scores.reshape(len(steps), *places.shape)


def _is_own(data: Periodogram, found: Candidate, line: float) -> bool:
    """False for another target's line, about which the comb has no lines: it tells nothing of the body."""
    nearest = found.centre + found.spacing * round((line - found.centre) / found.spacing)
    if abs(line - nearest) * data.pulses < ON_COMB_BINS or is_beside(data, found, line):
        return True
    there, own = _scores_about(data, found, np.array([line, nearest]))[1].max(axis=0)
    return bool(there > OWN_SHARE * own)


def moves(data: Periodogram, centre: float) -> bool:
    """True where a line is a moving body's; within the background's band only if another line is nearer to rest."""
    nearer = any(abs(line) < abs(centre) for line in data.strong.centres)
    return abs(centre) * data.pulses >= AT_REST_BINS and (nearer or abs(centre) > data.rest_half)


def _stands_out(
    data: Periodogram, places: NDArray[np.floating], power: NDArray[np.floating] | float
) -> NDArray[np.bool_]:
    """False where this power at places [cycles a sample] may be that of a static background's skirt."""
    return np.asarray(~data.in_skirt(places) | (power > OUT_OF_SKIRT * data.level_at(places)), np.bool_)


def _bonuses(data: Periodogram, found: Candidate) -> tuple[dict[float, float], dict[int, float]]:
    """Bonuses besides the comb's score [nats]: of lines by place [cycles a sample], of symmetry by order."""
    middle = found.centre + found.spacing * round((found.high + found.low) / 2)
    out = [(found.centre, 0.0), (middle, 0.0)]
    places = found.centre + found.spacing * np.arange(found.low, found.high + 1)
    if (found.high - found.low + AROUND_ORDERS) * found.spacing > 1:  # all around the circle: it has no middle
        out += [(float(place), 0.0) for place in places]
    power = data.at(places) * data.level_at(places) * data.usable(places)
    power *= _stands_out(data, places, power)
    highest_db = 10 * float(np.log10(power.max(initial=1.0)))
    others_db = max(highest_db, LINE_DB - STRONG_OVER_DB)
    moving, told = 0.0, []
    centres = data.strong.centres
    # the body is not hidden at rest where any line moves, even one right beside rest
    hides = abs(centres[0]) * data.pulses < AT_REST_BINS and not any(moves(data, line) for line in centres)
    for centre, level_db in sorted(data.strong.lines, key=lambda line: -abs(line[0])):
        if not _is_own(data, found, centre):
            continue
        is_line = _stands_out(data, np.array([centre]), 10 ** (level_db / 10))[0]
        over_db = max(level_db - others_db, 0.0) if is_line else 0.0
        nats = STRONG_LINE * min(over_db / STRONG_OVER_DB, 1.0)
        nats += STRONG_LINE_DB * max(over_db - STRONG_OVER_DB, 0.0)
        # without a background, a line at rest may still be an offset of the receiver
        if moves(data, centre):
            moving = nats
        elif hides:
            reach = int(data.rest_half / found.spacing) + 1
            hidden = found.centre % found.spacing + found.spacing * np.arange(-reach, reach + 1)
            out += [(float(place), nats) for place in hidden[np.abs(hidden) <= data.rest_half]]
            nats += REST
        else:
            nats = min(nats, REST + max(HOVERS - moving, 0.0))
        # the top of a wide line is not its mean, and the comb was moved to the mean
        place = found.centre if is_beside(data, found, centre) else centre
        orders = (place - found.centre) / found.spacing
        # spacings of several rotors differ: further from the middle, their common comb places lines less precisely
        from_middle = abs(orders - (found.low + found.high) / 2)
        off = (orders - round(orders)) * found.spacing * data.pulses / (1 + 0.2 * from_middle)
        if abs(off) < 1.5 and level_db > LINE_DB:
            out.append((place, nats - 16 * off**2))
            if moves(data, centre) and out[-1][1] > TELLS:
                told.append(round(orders))
    even: dict[int, float] = {}
    if not found.is_folded:  # a folded comb has lines on both sides of any order
        if max(nats for _, nats in out) < TELLS:
            even = _mirrored(data, found)
        if highest_db > CLEAR_DB:
            about = max(even, key=even.__getitem__, default=0)
            shifted = replace(
                found, centre=found.centre + found.spacing * about, low=found.low - about, high=found.high - about
            )
            unlikely, most_even = _even_orders(data, shifted, 10 ** ((highest_db - ENDS_DB) / 10))
            even |= {about + order: most_even - nats for order, nats in unlikely.items() if nats < most_even}
        # by chance several rotors of nearly one rate are as symmetric about another order: at most TELLS counts
        even |= {order: max(even.get(order, 0.0), max(even.values(), default=0.0) - TELLS) for order in told}
        evenest = sorted(even, key=even.__getitem__)[-EVENEST:]
        out += [(found.centre + found.spacing * order, 0.0) for order in evenest]
    most: dict[float, float] = {}
    for place, nats in out:  # a place may occur twice, as that of a line and as a hidden one
        most[place] = max(most.get(place, -np.inf), nats)
    return most, even


def _mirrored(data: Periodogram, found: Candidate) -> dict[int, float]:
    """Symmetry evidence of each order of a comb, from all that shows: 0 for the most symmetric one, else less [nats].

    The lines of several rotors, too, fall on lines when mirrored about the body; noise past an end of the comb does
    not. All orders are compared at once: products of a spectrum with its mirror images are its self-convolution.
    """
    shows = np.log(np.maximum(data.power * data.seen / SHOWS, 1))
    size = len(shows)
    spectrum, squares, seen = fft.rfft(np.stack([shows, shows**2, data.seen]))
    order = np.arange(found.low, found.high + 1)
    places = found.centre + found.spacing * order
    sums = np.rint(2 * places * size).astype(np.intp)[:, None] + np.arange(-BESIDE - 1, BESIDE + 2)
    # what has its mirror image in a band taken out tells nothing
    unlike = _lowest(fft.irfft(squares * seen - spectrum**2, size)[sums % size])
    pairs = max(np.count_nonzero(shows) / PAIR_BINS, 1)
    unlikely = pairs / 2 * np.log(2 * np.maximum(unlike, 0) / pairs + LEAST_UNEVEN)
    # half a span away all is as symmetric, but less of it is near: that order is penalised
    across = round(0.5 / found.spacing)
    both = (order - across >= found.low) | (order + across <= found.high)
    middle = np.exp(2j * np.pi * np.flatnonzero(shows) / size).sum()
    unlikely += EVEN * (both & ((middle * np.exp(-2j * np.pi * places)).real < 0))
    return dict(zip(order.tolist(), (unlikely.min() - unlikely).tolist(), strict=True))


def _lowest(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lowest inner value of each row, by a parabola through it and its neighbours also between columns."""
    row = np.arange(len(values))
    lowest = 1 + values[:, 1:-1].argmin(axis=1)
    before, own, after = (values[row, lowest + beside] for beside in (-1, 0, 1))
    is_lowest = (own < before) & (own < after)
    return np.asarray(own + is_lowest * (after - before) / 4 * parabola_offset(-before, -own, -after))


def _even_orders(data: Periodogram, found: Candidate, least: float) -> tuple[dict[int, float], float]:
    """Lead of the most symmetric order over each order near the middle of what exceeds `least`, and its bonus [nats].

    The highest level about each order counts, also that of rotors whose lines have parted from it. Levels as far to
    both sides differ by the blades' echoes and by chance; one variance is assumed for all.
    """
    size, furthest = len(data.power), int(0.49 / found.spacing)
    order = np.arange(-furthest, furthest + 1)
    places = found.centre + found.spacing * order
    borders = np.rint((np.append(places, places[-1] + found.spacing) - found.spacing / 2) * size).astype(np.intp)
    bins = np.arange(borders[0], borders[-1]) % size
    starts = borders[:-1] - borders[0]
    power = data.power * data.level
    seen = data.seen & _stands_out(data, np.arange(size) / size, power)
    highest = np.maximum.reduceat((power * seen)[bins], starts)
    # hidden is also an order of which only the line itself was taken out, and what is about it is seen
    hidden = ~(np.logical_or.reduceat(data.seen[bins], starts) & data.seen[data.bins_of(places)])
    shows = np.flatnonzero((highest > least) | hidden)
    hidden |= ~np.logical_or.reduceat(seen[bins], starts)
    # only groups that reach into the comb: another family may follow
    groups = np.split(shows, np.flatnonzero(np.diff(shows) > 1 + ENDS_GAP) + 1)
    own = [group for group in groups if np.any((order[group] >= found.low) & (order[group] <= found.high))]
    if not own:
        return {0: 0.0}, EVEN
    first, last = int(own[0][0]), int(own[-1][-1])
    half = (last - first) // 2 + ENDS_GAP
    nats = np.pad(np.log(np.maximum(highest, least)), half, constant_values=np.log(least))
    seen = np.pad(~hidden, half, constant_values=True)
    tried = np.arange((first + last) // 2 - MIDDLE_REACH, (first + last + 1) // 2 + MIDDLE_REACH + 1)
    tried = np.clip(tried, 0, len(order) - 1)
    after, before = (half + tried[:, None] + sign * np.arange(1, half + 1) for sign in (1, -1))
    both = seen[after] & seen[before]
    count = np.maximum(both.sum(axis=1), 1)
    uneven = (both * (nats[after] - nats[before]) ** 2).sum(axis=1) / count + LEAST_UNEVEN
    unlikely = UNEVEN_WEIGHT * count / 2 * np.log(uneven / uneven.min())
    related = float(np.clip(2 * (1 - uneven.min() / UNRELATED), 0, 1))
    return dict(zip(order[tried].tolist(), unlikely.tolist(), strict=True)), EVEN * related
