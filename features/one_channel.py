"""Records of a single real channel: both sides of the spectrum are one, and a body's two sides lie in one another."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .dropouts import silent
from .spectrum import doppler_spectrum

#: A side of the spectrum so far below the noise of the other is empty; one bin in so many does not count at either end.
EMPTY_SHARE, ENDS = 1e-2, 50

#: So many pulses tell whether there is noise.
NOISE_PULSES = 65_536


def one_channel(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """True where I or Q is the same in every pulse, or both are but for a sign: of (..., pulses), shape (...).

    To the bit: two equal blades at rest without any noise are a straight line in I and Q as well, of any direction. A
    channel without a signal is 0, or what its converter is off by.
    """
    real, imaginary = iq.real, iq.imag
    alike = (real == imaginary).all(axis=-1) | (real == -imaginary).all(axis=-1)
    one, other = varies(real), varies(imaginary)
    return np.asarray(np.where(alike, one, one != other), np.bool_)


def varies(part: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether I or Q is not the same in every pulse, of (..., pulses), shape (...)."""
    return np.asarray((part != part[..., :1]).any(axis=-1), np.bool_)


def made_analytic(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Records of one channel without the other side of their spectrum, all others as they are: same shape.

    What is silent stays so. What holds no noise at all was never recorded: two equal blades at rest give such a record,
    of which I is all.
    """
    first, last = iq[..., 0], iq[..., -1]
    # few records are looked at further than these two pulses
    one = np.asarray((np.abs(first.real) == np.abs(first.imag)) | (first.real == last.real) | (first.imag == last.imag))
    if np.count_nonzero(one):
        one[one] = one_channel(iq[one])
    if np.count_nonzero(one):
        # whatever the radar is
        one[one] = doppler_spectrum(iq[one, :NOISE_PULSES], carrier_hz=1.0, prf_hz=1.0).noise_shows
    if not np.count_nonzero(one):
        return iq
    made, some = iq.copy(), iq[one]
    channel = np.where(varies(some.real)[:, None], some.real, some.imag)
    quadrature = _quadrature(channel)
    quadrature[np.stack([silent(record) for record in some])] = 0
    made.real[one], made.imag[one] = channel, quadrature
    return made


def _quadrature(channel: NDArray[np.float32]) -> NDArray[np.float32]:
    """What is a quarter of a turn behind every line of a channel, shape (..., pulses), same shape.

    Of its cosine transform, which continues the channel by its mirror image: from the end to the beginning nothing
    jumps, which would spread over all of the record.
    """
    cosines = fft.dct(channel.astype(np.float64), type=2)  # float64, because its sums may leave float32
    sines = np.roll(cosines, -1, axis=-1)  # of 1 cycle up to all of them, where cosines begin at 0
    sines[..., -1] = 0
    most = np.finfo(np.float32).max
    return fft.idst(sines, type=2, overwrite_x=True).clip(-most, most).astype(np.float32)


def half_empty(relative_power: NDArray[np.float32]) -> NDArray[np.bool_]:
    """True where one side of the spectrum holds nothing: one channel, made analytic, has both sides folded onto one.

    Parameters
    ----------
    relative_power : ndarray of float32, shape (..., bins)
        Centred power spectra, any unit.

    Returns
    -------
    ndarray of bool, shape (...)
        All of one side, but for its ends, lies `EMPTY_SHARE` under what three quarters of the other's bins are over:
        noise, also where a fast body's lines are all there.
    """
    bins = relative_power.shape[-1]
    middle, end = bins // 2, max(bins // ENDS, 4)
    if middle <= 2 * end:
        return np.zeros(relative_power.shape[:-1], bool)
    sides = relative_power[..., end : middle - end], relative_power[..., middle + end : bins - end]
    noise = np.max([np.quantile(side, 0.25, axis=-1) for side in sides], axis=0)
    return np.asarray(np.min([side.max(axis=-1) for side in sides], axis=0) < EMPTY_SHARE * noise)
