"""The line family of a record's rotors: comb, edge, second comb and single rotors, of rates that may change."""

from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from ..lines import energy, squared
from ..spectrum import Spectrum
from .changing import ChangingSeparation, as_steady, may_be_sought
from .changing_fit import ChangingFit, Start, fit_changing
from .comb import Comb, counted_from, find_comb
from .comb_fit import CombFit
from .drift import Straightened, ahead_left, straightened
from .family_edge import edge_around, edge_of_lines, span_of
from .flash_count import flashes_in_period
from .flash_rate import may_be_fraction
from .gain import Evened
from .helicopter import Gear, find_gear
from .meeting import meeting_of, with_body
from .periodogram import Level, Periodogram, prepared_again
from .refusals import slower_than_rotors
from .rotors import LEAST_POWER_SHARE, Rotors, powers_of, separate_rotors
from .turning import DEGREES, bend, is_sure
from .unlike_blades import blade_numbers
from .unresolved import judged, left_over, not_all, power_about
from .weak_lines import by_rotation, with_all_lines, without_weak_lines

#: What the lines tell of the rate grows by so much once its change is taken out, where several rotors were found that
#: are one; and where these were told apart.
SEVERAL_GAIN, BELIEVED_GAIN = 1.0, 1.5

#: A gain over the dwell is that of all lines where it explains so much of what one comb leaves, and of what all rotors
#: found leave, which two nearer than the dwell tells apart come to 0.05 of. It is taken out so many times, each.
ONE_GAIN_SHARE, GAIN_SHARE, GAIN_STEPS = 0.3, 0.08, 2

#: Lines that swell and fall pass for two rotors whose outermost lines are so near to one another, at most [bins].
TWIN_BINS = 1.5

#: Gauss-Newton steps at most for both combs of a helicopter, whose change is known from one of them.
GEARED_STEPS = 4

#: Rates that change leave so much where they are fitted as steady ones, in its deviations, or so much less than what
#: is beyond, where their lines go on: steady ones near the noise leave 0 to 3, and below this none was ever told.
CHANGE_LEAVES = 2.0

#: Where the edge of the lines fitted and that of all about the orders differ by so many deviations, the fit of outer
#: lines went astray.
EDGE_DEVIATIONS = 4.0

#: A comb whose spacing is off by more than this, relative, from any multiple of another's is no part of that.
FAR_OFF = 0.003

#: A comb of several rotors is counted anew so often, at most.
RECOUNTS = 2

#: A rate that may be twice to five times what it seems is told to so many times itself.
UNTOLD_SPREAD = 4.0


@dataclass(frozen=True)
class Family:
    """What the lines of a record come to.

    Parameters
    ----------
    data : Periodogram
        The record that they were found in: as if the rotor had turned evenly, where that explains more of it, and
        without a second comb.
    comb : Comb
        The comb; a helicopter's first one.
    edge, edge_std : float
        Its edge and the standard deviation [cycles a sample from the body].
    fills_span : bool
        True where the lines of the comb found first fill all that is searched.
    gear : Gear or None
        A helicopter's two combs.
    rotors : Rotors
        Single rotors of the comb.
    gear_reason : str
        Why there is no second comb; empty where there is one.
    ahead : (ndarray, ndarray) or None
        How far ahead of an even rotor each is, by as many polynomials of `DEGREES` as were fitted, two at least, and
        standard deviations, shape (rotors, degrees) [samples]; None where they are not told apart.
    may_be_turn : bool
        True where the chopping frequency may be the rotation rate of unlike blades.
    meeting_std : float or None
        Where the combs of several rotors surely meet, standard deviation of that place, which is the body's [cycles a
        sample].
    """

    data: Periodogram
    comb: Comb
    edge: float
    edge_std: float
    fills_span: bool
    gear: Gear | None
    rotors: Rotors
    gear_reason: str
    ahead: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    may_be_turn: bool = False
    meeting_std: float | None = None

    @property
    def is_told_apart(self) -> bool:
        """True where nothing is left that the rotors found do not explain."""
        return self.gear is not None or self.rotors.resolved

    @property
    def drifts(self) -> NDArray[np.float64]:
        """Even relative change of each rotor's rate, and standard deviations, shape (2, rotors) [1 / sample]."""
        if self.ahead is None:
            return np.full((2, len(self.rotors.rates)), np.nan)
        return np.array([[bend(own, self.data.pulses) for own in values] for values in self.ahead])


