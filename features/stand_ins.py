"""What stands in for lost pulses besides 0: one value that comes again and again, or the pulse before, held."""

import numpy as np
from numpy.typing import NDArray

from .dropouts import LEAST_LOST, lost_pulses

#: Samples are seldom alike but for those that stand for lost pulses: this share of the others at most. Those that do
#: are so many times as many as come of any other value, or as others alike at all, and no more of all than this.
ALIKE, OFTEN, MOST_SHARE = 0.01, 3, 0.25


def stand_ins(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Find the pulses that hold no sample of their own.

    Lost pulses are not 0 once the mean or an offset was taken from all samples, or the converter has one; and some
    receivers repeat the pulse before. Coarse steps of a converter make samples alike too: of these nothing is told.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.

    Returns
    -------
    ndarray of bool, same shape
        Exact zeros are none of them (`dropouts`), nor is what stands at a clipping converter's ends.
    """
    none = np.zeros(len(iq), bool)
    as_one = np.ascontiguousarray(iq).view(np.int64)
    rising = np.sort(as_one)
    if not np.any(rising[1:] == rising[:-1]):  # as where samples have no steps: a tenth of the time
        return none
    values, counts = np.unique(rising, return_counts=True)
    inside = iq != 0
    for part in (iq.real, iq.imag):
        if part.any():  # or there is one channel
            inside &= (part > part.min()) & (part < part.max())
    again = (as_one == values[counts.argmax()]) & inside
    if _stands_out(again, len(values) - 1) and counts.max() >= OFTEN * np.sort(counts)[-2:][0]:
        return again
    # as zeros are judged, what lies from each to the next: a line that turns slowly is nearly alike from pulse to pulse
    steps = np.diff(iq * np.float32(0.5))  # halves, that no difference leaves float32
    held = np.append(False, lost_pulses(steps) & (as_one[1:] == as_one[:-1])) & inside
    if _stands_out(held, len(values)) and held.sum() > OFTEN * ((~held).sum() - len(values)):
        return held
    return none


def _stands_out(found: NDArray[np.bool_], distinct: int) -> bool:
    """Whether so many pulses may be lost, and the others, of so many values, are seldom alike."""
    number, others = int(found.sum()), int((~found).sum())
    return LEAST_LOST <= number <= MOST_SHARE * len(found) and distinct >= (1 - ALIKE) * others
