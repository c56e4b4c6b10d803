"""Where the combs of several rotors meet: at the body, whichever line they were counted from.

Every rotor's line of order n lies n times its own spacing from the body. Counted from a line m orders off, each comb
has a centre of its own, m times its own spacing from the body: the centres coincide only at the body. Levels on both
sides hardly tell the body's order, as the lines of several rotors beat; their frequencies do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..lines import squared
from .comb import Comb
from .comb_fit import CombFit, fit_combs
from .periodogram import Level, Periodogram
from .rotors import Rotors

#: Gauss-Newton steps of the separate fit, from the joint fit, whose combs are off by a fraction of a bin at most.
MEETING_STEPS = 3

#: The body is tried at up to this many orders to each side of the common centre.
MOST_ORDERS = 100

#: COUNTED: prior in favour of the order that the combs were counted from, more if a line tells it; OPEN_NATS: orders
#: less likely than the best one by more than this are dropped [nats].
COUNTED, OPEN_NATS = 3.0, 3.0

#: The best order is sure if every other one is less likely by more than this [nats].
SURE = 15.0

#: If the separately fitted centres differ by more than this, the joint fit has converged on wrong combs [bins].
NEAR_BINS = 0.35

#: Rms frequency error of each line of a comb that merges several unresolved rotors [bins].
MERGED_BINS = 0.2

#: BEATING_ORDERS: rms error of the body's order if one comb holds several rotors and no line tells the body: 8 of 60
#: were off. Two rotors that beat are about as symmetric about another order, as a rule to 0.3 nats^2, a lone rotor to
#: 0.01. EVEN_NATS: below this, beside noise, it is a lone rotor [nats^2], by at least EVEN_PAIRS orders whose lines on
#: both sides exceed the snr EVEN_SNR.
BEATING_ORDERS, EVEN_NATS, EVEN_PAIRS, EVEN_SNR = 0.5, 0.03, 4, 10.0


@dataclass(frozen=True)
class Meeting:
    """Where combs meet.

    Parameters
    ----------
    order : int
        The body's likeliest order, counted from the combs' common centre.
    place, std : float
        Mean place of the combs at that order and its standard deviation, raised if they scatter [cycles a sample].
    open_std : float
        Further standard deviation by other orders that are about as likely [cycles a sample].
    is_sure : bool
        True where every other order is less likely by more than SURE nats.
    is_near : bool
        Whether the separately fitted centres agree to NEAR_BINS, as after a good joint fit.
    """

    order: int
    place: float
    std: float
    open_std: float
    is_sure: bool
    is_near: bool


def meeting_of(
    data: Periodogram, fits: Sequence[CombFit], level_about: Level, *, resolved: bool, line_nats: float = 0.0
) -> Meeting | None:
    """Where the combs of several rotors meet.

    Parameters
    ----------
    data : Periodogram
        The record.
    fits : sequence of CombFit
        Two combs at least, fitted about one centre.
    level_about : callable
        Local level of the residual of these combs.
    resolved : bool
        Whether each comb is a single rotor's.
    line_nats : float
        Evidence of a line that stands out as the body's, at the order that the combs were counted from [nats].

    Returns
    -------
    Meeting or None
        None where the combs cannot be fitted with a centre each.
    """
    reaches = [fit.reach for fit in fits]
    spacings = [fit.spacing for fit in fits]
    apart = fit_combs(data, fits[0].centre, spacings, reaches, MEETING_STEPS, level_about=level_about, own_centres=True)
    if apart is None or not all(np.isfinite(fit.centre_std) for fit in apart[0]):
        return None
    merged = np.array([0.0 if resolved else MERGED_BINS / np.sqrt(len(fit.orders)) for fit in apart[0]])
    most = min(MOST_ORDERS, max(max(-low, high) for low, high in reaches))
    unlike, place, std = _by_order(apart[0], most, merged / data.pulses)
    # if the combs meet at no order within their deviations, all evidence is reduced in proportion
    nats = -unlike / 2 / max(float(unlike.min()) / (len(fits) - 1), 1.0)
    nats[most] += max(COUNTED, line_nats)
    best = int(nats.argmax())
    likely = np.exp(nats - nats[best])
    is_sure = bool(np.delete(likely, best).max(initial=0.0) < np.exp(-SURE))
    likely[likely < np.exp(-OPEN_NATS)] = 0.0
    open_orders = float(np.sqrt((likely * (np.arange(len(likely)) - best) ** 2).sum() / likely.sum()))
    open_std = open_orders * float(np.mean(spacings))
    is_near = float(np.ptp([fit.centre for fit in apart[0]])) * data.pulses < NEAR_BINS
    return Meeting(best - most, float(place[best]), float(std[best]), open_std, is_sure, is_near)


def with_body(comb: Comb, rotors: Rotors, meeting: Meeting | None) -> tuple[Comb, float | None]:
    """The comb with `body_std` by the meeting of its rotors; and the std of a sure meeting at its centre, else None."""
    if meeting is None:
        beats = len(rotors.rates) == 1 and not (comb.body_has_line or _is_even(comb.fit))
        return replace(comb, body_std=max(comb.body_std, BEATING_ORDERS * comb.chopping)) if beats else comb, None
    if meeting.is_sure and meeting.order == 0:
        return replace(comb, body_std=0.0), meeting.std
    elsewhere = abs(meeting.place - rotors.fits[0].centre) if meeting.order else 0.0
    return replace(comb, body_std=float(np.linalg.norm([comb.body_std, elsewhere, meeting.open_std]))), None


def _is_even(fit: CombFit) -> bool:
    """Whether a comb's lines are as strong on both sides of its centre, as a lone rotor's are."""
    power, snr = (dict(zip(fit.orders.tolist(), values, strict=True)) for values in (squared(fit.amplitudes), fit.snr))
    pairs = [order for order in power if order > 0 and min(snr[order], snr.get(-order, 0.0)) > EVEN_SNR]
    if len(pairs) < EVEN_PAIRS:
        return False
    unlike = np.square([np.log(power[order] / power[-order]) for order in pairs])
    by_noise = [2 / snr[order] + 2 / snr[-order] for order in pairs]
    return bool(np.mean(unlike) < EVEN_NATS + np.mean(by_noise))


def _by_order(
    fits: Sequence[CombFit], most: int, merged: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Chi-squared of the combs' places at each order from `-most` to `most`, their mean and its standard deviation.

    `merged` is a further standard deviation of each comb's place [cycles a sample].
    """
    known = [(fit.centre, fit.spacing, fit.centre_std, fit.spacing_std) for fit in fits]
    centre, spacing, centre_std, spacing_std = np.array(known).T
    order = np.arange(-most, most + 1)[:, None]
    place, weight = centre + order * spacing, 1 / (centre_std**2 + merged**2 + (order * spacing_std) ** 2)
    total = weight.sum(axis=1)
    mean = (weight * place).sum(axis=1) / total
    unlike = (weight * (place - mean[:, None]) ** 2).sum(axis=1)
    return unlike, mean, np.sqrt(np.maximum(unlike / (len(fits) - 1), 1.0) / total)
