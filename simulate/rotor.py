"""Echo of rotating blades in closed form: a uniform line of scatterers instead of a sum over them.

A blade from radius L1 to L2, seen at aspect beta, adds the radial displacement -r cos(beta) cos(theta) (the paper's
far field, eqs. 2 and 4). The integral over r of exp(+j 2 k r cos(beta) cos(theta)), k = 2 pi / wavelength, is

    (L2 - L1) exp(j k (L1 + L2) c) sinc(k (L2 - L1) c),     c = cos(beta) cos(theta),  sinc(x) = sin(x) / x.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    """

    rotation_hz: ArrayLike
    phase_rad: ArrayLike = 0.0
    drift_hz_per_s: ArrayLike = 0.0
    wander_hz: ArrayLike = 0.0
    wander_rate_hz: ArrayLike = 1.0
    wander_phase_rad: ArrayLike = 0.0

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


def rotor_echo(
    angle_rad: NDArray[np.float64],
    *,
    wavelength_m: float,
    blade_length_m: ArrayLike,
    beta_rad: ArrayLike = 0.0,
    root_m: ArrayLike = 0.0,
    blade_amplitudes: ArrayLike = (1.0, 1.0),
    edge_asymmetry: ArrayLike = 0.0,
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
        How unlike the leading and the trailing edge reflect, -1..1: a blade's amplitude is 1 + asymmetry * sin(angle),
        and sin(angle) > 0 is where it recedes (for a positive rotation rate).

    Returns
    -------
    ndarray of complex64, shape (..., pulses)
        Sum over the blades of the mean of exp(j 2 k r c) over the reflecting part of the blade: a blade of amplitude 1
        seen at rest at a right angle contributes 1.
    """
    amplitudes = np.asarray(blade_amplitudes, np.float32)
    blades = amplitudes.shape[-1]
    k_cos_beta = TWO_PI / wavelength_m * np.cos(np.asarray(beta_rad, np.float64))
    tip, root = np.asarray(blade_length_m, np.float64), np.asarray(root_m, np.float64)
    middle = ((tip + root) * k_cos_beta).astype(np.float32)[..., None]
    half = ((tip - root) * k_cos_beta).astype(np.float32)[..., None]
    asymmetry = np.asarray(edge_asymmetry, np.float32)[..., None]

    angle = reduce_phase(angle_rad)
    cos0, sin0 = np.cos(angle), np.sin(angle)
    out = np.zeros(np.broadcast_shapes(angle.shape, middle.shape, (*amplitudes.shape[:-1], 1)), np.complex64)
    for blade in range(blades):
        weight = amplitudes[..., blade, None]
        if not np.any(weight):
            continue
        turn = TWO_PI * blade / blades
        cos_turn, sin_turn = np.float32(np.cos(turn)), np.float32(np.sin(turn))
        cosine = cos0 * cos_turn - sin0 * sin_turn
        x = half * cosine
        # np.sinc divides by pi twice over; here x is safe from 0 because sin(x)/x is 1 to float32 below 1e-4
        x_safe = np.where(np.abs(x) < 1e-4, np.float32(1e-4), x)
        magnitude = weight * (np.sin(x_safe) / x_safe)
        if np.any(asymmetry):
            magnitude *= 1 + asymmetry * (sin0 * cos_turn + cos0 * sin_turn)
        phase = middle * cosine
        out.real += magnitude * np.cos(phase)
        out.imag += magnitude * np.sin(phase)
    return out
