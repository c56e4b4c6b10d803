"""Removal of the body line and the static background: a projection that leaves everything else as it was.

A window with side lobes as low as the spectrum's doubles the noise bandwidth. To measure lines at the Cramer-Rao bound
the samples must stay unwindowed. Strong slow lines are therefore projected out first, with the Slepian sequences that
span all signals of a narrow band.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import TAP, TAPS, kernel, line_products, middle_times, taps

#: Sequences beyond the time-bandwidth product: what they leave of the band's signals is below -100 dB.
EXTRA_SEQUENCES = 11

#: Eigenvalues of the Gram matrix of several bands' sequences below this share of the largest count as zero.
LEAST_SHARE = 1e-9

#: Table values computed at a time: intermediate arrays stay small, whatever the dwell.
_AT_ONCE = 1 << 22


def times(matrix: NDArray[np.float64], columns: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
    """Real matrix times complex columns; numpy would turn the matrix into a complex one each time."""
    return whole(matrix @ parts(columns)).reshape(len(matrix), *columns.shape[1:])


def parts(columns: NDArray[np.complexfloating]) -> NDArray[np.float64]:
    """Real and imaginary parts as columns of their own."""
    return np.ascontiguousarray(columns).view(np.float64).reshape(len(columns), -1)


def whole(both: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Complex columns from their `parts`, shape (rows, columns)."""
    return np.ascontiguousarray(both).view(np.complex128)


@lru_cache(maxsize=4)
def slepian(pulses: int, half_bins: float) -> NDArray[np.float64]:
    """Orthonormal sequences that span the signals within `half_bins` of frequency 0, shape (sequences, pulses).

    The best concentrated come first. They are even and odd about the middle in turn, so that one half of each is
    computed, in a quarter of the time.

    Parameters
    ----------
    pulses : int
        Pulses of the dwell, at least 2.
    half_bins : float
        Half width of the band [bins of PRF / pulses], > 0.
    """
    from scipy.linalg import eigh_tridiagonal

    count, half = min(pulses, int(np.ceil(2 * half_bins)) + EXTRA_SEQUENCES), pulses // 2
    n = np.arange(half + 1)
    diagonal = ((pulses - 1 - 2 * n) / 2) ** 2 * np.cos(2 * np.pi * half_bins / pulses)
    off = n[1:] * (pulses - n[1:]) / 2  # the last couples both halves, or the first half to the middle pulse
    out = np.zeros((count, pulses))
    for odd in (False, True):
        own = out[int(odd) :: 2]
        length = half + (pulses % 2 and not odd)
        main, beside = diagonal[:length].copy(), off[: length - 1].copy()
        if pulses % 2 == 0:
            main[-1] += -off[-1] if odd else off[-1]
        elif not odd:
            beside[-1] *= np.sqrt(2)
        _, vectors = eigh_tridiagonal(main, beside, select="i", select_range=(length - len(own), length - 1))
        rows = vectors.T[::-1]
        own[:, :half] = rows[:, :half] / np.sqrt(2)
        own[:, pulses - half :] = own[:, half - 1 :: -1] * (-1 if odd else 1)
        if length > half:
            own[:, half] = rows[:, half]
    out.setflags(write=False)
    return out


