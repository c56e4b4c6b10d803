"""Which line of a comb is the body's, about which its orders count."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..bodies import LINE_DB
from ..notch import parabola_offset
from .comb_scores import even_scores
from .comb_search import FINE_STEPS, Candidate, factors_about
from .folding import outermost_orders
from .one_sided import Sides
from .periodogram import Periodogram
from .wide_line import is_beside

#: What speaks for the comb's centre where a line stands so far over all others of it [nats, dB], and more for each dB
#: beyond. Blades may be the stronger: then their outermost lines are, and say nothing of the body.
STRONG_LINE, STRONG_OVER_DB = 10.0, 6.0
STRONG_LINE_DB = 1.0

#: A line that speaks for so much tells the body: one-sided lines about it must not outvote it [nats].
TELLS = 5.0

#: Counted from its outermost line, a family that takes up most of the unambiguous span reaches around all of it but for
#: so many orders.
AROUND_ORDERS = 4

#: What speaks for the order about which all that shows within so much of the strongest line is even, where that stands
#: so high over the noise that both ends show [nats, dB, dB].
EVEN, ENDS_DB, CLEAR_DB = 20.0, 20.0, 30.0

#: Levels to both sides are never more alike than by this variance [nats^2]; what an order says that is less even than
#: another is so many times that of Gaussian levels, which are those of several rotors' lines.
LEAST_UNEVEN, UNEVEN_WEIGHT = 0.05, 3.0

#: By this variance [nats^2] levels to both sides differ that have nothing to do with one another; from half of it on it
#: says less that they are about even there.
UNRELATED = np.pi**2 / 3

#: A family goes on over so many orders that do not show. So far about the middle of its ends [orders] the one about
#: which it is even is sought.
ENDS_GAP, MIDDLE_REACH = 2, 3

#: Where no line tells the body, what shows so many times over the level is compared with its mirror image about each
#: order, twice as far from that as so many bins of the padded spectrum too; a line and its image take up so many.
SHOWS, BESIDE, PAIR_BINS = 3.0, 8, 12

#: So many orders about which all is most even are tried.
EVENEST = 8

#: What speaks for the order at rest at most where a background lies there, and more where no line that moves is as
#: strong as a body's [nats]: a background is strong whatever hovers in it, and a line of the comb comes as near to it
#: by chance, but many do hover. Where no line stands out that moves, the body hides in what was taken out there.
REST, HOVERS = 14.0, 5.0

#: Lines that are even about their middle no more than this may all lie on one side of another line, if that is a strong
#: one; however uneven they are, that leaves both open [nats].
FLAT, LEAST_EVEN = 5.0, -2.0

#: A line is at rest so near to it [bins].
AT_REST_BINS = 1.0

#: A strong line is another target's where the comb counted from it speaks for less than this share of what it does
#: counted from its own nearest line; lines nearer than this to one [bins] are as good as on it.
OWN_SHARE, ON_COMB_BINS = 0.15, 0.5

#: Before a static background only what stands so far out of its skirt is a line [times the local level].
OUT_OF_SKIRT = 12.0

#: Other orders that have at most so much less [nats] leave the choice open; asked are those within so many of the best.
OPEN_NATS, NEAR_ORDERS = 3.0, 3


def centred(data: Periodogram, found: Candidate) -> tuple[Candidate, float, bool]:
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
        The same comb.
    open_orders : float
        Standard deviation of the body's order, of those that may be the body's as well; 0 where none is as likely.
    has_line : bool
        Whether a line that stands out tells the body.
    """
    evidence = data.contrast
    best, most = found, -np.inf
    totals: dict[int, float] = {}
    bonuses, even = _bonuses(data, found)
    shifts = [round((centre - found.centre) / found.spacing) for centre in bonuses]
    # one comb for several rotors may pass a little beside the body's line: either place will do
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
    # as one-sided lines of a strong line's, all that speaks for the best order speaks for that one
    for shift, nats in _one_sided(data, found, best, bonuses).items():
        totals[shift] = max(totals.get(shift, -np.inf), most + nats)
    shift = max(totals, key=totals.__getitem__)
    if totals[shift] > most:
        most = totals[shift]
        best = _counted_from(found, best.spacing, found.centre + found.spacing * shift, shift, within)
    has_line = _line_nats(bonuses, best) >= TELLS
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
        if not best.is_folded:  # counted from its own end it only seemed to go all around the span
            return centred(data, best)
    return best, float(np.sqrt((likely * away**2).sum() / likely.sum())), has_line


