"""How fast a body is over many dwells, of which some know it well and some take another line for its own."""

import numpy as np
from numpy.typing import NDArray

#: No dwell knows the body better [m/s].
LEAST_STD_MPS = 1e-6

#: Dwells that know it no better say nothing of how it sways [m/s].
KNOWN_MPS = 1.0

#: It is not the same in all dwells where these, so many at least, differ by so many deviations of chance more than it
#: would make them.
LEAST_DWELLS, UNLIKE_DEVIATIONS = 5, 3.0

#: The standard deviation of a normal law in median ones, and that of a sway's median in those of its mean: at its ends
#: a body is longer than between them.
MAD_STD, OF_MEDIAN = 1.4826, np.pi / 2


def over_dwells(velocity_mps: NDArray[np.float64], std_mps: NDArray[np.float64]) -> tuple[float, float]:
    """The velocity of a body over some dwells, and its standard deviation.

    Parameters
    ----------
    velocity_mps, std_mps : ndarray, shape (dwells,)
        Of each, one at least, finite [m/s].

    Returns
    -------
    velocity_mps, std_mps : float
        Of a steady body the median, each dwell weighed by its own variance: where several lines may be the body's a
        dwell says little. Of one that sways, as walkers and wings do, the median to which all dwells say alike: the
        surest ones, at the ends of the sway, would decide else. Not the mean: where it is fast, limbs may be louder.
    """
    order = np.argsort(velocity_mps)
    value, std = velocity_mps[order], np.maximum(std_mps[order], LEAST_STD_MPS)
    weight = 1 / std**2
    # between the two on either side of the half, as a median of equal weights
    upto = np.cumsum(weight) / weight.sum()
    pair = np.searchsorted(upto, [0.5 - 1e-9, 0.5 + 1e-9])
    middle = float(value[np.minimum(pair, len(value) - 1)].mean())
    unlike, free = float((weight * (value - middle) ** 2).sum()), max(len(value) - 1, 1)
    if unlike > free + UNLIKE_DEVIATIONS * np.sqrt(2 * free) and np.count_nonzero(std < KNOWN_MPS) >= LEAST_DWELLS:
        value = value[std < KNOWN_MPS]
        middle = float(np.median(value))
        own = max(MAD_STD * float(np.median(np.abs(value - middle))), LEAST_STD_MPS)
        return middle, OF_MEDIAN * own / float(np.sqrt(len(value)))
    # where values differ by more than their deviations the mean's grows by as much (Birge 1932)
    return middle, float(np.sqrt(max(unlike / free, 1.0) / weight.sum()))
