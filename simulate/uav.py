"""Small UAVs: fixed wing, multirotors, and the helicopter with its geared tail rotor."""

from dataclasses import fields, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .airframe import Rotor, body_echo, rotors_echo
from .laws import LAWS, Draws
from .motion import TWO_PI
from .radar import Radar
from .rotor import RotorMotion
from .target import Target

#: Lifting rotors of each kind.
ROTORS = {"fixed_wing": 1, "quadcopter": 4, "hexacopter": 6, "octocopter": 8, "helicopter": 1}

#: Blades a rotor may have.
BLADES = (2, 3, 4)

#: Slowest rotor [Hz], however long its blades (24-100 Hz in P, and a margin): what turns slower has wheels or wings.
LEAST_ROTATION_HZ = 20.0

#: Share of the moving UAVs whose speed is drawn by the law `fast_uav_mps`.
FAST_CHANCE = 0.2

#: Least ratio of tip speed to the aircraft's speed: rotors advance by at most 0.4 of their tips' speed (helicopters),
#: propellers by a third. A part whose rim is no faster than the body is a wheel.
TIP_OVER_BODY = 2.5

#: Speed from which discs have their full tilt [m/s], where drag balances the thrust; below, the tilt rises with speed.
TILTED_MPS = 20.0

#: Largest acceleration with which rotors shake an airframe [m/s^2]: five times gravity, beyond which no autopilot
#: flies. The phase of the shaking goes with its displacement over the wavelength, so it is large for short waves only.
SHAKEN_MPS2 = 50.0

#: Points that stand for a blade, and the share of the UAVs with that number. None: a uniform line (Martin and Mulgrew
#: 1990); 1: the tip alone (P). A model trained on one of them alone takes the spectrum of another for clutter.
POINTS = {None: 0.55, 1: 0.15, 2: 0.07, 3: 0.07, 5: 0.06, 8: 0.05, 12: 0.05}

#: ROUGH_CHANCE: share of the UAVs with tips alone whose blades are rough instead; ROUGH_POINTS: points of such a blade,
#: each of random strength. Where a blade's unevenness is as large as the wavelength, no two blades are alike, and lines
#: show at every multiple of the rotation rate.
ROUGH_CHANCE, ROUGH_POINTS = 0.5, 4


def draw_uav(draws: Draws, radar: Radar, kind: str) -> Target:
    """Draw and render a batch of UAVs of one kind.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.
    kind : {"fixed_wing", "quadcopter", "hexacopter", "octocopter", "helicopter"}
        Airframe.

    Returns
    -------
    Target
        `micro` holds the blades of all rotors about the body, moved with the body.
    """
    rotors = ROTORS[kind]
    beta = draws.value("uav_beta_rad")
    flown, velocity = _flight(draws, kind, beta)
    acceleration = draws.acceleration_mps2("uav_acceleration_mps2")
    length = draws.value("main_length_m" if kind == "helicopter" else "blade_length_m")
    least_mps = np.maximum(TWO_PI * length * LEAST_ROTATION_HZ, TIP_OVER_BODY * np.abs(flown))
    rotation = draws.value("tip_mps", least=least_mps) / (TWO_PI * length)
    blades = np.where(draws.chance(0.65), 2, np.where(draws.chance(0.75), 3, 4))
    amplitudes = _blade_amplitudes(draws)
    root = length * draws.value("root_fraction")
    asymmetry = draws.value("edge_asymmetry")
    points = np.searchsorted(np.cumsum(list(POINTS.values()))[:-1], draws.uniform(), side="right")
    rough = draws.chance(ROUGH_CHANCE) & (points == list(POINTS).index(1))

    manoeuvre = draws.chance(0.3)
    spread = np.where(manoeuvre, draws.value("manoeuvre_spread"), draws.value("hover_spread"))
    offsets = draws.uniform(rotors) - 0.5 if rotors > 1 else np.zeros((len(draws), 1))
    rates = rotation[:, None] * (1 + spread[:, None] * offsets)
    level = np.exp(0.4 * draws.normal(rotors))
    lifting = []
    for r in range(rotors):
        motion = _motion(draws, rates[:, r], radar)
        hub = level[:, r] * np.exp(1j * draws.value("phase_rad"))
        lifting.append(Rotor(motion, length, beta, root, amplitudes, asymmetry, hub))
    truth = {
        "rotation_hz": rates.mean(axis=1),
        "rotation_spread": np.ptp(rates, axis=1) / rates.mean(axis=1),
        "blades": blades.astype(float),
        "rotors": np.full(len(draws), float(rotors)),
        "blade_length_m": length,
        "beta_rad": beta,
        "velocity_mps": velocity,
        "acceleration_mps2": acceleration,
        "tip_mps": TWO_PI * rates.max(axis=1) * length,
        # a lone reflecting blade, and rough blades that are all unlike, repeat once a turn; others flash `blades` times
        "chopping_hz": rates.mean(axis=1) * np.where((amplitudes[:, 1:] > 0).any(axis=1) & ~rough, blades, 1),
    }
    tail = []
    if kind == "helicopter":
        rotor, truth["tail_rotation_hz"] = _tail_rotor(draws, length, lifting[0].motion)
        tail.append(rotor)
    shaken_m, phase, rest = (draws.value(law) for law in ("vibration_m", "phase_rad", "phase_rad"))
    shaken_m = np.minimum(shaken_m, SHAKEN_MPS2 / (TWO_PI * rates[:, 0]) ** 2)
    path: dict[str, Any] = {
        "velocity_mps": velocity,
        "acceleration_mps2": acceleration,
        "vibration_rad": 2 * TWO_PI / radar.wavelength_m * shaken_m,
        "vibration_hz": rates[:, 0],
        "vibration_phase_rad": phase,
    }
    micro = np.empty((len(draws), radar.pulses), np.complex64)
    parts = [part for rotor in lifting for part in _rough(draws, rotor)]
    looks = [(each, lifting, (points == number) & ~rough) for number, each in enumerate(POINTS)] + [(1, parts, rough)]
    for count, (each, main, own) in product(BLADES, looks):
        rows = np.flatnonzero((blades == count) & own)
        if len(rows):
            some = [_of(rotor, rows, each, count) for rotor in main] + [_of(rotor, rows, each) for rotor in tail]
            micro[rows] = rotors_echo(radar, some, len(rows), **{name: value[rows] for name, value in path.items()})
    body = body_echo(radar, len(draws), **path, phase_rad=rest)
    return Target(micro, body, draws.value("uav_body_db"), truth=truth)


