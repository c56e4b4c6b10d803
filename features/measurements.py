"""What `measure` gives: every number of a record with its standard deviation."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

#: The fields of the body's velocity and its deviation.
BODY = ("body_velocity_mps", "body_velocity_mps_std")

#: The fields that have a value for each rotor.
EACH_ROTOR = ("rotor_rates_hz", "rotor_rates_hz_std", "rotor_drifts_hz_per_s", "rotor_drifts_hz_per_s_std")

#: Blade counts listed where none is given.
BLADE_CHOICES = (1, 2, 3, 4, 5)


@dataclass(frozen=True, eq=False)
class Measurements:
    """What `measure` found; every array has the batch's leading shape, NaN where there is no value.

    Parameters
    ----------
    body_velocity_mps, body_velocity_mps_std : ndarray
        Radial velocity of the body [m/s], positive when the range grows.
    chopping_hz, chopping_hz_std : ndarray
        Chopping frequency, blades x rotation rate [Hz]; of several rotors, that of their mean rate, whose deviation
        allows for a rotor so strong that it may be two. Where the rate changes within the dwell, that of the nearest
        constant rate. Of a helicopter it is the main rotor's, or the tail's where the dwell holds too few flashes of
        the main one.
    chopping_drift_hz_per_s, chopping_drift_hz_per_s_std : ndarray
        Its linear drift within the dwell [Hz/s]; of several rotors that of their mean, NaN where they are not resolved.
        Neither velocity nor a constant acceleration of the body passes for it.
    comb_order : ndarray
        Outermost order of chopping lines with evidence for the comb [1].
    comb_snr_db : ndarray
        Power of the comb's lines over that of the noise, per sample [dB].
    rotor_rates_hz, rotor_rates_hz_std : ndarray, shape (..., MAX_ROTORS)
        Chopping frequency of each single rotor, rising [Hz], padded with NaN; where they are not resolved, that of
        combs that may hold several rotors, which the deviation allows for.
    rotor_drifts_hz_per_s, rotor_drifts_hz_per_s_std : ndarray, shape (..., MAX_ROTORS)
        Linear drift of each within the dwell [Hz/s], padded in the same way; NaN where they are not resolved.
    rotor_count : ndarray
        Rotors resolved; NaN without a comb.
    rotors_resolved : ndarray of bool
        False where rates lie closer than the dwell resolves, or changed irregularly within it: of steady ones the count
        is then a lower bound.
    rotor_spread_hz : ndarray
        Range of the rotors' chopping frequencies [Hz], also where they are not resolved; 0 where there is one rate.
    smearing_index : ndarray
        Relative spread of the rotor rates from the growth of the line width with the order; above 0.04, where lines
        widen no more, from the rates of resolved rotors [1].
    bandwidth_hz, bandwidth_hz_std : ndarray
        Doppler bandwidth f_max - f_min from the fitted edge of the line family [Hz] (the paper's eq. 26); of a
        helicopter, like tip speed and blade, that of the rotor whose chopping frequency is given.
    threshold_bandwidth_hz : ndarray
        The same by the paper's rule: the range over a threshold of 20 dB over the noise [Hz].
    tip_speed_mps, tip_speed_mps_std : ndarray
        Blade tip speed [m/s]; its part along the line of sight, a lower bound, where beta is not given.
    notch_residual_db : ndarray
        Mean power outside the notches over the noise floor [dB].
    rotation_hz, rotation_hz_std : ndarray
        Rotation rate [Hz]; NaN where the number of blades is neither given nor seen in unequal lines or in evenly
        spaced flashes, or where these flashes may be two rotors'.
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
        Why there is a comb but no band, tip speed and blade length: its lines fill the unambiguous span, or blades
        still flash past them; they reach further from the body than any blade's tip; where they end is lost in the
        noise; or a single channel has both sides of the body folded onto one. Or why there is a band but neither tip
        speed nor blade length: at the beta given the tips were faster than any blade's. Else empty.
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

    @classmethod
    def joined(cls, runs: Sequence[Self]) -> Self:
        """Measurements of several batches, taken with the same beta, joined along their first axis."""
        columns: dict[str, Any] = {"length_is_lower_bound": runs[0].length_is_lower_bound}
        for name in (field.name for field in fields(cls) if field.name not in columns):
            columns[name] = np.concatenate([getattr(run, name) for run in runs])
        return cls(**columns)

    def alternatives(self, index: tuple[int, ...] = ()) -> list[dict[str, float]]:
        """The {blades, rpm, blade_length_m} that a record's chopping frequency and band allow.

        Parameters
        ----------
        index : tuple of int
            Which record of the batch; () for a single one.

        Returns
        -------
        list of dict
            One entry where the rotation rate is known, one per blade count where it is not, none without a comb.
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
