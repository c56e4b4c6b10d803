"""Things that move and are neither UAV nor bird: a person, a vehicle, a wind turbine, a plain reflector.

Each is a handful of scatterers on known paths. They are the hard confusers, because parts of them move fast or turn.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import diric

from .airframe import body_echo
from .grid import PulseGrid, Sine
from .insects import draw_insects
from .laws import Draws
from .motion import TWO_PI, range_phasor, reduce_phase, straight_path, turned
from .radar import Radar
from .target import Target, mean_power

#: Limbs of a walker: (amplitude, swing of its speed over the torso's speed, share of that swing at twice the gait,
#: phase of the gait in turns). A foot stands still for nearly half of the time and then swings at three times the
#: torso's speed: for a raised cosine over three fifths of the gait, the second harmonic has 0.45 of the first.
LIMBS = (
    (1.0, 0.15, 0.0, 0.0),
    (0.25, 0.8, 0.1, 0.0),
    (0.25, 0.8, 0.1, 0.5),
    (0.2, 1.3, 0.3, 0.5),
    (0.2, 1.3, 0.3, 0.0),
    (0.15, 2.0, 0.45, 0.5),
    (0.15, 2.0, 0.45, 0.0),
)


#: Radius of the circle in which a foot on a pedal goes round, once a gait [m].
CRANK_M = 0.17

#: Most scatterers of a vehicle's body, of another's beside it, and of one of its wheels.
MAX_BODY_POINTS, MAX_COMPANY_POINTS, MAX_TYRE_POINTS = 48, 12, 60

#: Most wheels of a vehicle that show.
MAX_WHEELS = 4

#: Width of a vehicle's body [m].
VEHICLE_WIDTH_M = 1.8

#: Most scatterers of a wind turbine's blade.
MAX_BLADE_POINTS = 100


def draw_person(draws: Draws, radar: Radar) -> Target:
    """Draw a walker, a runner or a cyclist: a torso that sways and limbs whose speed swings about the torso's.

    The speed of limbs on the ground swings in proportion to the torso's; on pedals they go in even circles, whatever
    the torso's speed. A bicycle's wheels, wires and hollow rims, have no echo of their own here; a vehicle's do.
    """
    speed = draws.value("person_mps") * draws.value("pace")
    gait, phase = draws.value("gait_hz"), draws.value("phase_rad")
    rides = draws.value("pedalling") > 0.75
    sharper = np.where(rides, 0.0, 1.3 * draws.uniform())
    swing_mps = np.where(rides, TWO_PI * gait * CRANK_M / LIMBS[-1][1], speed)
    grid = PulseGrid(radar)
    micro = np.zeros((len(draws), radar.pulses), np.complex64)
    body = np.zeros_like(micro)
    for number, (amplitude, swing, sharp, turns) in enumerate(LIMBS):
        stretch = swing * (0.6 + 0.6 * draws.uniform())
        omega = TWO_PI * gait * (2 if number == 0 else 1)  # the torso bobs twice a stride
        offset = phase + TWO_PI * turns
        swing_rad = -2 * TWO_PI / radar.wavelength_m * swing_mps * stretch / omega
        level = amplitude * np.exp(0.3 * draws.normal())
        limb = body_echo(
            radar,
            len(draws),
            velocity_mps=speed,
            phase_rad=draws.value("phase_rad") - swing_rad * np.sin(offset),
            vibration_rad=swing_rad,
            vibration_hz=omega / TWO_PI,
            vibration_phase_rad=offset,
            amplitude=level,
        )
        if sharp:
            stride = swing_rad * sharper * sharp / 2, 2 * omega / TWO_PI, 2 * offset
            limb *= turned(grid.sines(Sine(*(values[:, None] for values in stride))))
        (micro if number else body)[...] += limb
    truth = {"velocity_mps": speed, "gait_hz": gait}
    return Target(micro, body, 27 * draws.uniform(), truth=truth)


def draw_vehicle(draws: Draws, radar: Radar) -> Target:
    """Draw a road vehicle that passes: scatterers all over it, each on its own way past the radar, and turning wheels.

    From afar the vehicle is one line. Close to the road its parts are seen under so different angles that they fill all
    speeds up to its own, and each part's speed changes as the vehicle passes. Few scatterers leave lines; many fill the
    speeds as a flock or rain does. Scatterers outside the beam are weak. The engine shakes the body as rotors shake an
    airframe, so that lines beside the body's are no sign of a UAV. Some vehicles are not alone in the beam.
    """
    body, passage = _vehicle_body(draws, radar, MAX_BODY_POINTS)
    turns = draws.value("engine_hz")[:, None] * radar.times_s
    shaken_m = draws.value("engine_m")[:, None] * np.sin(TWO_PI * turns + draws.value("phase_rad")[:, None])
    body *= range_phasor(shaken_m, radar.wavelength_m)
    accompanied = draws.chance(0.3)  # by another one in the beam
    other, _ = _vehicle_body(draws, radar, MAX_COMPANY_POINTS, accompanied)
    body += (10 ** (draws.value("company_db") / 20)).astype(np.float32)[:, None] * other
    speed, pull, ahead, aside, sight, gone = passage
    along = ahead[:, None] + gone
    wheels, radius = _wheels(draws, radar, gone, along / np.hypot(along, aside[:, None]))
    wheels *= _passing(radar, ahead, aside, gone)
    truth = {
        "velocity_mps": speed * np.sin(sight),
        "acceleration_mps2": pull * np.sin(sight) + (speed * np.cos(sight)) ** 2 / np.hypot(ahead, aside),
        "rotation_hz": speed / (TWO_PI * radius),
    }
    # The drawn SNR is the wheels' or the body's. Were it always the wheels', a model would take a lone line for a UAV
    # whose blades are hidden; were it always the body's, visible wheels would be rare and be taken for a UAV's rotors.
    return Target(wheels, body, -draws.value("wheel_db"), snr_of_body=draws.chance(0.5), truth=truth)


def _vehicle_body(
    draws: Draws, radar: Radar, most: int, there: NDArray[np.bool_] | bool = True
) -> tuple[NDArray[np.complex64], tuple[NDArray[np.float64], ...]]:
    """Draw the echo of a vehicle without its wheels, of unit power and at most `most` scatterers, and how it passes.

    Records in which it is not `there` get no echo.

    Returns
    -------
    body : ndarray of complex64, shape (records, pulses)
    passage : tuple of ndarray
        Speed [m/s] and acceleration [m/s^2] along the road, place ahead and aside [m], and angle between the line of
        sight and the perpendicular to the road [rad], all at the middle of the dwell and of shape (records,); distance
        gone since then [m], shape (records, pulses).
    """
    speed = draws.value("vehicle_mps")
    pull = draws.acceleration_mps2("road_acceleration_mps2", radar.dwell_s)
    # by `road_m` alone, slow cars within a few metres, which roadside radars see all day, would be one record in 1000
    aside, sight = draws.either("road_m", "verge_m", 0.5), draws.value("sight_rad")
    ahead = aside * np.tan(sight)  # at the middle of the dwell
    gone = straight_path(radar.times_s - radar.times_s[radar.pulses // 2], speed, pull)
    length, beam = draws.value("vehicle_length_m"), draws.value("beam_rad")
    axis = sight + beam * (2 * draws.uniform() - 1)
    points = np.minimum(np.floor(draws.value("body_points")), most) * there
    x = ahead[:, None] + length[:, None] * (draws.uniform(most) - 0.5)
    y = aside[:, None] + VEHICLE_WIDTH_M * draws.uniform(most)
    near = (np.hypot(aside, ahead)[:, None] / np.hypot(x, y)) ** 2  # near parts are strong
    within = np.exp(-(((np.arctan2(x, y) - axis[:, None]) / beam[:, None]) ** 2))
    echo = np.exp(0.6 * draws.normal(most) + 1j * draws.value("phase_rad", most)) * near * within
    body = np.zeros((len(draws), radar.pulses), np.complex64)
    for point in range(int(points.max(initial=0))):
        rows = np.flatnonzero(points > point)
        passing = _passing(radar, x[rows, point], y[rows, point], gone[rows])
        body[rows] += echo[rows, point, None].astype(np.complex64) * passing
    power = mean_power(body)  # zero where a narrow beam misses the whole vehicle
    body /= np.sqrt(np.where(power > 0, power, 1))[:, None]
    return body, (speed, pull, ahead, aside, sight, gone)


def _passing(
    radar: Radar, ahead_m: NDArray[np.float64], aside_m: NDArray[np.float64], gone_m: NDArray[np.float64]
) -> NDArray[np.complex64]:
    """Phasor of a point on a road, `ahead_m` along it and `aside_m` across it from the radar at the dwell's middle."""
    distance = np.hypot(ahead_m[:, None] + gone_m, aside_m[:, None])
    distance -= np.hypot(ahead_m, aside_m)[:, None]
    return range_phasor(distance, radar.wavelength_m)


