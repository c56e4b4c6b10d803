"""Smearing index: how fast the comb's lines widen with their order, which unlike rotor rates make them do."""

import numpy as np
from numpy.typing import NDArray

from .chopping import Chopping
from .notch import Body
from .spectrum import Spectrum

#: The index of lines that fill the space between orders evenly: the standard deviation of a uniform order, 1/sqrt(12).
FULLY_SMEARED = 0.2887

#: Orders that take part: far ones of a weak comb are noise.
MAX_ORDER = 24


def smearing_index(
    spectrum: Spectrum, energy: NDArray[np.float32], body: Body, chopping: Chopping
) -> NDArray[np.float32]:
    """Relative spread of the rotor rates, from the growth of the line width with the order.

    Rotors of rates spread by a relative standard deviation s put line l at l f0 with a standard deviation of l s f0.
    Every bin's energy is assigned to its nearest order; its squared distance to it, in orders, is regressed on the
    squared order. The slope is s squared.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    energy : ndarray of float32, shape (..., bins)
        Significant energy of each bin, >= 0.
    body : Body
        The comb's centre.
    chopping : Chopping
        The comb's spacing.

    Returns
    -------
    ndarray of float32, shape (...)
        0 (one rate, narrow lines at all orders) to `FULLY_SMEARED`; NaN where no spacing or no energy is given.
    """
    spacing = chopping.frequency_hz[..., None]
    usable = np.isfinite(spacing)
    centre = -2 * body.velocity_mps[..., None] / np.float32(spectrum.wavelength_m)
    order = spectrum.frequency_hz.astype(np.float32) - centre
    order /= np.where(usable, spacing, np.float32(1))
    nearest = np.rint(order)
    # Roots of the energy: one strong low line must not outvote the many weak high ones.
    order -= nearest
    x, y = np.square(nearest, out=nearest), np.square(order, out=order)
    weight = np.sqrt(energy)
    weight *= x <= MAX_ORDER**2
    weight *= x > 0
    total = np.add.reduce(weight, axis=-1)
    safe = np.where(total > 0, total, 1)
    # Centred first: where few orders hold energy the differences of mean squares are rounding alone.
    x -= (np.vecdot(weight, x) / safe)[..., None]
    weight *= x
    variance, covariance = np.vecdot(weight, x) / safe, np.vecdot(weight, y) / safe
    slope = covariance / np.where(variance > 1e-3, variance, np.inf)
    index = np.sqrt(np.clip(slope, 0, FULLY_SMEARED**2))
    return np.where((total > 0) & usable[..., 0], index, np.float32(np.nan)).astype(np.float32)
