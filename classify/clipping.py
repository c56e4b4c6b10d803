"""Detects clipping by a converter: I or Q stands at its largest value too often to be chance."""

import numpy as np
from numpy.typing import NDArray

#: LEAST_AT_TOP: fewest values at the largest of one side for that side to be clipped. LEAST_VALUES: fewest such values
#: in a whole recording. SAME: relative difference up to which two values count as equal, as arithmetic after the
#: converter may have changed the last digits.
LEAST_AT_TOP, LEAST_VALUES, SAME = 3, 5, 1e-6

#: On a clipped side more values stand at the largest than within this share below it: values of noise and lines become
#: rarer towards their largest.
BELOW_TOP = 0.03

#: COARSE: a side whose median step is above this share of its largest value is not judged: a strong line, which stays
#: longest at its extremes, fills the uppermost step as well. LEAST_DISTINCT: nor is a side of fewer distinct values,
#: which is a switch and no signal.
COARSE, LEAST_DISTINCT = 0.01, 8


def clipped_values(iq: NDArray[np.complex64]) -> int:
    """Count the values of I and Q that stand at the largest their converter gives.

    The positive and the negative side of each channel are judged alone, as a removed offset or unequal gains of I and Q
    move their limits apart. Clipping adds harmonics to the lines of a spectrum, also beyond a rotor's tips.

    Parameters
    ----------
    iq
        Samples of one recording at one gain, shape (pulses,), finite.

    Returns
    -------
    int
        0 where there is no sign of clipping: also where the largest values are no longer equal (filtered, resampled),
        where there are few distinct values (a switch, no signal), and where the converter's steps are coarse.
    """
    count = sum(_at_top(side) for part in (iq.real, iq.imag) for side in (part, -part))
    return count if count >= LEAST_VALUES else 0


def _at_top(side: NDArray[np.float32]) -> int:
    """How many values stand at the top of one side; 0 where that is no clipping."""
    above = side[side > 0]
    if len(above) < LEAST_AT_TOP:
        return 0
    top = above.max()
    at = int((above >= top * np.float32(1 - SAME)).sum())
    below = int((above >= top * np.float32(1 - BELOW_TOP)).sum()) - at
    if at < LEAST_AT_TOP or at <= below:
        return 0
    values, counts = np.unique(above, return_counts=True)
    steps = np.diff(values)
    steps = steps[steps > SAME * top]  # a smaller difference is rounding and no step
    if len(steps) + 1 < LEAST_DISTINCT or np.median(steps) > COARSE * top:
        return 0
    # a signal that was replayed again and again holds every value that often
    often = int(counts[values < top * np.float32(1 - SAME)][-LEAST_DISTINCT:].min())
    return at if at >= LEAST_AT_TOP * often else 0
