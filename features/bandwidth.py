"""Doppler bandwidth: where the spectrum ends on either side (the paper's eq. 26)."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .fast import ones, sums
from .spectrum import Spectrum

#: Share of the residual energy left out on each side of the energy band.
TAIL_SHARE = 0.025

#: False-alarm rate: share of the spectra in which noise alone exceeds the threshold.
FALSE_ALARM = 1e-2

#: Bins of a block: energy is added up block by block, and bin by bin only in the block that crosses a level.
_BLOCK = 32
_WITHIN_BLOCK = np.arange(_BLOCK)

_TAILS = np.array([[TAIL_SHARE], [1 - TAIL_SHARE]])


@lru_cache(maxsize=64)
def noise_threshold_db(bins: int) -> float:
    """Level that noise alone exceeds in any of `bins` bins with probability `FALSE_ALARM` [dB over the floor]."""
    return float(10 * np.log10(np.log(bins / FALSE_ALARM)))


def threshold_band_hz(
    spectrum: Spectrum, threshold_db: float, mask: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lowest and highest frequency over a threshold: the paper's bandwidth rule.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    threshold_db : float
        Threshold over the noise floor [dB]. The paper takes 30 (simulated) and 20 (measured) over the mean amplitude at
        8-10 kHz; noise alone seldom exceeds `noise_threshold_db`.
    mask : ndarray of bool, shape (..., bins), optional
        True where the spectrum counts, as from `notch_mask`; by default everywhere.

    Returns
    -------
    low_hz, high_hz : ndarray of float32, shape (...)
        [Hz]; both 0 where nothing exceeds the threshold. The bandwidth is their difference.
    """
    over = spectrum.relative_power > np.float32(10 ** (threshold_db / 10))
    if mask is not None:
        over &= mask
    some = np.logical_or.reduce(over, axis=-1)
    frequency = spectrum.frequency_hz_float32
    low = frequency[over.argmax(axis=-1)]
    high = frequency[spectrum.bins - 1 - over[..., ::-1].argmax(axis=-1)]
    return low * some, high * some


def energy_band_mps(
    spectrum: Spectrum, energy: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Velocities between which all residual energy but its tails lies, and the share of bins there that hold any.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    energy : ndarray of float32, shape (..., bins)
        Significant energy of each bin, >= 0.

    Returns
    -------
    low_mps, high_mps : ndarray of float32, shape (...)
        Band edges [m/s], low <= high; 0 where there is no energy.
    occupancy : ndarray of float32, shape (...)
        Share of the bins within the band that hold energy, 0..1.
    """
    bins = spectrum.bins
    flat = energy.reshape(-1, bins)
    total = _upto(_block_sums(flat))
    edges = _crossings(flat, total, _TAILS * total[:, -1])
    some = total[:, -1] > 0
    slow, fast = (spectrum.velocity_mps[edges] * some).astype(np.float32)
    first, after = edges[0], edges[1] + 1
    spans = zip(flat > 0, first.tolist(), after.tolist(), strict=True)
    held = np.array([np.count_nonzero(row[begin:end]) for row, begin, end in spans])
    share = held / (after - first) * some
    lead = energy.shape[:-1]
    return fast.reshape(lead), slow.reshape(lead), share.astype(np.float32).reshape(lead)


def _block_sums(energy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Energy of each block of `_BLOCK` bins, shape (records, blocks); the last one may be shorter."""
    records, bins = energy.shape
    whole = bins - bins % _BLOCK
    out = np.empty((records, -(-bins // _BLOCK)), np.float32)
    blocks = energy[:, :whole].reshape(records, whole // _BLOCK, _BLOCK)
    np.matmul(blocks, ones(_BLOCK), out=out[:, : whole // _BLOCK])
    if whole < bins:
        out[:, -1] = sums(energy[:, whole:])
    return out


def _upto(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """Running sums, each with its own value."""
    return np.add.accumulate(values, axis=-1, dtype=np.float64)


def _crossings(
    energy: NDArray[np.float32], total: NDArray[np.float64], levels: NDArray[np.float64]
) -> NDArray[np.intp]:
    """First bin at which the running sum of the energy reaches each level.

    Parameters
    ----------
    energy : ndarray of float32, shape (records, bins)
        Energy of each bin.
    total : ndarray of float64, shape (records, blocks)
        Energy up to the end of each block of `_BLOCK` bins.
    levels : ndarray of float64, shape (levels, records)
        At most the total energy.

    Returns
    -------
    ndarray of int, shape (levels, records)
    """
    rows, (records, bins) = np.arange(len(energy)), energy.shape
    before = np.zeros((records, total.shape[1] + 1))
    before[:, 1:] = total
    block = np.minimum((total >= levels[..., None]).argmax(axis=-1), total.shape[1] - 1)
    inside = np.minimum(block[..., None] * _BLOCK + _WITHIN_BLOCK, bins - 1)
    upto = _upto(energy[rows[:, None], inside])
    upto += before[rows, block][..., None]
    # rounding alone may leave the whole block short of its level
    upto[..., -1] = np.inf
    return np.minimum(inside[..., 0] + (upto >= levels[..., None]).argmax(axis=-1), bins - 1)