def remove_bands(samples: NDArray[np.complex128], bands: Iterable[tuple[float, float]]) -> NDArray[np.complex128]:
    """Take narrow bands out of records.

    Parameters
    ----------
    samples : ndarray of complex128, shape (..., pulses)
        One record or several.
    bands : iterable of (float, float)
        Centre [cycles a sample] and half width [bins] of each band.

    Returns
    -------
    ndarray of complex128, same shape
        What is left. A line 8 bins off a band loses a tenth of its power, one 30 bins off 2 %, most at the ends.
    """
    bands = tuple(bands)
    pulses = samples.shape[-1]
    out = samples.reshape(-1, pulses).T
    turns = [_turn(pulses, centre)[:, None] for centre, _ in bands]
    bases = [slepian(pulses, float(half)) for _, half in bands]
    seen = [times(basis, out * turn.conj()) for basis, turn in zip(bases, turns, strict=True)]
    if len(bands) > 1:
        # jointly: one after the other, what the first band took of the second's strong line would remain
        factor = np.concatenate([np.where(_odd(basis), 1j, 1) for basis in bases])[:, None]
        together = factor * times(_gram_inverse(pulses, bands), factor.conj() * np.concatenate(seen))
        seen = np.split(together, np.cumsum([len(basis) for basis in bases])[:-1])
    for amplitudes, basis, turn in zip(seen, bases, turns, strict=True):
        out = out - turn * times(basis.T, amplitudes)
    return np.asarray(out.T.reshape(samples.shape), np.complex128)


@lru_cache(maxsize=4)
def band_basis(pulses: int, bands: tuple[tuple[float, float], ...]) -> NDArray[np.complex128]:
    """Orthonormal sequences that span what `remove_bands` takes out of a record, shape (sequences, pulses)."""
    rows = [slepian(pulses, float(half)) * _turn(pulses, centre) for centre, half in bands]
    out = np.concatenate([np.zeros((0, pulses), np.complex128), *rows])
    if len(rows) > 1:  # without the directions that overlapping bands hold twice
        value, vector = np.linalg.eigh(out @ out.conj().T)
        kept = value > LEAST_SHARE * value[-1]
        out = (vector[:, kept].conj().T / np.sqrt(value[kept])[:, None]) @ out
    out.setflags(write=False)
    return out


@lru_cache(maxsize=4)
def _turn(pulses: int, frequency: float) -> NDArray[np.complex128]:
    """The unit line of a frequency [cycles a sample], time from the middle of the record."""
    out = np.exp(2j * np.pi * frequency * middle_times(pulses))
    out.setflags(write=False)
    return out