def _counted_from(found: Candidate, spacing: float, centre: float, order: int, within: int) -> Candidate:
    """A comb counted from one of its orders, its spacing and centre as given [cycles a sample]."""
    low, high = max(min(found.low - order, 0), -within), min(max(found.high - order, 0), within)
    return Candidate(spacing, centre, low, high, found.score)


def _line_nats(bonuses: dict[float, float], comb: Candidate) -> float:
    """What speaks for the line that a comb is counted from besides the comb [nats]."""
    own = (nats for place, nats in bonuses.items() if abs(place - comb.centre) < comb.spacing / 2)
    return max(own, default=0.0)


def _one_sided(data: Periodogram, found: Candidate, best: Candidate, bonuses: dict[float, float]) -> dict[int, float]:
    """What speaks for strong lines that all of a comb's lines lie on one side of, by order [nats over the best].

    Nothing does where the best order tells the body by how even all is about it, where too little shows to say that, or
    where a filter took it out, or it hides in a background.
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


def _furthest(data: Periodogram, found: Candidate) -> tuple[int, float]:
    """Outermost order that the body may have, and how far from it lines are looked for [cycles a sample]."""
    # only lines that were found to come back from the other end of the span lie past it
    within = int(outermost_orders(data, found.spacing)) if found.is_folded else int(0.5 / found.spacing)
    return within, within * found.spacing if found.is_folded else 0.5


def _scores_about(
    data: Periodogram, found: Candidate, places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spacings tried about that of a comb [cycles a sample], and its score with each counted from each place [nats].

    The scores are of shape (spacings, *places.shape).
    """
    steps = found.spacing * factors_about(data.pulses, FINE_STEPS, 2 * FINE_STEPS)
    tried = np.repeat(steps, places.size), np.tile(places.ravel(), len(steps))
    scores, _ = even_scores(data.contrast, *tried, _furthest(data, found)[1])
    return steps, scores.reshape(len(steps), *places.shape)


def _is_own(data: Periodogram, found: Candidate, line: float) -> bool:
    """False for another target's line, about which the comb has no lines: it says nothing of the body's."""
    nearest = found.centre + found.spacing * round((line - found.centre) / found.spacing)
    if abs(line - nearest) * data.pulses < ON_COMB_BINS or is_beside(data, found, line):
        return True
    there, own = _scores_about(data, found, np.array([line, nearest]))[1].max(axis=0)
    return bool(there > OWN_SHARE * own)


def _moves(data: Periodogram, centre: float) -> bool:
    """True where a line is a moving body's: of slow ones, where another is nearer to rest, the background's."""
    nearer = any(abs(line) < abs(centre) for line in data.strong.centres)
    return abs(centre) * data.pulses >= AT_REST_BINS and (nearer or abs(centre) > data.rest_half)


def _stands_out(
    data: Periodogram, places: NDArray[np.floating], power: NDArray[np.floating] | float
) -> NDArray[np.bool_]:
    """False where so much power at places [cycles a sample] is a static background's skirt, or may be."""
    return np.asarray(~data.in_skirt(places) | (power > OUT_OF_SKIRT * data.level_at(places)), np.bool_)


