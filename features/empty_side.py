"""An empty side of the spectrum, filled with noise: one channel made analytic tells nothing of it.

No radar of two channels ever sees such a side, and models know their records far better. With noise there the record is
one of theirs, whose lines lie on one side (what that brings: docs/ablation.md).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .fast import LOWEST_DB
from .spectrum import Spectrum

#: A side whose floor lies so far below the other's has no level that is followed.
EMPTY_SHARE = np.float32(10 ** (LOWEST_DB / 10))

#: Of the noise, which is the same for all records of so many pulses.
_SEED = 20

_NONE = np.empty(0, np.intp)


@lru_cache(maxsize=32)
def noise_transform(pulses: int, seed: int) -> NDArray[np.complex128]:
    """The transform of white noise of unit power a sample, the same for all records of so many pulses, read-only."""
    out = np.random.default_rng((seed, pulses)).standard_normal((pulses, 2)).view(np.complex128)[:, 0]
    out *= np.sqrt(pulses / 2)
    out.flags.writeable = False
    return out


@lru_cache(maxsize=16)
def side_noise(pulses: int) -> NDArray[np.complex64]:
    """Noise on the lower and on the upper side of the spectrum, mirror images, shape (2, pulses).

    As dense there as white noise of unit power a sample.
    """
    transform = np.where(fft.fftfreq(pulses) > 0, noise_transform(pulses, _SEED), 0)
    upper = fft.ifft(transform).astype(np.complex64)
    out = np.stack([upper.conj(), upper])
    out.flags.writeable = False
    return out


def empty_sides(spectrum: Spectrum) -> NDArray[np.bool_]:
    """Whether the lower and the upper side are empty beside the noise of the other, shape (..., 2)."""
    sides = spectrum.side_floors
    return np.asarray(sides < EMPTY_SHARE * sides[..., ::-1], np.bool_)


def filled_sides(iq: NDArray[np.complex64], spectrum: Spectrum) -> tuple[NDArray[np.intp], NDArray[np.complex64]]:
    """Records with an empty side, and these with noise there as strong as the other side's.

    Where both sides hold nothing but lines without any noise, as only a calculation gives them, none is empty.

    Parameters
    ----------
    iq : ndarray of complex64, shape (records, pulses)
        Slow-time samples.
    spectrum : Spectrum
        Of these.

    Returns
    -------
    rows : ndarray of int, shape (filled,)
        Which of the records.
    samples : ndarray of complex64, shape (filled, pulses)
        Theirs.
    """
    empty = empty_sides(spectrum)
    if not np.count_nonzero(empty):  # as most are
        return _NONE, iq[:0]
    empty &= spectrum.noise_shows[:, None]
    rows = np.flatnonzero(empty[:, 0] | empty[:, 1])
    if not len(rows):
        return rows, iq[:0]
    # float64, because the square of a sample may leave float32
    amplitude = np.sqrt(spectrum.floor[rows])[:, None]
    most = np.finfo(np.float32).max
    # of noise one side is empty at most: no product of matrices, for which a busy machine's threads wait
    filled = iq[rows] + amplitude * side_noise(spectrum.pulses)[empty[rows, 1].astype(np.intp)]
    return rows, filled.view(np.float64).clip(-most, most).astype(np.float32).view(np.complex64)
