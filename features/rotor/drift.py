"""A rotor whose rate changes within the dwell: by how much, and the record resampled to a constant rate.

Such a rotor's lines widen with their order and fill the gaps between them, as those of several rotors do. If the record
is read at the times at which a rotor of constant rate has turned as far, with the body's line kept, all lines are
narrow again. Hover is full of such changes: in the measured recordings a multirotor's rates change by one or two parts
in a hundred within 80 ms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lines import LinesSeen, squared, sum_of_lines
from .changing_fit import ChangingFit, Start, fit_changing, most_lines
from .comb import Comb
from .comb_fit import ENOUGH, LEAST_RIDGE, CombFit, lines_at_one_place
from .periodogram import Periodogram
from .slow_lines import notched_products, parts, remove_bands, whole
from .turning import (
    DEGREES,
    FIRST_DEGREES,
    MOST_CHANGE,
    Resampling,
    change_of,
    changed,
    inverse_of,
    is_sure,
    late_by,
    margin_of,
    other_rate,
    own_polynomials,
    polynomials,
)

#: Lines are followed over PARTS parts of the dwell, in long dwells over more parts of LONGEST_PART samples: within a
#: part hardly any line drifts out of phase.
PARTS, LONGEST_PART = 64, 48

#: The change is first fitted to the inner orders, LEAST_ORDERS at least, on which a linear change of MOST_CHANGE has an
#: effect of FIRST_RAD [rad]; then each time to MORE_ORDERS times as many, up to all.
FIRST_RAD, MORE_ORDERS, LEAST_ORDERS = 1.0, 1.3, 4

#: LAST_STEPS: most steps at all orders. ROUGHLY_SURE: standard deviations that make the change of this first fit sure.
LAST_STEPS, ROUGHLY_SURE = 6, 3.0

#: Most steps of the joint fit of all lines after that, out to FURTHER times the edge, which smeared lines hide.
FITTED_STEPS, FURTHER = 8, 2.0


@dataclass(frozen=True)
class Resampled:
    """A record resampled as if its rotor had a constant rate.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Samples of `Periodogram` read at other times; the body's line is unchanged.
    record : Periodogram
        The record as it is.
    fit : ChangingFit
        The rotor's lines in that, of all blades.
    """

    samples: NDArray[np.complex128]
    record: Periodogram
    fit: ChangingFit


def _continued(samples: NDArray[np.complex128], fit: ChangingFit) -> NDArray[np.complex128]:
    """A record with margins in which its comb continues and fades out, so that it repeats without a step."""
    pulses = len(samples)
    margin = margin_of(pulses)
    away = np.arange(1, margin + 1)
    time = np.concatenate([-away[::-1], away]) + np.repeat([-1, 1], margin) * (pulses - 1) / 2
    turned = fit.spacing * (time + fit.ahead @ polynomials(time, pulses))
    lines = np.exp(2j * np.pi * (turned[:, None] * fit.orders + fit.centre * time[:, None])) @ fit.amplitudes
    fade = np.cos(np.pi / 2 * away / (margin + 1)) ** 2
    return np.concatenate([lines[:margin] * fade[::-1], samples, lines[margin:] * fade])


def resampled(data: Periodogram, comb: Comb, edge: float, *, least_gain: float) -> Resampled | None:
    """Resample a record so that its rotor has a constant rate.

    The change is fitted by Gauss-Newton steps on the phases of the comb's lines over the dwell: first with each line by
    itself, from the inner orders outwards, then with all jointly.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it.
    edge : float
        Edge of the line family [cycles a sample from the body].
    least_gain : float
        Least factor by which taking out the change must raise the lines' information on the rate, in the first of these
        fits.

    Returns
    -------
    Resampled or None
        None where no change is sure, or it exceeds `MOST_CHANGE`.
    """
    pulses, rate, centre = data.pulses, comb.chopping, comb.fit.centre
    furthest = max(int(0.45 / rate), 1)
    reach = min(max(comb.last // comb.per_turn, round(edge / rate), LEAST_ORDERS), furthest)
    rough, gain = _each_by_itself(data, rate, centre, reach)
    if gain < least_gain:
        return None
    ahead = rough if gain > 1 else np.zeros(len(DEGREES))
    outermost = min(int(FURTHER * reach) * comb.per_turn, furthest * comb.per_turn, most_lines(pulses) // 2)
    spacing = rate / comb.per_turn * (1 + other_rate(ahead[0], pulses))
    starts = [Start(spacing, outermost, changed(ahead))]
    fitted = fit_changing(data, starts, centre, degrees=len(DEGREES), steps=FITTED_STEPS, level_about=data.level_at)
    if fitted is None:
        return None
    ((fit,), _) = fitted
    if not is_sure(fit.ahead, fit.ahead_std) or not change_of(fit.ahead, pulses) < MOST_CHANGE:
        return None
    late = late_by(fit.ahead, pulses)
    return Resampled(Resampling(_continued(data.samples, fit), fit.centre).read(late), data, fit)


def _each_by_itself(data: Periodogram, rate: float, centre: float, reach: int) -> tuple[NDArray[np.float64], float]:
    """Time ahead of a constant-rate rotor, from each line by itself, and the gain in information on the rate.

    The gain is 0 where no change is sure, or it exceeds `MOST_CHANGE`.
    """
    pulses = data.pulses
    orders = np.concatenate([np.arange(-reach, 0), np.arange(1, reach + 1)])
    orders = orders[data.usable(centre + rate * orders)]
    seen, time = _over_time(data.samples, centre + rate * orders)
    # parts count less towards the ends, or each line's neighbours would leak into it
    taper = np.cos(np.pi * time / pulses) ** 2
    taper /= taper.sum()
    shapes = polynomials(time, pulses)
    about = shapes - (shapes @ taper)[:, None]
    products = (about * taper) @ about.T
    noise = data.level_at(centre + rate * orders) / pulses * len(time) * float((taper**2).sum())
    lead = 2 * np.pi * rate * orders
    ahead = np.zeros(len(DEGREES))
    # a linear change c over the dwell puts its ends ahead by c / 8 of it
    order = int(np.clip(8 * FIRST_RAD / (2 * np.pi * MOST_CHANGE * rate * pulses), min(LEAST_ORDERS, reach), reach))
    last = 0
    before = float((lead**2 * _excess(seen @ taper, noise)).sum())
    while True:
        last += order == reach
        few = len(DEGREES) if last else FIRST_DEGREES
        own = np.abs(orders) <= order
        turned = seen[own] * np.exp(-1j * lead[own, None] * (ahead @ shapes))
        amplitude = turned @ taper
        snr = _excess(amplitude, noise[own])
        weight = lead[own] * snr / (1 + snr) / noise[own]
        power = float((lead[own] * weight * squared(amplitude)).sum())
        if not power:
            return ahead, 0.0
        score = (about * taper)[:few] @ ((amplitude.conj()[:, None] * turned).imag.T @ weight)
        covariance = np.linalg.inv(power * products[:few, :few])
        step, std = covariance @ score, np.sqrt(np.diag(covariance) / 2)
        ahead[:few] += step
        if not change_of(ahead, pulses) < MOST_CHANGE:
            return ahead, 0.0
        if last == LAST_STEPS or (last and np.all(np.abs(step) < ENOUGH * std)):
            break
        order = min(int(MORE_ORDERS * order) + 1, reach)
    sure = is_sure(ahead, std, ROUGHLY_SURE)
    return ahead, float((lead**2 * snr).sum()) / max(before, 1e-9) if sure else 0.0


def _excess(amplitude: NDArray[np.complex128], noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of lines over that of noise, less 1, at least 0."""
    return np.maximum(squared(amplitude) / noise - 1, 0)


