"""Measurements of a dwell with their standard deviations: body, chopping, single rotors, band, blade."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .allocator import keep_freed
from .bandwidth import half_empty, threshold_band_hz
from .body_velocity import body_velocity, folded
from .chopping import Chopping
from .family import find_family, slower_than_rotors
from .family_edge import FASTEST_TIP_MPS, SPAN, edge_around, edge_of_lines, span_of, surer_edge
from .notch import Body, body_line, notch_mask, notch_residual_db, residual
from .one_thread import one_thread
from .periodogram import prepared
from .rotors import MAX_ROTORS
from .smearing import wide_smearing_index
from .spectrum import LEAST_PART, Spectrum, doppler_spectrum, finite_complex, largest_part

#: Radars that are measured [Hz]: beyond, a frequency was given in another unit.
CARRIER_RANGE_HZ, PRF_RANGE_HZ = (1e8, 1e12), (1.0, 1e8)

#: Threshold of the paper's bandwidth rule over the noise [dB]: it took 20 on measured data, 30 on simulated.
PAPER_THRESHOLD_DB = 20.0

#: A fitted edge that may be so far out [cycles a sample] by so many of its deviations may be none.
FURTHEST_EDGE, EDGE_DEVIATIONS = 0.48, 3.0

#: Fitted lines that tell the edge of several rotors to no more than this share of it leave it to all about the orders.
UNSURE_SHARE = 0.03

#: Why there is no band where one channel was made analytic: the lines on both sides of the body lie in one another.
ONE_CHANNEL = "no band: one side of the spectrum is empty, one channel has both folded onto the other: record I and Q"

#: Where rates differ by more, the growth of their lines' width does not show it.
WIDEST_INDEX = 0.04

#: The fields of the body's velocity and its deviation.
BODY = ("body_velocity_mps", "body_velocity_mps_std")

#: The fields that have a value for each rotor.
EACH_ROTOR = ("rotor_rates_hz", "rotor_rates_hz_std", "rotor_drifts_hz_per_s", "rotor_drifts_hz_per_s_std")

#: Blade counts listed where none is given.
BLADE_CHOICES = (1, 2, 3, 4, 5)


@dataclass(frozen=True)
class Measurements:
    """What `measure` found; every array has the batch's leading shape, NaN where there is no value.

    Parameters
    ----------
    body_velocity_mps, body_velocity_mps_std : ndarray
        Radial velocity of the body [m/s], positive when the range grows.
    chopping_hz, chopping_hz_std : ndarray
        Chopping frequency, blades x rotation rate [Hz]; of several rotors, that of their mean rate. Where the rate
        changes within the dwell, that of the even turn that comes nearest.
    chopping_drift_hz_per_s, chopping_drift_hz_per_s_std : ndarray
        Its even change within the dwell [Hz/s]; of several rotors that of their mean, NaN where they are not resolved.
        Neither velocity nor an even acceleration of the body passes for it.
    comb_order : ndarray
        Outermost order of chopping lines that speaks for the comb [1].
    comb_snr_db : ndarray
        Power of the comb's lines over the noise, a sample [dB].
    rotor_rates_hz, rotor_rates_hz_std : ndarray, shape (..., MAX_ROTORS)
        Chopping frequency of each single rotor, rising [Hz], padded with NaN.
    rotor_drifts_hz_per_s, rotor_drifts_hz_per_s_std : ndarray, shape (..., MAX_ROTORS)
        Even change of each within the dwell [Hz/s], padded in the same way; NaN where they are not resolved.
    rotor_count : ndarray
        Rotors told apart; NaN without a comb.
    rotors_resolved : ndarray of bool
        False where rates lie nearer than the dwell tells apart, or changed jerkily within it: of steady ones the count
        is then a lower bound.
    rotor_spread_hz : ndarray
        Range of the rotors' chopping frequencies [Hz], also where they are not resolved; 0 where there is one rate.
    smearing_index : ndarray
        Relative spread of the rotor rates from the growth of the line width with the order, and above `WIDEST_INDEX`,
        where lines widen no more, from the rates of rotors that are told apart [1].
    bandwidth_hz, bandwidth_hz_std : ndarray
        Doppler bandwidth f_max - f_min from the fitted edge of the line family [Hz] (the paper's eq. 26).
    threshold_bandwidth_hz : ndarray
        The same by the paper's rule: the range over a threshold of `PAPER_THRESHOLD_DB` [Hz].
    tip_speed_mps, tip_speed_mps_std : ndarray
        Blade tip speed [m/s]; its part along the line of sight, a lower bound, where beta is not given.
    notch_residual_db : ndarray
        Mean power outside the notches over the noise floor [dB].
    rotation_hz, rotation_hz_std : ndarray
        Rotation rate [Hz]; NaN where the number of blades is neither given nor seen in unequal lines.
    blade_length_m, blade_length_m_std : ndarray
        Blade length [m]; a lower bound where beta is not given. NaN where the rotation rate is.
    length_is_lower_bound : bool
        True where beta was not given.
    reason : ndarray of str
        Why there is no comb; empty where there is one.
    main_chopping_hz, main_chopping_hz_std, tail_chopping_hz, tail_chopping_hz_std : ndarray
        Of a helicopter: chopping frequency of the main and of the tail rotor [Hz]; NaN where no second comb is seen.
    gear_ratio, gear_ratio_std : ndarray
        Tail over main chopping frequency [1]: the gear's ratio where both rotors have as many blades.
    gear_reason : ndarray of str
        Why there is no second comb; empty where there is one.
    band_reason : ndarray of str
        Why there is a comb but no band, tip speed and blade length: its lines fill the unambiguous span, or a single
        channel has both sides of the body folded onto one. Or why there is a band but neither tip speed nor blade
        length: at the beta given the tips were faster than any blade's. Else empty.
    """

    body_velocity_mps: NDArray[np.float64]
    body_velocity_mps_std: NDArray[np.float64]
    chopping_hz: NDArray[np.float64]
    chopping_hz_std: NDArray[np.float64]
    chopping_drift_hz_per_s: NDArray[np.float64]
    chopping_drift_hz_per_s_std: NDArray[np.float64]
    comb_order: NDArray[np.float64]
    comb_snr_db: NDArray[np.float64]
    rotor_rates_hz: NDArray[np.float64]
    rotor_rates_hz_std: NDArray[np.float64]
    rotor_drifts_hz_per_s: NDArray[np.float64]
    rotor_drifts_hz_per_s_std: NDArray[np.float64]
    rotor_count: NDArray[np.float64]
    rotors_resolved: NDArray[np.bool_]
    rotor_spread_hz: NDArray[np.float64]
    smearing_index: NDArray[np.float64]
    bandwidth_hz: NDArray[np.float64]
    bandwidth_hz_std: NDArray[np.float64]
    threshold_bandwidth_hz: NDArray[np.float64]
    tip_speed_mps: NDArray[np.float64]
    tip_speed_mps_std: NDArray[np.float64]
    notch_residual_db: NDArray[np.float64]
    rotation_hz: NDArray[np.float64]
    rotation_hz_std: NDArray[np.float64]
    blade_length_m: NDArray[np.float64]
    blade_length_m_std: NDArray[np.float64]
    length_is_lower_bound: bool
    reason: NDArray[np.str_]
    main_chopping_hz: NDArray[np.float64]
    main_chopping_hz_std: NDArray[np.float64]
    tail_chopping_hz: NDArray[np.float64]
    tail_chopping_hz_std: NDArray[np.float64]
    gear_ratio: NDArray[np.float64]
    gear_ratio_std: NDArray[np.float64]
    gear_reason: NDArray[np.str_]
    band_reason: NDArray[np.str_]

    def alternatives(self, index: tuple[int, ...] = ()) -> list[dict[str, float]]:
        """The {blades, rpm, blade_length_m} that a record's chopping frequency and band allow.

        Parameters
        ----------
        index : tuple of int
            Which record of the batch; () for a single one.

        Returns
        -------
        list of dict
            One entry where the rotation rate is known, one a blade count where it is not, none without a comb.
        """
        chopping = float(self.chopping_hz[index])
        if not np.isfinite(chopping):
            return []
        rotation = float(self.rotation_hz[index])
        choices = [round(chopping / rotation)] if np.isfinite(rotation) else list(BLADE_CHOICES)
        tip = float(self.tip_speed_mps[index])
        fastest = float(np.nanmax(self.rotor_rates_hz[index]))  # the tip is the fastest rotor's
        return [
            {"blades": n, "rpm": 60 * chopping / n, "blade_length_m": tip * n / (2 * np.pi * fastest)} for n in choices
        ]


def beyond_radars(carrier_hz: float, prf_hz: float) -> str:
    """Which of both is no frequency of a radar that is measured, and the rule; empty where both are."""
    for name, value, (low, high) in (("carrier", carrier_hz, CARRIER_RANGE_HZ), ("PRF", prf_hz, PRF_RANGE_HZ)):
        if not low <= value <= high:
            return f"the {name} is {value:g} Hz: it must be {low:g} to {high:g} Hz"
    return ""


def measure(
    iq: ArrayLike,
    *,
    carrier_hz: float,
    prf_hz: float,
    blades: int | None = None,
    beta_rad: float | None = None,
    on_record: Callable[[int], None] | None = None,
) -> Measurements:
    """Measure the rotor in each record, or say why there is none.

    Parameters
    ----------
    iq : array_like of complex, shape (..., pulses)
        Slow-time samples of one range cell, any gain.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], within `CARRIER_RANGE_HZ` and `PRF_RANGE_HZ`.
    blades : int, optional
        Blades of a rotor, >= 1.
    beta_rad : float, optional
        Angle between the line of sight and the rotor plane [rad], 0 <= beta < pi/2.
    on_record : callable, optional
        Called after each record with the number of those done: a record takes some hundredths of a second, and up to
        two where several rotors change or are not told apart.

    Returns
    -------
    Measurements
        Standard deviations hold for the model: rates that are steady within the dwell or change smoothly, white noise
        about each line. A body that accelerates smears all lines; `bladewing measure` takes that out first
        (`body_acceleration`, `without_acceleration`).

    Raises
    ------
    ValueError
        If `iq` is not complex, has fewer than 2 pulses or holds a value that is not finite, or an argument is out of
        its range.
    """
    if beyond := beyond_radars(carrier_hz, prf_hz):
        raise ValueError(f"{beyond}: give 9.85 GHz as 9.85e9, 20 kHz as 20e3")
    if blades is not None and not (math.isfinite(blades) and blades == int(blades) >= 1):
        raise ValueError(f"blades is {blades!r}: it must be a whole number of at least 1")
    if beta_rad is not None and not 0 <= beta_rad < np.pi / 2:
        raise ValueError(f"beta_rad is {beta_rad!r}: it must be at least 0 and below pi/2 [rad]")
    samples = finite_complex(iq)
    shape = samples.shape[:-1]
    some = samples if samples.size else np.zeros((1, *samples.shape[-1:]), np.complex64)  # of none, fields of no length
    spectrum = doppler_spectrum(some, carrier_hz=carrier_hz, prf_hz=prf_hz)
    rows = []
    keep_freed()
    with one_thread:
        for index in np.ndindex(some.shape[:-1]):
            rows.append(_measure_one(some[index], _record(spectrum, index), blades, beta_rad))
            if on_record:
                on_record(len(rows))
    columns = {}
    for field in fields(Measurements):
        if field.name != "length_is_lower_bound":
            values = np.array([row[field.name] for row in rows])[: math.prod(shape)]
            extra = (MAX_ROTORS,) if field.name in EACH_ROTOR else ()
            columns[field.name] = values.reshape((*shape, *extra))
    return Measurements(**columns, length_is_lower_bound=beta_rad is None)


def _record(spectrum: Spectrum, index: tuple[int, ...]) -> Spectrum:
    return replace(
        spectrum,
        relative_power=spectrum.relative_power[index],
        floor=spectrum.floor[index],
        scale=spectrum.scale[index],
        transform=spectrum.transform[index],
    )


def _measure_one(iq: NDArray[np.complex64], spectrum: Spectrum, blades: int | None, beta_rad: float | None) -> dict:
    """The numbers of one record, by the names of `Measurements`."""
    out: dict = {field.name: np.nan for field in fields(Measurements)}
    out |= dict.fromkeys(EACH_ROTOR, np.full(MAX_ROTORS, np.nan))
    out["rotors_resolved"] = False
    out["gear_reason"], out["band_reason"] = "no comb", ""
    if 0 < largest_part(iq) < LEAST_PART:
        return out | {"reason": "no digits left in samples this small: raise the gain"}
    data = prepared(iq, spectrum)
    if data is None:
        return out | {"reason": "no signal"}
    body = body_line(spectrum)
    mask = notch_mask(spectrum, body)
    out["notch_residual_db"] = float(notch_residual_db(spectrum, mask))
    low, high = threshold_band_hz(spectrum, PAPER_THRESHOLD_DB)
    out["threshold_bandwidth_hz"] = float(high - low)
    prf_hz, wavelength_m = data.prf_hz, data.wavelength_m
    blank, whole = dict(out), data

    def without_rotor(reason: str) -> dict:
        return blank | {"reason": reason} | dict(zip(BODY, body_velocity(whole, spectrum, None), strict=True))

    family, why = find_family(data, spectrum, blades)
    if family is None:
        return without_rotor(why)
    data, comb, rotors, gear = family.data, family.comb, family.rotors, family.gear
    edge, edge_std, span = family.edge, family.edge_std, span_of(data)
    out["reason"], out["gear_reason"] = "", family.gear_reason
    out["chopping_hz"] = comb.chopping * prf_hz
    out["chopping_hz_std"] = comb.chopping_std * prf_hz
    out["comb_order"] = float(comb.last // comb.per_turn)
    out["comb_snr_db"] = float(10 * np.log10(max(comb.fit.snr.sum() / data.pulses, 1e-9)))
    if gear is not None:
        for name, (rate, std) in zip(("main", "tail"), gear.rates, strict=True):
            out[f"{name}_chopping_hz"] = rate * prf_hz
            out[f"{name}_chopping_hz_std"] = std * prf_hz
        out["gear_ratio"], out["gear_ratio_std"] = gear.ratio, gear.ratio_std
    count = len(rotors.rates)
    middle = rotors.fits[0] if count > 1 else comb.fit
    one_channel = bool(half_empty(spectrum.relative_power))
    if one_channel:  # about a body whose sides lie in one another nothing is even: its own line tells
        velocity = body_velocity(whole, spectrum, None, blades=True)
    else:
        velocity = body_velocity(data, spectrum, middle, steady=rotors.resolved, open_std=comb.body_std)
    out |= dict(zip(BODY, velocity, strict=True))
    drifts, drift_stds = family.drifts * (rotors.rates if count > 1 else comb.chopping) * prf_hz**2
    out["chopping_drift_hz_per_s"] = float(drifts.mean())
    out["chopping_drift_hz_per_s_std"] = float(np.sqrt((drift_stds**2).sum())) / count
    if count > 1:
        # one comb fitted to several follows the strongest; the chopping frequency is that of the mean rotor
        out["chopping_hz"] = float(rotors.rates.mean()) * prf_hz
        out["chopping_hz_std"] = float(np.sqrt((rotors.stds**2).sum())) / count * prf_hz
        edge, edge_std = edge_of_lines(data, rotors.fits, rotors.rest, 1, blades)
    if not rotors.resolved:  # the mean lies anywhere within what the unresolved rates span
        out["chopping_hz_std"] = float(np.hypot(out["chopping_hz_std"], rotors.spread * prf_hz / np.sqrt(12)))
        edge, edge_std = surer_edge((edge, edge_std), edge_around(data, comb, rotors, blades))
    elif count > 1 and not edge_std < UNSURE_SHARE * edge:  # the lines of rates just resolved hardly part within it
        around = edge_around(data, comb, rotors, blades)
        edge, edge_std = around if np.isinf(edge) else surer_edge((edge, edge_std), around)
    if slow := slower_than_rotors(data, edge, edge_std):
        return without_rotor(slow)
    each = (rotors.rates * prf_hz, rotors.stds * prf_hz, drifts, drift_stds)
    for name, values in zip(EACH_ROTOR, each, strict=True):
        out[name] = np.pad(values, (0, MAX_ROTORS - count), constant_values=np.nan)
    out["rotor_count"], out["rotors_resolved"] = float(count), rotors.resolved
    out["rotor_spread_hz"] = rotors.spread * prf_hz
    # unequal blades tell their number; between the lines of several rotors the weak ones may be something else
    seen = comb.per_turn if comb.per_turn > 1 and count == 1 else None
    known = blades if blades is not None else seen
    furthest = FURTHEST_EDGE * span / SPAN
    if one_channel:
        out["band_reason"] = ONE_CHANNEL
        edge = edge_std = np.nan
    elif family.fills_span or not edge + EDGE_DEVIATIONS * edge_std < furthest:
        least_mps = furthest * prf_hz * wavelength_m / 2
        out["band_reason"] = (
            f"no band: lines may fill the unambiguous span, tips of {least_mps:.1f} m/s and more: raise the PRF"
            if span == SPAN
            else f"no band: lines reach {least_mps:.0f} m/s and more from the body, faster than any blade's tip"
        )
        edge = edge_std = np.nan
    # counted from a line beside the body's, the family is so much the wider on one side
    edge_std = float(np.hypot(edge_std, comb.body_std))
    out["bandwidth_hz"], out["bandwidth_hz_std"] = 2 * edge * prf_hz, 2 * edge_std * prf_hz
    cosine = 1.0 if beta_rad is None else float(np.cos(beta_rad))
    tip, tip_std = (value * prf_hz * wavelength_m / 2 / cosine for value in (edge, edge_std))
    if tip - EDGE_DEVIATIONS * tip_std > FASTEST_TIP_MPS:
        out["band_reason"] = (
            f"no tip speed: beta of {np.rad2deg(beta_rad or 0.0):.4g} deg makes it {tip:.0f} m/s, faster than any "
            "blade's tip: give another angle, or none"
        )
        tip = tip_std = np.nan
    out["tip_speed_mps"], out["tip_speed_mps_std"] = tip, tip_std
    if known is not None:
        rotation = out["chopping_hz"] / known
        out["rotation_hz"], out["rotation_hz_std"] = rotation, out["chopping_hz_std"] / known
        # the edge is the fastest rotor's
        length = tip / (2 * np.pi * float(rotors.rates.max()) * prf_hz / known)
        out["blade_length_m"] = length
        out["blade_length_m_std"] = length * float(np.hypot(tip_std / tip, comb.chopping_std / comb.chopping))

    centre_mps = np.float32(-folded(comb.fit.centre) * prf_hz * wavelength_m / 2)
    energy = np.where(spectrum.level_db > 6.0, residual(spectrum, mask), np.float32(0))
    nothing = np.float32(np.nan)
    index = wide_smearing_index(
        spectrum,
        energy,
        Body(body.index, np.asarray(centre_mps), body.level_db),
        Chopping(np.asarray(np.float32(out["chopping_hz"])), np.asarray(nothing), np.asarray(nothing)),
    )
    told = float(rotors.rates.std() / rotors.rates.mean()) if rotors.resolved else 0.0
    out["smearing_index"] = told if told > WIDEST_INDEX else float(index)
    return out
