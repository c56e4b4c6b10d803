"""Measurements of a dwell with their standard deviations: body, chopping, single rotors, band, blade."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bandwidth import threshold_band_hz
from .chopping import Chopping
from .comb import LEAST_REACH_MPS, Comb, find_comb
from .comb_fit import CombFit
from .helicopter import find_gear
from .lines import LineSpace
from .notch import Body, body_line, notch_mask, notch_residual_db, residual
from .one_thread import one_thread
from .periodogram import LINE_DB, Periodogram, prepared
from .rotor_band import LEAK_SHARE, fit_edge
from .rotors import MAX_ROTORS, Rotors
from .smearing import smearing_index
from .spectrum import LEAST_PART, Spectrum, as_complex, doppler_spectrum, largest_part

#: Threshold of the paper's bandwidth rule over the noise [dB]: it took 20 on measured data, 30 on simulated.
PAPER_THRESHOLD_DB = 20.0

#: Blade counts listed where none is given.
BLADE_CHOICES = (1, 2, 3, 4, 5)

#: Rates nearer than this at an order [bins] have one line there.
MERGED_BINS = 1.0

#: The edge of several rotors' fitted lines holds if that of all about them agrees within so many of its deviations.
AGREED_DEVIATIONS = 2.0

#: Share of the power of several rotors' family that does not count past its edge: what their inner lines leave between
#: them lifts the level that the outer ones are read against.
SEVERAL_LEAK = 0.005

#: Of the sums of all about an order: variance over the square where the rotors' lines lie in one another (four of equal
#: power, both sides), and what an edge is off by at least [lines].
AROUND_SCATTER, AROUND_LINES = 0.4, 0.035

#: Lines are looked for so far from the body [cycles a sample]. A family that still stands there at this share of its
#: mean power, by so many deviations of the noise, or whose fitted edge may be so far by so many of its own, has no edge
#: to be seen: it fills the span, and what lies beyond has been folded back between its lines.
SPAN, SPAN_SHARE, SPAN_DEVIATIONS, SPAN_EDGE, SPAN_EDGE_DEVIATIONS = 0.49, 0.05, 4.0, 0.48, 3.0

#: The orders beyond this share of the span are those asked whether it ends there.
SPAN_OUTER = 0.9

#: Rotors that are not told apart differ by about so much in their rates, relative.
LEAST_SPREAD = 0.02


@dataclass(frozen=True)
class Measurements:
    """What `measure` found; every array has the batch's leading shape, NaN where there is no value.

    Parameters
    ----------
    body_velocity_mps, body_velocity_mps_std : ndarray
        Radial velocity of the body [m/s], positive when the range grows.
    chopping_hz, chopping_hz_std : ndarray
        Chopping frequency, blades x rotation rate [Hz]; of several rotors, that of their mean rate.
    comb_order : ndarray
        Outermost order of chopping lines that speaks for the comb [1].
    comb_snr_db : ndarray
        Power of the comb's lines over the noise, a sample [dB].
    rotor_rates_hz, rotor_rates_hz_std : ndarray, shape (..., MAX_ROTORS)
        Chopping frequency of each single rotor, rising [Hz], padded with NaN.
    rotor_count : ndarray
        Rotors told apart; NaN without a comb.
    rotors_resolved : ndarray of bool
        False where rates lie nearer than the dwell tells apart: the count is then a lower bound.
    rotor_spread_hz : ndarray
        Range of the rotors' chopping frequencies [Hz], also where they are not resolved; 0 where there is one rate.
    smearing_index : ndarray
        Relative spread of the rotor rates from the growth of the line width with the order [1].
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
        Why there is a comb but no band, tip speed and blade length: its lines fill the unambiguous span; else empty.
    """

    body_velocity_mps: NDArray[np.float64]
    body_velocity_mps_std: NDArray[np.float64]
    chopping_hz: NDArray[np.float64]
    chopping_hz_std: NDArray[np.float64]
    comb_order: NDArray[np.float64]
    comb_snr_db: NDArray[np.float64]
    rotor_rates_hz: NDArray[np.float64]
    rotor_rates_hz_std: NDArray[np.float64]
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
        Carrier and pulse repetition frequency [Hz], > 0.
    blades : int, optional
        Blades of a rotor, >= 1.
    beta_rad : float, optional
        Angle between the line of sight and the rotor plane [rad], 0 <= beta < pi/2.
    on_record : callable, optional
        Called after each record with the number of those done: a record takes some hundredths of a second.

    Returns
    -------
    Measurements
        Standard deviations hold for the model: steady rates within the dwell, white noise about each line.

    Raises
    ------
    ValueError
        If `iq` is not complex, has fewer than 2 pulses or holds a value that is not finite, or an argument is out of
        its range.
    """
    if blades is not None and (blades != int(blades) or blades < 1):
        raise ValueError(f"blades is {blades!r}: it must be a whole number of at least 1")
    if beta_rad is not None and not 0 <= beta_rad < np.pi / 2:
        raise ValueError(f"beta_rad is {beta_rad!r}: it must be at least 0 and below pi/2 [rad]")
    samples = as_complex(iq)
    if not np.isfinite(samples).all():
        raise ValueError("iq holds values that are not finite: cut them out or replace them by 0")
    shape = samples.shape[:-1]
    some = samples if samples.size else np.zeros((1, *samples.shape[-1:]), np.complex64)  # of none, fields of no length
    spectrum = doppler_spectrum(some, carrier_hz=carrier_hz, prf_hz=prf_hz)
    rows = []
    with one_thread:
        for index in np.ndindex(some.shape[:-1]):
            rows.append(_measure_one(some[index], _record(spectrum, index), blades, beta_rad))
            if on_record:
                on_record(len(rows))
    columns = {}
    for field in fields(Measurements):
        if field.name != "length_is_lower_bound":
            values = np.array([row[field.name] for row in rows])[: math.prod(shape)]
            extra = (MAX_ROTORS,) if field.name.startswith("rotor_rates") else ()
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
    out["rotor_rates_hz"] = out["rotor_rates_hz_std"] = np.full(MAX_ROTORS, np.nan)
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
    comb, out["reason"] = find_comb(data)
    prf_hz, wavelength_m = data.prf_hz, data.wavelength_m
    if comb is not None:
        edge, edge_std = _edge(data, [comb.fit], comb.rest, comb.per_turn, blades)
        edge_mps, edge_std_mps = (value * prf_hz * wavelength_m / 2 for value in (edge, edge_std))
        if edge_mps + edge_std_mps < LEAST_REACH_MPS:
            comb, out["reason"] = (
                None,
                f"no rotor: the band ends at {edge_mps:.1f} m/s, below {LEAST_REACH_MPS:.0f} m/s",
            )
    if comb is None:
        return out | _body(data, None)
    out["chopping_hz"], out["chopping_hz_std"] = comb.chopping * prf_hz, comb.chopping_std * prf_hz
    out["comb_order"] = float(comb.last // comb.per_turn)
    out["comb_snr_db"] = float(10 * np.log10(max(comb.fit.snr.sum() / data.pulses, 1e-9)))

    fills = np.isinf(edge)
    gear, rotors, out["gear_reason"] = find_gear(data, comb, min(edge, SPAN))
    if gear is not None:
        data, comb = gear.alone, gear.first
        out["chopping_hz"], out["chopping_hz_std"] = comb.chopping * prf_hz, comb.chopping_std * prf_hz
        for name, (rate, std) in zip(("main", "tail"), gear.rates, strict=True):
            out[f"{name}_chopping_hz"], out[f"{name}_chopping_hz_std"] = rate * prf_hz, std * prf_hz
        out["gear_ratio"], out["gear_ratio_std"] = gear.ratio, gear.ratio_std
    count = len(rotors.rates)
    out |= _body(data, rotors.fits[0] if count > 1 else comb.fit, steady=rotors.resolved)
    if count > 1:
        # one comb fitted to several follows the strongest; the chopping frequency is that of the mean rotor
        out["chopping_hz"] = float(rotors.rates.mean()) * prf_hz
        out["chopping_hz_std"] = float(np.sqrt((rotors.stds**2).sum())) / count * prf_hz
        edge, edge_std = _edge(data, rotors.fits, rotors.rest, 1, blades)
    if not rotors.resolved:  # the mean lies anywhere within what the unresolved rates span
        out["chopping_hz_std"] = float(np.hypot(out["chopping_hz_std"], rotors.spread * prf_hz / np.sqrt(12)))
        edge, edge_std = _surer((edge, edge_std), _edge_around(data, comb, rotors, blades))
    for name, values in (("rotor_rates_hz", rotors.rates), ("rotor_rates_hz_std", rotors.stds)):
        padded = np.full(MAX_ROTORS, np.nan)
        padded[:count] = values * prf_hz
        out[name] = padded
    out["rotor_count"], out["rotors_resolved"] = float(count), rotors.resolved
    out["rotor_spread_hz"] = rotors.spread * prf_hz
    # unequal blades tell their number; between the lines of several rotors the weak ones may be something else
    seen = comb.per_turn if comb.per_turn > 1 and count == 1 else None
    known = blades if blades is not None else seen
    if fills or not edge + SPAN_EDGE_DEVIATIONS * edge_std < SPAN_EDGE:
        least_mps = SPAN_EDGE * prf_hz * wavelength_m / 2
        out["band_reason"] = (
            f"no band: lines may fill the unambiguous span, tips of {least_mps:.1f} m/s and more: raise the PRF"
        )
        edge = edge_std = np.nan
    out["bandwidth_hz"], out["bandwidth_hz_std"] = 2 * edge * prf_hz, 2 * edge_std * prf_hz
    cosine = 1.0 if beta_rad is None else float(np.cos(beta_rad))
    tip, tip_std = (value * prf_hz * wavelength_m / 2 / cosine for value in (edge, edge_std))
    out["tip_speed_mps"], out["tip_speed_mps_std"] = tip, tip_std
    if known is not None:
        rotation = out["chopping_hz"] / known
        out["rotation_hz"], out["rotation_hz_std"] = rotation, out["chopping_hz_std"] / known
        # the edge is the fastest rotor's
        length = tip / (2 * np.pi * float(rotors.rates.max()) * prf_hz / known)
        out["blade_length_m"] = length
        out["blade_length_m_std"] = length * float(np.hypot(tip_std / tip, comb.chopping_std / comb.chopping))

    centre_mps = np.float32(-comb.fit.centre * prf_hz * wavelength_m / 2)
    energy = np.where(spectrum.level_db > 6.0, residual(spectrum, mask), np.float32(0))
    nothing = np.float32(np.nan)
    index = smearing_index(
        spectrum,
        energy,
        Body(body.index, np.asarray(centre_mps), body.level_db),
        Chopping(np.asarray(np.float32(out["chopping_hz"])), np.asarray(nothing), np.asarray(nothing)),
    )
    out["smearing_index"] = float(index)
    return out


def _body(data: Periodogram, fit: CombFit | None, *, steady: bool = True) -> dict[str, float]:
    """The body's velocity: from its own line, or from the comb's centre where background may hide that line; or NaN.

    Of unresolved rotors, or a rate that is not steady, the centre has no true deviation.
    """
    own, level_db = data.centres[0], data.centres_db[0]
    # the bound of a single line's frequency, and what its interpolation between bins is off by
    snr = 10 ** (level_db / 10)
    own_std = float(np.hypot(np.sqrt(1.5 / snr) / np.pi, 0.01)) / data.pulses
    turns, std = own, own_std
    if fit is None and level_db < LINE_DB:
        return {"body_velocity_mps": np.nan, "body_velocity_mps_std": np.nan}
    if fit is not None:
        offset = (own - fit.centre) * data.pulses
        if abs(offset) > 1.0 or (steady and fit.centre_std < own_std):
            turns, std = fit.centre, fit.centre_std
    scale = data.prf_hz * data.wavelength_m / 2
    return {"body_velocity_mps": -turns * scale, "body_velocity_mps_std": std * scale}


def _edge(
    data: Periodogram, fits: list[CombFit], rest: NDArray[np.complex128], per_turn: int, blades: int | None
) -> tuple[float, float]:
    """Edge of the line family and its standard deviation [cycles a sample from the body], both sides together.

    Each line's power is what is seen there with all other fitted lines taken out; an order's is the mean over both
    sides and the single rotors, since their lines part at the outer orders. Without such orders nothing is known.
    """
    spacings = np.array([fit.spacing * per_turn for fit in fits])
    fastest = float(spacings.max())
    order = np.arange(1, int(SPAN / fastest) + 1)
    sides = np.array([[-1], [1]]) * order
    centres = np.array([fit.centre for fit in fits])
    frequency = np.asarray(centres[:, None, None] + spacings[:, None, None] * sides, np.float64)
    fitted = np.stack([_amplitudes_at(fit, per_turn * sides) for fit in fits])
    left = LineSpace(rest).at(frequency.ravel())[0].reshape(frequency.shape)
    usable = data.usable(frequency)
    total = np.where(usable, np.abs(left + fitted) ** 2 * data.pulses, 0.0).sum(axis=(0, 1))
    noise = np.where(usable, data.level_of(rest)(frequency), 0.0).sum(axis=(0, 1))
    number = usable.sum(axis=(0, 1)).astype(float)
    # where the single rotors' lines lie in one another they add up: those orders stand too high beside the outer ones
    nearest = float(np.diff(np.sort(spacings)).min()) if len(fits) > 1 else 1.0
    seen = (number > 0) & (order * nearest * data.pulses >= MERGED_BINS)
    if not seen.any():
        return 0.0, np.inf
    count = number[seen]
    if _fills_span(order[seen] * fastest, total[seen], noise[seen], count):
        return np.inf, np.inf
    leak = SEVERAL_LEAK if len(fits) > 1 else LEAK_SHARE
    edge, std = fit_edge(order[seen], total[seen] / count, noise[seen] / count, count, blades, leak=leak)
    return edge * fastest, std * fastest


def _fills_span(
    away: NDArray[np.float64], total: NDArray[np.float64], noise: NDArray[np.float64], bins: NDArray[np.float64]
) -> bool:
    """True where a line family still stands at the end of the span.

    Parameters
    ----------
    away : ndarray, shape (orders,)
        Distance of each order from the body, rising [cycles a sample].
    total, noise : ndarray, shape (orders,)
        Power of its lines with their noise, and of that alone, summed over so many `bins`.
    """
    outer = (away > SPAN_OUTER * SPAN) | (away == away[-1])
    excess, number = total - noise, bins[outer].sum()
    deviation = float(np.sqrt((noise[outer] ** 2 / bins[outer]).sum()))
    stands = float(excess[outer].sum()) > SPAN_DEVIATIONS * deviation
    mean = float(excess.sum() / bins.sum())
    return bool(away[-1] > SPAN / 2 and stands and excess[outer].sum() / number > SPAN_SHARE * mean)


def _amplitudes_at(fit: CombFit, orders: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Amplitudes of a fit's lines of these orders, 0 where it has none, same shape."""
    widest = int(max(np.abs(orders).max(), np.abs(fit.orders).max()))
    table = np.zeros(2 * widest + 1, np.complex128)
    table[widest + fit.orders] = fit.amplitudes
    return table[widest + orders]


def _surer(lines: tuple[float, float], around: tuple[float, float]) -> tuple[float, float]:
    """Of unresolved rotors, the edge of the lines and its deviation, if it is the surer one; or that of all about them.

    Rotors that were not told apart show in the second alone. It is known to its own deviation, whatever the first says.
    """
    if not np.isfinite(lines[0] + around[0]):
        return np.inf, np.inf
    agreed = abs(around[0] - lines[0]) < AGREED_DEVIATIONS * around[1]
    return lines if agreed and lines[1] < around[1] else around


def _edge_around(data: Periodogram, comb: Comb, rotors: Rotors, blades: int | None) -> tuple[float, float]:
    """Edge and its standard deviation by all that lies about each order: rotors that are not told apart count too."""
    nominal, centre = float(np.mean([rotors.rates.min(), rotors.rates.max()])), rotors.fits[0].centre
    size, pulses = len(data.power), data.pulses
    order = np.arange(1, int(SPAN / nominal) + 1)
    spread = max(rotors.spread, LEAST_SPREAD * nominal)
    half_bins = min(nominal * pulses / 2, 1 + comb.last / comb.per_turn * spread * pulses)
    half = int(half_bins * size / pulses)
    # what lies between the lines lifts the local level: the noise is that of most of the span, and the floor at most
    bins = np.arange(size) / size
    floor = min(float(np.median(data.level_of(rotors.rest)(bins)[data.seen])), 1.0)
    total, number = np.zeros(len(order)), np.zeros(len(order))
    for sign in (-1, 1):
        middle = np.rint((centre + sign * order * nominal) * size).astype(np.intp)
        frequency = (middle[:, None] + np.arange(-half, half + 1)) / size
        usable = data.usable(frequency)
        power = data.at(frequency) * data.level_at(frequency)
        total += np.where(usable, power, 0.0).sum(axis=1) * pulses / size
        number += usable.sum(axis=1) * pulses / size
    seen = number > 2
    count = number[seen]
    noise = np.full(len(count), floor)
    if _fills_span(np.asarray(order[seen] * nominal, np.float64), total[seen], noise * count, count):
        return np.inf, np.inf
    # once the lines part, what they have of one another falls with the square of their distance
    scatter = np.asarray(AROUND_SCATTER / (1 + (2 * order[seen] * rotors.spread * pulses) ** 2), np.float64)
    edge, std = fit_edge(order[seen], total[seen] / count, noise, count, blades, scatter=scatter, leak=SEVERAL_LEAK)
    fastest = float(max(nominal, rotors.rates.max()))
    return edge * fastest, float(np.hypot(std, AROUND_LINES)) * fastest
