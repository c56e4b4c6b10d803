"""The velocity of a body over many dwells: some measure it well, some take another line for the body's."""

import numpy as np
from numpy.typing import NDArray

#: Smaller standard deviations are raised to this [m/s].
LEAST_STD_MPS = 1e-6

#: Dwells with this standard deviation or more tell nothing of a varying velocity [m/s].
KNOWN_MPS = 1.0

#: The velocity varies if chi-squared over the dwells is more than UNLIKE_DEVIATIONS of its standard deviations above
#: its mean, and at least LEAST_DWELLS know the velocity to KNOWN_MPS.
LEAST_DWELLS, UNLIKE_DEVIATIONS = 5, 3.0

#: MAD_STD: standard deviation over median absolute deviation of a normal law; amplitude over the same, nearly, of a
#: sinusoidal motion. OF_MEDIAN: standard error of the median of n values of such a motion over amplitude / sqrt(n):
#: large, as the motion dwells at its extremes.
MAD_STD, OF_MEDIAN = 1.4826, np.pi / 2


def over_dwells(velocity_mps: NDArray[np.float64], std_mps: NDArray[np.float64]) -> tuple[float, float]:
    """The velocity of a body over some dwells, and its standard deviation.

    Parameters
    ----------
    velocity_mps, std_mps : ndarray, shape (dwells,)
        Of each dwell, one at least, finite [m/s].

    Returns
    -------
    velocity_mps, std_mps : float
        Of a steady body the median, each dwell weighted by its inverse variance: a dwell with several possible body
        lines counts little. Of a varying velocity, as of walkers and wings, the plain median of the dwells that know
        it: with weights the surest ones, at the extremes of the motion, would decide. Not the mean: where the body is
        fast, limbs may be louder.
    """
    order = np.argsort(velocity_mps)
    value, std = velocity_mps[order], np.maximum(std_mps[order], LEAST_STD_MPS)
    weight = 1 / std**2
    # the mean of the two values about half the total weight, as for a median of equal weights
    upto = np.cumsum(weight) / weight.sum()
    pair = np.searchsorted(upto, [0.5 - 1e-9, 0.5 + 1e-9])
    middle = float(value[np.minimum(pair, len(value) - 1)].mean())
    unlike, free = float((weight * (value - middle) ** 2).sum()), max(len(value) - 1, 1)
    if unlike > free + UNLIKE_DEVIATIONS * np.sqrt(2 * free) and np.count_nonzero(std < KNOWN_MPS) >= LEAST_DWELLS:
        value = value[std < KNOWN_MPS]
        middle = float(np.median(value))
        own = max(MAD_STD * float(np.median(np.abs(value - middle))), LEAST_STD_MPS)
        return middle, OF_MEDIAN * own / float(np.sqrt(len(value)))
    # if values scatter by more than their deviations, that of the result grows by as much (Birge 1932)
    return middle, float(np.sqrt(max(unlike / free, 1.0) / weight.sum()))
