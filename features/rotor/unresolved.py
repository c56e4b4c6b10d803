"""Whether the single rotors found in a record are all that there are."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import from_whole, squared
from .candidate_rates import RATE_SPREAD
from .comb import Comb
from .comb_fit import CombFit
from .flash_count import FLASH_PADDING, FLASH_WIDTH, flashes_in_period
from .left_flashes import others_flash
from .like_lines import like_shares
from .periodogram import Periodogram
from .points import fit_points
from .rotors import TWO_POWER, Rotors, may_hold, resolution
from .unlike_blades import blade_numbers

#: A rotor flashes once a period on each side of the body. A second flash of SECOND_FLASH_SHARE of the first one's
#: power, in LEAST_FLASH_LINES lines a side at least, is another rotor's whose rate is unresolved.
SECOND_FLASH_SHARE, LEAST_FLASH_LINES = 0.3, 6

#: The same for a comb among others that has the power of two: single rotors that are that much stronger than another
#: show 0.02 to 0.08.
STRONG_FLASH_SHARE = 0.1

#: Least share of each comb's line power that must match another comb's: LEAST_LIKE; with fewer than FEW_ORDERS orders
#: LEAST_LIKE_FEW, for changing rates LEAST_LIKE_CHANGING. It was 0.7 and more of eight rotors resolved at 9.85 GHz,
#: 0.77 of nearly all sets counted right at 3.3 to 24 GHz and 0 to 20 dB, and below 0.75 in two of three sets counted
#: too low. Few lines fit changing rates better: four changing rotors have 0.92 and more at 10 and 20 dB, two that four
#: steady ones passed for have 0.76 to 0.83.
LEAST_LIKE, LEAST_LIKE_FEW, LEAST_LIKE_CHANGING = 0.65, 0.75, 0.88

#: Two unresolved rotors may flash together by chance, the more often the fewer orders show it. With fewer orders than
#: this on each side, unequal powers or an odd number of combs are their only signs. With odd numbers accepted, 29 of
#: 201 sets reported at 3.3 and 5.8 GHz were not of the four rotors there were, else 9 of 181.
FEW_ORDERS = 16

#: With more orders, an odd number of combs counts only if their powers differ by more than this factor. Of three like
#: rotors reported at 9.85 GHz and 0 dB the powers are within it in 14 of 17 sets; where four passed for three at 0 dB
#: and 9.85 or 24 GHz they were not in three.
ODD_POWER = 1.45

#: Most blades assumed where blades reflect at their tips.
MOST_TIPS = 6

#: A row of points along a rotor's blades is accepted if it leaves less than this share of the lines' power: 0.005 at
#: most where blades are such rows; 0.02 and more for other blades or several rotors of one rate.
ROW_LEFT = 0.012

#: The residual between the lines within the band shows rotors not found if it exceeds the noise beyond the band by more
#: than LEFT_OVER of that noise and LEFT_SHARE of the lines' power. It needs LEAST_BINS bins.
LEFT_OVER, LEFT_SHARE = 0.3, 0.05
LEAST_BINS = 100

#: With fewer than FEW_LINES lines a side, the residual is taken from half a spacing off the body out to the edge, in
#: LEAST_BINS_FEW bins at least. A lone rotor's is held to the LEFT_SHARE of several where it exceeds FEW_DEVIATIONS
#: standard deviations. (Of 56 sets reported complete, 30 to 160 ms at 2.4 to 24 GHz, 34 were not; now 18 of 38.)
FEW_LINES, LEAST_BINS_FEW, FEW_DEVIATIONS = 8, 16, 5.0

#: A lone rotor's residual may come from a change of its rate; above this share of its lines' power it is unresolved.
LEFT_ALONE = 0.25

#: A residual above this share of the lines' power means wandering rates: lines of all but the strongest rotor run into
#: one another, and its rate says little of theirs. Steady rotors leave no residual, resolved or not.
LEFT_WANDERING = 0.5

#: A residual plus this many standard deviations that reaches the power of the mean rotor could hide one more rotor.
HIDDEN_DEVIATIONS = 1.5

#: Power past the family's edge, out to PAST_EDGE times the edge, shows rotors whose outer lines separate if it exceeds
#: PAST_DEVIATIONS standard deviations and PAST_SHARE of a lone rotor's line power (LEFT_SHARE of several's).
PAST_EDGE, PAST_DEVIATIONS, PAST_SHARE = 4.0, 4.0, 0.2


def _flashes_twice(fit: CombFit, per_turn: int, tip: float, share: float = SECOND_FLASH_SHARE) -> bool:
    """True where a comb's phases show two rotors' flashes a period, the second with a share of the first's power.

    A blade that reflects along its length flashes once on each side. A tip that alone reflects passes every speed below
    its own twice, before and after it moves straight at the radar: its lines are J_n(Gamma) (the paper's eq. 24), and
    flash once when weighted by that; `tip` is the order of the edge. All kinds of blades must show two.
    """
    blades = [None, *((number, tip) for number in range(1, MOST_TIPS + 1))]
    return all(_second_flashes(fit, per_turn, blade, share) for blade in blades)


def _second_flashes(fit: CombFit, per_turn: int, tip: tuple[int, float] | None, share: float) -> bool:
    """True where the second flashes on both sides are as strong as another rotor's, for one kind of blade.

    Parameters
    ----------
    fit, per_turn
        The comb; its strong lines are `per_turn` spacings apart.
    tip : (int, float), optional
        Number of blades that reflect at their tips, and the tip's order; None: blades reflect along their length.
    share
        Least power of the second flash over the first, mean of both sides; each side has half of it.
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
        if not power[first]:  # such tips have no lines at these orders: those seen are of another kind
            return False
        power = power / power[first] - np.roll(alone, first)  # few lines of unequal strength have side lobes
        lines_away = np.abs((np.arange(size) - first + size // 2) % size - size // 2) / FLASH_PADDING
        other = lines_away > FLASH_WIDTH
        for part in (2, 3):  # unequal blades of one rotor flash at fractions of the turn
            other &= np.abs(lines_away - len(lines) / part) > 1
        shares.append(float(power[other].max(initial=0.0)))
    return len(shares) == 2 and min(shares) > share / 2 and sum(shares) > 2 * share


#: Of each bin: its distance from a centre [cycles a sample], its power, whether it can be seen.
_About = tuple[NDArray[np.float64], NDArray[np.floating], NDArray[np.bool_]]


def power_about(data: Periodogram, rest: NDArray[np.complex128], centre: float) -> _About:
    """Each bin of a residual: its distance from a centre [cycles a sample], its power, whether it can be seen.

    The skirt of a static background is no residue of rotors. There the power is divided by the local level, or such
    loud bins would outweigh all others by chance.
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
    """Residual of combs within their band.

    Parameters
    ----------
    share : float
        Residual over the lines' power, 0 where it does not clearly exceed the noise beyond the band.
    may_hide : bool
        Whether it may hide a rotor.
    deviations : float
        Its excess over noise in standard deviations; infinite where too little of the band is seen to tell.
    few : bool
        Whether there are fewer than `FEW_LINES` lines a side, so that the residual close to the body counts.
    """

    share: float
    may_hide: bool
    deviations: float
    few: bool


def left_over(about: _About, fits: Sequence[CombFit], edge: float) -> Left:
    """The residual within the band.

    Fitted lines take out noise as well: each the share snr / (1 + snr), overlapping ones only once.
    """
    away, power, usable = about
    pulses = len(power)
    few = edge < FEW_LINES * fits[0].spacing
    low, high = (0.5 * fits[0].spacing, edge) if few else (2 * fits[0].spacing, 0.9 * edge)
    within = usable & (away < high) & (away > low)
    beyond = usable & (away > 1.1 * edge)
    if within.sum() < (LEAST_BINS_FEW if few else LEAST_BINS):
        return Left(0.0, False, np.inf, few)
    # where lines fold back over the span, or too little lies beyond the band, the noise is that of the floor
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
    """True where more than noise lies past the edge of a line family: near the noise only inner lines are seen.

    Lines of rotors of unequal rates overlap at the inner orders and separate at the outer ones.
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

    Like rotors of an airframe are even in number and equal in power.

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
    """True where the lines of one of several combs are unlike those of every other rotor.

    Parameters
    ----------
    fits, edge
        As in `like_shares`.
    tip : float
        Order of the edge.
    changing : bool
        Whether they were fitted with changing rates.
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
    """The rotors, marked unresolved where their flashes or their residual show more than were found.

    Parameters
    ----------
    rotors : Rotors
        From `separate_rotors`.
    data, comb, edge
        As there.
    blades : int, optional
        Of a rotor.
    fitted_to : float, optional
        Of changing rotors, how far out lines were fitted [cycles a sample from the body]: perhaps less than they reach.
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
    tip = edge / (per_turn * max(fit.spacing for fit in rotors.fits))  # the same order for all: blades are alike
    strong = may_hold(rotors.fits) > 1 if several else np.array([False])
    twice = any(
        _flashes_twice(fit, per_turn, tip, STRONG_FLASH_SHARE if more else SECOND_FLASH_SHARE)
        for fit, more in zip(rotors.fits, strong, strict=True)
    )
    paired = several and (_may_pair(rotors, tip) or _are_unlike(rotors.fits, edge, tip, changing=fitted_to is not None))
    if twice and not several and per_turn == 1:  # unlike blades of one rotor flash in turn
        twice = flashes_in_period(comb.fit, blade_numbers(None), tip)[0] == 1
    if twice and not several:  # so do points along a lone rotor's blades
        numbers = range(1, MOST_TIPS + 1) if blades is None else (blades,)
        row = fit_points(rotors.fits[0], per_turn, data.pulses, numbers)
        if row is not None and row.left < ROW_LEFT:
            chopping = per_turn * rotors.fits[0].spacing
            rotors = replace(rotors, row_edge=(row.edge * chopping, row.edge_std * chopping))
            twice = False
    # folded lines contradict a lone rotor's family whose edge lies within the span
    contradicted = not several and rotors.fits[0].is_folded and edge < 0.5
    past = (not several or fitted_to is not None) and _stands_past(about, rotors.fits, fitted_to or edge)
    if fitted_to is None and others_flash(data, rotors.rest, (fit.spacing for fit in rotors.fits), edge):
        return marked_unresolved(rotors, data, any_rate)  # their rates may be any
    held_to = LEFT_SHARE if several or (few and deviations > FEW_DEVIATIONS) else LEFT_ALONE
    if not (twice or paired or hidden or past or contradicted or share > held_to):
        return rotors
    apart = abs(rotors.next_rate - float(rotors.rates[0])) if hidden and not several else 0.0
    return marked_unresolved(rotors, data, apart)


def marked_unresolved(rotors: Rotors, data: Periodogram, apart: float = 0.0) -> Rotors:
    """The rotors marked unresolved; their spread is at least what the dwell resolves, and `apart` [cycles a sample]."""
    reach = max(rotors.fits[0].outermost, 1)
    least = resolution(data.pulses, reach)
    return replace(rotors, resolved=False, spread=max(rotors.spread, least, apart))