def _wheels(
    draws: Draws, radar: Radar, gone_m: NDArray[np.float64], cosine: NDArray[np.float64]
) -> tuple[NDArray[np.complex64], NDArray[np.float64]]:
    """Draw the echo of a vehicle's wheels about the vehicle itself, and their radius [m].

    A wheel rolls as far as the vehicle has `gone_m`. So the radial speed of a point on the rim runs from 0 at the
    ground to twice the vehicle's at the top. `cosine` is that of the angle between the road and the line of sight, one
    a pulse. Even spokes have the lines of a rotor. A tyre's points have random places and strengths, and many of them
    fill all speeds up to twice the vehicle's as noise does. A third of the vehicles show spokes, a third tyres, a third
    both.
    """
    radius = draws.value("wheel_radius_m")
    wheels, spokes, blocks = (np.floor(draws.value(law)).astype(int) for law in ("wheels", "spokes", "tyre_points"))
    own_phase = draws.value("phase_rad", 4)
    shows, equal, rim_only = draws.uniform(), draws.chance(0.5), draws.chance(0.5)
    spokes = np.where(shows < 2 / 3, spokes, 0)
    blocks = np.where(shows > 1 / 3, np.minimum(blocks, MAX_TYRE_POINTS - spokes), 0)
    points = wheels * (spokes + blocks)
    most = MAX_WHEELS * MAX_TYRE_POINTS
    depth, angle, echo = (draws.uniform(most) for _ in range(3))
    level = np.exp(0.4 * draws.normal(most))
    out = np.zeros((len(draws), radar.pulses), np.complex64)
    # float32 holds the phase of a radius, some 2300 rad at most; all points of a vehicle share one sine and cosine
    rolled = reduce_phase(gone_m / radius[:, None])
    sines, cosines = np.sin(rolled), np.cos(rolled)
    arm_rad = (-2 * TWO_PI / radar.wavelength_m * radius[:, None] * cosine).astype(np.float32)
    for point in range(int(points.max(initial=0))):
        rows = np.flatnonzero(points > point)
        number, wheel = np.divmod(point, wheels[rows])
        alike = number < spokes[rows]
        at = TWO_PI * np.where(alike, number / np.maximum(spokes[rows], 1), angle[rows, point])
        at += own_phase[rows, wheel]
        own = np.where(alike, wheel, point)  # even spokes share what is drawn for their wheel
        deep = 1 - np.where(rim_only[rows], 0.03, 0.5) * depth[rows, own]
        gain = np.where(alike & equal[rows], 1.0, level[rows, point]) * np.exp(1j * TWO_PI * echo[rows, own])
        ahead_rad = (deep * np.cos(at)).astype(np.float32)[:, None] * sines[rows]
        ahead_rad += (deep * np.sin(at)).astype(np.float32)[:, None] * cosines[rows]
        ahead_rad *= arm_rad[rows]
        out[rows] += gain.astype(np.complex64)[:, None] * turned(ahead_rad)
    return out, radius