def told_from_multiples(family: Family) -> Family:
    """A lone rotor's family, called not told apart where its comb may as well be that of a multiple of its rate."""
    comb, rotors = family.comb, family.rotors
    if family.gear is not None or len(rotors.rates) > 1:
        return family
    if not may_be_fraction(family.data, comb.fit.spacing, comb.last):
        return family
    return replace(family, rotors=not_all(rotors, family.data, UNTOLD_SPREAD * comb.chopping))


def by_turns(family: Family, blades: int | None) -> Family:
    """A lone rotor's family, its comb counted in turns where its blades flash one after another: it is that of a turn.

    Parameters
    ----------
    family : Family
        From `find_family`.
    blades : int, optional
        Of a rotor: those that are alike flash together.
    """
    comb, rotors = family.comb, family.rotors
    if family.gear is not None or len(rotors.rates) > 1 or comb.blades > 1 or family.data.one_channel:
        return family
    numbers = [number for number in range(2, blades + 1) if blades % number == 0] if blades else blade_numbers(None)
    if not numbers:
        return family
    edge, std = family.edge, family.edge_std
    number, is_sure = flashes_in_period(comb.fit, numbers, min(edge, 0.5) / comb.fit.spacing)
    if blades is not None and (number > 1 or not rotors.resolved):  # it was sought for blades that are alike
        edge, std = edge_of_lines(family.data, [comb.fit], comb.rest, 1, None)
        number, is_sure = flashes_in_period(comb.fit, numbers, min(edge, 0.5) / comb.fit.spacing)
    if number == 1 or not is_sure:
        return replace(family, may_be_turn=number > 1)
    turned = replace(comb, per_turn=number, blades=number, blades_sure=True)
    rates, stds, spread = number * rotors.rates, number * rotors.stds, number * rotors.spread
    rotors = replace(rotors, rates=rates, stds=stds, spread=spread, unseen=number * rotors.unseen)
    return replace(family, comb=turned, edge=edge, edge_std=std, rotors=rotors)


def find_family(data: Periodogram, spectrum: Spectrum, blades: int | None = None) -> tuple[Family | None, str]:
    """Find the line family of a record.

    A gain over the dwell that all lines share is divided out: what it makes of them passes for more rotors. It is told
    from the first comb where that is nearly alone, from all rotors found, and from those whose rates change.

    Parameters
    ----------
    data : Periodogram
        From `prepared`.
    spectrum : Spectrum
        What that was prepared with.
    blades : int, optional
        Of a rotor.

    Returns
    -------
    family : Family or None
        None where there is none.
    reason : str
        Why not; empty where there is one.
    """
    even, found = _evened_by_one(Evened.of(data, spectrum), blades)
    first, reason = _as_it_is(even.record, found, blades)
    if first is None:
        return None, reason
    by_rotors = _evened_by_rotors(even, first, blades)
    if by_rotors is not None:
        family = _turned(by_rotors[0].record, spectrum, by_rotors[1], blades)
        if family.is_told_apart:
            return family, ""
    return _turned(even.record, spectrum, first, blades), ""


def _evened_by_one(even: Evened, blades: int | None) -> tuple[Evened, tuple[Comb | None, str]]:
    """A record evened by its first comb, as often as the gain explains much of what that leaves; and the comb."""
    found = find_comb(even.record, blades)
    for _ in range(GAIN_STEPS):
        comb = found[0]
        further = even.further(even.record, comb.rest, comb.chopping, ONE_GAIN_SHARE) if comb is not None else None
        again = find_comb(further.record, blades) if further is not None else (None, "")
        if further is None or again[0] is None:
            break
        even, found = further, again
    return even, found


def _evened_by_rotors(even: Evened, family: Family, blades: int | None) -> tuple[Evened, Family] | None:
    """A record evened by all its rotors, and what is then found in it; None where they have no gain."""
    out = None
    for _ in range(GAIN_STEPS):
        further = even.further(family.data, family.rotors.rest, family.comb.chopping, GAIN_SHARE)
        if further is None:
            break
        even = further.fitted_to(_not_twins(family), GAIN_SHARE)
        again, _ = _as_it_is(even.record, find_comb(even.record, blades), blades)
        if again is None:
            break
        family = again
        out = even, family
    return out


def _not_twins(family: Family) -> list[CombFit]:
    """Combs of a family, where not told apart the strongest of those as near to one another as a gain splits lines."""
    fits = sorted(family.rotors.fits, key=lambda fit: -energy(fit.amplitudes))
    if family.is_told_apart:
        return fits
    out: list[CombFit] = []
    for fit in fits:
        reach = float(np.abs(fit.orders).max()) * family.data.pulses
        if all(abs(fit.spacing - other.spacing) * reach > TWIN_BINS for other in out):
            out.append(fit)
    return out


