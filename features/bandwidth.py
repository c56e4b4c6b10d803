"""Doppler bandwidth: where the spectrum ends on either side (the paper's eq. 26)."""

import numpy as np
from numpy.typing import NDArray

from .spectrum import Spectrum

#: Share of the residual energy left out on each side of the energy band.
TAIL_SHARE = 0.025

#: Bins summed together before the energy is followed bin by bin, where it matters.
_BLOCK = 32


def noise_threshold_db(bins: int, false_alarm: float = 1e-2) -> float:
    """Level that noise alone exceeds in any of so many bins with that probability [dB over the floor]."""
    return float(10 * np.log10(np.log(bins / false_alarm)))


def threshold_band_hz(
    spectrum: Spectrum, threshold_db: float | None = None, mask: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lowest and highest frequency over a threshold: the paper's bandwidth rule.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    threshold_db : float, optional
        Threshold over the noise floor [dB]; the paper takes 30 (simulated) and 20 (measured) over the mean amplitude at
        8-10 kHz. By default the level that noise alone exceeds in 1 % of the spectra.
    mask : ndarray of bool, shape (..., bins), optional
        True where the spectrum counts, as from `notch_mask`; by default everywhere.

    Returns
    -------
    low_hz, high_hz : ndarray of float32, shape (...)
        [Hz]; both 0 where nothing exceeds the threshold. The bandwidth is their difference.
    """
    if threshold_db is None:
        threshold_db = noise_threshold_db(spectrum.bins)
    over = spectrum.relative_power > np.float32(10 ** (threshold_db / 10))
    if mask is not None:
        over &= mask
    any_over = over.any(axis=-1)
    frequency = spectrum.frequency_hz
    low = frequency[over.argmax(axis=-1)]
    high = frequency[spectrum.bins - 1 - over[..., ::-1].argmax(axis=-1)]
    zero = np.float32(0)
    return (
        np.where(any_over, low, zero).astype(np.float32),
        np.where(any_over, high, zero).astype(np.float32),
    )


def energy_band_mps(
    spectrum: Spectrum, energy: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Velocities between which all but the tails of the residual energy lies, and the share of bins that carry it.

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
    starts = np.arange(0, bins, _BLOCK)
    total = np.cumsum(np.add.reduceat(flat, starts, axis=-1), axis=-1, dtype=np.float64)
    sums = total[:, -1]
    first, last = _crossings(flat, total, np.array([[TAIL_SHARE], [1 - TAIL_SHARE]]) * sums)
    position = np.arange(bins, dtype=np.int32)
    within = (position >= first[:, None].astype(np.int32)) & (position <= last[:, None].astype(np.int32))
    within &= flat > 0
    lead = energy.shape[:-1]
    inside, some = np.count_nonzero(within, axis=-1).reshape(lead), (sums > 0).reshape(lead)
    first, last = first.reshape(lead), last.reshape(lead)
    velocity, zero = spectrum.velocity_mps, np.float32(0)
    return (
        np.where(some, velocity[last], zero).astype(np.float32),
        np.where(some, velocity[first], zero).astype(np.float32),
        np.where(some, inside / (last - first + 1), zero).astype(np.float32),
    )


def _crossings(
    energy: NDArray[np.float32], total: NDArray[np.float64], levels: NDArray[np.float64]
) -> NDArray[np.intp]:
    """First bin up to which the energy adds up to each level.

    Parameters
    ----------
    energy : ndarray of float32, shape (records, bins)
        Energy of each bin.
    total : ndarray of float64, shape (records, blocks)
        Energy up to the end of each block of `_BLOCK` bins.
    levels : ndarray of float64, shape (levels, records)
        At most the energy of all.

    Returns
    -------
    ndarray of int, shape (levels, records)
    """
    rows, bins = np.arange(len(energy)), energy.shape[1]
    block = np.minimum(np.count_nonzero(total < levels[..., None], axis=-1), total.shape[1] - 1)
    inside = np.minimum(block[..., None] * _BLOCK + np.arange(_BLOCK), bins - 1)
    upto = np.cumsum(energy[rows[:, None], inside], axis=-1, dtype=np.float64)
    upto += np.where(block > 0, total[rows, block - 1], 0.0)[..., None]
    return np.minimum(block * _BLOCK + np.count_nonzero(upto < levels[..., None], axis=-1), bins - 1)
