"""The measurements of one record, by the names of `Measurements`."""

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bandwidth import threshold_band_hz
from .body_velocity import body_velocity, folded
from .chopping import Chopping
from .dropouts import filled
from .free_side import with_free_side
from .measurements import BODY, EACH_ROTOR, Measurements
from .notch import Body, body_line, notch_mask, notch_residual_db, residual
from .reasons import NO_DIGITS, NO_SIGNAL
from .rotor.even_pulses import even_pulses
from .rotor.family import Family, by_turns, find_family, unresolved_if_multiple
from .rotor.family_edge import SPAN, edge_around, edge_of_lines, span_of, surer_edge
from .rotor.folding import FASTEST_TIP_MPS, fastest_tip
from .rotor.past_edge import PastEdge, past_edge_of
from .rotor.periodogram import Periodogram, prepared
from .rotor.refusals import short_dwell_reason, slow_rotor_reason, wheel_reason
from .rotor.rotors import MAX_ROTORS, hidden_shift
from .rotor.sidebands import sideband_spacing
from .samples import LEAST_PART, largest_part
from .smearing import wide_smearing_index
from .spectrum import Spectrum, doppler_spectrum

#: Threshold of the paper's bandwidth rule over the noise [dB]: it took 20 on measured data, 30 on simulated.
PAPER_THRESHOLD_DB = 20.0

#: No band is given if the edge plus EDGE_DEVIATIONS standard deviations reaches FURTHEST_EDGE [cycles a sample].
FURTHEST_EDGE, EDGE_DEVIATIONS = 0.48, 3.0

#: If fitted lines give the edge of several rotors no better than to this share, all power about the orders is used too.
UNSURE_SHARE = 0.03

#: Relative standard deviation above which an edge is not reported.
LOST_SHARE = 0.3

#: Why there is no band where one channel was made analytic: the lines of both sides of the body overlap.
ONE_CHANNEL = "no band: one side of the spectrum is empty, one channel has both folded onto the other: record I and Q"

#: Most other radars whose pulses are replaced, one after the other.
MOST_RADARS = 2

#: Largest relative spread of rates that shows in the growth of their lines' width.
WIDEST_INDEX = 0.04


def unmeasured(reason: str) -> dict[str, Any]:
    """A value for each array of `Measurements` of a record that gives none, and why."""
    out: dict[str, Any] = {field.name: np.nan for field in fields(Measurements)}
    out |= dict.fromkeys(EACH_ROTOR, np.full(MAX_ROTORS, np.nan))
    return out | {"rotors_resolved": False, "gear_reason": "no comb", "band_reason": "", "reason": reason}


#: Error of the rate of a comb that may hold several rotors, as shift of its outermost line [bins], rms.
HIDDEN_BINS = 0.12


