"""Echo from exact ranges of dense point scatterers in float64: slow, and approximate in their number alone.

It is the reference for the closed form (`rotor`) and for the line spectrum (`analytic`), and the renderer of scenes so
near to the radar that the range's curvature shows.

A target's centre is at range rho(t). A scatterer of the body, or a rotor's hub, stands `offset_m` from it at the angle
`bearing_rad` from the line of sight (0 is nearer to the radar); a blade's scatterer stands at radius r from the hub.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import roots_legendre

from .motion import TWO_PI


def hub_range_m(
    centre_range_m: ArrayLike, offset_m: float, bearing_rad: float, *, far_field: bool = False
) -> NDArray[np.float64]:
    """Range of a hub or of a body's scatterer: the paper's eq. (1), or (2) in the far field.

    Parameters
    ----------
    centre_range_m : array_like, shape (pulses,)
        Range of the target's centre [m], > 0.
    offset_m : float
        Distance from the centre [m], >= 0.
    bearing_rad : float
        Angle between the offset and the line of sight [rad]; 0 is straight towards the radar.
    far_field : bool
        Leave out what falls with the range.

    Returns
    -------
    ndarray of float64, shape (pulses,)
        Range [m].
    """
    rho = np.asarray(centre_range_m, np.float64)
    along = offset_m * np.cos(bearing_rad)
    if far_field:
        return rho - along
    return np.sqrt((rho - along) ** 2 + (offset_m * np.sin(bearing_rad)) ** 2)


def blade_range_m(
    hub_m: NDArray[np.float64], radius_m: ArrayLike, cosine: NDArray[np.float64], *, far_field: bool = False
) -> NDArray[np.float64]:
    """Range of a scatterer on a blade: the paper's eq. (3), or (4) in the far field.

    Parameters
    ----------
    hub_m : ndarray of float64, shape (pulses,)
        Range of the hub [m].
    radius_m : array_like
        Distance of the scatterer from the hub [m], broadcast against `hub_m`.
    cosine : ndarray of float64, shape (pulses,)
        cos(beta) cos(angle): cosine of the angle between the blade and the line of sight.
    far_field : bool
        Leave out what falls with the range.

    Returns
    -------
    ndarray of float64
        Range [m].
    """
    r = np.asarray(radius_m, np.float64)
    if far_field:
        return hub_m - r * cosine
    return np.sqrt((hub_m - r * cosine) ** 2 + r**2 * (1 - cosine**2))


def range_echo(range_m: NDArray[np.float64], wavelength_m: float) -> NDArray[np.complex128]:
    """exp(-j 4 pi R / wavelength), one term of the paper's sum (7), in float64."""
    return np.exp(-2j * TWO_PI / wavelength_m * range_m)


@dataclass(frozen=True)
class BladePoints:
    """Point scatterers along one blade.

    Parameters
    ----------
    radius_m : ndarray of float64, shape (points,)
        Distances from the hub [m].
    weight : ndarray of float64, shape (points,)
        Shares of the blade's amplitude, of unit sum.
    """

    radius_m: NDArray[np.float64]
    weight: NDArray[np.float64]


def blade_points(
    root_m: float, blade_length_m: float, points: int, spacing: Literal["even", "gauss"] = "even"
) -> BladePoints:
    """Put point scatterers on a uniform blade.

    Parameters
    ----------
    root_m, blade_length_m : float
        Radii between which the blade reflects [m]; if they are equal, one point stands there.
    points : int
        How many, >= 1.
    spacing : {"even", "gauss"}
        Evenly spaced as in the paper, or at the nodes of the Gauss-Legendre rule: then half a scatterer a radian of
        phase along the blade, plus some twenty, equal the continuous blade to all digits.

    Returns
    -------
    BladePoints

    Raises
    ------
    ValueError
        If the radii do not satisfy 0 <= root_m <= blade_length_m, or `points` is below 1.
    """
    if not 0 <= root_m <= blade_length_m:
        raise ValueError(f"root_m is {root_m!r}: it must lie between 0 and blade_length_m = {blade_length_m!r} [m]")
    if points < 1:
        raise ValueError(f"points is {points!r}: it must be at least 1")
    if root_m == blade_length_m:
        return BladePoints(np.array([blade_length_m]), np.ones(1))
    width = blade_length_m - root_m
    if spacing == "gauss":
        nodes, weights = roots_legendre(points)
        return BladePoints(root_m + width * (nodes + 1) / 2, weights / 2)
    return BladePoints(root_m + width * (np.arange(points) + 0.5) / points, np.full(points, 1 / points))


def dense_rotor_echo(
    hub_m: NDArray[np.float64],
    angle_rad: NDArray[np.float64],
    blade: BladePoints,
    *,
    wavelength_m: float,
    beta_rad: float = 0.0,
    blade_amplitudes: ArrayLike = (1.0, 1.0),
    edge_asymmetry: float = 0.0,
    far_field: bool = False,
) -> NDArray[np.complex128]:
    """Echo of one rotor's blades as a sum over point scatterers, the range of the hub included.

    Parameters
    ----------
    hub_m : ndarray of float64, shape (pulses,)
        Range of the hub [m], larger than the blade.
    angle_rad : ndarray of float64, shape (pulses,)
        Angle of the first blade [rad]; 0 points at the radar.
    blade : BladePoints
        The scatterers of each blade.
    wavelength_m : float
        Wavelength [m].
    beta_rad : float
        Angle between the line of sight and the rotor plane [rad].
    blade_amplitudes : array_like, shape (blades,)
        Amplitude of each blade, equally spaced in angle.
    edge_asymmetry : float
        As in `rotor.rotor_echo`.
    far_field : bool
        Eq. (4) in place of eq. (3).

    Returns
    -------
    ndarray of complex128, shape (pulses,)
        In the far field it is `rotor.rotor_echo` times exp(-j 4 pi hub range / wavelength), in the same unit.
    """
    amplitudes = np.asarray(blade_amplitudes, np.float64)
    out = np.zeros(np.broadcast_shapes(hub_m.shape, angle_rad.shape), np.complex128)
    for number, amplitude in enumerate(amplitudes):
        theta = angle_rad + TWO_PI * number / len(amplitudes)
        cosine = np.cos(beta_rad) * np.cos(theta)
        echo = np.zeros_like(out)
        for radius, weight in zip(blade.radius_m, blade.weight, strict=True):
            echo += weight * range_echo(blade_range_m(hub_m, radius, cosine, far_field=far_field), wavelength_m)
        out += amplitude * (1 + edge_asymmetry * np.sin(theta)) * echo
    return out
