"""Which line of a comb is the body's, about which its orders count."""

import numpy as np

from .comb_search import FINE_STEPS, Candidate, even_scores
from .periodogram import LINE_DB, Periodogram

#: What speaks for the comb's centre where a line stands so far over all others of it [nats, dB], and more for each dB
#: beyond. Blades may be the stronger: then their outermost lines are, and say nothing of the body.
STRONG_LINE, STRONG_OVER_DB = 10.0, 6.0
STRONG_LINE_DB = 1.0

#: What speaks for the order about which all that shows within so much of the strongest line is even, where that stands
#: so high over the noise that both ends show [nats, dB, dB].
EVEN, ENDS_DB, CLEAR_DB = 20.0, 20.0, 30.0

#: A family goes on over so many orders that do not show. So far about the middle of its ends [orders] the one about
#: which it is even is sought.
ENDS_GAP, MIDDLE_REACH = 2, 3

#: What is at rest may be the background: its level counts up to so much over that of the strongest line that moves.
REST_DB = 15.0


def centred(data: Periodogram, found: Candidate) -> Candidate:
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
    Candidate
        The same comb.
    """
    pulses, evidence = data.pulses, data.contrast
    middle = found.centre + found.spacing * round((found.high + found.low) / 2)
    options = [(found.centre, 0.0), (middle, 0.0)]
    places = found.centre + found.spacing * np.arange(found.low, found.high + 1)
    power = data.at(places) * data.level_at(places) * data.usable(places)
    highest_db = 10 * float(np.log10(power.max(initial=1.0)))
    if highest_db > CLEAR_DB:
        order = _even_order(data, found, 10 ** ((highest_db - ENDS_DB) / 10))
        options.append((found.centre + found.spacing * order, EVEN))
    others_db = max(highest_db, LINE_DB - STRONG_OVER_DB)
    moving = max(
        (db for c, db in zip(data.centres, data.centres_db, strict=True) if abs(c) > data.rest_half), default=99.0
    )
    for centre, level_db in zip(data.centres, data.centres_db, strict=True):
        shown_db = level_db if abs(centre) > data.rest_half else min(level_db, moving + REST_DB)
        orders = (centre - found.centre) / found.spacing
        # several rotors' spacings differ: the further off, the less one comb for them all tells where a line must be
        off = (orders - round(orders)) * found.spacing * pulses / (1 + 0.2 * abs(orders))
        if abs(off) < 1.5 and level_db > LINE_DB:
            over_db = max(shown_db - others_db, 0.0)
            strong = STRONG_LINE * min(over_db / STRONG_OVER_DB, 1.0)
            more = STRONG_LINE_DB * max(over_db - STRONG_OVER_DB, 0.0)
            options.append((centre, strong + more - 16 * off**2))
    best, most = found, -np.inf
    steps = found.spacing * (1 + np.arange(-FINE_STEPS, FINE_STEPS + 1) / (2 * FINE_STEPS * pulses))
    for centre, bonus in dict(options).items():
        # one comb for several rotors may pass a little beside the body's line: either place will do
        beside = found.centre + found.spacing * round((centre - found.centre) / found.spacing)
        scores, _ = even_scores(evidence, np.repeat(steps, 2), np.tile([centre, beside], len(steps)))
        index = int(scores.argmax())
        if scores[index] + bonus > most:
            most = scores[index] + bonus
            if centre == found.centre:
                best = found
            else:
                shift = round((centre - found.centre) / found.spacing)
                best = Candidate(
                    float(steps[index // 2]),
                    centre,
                    min(found.low - shift, 0),
                    max(found.high - shift, 0),
                    found.score,
                )
    return best


def _even_order(data: Periodogram, found: Candidate, least: float) -> int:
    """Order about which what shows of this power is even.

    All that lies about each order counts, the lines of several rotors too that it has parted from.
    """
    size, furthest = len(data.power), int(0.49 / found.spacing)
    order = np.arange(-furthest, furthest + 1)
    borders = np.rint((found.centre + found.spacing * (np.append(order, furthest + 1) - 0.5)) * size).astype(np.intp)
    bins = np.arange(borders[0], borders[-1]) % size
    highest = np.maximum.reduceat((data.power * data.level * data.seen)[bins], borders[:-1] - borders[0])
    hidden = ~np.logical_or.reduceat(data.seen[bins], borders[:-1] - borders[0])
    shows = np.flatnonzero((highest > least) | hidden)
    # from what speaks for the comb outwards: another family may follow
    groups = np.split(shows, np.flatnonzero(np.diff(shows) > 1 + ENDS_GAP) + 1)
    own = [group for group in groups if np.any((order[group] >= found.low) & (order[group] <= found.high))]
    if not own:
        return 0
    first, last = int(own[0][0]), int(own[-1][-1])
    half = (last - first) // 2 + ENDS_GAP
    nats = np.pad(np.log(np.maximum(highest, least)), half, constant_values=np.log(least))
    seen = np.pad(~hidden, half, constant_values=True)
    tried = np.arange((first + last) // 2 - MIDDLE_REACH, (first + last + 1) // 2 + MIDDLE_REACH + 1)
    tried = np.clip(tried, 0, len(order) - 1)
    after, before = (half + tried[:, None] + sign * np.arange(1, half + 1) for sign in (1, -1))
    both = seen[after] & seen[before]
    uneven = (both * (nats[after] - nats[before]) ** 2).sum(axis=1) / np.maximum(both.sum(axis=1), 1)
    return int(order[tried[int(uneven.argmin())]])
