"""Birds: two-part flapping wings, glides, accelerating bodies, small flocks."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .blades import TILE_SAMPLES, TINY
from .laws import Draws
from .motion import GRAVITY_MPS2, TWO_PI, range_phasor, reduce_phase, straight_path
from .radar import Radar
from .target import Target

#: No bird beats faster than this [Hz]: the product's definition of a bird, and the paper's.
MAX_WINGBEAT_HZ = 18.0

#: Most birds that a flock brings into one range cell.
MAX_FLOCK = 20

_AIR_KG_M3 = 1.225


def wingbeat_hz(mass_kg: ArrayLike, span_m: ArrayLike, area_m2: ArrayLike) -> NDArray[np.float64]:
    """Wingbeat frequency of steady flapping flight, m^(3/8) g^(1/2) b^(-23/24) S^(-1/3) rho^(-3/8).

    Parameters
    ----------
    mass_kg, span_m, area_m2 : array_like
        Body mass [kg], wing span [m] and wing area [m^2], all > 0.

    Returns
    -------
    ndarray
        Wingbeat [Hz].

    References
    ----------
    Pennycuick, "Wingbeat frequency of birds in steady cruising flight", J. Exp. Biol. 199 (1996) 1613-1618.
    """
    mass, span, area = (np.asarray(x, np.float64) for x in (mass_kg, span_m, area_m2))
    return mass ** (3 / 8) * GRAVITY_MPS2**0.5 * span ** (-23 / 24) * area ** (-1 / 3) * _AIR_KG_M3 ** (-3 / 8)


def wing_size(mass_kg: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Typical span [m] and wing area [m^2] of a bird of that mass, 1.17 m^0.39 and 0.16 m^0.72.

    References
    ----------
    Rayner, "Form and function in avian flight" (1988), allometry over all birds.
    """
    mass = np.asarray(mass_kg, np.float64)
    return 1.17 * mass**0.39, 0.16 * mass**0.72


