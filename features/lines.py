"""Inner products of a record with unit lines of any frequency, and sums of such lines, each through one short FFT."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

#: TAPS: bins of the twice padded spectrum that a line is interpolated from. _SHAPE: the kernel's shape parameter for so
#: many. Errors are 1e-6. The kernel is exp(shape x sqrt(1 - x^2)) (Barnett, Magland and af Klinteberg, SIAM J. Sci.
#: Comput. 41, 2019).
TAPS = 8
_SHAPE = 2.3 * TAPS

#: Places of these bins, counted from the bin below the line.
TAP = np.arange(1 - TAPS // 2, 1 + TAPS // 2)

#: Products of lines worked out at once: they must stay in the cache.
PRODUCTS_AT_ONCE = 2**15


def squared(amplitude: NDArray[np.complexfloating]) -> NDArray[np.floating]:
    """Power of amplitudes, in their own precision."""
    return np.asarray(amplitude.real**2 + amplitude.imag**2)


def energy(samples: NDArray[np.complexfloating]) -> float:
    """Sum of the samples' powers."""
    return float(squared(samples).sum())


def from_whole(turns: NDArray[np.floating]) -> NDArray[np.floating]:
    """Turns less the nearest whole number, -0.5 to 0.5: folds frequencies [cycles a sample] into the span."""
    return np.asarray(turns - np.rint(turns))


def middle_times(pulses: int) -> NDArray[np.float64]:
    """Time of each pulse from the middle of the record [samples]."""
    return np.asarray(np.arange(pulses) - (pulses - 1) / 2, np.float64)


def _bell(away: NDArray[np.floating]) -> NDArray[np.float64]:
    """The kernel at -1 <= away <= 1, scaled to 1 at 0."""
    return np.asarray(np.exp(_SHAPE * (np.sqrt(np.maximum(1 - away**2, 0)) - 1)), np.float64)


@lru_cache(maxsize=16)
def kernel(pulses: int) -> tuple[int, NDArray[np.float64]]:
    """Transform length, and one over the kernel's own transform at each pulse."""
    size = fft.next_fast_len(2 * pulses)
    time = middle_times(pulses)
    node, weight = np.polynomial.legendre.leggauss(64)
    out = 2 / TAPS / (np.cos(np.pi * TAPS / size * np.outer(time, node)) @ (weight * _bell(node)))
    out.setflags(write=False)
    return size, out


