"""Scenes from a simulator that shares no line with `bladewing.simulate`: point scatterers, exp(-4j pi R / wavelength).

It is written the way published micro-Doppler simulators are (Chen, *The Micro-Doppler Effect in Radar*, 2011: rotors of
scatterers, bird and walker of ellipsoids; Billingsley, *Low-Angle Radar Land Clutter*, 2002): every scatterer has a
place in metres at every pulse and its echo its two-way phase. Nothing is taken from the product, so a model that
only knows the product's own drawings shows it here. Radar at the origin, x to the target, z up.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

LIGHT_MPS = 299_792_458.0
BLADE_LAWS = ("line", "points", "tip", "asymmetric")


@dataclass(frozen=True)
class Radar:
    """A pulse-Doppler or FMCW radar that keeps one range cell."""

    carrier_hz: float
    prf_hz: float
    pulses: int

    @property
    def wavelength_m(self) -> float:
        return LIGHT_MPS / self.carrier_hz

    @property
    def time_s(self) -> np.ndarray:
        return np.arange(self.pulses) / self.prf_hz

    @property
    def name(self) -> str:
        return f"{self.carrier_hz / 1e9:g} GHz {self.prf_hz / 1e3:g} kHz {1e3 * self.pulses / self.prf_hz:.0f} ms"


@dataclass(frozen=True)
class Scene:
    """Echoes without noise: the body (all that moves as a whole) and the micro-motion (blades, wings, limbs, wheels).

    A process without parts (ground, sea, rain) is all micro-motion; a glider and noise have none.
    """

    body: np.ndarray
    micro: np.ndarray


# ---------------------------------------------------------------------------------------------------------- scatterers


def phasor(range_m: np.ndarray, radar: Radar) -> np.ndarray:
    """Two-way phase of a range, complex64."""
    cycles = range_m * (-2 / radar.wavelength_m)
    cycles -= np.rint(cycles)
    angle = (2 * np.pi * cycles).astype(np.float32)
    out = np.empty(angle.shape, np.complex64)
    np.cos(angle, out=out.real)
    np.sin(angle, out=out.imag)
    return out


def echo(place_m: np.ndarray, radar: Radar, amplitude: np.ndarray | float = 1.0) -> np.ndarray:
    """Sum over scatterers at `place_m` (scatterers, pulses, 3), of amplitudes that fit (scatterers, pulses)."""
    parts = phasor(np.sqrt(np.sum(place_m**2, axis=-1)), radar)
    return np.sum(parts * np.asarray(amplitude, np.float32), axis=0)


def unit(vector: np.ndarray) -> np.ndarray:
    """The direction of vectors along the last axis."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two directions that stand on an axis and on each other."""
    first = unit(np.cross(axis, [0.31, 0.95, 0.05]))
    return first, np.cross(axis, first)


def level(echoes: np.ndarray, power_db: float) -> np.ndarray:
    """Bring a series to a mean power [dB]; silence stays silent."""
    power = np.mean(np.abs(echoes) ** 2)
    return echoes if power == 0 else echoes * np.sqrt(10 ** (power_db / 10) / power)


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
    """Blades that turn about `axis` at `hub_m` (pulses, 3), exact ranges.

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
        gain = 1 - weaker * (0.5 + 0.5 * np.sin(angle))  # which side of the disc that is hangs on `start`'s zero
        for part in np.array_split(along, max(1, len(along) // 64)):
            ranges = np.sqrt(hub_squared + part[:, None] ** 2 + 2 * part[:, None] * towards)
            out += gain.astype(np.float32) * phasor(ranges, radar).sum(axis=0)
    return out


def flight(
    rng: np.random.Generator, radar: Radar, speed_mps: tuple[float, float], range_m: tuple[float, float] = (100, 1500)
) -> tuple[np.ndarray, np.ndarray]:
    """A straight track (pulses, 3) at an elevation of 2 to 25 degrees, and its heading."""
    elevation, heading = np.deg2rad(rng.uniform(2, 25)), rng.uniform(0, 2 * np.pi)
    start = rng.uniform(*range_m) * np.array([np.cos(elevation), 0, np.sin(elevation)])
    ahead = unit(np.array([np.cos(heading), np.sin(heading), rng.normal(0, 0.05)]))
    return start + radar.time_s[:, None] * ahead * rng.uniform(*speed_mps), ahead


def tilted(rng: np.random.Generator, most_deg: float) -> np.ndarray:
    """A rotor's axis: vertical but for a tilt."""
    tilt, towards = np.deg2rad(rng.uniform(0, most_deg)), rng.uniform(0, 2 * np.pi)
    return np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), np.cos(tilt)])


