"""Echo of whole aircraft at about the cost of drawing their noise: rotors, body and path, tile by tile in float32."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .blades import TILE_SAMPLES, Array32, Blades, Room
from .grid import PhaseLaw, PulseGrid, Sine
from .radar import Radar
from .rotor import LARGEST_GAMMA, MOST_FLOAT32_POINTS, RotorMotion, needs_float64


@dataclass(frozen=True)
class Rotor:
    """One rotor of each aircraft of a batch; every field but `points` is array_like, shape (records,) or a scalar.

    Parameters
    ----------
    motion : RotorMotion
        How it turns.
    blade_length_m, beta_rad, root_m, edge_asymmetry : array_like
        As in `rotor_echo`.
    blade_amplitudes : array_like, shape (blades,) or (records, blades)
        Amplitude of each blade.
    hub : array_like of complex
        Amplitude and phase of the whole rotor: where on the aircraft it sits.
    points : int or None
        As in `rotor_echo`; at most `MOST_FLOAT32_POINTS`.
    """

    motion: RotorMotion
    blade_length_m: ArrayLike
    beta_rad: ArrayLike = 0.0
    root_m: ArrayLike = 0.0
    blade_amplitudes: ArrayLike = (1.0, 1.0)
    edge_asymmetry: ArrayLike = 0.0
    hub: ArrayLike = 1.0
    points: int | None = None


def rotors_echo(
    radar: Radar,
    rotors: Sequence[Rotor],
    records: int,
    *,
    velocity_mps: ArrayLike = 0.0,
    acceleration_mps2: ArrayLike = 0.0,
    vibration_rad: ArrayLike = 0.0,
    vibration_hz: ArrayLike = 0.0,
    vibration_phase_rad: ArrayLike = 0.0,
    out: NDArray[np.complex64] | None = None,
) -> NDArray[np.complex64]:
    """Echo of all rotors of each aircraft, carried along and shaken by its body.

    It is the sum over the rotors of hub x `rotor_echo`, times the phasor of the path, to the precision of float32, but
    much cheaper to compute. The airframe is rigid, so its vibration moves every hub as it moves the body.

    Parameters
    ----------
    radar : Radar
        The radar that looks.
    rotors : sequence of Rotor
        The rotors, at least one.
    records : int
        Aircraft in the batch.
    velocity_mps, acceleration_mps2 : array_like, shape (records,)
        Radial velocity [m/s] at the first pulse and acceleration [m/s^2], positive when the range grows.
    vibration_rad, vibration_hz, vibration_phase_rad : array_like, shape (records,)
        As in `body_echo`.
    out : ndarray of complex64, shape (records, pulses), optional
        What the echo is added to, such as the noise: this saves another pass over the records.

    Returns
    -------
    ndarray of complex64, shape (records, pulses)

    Raises
    ------
    ValueError
        If a rotor's `points` is below 1 or above `MOST_FLOAT32_POINTS`, or a blade is too many wavelengths long for
        float32.
    """
    most = max((rotor.points or 0 for rotor in rotors), default=0)
    if most > MOST_FLOAT32_POINTS:
        raise ValueError(f"points is {most}: it must be at most {MOST_FLOAT32_POINTS}: more take `rotor_echo`")
    for number, rotor in enumerate(rotors):
        if needs_float64(radar.wavelength_m, rotor.blade_length_m, rotor.beta_rad).any():
            raise ValueError(
                f"rotors[{number}].blade_length_m is {rotor.blade_length_m!r}: 4 pi length cos(beta) / wavelength must "
                f"be at most {LARGEST_GAMMA:g}: longer blades take `rotor_echo`"
            )
    shake = (vibration_rad, vibration_hz, vibration_phase_rad)
    grid, path = PulseGrid(radar), _path(radar, velocity_mps, acceleration_mps2, records, shake)
    turning = _turning([rotor.motion for rotor in rotors], records)
    blades = [_blades(rotor, radar, records) for rotor in rotors]
    parts = 1 if all(b.real for b in blades) else 2
    hubs = np.stack([np.broadcast_to(np.asarray(rotor.hub, np.complex64), records) for rotor in rotors], axis=-1)
    mixing = np.concatenate([hubs, 1j * hubs][:parts], axis=-1)[:, None]
    mixing = np.concatenate([mixing.real, mixing.imag], axis=1)  # (records, 2, parts x rotors)
    sums = np.empty((records, radar.pulses), np.complex64) if out is None else out
    room, planes = Room(10 * TILE_SAMPLES), Room(5 * len(rotors) * TILE_SAMPLES)
    for tile in grid.tiles(records):
        echoes = planes(parts, len(rotors), *tile.flat)
        for number, angle in enumerate(grid.phase(tile, turning, planes)):
            blades[number].sum(tile.rows, angle, room, echoes[0, number], echoes[1, number] if parts == 2 else None)
        total = room(2, *tile.flat)
        np.matmul(mixing[tile.rows], echoes.reshape(-1, *tile.flat).swapaxes(0, 1), out=total.swapaxes(0, 1))
        (angle,) = grid.phase(tile, path, room)
        turn = room(2, *tile.flat)
        np.cos(angle, out=turn[0])
        np.sin(angle, out=turn[1])
        a, b = room(2, *tile.flat)
        for into, operation, (first, second) in (
            (sums.real, np.subtract, ((0, 0), (1, 1))),
            (sums.imag, np.add, ((0, 1), (1, 0))),
        ):
            np.multiply(total[first[0]], turn[first[1]], out=a)
            np.multiply(total[second[0]], turn[second[1]], out=b)
            operation(a, b, out=a)
            _put(into[tile.rows, tile.pulses], a, add=out is not None)
        room.clear()
        planes.clear()
    return sums


def body_echo(
    radar: Radar,
    records: int,
    *,
    velocity_mps: ArrayLike = 0.0,
    acceleration_mps2: ArrayLike = 0.0,
    phase_rad: ArrayLike = 0.0,
    vibration_rad: ArrayLike = 0.0,
    vibration_hz: ArrayLike = 0.0,
    vibration_phase_rad: ArrayLike = 0.0,
    amplitude: ArrayLike = 1.0,
    out: NDArray[np.complex64] | None = None,
) -> NDArray[np.complex64]:
    """Echo of a body on a straight path that shakes sinusoidally.

    Parameters
    ----------
    radar : Radar
        The radar that looks.
    records : int
        Bodies in the batch.
    velocity_mps, acceleration_mps2 : array_like, shape (records,)
        As in `rotors_echo`.
    phase_rad : array_like, shape (records,)
        Phase at rest [rad].
    vibration_rad, vibration_hz, vibration_phase_rad : array_like, shape (records,)
        Amplitude of the phase [rad], rate [Hz] and phase [rad] of the vibration.
    amplitude : array_like, shape (records,)
        Amplitude of the echo.
    out : ndarray of complex64, shape (records, pulses), optional
        What the echo is added to.

    Returns
    -------
    ndarray of complex64, shape (records, pulses)
    """
    shake = (vibration_rad, vibration_hz, vibration_phase_rad)
    grid, path = PulseGrid(radar), _path(radar, velocity_mps, acceleration_mps2, records, shake, phase_rad)
    gain = np.broadcast_to(np.asarray(amplitude, np.float32), records)[:, None]
    sums = np.empty((records, radar.pulses), np.complex64) if out is None else out
    room = Room(4 * TILE_SAMPLES)
    for tile in grid.tiles(records):
        (angle,) = grid.phase(tile, path, room)
        wave = room(*tile.flat)
        for into, function in ((sums.real, np.cos), (sums.imag, np.sin)):
            function(angle, out=wave)
            wave *= gain[tile.rows]
            _put(into[tile.rows, tile.pulses], wave, add=out is not None)
        room.clear()
    return sums


def _row(value: ArrayLike, records: int) -> NDArray[np.float64]:
    """One value a record, shape (1, records)."""
    return np.broadcast_to(np.asarray(value, np.float64), (1, records))


def _path(
    radar: Radar,
    velocity_mps: ArrayLike,
    acceleration_mps2: ArrayLike,
    records: int,
    shake: tuple[ArrayLike, ArrayLike, ArrayLike],
    phase_rad: ArrayLike = 0.0,
) -> PhaseLaw:
    """Two-way phase of straight paths, Doppler = -2 v / wavelength, shaken by a sine of amplitude, rate and phase."""
    velocity, acceleration = _row(velocity_mps, records), _row(acceleration_mps2, records)
    return PhaseLaw(
        _row(phase_rad, records),
        velocity * (-2 / radar.wavelength_m),
        acceleration * (-2 / radar.wavelength_m),
        Sine(*(_row(x, records) for x in shake)) if np.any(shake[0]) else None,
    )


def _turning(motions: Sequence[RotorMotion], records: int) -> PhaseLaw:
    """Angles of the rotors."""

    def rows(name: str) -> NDArray[np.float64]:
        return np.concatenate([_row(getattr(motion, name), records) for motion in motions])

    rate, phase = rows("wander_rate_hz"), rows("wander_phase_rad")
    wander = Sine(rows("wander_hz") / rate, rate, phase)
    start = rows("phase_rad") - wander.amplitude_rad * np.sin(phase)
    sine = wander if np.any(wander.amplitude_rad) else None
    return PhaseLaw(start, rows("rotation_hz"), rows("drift_hz_per_s"), sine)


def _blades(rotor: Rotor, radar: Radar, records: int) -> Blades:
    return Blades.of(
        (records,),
        radar.wavelength_m,
        rotor.blade_length_m,
        rotor.beta_rad,
        rotor.root_m,
        rotor.blade_amplitudes,
        rotor.edge_asymmetry,
        rotor.points,
    )


def _put(into: Array32, values: Array32, *, add: bool) -> None:
    """Add a tile to the records, or write it; columns beyond the last pulse are dropped."""
    if add:
        into += values[:, : into.shape[1]]
    else:
        into[...] = values[:, : into.shape[1]]
