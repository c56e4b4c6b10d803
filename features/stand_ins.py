"""Values other than 0 that stand in for lost pulses: one that comes again and again, or that of the pulse before."""

import numpy as np
from numpy.typing import NDArray

from .dropouts import LEAST_LOST, lost_pulses

#: Samples are seldom equal unless they stand for lost pulses. ALIKE: largest share of the other samples that may repeat
#: a value. OFTEN: stand-ins must be this many times as many as samples of any other value, or as others that repeat
#: one. MOST_SHARE: largest share of all samples that may be stand-ins.
ALIKE, OFTEN, MOST_SHARE = 0.01, 3, 0.25


def stand_ins(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Find the pulses that hold no sample of their own.

    Lost pulses are not 0 once the mean or an offset was taken from all samples, or if the converter has an offset; and
    some receivers repeat the pulse before. Coarse steps of a converter make samples equal too: there nothing is found.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.

    Returns
    -------
    ndarray of bool, same shape
        Exact zeros are not among them (see `dropouts`), nor are samples at the limits of a clipping converter.
    """
    none = np.zeros(len(iq), bool)
    as_one = np.ascontiguousarray(iq).view(np.int64)
    rising = np.sort(as_one)
    if not np.any(rising[1:] == rising[:-1]):  # as where samples have no steps; found in a tenth of the time
        return none
    values, counts = np.unique(rising, return_counts=True)
    inside = iq != 0
    for part in (iq.real, iq.imag):
        if part.any():  # else only the other channel holds a signal
            inside &= (part > part.min()) & (part < part.max())
    again = (as_one == values[counts.argmax()]) & inside
    if _stands_out(again, len(values) - 1) and counts.max() >= OFTEN * np.sort(counts)[-2:][0]:
        return again
    # steps from pulse to pulse are judged as samples are: 0 counts unless small steps are common, as of a slow line
    steps = np.diff(iq * np.float32(0.5))  # halved, so that no difference leaves float32
    held = np.append(False, lost_pulses(steps) & (as_one[1:] == as_one[:-1])) & inside
    if _stands_out(held, len(values)) and held.sum() > OFTEN * ((~held).sum() - len(values)):
        return held
    return none


def _stands_out(found: NDArray[np.bool_], distinct: int) -> bool:
    """Whether as many pulses as found may be lost, and the others, of `distinct` values, are seldom equal."""
    number, others = int(found.sum()), int((~found).sum())
    return LEAST_LOST <= number <= MOST_SHARE * len(found) and distinct >= (1 - ALIKE) * others
