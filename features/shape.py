"""Plain numbers about the shape of a spectrum: level by velocity, entropy, peakedness, symmetry."""

import numpy as np
from numpy.typing import NDArray

from .notch import Body, Mask, weights
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
    widths = np.diff(edges).astype(np.float32)
    one, other = (
        np.add.reduceat(side[..., : edges[-1]], edges[:-1], axis=-1) / widths for side in (axis_db, axis_db[..., ::-1])
    )
    return np.maximum(one, other), np.minimum(one, other)


def entropy(energy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Entropy of the energy's distribution over the bins, 0 (one bin) to 1 (even), shape (...); 1 without energy."""
    peak = energy.max(axis=-1, keepdims=True)
    share = energy / np.where(peak > 0, peak, np.float32(1))
    logs = np.maximum(share, np.float32(1e-12))
    np.log(logs, out=logs)
    total = np.add.reduce(share, axis=-1)
    safe = np.where(total > 0, total, np.float32(1))
    # the mean of -log(share / total)
    bits = (np.log(safe) - np.vecdot(share, logs) / safe) / np.float32(np.log(energy.shape[-1]))
    return np.where(total > 0, np.minimum(np.maximum(bits, 0), 1), np.float32(1)).astype(np.float32)


def ripple_db(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Standard deviation of the level outside the notches [dB]: 5.6 for noise, more for lines, shape (...)."""
    kept = weights(mask)
    count = np.maximum(np.add.reduce(kept, axis=-1), np.float32(1))
    level = spectrum.level_db * kept
    mean = np.add.reduce(level, axis=-1) / count
    square = np.vecdot(level, level) / count
    return np.sqrt(np.maximum(square - mean**2, 0)).astype(np.float32)


def symmetry(spectrum: Spectrum, energy: NDArray[np.float32], body: Body) -> NDArray[np.float32]:
    """Correlation of the two sides about the body line, -1..1, shape (...): rotors spread to both sides alike."""
    bins = spectrum.bins
    reach = bins // 2 - 1
    twice = np.empty((body.index.size, 2 * bins), np.float32)  # the circle, cut open anywhere
    root = np.sqrt(energy.reshape(-1, bins), out=twice[:, :bins])
    np.sqrt(root, out=root)
    twice[:, bins:] = root
    windows = np.lib.stride_tricks.as_strided(
        twice, (len(twice), 2 * bins - reach, reach), (twice.strides[0], *2 * twice.strides[1:]), writeable=False
    )
    rows, index = np.arange(len(twice)), body.index.reshape(-1)
    right, left = windows[rows, index + 1], windows[rows, index + bins - reach][:, ::-1]
    right -= np.add.reduce(right, axis=-1, keepdims=True) / np.float32(reach)
    left -= np.add.reduce(left, axis=-1, keepdims=True) / np.float32(reach)
    norm = np.sqrt(np.vecdot(right, right) * np.vecdot(left, left))
    product = np.vecdot(right, left) / np.where(norm > 0, norm, np.float32(1))
    return np.where(norm > 0, product, np.float32(0)).reshape(body.index.shape)
