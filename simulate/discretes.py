"""Things that move and are neither UAV nor bird: a walking person, a vehicle, a wind turbine, a plain reflector.

Each is a handful of scatterers on known paths; they are the hard confusers, because parts of them move fast or turn.
"""

import numpy as np

from .airframe import body_echo
from .laws import Draws
from .motion import TWO_PI, range_phasor, straight_path
from .radar import Radar
from .target import Target

#: Limbs of a walker: (amplitude, swing of its speed over the torso's, phase of the gait in turns). Feet reach 3x.
LIMBS = (
    (1.0, 0.15, 0.0),
    (0.25, 0.8, 0.0),
    (0.25, 0.8, 0.5),
    (0.2, 1.3, 0.5),
    (0.2, 1.3, 0.0),
    (0.15, 2.0, 0.5),
    (0.15, 2.0, 0.0),
)


#: Scatterers of a vehicle's body and of its wheels.
BODY_POINTS, WHEEL_POINTS = 9, 8


def draw_person(draws: Draws, radar: Radar) -> Target:
    """Draw a walker: a torso that sways and limbs whose speed swings about the torso's at the gait."""
    speed, gait, phase = draws.value("person_mps"), draws.value("gait_hz"), draws.value("phase_rad")
    micro = np.zeros((len(draws), radar.pulses), np.complex64)
    body = np.zeros_like(micro)
    for number, (amplitude, swing, turns) in enumerate(LIMBS):
        stretch = swing * (0.6 + 0.6 * draws.uniform())
        omega = TWO_PI * gait * (2 if number == 0 else 1)  # the torso bobs twice a stride
        offset = phase + TWO_PI * turns
        swing_rad = -2 * TWO_PI / radar.wavelength_m * speed * stretch / omega
        level = amplitude * np.exp(0.3 * draws.normal())
        body_echo(
            radar,
            len(draws),
            velocity_mps=speed,
            phase_rad=draws.value("phase_rad") - swing_rad * np.sin(offset),
            vibration_rad=swing_rad,
            vibration_hz=omega / TWO_PI,
            vibration_phase_rad=offset,
            amplitude=level,
            out=body if number == 0 else micro,
        )
    truth = {"velocity_mps": speed, "gait_hz": gait}
    return Target(micro, body, 3 + 12 * draws.uniform(), truth=truth)


def draw_vehicle(draws: Draws, radar: Radar) -> Target:
    """Draw a road vehicle: several body scatterers of slightly unlike radial speed, and wheels from 0 to 2 v."""
    speed = draws.value("vehicle_mps") * draws.sign()
    # half of them drive steadily
    acceleration = draws.change("vehicle_acceleration_mps2", radar.dwell_s) * np.where(draws.chance(0.5), 0.05, 1.0)
    spread = draws.value("aspect_spread")  # close to the road each part has its own aspect
    body = np.zeros((len(draws), radar.pulses), np.complex64)
    for _ in range(BODY_POINTS):
        own = speed * (1 - spread * draws.uniform())
        level, phase = np.exp(0.6 * draws.normal()), draws.value("phase_rad")
        path = {"velocity_mps": own, "acceleration_mps2": acceleration}
        body_echo(radar, len(draws), **path, phase_rad=phase, amplitude=level, out=body)
    radius = draws.value("wheel_radius_m")
    turn = speed / (TWO_PI * radius)
    wheels = np.zeros_like(body)
    for _ in range(WHEEL_POINTS):
        # a scatterer on the rim rolls: its speed along the road runs from 0 at the ground to 2 v at the top
        rim = radius * (0.5 + 0.5 * draws.uniform())
        phase = draws.value("phase_rad")
        rim_rad = -2 * TWO_PI / radar.wavelength_m * rim
        level = np.exp(0.4 * draws.normal())
        body_echo(
            radar,
            len(draws),
            velocity_mps=speed,
            acceleration_mps2=acceleration,
            phase_rad=draws.value("phase_rad") - rim_rad * np.sin(phase),
            vibration_rad=rim_rad,
            vibration_hz=turn,
            vibration_phase_rad=phase,
            amplitude=level,
            out=wheels,
        )
    truth = {"velocity_mps": speed, "acceleration_mps2": acceleration, "rotation_hz": np.abs(turn)}
    return Target(wheels, body, -draws.value("wheel_db"), truth=truth)


def draw_wind_turbine(draws: Draws, radar: Radar) -> Target:
    """Draw a wind turbine: three long blades of which the range cell holds a part, and its tower at rest.

    The blade is rough on the scale of the wavelength, so it is a row of scatterers of random strength, not a mirror.
    """
    t = radar.times_s
    length, tip = draws.value("turbine_length_m"), draws.value("turbine_tip_mps")
    turn = tip / (TWO_PI * length) * draws.sign()
    cell = np.minimum(draws.value("cell_m"), length)
    start = (length - cell) * draws.uniform()
    cos_beta = np.cos(np.deg2rad(85) * draws.uniform())
    first = draws.value("phase_rad")
    micro = np.zeros((len(draws), radar.pulses), np.complex64)
    for blade in range(3):
        angle = TWO_PI * (turn[:, None] * t + blade / 3) + first[:, None]
        towards = np.cos(angle) - np.cos(angle[:, :1])
        for _ in range(8):
            r = (start + cell * draws.uniform()) * cos_beta
            level = (draws.uniform() ** 2 * np.exp(1j * draws.value("phase_rad"))).astype(np.complex64)
            micro += level[:, None] * range_phasor(-r[:, None] * towards, radar.wavelength_m)
    body = np.exp(1j * draws.value("phase_rad")).astype(np.complex64)[:, None] * np.ones(
        (1, radar.pulses), np.complex64
    )
    truth = {
        "rotation_hz": np.abs(turn),
        "blade_length_m": length,
        "tip_mps": tip * cos_beta,
        "blades": np.full(len(draws), 3.0),
        "velocity_mps": np.zeros(len(draws)),
    }
    return Target(micro, body, 45 * draws.uniform() - 5, truth=truth)


def draw_mover(draws: Draws, radar: Radar) -> Target:
    """Draw a featureless moving reflector: a far vehicle, a boat, a balloon. A line alone is no drone."""
    speed = draws.value("mover_mps")
    acceleration = draws.value("bird_acceleration_mps2") * np.where(draws.chance(0.7), 0.05, 1.0)
    path = straight_path(radar.times_s, speed, acceleration)
    turn = np.exp(1j * draws.value("phase_rad")).astype(np.complex64)[:, None]
    truth = {"velocity_mps": speed, "acceleration_mps2": acceleration}
    return Target(turn * range_phasor(path, radar.wavelength_m), snr_law="clutter_snr_db", truth=truth)


#: Renderers by kind.
DISCRETES = {
    "mover": draw_mover,
    "person": draw_person,
    "vehicle": draw_vehicle,
    "wind_turbine": draw_wind_turbine,
}


def draw_discrete(draws: Draws, radar: Radar, kind: str) -> Target:
    """Draw and render a batch of one kind of moving thing.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.
    kind : {"person", "vehicle", "wind_turbine", "mover"}
        What it is.

    Returns
    -------
    Target
    """
    return DISCRETES[kind](draws, radar)