def measure_record(
    iq: NDArray[np.complex64], spectrum: Spectrum, blades: int | None, beta_rad: float | None
) -> dict[str, Any]:
    """Measure one record.

    Parameters
    ----------
    iq : ndarray of complex64, shape (pulses,)
        Its samples.
    spectrum : Spectrum
        Of these.
    blades, beta_rad
        As in `measure`.

    Returns
    -------
    dict
        A value for each array of `Measurements`.
    """
    if 0 < largest_part(iq) < LEAST_PART:
        return unmeasured(f"{NO_DIGITS} in samples this small: raise the gain")
    spectrum = with_free_side(spectrum)
    data = prepared(iq, spectrum)
    if data is None:
        return unmeasured(NO_SIGNAL)
    out = unmeasured("")
    iq, data, spectrum, family, why = _found(iq, data, spectrum, blades)
    body = body_line(spectrum)
    mask = notch_mask(spectrum, body.index)
    low, high = threshold_band_hz(spectrum, PAPER_THRESHOLD_DB)
    out["threshold_bandwidth_hz"] = float(high - low)
    out["notch_residual_db"] = float(notch_residual_db(spectrum, mask))
    if family is not None:
        family = by_turns(family, blades)
        edge = _edge(family, blades)
        why = (
            slow_rotor_reason(family.data, family.comb.fit, *edge)
            or short_dwell_reason(family)
            or _supply_reason(family)
        )
    if family is None or why:
        return out | {"reason": why} | _named(BODY, body_velocity(data, spectrum, None))
    if data.one_channel:  # if both sides of the body overlap, no comb has a true centre: the body's line is used
        velocity = body_velocity(data, spectrum, None, blades=True)
    else:
        middle = family.rotors.fits[0] if len(family.rotors.rates) > 1 else family.comb.fit
        steady, open_std = family.rotors.resolved, family.comb.body_std
        if family.meeting_std is not None:
            steady, middle = True, replace(middle, centre_std=max(middle.centre_std, family.meeting_std))
        # lines of unresolved rotors lie all over the span: any of them may be the middle
        if not (family.is_resolved or family.comb.body_has_line) and (family.fills_span or middle.is_folded):
            open_std = np.inf
        velocity = body_velocity(family.data, spectrum, middle, steady=steady, open_std=open_std)
    out |= {"reason": wheel_reason(family.data, edge[0], velocity[0])} | _named(BODY, velocity)
    if out["reason"]:
        return out
    family = unresolved_if_multiple(family)
    out |= _turning(family) | _geared(family)
    out |= _band(family, edge, beta_rad, _past(family, iq, edge))
    out |= _blade(family, out, blades)
    return out | {"smearing_index": _index(family, spectrum, body, mask, out["chopping_hz"])}


def _found(
    iq: NDArray[np.complex64], data: Periodogram, spectrum: Spectrum, blades: int | None
) -> tuple[NDArray[np.complex64], Periodogram, Spectrum, Family | None, str]:
    """The line family of a record, or why there is none; pulses of another radar that make it up are replaced.

    The samples, the prepared record and its spectrum are those that the family was found in.
    """
    family, why = find_family(data, spectrum, blades)
    for _ in range(MOST_RADARS):
        if family is None or not len(places := even_pulses(data, family.comb.fit.spacing)):
            break
        spoilt = np.zeros(len(iq), bool)
        spoilt[places] = True
        iq = filled(iq, spoilt)
        again = doppler_spectrum(iq, carrier_hz=spectrum.carrier_hz, prf_hz=spectrum.prf_hz)
        pulsed, spectrum = spectrum, with_free_side(again)
        rate_hz = spectrum.prf_hz * (len(places) - 1) / (places[-1] - places[0])
        no_rotor = f"no rotor: single pulses {rate_hz:.1f} times a second, as of another radar"
        without = prepared(iq, spectrum)
        if without is None:  # there was nothing else
            return iq, data, pulsed, None, no_rotor
        data = without
        family, _ = find_family(data, spectrum, blades)
        why = no_rotor
    return iq, data, spectrum, family, why


def _supply_reason(family: Family) -> str:
    """Why a family is a supply's; empty where it may be a rotor's."""
    spacing = sideband_spacing(family.data, family.comb)
    if spacing is None:
        return ""
    return f"no rotor: lines every {spacing * family.data.prf_hz:.1f} Hz, alike on both sides, as a supply draws them"


def _named(names: tuple[str, ...], values: Iterable[Any]) -> dict[str, Any]:
    return dict(zip(names, values, strict=True))


def _edge(family: Family, blades: int | None) -> tuple[float, float]:
    """Edge of all rotors' lines and its standard deviation [cycles a sample], from the surest source."""
    data, comb, rotors = family.data, family.comb, family.rotors
    if rotors.resolved and rotors.row_edge is not None:
        return rotors.row_edge
    several = len(rotors.rates) > 1
    edge, std = edge_of_lines(data, rotors.fits, rotors.rest, 1, blades) if several else (family.edge, family.edge_std)
    if not rotors.resolved:
        return surer_edge((edge, std), edge_around(data, comb, rotors, blades, (edge, std)))
    if several and not std < UNSURE_SHARE * edge:  # lines of barely resolved rates hardly separate there
        around = edge_around(data, comb, rotors, blades, (edge, std))
        return around if np.isinf(edge) else surer_edge((edge, std), around)
    return edge, std