def _bonuses(data: Periodogram, found: Candidate) -> tuple[dict[float, float], dict[int, float]]:
    """What speaks for the body's line besides the comb [nats]: by place [cycles a sample], and by order of the comb."""
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
    # a line beside rest is a slow body's own, and hides no other
    hides = abs(centres[0]) * data.pulses < AT_REST_BINS and not any(_moves(data, line) for line in centres)
    for centre, level_db in sorted(data.strong.lines, key=lambda line: -abs(line[0])):
        if not _is_own(data, found, centre):
            continue
        is_line = _stands_out(data, np.array([centre]), 10 ** (level_db / 10))[0]
        over_db = max(level_db - others_db, 0.0) if is_line else 0.0
        nats = STRONG_LINE * min(over_db / STRONG_OVER_DB, 1.0)
        nats += STRONG_LINE_DB * max(over_db - STRONG_OVER_DB, 0.0)
        # a line at rest that is no background may be an offset of the receiver all the same
        if _moves(data, centre):
            moving = nats
        elif hides:
            reach = int(data.rest_half / found.spacing) + 1
            hidden = found.centre % found.spacing + found.spacing * np.arange(-reach, reach + 1)
            out += [(float(place), nats) for place in hidden[np.abs(hidden) <= data.rest_half]]
            nats += REST
        else:
            nats = min(nats, REST + max(HOVERS - moving, 0.0))
        # a wide line's top is not its mean, which the comb was sought about
        place = found.centre if is_beside(data, found, centre) else centre
        orders = (place - found.centre) / found.spacing
        # several rotors' spacings differ: the further off, the less one comb for them all tells where a line must be
        from_middle = abs(orders - (found.low + found.high) / 2)
        off = (orders - round(orders)) * found.spacing * data.pulses / (1 + 0.2 * from_middle)
        if abs(off) < 1.5 and level_db > LINE_DB:
            out.append((place, nats - 16 * off**2))
            if _moves(data, centre) and out[-1][1] > TELLS:
                told.append(round(orders))
    even: dict[int, float] = {}
    if not found.is_folded:  # on both sides of any line there are those of the other end
        if max(nats for _, nats in out) < TELLS:
            even = _mirrored(data, found)
        if highest_db > CLEAR_DB:
            about = max(even, key=even.__getitem__, default=0)
            shifted = replace(
                found, centre=found.centre + found.spacing * about, low=found.low - about, high=found.high - about
            )
            unlikely, most_even = _even_orders(data, shifted, 10 ** ((highest_db - ENDS_DB) / 10))
            even |= {about + order: most_even - nats for order, nats in unlikely.items() if nats < most_even}
        # lines of several rotors of nearly one rate are as even about another order by chance
        even |= {order: max(even.get(order, 0.0), max(even.values(), default=0.0) - TELLS) for order in told}
        evenest = sorted(even, key=even.__getitem__)[-EVENEST:]
        out += [(found.centre + found.spacing * order, 0.0) for order in evenest]
    most: dict[float, float] = {}
    for place, nats in out:  # a place may come in twice, as a line's and as one that hides
        most[place] = max(most.get(place, -np.inf), nats)
    return most, even


def _mirrored(data: Periodogram, found: Candidate) -> dict[int, float]:
    """What speaks for each order of a comb by how even all that shows is about it: 0 for the evenest [nats].

    Lines of several rotors too lie where their mirror images about the body do, and noise past an end of the comb has
    none. All orders are compared at once: what a spectrum has in common with its mirror image is its own convolution.
    """
    shows = np.log(np.maximum(data.power * data.seen / SHOWS, 1))
    size = len(shows)
    spectrum, squares, seen = fft.rfft(np.stack([shows, shows**2, data.seen]))
    order = np.arange(found.low, found.high + 1)
    places = found.centre + found.spacing * order
    sums = np.rint(2 * places * size).astype(np.intp)[:, None] + np.arange(-BESIDE - 1, BESIDE + 2)
    # what has no image that could be seen, as a strong line's is taken out, says nothing
    unlike = _lowest(fft.irfft(squares * seen - spectrum**2, size)[sums % size])
    pairs = max(np.count_nonzero(shows) / PAIR_BINS, 1)
    unlikely = pairs / 2 * np.log(2 * np.maximum(unlike, 0) / pairs + LEAST_UNEVEN)
    # about the place across the circle all is as even, but less of it is near
    across = round(0.5 / found.spacing)
    both = (order - across >= found.low) | (order + across <= found.high)
    middle = np.exp(2j * np.pi * np.flatnonzero(shows) / size).sum()
    unlikely += EVEN * (both & ((middle * np.exp(-2j * np.pi * places)).real < 0))
    return dict(zip(order.tolist(), (unlikely.min() - unlikely).tolist(), strict=True))


def _lowest(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lowest value of each row within, between its columns too: where the parabola through three of them is."""
    row = np.arange(len(values))
    lowest = 1 + values[:, 1:-1].argmin(axis=1)
    before, own, after = (values[row, lowest + beside] for beside in (-1, 0, 1))
    is_lowest = (own < before) & (own < after)
    return np.asarray(own + is_lowest * (after - before) / 4 * parabola_offset(-before, -own, -after))


def _even_orders(data: Periodogram, found: Candidate, least: float) -> tuple[dict[int, float], float]:
    """Orders about which what shows of this power is about even, and what the evenest has before each, and by itself.

    All that lies about each order counts, the lines of several rotors too that it has parted from. The levels of two
    places as far to both sides differ by what the blades' echoes make of it and by chance, of one variance for all.
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
    # the strongest line may have been taken out alone, and what is left about it be seen
    hidden = ~(np.logical_or.reduceat(data.seen[bins], starts) & data.seen[data.bins_of(places)])
    shows = np.flatnonzero((highest > least) | hidden)
    hidden |= ~np.logical_or.reduceat(seen[bins], starts)
    # from what speaks for the comb outwards: another family may follow
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
