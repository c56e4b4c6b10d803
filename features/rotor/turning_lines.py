"""Lines that follow rotors of changing rates, about a body: their means over records, their sums, their products.

Relative to the body, lines n and -n consist of the same cosine and sine. So half as many numbers hold them, and the
products of all lines, which a fit needs, take a quarter of the operations.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..lines import middle_times
from .turning import own_polynomials


def _powers(rate: float, ahead: NDArray[np.float64], reach: int, pulses: int) -> NDArray[np.complex64]:
    """A rotor's unit lines of orders 0 to reach about a body at rest, shape (reach + 1, pulses)."""
    out = np.empty((reach + 1, pulses), np.complex64)
    out[0] = 1
    out[1:2] = np.exp(2j * np.pi * rate * (middle_times(pulses) + ahead @ own_polynomials(pulses)))
    for order in range(2, len(out)):  # from two half orders: errors grow with the order's logarithm
        np.multiply(out[order // 2], out[order - order // 2], out=out[order])
    return out


class TurningLines:
    """Unit lines that each follow their rotor; phases count from the middle of the record.

    Parameters
    ----------
    body : ndarray, shape (pulses,)
        Turns of the body's line.
    rotors : sequence of (float, ndarray of shape (degrees,))
        Line spacing of each rotor [cycles a sample], and its time ahead of a constant-rate rotor, by polynomials of
        `DEGREES` [samples].
    comb, order : ndarray of int, shape (lines,)
        Rotor and order of each line; each pair occurs once.
    """

    def __init__(
        self,
        body: NDArray[np.float64],
        rotors: Sequence[tuple[float, NDArray[np.float64]]],
        comb: NDArray[np.intp],
        order: NDArray[np.intp],
    ) -> None:
        pulses, reaches = len(body), [int(np.abs(order[comb == n]).max(initial=0)) for n in range(len(rotors))]
        powers = [_powers(*rotor, reach, pulses) for rotor, reach in zip(rotors, reaches, strict=True)]
        first = np.cumsum([0, *(len(own) for own in powers)])
        #: Cosines, then as many sines.
        self._waves = np.empty((2 * first[-1], pulses), np.float32)
        for own, at in zip(powers, first[:-1], strict=True):
            self._waves[at : at + len(own)] = own.real
            self._waves[first[-1] + at : first[-1] + at + len(own)] = own.imag
        #: Which wave each line has, and the factor of its sine.
        self._wave, self._turn = first[comb] + np.abs(order), np.where(order < 0, -1j, 1j)
        self._sides = (np.flatnonzero(order >= 0), np.flatnonzero(order < 0))  # no wave occurs twice in one
        self._body = np.exp(2j * np.pi * body).astype(np.complex64)

    def means(self, records: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
        """Mean products of records (records, pulses) with the conjugate of each line, shape (lines, records)."""
        still = (records * self._body.conj()).astype(np.complex64)
        real, imag = np.split(self._waves @ np.concatenate([still.real, still.imag]).T, 2, axis=1)
        cosine, sine = np.split((real + 1j * imag.astype(np.float64)) / self._waves.shape[1], 2)
        return np.asarray(cosine[self._wave] + self._turn.conj()[:, None] * sine[self._wave], np.complex128)

    def sums(self, amplitudes: NDArray[np.complexfloating]) -> NDArray[np.complex64]:
        """Sums of lines as records, shape (records, pulses), for amplitudes (records, lines)."""
        of_waves = np.zeros((2, len(amplitudes), len(self._waves) // 2), np.complex64)
        for side in self._sides:
            of_waves[0][:, self._wave[side]] += amplitudes[:, side]
            of_waves[1][:, self._wave[side]] += amplitudes[:, side] * self._turn[side]
        each = np.concatenate(of_waves, axis=1)
        real, imag = np.split(np.concatenate([each.real, each.imag]) @ self._waves, 2)
        return np.asarray((real + 1j * imag) * self._body, np.complex64)

    def products(self, basis: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
        """Mean products of each line's conjugate with each line, shape (lines, lines), without what a basis spans.

        Parameters
        ----------
        basis : ndarray, shape (sequences, pulses)
            Orthonormal.
        """
        from scipy.linalg import blas  # here, because predicting needs no such import

        pulses, waves = self._waves.shape[1], len(self._waves) // 2
        upper = blas.ssyrk(1 / pulses, self._waves.T, trans=1)
        alike = [np.triu(one) + np.triu(one, 1).T for one in (upper[:waves, :waves], upper[waves:, waves:])]
        crossed = upper[:waves, waves:]
        both = self._wave[:, None], self._wave[None]
        turn = self._turn.imag.astype(np.float32)
        out = np.empty((len(turn), len(turn)), np.complex128)
        out.real = alike[0][both] + turn[:, None] * turn * alike[1][both]
        cosine_sine = crossed[both] * turn
        out.imag = cosine_sine - cosine_sine.T
        if len(basis):
            held = self.means(basis)
            out -= pulses * (held @ held.conj().T)
        return out
