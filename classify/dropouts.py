"""Whether pulses were lost: samples that are exactly 0 where hardly any is nearly 0."""

import numpy as np
from numpy.typing import NDArray

#: Samples no further from 0 than so many steps of the converter are nearly 0, and zeros are lost pulses where they are
#: more than this share of these, and so many: 24 places (of one channel 4) lie so near, each about as likely as 0.
#: Samples without steps differ by next to nothing, and next to none is nearly 0.
NEAR_STEPS, NEAR_SHARE, LEAST_LOST = 2.1, 0.5, 3

#: More zeros in a row are silence, which is no comb, and too long to be filled in.
MOST_IN_A_ROW = 32

#: Fewer sizes that differ are a converter's that hardly steps at all: it gives 0 most of the time.
LEAST_DISTINCT = 8


def lost_pulses(iq: NDArray[np.complex64]) -> int:
    """Count the pulses that hold nothing at all, not even noise.

    Each spoils every line of the spectrum as an impulse would; a few of them, of whatever spacing, look like a rotor's
    flashes.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.

    Returns
    -------
    int
        0 where nothing speaks of lost ones: no zeros, no more than a converter of coarse steps gives of noise, or
        nothing else. Zeros of longer silences are not counted.
    """
    size = np.maximum(np.abs(iq.real), np.abs(iq.imag))
    there = size > 0
    runs = np.diff(np.flatnonzero(np.concatenate([[True], there, [True]]))) - 1  # of zeros between those that are there
    zeros = int(runs[runs <= MOST_IN_A_ROW].sum())
    if zeros < LEAST_LOST or not there.any():
        return 0
    held = np.sort(size[there])
    steps = np.diff(held)
    steps = steps[steps > 0]
    if len(steps) + 1 < LEAST_DISTINCT:
        return 0
    near = np.searchsorted(held, np.float32(NEAR_STEPS) * np.median(steps), side="right")
    return zeros if zeros > NEAR_SHARE * near else 0