def _flight(draws: Draws, kind: str, beta_rad: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Draw the speed of flight, and its component along the line of sight, which depends on the aspect [m/s].

    A propeller pulls along its axis, a lifting rotor nearly at right angles to it. Seen along the axis, a propeller
    aircraft has all of its speed along the line of sight, and one with lifting rotors hardly any. So the tips of a
    lifting rotor seldom look slower than the body.
    """
    still = draws.chance(0.3)
    flown = draws.sign() * draws.either("uav_mps", "fast_uav_mps", FAST_CHANCE)
    tilt = draws.sign() * draws.value("tilt_rad") * np.minimum(np.abs(flown) / TILTED_MPS, 1.0)
    climb = draws.value("climb_mps")
    if kind == "fixed_wing":
        seen = flown * np.sin(beta_rad) + climb
    else:
        height = np.clip(beta_rad + tilt, 0.0, np.pi / 2)
        seen = flown * np.cos(height) + climb * np.sin(height)
    return np.where(still, 0.0, flown), np.where(still, 0.0, seen)


def _motion(draws: Draws, rate_hz: NDArray[np.float64], radar: Radar) -> RotorMotion:
    """Draw one rotor's sense, phase, drift and wander."""
    return RotorMotion(
        rotation_hz=rate_hz * draws.sign(),
        phase_rad=draws.value("phase_rad"),
        drift_hz_per_s=rate_hz * draws.change("drift_per_s", radar.dwell_s) * draws.sign(),
        wander_hz=rate_hz * draws.value("wander"),
        wander_rate_hz=draws.value("wander_rate_hz"),
        wander_phase_rad=draws.value("phase_rad"),
    )


def _blade_amplitudes(draws: Draws) -> NDArray[np.float64]:
    """Draw amplitudes, shape (records, max(BLADES)): equal, unequal, or (seldom) one reflecting blade alone."""
    inequality = np.where(draws.chance(0.5), 0.0, draws.value("blade_inequality"))
    amplitudes = np.exp(inequality[:, None] * draws.normal(max(BLADES)))
    amplitudes[draws.chance(0.06), 1:] = 0.0
    return amplitudes


def _rough(draws: Draws, rotor: Rotor) -> list[Rotor]:
    """Draw rough blades as `ROUGH_POINTS` rotors of one point a blade: random radius, each blade of random strength."""
    length, root, amplitudes = (np.asarray(v) for v in (rotor.blade_length_m, rotor.root_m, rotor.blade_amplitudes))
    out = []
    for _ in range(ROUGH_POINTS):
        place, turn = root + (length - root) * draws.uniform(), np.exp(1j * draws.value("phase_rad"))
        uneven = amplitudes * draws.normal(amplitudes.shape[-1])
        out.append(replace(rotor, blade_length_m=place, blade_amplitudes=uneven, hub=rotor.hub * turn))
    return out


def _tail_rotor(
    draws: Draws, main_length_m: NDArray[np.float64], main: RotorMotion
) -> tuple[Rotor, NDArray[np.float64]]:
    """Draw a two-blade tail rotor, geared to the main one, and its rate [Hz]; its disc is upright, so beta is its own.

    Tip speed is at most 200 m/s, as on real airframes. Drift and wander of its rate are those of the main rotor times
    the gear ratio, whichever way it turns.
    """
    length = main_length_m * draws.value("tail_ratio")
    main_hz = np.abs(main.rotation_hz)
    rate = np.minimum(main_hz * draws.value("gear_ratio"), 200.0 / (TWO_PI * length))
    ratio = draws.sign() * rate / main_hz
    motion = replace(
        main,
        rotation_hz=np.multiply(main.rotation_hz, ratio),
        phase_rad=draws.value("phase_rad"),
        drift_hz_per_s=np.multiply(main.drift_hz_per_s, ratio),
        wander_hz=np.multiply(main.wander_hz, ratio),
    )
    beta = LAWS["uav_beta_rad"](draws.uniform())
    hub = 0.4 * np.exp(0.5 * draws.normal() + 1j * draws.value("phase_rad"))
    amplitudes = np.ones((len(draws), 2))
    return Rotor(motion, length, beta, 0.2 * length, amplitudes, np.zeros(len(draws)), hub), rate


def _of(rotor: Rotor, rows: NDArray[np.intp], points: int | None, blades: int | None = None) -> Rotor:
    """Take a rotor of some records: its first `blades` blades (None: all), each of `points` points (None: a line)."""
    taken = {f.name: getattr(rotor, f.name)[rows] for f in fields(rotor) if f.name not in ("motion", "points")}
    taken["blade_amplitudes"] = taken["blade_amplitudes"][:, :blades]
    motion = {f.name: getattr(rotor.motion, f.name)[rows] for f in fields(rotor.motion)}
    return Rotor(RotorMotion(**motion), **taken, points=points)
