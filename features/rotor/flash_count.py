"""How often a lone rotor flashes in a period of its comb: once for like blades, once a blade for unlike ones.

Blades of equal strength, some rad apart in phase, have equally strong lines at every multiple of the rotation rate, so
that line power does not tell that rate from the chopping frequency. But line n of blade m of N has the extra phase -2
pi n m / N: on each side of the body the blades flash one after another, an N-th of the turn apart, each as strong as
its blade.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared
from .comb_fit import CombFit

#: Least lines a side, LEAST_OF_TIPS for blades that reflect at their tips: few of those add up anywhere. Flashes are
#: read at FLASH_PADDING places for each line.
LEAST_LINES, LEAST_OF_TIPS, FLASH_PADDING = 12, 24, 16

#: Power further than this from a flash is no part of it [1 / lines].
FLASH_WIDTH = 2.5

#: Flashes hold LEAST_SHARE of the power that is not noise, each has LEAST_FLASH of the strongest one's, and nothing
#: between them exceeds MOST_RIVAL of the weakest. Like blades, which flash once, have 0.08 in another place at -15 dB;
#: those of some points along them hold up to 0.4 in four places.
LEAST_SHARE, LEAST_FLASH, MOST_RIVAL = 0.6, 0.1, 0.6

#: At its evenly spaced place each flash has this share of its maximum nearby: two rotors of one rate, whose flashes are
#: apart by chance, do in one of a hundred records.
LEAST_EVEN = 0.95

#: With less, down to these, the number is unsure.
UNSURE_SHARE, UNSURE_EVEN = 0.45, 0.7


def flashes_in_period(fit: CombFit, numbers: Iterable[int], tip: float) -> tuple[int, bool]:
    """How often the blades of a comb flash in its period, evenly and on both sides, and whether that is sure.

    Parameters
    ----------
    fit : CombFit
        The comb.
    numbers : iterable of int
        Numbers that are tried.
    tip : float
        Order of the edge: blades may reflect along their length, or at their tips alone. Tips pass every speed below
        their own twice, unless their lines are weighted by their J_n(tip) (the paper's eq. 24).
    """
    from scipy.special import jv  # here, because predicting needs no such import

    best, most, is_sure = 1, UNSURE_SHARE, True
    sides = [sign * fit.orders > 0 for sign in (-1, 1)]
    least = min(int(np.count_nonzero(side)) for side in sides)
    if fit.is_folded or least < LEAST_LINES:
        return best, is_sure
    shapes = [np.ones(len(fit.orders)), jv(np.abs(fit.orders), tip)]
    snr = float(fit.snr.mean())
    for shape in shapes if least >= LEAST_OF_TIPS else shapes[:1]:
        for number in numbers:
            share, even = np.inf, np.inf
            for side in sides:
                if share > most and even > UNSURE_EVEN:
                    held, evenly = _evenly(np.abs(fit.orders[side]), fit.amplitudes[side], shape[side], number)
                    share, even = min(share, held * (1 + 1 / snr)), min(even, evenly)
            if share > most and even > UNSURE_EVEN:
                best, most, is_sure = number, share, share > LEAST_SHARE and even > LEAST_EVEN
    return best, is_sure


def _evenly(
    order: NDArray[np.intp], amplitudes: NDArray[np.complex128], shape: NDArray[np.float64], number: int
) -> tuple[float, float]:
    """Share of one side's power in `number` evenly spaced flashes, and how even they are; 0 where there are none.

    Parameters
    ----------
    order, amplitudes, shape : ndarray, shape (lines,)
        The lines, and the weight of each for one kind of blade.
    number : int
        How many flashes.
    """
    lines = np.zeros(order.max() + 1, np.complex128)
    lines[order] = amplitudes * shape
    part = FLASH_PADDING * len(lines) // number
    power = squared(fft.fft(lines, part * number)) / max(float(squared(amplitudes).sum() * (shape**2).sum()), 1e-30)
    first = int(power.reshape(number, part).sum(axis=0).argmax())
    parts = np.roll(power, part // 2 - first).reshape(number, part)  # each has its flash in the middle
    flashes = parts[:, part // 2]
    near = np.abs(np.arange(part) - part // 2) < FLASH_WIDTH * FLASH_PADDING
    rival = float(parts[:, ~near].max(initial=0.0))
    if flashes.min() < LEAST_FLASH * flashes.max() or rival > MOST_RIVAL * flashes.min():
        return 0.0, 0.0
    return float(flashes.sum()), float((flashes / parts[:, near].max(axis=1)).min())
