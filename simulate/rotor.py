"""Echo of rotating blades in closed form: a uniform line of scatterers instead of a sum over them.

A blade from radius L1 to L2, seen at aspect beta, adds the radial displacement -r cos(beta) cos(theta) (the paper's
far field, eqs. 2 and 4). The integral over r of exp(+j 2 k r cos(beta) cos(theta)), k = 2 pi / wavelength, is

    (L2 - L1) exp(j k (L1 + L2) c) sinc(k (L2 - L1) c),     c = cos(beta) cos(theta),  sinc(x) = sin(x) / x.

The opposite blade has the conjugate echo, so two blades cost little more than one.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import diric

from .blades import TILE_SAMPLES, Blades, Room, row_m
from .motion import TWO_PI, reduce_phase


@dataclass(frozen=True)
class RotorMotion:
    """How one rotor turns: angle(t) = phase + 2 pi (f t + drift t^2 / 2) + (wander / rate) sin(2 pi rate t + ...).

    Every field is array_like of shape (...), one value a record.

    Parameters
    ----------
    rotation_hz : array_like
        Rotation rate [Hz] at the first pulse; its sign is the sense of rotation.
    phase_rad : array_like
        Angle of the first blade at the first pulse [rad].
    drift_hz_per_s : array_like
        Linear change of the rate [Hz/s].
    wander_hz, wander_rate_hz, wander_phase_rad : array_like
        Amplitude [Hz], rate [Hz] and phase [rad] of a slow sinusoidal wander of the rate (governor and gusts).

    Raises
    ------
    ValueError
        If a rate of the wander is not above 0.
    """

    rotation_hz: ArrayLike
    phase_rad: ArrayLike = 0.0
    drift_hz_per_s: ArrayLike = 0.0
    wander_hz: ArrayLike = 0.0
    wander_rate_hz: ArrayLike = 1.0
    wander_phase_rad: ArrayLike = 0.0

    def __post_init__(self) -> None:
        if not np.all(np.asarray(self.wander_rate_hz) > 0):
            raise ValueError(f"wander_rate_hz is {self.wander_rate_hz!r}: it must be above 0 [Hz]")

    def angle_rad(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angle of the first blade at each instant.

        Parameters
        ----------
        times_s : ndarray, shape (pulses,)
            Instants [s].

        Returns
        -------
        ndarray of float64, shape (..., pulses)
            Angle [rad], not reduced.
        """

        def column(value: ArrayLike) -> NDArray[np.float64]:
            return np.asarray(value, np.float64)[..., None]

        f, drift = column(self.rotation_hz), column(self.drift_hz_per_s)
        angle = column(self.phase_rad) + TWO_PI * times_s * (f + 0.5 * drift * times_s)
        wander = column(self.wander_hz)
        if np.any(wander):
            rate, phase = column(self.wander_rate_hz), column(self.wander_phase_rad)
            angle = angle + wander / rate * (np.sin(TWO_PI * rate * times_s + phase) - np.sin(phase))
        return angle


#: Largest 4 pi L cos(beta) / wavelength for float32: beyond it the rounding of an angle shows in the flash.
LARGEST_GAMMA = 3e4

#: Most points of a blade in float32: the recursion over them loses digits with the square of their number.
MOST_FLOAT32_POINTS = 64


