"""From a path to a phase: range histories become unit phasors without losing digits."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

TWO_PI = 2 * np.pi

GRAVITY_MPS2 = 9.81


def reduce_phase(phase_rad: NDArray[np.float64]) -> NDArray[np.float32]:
    """Bring a phase into [-pi, pi] and then to float32.

    A phase grows with range and time to 1e6 rad and more, where float32 has hardly a digit left behind the point. So it
    is reduced in float64 first; that is faster than a double-precision sine of it.

    Parameters
    ----------
    phase_rad : ndarray of float64
        Phase [rad], any shape.

    Returns
    -------
    ndarray of float32
        The same angle within [-pi, pi] [rad].
    """
    return (phase_rad - TWO_PI * np.rint(phase_rad / TWO_PI)).astype(np.float32)


def phasor(phase_rad: NDArray[np.float64]) -> NDArray[np.complex64]:
    """exp(j phase), complex64, accurate for phases of any size a float64 holds.

    Parameters
    ----------
    phase_rad : ndarray of float64
        Phase [rad], any shape.

    Returns
    -------
    ndarray of complex64
        Unit phasors, same shape.
    """
    return turned(reduce_phase(phase_rad))


def turned(angle_rad: NDArray[np.float32]) -> NDArray[np.complex64]:
    """exp(j angle) of angles [rad] that float32 holds: a third of the time of a complex exponential."""
    out = np.empty(angle_rad.shape, np.complex64)
    np.cos(angle_rad, out=out.real)
    np.sin(angle_rad, out=out.imag)
    return out


def range_phasor(range_m: NDArray[np.float64], wavelength_m: ArrayLike) -> NDArray[np.complex64]:
    """Two-way phasor exp(-j 4 pi R / wavelength) of a range history: the paper's eq. (7).

    A range that grows (positive radial velocity) gives a falling phase: Doppler = -2 v / wavelength.

    Parameters
    ----------
    range_m : ndarray of float64, shape (..., pulses)
        Range, or its change since the first pulse [m].
    wavelength_m : array_like
        Wavelength [m], broadcast against `range_m`.

    Returns
    -------
    ndarray of complex64, shape (..., pulses)
    """
    return phasor(range_m * (-2 * TWO_PI / np.asarray(wavelength_m, np.float64)))


def straight_path(times_s: NDArray[np.float64], velocity_mps: ArrayLike, acceleration_mps2: ArrayLike = 0.0) -> NDArray:
    """Range change of a body with constant acceleration, v t + a t^2 / 2 [m].

    Parameters
    ----------
    times_s : ndarray, shape (pulses,)
        Instants [s].
    velocity_mps, acceleration_mps2 : array_like, shape (...)
        Radial velocity [m/s] at the first pulse and radial acceleration [m/s^2]; positive when the range grows.

    Returns
    -------
    ndarray of float64, shape (..., pulses)
    """
    v = np.asarray(velocity_mps, np.float64)[..., None]
    a = np.asarray(acceleration_mps2, np.float64)[..., None]
    return times_s * (v + 0.5 * a * times_s)
