"""Whether a converter clipped: I or Q stands at its largest value too often to be chance."""

import numpy as np
from numpy.typing import NDArray

#: Values that stand at the top of one side for that side to be clipped, of one recording in all, and their distance
#: from another by which they differ, relative: arithmetic after the converter may have changed the last digits.
LEAST_AT_TOP, LEAST_VALUES, SAME = 3, 5, 1e-6

#: Those at the top are more than those within this share of it below: noise and lines thin out towards their largest.
BELOW_TOP = 0.03

#: A converter whose steps are this share of the largest value and more says nothing: a strong line, which dwells where
#: it turns, fills its uppermost step as well. Nor does a side of fewer values that differ: a switch, no signal.
COARSE, LEAST_DISTINCT = 0.01, 8


def clipped_values(iq: NDArray[np.complex64]) -> int:
    """Count the values of I and Q that stand at the largest their converter gives.

    Each side of each channel is judged alone, as an offset that was taken out, or a gain of the channel's own, moves
    their ends apart. What clips is cut straight: of lines it makes more lines, also past a rotor's tips.

    Parameters
    ----------
    iq
        Samples of one recording at one gain, shape (pulses,), finite.

    Returns
    -------
    int
        0 where nothing speaks of clipping: also where the largest are no longer one value (filtered, resampled), where
        few values differ at all (a switch, no signal), and where the converter's steps are coarse.
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
    steps = steps[steps > SAME * top]  # what rounding makes of one value is none
    if len(steps) + 1 < LEAST_DISTINCT or np.median(steps) > COARSE * top:
        return 0
    # what was played again and again holds each value as often
    often = int(counts[values < top * np.float32(1 - SAME)][-LEAST_DISTINCT:].min())
    return at if at >= LEAST_AT_TOP * often else 0