def _odd(basis: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True for the sequences of `slepian` that are odd about the middle."""
    return np.arange(len(basis)) % 2 == 1


@lru_cache(maxsize=2)
def _held(pulses: int, half_bins: float) -> NDArray[np.float32]:
    """Projections of unit lines, and of unit lines times time, onto the sequences, made real for even and odd ones.

    Shape (bins, 2, sequences): the bins of `lines.kernel` from -1/2 to 1/2 and a few more, to be interpolated by it.
    """
    size, shape = kernel(pulses)
    place = np.arange(-(size // 2) - TAPS, size // 2 + TAPS)
    basis = slepian(pulses, half_bins)
    time = middle_times(pulses)
    turn = (np.exp(1j * np.pi * (pulses - 1) / size * place) / np.sqrt(pulses)).astype(np.complex64)
    out = np.empty((len(place), 2, len(basis)), np.float32)
    step = max(1, _AT_ONCE // size)
    for first in range(0, len(basis), step):
        some = basis[first : first + step] * shape
        odd = _odd(basis)[first : first + step, None]
        plain, timed = (fft.fft(v.astype(np.complex64), size)[:, place % size] * turn for v in (some, some * time))
        out[:, 0, first : first + step] = np.where(odd, -plain.imag, plain.real).T
        out[:, 1, first : first + step] = np.where(odd, timed.real, timed.imag).T
    out.setflags(write=False)
    return out


@dataclass(frozen=True)
class LineProducts:
    """Mean products of unit lines after removal of narrow bands.

    A line some bins off a band loses a little, most at the ends of the record. The fit of lines to what is left must
    know that, or it takes the loss for a change of frequency.

    Parameters
    ----------
    plain, first, second : ndarray, shape (lines, lines)
        As from `lines.line_products`: `plain` of the lines after removal, the other two of the whole lines.
    held, held_timed : ndarray, shape (lines, sequences)
        Projections of each line, and of each line times time, onto the bands' sequences.
    joint, joint_timed : ndarray, same shape
        The same times the inverse Gram matrix of all sequences: the share of each where bands overlap.
    """

    plain: NDArray[np.float64]
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    held: NDArray[np.floating]
    held_timed: NDArray[np.floating]
    joint: NDArray[np.floating]
    joint_timed: NDArray[np.floating]

    # what the bands take from `first` and `second` is of low rank: it is subtracted column by column

    def with_time(self, columns: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
        """Products of each line with sums of lines times time, of these amplitudes, shape (lines, columns)."""
        both = parts(columns)
        return whole(self.first @ both - self.joint @ (self.held_timed.T @ both))

    def time_with(self, columns: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
        """Products of each line times time with sums of plain lines of these amplitudes."""
        both = parts(columns)
        return whole(-(self.first @ both) - self.held_timed @ (self.joint.T @ both))

    def with_time_squared(self, columns: NDArray[np.complexfloating]) -> NDArray[np.complex128]:
        """Products of each line times time with sums of lines times time, of these amplitudes."""
        both = parts(columns)
        return whole(self.second @ both - self.joint_timed @ (self.held_timed.T @ both))


def notched_products(
    frequency: NDArray[np.floating], pulses: int, bands: tuple[tuple[float, float], ...]
) -> LineProducts:
    """Mean products of unit lines after `remove_bands`.

    Parameters
    ----------
    frequency : ndarray, shape (lines,)
        [cycles a sample].
    pulses : int
        Pulses of the record.
    bands : tuple of (float, float)
        Centre [cycles a sample] and half width [bins] of each band.
    """
    products, (size, _) = line_products(frequency, pulses), kernel(pulses)
    plains: list[NDArray[np.floating]] = [np.zeros((len(frequency), 0), np.float32)]
    timeds = plains.copy()
    for centre, half in bands:
        table = _held(pulses, float(half))
        away = frequency - centre
        turns = np.rint(away)
        first, weights = taps((away - turns) * size)
        # time counts from the middle of the record: of an even number of pulses, a whole turn changes the sign
        weights *= (1 - 2 * (turns % 2) * (pulses % 2 == 0))[:, None]
        about = table.take(first[:, None] + (TAP + len(table) // 2), axis=0).reshape(*weights.shape, -1)
        held = (weights[:, None, :] @ about).reshape(-1, *table.shape[1:])
        plains.append(held[:, 0])
        timeds.append(held[:, 1])
    plain, timed = np.concatenate(plains, axis=1), np.concatenate(timeds, axis=1)
    both: tuple[NDArray[np.floating], NDArray[np.floating]] = plain, timed
    if len(bands) > 1:
        inverse = _gram_inverse(pulses, bands)
        both = plain @ inverse, timed @ inverse
    left = products[0]
    left -= both[0] @ plain.T
    return LineProducts(*products, plain, timed, *both)


@lru_cache(maxsize=4)
def _gram_inverse(pulses: int, bands: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """Pseudo-inverse of the Gram matrix of all bands' sequences; odd ones are taken times j, which makes it real."""
    bases = [slepian(pulses, half) for _, half in bands]
    ends = np.cumsum([0, *map(len, bases)])
    gram = np.eye(ends[-1])
    for one, two in combinations(range(len(bands)), 2):
        block = gram[ends[one] : ends[one + 1], ends[two] : ends[two + 1]]
        turn = _turn(pulses, bands[two][0] - bands[one][0])
        even, uneven = turn.real.copy(), turn.imag.copy()
        for odd in (0, 1):
            own = bases[two][odd::2].T
            block[odd::2, odd::2] = (bases[one][odd::2] * even) @ own
            block[1 - odd :: 2, odd::2] = (bases[one][1 - odd :: 2] * (uneven if odd == 0 else -uneven)) @ own
        gram[ends[two] : ends[two + 1], ends[one] : ends[one + 1]] = block.T
    return np.asarray(np.linalg.pinv(gram, rcond=LEAST_SHARE, hermitian=True), np.float64)
