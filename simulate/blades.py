"""The blades of a rotor at given angles: the inner loop of every rotor, in float32 and in place.

Opposite blades, at theta and theta + pi, are conjugates. Weighted by a (1 + s sin) and b (1 - s sin), they sum to

    sinc(x) [((a + b) + (a - b) s sin(theta)) cos(y) + j ((a - b) + (a + b) s sin(theta)) sin(y)]

with x and y proportional to cos(theta). For a pair at any angle on the hub, x, y and the two weights are all linear in
the first blade's cosine, its sine and 1: a small matrix a record gives all four in one product. Where a blade is a row
of n points in place of a line, Dirichlet's kernel sin(n z) / (n sin z), z = x / (n - 1), stands for sinc(x).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .motion import TWO_PI

#: Samples worked on at a time: the arrays of a tile stay in a core's own cache.
TILE_SAMPLES = 1 << 15

#: Keeps sin(x) / x from 0 / 0 where cosines cancel; far below what a float32 of any other x resolves.
TINY = np.float32(1e-30)

#: Least half phase between root and tip [rad]: a blade without length is then a point, with sin(x) / x = 1.
_LEAST_HALF = 1e-20

Array32 = NDArray[np.float32]


@dataclass(frozen=True)
class Blades:
    """Blades of one rotor a record, in the form that the inner loop needs.

    Parameters
    ----------
    maps : ndarray of float32, shape (records, pairs, 4 or 3, 3)
        For each pair of opposite blades (or each blade of an odd number) the matrix from (cos, sin, 1) of the first
        blade's angle to (x or z, y, real weight, imaginary weight); the last is left out where it is zero throughout.
    points : int or None
        Points a blade; None for a line.
    """

    maps: Array32
    points: int | None = None

    @classmethod
    def of(
        cls,
        lead: tuple[int, ...],
        wavelength_m: float,
        blade_length_m: ArrayLike,
        beta_rad: ArrayLike,
        root_m: ArrayLike,
        blade_amplitudes: ArrayLike,
        edge_asymmetry: ArrayLike,
        points: int | None = None,
    ) -> "Blades":
        """Make them from the parameters of `rotor_echo`, for records of leading shape `lead`.

        Raises
        ------
        ValueError
            If `points` is below 1.
        """
        if points is not None and points < 1:
            raise ValueError(f"points is {points!r}: a blade has at least 1, or None for a line")

        def row(value: ArrayLike) -> NDArray[np.float64]:
            return np.broadcast_to(np.asarray(value, np.float64), lead).reshape(-1, 1)

        k_cos_beta = TWO_PI / wavelength_m * np.cos(row(beta_rad))
        tip, root, asymmetry = row(blade_length_m), row(root_m), row(edge_asymmetry)
        amplitudes = np.asarray(blade_amplitudes, np.float64)
        blades = amplitudes.shape[-1]
        amplitudes = np.broadcast_to(amplitudes, (*lead, blades)).reshape(math.prod(lead), blades)
        if blades % 2:
            even = odd = amplitudes
        else:
            here, there = amplitudes[:, : blades // 2], amplitudes[:, blades // 2 :]
            even, odd = here + there, here - there
        turn = TWO_PI / max(blades, 1) * np.arange(even.shape[1])
        cosine, sine = np.cos(turn), np.sin(turn)
        root = row_m(root, tip, points)[-1] if points else root
        half, middle = np.maximum(np.abs((tip - root) * k_cos_beta), _LEAST_HALF), (tip + root) * k_cos_beta
        half = half / (points - 1) if points and points > 1 else half
        maps = np.zeros((len(half), len(turn), 4, 3), np.float32)
        for number, value in enumerate((half, middle)):
            maps[:, :, number, 0], maps[:, :, number, 1] = value * cosine, -value * sine
        for number, level, slope in ((2, even, odd * asymmetry), (3, odd, even * asymmetry)):
            maps[:, :, number, 0], maps[:, :, number, 1], maps[:, :, number, 2] = slope * sine, slope * cosine, level
        reflecting = np.any(maps[:, :, 2:], axis=(0, 2, 3))
        return cls(maps[:, reflecting] if maps[..., 3, :].any() else maps[:, reflecting, :3], points)

    @property
    def real(self) -> bool:
        """Whether the echo has no imaginary part."""
        return self.maps.shape[2] == 3

    def sum(self, rows: slice, angle: Array32, room: "Room", real: Array32, imag: Array32 | None) -> None:
        """Sum the echoes of some records' blades.

        Parameters
        ----------
        rows : slice
            The records.
        angle : ndarray of float32, shape (records, pulses)
            Angle of the first blade [rad].
        room : Room
            Room to work in.
        real, imag : ndarray of float32, shape (records, pulses)
            Where the echo goes; `imag` may be None if `self.real`.
        """
        shape, maps = angle.shape, self.maps[rows]
        basis, mapped, share = room(3, *shape), room(maps.shape[2], *shape), room(3, *shape)
        np.cos(angle, out=basis[0])
        np.sin(angle, out=basis[1])
        basis[2] = 1
        parts = [(np.cos, 2, real)] if self.real or imag is None else [(np.cos, 2, real), (np.sin, 3, imag)]
        for pair in range(maps.shape[1]):
            np.matmul(maps[:, pair], basis.swapaxes(0, 1), out=mapped.swapaxes(0, 1))
            x, y = mapped[0], mapped[1]
            left = _share(x, self.points, share)
            for function, weight, total in parts:
                part = mapped[weight]
                part *= left
                function(y, out=x)
                if pair == 0:
                    np.multiply(part, x, out=total)
                else:
                    part *= x
                    total += part
        if imag is not None and self.real:
            imag.fill(0)
        if not maps.shape[1]:
            real.fill(0)
        room.clear()


def _share(x: Array32, points: int | None, room: Array32) -> Array32:
    """Echo of a blade over that with all its parts in phase: sinc(x), or sin(n z) / (n sin z) for a row.

    It lies in `room`, shape (3, *x.shape); `x` is overwritten. By Chebyshev's recursion sin(n z) / sin(z) is never
    0 / 0, however large z.
    """
    before, share, product = room
    if not points:
        x += TINY
        np.sin(x, out=share)
        share /= x
        return share
    share.fill(1)
    before.fill(0)
    np.cos(x, out=x)
    x *= 2
    for _ in range(points - 1):
        np.multiply(x, share, out=product)
        product -= before
        before, share, product = share, product, before
    share *= np.float32(1 / points)
    return share


def row_m(root_m: NDArray[np.float64] | float, tip_m: NDArray[np.float64] | float, points: int) -> NDArray[np.float64]:
    """Radii of a row of points, from the tip to the root [m], shape (points, ...); the only one is at the tip."""
    return np.linspace(tip_m, root_m, points)


class Room:
    """Scratch memory, taken array by array and given back all at once.

    Parameters
    ----------
    samples : int
        How many float32 it holds.
    """

    def __init__(self, samples: int) -> None:
        self._memory = np.empty(samples, np.float32)
        self._taken = 0

    def __call__(self, *shape: int) -> Array32:
        """Take an array of that shape, uninitialised."""
        start, self._taken = self._taken, self._taken + math.prod(shape)
        return self._memory[start : self._taken].reshape(shape)

    def clear(self) -> None:
        """Give everything back."""
        self._taken = 0
