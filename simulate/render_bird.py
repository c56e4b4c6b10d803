"""Rendering of a scene's birds: flapping, flap-gliding and bounding flight, accelerating bodies, small flocks."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bird import wing_echo, wing_size, wingbeat_hz
from .exact import range_echo
from .fidelity import Fidelity, centre_range_m
from .generator import generator
from .motion import TWO_PI
from .parts import BirdPart
from .radar import Radar


def bird_wingbeat_hz(part: BirdPart) -> float:
    """Wingbeat of a bird [Hz]: as given, or by Pennycuick from its size."""
    if part.wingbeat_hz is not None:
        return part.wingbeat_hz
    span, area = wing_size(part.mass_kg)
    return float(wingbeat_hz(part.mass_kg, part.span_m or span, part.area_m2 or area))


@dataclass(frozen=True)
class Member:
    """One bird of a flock: wingbeat over the species' [1], phase [rad], own velocity [m/s] and place [m]."""

    beat: float
    phase_rad: float
    velocity_mps: float
    place_m: float


def members(part: BirdPart) -> list[Member]:
    """Birds of a part: the first is as the part says, the others are drawn by its `flock_seed`."""
    rng = generator(part.flock_seed)
    birds = [Member(1.0, float(np.deg2rad(part.phase_deg)), 0.0, 0.0)]
    for _ in range(part.members - 1):
        beat, phase, place = rng.uniform(0.95, 1.05), rng.uniform(-np.pi, np.pi), rng.uniform(0, 3)
        birds.append(Member(beat, phase, part.flock_velocity_mps * rng.standard_normal(), place))
    return birds


def bird_echo(part: BirdPart, radar: Radar, times_s: NDArray[np.float64], how: Fidelity) -> NDArray[np.complex128]:
    """Echo of a bird or a small flock.

    Parameters
    ----------
    part : BirdPart
        The bird.
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
    centre = centre_range_m(part, times_s, "acceleration" in how.effects)
    out = np.zeros(len(times_s), np.complex128)
    for bird in members(part):
        place = centre + bird.velocity_mps * times_s + bird.place_m
        if "heave" in how.effects:
            place = place + heave_range_m(part, times_s, bird)
        out += bird_parts_echo(part, radar, times_s, bird) * range_echo(place, radar.wavelength_m)
    return out


def heave_range_m(part: BirdPart, times_s: NDArray[np.float64], bird: Member) -> NDArray[np.float64]:
    """Range change as the body rises and sinks against the wings [m]: it is lowest when they are highest."""
    cycle, _ = _cycle_rad(part, times_s, bird)
    return -part.heave_m * np.sin(np.deg2rad(part.elevation_deg)) * np.cos(cycle)


def bird_parts_echo(part: BirdPart, radar: Radar, times_s: NDArray[np.float64], bird: Member) -> NDArray[np.complex128]:
    """Body and wings of one bird about its centre, shape (pulses,)."""
    cycle, wings_out = _cycle_rad(part, times_s, bird)
    heading, elevation = np.deg2rad(part.heading_deg), np.deg2rad(part.elevation_deg)
    sight = np.array([np.cos(heading) * np.cos(elevation), np.sin(heading) * np.cos(elevation), -np.sin(elevation)])
    span = part.span_m or float(wing_size(part.mass_kg)[0])
    wings = wing_echo(
        cycle,
        wavelength_m=radar.wavelength_m,
        half_span_m=span / 2,
        sight=sight,
        stroke_scale=part.stroke_scale,
        down_stroke=part.down_stroke,
        feather_weight=part.feather_weight,
    )
    full = (4 + 4 * part.feather_weight) * (1 + part.down_stroke * min(part.stroke_scale, 1.0))
    echo = 10 ** (part.wing_db / 20) / full * wings * wings_out + 10 ** (part.body_db / 20)
    return np.asarray(echo, np.complex128)


def _cycle_rad(
    part: BirdPart, times_s: NDArray[np.float64], bird: Member
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Phase of the wingbeat [rad], which rests hold, and whether the wings are out, 0 (a bounding bird's rest) or 1."""
    if part.flight == "flap":
        beating, out = times_s, np.ones(len(times_s))
    else:
        turn = part.flap_s + part.rest_s
        bouts, within = np.floor(times_s / turn), np.mod(times_s, turn)
        beating = bouts * part.flap_s + np.minimum(within, part.flap_s)
        folded = (within > part.flap_s) & (part.flight == "bound")
        out = np.where(folded, 0.0, 1.0)
    return TWO_PI * bird_wingbeat_hz(part) * bird.beat * beating + bird.phase_rad, out


def bird_truth(part: BirdPart) -> dict[str, Any]:
    """Truth about a bird."""
    return {
        "name": part.name,
        "label": "bird",
        "kind": part.species or ("flock" if part.members > 1 else "bird"),
        "range_m": part.range_m,
        "velocity_mps": part.velocity_mps,
        "acceleration_mps2": part.acceleration_mps2,
        "wingbeat_hz": bird_wingbeat_hz(part),
        "mass_kg": part.mass_kg,
        "members": part.members,
        "wing_db": part.wing_db,
        "body_db": part.body_db,
    }
