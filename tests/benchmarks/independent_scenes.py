"""Scenes from a simulator that shares no code with `bladewing.simulate`: point scatterers, exp(-4j pi R / wavelength).

It is written the way published micro-Doppler simulators are (Chen, *The Micro-Doppler Effect in Radar*, 2011: rotors of
scatterers, bird and walker of ellipsoids; Billingsley, *Low-Angle Radar Land Clutter*, 2002): every scatterer has a
position in metres at every pulse, and its echo has the two-way phase of the range. Nothing is taken from the product,
so a model that only fits the product's own simulator fails here. The radar is at the origin, x points to the target,
z up.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from . import independent_clutter as clutter
from .independent_echo import Radar, Scene, across, echo, level, phasor, unit

BLADE_LAWS = ("line", "points", "tip", "asymmetric")


def rotor(
    rng: np.random.Generator,
    radar: Radar,
    hub_m: np.ndarray,
    axis: np.ndarray,
    *,
    blades: int,
    radius_m: float,
    rate_hz: float,
    law: str,
) -> np.ndarray:
    """Make the echo of blades that turn about `axis` at `hub_m` (pulses, 3), with exact ranges.

    The laws of the literature: a "line" of evenly reflecting elements a quarter wavelength apart (Martin and Mulgrew),
    a handful of "points", the "tip" alone, and a line of which one side of the disc reflects less ("asymmetric").
    """
    first, second = across(axis)
    root = 0.1 * radius_m
    if law == "tip":
        along = np.array([radius_m])
    elif law == "points":
        along = np.linspace(root, radius_m, rng.integers(5, 13))
    else:
        along = np.arange(root, radius_m, radar.wavelength_m / 4)
    hub_squared = np.sum(hub_m**2, axis=-1)
    start = rng.uniform(0, 2 * np.pi)
    weaker = rng.uniform(0.2, 0.8) if law == "asymmetric" else 0.0
    out = np.zeros(radar.pulses, np.complex64)
    for blade in range(blades):
        angle = 2 * np.pi * rate_hz * radar.time_s + start + 2 * np.pi * blade / blades
        direction = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        towards = np.sum(hub_m * direction, axis=-1)
        gain = 1 - weaker * (0.5 + 0.5 * np.sin(angle))  # the weaker side of the disc is that of `second`
        for part in np.array_split(along, max(1, len(along) // 64)):
            ranges = np.sqrt(hub_squared + part[:, None] ** 2 + 2 * part[:, None] * towards)
            out += gain.astype(np.float32) * phasor(ranges, radar).sum(axis=0)
    return out


def flight(rng: np.random.Generator, radar: Radar, speed_mps: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Draw a straight track (pulses, 3) that starts at an elevation of 2 to 25 degrees; give it with its heading."""
    elevation, heading = np.deg2rad(rng.uniform(2, 25)), rng.uniform(0, 2 * np.pi)
    start = rng.uniform(100, 1500) * np.array([np.cos(elevation), 0, np.sin(elevation)])
    ahead = unit(np.array([np.cos(heading), np.sin(heading), rng.normal(0, 0.05)]))
    return start + radar.time_s[:, None] * ahead * rng.uniform(*speed_mps), ahead


def tilted(rng: np.random.Generator, most_deg: float) -> np.ndarray:
    """Draw a rotor's axis: vertical except for a tilt of at most `most_deg`."""
    tilt, towards = np.deg2rad(rng.uniform(0, most_deg)), rng.uniform(0, 2 * np.pi)
    return np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), np.cos(tilt)])


def multicopter(
    rng: np.random.Generator,
    radar: Radar,
    rotors: int = 4,
    *,
    law: str | None = None,
    radius_m: tuple[float, float] = (0.10, 0.20),
    rate_hz: tuple[float, float] = (65, 120),
) -> Scene:
    """Make rotors on a ring, each at its own rate; the power of all blades is 5 to 20 dB below the body's."""
    law = law or str(rng.choice(BLADE_LAWS))
    hover = rng.uniform() < 0.3
    track, _ = flight(rng, radar, (0, 0.5) if hover else (2, 18))
    axis = tilted(rng, 5 if hover else 20)
    radius, rate = rng.uniform(*radius_m), rng.uniform(*rate_hz)
    first, second = across(axis)
    micro = np.zeros(radar.pulses, np.complex64)
    arm = 1.3 * radius / np.sin(np.pi / rotors)
    turn, rates = rng.uniform(0, 2 * np.pi), rate * (1 + rng.uniform(0.01, 0.08) * rng.uniform(-1, 1, rotors))
    for index in range(rotors):
        around = turn + 2 * np.pi * index / rotors
        hub = track + arm * (np.cos(around) * first + np.sin(around) * second)
        micro += rotor(rng, radar, hub, axis, blades=2, radius_m=radius, rate_hz=rates[index], law=law)
    places = track + rng.normal(0, 0.5 * arm, (5, 1, 3)) * [1, 1, 0.3]
    body = echo(places, radar, rng.rayleigh(1, (5, 1)))
    return Scene(level(body, 0), level(micro, rng.uniform(-20, -5)))