def _turned(data: Periodogram, spectrum: Spectrum, family: Family, blades: int | None) -> Family:
    """A family of rates that were taken to be steady, or another where they are not.

    Where one changes for sure, or rotors are not told apart, the record may be one of a rotor that turns evenly, read
    at other times; if not that, of several that change, each in its own way.
    """
    if family.ahead is not None and not is_sure(*family.ahead):
        return family
    edge = min(family.edge, span_of(data, [family.comb.fit]))
    several_gain = BELIEVED_GAIN if family.is_told_apart else SEVERAL_GAIN
    least_gain = several_gain if len(family.rotors.rates) > 1 else 0.0

    def evened(comb: Comb) -> tuple[Straightened | None, Family | None]:
        even = straightened(data, comb, edge, least_gain=least_gain)
        if even is None:
            return None, None
        again = prepared_again(even.samples, spectrum, data.ends_noise)
        steady, found = _evened_by_one(Evened.of(again, spectrum), blades)
        return even, _as_it_is(steady.record, found, blades, even)[0]

    comb = by_rotation(family.comb)
    even, other = evened(comb)
    if even is None:
        return _changing(data, family, edge)
    if _is_one(other) and other.comb.blades > comb.blades:  # narrow, its lines show weak ones that pulled at its rate
        comb = by_rotation(replace(family.comb, blades=other.comb.blades))
        finer = evened(comb)
        if finer[0] is not None and _is_one(finer[1]):
            even, other = finer
    # what was straightened may be the tail's comb; but several rotors may pass for that one and a slower one as well
    slower = other is not None and other.gear is not None and other.comb.chopping < (1 - FAR_OFF) * comb.chopping
    if _is_one(other) and not slower:
        return other
    apart = _changing(data, family, edge)
    # and several that are so but for a change that they share are believed where nothing better is found
    if family.is_told_apart or apart.is_told_apart or other is None or not other.is_told_apart:
        return apart
    return other


def _is_one(family: Family | None) -> TypeGuard[Family]:
    """True where a family is that of one rotor, or of a helicopter, and nothing is left."""
    return family is not None and family.is_told_apart and len(family.rotors.rates) == 1


def _changing(data: Periodogram, family: Family, edge: float) -> Family:
    """A family of several rotors whose rates change; the one given where none do, or that does not tell them apart.

    Rotors that were told apart as steady ones, and are not, must be told apart as such that change. Where one side of
    the body lies in the other, lines cross and speak for anything; so do those that come back from the other end of the
    span, which are not sought. Nor are any where steady ones come to a single comb: one record in a hundred of several
    that change smoothly; and of rates that wander, sought for a third of all the time, one in 276 was ever told.
    """
    known, comb = family.rotors, family.comb
    if family.gear is not None or len(known.rates) == 1:
        return family
    if known.resolved:
        left = ahead_left(data, known.fits, known.rest)
        if not is_sure(*left):
            return replace(family, ahead=left)
    else:
        about = power_about(data, known.rest, known.fits[0].centre)
        if abs(left_over(about, known.fits, edge).deviations) < CHANGE_LEAVES:
            return family
    unsure = replace(family, rotors=not_all(known, data)) if known.resolved else family
    reach = max(round(edge / comb.chopping), 1)
    fills_span = family.fills_span or comb.fit.is_folded
    if fills_span or not may_be_sought(data, comb.chopping, reach) or data.one_channel:
        return unsure
    apart = separate_rotors(data, comb, edge, ChangingSeparation)
    fits = [fit for fit in apart.fits if isinstance(fit, ChangingFit)]
    if len(fits) < 2 or (known.resolved and len(fits) > len(known.rates)):
        return unsure
    steady = as_steady(data, apart)
    if steady is not None:
        return replace(family, rotors=judged(steady, data, comb, family.edge))
    powers = powers_of(fits)
    own = edge_of_lines(data, apart.fits, apart.rest, 1, None)
    around = edge_around(data, comb, apart, None, own)
    fitted_to = max(float(np.abs(fit.orders).max()) * fit.spacing for fit in fits)
    rotors = judged(apart, data, comb, max(min(own[0], span_of(data)), edge), fitted_to=fitted_to)
    led_astray = abs(own[0] - around[0]) > EDGE_DEVIATIONS * np.hypot(own[1], around[1])
    if led_astray or not rotors.resolved or min(powers) < LEAST_POWER_SHARE * max(powers):
        return unsure
    ahead = np.array([fit.ahead for fit in fits]), np.array([fit.ahead_std for fit in fits])
    return replace(family, rotors=rotors, ahead=ahead)