def stroke_angles_rad(
    cycle_rad: NDArray[np.floating], stroke_scale: ArrayLike = 1.0
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
    """Angles of a two-part wing over the wingbeat cycle.

    Parameters
    ----------
    cycle_rad : ndarray, shape (..., pulses)
        Phase of the wingbeat [rad]; the wing is highest at 0.
    stroke_scale : array_like, shape (...)
        Scale of the amplitudes: 1 for the published ones, 0 for a glide.

    Returns
    -------
    inner, outer, sweep : ndarray of the type of `cycle_rad`, shape (..., pulses)
        Elevation of the inner and of the outer part, and how far the outer part is swept back [rad]: least in the
        down-stroke, when the hand is stretched.

    References
    ----------
    Amplitudes 40, 30, 20 and means 15, 40, 40 degrees: Journal of Electromagnetic Engineering and Science (2021).
    """
    scale = np.asarray(stroke_scale, cycle_rad.dtype)[..., None]
    cosine, sine = scale * np.cos(cycle_rad), scale * np.sin(cycle_rad)
    return np.deg2rad(40 * cosine + 15), np.deg2rad(30 * cosine + 40), np.deg2rad(40 - 20 * sine)


def wing_echo(
    cycle_rad: NDArray[np.float64],
    *,
    wavelength_m: float,
    half_span_m: ArrayLike,
    sight: NDArray[np.float64],
    stroke_scale: ArrayLike = 1.0,
    down_stroke: ArrayLike = 0.0,
    feather_weight: ArrayLike = 0.3,
    sweep_scale: ArrayLike = 1.0,
) -> NDArray[np.complex64]:
    """Slow-time echo of both wings about the body.

    Each part is a uniform line in closed form, with a discrete scatterer at wrist and tip.

    Parameters
    ----------
    cycle_rad : ndarray, shape (..., pulses)
        Phase of the wingbeat [rad].
    wavelength_m : float
        Wavelength [m].
    half_span_m : array_like, shape (...)
        Length of one wing [m], half of it in each part.
    sight : ndarray, shape (..., 3)
        Unit vector from the bird to the radar: forward, to the right wing, up.
    stroke_scale : array_like
        Scale of the stroke, 0 for a glide.
    down_stroke : array_like
        How much stronger the down-stroke echoes, 0..1; less where the stroke is less than the published one.
    feather_weight : array_like
        Amplitude of the wrist and tip scatterers against the whole line.
    sweep_scale : array_like
        Scale of the sweep, mean and amplitude: 1 for the published one, 0 for straight wings, negative for forward.

    Returns
    -------
    ndarray of complex64, shape (..., pulses)
    """
    cycle = reduce_phase(cycle_rad)
    inner, outer, sweep = stroke_angles_rad(cycle, stroke_scale)
    k_part = (TWO_PI / wavelength_m / 2 * np.asarray(half_span_m, np.float64)[..., None]).astype(np.float32)
    forward, right, up = (k_part * sight[..., axis, None].astype(np.float32) for axis in range(3))
    feather, down = (np.asarray(x, np.float32)[..., None] for x in (feather_weight, down_stroke))
    inner_right, inner_up = right * np.cos(inner), up * np.sin(inner)
    sweep = np.asarray(sweep_scale, sweep.dtype)[..., None] * sweep
    ahead, across = -forward * np.sin(sweep), np.cos(sweep)
    outer_right, outer_up = across * right * np.cos(outer), ahead + across * up * np.sin(outer)
    out = np.zeros(inner_right.shape, np.complex64)
    for side in (np.float32(1), np.float32(-1)):
        # A displacement towards the radar advances the phase by 2 k per metre, so by 2 x at the wrist and 2 y more at
        # the tip; the middles of the parts are half as far.
        inner_line, to_wrist = _line(inner_up + side * inner_right)
        outer_line, to_tip = _line(outer_up + side * outer_right)
        to_tip += 1
        to_tip *= feather
        outer_line += to_tip
        outer_line *= to_wrist
        out += inner_line
        out += outer_line
    # wings held still have no down-stroke
    out *= 1 + down * np.minimum(np.asarray(stroke_scale, np.float32)[..., None], 1) * np.sin(cycle)
    return out


def _line(phase_rad: NDArray[np.float32]) -> tuple[NDArray[np.complex64], NDArray[np.complex64]]:
    """Echo of a line whose middle is at that phase, sinc(x) exp(jx), and the phasor exp(2jx) of its end.

    A wing's span bounds the phase to some thousand radians, which float32 holds.
    """
    x = phase_rad + TINY
    middle = np.empty(x.shape, np.complex64)
    middle.real = np.cos(x)
    middle.imag = sine = np.sin(x)
    end = middle * middle
    sine /= x
    middle *= sine
    return middle, end


def draw_bird(draws: Draws, radar: Radar, kind: str) -> Target:
    """Draw and render a batch of birds of one kind.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.
    kind : {"flapping_bird", "gliding_bird", "flock"}
        "flapping_bird" flaps steadily. "gliding_bird" flaps and then glides, or glides and then flaps; the change may
        fall into the dwell. "flock" is 2 to `MAX_FLOCK` flapping birds.

    Returns
    -------
    Target
        `micro` holds the wings, `body` the bodies.
    """
    records = len(draws)
    mass = draws.value("bird_mass_kg")
    span, area = wing_size(mass)
    beat = np.minimum(wingbeat_hz(mass, span, area) * draws.value("wingbeat_scatter"), MAX_WINGBEAT_HZ)
    heading, elevation = draws.value("phase_rad"), np.deg2rad(-10 + 60 * draws.uniform())
    sight = np.stack(
        [np.cos(heading) * np.cos(elevation), np.sin(heading) * np.cos(elevation), -np.sin(elevation)], axis=-1
    )
    # The radar sees the bird's speed along the line of sight; flying at it (forward > 0) closes the range.
    velocity = -draws.value("bird_speed_mps") * sight[:, 0]
    acceleration = draws.acceleration_mps2("bird_acceleration_mps2")
    scale = draws.value("stroke_scale")
    down, feather = draws.value("down_stroke"), draws.value("feather_weight")
    flock = np.floor(draws.value("members")).astype(int)
    members = np.minimum(flock, MAX_FLOCK) if kind == "flock" else np.ones(records, int)
    bob = 0.02 * span * draws.uniform()

    # One column a member, drawn for all records alike: what a record draws must not depend on its batch.
    spread = draws.value("flock_velocity_mps", MAX_FLOCK) * draws.value("flock_spread")[:, None]
    rate = beat[:, None] * (1 + 0.1 * (draws.uniform(MAX_FLOCK) - 0.5))
    phase = draws.value("phase_rad", MAX_FLOCK)
    level = np.exp(0.4 * draws.normal(MAX_FLOCK) + 1j * draws.value("phase_rad", MAX_FLOCK)).astype(np.complex64)
    pause, first = draws.uniform(), draws.chance(0.5)
    # in four gliding birds of ten the wings hardly move in the whole dwell: 5e-6 to 0.05 of the stroke
    still = np.where(draws.chance(0.4), 0.05 * 1e-4 ** draws.uniform(), 1.0)
    sweep = draws.value("sweep_scale")
    body_db = draws.value("bird_body_db")

    micro = np.zeros((records, radar.pulses), np.complex64)
    body = np.zeros_like(micro)
    high = max(1, TILE_SAMPLES // radar.pulses)
    there = [np.flatnonzero(members > member) for member in range(int(members.max()))]
    tiles = [(member, all_[i : i + high]) for member, all_ in enumerate(there) for i in range(0, len(all_), high)]
    for member, rows in tiles:
        cycle = TWO_PI * rate[rows, member, None] * radar.times_s + phase[rows, member, None]
        flap = np.ones(len(rows))
        if kind == "gliding_bird":
            cycle = _pause(cycle, pause[rows], radar.dwell_s * rate[rows, member], first[rows])
            flap = still[rows]
        wings = wing_echo(
            cycle,
            wavelength_m=radar.wavelength_m,
            half_span_m=span[rows] / 2,
            sight=sight[rows],
            stroke_scale=scale[rows] * flap,
            down_stroke=down[rows],
            feather_weight=feather[rows],
            sweep_scale=sweep[rows],
        )
        # the body rises and sinks against the wings, at the wingbeat
        heave = (flap * (bob * sight[:, 2])[rows])[:, None] * np.cos(reduce_phase(cycle))
        own = velocity[rows] + (spread[rows, member] if member else 0.0)
        path = straight_path(radar.times_s, own, acceleration[rows]) + heave
        moved = level[rows, member, None] * range_phasor(path, radar.wavelength_m)
        micro[rows] += moved * wings
        body[rows] += moved
    truth = {
        "wingbeat_hz": rate[:, 0],  # as rendered; in a flock that of the first member
        "mass_kg": mass,
        "span_m": span,
        "members": members.astype(float),
        "velocity_mps": velocity,
        "acceleration_mps2": acceleration,
    }
    return Target(micro, body, body_db, truth=truth)


def _pause(
    cycle: NDArray[np.float64], when: NDArray[np.float64], beats: NDArray[np.float64], first: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Phase of the wingbeat with the wings held still before a moment (`first`) or after it (not `first`).

    The moment lies inside the dwell, or up to a quarter of it before or after.
    """
    moment = cycle[:, :1] + TWO_PI * beats[:, None] * (1.5 * when[:, None] - 0.25)
    return np.where(first[:, None], np.maximum(cycle, moment), np.minimum(cycle, np.maximum(moment, cycle[:, :1])))