def draw_wind_turbine(draws: Draws, radar: Radar) -> Target:
    """Draw a wind turbine: three long blades of which the range cell holds a part, and its tower at rest.

    A blade is rough on the scale of the wavelength, not a mirror: a few or many scatterers, equal or of random
    strength, at random places along the blade and across its chord. Two fifths of the turbines are as published models
    have them, equal points at equal distances, from a few to a smooth line: for a while their lines are as even as a
    rotor's.
    """
    t, records = radar.times_s, len(draws)
    length, tip = draws.value("turbine_length_m"), draws.value("turbine_tip_mps")
    turn = tip / (TWO_PI * length) * draws.sign()
    cell = np.minimum(draws.value("cell_m"), length)
    start = (length - cell) * draws.uniform()
    beta = np.deg2rad(85) * draws.uniform()
    cos_beta = np.cos(beta)
    first = draws.value("phase_rad")
    points, chord = np.floor(draws.value("turbine_points")), draws.value("chord_m")
    equal, even = draws.chance(0.5)[:, None], draws.chance(0.4)
    in_row = np.floor(draws.value("turbine_row_points"))
    evenly, points = np.flatnonzero(even), np.where(even, 0, points).astype(int)
    reach_m = np.stack([start, start + cell]) * cos_beta
    micro = np.zeros((records, radar.pulses), np.complex64)
    for blade in range(3):
        angle = TWO_PI * (turn[:, None] * t + blade / 3) + first[:, None]
        towards, across = np.cos(angle), np.sin(angle)
        inner_m, outer_m = reach_m[:, evenly, None] * towards[evenly]
        micro[evenly] += _even_row(inner_m, outer_m, in_row[evenly, None], radar.wavelength_m)
        towards -= towards[:, :1].copy()
        across -= across[:, :1].copy()
        place, aside = draws.uniform(MAX_BLADE_POINTS), draws.uniform(MAX_BLADE_POINTS)
        strength, phase = draws.uniform(MAX_BLADE_POINTS), draws.value("phase_rad", MAX_BLADE_POINTS)
        along = start[:, None] + cell[:, None] * place
        level = (np.where(equal, 1.0, strength**2) * np.exp(1j * phase)).astype(np.complex64)
        r = along * cos_beta[:, None]
        # the chord tapers to the tip
        c = chord[:, None] * (2 * aside - 1) * (1 - along / length[:, None]) * cos_beta[:, None]
        for point in range(int(points.max(initial=0))):
            rows = np.flatnonzero(points > point)
            nearer = r[rows, point, None] * towards[rows] + c[rows, point, None] * across[rows]
            micro[rows] += level[rows, point, None] * range_phasor(-nearer, radar.wavelength_m)
    body = np.exp(1j * draws.value("phase_rad")).astype(np.complex64)[:, None] * np.ones(
        (1, radar.pulses), np.complex64
    )
    truth = {
        "rotation_hz": np.abs(turn),
        "blade_length_m": length,
        "tip_mps": tip,
        "beta_rad": beta,
        "blades": np.full(records, 3.0),
        "velocity_mps": np.zeros(records),
    }
    return Target(micro, body, 45 * draws.uniform() - 5, truth=truth)


