"""An empty side of the spectrum, filled with noise: one channel made analytic holds nothing there.

No radar of two channels ever sees an empty side, and models know the records of such radars far better. With noise
there, the record is like one of two channels whose lines lie on one side (what that brings: docs/ablation.md).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .fast import LOWEST_DB
from .spectrum import Spectrum

#: A side whose floor is below this share of the other's is empty: levels are not followed below `LOWEST_DB`.
EMPTY_SHARE = np.float32(10 ** (LOWEST_DB / 10))

#: Seed of the noise, which is the same for all records with the same number of pulses.
_SEED = 20

_NONE = np.empty(0, np.intp)


@lru_cache(maxsize=32)
def noise_transform(pulses: int, seed: int) -> NDArray[np.complex128]:
    """The transform of white noise of unit power a sample, the same for all records of `pulses`, read-only."""
    out = np.random.default_rng((seed, pulses)).standard_normal((pulses, 2)).view(np.complex128)[:, 0]
    out *= np.sqrt(pulses / 2)
    out.flags.writeable = False
    return out


@lru_cache(maxsize=16)
def side_noise(pulses: int) -> NDArray[np.complex64]:
    """Noise on the lower and on the upper side of the spectrum, mirror images, shape (2, pulses).

    Its power density there is that of white noise of unit power a sample.
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
    """Records with an empty side, filled there with noise as strong as the other side's.

    Where the spectrum holds nothing but lines without any noise, as only a calculation gives, no side counts as empty.

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
        The samples of these with the noise.
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
    # at most one side is empty where there is noise: no matrix product is needed, whose threads wait on a busy machine
    filled = iq[rows] + amplitude * side_noise(spectrum.pulses)[empty[rows, 1].astype(np.intp)]
    return rows, filled.view(np.float64).clip(-most, most).astype(np.float32).view(np.complex64)