# ---------------------------------------------------------------------------------------------------------------- UAVs


def multicopter(
    rng: np.random.Generator,
    radar: Radar,
    rotors: int = 4,
    *,
    law: str | None = None,
    blades_db: float | None = None,
    radius_m: tuple[float, float] = (0.10, 0.20),
    rate_hz: tuple[float, float] = (65, 120),
    spread: tuple[float, float] = (0.01, 0.08),
    speed_mps: tuple[float, float] | None = None,
    tilt_deg: float = 20,
) -> Scene:
    """Rotors on a ring, each at its own rate; `blades_db` is all blades' power over the body's (default -20 to -5)."""
    law = law or str(rng.choice(BLADE_LAWS))
    hover = rng.uniform() < 0.3
    track, _ = flight(rng, radar, speed_mps or ((0, 0.5) if hover else (2, 18)))
    axis = tilted(rng, 5 if hover else tilt_deg)
    radius, rate = rng.uniform(*radius_m), rng.uniform(*rate_hz)
    first, second = across(axis)
    micro = np.zeros(radar.pulses, np.complex64)
    arm = 1.3 * radius / np.sin(np.pi / rotors)
    turn, rates = rng.uniform(0, 2 * np.pi), rate * (1 + rng.uniform(*spread) * rng.uniform(-1, 1, rotors))
    for index in range(rotors):
        around = turn + 2 * np.pi * index / rotors
        hub = track + arm * (np.cos(around) * first + np.sin(around) * second)
        micro += rotor(rng, radar, hub, axis, blades=2, radius_m=radius, rate_hz=rates[index], law=law)
    places = track + rng.normal(0, 0.5 * arm, (5, 1, 3)) * [1, 1, 0.3]
    body = echo(places, radar, rng.rayleigh(1, (5, 1)))
    return Scene(level(body, 0), level(micro, rng.uniform(-20, -5) if blades_db is None else blades_db))


def quadcopter(rng: np.random.Generator, radar: Radar) -> Scene:
    return multicopter(rng, radar)


def quadcopter_over_ground(rng: np.random.Generator, radar: Radar) -> Scene:
    """The same with ground in its cell, 0 to 25 dB over its body."""
    scene = multicopter(rng, radar)
    return Scene(scene.body + level(ground(rng, radar).micro, rng.uniform(0, 25)), scene.micro)


def hexacopter(rng: np.random.Generator, radar: Radar) -> Scene:
    return multicopter(rng, radar, 6, radius_m=(0.15, 0.30), rate_hz=(40, 75))


def helicopter(rng: np.random.Generator, radar: Radar, law: str | None = None, blades_db: float | None = None) -> Scene:
    """A model helicopter: main rotor of 0.35 to 0.8 m and a tail rotor 4 to 5.5 times as fast."""
    law = law or str(rng.choice(BLADE_LAWS))
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
    return Scene(level(body, 0), level(micro, rng.uniform(-18, -3) if blades_db is None else blades_db))


def fixed_wing(
    rng: np.random.Generator,
    radar: Radar,
    law: str | None = None,
    blades_db: float | None = None,
    off_nose_deg: tuple[float, float] = (20, 160),
) -> Scene:
    """One two-bladed propeller whose axis is the line of flight, seen at 20 to 160 degrees off the nose."""
    law = law or str(rng.choice(BLADE_LAWS))
    track, _ = flight(rng, radar, (0, 0))
    off = np.deg2rad(rng.uniform(*off_nose_deg)) * rng.choice([-1, 1])
    ahead = unit(np.array([-np.cos(off), np.sin(off), rng.normal(0, 0.05)]))
    track = track + radar.time_s[:, None] * ahead * rng.uniform(12, 28)
    nose = track + 0.4 * ahead
    radius, rate = rng.uniform(0.10, 0.20), rng.uniform(70, 150)
    propeller = rotor(rng, radar, nose, ahead, blades=2, radius_m=radius, rate_hz=rate, law=law)
    wing = rng.uniform(-0.8, 0.8, (5, 1, 1)) * unit(np.cross(ahead, [0, 0, 1]))
    places = np.concatenate([track + wing, track - rng.uniform(0, 0.8, (3, 1, 1)) * ahead])
    body = echo(places, radar, rng.rayleigh(1, (8, 1)))
    return Scene(level(body, 0), level(propeller, rng.uniform(-25, -8) if blades_db is None else blades_db))


