"""Plain numbers about the shape of a spectrum: level by velocity, entropy, peakedness, symmetry."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .axis import axis_velocities_mps
from .fast import at_least, sums
from .notch import Body, Mask, weights
from .spectrum import Spectrum

#: Edges of the speed bands [m/s]: body and bird speeds below, limbs and wing tips between, blade tips above.
SPEED_BANDS_MPS = (0.0, 0.8, 2.5, 6.0, 12.0, 22.0, 40.0, 70.0, 110.0, 200.0)


def band_levels_db(
    axis_db: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean level of each speed band, on the stronger and on the weaker side [dB], shape (..., bands) each.

    How lopsided a target is may say something about its class; which side is the stronger does not.

    Parameters
    ----------
    axis_db : ndarray, shape (..., axis bins)
        Level on the shared velocity axis.

    Returns
    -------
    stronger, weaker : ndarray of float32, shape (..., bands)
        [dB over the floor]; a band wholly outside the unambiguous span holds `axis.UNSEEN_DB`.
    """
    both = (band_shares(axis_db.shape[-1]) @ axis_db[..., None])[..., 0]
    count = len(SPEED_BANDS_MPS) - 1
    one, other = both[..., :count], both[..., count:]
    return np.maximum(one, other), np.minimum(one, other)


@lru_cache(maxsize=4)
def band_shares(bins: int) -> NDArray[np.float32]:
    """Share of each bin of the shared axis in the mean of each speed band, first of one side and then of the other."""
    edges = np.searchsorted(axis_velocities_mps(bins), SPEED_BANDS_MPS)
    position = np.arange(bins)
    inside = (position >= edges[:-1, None]) & (position < edges[1:, None])
    shares = inside / np.diff(edges)[:, None]
    return np.concatenate([shares, shares[:, ::-1]]).astype(np.float32)


def entropy(energy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Entropy of the energy's distribution over the bins, 0 (one bin) to 1 (even), shape (...); 1 without energy."""
    logs = at_least(energy, 1e-30)
    np.log(logs, out=logs)
    total = sums(energy)
    some = np.maximum(total, np.float32(1e-30))
    # the mean of -log(share), the share being energy / total
    bits = (np.log(some) - np.vecdot(energy, logs) / some) / np.float32(math.log(energy.shape[-1]))
    return np.minimum(np.maximum(bits, 0) + (total <= 0), np.float32(1))


def ripple_db(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Standard deviation of the level outside the notches [dB]: 5.0 to 5.4 for noise, more for lines, shape (...)."""
    kept = weights(mask)
    share = 1 / np.maximum(sums(kept), np.float32(1))
    level = spectrum.level_db * kept
    mean = sums(level) * share
    return np.sqrt(np.maximum(np.vecdot(level, level) * share - mean * mean, np.float32(0)))


def symmetry(root: NDArray[np.float32], body: Body) -> NDArray[np.float32]:
    """Correlation of the two sides about the body line: rotors spread to both sides alike.

    Parameters
    ----------
    root : ndarray of float32, shape (..., bins)
        Root of the significant energy of each bin, >= 0.
    body : Body
        The body lines, about which the sides are compared.

    Returns
    -------
    ndarray of float32, shape (...)
        -1..1; the square roots of `root` are correlated.
    """
    bins = root.shape[-1]
    reach = bins // 2 - 1
    twice = np.empty((body.index.size, 2 * bins), np.float32)  # the circle of bins twice, so that no side is cut
    np.sqrt(root.reshape(-1, bins), out=twice[:, :bins])
    twice[:, bins:] = twice[:, :bins]
    # both sides of each spectrum, each from the body outwards
    both = np.empty((len(twice), 2, reach), np.float32)
    for row, circle, index in zip(both, twice, body.index.reshape(-1).tolist(), strict=True):
        row[0] = circle[index + 1 : index + 1 + reach]
        row[1] = circle[index + bins - 1 : index + bins - 1 - reach : -1]
    both -= sums(both)[..., None] * np.float32(1 / reach)
    squares, product = np.vecdot(both, both), np.vecdot(both[:, 0], both[:, 1])
    norm = np.sqrt(squares[:, 0] * squares[:, 1])
    return (product / np.maximum(norm, np.float32(1e-30))).reshape(body.index.shape)
