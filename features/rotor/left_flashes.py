"""Whether rotors' residual flashes at other times than they do, where their lines fill the span and hide the noise.

The residual of a rotor's fit is noise and, near the noise, some of its own flashes: stronger at some of its angles than
at others, but at each angle as steady from turn to turn as noise. Flashes of rotors of other rates drift through its
angles.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..lines import squared
from .folding import FILLED
from .periodogram import Periodogram

#: Tested only where the edge exceeds NEARLY_FILLED, where lines of a rotor a quarter faster may fold [cycles a sample]:
#: else what lies past the edge shows the noise. And only where the rotors found explain less than LEAST_EXPLAINED of
#: the samples' power, as strong lines leave some residue: lone rotors at 8 to 25 dB explain more in 19 of 20.
NEARLY_FILLED, LEAST_EXPLAINED = FILLED / 1.25, 0.6

#: The residual is another rotor's if its power, over that at like angles, is this many times as uneven as noise: 1.5 to
#: 20 where rotors were not found, up to 1.35 of 200 lone ones at -8 to 25 dB.
MOST_UNEVEN = 1.45

#: Power at like angles counts as at least this share of the mean: a few samples may be weak by chance.
LEAST_POWER = 0.3


def others_flash(data: Periodogram, rest: NDArray[np.complex128], rates: Iterable[float], edge: float) -> bool:
    """True where much of a record's power is left and flashes at other rates than those of the rotors found.

    Parameters
    ----------
    data : Periodogram
        The record.
    rest : ndarray of complex128, shape (pulses,)
        Samples that the rotors' lines leave.
    rates : iterable of float
        Spacings of the lines of each rotor [cycles a sample].
    edge : float
        Edge of the line family [cycles a sample from the body].
    """
    if edge < NEARLY_FILLED:
        return False
    left = squared(rest)
    if left.mean() < (1 - LEAST_EXPLAINED) * squared(data.samples).mean():
        return False
    return min(_unevenness(left, rate) for rate in rates) > MOST_UNEVEN


def _unevenness(power: NDArray[np.floating], rate: float) -> float:
    """Mean square of power over that at like angles of a rate, relative to noise, whatever the mean at each angle."""
    pulses = len(power)
    half = max(round(pulses * rate), 4) // 2  # a window of about as many samples as turns, at nearly one angle
    by_angle = power[np.argsort(np.arange(pulses) * rate % 1.0)]
    sums = np.cumsum(np.concatenate([[0.0], by_angle[-half:], by_angle, by_angle[:half]]))
    others = (sums[2 * half + 1 :] - sums[:pulses] - by_angle) / (2 * half)
    ratio = by_angle / np.maximum(others, LEAST_POWER * power.mean())
    # of exponentials over means of 2 * half
    noise = 2 * (2 * half - 1) / (2 * half - 2)
    return float((ratio**2).mean() / ratio.mean() ** 2 / noise)