# --------------------------------------------------------------------------------------------------------------- birds

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
    """Amplitude of a spheroid's echo seen along `sight` (Chen, RCS of an ellipsoid)."""
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
    stroke: float = 1.0,
    parts: int = 4,
) -> Scene:
    """An ellipsoid with two wings of two segments (JEES 2021: inner 40 cos + 15 deg, outer 30 cos + 40 deg, swept).

    The body heaves against the wings. Every segment is a row of spheroids.
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
    inner = np.deg2rad(40 * stroke * np.cos(phase) + 15) if flapping else np.deg2rad(5 + 0 * phase)
    bend = np.deg2rad(30 * stroke * np.cos(phase + 0.6) - 10) if flapping else 0 * phase
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
            amplitude = spheroid(length / parts, 0.02 * span, axis, sight)
            middles = (np.arange(parts) + 0.5) / parts * length
            micro += echo(joint + middles[:, None, None] * axis, radar, amplitude)
            joint = joint + length * axis
    return Scene(body, micro) if flapping else Scene(body + micro, np.zeros_like(micro))


def flapping_bird(rng: np.random.Generator, radar: Radar) -> Scene:
    return bird(rng, radar)


def gliding_bird(rng: np.random.Generator, radar: Radar) -> Scene:
    return bird(rng, radar, flapping=False)


def flock(rng: np.random.Generator, radar: Radar) -> Scene:
    """3 to 20 birds of a kind, a few metres apart, at much the same velocity."""
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


# ------------------------------------------------------------------------------------------------------------- clutter


def white(rng: np.random.Generator, count: int) -> np.ndarray:
    """Complex Gaussian noise of unit power."""
    return rng.normal(0, np.sqrt(0.5), (count, 2)).astype(np.float32).view(np.complex64)[:, 0]


def process(rng: np.random.Generator, radar: Radar, density: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """A Gaussian process of this density over radial velocity [m/s], folded into the span, unit power."""
    count = 4 * radar.pulses  # cut from a longer one, whose ends meet
    span = radar.wavelength_m * radar.prf_hz / 2
    velocity = -np.fft.fftfreq(count) * span
    power = sum(density(velocity + fold * span) for fold in range(-3, 4))
    series = np.fft.ifft(np.sqrt(power) * white(rng, count))[: radar.pulses]
    return level(series, 0).astype(np.complex64)


def ground(rng: np.random.Generator, radar: Radar, wind_mph: float | None = None) -> Scene:
    """Billingsley: a steady part and an exponential one (his a and b), wind 2 to 30 mph."""
    wind = rng.uniform(2, 30) if wind_mph is None else wind_mph
    ratio = 489.8 * wind**-1.55 * (radar.carrier_hz / 1e9) ** -1.21
    slope = 1 / (0.1048 * (np.log10(wind) + 0.4147))
    moving = process(rng, radar, lambda v: np.exp(-slope * np.abs(v)))
    steady = np.exp(2j * np.pi * rng.uniform()) * np.sqrt(ratio)
    return Scene(np.zeros(radar.pulses, np.complex64), level(moving + steady, 0).astype(np.complex64))


def rain(rng: np.random.Generator, radar: Radar) -> Scene:
    """A Gaussian of 0.5 to 3 m/s about the wind's radial velocity."""
    mean, width = rng.uniform(-12, 12), rng.uniform(0.5, 3)
    echoes = process(rng, radar, lambda v: np.exp(-((v - mean) ** 2) / (2 * width**2)))
    return Scene(np.zeros_like(echoes), echoes)


