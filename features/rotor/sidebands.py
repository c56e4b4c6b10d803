"""Lines that a supply or an oscillator draws about a strong one: alike on both sides, and no blade's."""

import numpy as np
from numpy.typing import NDArray

from ..lines import squared
from .comb import Comb
from .periodogram import Periodogram

#: A sideband stands so far over the noise of a bin [1], the line that is modulated so far over all of them [dB] and so
#: near to the comb's centre [bins].
CLEAR, UNDER_DB, ON_CENTRE_BINS = 20.0, 10.0, 1.0

#: Together they hold so much power over the noise of a bin [1], and all other lines of the comb next to none.
LEAST_POWER, OTHERS, OTHERS_STD = 1000.0, 10.0, 4.0

#: Only where they are as few as lines of blades that are this long for each blade of the rotor [m], 4 pi of it over the
#: wavelength. Most blades are longer.
SHORT_M = 0.0135

#: What both sides of an order do not have in common is less than this share of what they do, beside noise [nats].
UNLIKE_SHARE, UNLIKE_NATS = 0.01, 8.0

#: What lies off the phases of a blade's lines is less than these shares of all orders but the strongest and of that,
#: beside noise [nats an order].
OFF_SHARE, OFF_SHARE_OF_ONE, OFF_NATS = 0.01, 1e-3, 4.0

#: Phases of a single order are a blade's whatever they are.
LEAST_ORDERS = 2

#: Phases tried for each order.
PHASES = 64


def sideband_spacing(data: Periodogram, comb: Comb) -> float | None:
    """Spacing of a comb's lines [cycles a sample] where they are those of a modulation, by the few that stand out.

    What modulates a line by one real signal, in amplitude, phase or both, draws each order alike on both sides, its
    phases mirrored about one that all share. So does a rotor of blades that are alike, but it is also even in time
    about a blade's flash: from order to order its phases grow by equal steps, but for half turns. Those of a supply's
    harmonics are any. Several rotors, unlike blades and what reflects on one side alone are not alike on both.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb, counted from the body's line.

    Returns
    -------
    float or None
        None where they may be a rotor's.
    """
    fit = comb.fit
    away = np.abs(np.array(data.strong.centres) - fit.centre) * data.pulses
    nearest = int(away.argmin())
    if away[nearest] > ON_CENTRE_BINS:
        return None
    most = SHORT_M * 4 * np.pi / data.wavelength_m
    at_least = squared(fit.amplitudes) * data.pulses / data.level_at(fit.frequencies)
    if np.count_nonzero(at_least > CLEAR) > 2 * most:
        return None
    seen = fit.seen_beside(comb.rest)
    noise = data.level_of(comb.rest)(fit.frequencies) / data.pulses
    snr = squared(seen) / noise
    if data.strong.centres_db[nearest] - 10 * np.log10(float(snr.max())) < UNDER_DB:
        return None
    _, above, below = np.intersect1d(fit.orders, -fit.orders, return_indices=True)
    above, below = above[fit.orders[above] > 0], below[fit.orders[above] > 0]
    stands = snr > CLEAR
    clear = stands[above] | stands[below]
    others = snr[~stands & (fit.orders != 0)] - 1
    if others.sum() > OTHERS + OTHERS_STD * np.sqrt(len(others)):
        return None
    if np.count_nonzero(clear) < LEAST_ORDERS:
        return None
    order, upper, lower = fit.orders[above][clear], seen[above][clear], seen[below][clear]
    each = np.sqrt((noise[above] + noise[below])[clear] / 4)
    apart = int(np.gcd.reduce(order))  # the comb may be one of a fraction of their spacing
    order = order // apart
    if order[-1] > most:
        return None
    common = _common(np.asarray(upper / each), np.asarray(lower / each))
    if common is None or squared(common).sum() < LEAST_POWER:
        return None
    return None if _flash(order, common) else apart * fit.spacing


def _common(
    upper: NDArray[np.complexfloating], lower: NDArray[np.complexfloating]
) -> NDArray[np.complexfloating] | None:
    """What each order, over half the noise of a bin, has in common on both sides; None where they are not alike."""
    # the phase that all are mirrored about; a quarter of a turn more is a modulated phase, and a blade of odd number
    mirror = np.exp(-1j * np.angle(((upper * lower) ** 2).sum()) / 4)
    upper, lower = mirror * upper, (mirror * lower).conj()
    parts = np.asarray([upper + lower, -1j * (upper - lower)], np.complex128) / 2
    power = squared(parts)
    if (power.min(axis=0) > UNLIKE_NATS + UNLIKE_SHARE * power.max(axis=0)).any():
        return None
    return np.asarray(np.where(power[0] > power[1], *parts))


def _flash(order: NDArray[np.intp], common: NDArray[np.complexfloating]) -> bool:
    """Whether phases grow by equal steps from order to order, but for half turns, as those of a blade's lines do."""
    steps = np.pi * np.arange(PHASES * order[-1]) / (PHASES * order[-1])
    off = (common * np.exp(-1j * steps[:, None] * order)).imag
    power, least = squared(common), float((off**2).sum(axis=1).min())
    strongest = float(power.max())
    shares = OFF_SHARE * (float(power.sum()) - strongest) + OFF_SHARE_OF_ONE * strongest
    return least < OFF_NATS * len(order) + shares