def _turning(family: Family) -> dict[str, Any]:
    """Comb, chopping frequency, single rotors and how their rates change."""
    data, comb, rotors = family.data, family.comb, family.rotors
    prf_hz, count = data.prf_hz, len(rotors.rates)
    chopping, std = comb.chopping * prf_hz, comb.chopping_std * prf_hz
    if count > 1:  # one comb fitted to several follows the strongest; the chopping frequency is that of the mean rotor
        chopping = float(rotors.rates.mean()) * prf_hz
        # of two unresolved rotors only one was counted
        std = float(np.hypot(np.sqrt((rotors.stds**2).sum()) / count, hidden_shift(rotors.fits))) * prf_hz
    spread, order, stds = max(rotors.spread, rotors.unseen), comb.last // comb.per_turn, rotors.stds
    if not rotors.resolved:  # the mean lies anywhere within what the unresolved rates span
        std = float(np.hypot(std, spread * prf_hz / np.sqrt(12)))
    pulled = HIDDEN_BINS / (max(order, 1) * data.pulses)
    if not rotors.resolved or data.one_channel:  # power between the lines, as of the other side's, biases rates
        stds = np.hypot(stds, pulled)
    if data.one_channel:
        std = float(np.hypot(std, pulled * prf_hz))
    drifts, drift_stds = family.drifts * (rotors.rates if count > 1 else comb.chopping) * prf_hz**2
    each = (rotors.rates * prf_hz, stds * prf_hz, drifts, drift_stds)
    padded = (np.pad(values, (0, MAX_ROTORS - count), constant_values=np.nan) for values in each)
    return _named(EACH_ROTOR, padded) | {
        "comb_order": float(order),
        "comb_snr_db": float(10 * np.log10(max(comb.fit.snr.sum() / data.pulses, 1e-9))),
        "chopping_hz": chopping,
        "chopping_hz_std": std,
        "chopping_drift_hz_per_s": float(drifts.mean()),
        "chopping_drift_hz_per_s_std": float(np.sqrt((drift_stds**2).sum())) / count,
        "rotor_count": float(count),
        "rotors_resolved": rotors.resolved,
        "rotor_spread_hz": spread * prf_hz,
    }


def _geared(family: Family) -> dict[str, Any]:
    """A helicopter's two combs, or why there is no second one."""
    gear, out = family.gear, {"gear_reason": family.gear_reason}
    if gear is None:
        return out
    (main, main_std), (tail, tail_std) = gear.rates * family.data.prf_hz
    return out | {
        "main_chopping_hz": main,
        "main_chopping_hz_std": main_std,
        "tail_chopping_hz": tail,
        "tail_chopping_hz_std": tail_std,
        "gear_ratio": gear.ratio,
        "gear_ratio_std": gear.ratio_std,
    }


def _past(family: Family, iq: NDArray[np.complex64], edge: tuple[float, float]) -> PastEdge:
    """What lies past the edge of all rotors' lines, of the samples that these were found in."""
    rotors = family.rotors
    rates = [*map(float, rotors.rates), family.comb.chopping]
    return past_edge_of(family.data, iq, rotors.fits[0].centre, rates, rotors.spread, edge)