def sea(rng: np.random.Generator, radar: Radar) -> Scene:
    """Bragg lines, wind-driven and breaking waves, each of a K-distributed texture that hardly moves in a dwell."""
    bragg = np.sqrt(9.81 * radar.wavelength_m / (4 * np.pi)) + 0.1
    wind = rng.uniform(3, 15) * np.cos(rng.uniform(0, np.pi))
    shape = rng.uniform(0.3, 8)
    out = np.zeros(radar.pulses, np.complex64)
    for mean, width, power_db in (
        (bragg + 0.02 * wind, 0.25, 0.0),
        (-bragg + 0.02 * wind, 0.25, rng.uniform(-15, 0)),
        (0.13 * wind, rng.uniform(0.4, 1.0), rng.uniform(-10, 10)),
        (0.25 * wind, rng.uniform(0.6, 1.5), rng.uniform(-20, 3)),
    ):
        texture = rng.gamma(shape, 1 / shape)
        out += np.sqrt(texture) * level(
            process(rng, radar, lambda v, m=mean, w=width: np.exp(-((v - m) ** 2) / (2 * w**2))), power_db
        )
    return Scene(np.zeros_like(out), out)


def person(rng: np.random.Generator, radar: Radar) -> Scene:
    """A walker: trunk and head, and limbs of two segments that swing (after Chen and Boulic, much simplified)."""
    speed, height = rng.uniform(0.8, 2.0), rng.uniform(1.6, 1.9)
    heading, start = rng.uniform(0, 2 * np.pi), rng.uniform(20, 400)
    ahead = np.array([np.cos(heading), np.sin(heading), 0])
    side, up = np.array([-ahead[1], ahead[0], 0]), np.array([0.0, 0.0, 1.0])
    phase = 2 * np.pi * 0.75 * np.sqrt(speed) * radar.time_s + rng.uniform(0, 2 * np.pi)
    hip = np.array([start, 0, 0.5 * height]) + (speed * radar.time_s + 0.02 * np.sin(2 * phase))[:, None] * ahead
    hip = hip + (0.02 * np.cos(2 * phase))[:, None] * up
    trunk = np.stack([hip + share * height * up for share in (0.05, 0.15, 0.25, 0.42)])
    body = echo(trunk, radar, np.array([1.0, 1.2, 1.0, 0.4])[:, None])
    swing = np.deg2rad(18 * (0.6 + 0.4 * speed))
    micro = np.zeros(radar.pulses, np.complex64)
    for hand in (-1, 1):
        for root, upper, lower, gain, sign, bend in (
            (0.0, 0.245 * height, 0.246 * height, 0.35, hand, -0.5),
            (0.3 * height, 0.17 * height, 0.16 * height, 0.2, -hand, 0.4),
        ):
            angle = swing * sign * np.sin(phase)
            joint = hip + root * up + hand * 0.1 * height * side
            knee = angle + bend * (1 + np.sin(phase * 1.0 + sign * 1.2)) * 0.6
            for length, lean in ((upper, angle), (lower, knee)):
                axis = np.sin(lean)[:, None] * ahead - np.cos(lean)[:, None] * up
                middles = (np.arange(4) + 0.5) / 4 * length
                micro += gain / 4 * echo(joint + middles[:, None, None] * axis, radar)
                joint = joint + length * axis
    return Scene(body, micro)


def vehicle(rng: np.random.Generator, radar: Radar) -> Scene:
    """A car: a rigid cloud of scatterers, and four wheels whose rims turn (0 to twice its speed)."""
    speed, gain = rng.uniform(3, 35), rng.uniform(-1.5, 1.5)
    heading, start = rng.uniform(0, 2 * np.pi), rng.uniform(30, 800)
    ahead = np.array([np.cos(heading), np.sin(heading), 0])
    side, up = np.array([-ahead[1], ahead[0], 0]), np.array([0.0, 0.0, 1.0])
    gone = speed * radar.time_s + gain / 2 * radar.time_s**2
    middle = np.array([start, 0, -2.0]) + gone[:, None] * ahead
    offset = rng.uniform(-1, 1, (10, 3)) @ np.array([2.2 * ahead, 0.9 * side, 0.6 * up])
    body = echo(middle + offset[:, None], radar, rng.rayleigh(1, (10, 1)))
    radius = 0.32
    micro = np.zeros(radar.pulses, np.complex64)
    for front in (-1.3, 1.3):
        for hand in (-0.8, 0.8):
            angle = gone / radius + rng.uniform(0, 2 * np.pi) + np.arange(10)[:, None] * 2 * np.pi / 10
            rim = radius * (np.cos(angle)[..., None] * ahead - np.sin(angle)[..., None] * up)
            micro += echo(middle + front * ahead + hand * side - 0.3 * up + rim, radar, rng.rayleigh(1, (10, 1)))
    return Scene(level(body, 0), level(micro, rng.uniform(-30, -12)))


