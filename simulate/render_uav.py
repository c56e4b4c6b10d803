"""Rendering of a scene's UAVs: exact or far-field ranges, blades in closed form or as dense points, by a `Fidelity`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blades import row_m
from .exact import BladePoints, blade_points, dense_rotor_echo, hub_range_m, range_echo
from .fidelity import UAV_EFFECTS, Fidelity, centre_range_m
from .motion import TWO_PI, range_phasor
from .parts import RotorPart, UavPart
from .radar import Radar
from .rotor import RotorMotion, rotor_echo


def full_fidelity(part: UavPart, radar: Radar) -> Fidelity:
    """Every effect, and enough scatterers a blade that float64 cannot tell them from a continuous one."""
    longest = max((r.blade_length_m - r.root_m for r in part.rotors if not r.points), default=0.0)
    phase = 2 * TWO_PI * longest / radar.wavelength_m
    # phase / 4 points represent the blade, but the bound (`sag_error`) shows that only from e / 8 x phase points on
    return Fidelity(frozenset(UAV_EFFECTS), int(np.e / 8 * phase + 6 * np.cbrt(phase)) + 30)


def rotor_angle_rad(rotor: RotorPart, times_s: NDArray[np.float64], wanders: bool) -> NDArray[np.float64]:
    """Angle of a rotor's first blade [rad], shape (pulses,), with or without drift and wander of its rate."""
    motion = RotorMotion(
        rotor.rotation_hz,
        np.deg2rad(rotor.phase_deg),
        drift_hz_per_s=rotor.drift_hz_per_s if wanders else 0.0,
        wander_hz=rotor.wander_hz if wanders else 0.0,
        wander_rate_hz=rotor.wander_rate_hz,
        wander_phase_rad=np.deg2rad(rotor.wander_phase_deg),
    )
    return motion.angle_rad(times_s)


def uav_echo(part: UavPart, radar: Radar, times_s: NDArray[np.float64], how: Fidelity) -> NDArray[np.complex128]:
    """Echo of a UAV, its absolute range included.

    Parameters
    ----------
    part : UavPart
        The UAV.
    radar : Radar
        The radar that looks.
    times_s : ndarray of float64, shape (pulses,)
        Instants of the pulses [s].
    how : Fidelity
        What to keep.

    Returns
    -------
    ndarray of complex128, shape (pulses,)
    """
    wavelength = radar.wavelength_m
    centre = centre_range_m(part, times_s, "acceleration" in how.effects)
    straight_blades = "blade_curvature" not in how.effects
    near_hubs = not straight_blades or "hub_curvature" in how.effects
    out = np.zeros(len(times_s), np.complex128)
    for rotor in part.rotors:
        hub = hub_range_m(centre, rotor.offset_m, np.deg2rad(rotor.bearing_deg), far_field=not near_hubs)
        angle = rotor_angle_rad(rotor, times_s, "wander" in how.effects)
        level = part.amplitude(rotor.flash_db) * np.exp(1j * np.deg2rad(rotor.hub_phase_deg))
        beta = part.beta_rad(rotor)
        if how.points is None:
            blades = rotor_echo(
                angle,
                wavelength_m=wavelength,
                blade_length_m=rotor.blade_length_m,
                beta_rad=beta,
                root_m=rotor.root_m,
                blade_amplitudes=rotor.amplitudes,
                edge_asymmetry=rotor.edge_asymmetry,
                points=rotor.points,
            )
            out += level * blades * range_phasor(hub, wavelength)
        else:
            out += level * dense_rotor_echo(
                hub,
                angle,
                scatterers(rotor, how.points),
                wavelength_m=wavelength,
                beta_rad=beta,
                blade_amplitudes=rotor.amplitudes,
                edge_asymmetry=rotor.edge_asymmetry,
                far_field=straight_blades,
            )
    for point in part.body:
        place = hub_range_m(centre, point.offset_m, np.deg2rad(point.bearing_deg), far_field=not near_hubs)
        amplitude = part.amplitude(point.level_db) * np.exp(1j * np.deg2rad(point.phase_deg))
        out += amplitude * range_echo(place, wavelength)
    if "vibration" in how.effects and part.vibration_rad:
        out *= np.exp(1j * vibration_rad(part, times_s))
    return out


def scatterers(rotor: RotorPart, points: int) -> BladePoints:
    """Points of one blade: its own row, or `points` Gauss points in place of a line."""
    if rotor.points:
        row = row_m(rotor.root_m, rotor.blade_length_m, rotor.points)
        return BladePoints(row, np.full(len(row), 1 / len(row)))
    return blade_points(rotor.root_m, rotor.blade_length_m, points, "gauss")


def vibration_rad(part: UavPart, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Phase that the vibration of the rigid airframe adds to its echo, body and hubs alike [rad], shape (pulses,)."""
    return part.vibration_rad * np.sin(TWO_PI * part.vibration_hz * times_s)


def uav_truth(part: UavPart) -> dict[str, Any]:
    """Truth about a UAV; values of rotors are lists, one entry a rotor."""
    return {
        "name": part.name,
        "label": "uav",
        "kind": part.airframe or "uav",
        "range_m": part.range_m,
        "velocity_mps": part.velocity_mps,
        "acceleration_mps2": part.acceleration_mps2,
        "beta_deg": part.beta_deg,
        "rotor_beta_deg": [part.rotor_beta_deg(rotor) for rotor in part.rotors],
        "rotation_hz": [rotor.rotation_hz for rotor in part.rotors],
        "blades": [rotor.blades for rotor in part.rotors],
        "blade_length_m": [rotor.blade_length_m for rotor in part.rotors],
        "chopping_hz": [abs(rotor.rotation_hz) * _flashes(rotor) for rotor in part.rotors],
        "line_spacing_hz": [abs(rotor.rotation_hz) * _repeats(rotor) for rotor in part.rotors],
        "flash_db": [rotor.flash_db + part.gain_db for rotor in part.rotors],
        "body_db": [point.level_db + part.gain_db for point in part.body],
    }


def _flashes(rotor: RotorPart) -> int:
    """Flashes a turn on each side (the paper's eq. 25): one for each blade that reflects at all."""
    return max(1, sum(amplitude > 0 for amplitude in rotor.amplitudes))


def _repeats(rotor: RotorPart) -> int:
    """Repeats of a rotor's echo within a turn: once a blade if all are equal, twice for strong, weak, strong, weak.

    Lines stand that many rotation rates apart.
    """
    every, count = list(rotor.amplitudes), rotor.blades
    turned = (step for step in range(1, count + 1) if count % step == 0 and every[step:] + every[:step] == every)
    return count // next(turned)
