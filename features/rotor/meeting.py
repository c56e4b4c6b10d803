"""Where the combs of several rotors meet: at the body, whichever of their lines it was counted from.

About the body every rotor's line of order n lies n of its own rates away. Counted from another line, m orders off, each
comb has a centre of its own, m times its rate further on. How levels are to both sides hardly tells these apart, as the
lines of several rotors beat; where they lie does.
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

#: Gauss-Newton steps from the joint fit, none of whose combs is more than a part of a bin off.
MEETING_STEPS = 3

#: Asked are so many orders to each side.
MOST_ORDERS = 100

#: Beside what their places say, so much speaks for the order that they were counted from; orders less likely than the
#: likeliest by more than the second are none [nats].
COUNTED, OPEN_NATS = 3.0, 3.0

#: They surely meet about one order where no other is nearer to it than this [nats].
SURE = 15.0

#: A joint fit about a place off theirs by more than this is drawn to combs that are none [bins].
NEAR_BINS = 0.35

#: A comb that is several rotors not told apart has each of its lines drawn off its place by so much [bins], rms.
MERGED_BINS = 0.2

#: Of rotors that one comb holds, and no line that tells the body, that is so many orders off, rms: 8 of 60 were.
#: Two that beat are about as even about another order, by 0.3 nats^2 as a rule; a lone one's lines by 0.01, of so many
#: orders of such an snr to each side.
BEATING_ORDERS, EVEN_NATS, EVEN_PAIRS, EVEN_SNR = 0.5, 0.03, 4, 10.0


@dataclass(frozen=True)
class Meeting:
    """Where combs meet.

    Parameters
    ----------
    order : int
        The likeliest, counted from their common centre.
    place, std : float
        That of it, and standard deviation, by how near they come to one another too [cycles a sample].
    open_std : float
        What other orders add to that, where they are about as likely [cycles a sample].
    is_sure : bool
        Whether none is by far.
    is_near : bool
        Whether it is told from combs that the joint fit was not far from.
    """

    order: int
    place: float
    std: float
    open_std: float
    is_sure: bool
    is_near: bool


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
        None where they cannot be fitted each about a centre of its own.
    """
    reaches = [fit.reach for fit in fits]
    spacings = [fit.spacing for fit in fits]
    apart = fit_combs(data, fits[0].centre, spacings, reaches, MEETING_STEPS, level_about=level_about, own_centres=True)
    if apart is None or not all(np.isfinite(fit.centre_std) for fit in apart[0]):
        return None
    merged = np.array([0.0 if resolved else MERGED_BINS / np.sqrt(len(fit.orders)) for fit in apart[0]])
    most = min(MOST_ORDERS, max(max(-low, high) for low, high in reaches))
    unlike, place, std = _by_order(apart[0], most, merged / data.pulses)
    # combs that meet nowhere as near as they should say so much less
    nats = -unlike / 2 / max(float(unlike.min()) / (len(fits) - 1), 1.0)
    nats[most] += COUNTED
    best = int(nats.argmax())
    likely = np.exp(nats - nats[best])
    is_sure = bool(np.delete(likely, best).max(initial=0.0) < np.exp(-SURE))
    likely[likely < np.exp(-OPEN_NATS)] = 0.0
    open_orders = float(np.sqrt((likely * (np.arange(len(likely)) - best) ** 2).sum() / likely.sum()))
    open_std = open_orders * float(np.mean(spacings))
    is_near = float(np.ptp([fit.centre for fit in apart[0]])) * data.pulses < NEAR_BINS
    return Meeting(best - most, float(place[best]), float(std[best]), open_std, is_sure, is_near)


def with_body(comb: Comb, rotors: Rotors, meeting: Meeting | None) -> tuple[Comb, float | None]:
    """A comb that may be several rotors' with what is known of the body: where they meet, and how sure that is."""
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