def _band(family: Family, edge: tuple[float, float], beta_rad: float | None, past: PastEdge) -> dict[str, Any]:
    """Doppler bandwidth and tip speed, or why there is none.

    Parameters
    ----------
    family : Family
        The line family.
    edge : (float, float)
        From `_edge`.
    beta_rad
        As in `measure`.
    past : PastEdge
        What lies past that edge.
    """
    data, (away, std), span = family.data, edge, span_of(family.data, family.rotors.fits)
    mps = data.span_mps
    furthest, why = FURTHEST_EDGE * span / SPAN, ""
    not_told = family.comb.fit.is_folded and not family.is_resolved
    # folded lines of unresolved rotors may pass for the whole family: what lies past the edge must be seen
    no_end = past.flashes or not (past.seen or family.is_resolved)
    if data.one_channel:
        why = ONE_CHANNEL
    elif family.fills_span or not_told or no_end or not away + EDGE_DEVIATIONS * std < furthest:
        why = (
            f"no band: lines may fill the unambiguous span, tips of {furthest * mps:.1f} m/s and more: raise the PRF"
            if span < fastest_tip(data)
            else f"no band: lines reach some {FASTEST_TIP_MPS:.0f} m/s from the body, faster than any blade's tip"
        )
    elif std > LOST_SHARE * away:
        why = "no band: where the lines end is lost in the noise: a longer dwell may show it"
    if why:
        away = std = np.nan
    # if orders were counted from a line beside the body's, the family is that much wider on one side
    std = float(np.hypot(std, family.comb.body_std))
    cosine = 1.0 if beta_rad is None else float(np.cos(beta_rad))
    tip, tip_std = away * mps / cosine, std * mps / cosine
    if tip - EDGE_DEVIATIONS * tip_std > FASTEST_TIP_MPS:
        why = (
            f"no tip speed: beta of {np.rad2deg(beta_rad or 0.0):.7g} deg makes it {tip:.0f} m/s, faster than any "
            "blade's tip: give another angle, or none"
        )
        tip = tip_std = np.nan
    return {
        "bandwidth_hz": 2 * away * data.prf_hz,
        "bandwidth_hz_std": 2 * std * data.prf_hz,
        "tip_speed_mps": tip,
        "tip_speed_mps_std": tip_std,
        "band_reason": why,
    }


def _blade(family: Family, found: dict[str, Any], blades: int | None) -> dict[str, Any]:
    """Rotation rate and blade length, where the number of blades is given or seen."""
    comb, rates = family.comb, family.rotors.rates
    # unequal blades show their number; between lines of several rotors, weak ones may be something else
    told = comb.blades_sure and len(rates) == 1 and family.is_resolved
    known = comb.blades if blades is None and told else blades
    if known is None or (known > 1 and family.may_be_turn):
        return {}
    tip, tip_std = found["tip_speed_mps"], found["tip_speed_mps_std"]
    length = tip / (2 * np.pi * float(rates.max()) * family.data.prf_hz / known)  # the edge is the fastest rotor's
    return {
        "rotation_hz": found["chopping_hz"] / known,
        "rotation_hz_std": found["chopping_hz_std"] / known,
        "blade_length_m": length,
        "blade_length_m_std": length * float(np.hypot(tip_std / tip, found["chopping_hz_std"] / found["chopping_hz"])),
    }


def _index(family: Family, spectrum: Spectrum, body: Body, mask: NDArray[np.bool_], chopping_hz: float) -> float:
    """Smearing index: of resolved rates where they differ too much for their lines' width to show it."""
    rates, data = family.rotors.rates, family.data
    told = float(rates.std() / rates.mean()) if family.rotors.resolved else 0.0
    if told > WIDEST_INDEX:
        return told
    centre_mps = np.float32(-folded(family.comb.fit.centre) * data.span_mps)
    energy = np.where(spectrum.level_db > 6.0, residual(spectrum, mask), np.float32(0))
    nothing = np.asarray(np.float32(np.nan))
    chopping = Chopping(np.asarray(np.float32(chopping_hz)), nothing, nothing)
    return float(
        wide_smearing_index(spectrum, energy, Body(body.index, np.asarray(centre_mps), body.level_db), chopping)
    )
