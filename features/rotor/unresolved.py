"""Whether the single rotors found in a record are all that there are."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import from_whole, squared
from .comb import Comb
from .comb_fit import CombFit
from .flash_count import FLASH_PADDING, FLASH_WIDTH, flashes_in_period
from .left_flashes import others_flash
from .like_lines import like_shares
from .periodogram import Periodogram
from .points import fit_points
from .rotors import RATE_SPREAD, RESOLVED_BINS, TWO_POWER, Rotors, may_hold
from .unlike_blades import blade_numbers

#: A rotor flashes once a period on each side of the body. A second flash of this share of the first one's power is
#: another rotor's, of a rate that the dwell does not tell apart, where so many lines tell.
SECOND_FLASH_SHARE, LEAST_FLASH_LINES = 0.3, 6

#: The same of a comb among others that has the power of two: rotors alone that are so much stronger than another leave
#: 0.02 to 0.08.
STRONG_FLASH_SHARE = 0.1

#: Of each comb's lines at least this share is like another's, of few orders more: 0.7 and more of eight rotors told
#: apart at 9.85 GHz, 0.77 of nearly all sets counted right at 3.3 to 24 GHz and 0 to 20 dB; in two of three of those in
#: which fewer were told it is below 0.75. Few lines fit changing rates better: four that change have 0.92 and more at
#: 10 and 20 dB, two that four steady ones passed for 0.76 to 0.83.
LEAST_LIKE, LEAST_LIKE_FEW, LEAST_LIKE_CHANGING = 0.65, 0.75, 0.88

#: Two rotors whose rates the dwell does not tell apart flash together by chance, the more often the fewer orders show
#: it. With fewer than this to each side unlike powers, or an odd number of combs, are the only signs of them: where
#: an odd number was let pass, 29 of 201 sets told at 3.3 and 5.8 GHz were not of the four there were, else 9 of 181.
FEW_ORDERS = 16

#: Of more orders an odd number and unlike powers are: of three like rotors told at 9.85 GHz and 0 dB the powers are
#: within this in 14 of 17, where four passed for three at 0 dB and 9.85 or 24 GHz they were not in three.
ODD_POWER = 1.45

#: Blades that reflect at their tips are taken for this many, at most.
MOST_TIPS = 6

#: Points along a rotor's blades explain all of its lines but for this share of their power: 0.005 at most where blades
#: are such rows; where they are not, or rotors of one rate are several, 0.02 and more is left.
ROW_LEFT = 0.012

#: What is left between the lines within the band, over what is left beyond it, and as a share of the lines' power,
#: speaks of rotors that were not found where it exceeds both of these.
LEFT_OVER, LEFT_SHARE = 0.3, 0.05
LEAST_BINS = 100

#: A family of fewer lines than this to a side lies near the body: what is left of it is looked for from half a line out
#: to the edge, in so many bins at least, and what a lone rotor leaves is held to the share of several where it comes to
#: so many deviations. (Of 56 sets told as all there were, 30 to 160 ms at 2.4 to 24 GHz, 34 were not; now 18 of 38.)
FEW_LINES, LEAST_BINS_FEW, FEW_DEVIATIONS = 8, 16, 5.0

#: What a lone rotor leaves may be a change of its rate; from this share of its lines' power on they say little of it.
LEFT_ALONE = 0.25

#: Where that much of it is left, rates wander: all but the loudest rotor's lines run into one another, and its rate
#: says little of theirs. Of steady rotors nothing is left, whether the dwell tells their rates apart or not.
LEFT_WANDERING = 0.5

#: As does what is left where it comes, with so many of its deviations, to the mean rotor found: one more like it would
#: not have been seen.
HIDDEN_DEVIATIONS = 1.5

#: What stands past the edge of a lone rotor's family, out to so many times it, speaks of rotors whose outer lines part
#: where it comes to so many deviations, and to this share of the lines' power.
PAST_EDGE, PAST_DEVIATIONS, PAST_SHARE = 4.0, 4.0, 0.2


def _flashes_twice(fit: CombFit, per_turn: int, tip: float, share: float = SECOND_FLASH_SHARE) -> bool:
    """True where a comb's phases show the flashes of two rotors in each period, the second one of a share of the first.

    A blade that reflects along its length flashes once on each side. One that reflects at its tip alone is seen twice
    at every speed below the tip's, before and after that comes straight on: its lines are J_n(Gamma) (the paper's eq.
    24), and flash once when these are taken for what they are; `tip` is the order its edge has.
    """
    blades = [None, *((number, tip) for number in range(1, MOST_TIPS + 1))]
    return all(_second_flashes(fit, per_turn, blade, share) for blade in blades)


def _second_flashes(fit: CombFit, per_turn: int, tip: tuple[int, float] | None, share: float) -> bool:
    """True where the second flashes on both sides are as strong as another rotor's, for blades of one kind.

    Parameters
    ----------
    fit, per_turn
        The comb, and the strong lines' spacing in lines of it.
    tip : (int, float), optional
        Blades that reflect at their tips, and the tip's order; else they reflect along their length.
    share
        Of the first flash's power, both sides' mean, each half of it at least.
    """
    from scipy.special import jv  # here, because predicting needs no such import

    shares = []
    for sign in (-1, 1):
        side = np.flatnonzero((sign * fit.orders > 0) & (fit.orders % per_turn == 0))
        order = np.abs(fit.orders[side]) // per_turn
        if len(side) < LEAST_FLASH_LINES:
            continue
        lines = np.zeros(order.max() + 1, np.complex128)
        lines[order] = fit.amplitudes[side]
        size = FLASH_PADDING * len(lines)
        alone = np.zeros(size)
        if tip is not None:
            shape = jv(tip[0] * np.arange(len(lines)), tip[0] * tip[1])
            lines *= shape
            shape[np.setdiff1d(np.arange(len(lines)), order)] = 0.0
            alone = np.abs(fft.fft(shape**2, size)) ** 2 / max(float((shape**2).sum()) ** 2, 1e-30)
        power = np.abs(fft.fft(lines, size)) ** 2
        first = int(power.argmax())
        if not power[first]:  # such tips have no lines of these orders: those that are there flash as another kind's
            return False
        power = power / power[first] - np.roll(alone, first)  # few lines of unlike strength flash beside as well
        lines_away = np.abs((np.arange(size) - first + size // 2) % size - size // 2) / FLASH_PADDING
        other = lines_away > FLASH_WIDTH
        for part in (2, 3):  # unequal blades of one rotor flash at fractions of the turn
            other &= np.abs(lines_away - len(lines) / part) > 1
        shares.append(float(power[other].max(initial=0.0)))
    return len(shares) == 2 and min(shares) > share / 2 and sum(shares) > 2 * share


#: Of each bin: how far from a centre it is [cycles a sample], its power, whether it can be seen.
_About = tuple[NDArray[np.float64], NDArray[np.floating], NDArray[np.bool_]]


def power_about(data: Periodogram, rest: NDArray[np.complex128], centre: float) -> _About:
    """Of each bin of what is left: how far from a centre it is [cycles a sample], its power, whether it can be seen.

    A background's skirt is nothing that rotors leave: there the power is in units of that, or what is so loud would
    outweigh all others by chance.
    """
    frequency = fft.fftfreq(data.pulses)
    away = np.abs(from_whole(np.abs(frequency - centre)))
    seen = data.usable(frequency) & data.in_band(frequency)
    power = squared(fft.fft(rest)) / data.pulses
    skirt = data.in_skirt(frequency)
    if skirt.any():
        power[skirt] /= np.maximum(data.level_of(rest)(frequency[skirt]), 1.0)
    return away, power, seen


class Left(NamedTuple):
    """What combs leave within their band.

    Parameters
    ----------
    share : float
        Of the lines' power, 0 where it is not clearly more than the noise beyond the band.
    may_hide : bool
        Whether it may be a rotor.
    deviations : float
        How far it is from noise, in its own deviations; infinite where too little of the band is seen to tell.
    few : bool
        Whether the family has so few lines that it was looked at right beside them.
    """

    share: float
    may_hide: bool
    deviations: float
    few: bool


def left_over(about: _About, fits: Sequence[CombFit], edge: float) -> Left:
    """What is left within the band.

    Fitted lines take noise out with them: each as much as it was let free, those that lie in one another only once.
    """
    away, power, usable = about
    pulses = len(power)
    few = edge < FEW_LINES * fits[0].spacing
    low, high = (0.5 * fits[0].spacing, edge) if few else (2 * fits[0].spacing, 0.9 * edge)
    within = usable & (away < high) & (away > low)
    beyond = usable & (away > 1.1 * edge)
    if within.sum() < (LEAST_BINS_FEW if few else LEAST_BINS):
        return Left(0.0, False, np.inf, few)
    # where lines come back from the other end of the span, or leave too little of it, the floor tells the noise
    nothing_beyond = edge > 0.5 or beyond.sum() < LEAST_BINS
    noise = 1.0 if nothing_beyond else float(power[beyond].mean())
    over = float(power[within].mean()) - noise
    lines = sum(float((np.abs(fit.amplitudes) ** 2).sum()) for fit in fits) * pulses
    share = over * within.sum() / lines if over > LEFT_OVER * noise else 0.0
    range_bins = float(np.ptp([fit.spacing for fit in fits])) * pulses
    held, taken = 0.0, 0.0
    for fit in fits:
        order = np.abs(fit.orders)
        inside = (order * fit.spacing < high) & (order * fit.spacing > low)
        held += float((np.abs(fit.amplitudes[inside]) ** 2).sum()) * pulses / len(fits)
        apart = np.minimum(1.0, (1 + order[inside] * range_bins) / len(fits))
        taken += float((apart * fit.snr[inside] / (1 + fit.snr[inside])).sum())
    deviation = noise * float(np.sqrt(1 / within.sum() + 1 / max(beyond.sum(), LEAST_BINS)))
    all_over = over + noise * taken / float(within.sum())
    may_hide = (all_over + HIDDEN_DEVIATIONS * deviation) * float(within.sum()) > held
    return Left(share, may_hide, all_over / deviation, few)


def _stands_past(about: _About, fits: Sequence[CombFit], edge: float) -> bool:
    """True where more than noise stands past the edge of a line family: near the noise its inner lines alone are seen.

    Rotors of unlike rates have their lines in one another at the inner orders, and apart at the outer ones.
    """
    away, power, usable = about
    furthest = min(PAST_EDGE * edge, (edge + 0.5) / 2)
    past = usable & (away > 1.1 * edge) & (away < furthest)
    far = usable & (away > furthest)
    if past.sum() < LEAST_BINS or far.sum() < LEAST_BINS:
        return False
    noise = float(power[far].mean())
    over = float(power[past].mean()) - noise
    lines = sum(float((np.abs(fit.amplitudes) ** 2).sum()) for fit in fits) * len(power)
    deviation = noise * float(np.sqrt(1 / past.sum() + 1 / far.sum()))
    least = PAST_SHARE if len(fits) == 1 else LEFT_SHARE
    return over > PAST_DEVIATIONS * deviation and over * past.sum() > least * lines


def _may_pair(rotors: Rotors, tip: float) -> bool:
    """True where one of several combs may be two rotors that flash together and pass for one.

    Like rotors of an airframe are of an even number, and of one power.

    Parameters
    ----------
    rotors : Rotors
        Several.
    tip : float
        Order of the edge of their lines.
    """
    if float(np.ptp(rotors.rates)) >= 2 * RATE_SPREAD * float(rotors.rates.mean()):
        return False
    few, odd = tip < FEW_ORDERS, len(rotors.fits) % 2 == 1
    unlike = bool(may_hold(rotors.fits, ODD_POWER if odd else TWO_POWER).max() > 1)
    return (few and odd) or ((few or odd) and unlike)


def _are_unlike(fits: Sequence[CombFit], edge: float, tip: float, *, changing: bool) -> bool:
    """True where the lines of one of several combs are not those of a rotor like another one.

    Parameters
    ----------
    fits, edge
        As of `like_shares`.
    tip : float
        Order of the edge.
    changing : bool
        Whether these were fitted as of rates that change.
    """
    few = LEAST_LIKE_CHANGING if changing else LEAST_LIKE_FEW
    return bool(like_shares(fits, edge).min() < (few if tip < FEW_ORDERS else LEAST_LIKE))


def judged(
    rotors: Rotors,
    data: Periodogram,
    comb: Comb,
    edge: float,
    blades: int | None = None,
    *,
    fitted_to: float | None = None,
) -> Rotors:
    """Rotors, called unresolved where their flashes, or what they leave, speak of more than were found.

    Parameters
    ----------
    rotors : Rotors
        From `separate_rotors`.
    data, comb, edge
        As there.
    blades : int, optional
        Of a rotor.
    fitted_to : float, optional
        How far out lines were fitted [cycles a sample from the body], where that may not be as far as they reach.
    """
    about = power_about(data, rotors.rest, rotors.fits[0].centre)
    share, hidden, deviations, few = left_over(about, rotors.fits, edge)
    any_rate = 2 * RATE_SPREAD * float(rotors.rates.mean())  # of one airframe
    if share > LEFT_WANDERING:
        rotors = replace(rotors, unseen=any_rate)
    if not rotors.resolved:
        return rotors
    several = len(rotors.fits) > 1
    per_turn = comb.per_turn if rotors.fits[0] is comb.fit else 1
    tip = edge / (per_turn * max(fit.spacing for fit in rotors.fits))  # an order is the same for all: blades are alike
    strong = may_hold(rotors.fits) > 1 if several else np.array([False])
    twice = any(
        _flashes_twice(fit, per_turn, tip, STRONG_FLASH_SHARE if more else SECOND_FLASH_SHARE)
        for fit, more in zip(rotors.fits, strong, strict=True)
    )
    paired = several and (_may_pair(rotors, tip) or _are_unlike(rotors.fits, edge, tip, changing=fitted_to is not None))
    if twice and not several and per_turn == 1:  # unlike blades of one rotor do so in its turn
        twice = flashes_in_period(comb.fit, blade_numbers(None), tip)[0] == 1
    if twice and not several:  # or points along a lone one's blades do
        numbers = range(1, MOST_TIPS + 1) if blades is None else (blades,)
        row = fit_points(rotors.fits[0], per_turn, data.pulses, numbers)
        if row is not None and row.left < ROW_LEFT:
            chopping = per_turn * rotors.fits[0].spacing
            rotors = replace(rotors, row_edge=(row.edge * chopping, row.edge_std * chopping))
            twice = False
    # lines that come back from the other end of the span are none of a family that ends within it
    contradicted = not several and rotors.fits[0].is_folded and edge < 0.5
    past = (not several or fitted_to is not None) and _stands_past(about, rotors.fits, fitted_to or edge)
    if fitted_to is None and others_flash(data, rotors.rest, (fit.spacing for fit in rotors.fits), edge):
        return not_all(rotors, data, any_rate)  # they may be any
    held_to = LEFT_SHARE if several or (few and deviations > FEW_DEVIATIONS) else LEFT_ALONE
    if not (twice or paired or hidden or past or contradicted or share > held_to):
        return rotors
    apart = abs(rotors.next_rate - float(rotors.rates[0])) if hidden and not several else 0.0
    return not_all(rotors, data, apart)


def not_all(rotors: Rotors, data: Periodogram, apart: float = 0.0) -> Rotors:
    """Rotors, called unresolved, spread by what the dwell tells apart at least, or by so much [cycles a sample]."""
    reach = max(int(np.abs(rotors.fits[0].orders).max()), 1)
    least = RESOLVED_BINS / (reach * data.pulses)
    return replace(rotors, resolved=False, spread=max(rotors.spread, least, apart))