def quadcopter_over_ground(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make a quadcopter with ground in its cell, 0 to 25 dB over its body."""
    scene = multicopter(rng, radar)
    return Scene(scene.body + level(clutter.ground(rng, radar).micro, rng.uniform(0, 25)), scene.micro)


def helicopter(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make a model helicopter: a main rotor of 0.35 to 0.8 m radius and a tail rotor 4 to 5.5 times as fast."""
    law = str(rng.choice(BLADE_LAWS))
    track, ahead = flight(rng, radar, (0, 20))
    rate, radius = rng.uniform(20, 40), rng.uniform(0.35, 0.8)
    main = rotor(rng, radar, track, tilted(rng, 10), blades=2, radius_m=radius, rate_hz=rate, law=law)
    side = unit(np.cross(ahead, [0, 0, 1]))
    tail = rotor(
        rng,
        radar,
        track - 1.2 * radius * ahead,
        side,
        blades=2,
        radius_m=0.2 * radius,
        rate_hz=rate * rng.uniform(4, 5.5),
        law=law,
    )
    body = echo(track - np.linspace(0, 1.2 * radius, 6)[:, None, None] * ahead, radar, rng.rayleigh(1, (6, 1)))
    micro = level(main, 0) + level(tail, rng.uniform(-15, -5))
    return Scene(level(body, 0), level(micro, rng.uniform(-18, -3)))


def fixed_wing(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make one two-bladed propeller whose axis is the line of flight, seen at 20 to 160 degrees off the nose."""
    law = str(rng.choice(BLADE_LAWS))
    track, _ = flight(rng, radar, (0, 0))
    off = np.deg2rad(rng.uniform(20, 160)) * rng.choice([-1, 1])
    ahead = unit(np.array([-np.cos(off), np.sin(off), rng.normal(0, 0.05)]))
    track = track + radar.time_s[:, None] * ahead * rng.uniform(12, 28)
    nose = track + 0.4 * ahead
    radius, rate = rng.uniform(0.10, 0.20), rng.uniform(70, 150)
    propeller = rotor(rng, radar, nose, ahead, blades=2, radius_m=radius, rate_hz=rate, law=law)
    wing = rng.uniform(-0.8, 0.8, (5, 1, 1)) * unit(np.cross(ahead, [0, 0, 1]))
    places = np.concatenate([track + wing, track - rng.uniform(0, 0.8, (3, 1, 1)) * ahead])
    body = echo(places, radar, rng.rayleigh(1, (8, 1)))
    return Scene(level(body, 0), level(propeller, rng.uniform(-25, -8)))


# wingbeat [Hz] and span [m]: swan, gull, goose, crow, pigeon, swallow, starling, siskin
BIRDS = (
    (3.3, 2.2),
    (3.8, 1.3),
    (4.4, 1.6),
    (4.6, 0.9),
    (6.5, 0.66),
    (8.3, 0.33),
    (9.7, 0.39),
    (12.5, 0.22),
)


def spheroid(length_m: float, radius_m: float, axis: np.ndarray, sight: np.ndarray) -> np.ndarray:
    """Give the amplitude of a spheroid's echo seen along `sight` (Chen, RCS of an ellipsoid)."""
    cosine2 = np.sum(axis * sight, axis=-1) ** 2
    half = length_m / 2
    return np.sqrt(np.pi) * radius_m**2 * half / (radius_m**2 * (1 - cosine2) + half**2 * cosine2)


def bird(
    rng: np.random.Generator,
    radar: Radar,
    *,
    flapping: bool = True,
    kind: tuple[float, float] | None = None,
    start_m: np.ndarray | None = None,
    ahead: np.ndarray | None = None,
    speed_mps: float | None = None,
) -> Scene:
    """Make an ellipsoid with two wings of two segments (JEES 2021: inner 40 cos + 15 deg, outer 30 cos + 40 deg).

    Here the outer segment is bent from the inner one by 30 cos - 10 deg, 0.6 rad ahead in phase, and swept by 20 sin
    deg. The body heaves against the wings. Every segment is a row of four spheroids.
    """
    beat_hz, span = kind or BIRDS[rng.integers(len(BIRDS))]
    beat_hz, span = beat_hz * rng.uniform(0.85, 1.15), span * rng.uniform(0.85, 1.15)
    track, heading = flight(rng, radar, (0, 0))
    ahead = heading if ahead is None else ahead
    start = track[0] if start_m is None else start_m
    speed = rng.uniform(8, 18) if speed_mps is None else speed_mps
    sight = unit(start)
    phase = 2 * np.pi * beat_hz * radar.time_s + rng.uniform(0, 2 * np.pi) if flapping else np.full(radar.pulses, 1.57)
    heave = -0.02 * span * np.cos(phase) * flapping
    place = start + radar.time_s[:, None] * ahead * speed + heave[:, None] * [0, 0, 1]
    side, up = unit(np.cross(ahead, [0, 0, 1])), np.array([0.0, 0.0, 1.0])
    body = echo(place[None], radar, spheroid(0.3 * span, 0.07 * span, ahead, sight))
    inner = np.deg2rad(40 * np.cos(phase) + 15) if flapping else np.deg2rad(5 + 0 * phase)
    bend = np.deg2rad(30 * np.cos(phase + 0.6) - 10) if flapping else 0 * phase
    sweep = np.deg2rad(20 * np.sin(phase)) if flapping else 0 * phase
    micro = np.zeros(radar.pulses, np.complex64)
    for hand in (-1, 1):
        joint = place + hand * 0.05 * span * side
        for length, lift, back in ((0.2 * span, inner, 0 * sweep), (0.25 * span, inner + bend, sweep)):
            axis = (
                hand * (np.cos(lift) * np.cos(back))[:, None] * side
                + (np.sin(lift) * np.cos(back))[:, None] * up
                + np.sin(back)[:, None] * ahead
            )
            amplitude = spheroid(length / 4, 0.02 * span, axis, sight)
            middles = (np.arange(4) + 0.5) / 4 * length
            micro += echo(joint + middles[:, None, None] * axis, radar, amplitude)
            joint = joint + length * axis
    return Scene(body, micro) if flapping else Scene(body + micro, np.zeros_like(micro))


def flock(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make 3 to 20 birds of one kind, a few metres apart, at nearly the same velocity."""
    track, ahead = flight(rng, radar, (0, 0))
    kind, speed = BIRDS[rng.integers(len(BIRDS))], rng.uniform(8, 18)
    birds = [
        bird(
            rng,
            radar,
            kind=kind,
            start_m=track[0] + rng.normal(0, 3, 3),
            ahead=unit(ahead + rng.normal(0, 0.03, 3)),
            speed_mps=speed + rng.normal(0, 0.4),
        )
        for _ in range(rng.integers(3, 21))
    ]
    return Scene(sum(b.body for b in birds), sum(b.micro for b in birds))


KINDS: dict[str, tuple[str, Callable[[np.random.Generator, Radar], Scene]]] = {
    "quadcopter": ("uav", multicopter),
    "quad_over_ground": ("uav", quadcopter_over_ground),
    "hexacopter": ("uav", partial(multicopter, rotors=6, radius_m=(0.15, 0.30), rate_hz=(40, 75))),
    "helicopter": ("uav", helicopter),
    "fixed_wing": ("uav", fixed_wing),
    "flapping_bird": ("bird", bird),
    "gliding_bird": ("bird", partial(bird, flapping=False)),
    "flock": ("bird", flock),
    "ground": ("clutter", clutter.ground),
    "rain": ("clutter", clutter.rain),
    "sea": ("clutter", clutter.sea),
    "person": ("clutter", clutter.person),
    "vehicle": ("clutter", clutter.vehicle),
    "wind_turbine": ("clutter", clutter.wind_turbine),
    "noise": ("clutter", clutter.noise),
    # Only the tips reflect: there is no flash, and the power lies at the edges of the band.
    "quad_of_tips": ("uav", partial(multicopter, law="tip")),
    # A turbine whose lines are for a while as evenly spaced as a rotor's.
    "turbine_of_points": ("clutter", partial(clutter.wind_turbine, points=40, law="points")),
}
"""Kind to the class that it should be called, and the function that makes a scene of it."""
