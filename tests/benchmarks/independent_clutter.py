"""Ground, rain, sea, walkers, vehicles and wind turbines of the independent simulator, see `independent_scenes`."""

from collections.abc import Callable

import numpy as np

from .independent_echo import Radar, Scene, across, echo, level, unit, white


def process(rng: np.random.Generator, radar: Radar, density: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Draw a Gaussian process with a power density over radial velocity [m/s], folded into the span; unit power."""
    count = 4 * radar.pulses  # the whole series is periodic, so only a quarter of it is kept
    span = radar.wavelength_m * radar.prf_hz / 2
    velocity = -np.fft.fftfreq(count) * span
    power = sum(density(velocity + fold * span) for fold in range(-3, 4))
    series = np.fft.ifft(np.sqrt(power) * white(rng, count))[: radar.pulses]
    return level(series, 0).astype(np.complex64)


def ground(rng: np.random.Generator, radar: Radar, wind_mph: float | None = None) -> Scene:
    """Make ground after Billingsley: a steady and an exponential part (his ratio and shape); wind 2 to 30 mph."""
    wind = rng.uniform(2, 30) if wind_mph is None else wind_mph
    ratio = 489.8 * wind**-1.55 * (radar.carrier_hz / 1e9) ** -1.21
    slope = 1 / (0.1048 * (np.log10(wind) + 0.4147))
    moving = process(rng, radar, lambda v: np.exp(-slope * np.abs(v)))
    steady = np.exp(2j * np.pi * rng.uniform()) * np.sqrt(ratio)
    return Scene(np.zeros(radar.pulses, np.complex64), level(moving + steady, 0).astype(np.complex64))


def rain(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make rain: a Gaussian spectrum with a deviation of 0.5 to 3 m/s about the wind's radial velocity."""
    mean, width = rng.uniform(-12, 12), rng.uniform(0.5, 3)
    echoes = process(rng, radar, lambda v: np.exp(-((v - mean) ** 2) / (2 * width**2)))
    return Scene(np.zeros_like(echoes), echoes)


def sea(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make Bragg lines, wind-driven and breaking waves, K-distributed: each has a gamma texture, fixed in a dwell."""
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
    """Make a walker: trunk and head, and swinging limbs of two segments (after Chen and Boulic, much simplified)."""
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
    """Make a car: a rigid cloud of scatterers, and four wheels whose rims move at 0 to twice its speed."""
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


def wind_turbine(rng: np.random.Generator, radar: Radar, points: int = 150, law: str | None = None) -> Scene:
    """Make a tower and three blades of 25 to 60 m: each a "cloud" of points over the chord, or a row of "points"."""
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
    return Scene(level(tower, rng.uniform(0, 25)), level(micro, 0))


def noise(rng: np.random.Generator, radar: Radar) -> Scene:
    """Make an empty cell: nothing but the receiver's noise."""
    silence = np.zeros(radar.pulses, np.complex64)
    return Scene(silence, silence)
