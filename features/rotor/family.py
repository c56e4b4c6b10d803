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
from .comb_centre import moves
from .comb_fit import CombFit
from .drift import Resampled, ahead_left, resampled
from .family_edge import edge_around, edge_of_lines, span_of
from .flash_count import flashes_in_period
from .flash_rate import may_be_fraction
from .gain import GainCorrected
from .helicopter import Gear, find_gear
from .meeting import meeting_of, with_body
from .periodogram import Level, Periodogram, prepared_again
from .refusals import slow_rotor_reason
from .rotors import LEAST_POWER_SHARE, Rotors, powers_of, separate_rotors
from .turning import DEGREES, bend, is_sure
from .unlike_blades import blade_numbers
from .unresolved import judged, left_over, marked_unresolved, power_about
from .weak_lines import by_rotation, with_all_lines, without_weak_lines

#: Where several rotors were found, one common rate change is tried if taking it out raises the lines' information on
#: the rate by this factor: SEVERAL_GAIN if they are unresolved, BELIEVED_GAIN if resolved.
SEVERAL_GAIN, BELIEVED_GAIN = 1.0, 1.5

#: A common gain is accepted where it explains this share of the residual of one comb (ONE_GAIN_SHARE), or of all rotors
#: found (GAIN_SHARE; two unresolved rotors mimic 0.05). Each is applied GAIN_STEPS times at most.
ONE_GAIN_SHARE, GAIN_SHARE, GAIN_STEPS = 0.3, 0.08, 2

#: Lines of varying gain pass for two rotors whose outermost lines lie no further apart than this [bins].
TWIN_BINS = 1.5

#: Gauss-Newton steps at most for both combs of a helicopter, whose change is known from one of them.
GEARED_STEPS = 4

#: Changing rates are sought only if the residual within the band of the steady fit differs from the noise beyond it by
#: this many standard deviations, up or down. Steady rotors near the noise leave 0 to 3; below this no changing rotors
#: were ever resolved.
CHANGE_LEAVES = 2.0

#: Mean power of the residual over the noise above which changing rates are sought whatever that difference: smeared
#: lines beyond the band may leave as much as those within.
LOUD_RESIDUAL = 1.5

#: If the edge of the fitted lines and that of all power about the orders differ by more than this many standard
#: deviations, the fit of outer lines went astray.
EDGE_DEVIATIONS = 4.0

#: Relative distance from multiples and fractions of another comb's spacing above which a comb is not part of that one.
FAR_OFF = 0.003

#: How often, at most, the orders of a comb of several rotors are counted anew.
RECOUNTS = 2

#: Spread given to a chopping frequency that may be 2 to 5 times the value found, as a multiple of that value.
UNTOLD_SPREAD = 4.0


@dataclass(frozen=True)
class Family:
    """The line family found in a record.

    Parameters
    ----------
    data : Periodogram
        The record that it was found in: resampled as if the rotor had a constant rate, where that explains more of it,
        and without a second comb.
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
        Time by which each rotor is ahead of one of constant rate: coefficients of the polynomials of `DEGREES` that
        were fitted, two at least, and standard deviations, shape (rotors, degrees) [samples]; None where unresolved.
    may_be_turn : bool
        True where the chopping frequency may be the rotation rate of unlike blades.
    meeting_std : float or None
        Standard deviation of the place where the combs of several rotors meet, which is the body's, if that is sure
        [cycles a sample].
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
    def is_resolved(self) -> bool:
        """True where the rotors found are all resolved, or a helicopter's two combs are found."""
        return self.gear is not None or self.rotors.resolved

    @property
    def drifts(self) -> NDArray[np.float64]:
        """Linear relative drift of each rotor's rate, and standard deviations, shape (2, rotors) [1 / sample]."""
        if self.ahead is None:
            return np.full((2, len(self.rotors.rates)), np.nan)
        return np.array([[bend(own, self.data.pulses) for own in values] for values in self.ahead])


def unresolved_if_multiple(family: Family) -> Family:
    """The family, marked unresolved where a lone rotor's comb may as well be that of a multiple of its rate."""
    comb, rotors = family.comb, family.rotors
    if family.gear is not None or len(rotors.rates) > 1:
        return family
    if not may_be_fraction(family.data, comb.fit.spacing, comb.last):
        return family
    return replace(family, rotors=marked_unresolved(rotors, family.data, UNTOLD_SPREAD * comb.chopping))


