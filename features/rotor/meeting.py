"""Where the combs of several rotors meet: at the body, whichever of their lines it was counted from.

About the body every rotor's line of order n lies n of its own rates away. Counted from another line, m orders off, each
comb has a centre of its own, m times its rate further on. How levels are to both sides hardly tells these apart, as the
lines of several rotors beat; where they lie does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .comb_fit import MARGIN_ORDERS, CombFit, fit_combs
from .periodogram import Level, Periodogram

#: Gauss-Newton steps from the joint fit, none of whose combs is more than a part of a bin off.
MEETING_STEPS = 3

#: Asked are so many orders to each side.
MOST_ORDERS = 100

#: They meet where the square of what their places are apart, over its variance, is so much less than elsewhere, and at
#: most that or this share of what it is elsewhere.
SURE, SHARE = 30.0, 0.2

#: A comb that is several rotors not told apart has each of its lines drawn off its place by so much [bins], rms.
MERGED_BINS = 0.2


@dataclass(frozen=True)
class Meeting:
    """Where combs meet.

    Parameters
    ----------
    order : int
        Of theirs, counted from their common centre.
    place, std : float
        And standard deviation, by how near they come to one another too [cycles a sample].
    is_sure : bool
        Whether they do about no other order.
    """

    order: int
    place: float
    std: float
    is_sure: bool


def meeting_of(data: Periodogram, fits: Sequence[CombFit], level_about: Level, *, resolved: bool) -> Meeting | None:
    """Where the combs of several rotors meet.

    Parameters
    ----------
    data : Periodogram
        The record.
    fits : sequence of CombFit
        Two combs at least, fitted about one centre.
    level_about : callable
        Local level of what these leave.
    resolved : bool
        Whether each is one rotor's.

    Returns
    -------
    Meeting or None
        None where nothing says that it is elsewhere than at their common centre, nor that it is there.
    """
    ends = [(int(fit.orders.min()) + MARGIN_ORDERS, int(fit.orders.max()) - MARGIN_ORDERS) for fit in fits]
    reaches = [(min(low, 0), max(high, 0)) for low, high in ends]
    spacings = [fit.spacing for fit in fits]
    apart = fit_combs(data, fits[0].centre, spacings, reaches, MEETING_STEPS, level_about=level_about, own_centres=True)
    if apart is None or not all(fit.centre_std > 0 for fit in apart[0]):
        return None
    merged = np.array([0.0 if resolved else MERGED_BINS / np.sqrt(len(fit.orders)) for fit in apart[0]])
    most = min(MOST_ORDERS, max(max(-low, high) for low, high in reaches))
    plain = _by_order(apart[0], most, np.zeros(len(fits)))
    unlike, place, std = _by_order(apart[0], most, merged / data.pulses)
    best = int(unlike.argmin())
    is_sure = _beats(unlike[best], np.delete(unlike, best).min(initial=np.inf))
    likeliest = best if is_sure else int(plain[0].argmin())
    if not is_sure and not _beats(plain[0][likeliest], plain[0][most]):
        return None
    return Meeting(likeliest - most, float(place[likeliest]), float(std[likeliest]), is_sure)


def _by_order(
    fits: Sequence[CombFit], most: int, merged: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """How unlike combs' places are at each order from `-most` to `most`, their mean and its deviation.

    Each place has a further deviation of so much [cycles a sample].
    """
    known = [(fit.centre, fit.spacing, fit.centre_std, fit.spacing_std) for fit in fits]
    centre, spacing, centre_std, spacing_std = np.array(known).T
    order = np.arange(-most, most + 1)[:, None]
    place, weight = centre + order * spacing, 1 / (centre_std**2 + merged**2 + (order * spacing_std) ** 2)
    total = weight.sum(axis=1)
    mean = (weight * place).sum(axis=1) / total
    unlike = (weight * (place - mean[:, None]) ** 2).sum(axis=1)
    return unlike, mean, np.sqrt(np.maximum(unlike / (len(fits) - 1), 1.0) / total)


def _beats(one: float, other: float) -> bool:
    """Whether combs that are so unlike at one order surely meet there and not where they are so unlike."""
    return bool(other - one > SURE and one < max(SHARE * other, SURE))
