"""How far the lines of several resolved rotors are those of like rotors.

Lines of two rotors of like blades differ, on each side of the body, by a factor and by equal phase steps from order to
order, which tell when they flash. A merged comb of two unresolved rotors is a sum of two such sets: only about half of
its power matches another comb. This shows in few lines too, which do not resolve a second flash.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared
from .comb_fit import CombFit
from .flash_count import FLASH_PADDING


def like_shares(fits: Sequence[CombFit], edge: float) -> NDArray[np.float64]:
    """Share of each comb's line power that matches another comb, or blades that reflect along their length.

    Parameters
    ----------
    fits : sequence of CombFit
        The combs.
    edge : float
        Edge of the line family [cycles a sample from the body]: lines past it are no rotor's.

    Returns
    -------
    ndarray of float64, shape (combs,)
        About 1 for like rotors, as noise, which all combs hold, is allowed for. 0 without lines.
    """
    lines, signal = _by_order(fits, edge)
    # rotors that turn the other way have the two sides of the body exchanged
    shapes = np.concatenate([np.ones_like(lines[:1]), lines, lines[:, ::-1]])
    certain = np.concatenate([np.ones_like(signal[:1]), signal, signal[:, ::-1]])
    shares = np.zeros(len(fits))
    for own in range(len(fits)):
        shape = shapes * (signal[own] > 0)
        held = (squared(shape) * certain).sum(axis=-1)
        alike = squared(fft.fft(lines[own] * shape.conj(), FLASH_PADDING * lines.shape[-1])).max(axis=-1)
        power = (alike / np.maximum(held, 1e-30)).sum(axis=-1)
        power[[1 + own, 1 + len(fits) + own]] = 0.0
        shares[own] = power.max() / max(float((squared(lines[own]) * signal[own]).sum()), 1e-30)
    return shares


def _by_order(fits: Sequence[CombFit], edge: float) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Combs' lines on both sides of the body, and the share of their power that is not noise, by order.

    Returns
    -------
    lines, signal : ndarray, shape (combs, 2, orders)
        0 where there is no line.
    """
    count = max(int(edge / fit.spacing) for fit in fits) + 1
    lines, signal = np.zeros((len(fits), 2, count), np.complex128), np.zeros((len(fits), 2, count))
    for number, fit in enumerate(fits):
        for side, sign in enumerate((-1, 1)):
            own = (sign * fit.orders > 0) & (sign * fit.orders * fit.spacing <= edge)
            order = np.abs(fit.orders[own])
            lines[number, side, order] = fit.amplitudes[own]
            # the fit shrinks these by that factor
            signal[number, side, order] = fit.snr[own] / (1 + fit.snr[own])
    return lines, signal