def wind_turbine(
    rng: np.random.Generator, radar: Radar, points: int = 150, tower_db: float | None = None, law: str | None = None
) -> Scene:
    """A tower and three blades of 25 to 60 m; a "cloud" of points over the chord, or a row of "points"."""
    law = law or str(rng.choice(["cloud", "points"]))
    length, tip_mps = rng.uniform(25, 60), rng.uniform(40, 85)
    start = np.array([rng.uniform(800, 6000), 0, rng.uniform(20, 90)])
    yaw = rng.uniform(0, 2 * np.pi)
    axis = np.array([np.cos(yaw), np.sin(yaw), 0.05])
    first, second = across(unit(axis))
    turn = tip_mps / length * radar.time_s + rng.uniform(0, 2 * np.pi)
    micro = np.zeros(radar.pulses, np.complex64)
    for blade in range(3):
        angle = turn + 2 * np.pi * blade / 3
        direction = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        chordwise = -np.sin(angle)[:, None] * first + np.cos(angle)[:, None] * second
        along = np.sort(rng.uniform(2, length, points)) if law == "cloud" else np.linspace(2, length, points)
        chord = rng.uniform(-1, 1, points) * (law == "cloud")
        for part in np.array_split(np.arange(points), 8):
            place = along[part, None, None] * direction + chord[part, None, None] * chordwise
            micro += echo(start + place, radar)
    tower = np.full(radar.pulses, np.exp(2j * np.pi * rng.uniform()), np.complex64)
    return Scene(level(tower, rng.uniform(0, 25) if tower_db is None else tower_db), level(micro, 0))


def noise(rng: np.random.Generator, radar: Radar) -> Scene:
    """Nothing but the receiver."""
    silence = np.zeros(radar.pulses, np.complex64)
    return Scene(silence, silence)


KINDS: dict[str, tuple[str, Callable[[np.random.Generator, Radar], Scene]]] = {
    "quadcopter": ("uav", quadcopter),
    "quad_over_ground": ("uav", quadcopter_over_ground),
    "hexacopter": ("uav", hexacopter),
    "helicopter": ("uav", helicopter),
    "fixed_wing": ("uav", fixed_wing),
    "flapping_bird": ("bird", flapping_bird),
    "gliding_bird": ("bird", gliding_bird),
    "flock": ("bird", flock),
    "ground": ("clutter", ground),
    "rain": ("clutter", rain),
    "sea": ("clutter", sea),
    "person": ("clutter", person),
    "vehicle": ("clutter", vehicle),
    "wind_turbine": ("clutter", wind_turbine),
    "noise": ("clutter", noise),
}
"""What a kind should be called, and what makes one of it."""


# ------------------------------------------------------------------------------------------------------------ receiver


def noise_power(scene: Scene, snr_db: float, of: str) -> float:
    """Noise power a sample: `snr_db` under the whole target ("total"), or under its micro-motion ("micro") if any."""
    whole = np.mean(np.abs(scene.body + scene.micro) ** 2)
    moving = np.mean(np.abs(scene.micro) ** 2)
    power = moving if of == "micro" and moving > 0 else whole
    return float(power / 10 ** (snr_db / 10)) or 1.0


def received(scene: Scene, power: float, rng: np.random.Generator) -> np.ndarray:
    """The scene in white noise of this power a sample."""
    samples = scene.body + scene.micro + np.sqrt(power) * white(rng, len(scene.body))
    return samples.astype(np.complex64)


def visible(scene: Scene, power: float) -> bool:
    """Whether a spectrum shows the micro-motion: four bins of it at 10 dB over the noise and not under the body's."""
    window = np.blackman(len(scene.body))
    window /= np.sqrt(np.sum(window**2))
    body, micro = (np.abs(np.fft.fft(window * part)) ** 2 for part in (scene.body, scene.micro))
    return bool(np.count_nonzero((micro >= 10 * power) & (micro >= body)) >= 4)