def by_turns(family: Family, blades: int | None) -> Family:
    """The family; a lone rotor's comb is taken as that of a turn where its blades flash one after another.

    Parameters
    ----------
    family : Family
        From `find_family`.
    blades : int, optional
        Blades of a rotor: like ones flash together.
    """
    comb, rotors = family.comb, family.rotors
    if family.gear is not None or len(rotors.rates) > 1 or comb.blades > 1 or family.data.one_channel:
        return family
    numbers = [number for number in range(2, blades + 1) if blades % number == 0] if blades else blade_numbers(None)
    if not numbers:
        return family
    edge, std = family.edge, family.edge_std
    number, is_sure = flashes_in_period(comb.fit, numbers, min(edge, 0.5) / comb.fit.spacing)
    if blades is not None and (number > 1 or not rotors.resolved):  # that edge was fitted for like blades
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

    A gain over the dwell that all lines share is divided out: its effect on the lines passes for more rotors. It is
    estimated from the first comb where that is nearly alone, from all rotors found, and from the comb of a resampled
    record.

    Parameters
    ----------
    data : Periodogram
        From `prepared`.
    spectrum : Spectrum
        Spectrum it was prepared with.
    blades : int, optional
        Of a rotor.

    Returns
    -------
    family : Family or None
        None where there is none.
    reason : str
        Why not; empty where there is one.
    """
    even, found = _gain_corrected_by_comb(GainCorrected.of(data, spectrum), blades)
    first, reason = _as_it_is(even.record, found, blades)
    if first is None:
        return None, reason
    as_recorded = even.record is data
    by_rotors = _gain_corrected_by_rotors(even, first, blades)
    family = None if by_rotors is None else _turned(by_rotors[0].record, spectrum, by_rotors[1], blades)
    if family is None or not family.is_resolved:
        family = _turned(even.record, spectrum, first, blades)
        if as_recorded:
            return family, ""
    uncorrected = first if as_recorded else _as_it_is(data, find_comb(data, blades), blades)[0]
    return _or_of_changing_rate(data, spectrum, family, uncorrected, blades), ""


def _or_of_changing_rate(
    data: Periodogram, spectrum: Spectrum, family: Family, first: Family | None, blades: int | None
) -> Family:
    """A family whose gain was divided out, or one rotor of changing rate without any, if that leaves less.

    A changing rate takes lines of a steady comb out of step for a part of the dwell, as a low gain would.
    """
    other = _turned(data, spectrum, first, blades) if first is not None else None
    if not _is_one(other) or other.ahead is None or not is_sure(*other.ahead):
        return family

    def left(one: Family) -> float:
        return energy(one.rotors.rest) / energy(one.data.samples)

    return other if left(other) < left(family) else family


def _gain_corrected_by_comb(even: GainCorrected, blades: int | None) -> tuple[GainCorrected, tuple[Comb | None, str]]:
    """A record with its first comb's gain divided out while that explains much of the residual; and the comb."""
    found = find_comb(even.record, blades)
    for _ in range(GAIN_STEPS):
        comb = found[0]
        further = even.further(even.record, comb.rest, comb.chopping, ONE_GAIN_SHARE) if comb is not None else None
        again = find_comb(further.record, blades) if further is not None else (None, "")
        if further is None or again[0] is None:
            break
        even, found = further, again
    return even, found


def _gain_corrected_by_rotors(
    even: GainCorrected, family: Family, blades: int | None
) -> tuple[GainCorrected, Family] | None:
    """A record with the gain of all rotors divided out, and its family; None where they have no gain."""
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
    """Combs of a family; if unresolved, only the strongest of combs as close together as a gain splits lines."""
    fits = sorted(family.rotors.fits, key=lambda fit: -energy(fit.amplitudes))
    if family.is_resolved:
        return fits
    out: list[CombFit] = []
    for fit in fits:
        reach = fit.outermost * family.data.pulses
        if all(abs(fit.spacing - other.spacing) * reach > TWIN_BINS for other in out):
            out.append(fit)
    return out


def _turned(data: Periodogram, spectrum: Spectrum, family: Family, blades: int | None) -> Family:
    """The family of steady rates given, or one of changing rates where they change.

    If a rate surely changes or rotors are unresolved, the record is resampled as that of one rotor of constant rate. If
    that does not explain it, several rotors are sought whose rates change each in its own way.
    """
    if family.ahead is not None and not is_sure(*family.ahead):
        return family
    edge = min(family.edge, span_of(data, [family.comb.fit]))
    several_gain = BELIEVED_GAIN if family.is_resolved else SEVERAL_GAIN
    least_gain = several_gain if len(family.rotors.rates) > 1 else 0.0

    def evened(comb: Comb) -> tuple[Resampled | None, Family | None]:
        even = resampled(data, comb, edge, least_gain=least_gain)
        if even is None:
            return None, None
        again = prepared_again(even.samples, spectrum, data.ends_noise)
        steady, found = _gain_corrected_by_comb(GainCorrected.of(again, spectrum), blades)
        return even, _as_it_is(steady.record, found, blades, even)[0]

    comb = by_rotation(family.comb)
    even, other = evened(comb)
    if even is None:
        return _changing(data, family, edge)
    if _is_one(other) and other.comb.blades > comb.blades:  # narrow lines show weak ones that biased the rate
        comb = by_rotation(replace(family.comb, blades=other.comb.blades))
        finer = evened(comb)
        if finer[0] is not None and _is_one(finer[1]):
            even, other = finer
    # the comb resampled may be the tail's; but several rotors may also pass for a tail and a slower main rotor
    slower = other is not None and other.gear is not None and other.comb.chopping < (1 - FAR_OFF) * comb.chopping
    if _is_one(other) and not slower:
        return other
    apart = _changing(data, family, edge)
    # several rotors that only share one change are accepted where nothing better is found
    if family.is_resolved or apart.is_resolved or other is None or not other.is_resolved:
        return apart
    return other


