"""The noise floor of a record whose lines fill one side of the spectrum: the other side shows it."""

from dataclasses import replace

import numpy as np

from .one_channel import half_empty
from .spectrum import EMPTY_RATIO, LEAST_FLOOR, Spectrum, quartile_rank, side_sums

#: A side far below the other holds the noise, and was not taken away by a filter, in three cases. First: FREE_BLOCKS of
#: the other side's blocks are below NOISE_TIMES that noise, as lines do not fill the other side to its end. Second:
#: they are below UNEVEN_SHARE of what most blocks there exceed, as noise in blocks of UNEVEN_BINS or more never is.
#: Third: LINE_BLOCKS of its own blocks exceed LINES_SHARE of that, where a filter would have left no lines.
FREE_BLOCKS, NOISE_TIMES, UNEVEN_SHARE, UNEVEN_BINS = 0.05, 3.0, 0.25, 8
LINE_BLOCKS, LINES_SHARE = 0.1, 0.25


def with_free_side(spectrum: Spectrum) -> Spectrum:
    """One record's spectrum, in units of the noise of one side where lines fill the other.

    `noise_floor` takes a side far below the other for empty, as in a single channel made analytic. But the lines of a
    moving body lie mostly on one side and may fill it: their level would then pass for the noise.

    Parameters
    ----------
    spectrum : Spectrum
        Of shape (bins,).
    """
    power = spectrum.relative_power
    if len(power) < 4 or not spectrum.floor > 0:
        return spectrum
    sums, size = side_sums(power)
    sides = np.sort(sums, axis=-1)
    blocks = sides.shape[-1]
    quartiles = sides[:, quartile_rank(blocks)]
    low, high = (float(quartile) for quartile in np.sort(quartiles))
    if high <= EMPTY_RATIO * low or half_empty(power):
        return spectrum
    lower, upper = sides[np.argsort(quartiles)]
    uneven = UNEVEN_SHARE * high if size >= UNEVEN_BINS else 0.0
    comes_down = upper[int(FREE_BLOCKS * blocks)] < max(NOISE_TIMES * low, uneven)
    holds_lines = lower[int((1 - LINE_BLOCKS) * blocks)] > LINES_SHARE * high
    if not (comes_down or holds_lines):
        return spectrum
    floor = np.float32(max(low / high, float(LEAST_FLOOR * power.mean())))
    return replace(spectrum, relative_power=power / floor, transform_floor=np.asarray(spectrum.transform_floor * floor))