def _even_row(
    first_m: NDArray[np.float64], last_m: NDArray[np.float64], points: NDArray[np.float64], wavelength_m: float
) -> NDArray[np.complex64]:
    """Mean echo of equal points spaced evenly between two places, which are given in metres nearer to the radar.

    Dirichlet's kernel gives it at the same cost for any number of points; in float64, because the phase over a long
    blade is 1e5 rad.
    """
    between_rad = 2 * TWO_PI / wavelength_m * (last_m - first_m) / (points - 1)
    return diric(between_rad, points).astype(np.float32) * range_phasor(-(first_m + last_m) / 2, wavelength_m)


def draw_mover(draws: Draws, radar: Radar) -> Target:
    """Draw a featureless moving reflector: a far vehicle, a boat, a balloon. A lone line must not mean a drone."""
    speed = draws.either("mover_mps", "drifter_mps", 0.2)
    acceleration = draws.acceleration_mps2("bird_acceleration_mps2")
    path = straight_path(radar.times_s, speed, acceleration)
    turn = np.exp(1j * draws.value("phase_rad")).astype(np.complex64)[:, None]
    truth = {"velocity_mps": speed, "acceleration_mps2": acceleration}
    return Target(turn * range_phasor(path, radar.wavelength_m), snr_law="clutter_snr_db", truth=truth)


#: Renderers by kind.
DISCRETES = {
    "insects": draw_insects,
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
    kind : {"person", "vehicle", "wind_turbine", "mover", "insects"}
        What it is.

    Returns
    -------
    Target
    """
    return DISCRETES[kind](draws, radar)