def _is_one(family: Family | None) -> TypeGuard[Family]:
    """True where a family is that of one resolved rotor, or of a helicopter."""
    return family is not None and family.is_resolved and len(family.rotors.rates) == 1


def _changing(data: Periodogram, family: Family, edge: float) -> Family:
    """The family as several rotors of changing rates; the one given where none change or they stay unresolved.

    Rotors resolved as steady whose rates change must be resolved as changing ones, else they are marked unresolved.
    One-channel records are not searched, as lines of both sides cross and support anything; nor are folded lines, for
    the same reason. Nor are records whose steady fit has a single comb: these are one in a hundred of several smoothly
    changing rotors, and searching wandering rates took a third of all time and resolved one in 276.
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
        _, power, seen = about
        is_loud = bool(seen.any()) and float(power[seen].mean()) > LOUD_RESIDUAL
        if abs(left_over(about, known.fits, edge).deviations) < CHANGE_LEAVES and not is_loud:
            return family
    unsure = replace(family, rotors=marked_unresolved(known, data)) if known.resolved else family
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
    fitted_to = max(fit.outermost * fit.spacing for fit in fits)
    rotors = judged(apart, data, comb, max(min(own[0], span_of(data)), edge), fitted_to=fitted_to)
    led_astray = abs(own[0] - around[0]) > EDGE_DEVIATIONS * np.hypot(own[1], around[1])
    if led_astray or not rotors.resolved or min(powers) < LEAST_POWER_SHARE * max(powers):
        return unsure
    ahead = np.array([fit.ahead for fit in fits]), np.array([fit.ahead_std for fit in fits])
    return replace(family, rotors=rotors, ahead=ahead)


def _known_as(fit: CombFit, changing: ChangingFit) -> CombFit:
    """A comb found in a resampled record, with the spacing from the fit to the record as it is."""
    lines = fit.spacing / changing.spacing
    whole = round(lines) if lines > 1 else 1 / max(round(1 / lines), 1)  # it may skip lines, or have more between
    std = max(changing.spacing_std / changing.spacing, fit.spacing_std / fit.spacing) * fit.spacing
    off = abs(whole / lines - 1) > FAR_OFF
    return replace(fit, spacing=fit.spacing if off else whole * changing.spacing, spacing_std=std)


def _as_it_is(
    data: Periodogram,
    found: tuple[Comb | None, str],
    blades: int | None,
    even: Resampled | None = None,
    *,
    recounts: int = RECOUNTS,
) -> tuple[Family | None, str]:
    """`find_family` for steady rates or a resampled record, given the comb found, or why there is none.

    Where the combs of several rotors meet at another line of the comb, orders are counted from that line.
    """
    comb, why = found
    if comb is None:
        return None, why
    comb = with_all_lines(data, comb, blades)
    edge, std = edge_of_lines(data, [comb.fit], comb.rest, comb.per_turn, blades)
    if slow := slow_rotor_reason(data, comb.fit, edge, std):
        return None, slow
    fills_span = bool(np.isinf(edge))
    furthest = min(edge, span_of(data, [comb.fit]))
    gear, rotors, reason = find_gear(data, comb, furthest, blades)
    meeting = None
    if len(rotors.fits) > 1 and not data.one_channel:
        # a line at rest may be a background's or an offset, and where lines fold any may lie on another
        line_nats = comb.line_nats if moves(data, comb.fit.centre) and not comb.fit.is_folded else 0.0
        meeting = meeting_of(
            data, rotors.fits, data.level_of(rotors.rest), resolved=rotors.resolved, line_nats=line_nats
        )
        if meeting is not None and meeting.order != 0 and meeting.is_near and recounts > 0:
            counted = counted_from(data, comb, meeting.place, blades)
            anew = _as_it_is(data, counted, blades, even, recounts=recounts - 1)
            if anew[0] is not None and energy(anew[0].rotors.rest) < energy(rotors.rest):
                return anew
    if gear is None and len(rotors.rates) == 1:  # lines of several rotors lie anywhere
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
    # the mean rate is that of the fit with its change
    changing = even.fit
    if gear is not None:
        gear, changing = _geared(gear, even, data.level_of(comb.rest))
    comb = replace(comb, fit=_known_as(comb.fit, changing))
    rotors = replace(rotors, rates=np.array([comb.chopping]), stds=np.array([comb.chopping_std]), fits=[comb.fit])
    ahead = changing.ahead[None], changing.ahead_std[None]
    return Family(data, comb, edge, std, fills_span, gear, rotors, reason, ahead), ""


def _geared(gear: Gear, even: Resampled, level_about: Level) -> tuple[Gear, ChangingFit]:
    """Two combs of a resampled record, fitted to the record as it is.

    One gear drives both: where their fitted changes differ for sure, each is tried for both, and the best fit is kept.
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