def _over_time(
    samples: NDArray[np.complex128], frequency: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Amplitude of each line in each part of a dwell, shape (lines, parts), and the parts' middles [samples]."""
    pulses = len(samples)
    length = min(max(pulses // PARTS, 1), LONGEST_PART)
    cut = samples[: pulses // length * length].reshape(-1, length)
    within = np.arange(length) - (length - 1) / 2
    time = np.asarray(np.arange(len(cut)) * length + (length - pulses) / 2, np.float64)
    short = np.exp(-2j * np.pi * frequency[:, None] * within) / length
    return short @ cut.T * np.exp(-2j * np.pi * frequency[:, None] * time), time


def ahead_left(
    data: Periodogram, fits: Sequence[CombFit], rest: NDArray[np.complex128]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time by which rotors are ahead of constant-rate ones, from the residual of their combs.

    Parameters
    ----------
    data : Periodogram
        The record.
    fits : sequence of CombFit
        The combs, of one centre.
    rest : ndarray of complex128, shape (pulses,)
        Residual of the combs.

    Returns
    -------
    ahead, std : ndarray, shape (combs, degrees)
        Coefficients of the first two of `DEGREES`, and standard deviations at the fitted amplitudes [samples], for any
        velocity and constant acceleration of the body: one Gauss-Newton step, close where the change leaves lines
        narrow.
    """
    pulses, frequency = data.pulses, np.concatenate([fit.frequencies for fit in fits])
    amplitudes = np.concatenate([fit.amplitudes for fit in fits])
    leads = [2 * np.pi * fit.spacing * fit.orders for fit in fits]
    shapes = own_polynomials(pulses)[:FIRST_DEGREES]
    turned = [
        sum_of_lines(pulses, fit.frequencies, 1j * lead * fit.amplitudes) for fit, lead in zip(fits, leads, strict=True)
    ]
    still = sum_of_lines(pulses, frequency, 2j * np.pi * amplitudes)
    # derivatives of the record by each polynomial of each rotor, and by the body's velocity and acceleration
    gained = remove_bands(np.concatenate([*(shapes * one for one in turned), shapes * still]), data.strong.bands)
    # what other amplitudes would explain is projected out
    seen = LinesSeen(np.concatenate([gained, rest[None]])).means(frequency).T
    products = notched_products(frequency, pulses, data.strong.bands).plain
    snr = np.concatenate([fit.snr for fit in fits])
    products.flat[:: len(products) + 1] += np.where(lines_at_one_place(frequency, pulses) > 1, 1 / snr, LEAST_RIDGE)
    as_lines = whole(np.asarray(np.linalg.solve(products, parts(seen)), np.float64))
    own = gained.conj() @ np.vstack([gained, rest]).T - pulses * seen[:, :-1].conj().T @ as_lines
    level = float(
        np.average(data.level_of(rest)(frequency), weights=squared(np.concatenate(leads) * amplitudes) + 1e-30)
    )
    information, score = 2 * own[:, :-1].real / level, 2 * own[:, -1].real / level
    covariance = inverse_of(information)
    step, std = covariance @ score, np.sqrt(np.diag(covariance) * data.ends_noise)
    each = (len(fits), FIRST_DEGREES)
    return step[:-FIRST_DEGREES].reshape(each), std[:-FIRST_DEGREES].reshape(each)
