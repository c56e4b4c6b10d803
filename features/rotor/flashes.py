"""Blade flashes: the phases of a blade's lines line up, whatever their powers are.

A uniform blade's line of rotation order n has the amplitude exp(j n (phi - pi/2)) / Gamma x integral of J_n (the
paper's eq. 16 summed along the blade): inside the band that integral is near 1 at every order, so that the phases grow
by equal steps from line to line. In time that is the flash of the blade at right angles to the line of sight. Noise has
no such phase law, so the phases are evidence besides the powers of the lines.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared
from .periodogram import Periodogram

#: A side with fewer lines than this has no phase evidence.
LEAST_LINES = 5

#: Phase steps tried for each order of a side, at least.
OVERSAMPLING = 4


def flash_nats(amplitudes: NDArray[np.complexfloating]) -> NDArray[np.float64]:
    """Evidence of equal phase steps in the lines of one side [nats].

    For given powers and random phases, the share of the power that adds up at one phase step follows a beta law of
    parameters 1 and lines - 1, exactly so for lines of noise. Its tail times the number of independent steps, taken as
    2 x lines, is the probability that chance does as well.

    Parameters
    ----------
    amplitudes : ndarray of complex, shape (..., orders)
        Lines in rising order; 0 where a line cannot be seen.

    Returns
    -------
    ndarray of float64, shape (...)
        At least 0.
    """
    lines = np.count_nonzero(amplitudes, axis=-1)
    total = squared(amplitudes).sum(axis=-1, dtype=np.float64)
    size = fft.next_fast_len(OVERSAMPLING * amplitudes.shape[-1])
    peak = squared(fft.fft(amplitudes, size, axis=-1)).max(axis=-1)
    share = np.minimum(peak / np.maximum(total * lines, 1e-30), 1 - 1e-9)
    nats = -(lines - 1) * np.log1p(-share) - np.log(2.0 * np.maximum(lines, 1))
    return np.where(lines >= LEAST_LINES, np.maximum(nats, 0.0), 0.0)


def flash_evidence(
    data: Periodogram,
    spacings: NDArray[np.float64],
    centres: NDArray[np.float64],
    lows: NDArray[np.intp],
    highs: NDArray[np.intp],
) -> NDArray[np.float64]:
    """Evidence of flashes in combs, both sides together, shape (combs,) [nats].

    Parameters
    ----------
    data : Periodogram
        The record.
    spacings, centres : ndarray, shape (combs,)
        [cycles a sample].
    lows, highs : ndarray of int, shape (combs,)
        Outermost orders, low <= 0 <= high.
    """
    reach = np.stack([-lows, highs])
    order = np.arange(1, reach.max(initial=0) + 1)
    frequency = centres[:, None] + np.array([-1, 1])[:, None, None] * spacings[:, None] * order
    counted = data.usable(frequency) & (order <= reach[..., None])
    left, right = np.where(counted, data.amplitude[data.bins_of(frequency)], 0)
    apart = flash_nats(np.stack([left, right])).sum(axis=0)
    # J_-n = (-1)^n J_n: both sides share one phase step, with half a turn more on one if the number of blades is odd
    turned = left * np.where(order % 2, -1, 1).astype(np.float32)
    rest = np.zeros_like(left[:, :1])
    both = np.stack([np.concatenate([side[:, ::-1], rest, right], axis=1) for side in (left, turned)])
    return np.maximum(apart, flash_nats(both).max(axis=0) - np.log(2))