def taps(place: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The bin below each place [bins of `kernel`], and the weights of the `TAP` bins about it, shape (lines, taps)."""
    first = np.floor(place).astype(np.intp)
    return first, _bell(2 / TAPS * ((place - first)[:, None] - TAP))


def _turned_taps(frequency: NDArray[np.floating], pulses: int) -> tuple[NDArray[np.intp], NDArray[np.complex128]]:
    """Bins about each frequency and their weights, shape (lines, taps); time counts from the middle of the record."""
    size, _ = kernel(pulses)
    first, weight = taps(frequency * size)
    turn = 1j * np.pi * (pulses - 1) / size
    turns = np.exp(turn * (first % (2 * size)))[:, None] * np.exp(turn * TAP)
    return (first[:, None] + TAP) % size, weight * turns


class LinesSeen:
    """Records prepared for inner products with unit lines of any frequencies, any number of times.

    Parameters
    ----------
    samples : ndarray of complex128, shape (rows, pulses)
        Records.
    """

    def __init__(self, samples: NDArray[np.complex128]) -> None:
        self._pulses = samples.shape[-1]
        size, shape = kernel(self._pulses)
        self._spectra = fft.fft(samples * shape, size)

    def means(self, frequency: NDArray[np.floating]) -> NDArray[np.complex128]:
        """Mean of conj(unit line) x samples, time counted from the middle of the record, shape (rows, lines).

        Parameters
        ----------
        frequency : ndarray, shape (lines,)
            [cycles a sample].
        """
        bins, weight = _turned_taps(frequency, self._pulses)
        read = np.einsum("lt,klt->kl", weight, self._spectra.take(bins, axis=1))
        return np.asarray(read / self._pulses, np.complex128)


@dataclass(frozen=True)
class LineSpace:
    """One record, ready to be read at any frequency.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        The record.
    """

    samples: NDArray[np.complex128]

    @cached_property
    def _seen(self) -> LinesSeen:
        """The samples, and the samples times their time."""
        return LinesSeen(np.stack([self.samples, self.samples * middle_times(len(self.samples))]))

    def at(self, frequency: NDArray[np.floating]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Mean of conj(unit line) x samples, and of conj(unit line) x time x samples.

        Parameters
        ----------
        frequency : ndarray, shape (lines,)
            [cycles a sample].

        Returns
        -------
        amplitude, moment : ndarray of complex128, shape (lines,)
            Time counts from the middle of the record, in samples.
        """
        seen = self._seen.means(frequency)
        return seen[0], seen[1]


def sum_of_lines(
    pulses: int, frequency: NDArray[np.floating], amplitudes: NDArray[np.complexfloating]
) -> NDArray[np.complex128]:
    """Samples of a sum of lines, shape (pulses,): the way back from `LineSpace.at`."""
    size, shape = kernel(pulses)
    bins, weight = _turned_taps(frequency, pulses)
    part = (weight.conj() * amplitudes[:, None]).ravel()
    place = bins.ravel()
    grid = np.bincount(place, part.real, size) + 1j * np.bincount(place, part.imag, size)
    return np.asarray(fft.ifft(grid)[:pulses] * (size * shape), np.complex128)


def line_products(
    frequency: NDArray[np.floating], pulses: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean products of unit lines: plain, with time, with time squared, each of shape (lines, lines).

    With D the Dirichlet kernel of the frequencies' difference: D, D' / 2 pi and -D'' / 4 pi^2. The second is the mean
    of conj(line k) x time x line l without its factor -j; it is antisymmetric.
    """
    (top_rows, top_sines, top_cosines), (low_rows, low_sines, low_cosines) = (
        _of_differences(angle) for angle in (np.pi * pulses * frequency, np.pi * frequency)
    )
    top_sines /= pulses
    top_cosines /= 2
    count = len(frequency)
    plain, first, second = np.empty((3, count, count))
    for begin in range(0, count, rows := max(1, PRODUCTS_AT_ONCE // max(count, 1))):
        some = slice(begin, begin + rows)
        low_sine, low_cosine = low_rows[some] @ low_sines, low_rows[some] @ low_cosines
        near = np.nonzero(np.abs(low_sine) < 1e-5 / pulses)  # hardly more than each line and itself
        low_sine[near] = 1.0
        over = np.divide(1, low_sine, out=low_sine)
        ratio = np.multiply(low_cosine, over, out=low_cosine)
        own = np.matmul(top_rows[some], top_sines, out=plain[some])
        own *= over
        # lines whole PRFs apart are one, but for a sign: -1 at odd PRFs where time counts from between two pulses
        turns = np.rint(frequency[some][near[0]] - frequency[near[1]])
        sign = 1.0 - 2.0 * (np.abs(turns) % 2) * (pulses % 2 == 0)
        own[near] = sign
        timed = np.matmul(top_rows[some], top_cosines, out=first[some])
        timed *= over
        timed_twice = np.multiply(own, 0.5, out=second[some])
        timed -= np.multiply(timed_twice, ratio, out=over)
        timed[near] = 0.0
        timed_twice *= (pulses**2 - 1) / 2
        timed_twice += np.multiply(ratio, timed, out=ratio)
        timed_twice[near] = sign * ((pulses**2 - 1) / 12)
    return plain, first, second


def _of_differences(
    angle: NDArray[np.floating],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Rows, and columns that give with them the sines, and the cosines, of the differences, column less row."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.stack([cosine, sine], axis=1), np.stack([sine, -cosine]), np.stack([cosine, sine])
