"""Records of a single real channel: their spectrum has mirror sides, so lines to both sides of a body overlap."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .dropouts import silent
from .spectrum import doppler_spectrum

#: EMPTY_SHARE: a side of the spectrum is empty where all of it is below this share of the other side's noise. ENDS: one
#: bin in this many (at least 4 bins) does not count at either end of a side.
EMPTY_SHARE, ENDS = 1e-2, 50

#: Pulses from which is judged whether there is noise, at most.
NOISE_PULSES = 65_536


def one_channel(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """True where only one of I and Q varies, or both and I is Q or -Q in every pulse: of (..., pulses), shape (...).

    They are compared to the bit, because two equal blades at rest without any noise are also a straight line in I and
    Q, of any direction. A channel without a signal is 0, or its converter's offset.
    """
    real, imaginary = iq.real, iq.imag
    alike = (real == imaginary).all(axis=-1) | (real == -imaginary).all(axis=-1)
    one, other = varies(real), varies(imaginary)
    return np.asarray(np.where(alike, one, one != other), np.bool_)


def varies(part: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether I or Q differs from its first value in any pulse, of (..., pulses), shape (...)."""
    return np.asarray((part != part[..., :1]).any(axis=-1), np.bool_)


def made_analytic(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Make records of one channel analytic, so that one side of their spectrum is empty; all others stay: same shape.

    Silences stay silent. A record without any noise stays as it is, because it was never recorded: a calculation of two
    equal blades at rest gives such a record, which is complete without Q.
    """
    first, last = iq[..., 0], iq[..., -1]
    # for few records more than these two pulses must be looked at
    one = np.asarray((np.abs(first.real) == np.abs(first.imag)) | (first.real == last.real) | (first.imag == last.imag))
    if np.count_nonzero(one):
        one[one] = one_channel(iq[one])
    if np.count_nonzero(one):
        # whether there is noise does not depend on the carrier and the PRF
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
    """Quadrature of a channel: each of its lines a quarter of a turn behind; shape (..., pulses), same shape.

    It is made from the cosine transform, which continues the channel by its mirror image. So there is no jump from the
    end to the beginning, whose error would spread over the whole record.
    """
    cosines = fft.dct(channel.astype(np.float64), type=2)  # float64, because its sums may leave float32
    sines = np.roll(cosines, -1, axis=-1)  # sines count from order 1, cosines from order 0
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
        True where all of one side, but for its ends, is below `EMPTY_SHARE` times the lower quartile of the other
        side's bins. That quartile is noise even where all lines of a fast body are on that side.
    """
    bins = relative_power.shape[-1]
    middle, end = bins // 2, max(bins // ENDS, 4)
    if middle <= 2 * end:
        return np.zeros(relative_power.shape[:-1], bool)
    sides = relative_power[..., end : middle - end], relative_power[..., middle + end : bins - end]
    noise = np.max([np.quantile(side, 0.25, axis=-1) for side in sides], axis=0)
    return np.asarray(np.min([side.max(axis=-1) for side in sides], axis=0) < EMPTY_SHARE * noise)
