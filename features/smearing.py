"""Smearing index: how fast the comb's lines widen with their order, as they do where rotor rates differ."""

import numpy as np
from numpy.typing import NDArray

from .chopping import Chopping
from .fast import sums
from .notch import Body, weights
from .spectrum import Spectrum

#: The index of lines that fill the space between orders evenly: the standard deviation of a uniform order, 1/sqrt(12).
FULLY_SMEARED = 0.2887

#: Highest order that takes part: higher ones of a weak comb are noise.
MAX_ORDER = 24

#: Where rates are further apart, the outer lines fill the space between the orders and widen no more. FEWER_ORDERS:
#: highest orders that are then tried in place of MAX_ORDER, one after the other. SATURATED: the index from fewer orders
#: counts if it is more than this when multiplied by their highest [orders].
FEWER_ORDERS, SATURATED = (12, 8), 0.2

#: Variance of the squared orders up to which they do not show whether lines widen.
LEAST_VARIANCE = 1e-3


def smearing_index(
    spectrum: Spectrum,
    energy: NDArray[np.float32],
    body: Body,
    chopping: Chopping,
    root: NDArray[np.float32] | None = None,
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
    root : ndarray of float32, shape (..., bins), optional
        Root of the energy, if it was computed already.

    Returns
    -------
    ndarray of float32, shape (...)
        0 (one rate, narrow lines at all orders) to `FULLY_SMEARED`; NaN where no spacing or no energy is given.
    """
    nearest, away = _squared_orders(spectrum, body, chopping)
    return _growth(nearest, away, np.sqrt(energy) if root is None else root, MAX_ORDER)


def wide_smearing_index(
    spectrum: Spectrum, energy: NDArray[np.float32], body: Body, chopping: Chopping
) -> NDArray[np.float32]:
    """`smearing_index` of rates that differ by up to about 4 %, from fewer orders where the outer lines fill all space.

    At rates further apart even the inner lines fill the space between the orders, and none widens.

    Parameters
    ----------
    spectrum, energy, body, chopping
        As in `smearing_index`.
    """
    nearest, away = _squared_orders(spectrum, body, chopping)
    root = np.sqrt(energy)
    index = _growth(nearest.copy(), away, root, MAX_ORDER)
    for orders in FEWER_ORDERS:
        inner = _growth(nearest.copy(), away, root, orders)
        index = np.where(inner * orders > SATURATED, inner, index)
    return index


def _squared_orders(
    spectrum: Spectrum, body: Body, chopping: Chopping
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Nearest order of every bin and the distance to it [orders], both squared; NaN where no spacing is given."""
    per_order = np.float32(1) / chopping.frequency_hz
    centre = body.velocity_mps * np.float32(-2 / spectrum.wavelength_m)
    order = spectrum.frequency_hz_float32 - centre[..., None]
    order *= per_order[..., None]
    nearest = np.rint(order)
    order -= nearest
    return np.square(nearest, out=nearest), np.square(order, out=order)


def _growth(
    nearest: NDArray[np.float32], away: NDArray[np.float32], root: NDArray[np.float32], most: int
) -> NDArray[np.float32]:
    """Root of the slope of `away` over `nearest` from the orders 1 to `most`; NaN where none holds energy.

    `nearest` is overwritten. Bins are weighted by the root of their energy: one strong low line must not outvote the
    many weak high ones.
    """
    counts = nearest <= most**2  # false for the NaN of a missing spacing
    counts &= nearest > 0
    weight = root * weights(counts)
    total = sums(weight)
    per_total = 1 / np.maximum(total, np.float32(1e-30))
    # centred first: where few orders hold energy, a difference of mean squares is rounding alone
    nearest -= (np.vecdot(weight, nearest) * per_total)[..., None]
    weight *= nearest
    variance, covariance = np.vecdot(weight, nearest) * per_total, np.vecdot(weight, away) * per_total
    slope = covariance * (variance > LEAST_VARIANCE) / np.maximum(variance, np.float32(LEAST_VARIANCE))
    index = np.sqrt(np.minimum(np.maximum(slope, 0), np.float32(FULLY_SMEARED**2)))
    return np.where(total > 0, index, np.float32(np.nan))
