"""Doppler bandwidth: where the spectrum ends on either side (the paper's eq. 26)."""

import numpy as np
from numpy.typing import NDArray

from .spectrum import Spectrum

#: Share of the residual energy left out on each side of the energy band.
TAIL_SHARE = 0.025


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
    total = np.cumsum(energy, axis=-1, dtype=np.float64)
    sums = total[..., -1:]
    before, within = total < TAIL_SHARE * sums, total < (1 - TAIL_SHARE) * sums
    first = np.count_nonzero(before, axis=-1)
    last = np.minimum(np.count_nonzero(within, axis=-1), spectrum.bins - 1)
    velocity = spectrum.velocity_mps
    some = sums[..., 0] > 0
    zero = np.float32(0)
    within &= ~before
    within &= energy > 0
    inside = np.count_nonzero(within, axis=-1) + 1  # the last bin of the band holds energy, but is not before its end
    return (
        np.where(some, velocity[last], zero).astype(np.float32),
        np.where(some, velocity[np.minimum(first, spectrum.bins - 1)], zero).astype(np.float32),
        np.where(some, inside / (last - first + 1), zero).astype(np.float32),
    )
