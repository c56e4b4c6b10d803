"""The noise floor of a record whose lines fill one side of the spectrum: the other side shows it."""

from dataclasses import replace

import numpy as np

from .one_channel import half_empty
from .spectrum import EMPTY_RATIO, LEAST_FLOOR, Spectrum, quartile_rank, side_sums

#: A side that is far below the other holds the noise where the other comes down to this many times it in so small a
#: share of its blocks: its lines do not fill it to the end. Or where that is this share of what most blocks there hold,
#: which noise is not in blocks of so many bins. Or where so many of its own blocks reach this share of what most of the
#: other side has: a filter that took a side away left no lines there.
FREE_BLOCKS, NOISE_TIMES, UNEVEN_SHARE, UNEVEN_BINS = 0.05, 3.0, 0.25, 8
LINE_BLOCKS, LINES_SHARE = 0.1, 0.25


def with_free_side(spectrum: Spectrum) -> Spectrum:
    """One record's spectrum, in units of the noise of one side where lines fill the other.

    `noise_floor` takes a side that is far below the other for empty, as a single channel made analytic has it. Lines of
    a body that moves lie on one side for the most part, and may fill it: their level passed for the noise.

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
