"""The line family of a record's rotors: comb, edge, second comb and single rotors, of rates that may change."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .changing import ChangingSeparation
from .changing_fit import ChangingFit
from .comb import LEAST_REACH_MPS, Comb, find_comb
from .drift import Straightened, ahead_left, straightened
from .family_edge import edge_of_lines, span_of
from .helicopter import Gear, find_gear
from .periodogram import Periodogram, prepared
from .rotors import Rotors, separate_rotors
from .spectrum import Spectrum
from .turning import bend, is_sure
from .unresolved import judged

#: What the lines tell of the rate grows by so much once its change is taken out, where several rotors were found that
#: are one; and where these were told apart.
SEVERAL_GAIN, BELIEVED_GAIN = 1.0, 1.5


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
        How far ahead of an even rotor each is, by the polynomials of `DEGREES`, and standard deviations, shape
        (rotors, degrees) [samples]; None where they are not told apart.
    change_std : float
        Relative standard deviation that this adds to the rates.
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
    change_std: float

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

    def with_change(self, std: NDArray[np.float64] | float, rate: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Standard deviations of rates, with what the change that was taken out adds, in the unit of both."""
        return np.asarray(np.hypot(std, self.change_std * np.asarray(rate)), np.float64)


def slower_than_rotors(data: Periodogram, edge: float, edge_std: float) -> str:
    """Why a line family of this edge [cycles a sample] is no rotor's; empty where it may be one's."""
    edge_mps, edge_std_mps = (value * data.prf_hz * data.wavelength_m / 2 for value in (edge, edge_std))
    if edge_mps + edge_std_mps < LEAST_REACH_MPS:
        return f"no rotor: the band ends at {edge_mps:.1f} m/s, below {LEAST_REACH_MPS:.0f} m/s"
    return ""


def find_family(data: Periodogram, spectrum: Spectrum, blades: int | None = None) -> tuple[Family | None, str]:
    """Find the line family of a record.

    Where its rotors are not told apart, their rates may have changed instead: if the record as it would be of rotors
    that turn evenly is explained, it is that.

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
    family, reason = _as_it_is(data, blades)
    if family is None:
        return None, reason
    if family.ahead is not None and not is_sure(*family.ahead):
        return family, ""
    edge = min(family.edge, span_of(data))
    several_gain = BELIEVED_GAIN if family.is_told_apart else SEVERAL_GAIN
    least_gain = several_gain if len(family.rotors.rates) > 1 else 0.0
    even = straightened(data, family.comb, edge, narrow=family.ahead is not None, least_gain=least_gain)
    if even is None:
        return _changing(data, family, edge), ""
    again = prepared((even.samples * np.sqrt(spectrum.floor)).astype(np.complex64), spectrum)
    other = _as_it_is(again, blades, even)[0] if again is not None else None
    if other is None or not other.is_told_apart:
        return _changing(data, family, edge), ""
    # several that are told apart are believed, but for a single one that changed
    if family.is_told_apart and len(other.rotors.rates) > 1:
        return _changing(data, family, edge), ""
    return other, ""


def _changing(data: Periodogram, family: Family, edge: float) -> Family:
    """A family of several rotors whose rates change; the one given where none do, or that does not tell them apart."""
    known = family.rotors
    if family.gear is not None or (known.resolved and len(known.rates) == 1):
        return family
    if known.resolved:
        left = ahead_left(data, known.fits, known.rest)
        if not is_sure(*left):
            return replace(family, ahead=left)
    rotors = judged(separate_rotors(data, family.comb, edge, ChangingSeparation), data, family.comb, edge)
    fits = [fit for fit in rotors.fits if isinstance(fit, ChangingFit)]
    if not rotors.resolved or len(fits) < 2 or (known.resolved and len(fits) != len(known.rates)):
        return family
    ahead = np.array([fit.ahead for fit in fits]), np.array([fit.ahead_std for fit in fits])
    return replace(family, rotors=rotors, ahead=ahead)


def _faster(comb: Comb, rotors: Rotors, factor: float) -> tuple[Comb, Rotors]:
    """A comb and its single rotor of another rate."""
    fit = replace(comb.fit, spacing=factor * comb.fit.spacing)
    return replace(comb, fit=fit), replace(rotors, rates=factor * rotors.rates, fits=[fit])


def _as_it_is(data: Periodogram, blades: int | None, even: Straightened | None = None) -> tuple[Family | None, str]:
    """`find_family` of rotors that turn evenly, or were made to."""
    comb, why = find_comb(data, blades)
    if comb is None:
        return None, why
    edge, std = edge_of_lines(data, [comb.fit], comb.rest, comb.per_turn, blades)
    if slow := slower_than_rotors(data, edge, std):
        return None, slow
    fills_span = bool(np.isinf(edge))
    gear, rotors, reason = find_gear(data, comb, min(edge, span_of(data)))
    if gear is not None:
        data, comb = gear.alone, gear.first
        edge, std = edge_of_lines(data, [comb.fit], comb.rest, comb.per_turn, blades, gear.second.spacing)
    single = len(rotors.rates) == 1 and (gear is not None or rotors.resolved)
    ahead, change_std = None, 0.0
    if single and even is not None:  # the mean rate is told from how it changes
        fit = even.fit
        ahead = fit.ahead[None], fit.ahead_std[None]
        all_in, alone = fit.spacing_std / fit.spacing, comb.chopping_std / comb.chopping
        change_std = float(np.sqrt(max(all_in**2 - alone**2, 0.0)))
        if gear is None:
            lines = comb.chopping / fit.spacing
            comb, rotors = _faster(comb, rotors, max(round(lines), 1) / lines)
    elif single:
        ahead = ahead_left(data, [comb.fit], comb.rest)
    return Family(data, comb, edge, std, fills_span, gear, rotors, reason, ahead, change_std), ""