def _known_as(fit: CombFit, changing: ChangingFit) -> CombFit:
    """A comb of lines found in a record that was straightened, its rate that of the fit to the record as it is."""
    lines = fit.spacing / changing.spacing
    whole = round(lines) if lines > 1 else 1 / max(round(1 / lines), 1)  # it may be every so many-th line, or between
    std = max(changing.spacing_std / changing.spacing, fit.spacing_std / fit.spacing) * fit.spacing
    off = abs(whole / lines - 1) > FAR_OFF
    return replace(fit, spacing=fit.spacing if off else whole * changing.spacing, spacing_std=std)


def _as_it_is(
    data: Periodogram,
    found: tuple[Comb | None, str],
    blades: int | None,
    even: Straightened | None = None,
    *,
    recounts: int = RECOUNTS,
) -> tuple[Family | None, str]:
    """`find_family` of rotors that turn evenly, or were made to, with the comb found, or why there is none.

    Where several rotors' combs meet about another of its lines, it is counted from that.
    """
    comb, why = found
    if comb is None:
        return None, why
    comb = with_all_lines(data, comb, blades)
    edge, std = edge_of_lines(data, [comb.fit], comb.rest, comb.per_turn, blades)
    if slow := slower_than_rotors(data, comb.fit, edge, std):
        return None, slow
    fills_span = bool(np.isinf(edge))
    furthest = min(edge, span_of(data, [comb.fit]))
    gear, rotors, reason = find_gear(data, comb, furthest, blades)
    meeting = None
    if len(rotors.fits) > 1 and not data.one_channel:
        meeting = meeting_of(data, rotors.fits, data.level_of(rotors.rest), resolved=rotors.resolved)
        if meeting is not None and meeting.order != 0 and meeting.is_near and recounts > 0:
            counted = counted_from(data, comb, meeting.place, blades)
            anew = _as_it_is(data, counted, blades, even, recounts=recounts - 1)
            if anew[0] is not None and energy(anew[0].rotors.rest) < energy(rotors.rest):
                return anew
    if gear is None and len(rotors.rates) == 1:  # of several the lines lie anywhere
        without, alike = without_weak_lines(data, comb, blades)
        again = find_gear(without, alike, furthest, blades) if without is not data else None
        if again is not None and again[0] is None and len(again[1].rates) == 1:
            data, comb, (_, rotors, reason) = without, alike, again
    if gear is not None:
        data, comb = gear.alone, gear.first
        edge, std = edge_of_lines(data, [comb.fit], comb.rest, comb.per_turn, blades, gear.second.spacing)
    if len(rotors.rates) > 1 or not (gear or rotors.resolved):
        comb, known_at = with_body(comb, rotors, meeting)
        return Family(data, comb, edge, std, fills_span, gear, rotors, reason, None, meeting_std=known_at), ""
    if even is None:
        ahead = ahead_left(data, [comb.fit], comb.rest)
        return Family(data, comb, edge, std, fills_span, gear, rotors, reason, ahead), ""
    # the mean rate is told from how it changes
    changing = even.fit
    if gear is not None:
        gear, changing = _geared(gear, even, data.level_of(comb.rest))
    comb = replace(comb, fit=_known_as(comb.fit, changing))
    rotors = replace(rotors, rates=np.array([comb.chopping]), stds=np.array([comb.chopping_std]), fits=[comb.fit])
    ahead = changing.ahead[None], changing.ahead_std[None]
    return Family(data, comb, edge, std, fills_span, gear, rotors, reason, ahead), ""


def _geared(gear: Gear, even: Straightened, level_about: Level) -> tuple[Gear, ChangingFit]:
    """Two combs of a straightened record as they are in the record itself.

    One turn drives both: where one was led astray, the other tells how far ahead they are.
    """
    combs = (gear.first.fit, gear.second)

    def fitted(ahead: NDArray[np.float64]) -> tuple[float, list[ChangingFit]]:
        starts = [Start(comb.spacing, max(map(abs, comb.reach)), ahead) for comb in combs]
        found = fit_changing(
            even.record, starts, even.fit.centre, degrees=len(DEGREES), steps=GEARED_STEPS, level_about=level_about
        )
        return (float(squared(found[1]).mean()), found[0]) if found else (np.inf, [])

    best = fitted(even.fit.ahead)
    if not best[1]:
        return gear, even.fit
    one, other = best[1]
    if is_sure(one.ahead - other.ahead, np.hypot(one.ahead_std, other.ahead_std)):
        best = min(best, *(fitted(fit.ahead) for fit in best[1]), key=lambda found: found[0])
    first, second = (_known_as(comb, fit) for comb, fit in zip(combs, best[1], strict=True))
    return replace(gear, first=replace(gear.first, fit=first), second=second), best[1][0]
