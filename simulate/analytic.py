"""The line spectrum of a steady rotor, the paper's eq. (24): a third way to the same echo, without time in it.

exp(j G cos(theta)) = sum over m of j^m J_m(G) exp(j m theta), G = 4 pi r cos(beta) / wavelength. So a scatterer at
radius r has a line at every multiple of the rotation rate, of amplitude J_m(G); N equal blades leave every N-th line.
(The paper's phase factor, phi - pi/2 in place of phi + pi/2, counts a blade's angle from the side away from the radar.)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import jv

from .motion import TWO_PI


@dataclass(frozen=True)
class LineSpectrum:
    """Lines of one rotor about its hub.

    Parameters
    ----------
    orders : ndarray of int, shape (lines,)
        Order m of each line, rising from -highest to highest.
    frequency_hz : ndarray of float64, shape (lines,)
        Doppler frequency of each line [Hz]: m times the rotation rate, less 2 v / wavelength.
    amplitude : ndarray of complex128, shape (lines,)
        Complex amplitude; a blade of amplitude 1 at rest, seen at a right angle, has 1.
    """

    orders: NDArray[np.int64]
    frequency_hz: NDArray[np.float64]
    amplitude: NDArray[np.complex128]

    def echo(self, times_s: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Sum of the lines at these instants [s], shape (pulses,): aliases as the radar's samples do."""
        out = np.zeros(len(times_s), np.complex128)
        for frequency, amplitude in zip(self.frequency_hz, self.amplitude, strict=True):
            if amplitude != 0:
                out += amplitude * np.exp(1j * TWO_PI * frequency * times_s)
        return out


def highest_order(gamma: float) -> int:
    """Order beyond which J_m(gamma) is below 1e-17: beyond m = gamma it decays within a few gamma^(1/3) orders."""
    return int(np.ceil(gamma + 12 * np.cbrt(gamma) + 20))


def point_coefficients(gamma: float, highest: int) -> NDArray[np.float64]:
    """J_m(gamma) for m = 0..highest, shape (highest + 1,): a scatterer at one radius."""
    return jv(np.arange(highest + 1), gamma)


def blade_coefficients(gamma_root: float, gamma_tip: float, highest: int) -> NDArray[np.float64]:
    """Mean of J_m over a uniform blade, m = 0..highest: its integral is 2 (J_(m+1) + J_(m+3) + ...).

    Parameters
    ----------
    gamma_root, gamma_tip : float
        4 pi r cos(beta) / wavelength at both ends of the reflecting part, 0 <= gamma_root <= gamma_tip.
    highest : int
        Highest order.

    Returns
    -------
    ndarray of float64, shape (highest + 1,)
    """
    width = gamma_tip - gamma_root
    if width < 1e-6:  # a point at the middle, right to 1e-13: the error is of second order in the width
        return point_coefficients((gamma_root + gamma_tip) / 2, highest)
    top = max(highest, highest_order(gamma_tip)) + 2
    orders = np.arange(top + 1)
    bessel = jv(orders, gamma_tip) - jv(orders, gamma_root)
    sums = np.zeros(top + 3)
    for parity in (0, 1):  # sums[m] = bessel[m] + bessel[m + 2] + ...
        column = bessel[parity::2]
        sums[parity : top + 1 : 2] = np.cumsum(column[::-1])[::-1]
    return 2 * sums[1 : highest + 2] / width


def rotor_lines(
    *,
    rotation_hz: float,
    phase_rad: float = 0.0,
    wavelength_m: float,
    blade_length_m: float,
    beta_rad: float = 0.0,
    root_m: float = 0.0,
    blade_amplitudes: ArrayLike = (1.0, 1.0),
    edge_asymmetry: float = 0.0,
    velocity_mps: float = 0.0,
) -> LineSpectrum:
    """Line spectrum of a rotor that turns at a constant rate, far field.

    Parameters
    ----------
    rotation_hz : float
        Rotation rate [Hz]; its sign is the sense of rotation.
    phase_rad : float
        Angle of the first blade at time 0 [rad].
    wavelength_m, blade_length_m, beta_rad, root_m, blade_amplitudes, edge_asymmetry
        As in `rotor.rotor_echo`; `root_m` equal to `blade_length_m` is the paper's point scatterer at the tip.
    velocity_mps : float
        Radial velocity [m/s], positive when the range grows.

    Returns
    -------
    LineSpectrum
    """
    amplitudes = np.asarray(blade_amplitudes, np.float64)
    gamma_root, gamma_tip = (2 * TWO_PI * r * np.cos(beta_rad) / wavelength_m for r in (root_m, blade_length_m))
    highest = highest_order(gamma_tip)
    one_side = blade_coefficients(gamma_root, gamma_tip, highest + 1)
    # j^m J_m is the same for m and -m
    one_side = one_side * np.array([1, 1j, -1, -1j])[np.arange(highest + 2) % 4]
    both = np.concatenate([one_side[:0:-1], one_side])
    orders = np.arange(-highest, highest + 1)
    # multiplying by sin(theta) shifts every line by one order to each side
    blade = both[1:-1] + edge_asymmetry / 2j * (both[:-2] - both[2:])
    turns = TWO_PI * np.arange(len(amplitudes)) / len(amplitudes)
    comb = np.exp(1j * orders[:, None] * turns) @ amplitudes.astype(np.complex128)
    comb[np.abs(comb) < 1e-12 * np.abs(amplitudes).sum()] = 0  # equal blades cancel the lines between, to rounding
    amplitude = blade * comb * np.exp(1j * orders * phase_rad)
    frequency = np.asarray(orders * rotation_hz - 2 * velocity_mps / wavelength_m, np.float64)
    return LineSpectrum(orders, frequency, amplitude)
