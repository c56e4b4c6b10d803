"""Single samples that stand out of a record at a fixed interval: another radar's pulses, whose comb has no edge."""

import numpy as np
from numpy.typing import NDArray

from ..lines import squared
from .periodogram import Periodogram

#: Pulse periods tried, in 1 / spacing: a comb may be every second to fourth of their lines, or have others between
#: them.
PERIODS = (1 / 6, 1 / 5, 1 / 4, 1 / 3, 1 / 2, 1, 2, 3, 4)

#: Least samples in a period, and least pulses: a pulse and its neighbours must be told from the other samples.
LEAST_PERIOD, LEAST_PULSES = 8, 4

#: Pulses exceed LEAST_HEIGHT times the noise, and some of them ALONE times both neighbours. Of several periods the
#: shortest is taken whose pulses are SAME_SHARE as high as those of any.
LEAST_HEIGHT, ALONE, SAME_SHARE = 8.0, 3.0, 0.7

#: Excess power beside a pulse is less than this share of it. A blade's flash whose band is the whole span falls between
#: two samples as often as on one and leaves 0.17 beside it, in twice the span 0.05.
BESIDE_SHARE = 0.08

#: Pulses are sought only in unambiguous spans of LEAST_SPAN_MPS [m/s] and more: in less, flashes of usual tips are as
#: short. Pulses whose intervals are off a whole number of samples by fewer than SHIFTS samples in all may be flashes
#: that fall on a sample each: only from WHOLE_SPAN_MPS on [m/s], which hardly any tip fills, are they pulses.
LEAST_SPAN_MPS, WHOLE_SPAN_MPS, SHIFTS = 300.0, 400.0, 2


def even_pulses(data: Periodogram, spacing: float) -> NDArray[np.intp]:
    """Find the samples of the pulses that make up a comb; none where it may be a rotor's.

    A pulse is one sample with quiet neighbours, whatever the interval to the next; a rotor's flash lasts the longer the
    narrower its band.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacing : float
        Of the comb [cycles a sample].

    Returns
    -------
    ndarray of int, shape (pulses found,)
        Their indices, rising.
    """
    none = np.zeros(0, np.intp)
    if data.span_mps < LEAST_SPAN_MPS:
        return none
    power = np.asarray(squared(data.samples), np.float64)
    noise = float(np.median(power)) / np.log(2)
    beside = np.maximum(power[:-2], power[2:])
    lone = (power[1:-1] > LEAST_HEIGHT * noise) & (power[1:-1] > ALONE * beside)
    if lone.sum() < LEAST_PULSES:
        return none
    periods = [period for period in np.array(PERIODS) / spacing if period >= LEAST_PERIOD]
    found = [_loudest(power, period) for period in periods if period * (LEAST_PULSES + 1) <= len(power)]
    heights = [float(power[places].mean()) - noise for places in found]
    for places, height in zip(found, heights, strict=True):
        if height < max(SAME_SHARE * max(heights), LEAST_HEIGHT * noise):
            continue
        apart = np.diff(places)
        if data.span_mps < WHOLE_SPAN_MPS and np.abs(apart - np.median(apart)).sum() < SHIFTS:
            return none
        # the louder of two noise samples has 1.5 times the mean
        return places if float(beside[places - 1].mean()) - 1.5 * noise < BESIDE_SHARE * height else none
    return none


def _loudest(power: NDArray[np.float64], period: float) -> NDArray[np.intp]:
    """The samples, about a period apart, that hold the most power; none at either end of the record."""
    starts = np.arange(2, 2 * period) / 2
    times = np.arange(int((len(power) - 3 - starts[-1]) / period) + 1) * period
    nearest = np.rint(starts[:, None] + times).astype(np.intp)
    best = nearest[power[nearest].mean(axis=1).argmax()]
    around = best[:, None] + [-1, 0, 1]
    around = np.clip(around, 1, len(power) - 2)
    return np.asarray(np.take_along_axis(around, power[around].argmax(axis=1)[:, None], axis=1)[:, 0], np.intp)
