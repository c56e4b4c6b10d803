"""Sidebands that a supply or an oscillator puts about a strong line: alike on both sides, and no blade's."""

import numpy as np
from numpy.typing import NDArray

from ..lines import squared
from .comb import Comb
from .periodogram import Periodogram

#: A sideband exceeds CLEAR times the noise of a bin [1]; the modulated line is UNDER_DB over all of them [dB] and
#: within ON_CENTRE_BINS of the comb's centre [bins].
CLEAR, UNDER_DB, ON_CENTRE_BINS = 20.0, 10.0, 1.0

#: Together they hold LEAST_POWER times the noise of a bin [1]; all n other lines at most OTHERS + OTHERS_STD x sqrt(n).
LEAST_POWER, OTHERS, OTHERS_STD = 1000.0, 10.0, 4.0

#: Sidebands have no more orders than lines of blades this long for each blade of the rotor [m]: 4 pi of it over the
#: wavelength. Most blades are longer.
SHORT_M = 0.0135

#: The part in which both sides of an order differ is less than UNLIKE_SHARE of what they share plus UNLIKE_NATS for
#: noise [nats].
UNLIKE_SHARE, UNLIKE_NATS = 0.01, 8.0

#: Lines are a blade's if the power off its phases is less than OFF_SHARE of all orders but the strongest, plus
#: OFF_SHARE_OF_ONE of that, plus OFF_NATS for noise [nats an order].
OFF_SHARE, OFF_SHARE_OF_ONE, OFF_NATS = 0.01, 1e-3, 4.0

#: Least orders: the phase of a single one always fits a blade.
LEAST_ORDERS = 2

#: Phases tried for each order.
PHASES = 64


def sideband_spacing(data: Periodogram, comb: Comb) -> float | None:
    """Spacing of a comb's lines [cycles a sample] if the few that stand out are those of a modulation.

    A line modulated by one real signal, in amplitude, phase or both, has each order alike on both sides, with phases
    mirrored about one common phase. So has a rotor of like blades, but it is also symmetric in time about a flash: its
    phases grow by equal steps from order to order, up to half turns. Phases of a supply's harmonics are arbitrary.
    Several rotors, unlike blades and one-sided reflectors are not alike on both sides.

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
    apart = int(np.gcd.reduce(order))  # the comb may have a fraction of their spacing
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
    """Common part of both sides of each order, over half the noise of a bin; None where they are not alike."""
    # the phase that all are mirrored about; a phase modulation, or an odd number of blades, adds a quarter of a turn
    mirror = np.exp(-1j * np.angle(((upper * lower) ** 2).sum()) / 4)
    upper, lower = mirror * upper, (mirror * lower).conj()
    parts = np.asarray([upper + lower, -1j * (upper - lower)], np.complex128) / 2
    power = squared(parts)
    if (power.min(axis=0) > UNLIKE_NATS + UNLIKE_SHARE * power.max(axis=0)).any():
        return None
    return np.asarray(np.where(power[0] > power[1], *parts))


def _flash(order: NDArray[np.intp], common: NDArray[np.complexfloating]) -> bool:
    """Whether phases grow by equal steps from order to order, up to half turns, as those of a blade's lines do."""
    steps = np.pi * np.arange(PHASES * order[-1]) / (PHASES * order[-1])
    off = (common * np.exp(-1j * steps[:, None] * order)).imag
    power, least = squared(common), float((off**2).sum(axis=1).min())
    strongest = float(power.max())
    shares = OFF_SHARE * (float(power.sum()) - strongest) + OFF_SHARE_OF_ONE * strongest
    return least < OFF_NATS * len(order) + shares
