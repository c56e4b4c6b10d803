"""How far the lines of several rotors told apart are those of like rotors.

Of like blades the lines of two rotors differ, on either side of the body, by a factor and by equal steps in phase from
order to order, whatever the blades are: by when they flash. Those of two rotors that one comb holds, of rates nearer
than the dwell tells apart, are a sum of two such: half of it, about, is like another's. That shows in few lines too,
which do not part a second flash from the first.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared
from .comb_fit import CombFit
from .flash_count import FLASH_PADDING


def like_shares(fits: Sequence[CombFit], edge: float) -> NDArray[np.float64]:
    """Share of the power of each comb's lines that is as another's, or as of blades that reflect along their length.

    Parameters
    ----------
    fits : sequence of CombFit
        The combs.
    edge : float
        Edge of the line family [cycles a sample from the body]: lines past it are no rotor's.

    Returns
    -------
    ndarray of float64, shape (combs,)
        About 1 for like rotors: noise, which all combs hold, is allowed for. 0 without lines.
    """
    lines, signal = _by_order(fits, edge)
    # rotors that turn the other way have what these have before they come straight on, after it
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
    """Combs' lines on both sides of the body, and which share of their power is no noise's, by their orders.

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
            # these are held back as far as noise makes them
            signal[number, side, order] = fit.snr[own] / (1 + fit.snr[own])
    return lines, signal