def rotor_echo(
    angle_rad: NDArray[np.float64],
    *,
    wavelength_m: float,
    blade_length_m: ArrayLike,
    beta_rad: ArrayLike = 0.0,
    root_m: ArrayLike = 0.0,
    blade_amplitudes: ArrayLike = (1.0, 1.0),
    edge_asymmetry: ArrayLike = 0.0,
    points: int | None = None,
) -> NDArray[np.complex64]:
    """Slow-time echo of one rotor's blades about its hub, far field.

    Parameters
    ----------
    angle_rad : ndarray of float64, shape (..., pulses)
        Angle of the first blade [rad]; 0 points at the radar, where that blade's range is shortest.
    wavelength_m : float
        Wavelength [m].
    blade_length_m : array_like, shape (...)
        Blade tip radius [m], >= 0.
    beta_rad : array_like, shape (...)
        Angle between the line of sight and the rotor plane [rad]; pi/2 leaves no micro-Doppler.
    root_m : array_like, shape (...)
        Radius where the reflecting part of the blade begins [m], 0 <= root_m <= blade_length_m.
    blade_amplitudes : array_like, shape (..., blades)
        Amplitude of each blade, equally spaced in angle; 0 takes a blade away.
    edge_asymmetry : array_like, shape (...)
        How differently the leading and the trailing edge reflect, -1..1: a blade's amplitude is multiplied by
        1 + asymmetry * sin(angle); it recedes where sin(angle) > 0 (for a positive rotation rate).
    points : int, optional
        Equal scatterers a blade, evenly from `root_m` to the tip, >= 1; one is at the tip, which is the paper's model.
        None: a line that reflects evenly (Martin and Mulgrew 1990).

    Returns
    -------
    ndarray of complex64, shape (..., pulses)
        Sum over the blades of the mean of exp(j 2 k r c) over the reflecting part of the blade: a blade of amplitude 1
        seen at rest at a right angle contributes 1.

    Raises
    ------
    ValueError
        If `points` is below 1.
    """
    angle = np.asarray(angle_rad, np.float64)
    lead = np.broadcast_shapes(
        angle.shape[:-1],
        *(np.shape(value) for value in (blade_length_m, beta_rad, root_m, edge_asymmetry)),
        np.shape(blade_amplitudes)[:-1],
    )
    blades = Blades.of(lead, wavelength_m, blade_length_m, beta_rad, root_m, blade_amplitudes, edge_asymmetry, points)
    pulses = angle.shape[-1]
    angle = np.broadcast_to(angle, (*lead, pulses)).reshape(-1, pulses)
    out = np.empty(angle.shape, np.complex64)
    tip, beta, root, asymmetry = (
        np.broadcast_to(np.asarray(value, np.float64), lead).reshape(-1, 1)
        for value in (blade_length_m, beta_rad, root_m, edge_asymmetry)
    )
    fine = (needs_float64(wavelength_m, tip, beta) | ((points or 0) > MOST_FLOAT32_POINTS))[:, 0]
    if not fine.all():
        wide = max(1, min(pulses, TILE_SAMPLES))
        high, room = TILE_SAMPLES // wide, Room(10 * TILE_SAMPLES)
        for row, at in product(range(0, len(out), high), range(0, pulses, wide)):
            rows, span = slice(row, row + high), slice(at, at + wide)
            reduced = reduce_phase(angle[rows, span])
            part = out[rows, span]
            real, imag = np.empty_like(reduced), np.empty_like(reduced)
            blades.sum(rows, reduced, room, real, imag)
            part.real, part.imag = real, imag
    if fine.any():  # the precision of a record depends on itself alone, not on the others of its batch
        amplitudes = np.asarray(blade_amplitudes, np.float64)
        number = amplitudes.shape[-1]
        amplitudes = np.broadcast_to(amplitudes, (*lead, number)).reshape(len(out), number)
        tip, beta, root, asymmetry, amplitudes = (value[fine] for value in (tip, beta, root, asymmetry, amplitudes))
        out[fine] = _double_echo(angle[fine], wavelength_m, tip, beta, root, asymmetry, amplitudes, points)
    return out.reshape(*lead, pulses)


def needs_float64(wavelength_m: float, blade_length_m: ArrayLike, beta_rad: ArrayLike) -> NDArray[np.bool_]:
    """Tell where a blade is too long in wavelengths (`LARGEST_GAMMA`) for angles rounded to float32."""
    return np.asarray(2 * TWO_PI / wavelength_m * np.multiply(blade_length_m, np.abs(np.cos(beta_rad))) > LARGEST_GAMMA)


def _double_echo(
    angle: NDArray[np.float64],
    wavelength_m: float,
    tip_m: NDArray[np.float64],
    beta_rad: NDArray[np.float64],
    root_m: NDArray[np.float64],
    asymmetry: NDArray[np.float64],
    amplitudes: NDArray[np.float64],
    points: int | None,
) -> NDArray[np.complex64]:
    """Closed form blade by blade in float64, where float32 is too coarse: long blades, rows of many points.

    Angles are of shape (records, pulses), amplitudes (records, blades), all others (records, 1).
    """
    blades = amplitudes.shape[-1]
    inner_m = row_m(root_m, tip_m, points)[-1] if points else root_m
    k = TWO_PI / wavelength_m * np.cos(beta_rad)
    out = np.zeros(angle.shape, np.complex128)
    for number in range(blades):
        theta = angle + TWO_PI * number / blades
        along = k * np.cos(theta)
        weight = amplitudes[:, number, None] * (1 + asymmetry * np.sin(theta))
        half = (tip_m - inner_m) * along
        share = diric(2 * half / max(points - 1, 1), points) if points else np.sinc(half / np.pi)
        out += weight * share * np.exp(1j * (tip_m + inner_m) * along)
    return out.astype(np.complex64)
