"""Plain numbers about the shape of a spectrum: level by velocity, entropy, peakedness, symmetry."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .notch import Body
from .spectrum import Spectrum

#: Edges of the speed bands [m/s]: body and bird speeds below, limbs and wing tips between, blade tips above.
SPEED_BANDS_MPS = (0.0, 0.8, 2.5, 6.0, 12.0, 22.0, 40.0, 70.0, 110.0, 200.0)


def band_levels_db(
    axis_db: NDArray[np.float32], axis_mps: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean level of each speed band, on the stronger and on the weaker side [dB], shape (..., bands) each.

    How lopsided a target is may say something about its class; which side is the stronger does not.

    Parameters
    ----------
    axis_db : ndarray, shape (..., axis bins)
        Level on the shared velocity axis.
    axis_mps : ndarray, shape (axis bins,)
        Its velocities [m/s], rising and symmetric about 0.

    Returns
    -------
    stronger, weaker : ndarray of float32, shape (..., bands)
        [dB over the floor]; a band wholly outside the unambiguous span holds the axis's own mark for "unseen".
    """
    edges = np.searchsorted(axis_mps, SPEED_BANDS_MPS)
    bands = [slice(a, b) for a, b in pairwise(edges)]
    one = np.stack([axis_db[..., band].mean(axis=-1) for band in bands], axis=-1)
    other = np.stack([axis_db[..., ::-1][..., band].mean(axis=-1) for band in bands], axis=-1)
    return np.maximum(one, other), np.minimum(one, other)


def entropy(energy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Entropy of the energy's distribution over the bins, 0 (one bin) to 1 (even), shape (...); 1 without energy."""
    total = energy.sum(axis=-1, keepdims=True)
    share = energy / np.where(total > 0, total, 1)
    bits = -(share * np.log(np.maximum(share, np.float32(1e-12)))).sum(axis=-1) / np.log(energy.shape[-1])
    return np.where(total[..., 0] > 0, bits, np.float32(1)).astype(np.float32)


def ripple_db(spectrum: Spectrum, mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Standard deviation of the level outside the notches [dB]: 5.6 for noise, more for lines, shape (...)."""
    count = np.maximum(mask.sum(axis=-1), 1)
    level = np.where(mask, spectrum.level_db, np.float32(0))
    mean = level.sum(axis=-1) / count
    square = (level * level).sum(axis=-1) / count
    return np.sqrt(np.maximum(square - mean**2, 0)).astype(np.float32)


def symmetry(spectrum: Spectrum, energy: NDArray[np.float32], body: Body) -> NDArray[np.float32]:
    """Correlation of the two sides about the body line, -1..1, shape (...): rotors spread to both sides alike."""
    bins = spectrum.bins
    reach = np.arange(1, bins // 2)
    root = np.sqrt(np.sqrt(energy))
    right = np.take_along_axis(root, (body.index[..., None] + reach) % bins, axis=-1)
    left = np.take_along_axis(root, (body.index[..., None] - reach) % bins, axis=-1)
    right = right - right.mean(axis=-1, keepdims=True)
    left = left - left.mean(axis=-1, keepdims=True)
    norm = np.sqrt((right**2).sum(axis=-1) * (left**2).sum(axis=-1))
    return np.where(norm > 0, (right * left).sum(axis=-1) / np.where(norm > 0, norm, 1), 0).astype(np.float32)
