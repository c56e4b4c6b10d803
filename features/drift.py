"""A rotor whose rate changes within the dwell: by how much, and the record as if it had turned evenly.

Such a rotor's lines widen with their order and fill what lies between them, as those of several rotors do. Read at the
times at which an even rotor has turned as far, counted about the body's line, they are narrow again, all at once. Hover
is full of it: in the measured recordings a multirotor's rates change by one or two parts in a hundred within 80 ms.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .comb import Comb
from .comb_fit import LEAST_RIDGE, CombFit, fit_combs
from .lines import LineSpace, against_lines, squared, sum_of_lines
from .periodogram import Periodogram
from .slow_lines import notched_products, remove_bands, times

#: How far a rotor is ahead of an even one is a sum of Legendre polynomials in time, of these degrees. The first is
#: another rate, the second one that changes evenly.
DEGREES = (1, 2, 3, 4, 5)

#: Lines are seen in so many parts of the dwell, at least: within one of them no line turns out of phase.
PARTS = 64

#: The change is sought by the inner orders first, on which it has no more effect than this [rad] if the rate changes by
#: so much over the dwell, relative, and then by so many times more of them, up to all. Before that it is an even one:
#: the first so many degrees.
FIRST_DEGREES = 2
FIRST_RAD, MOST_CHANGE, MORE_ORDERS, LEAST_ORDERS = 1.0, 0.06, 1.3, 4

#: Steps at all orders, at most; they end after one below this many standard deviations.
LAST_STEPS, ENOUGH = 6, 0.1

#: Steps after that, each from a fit of all lines, at most, out to so many times the edge, which smeared lines hide.
FITTED_STEPS, FURTHER = 8, 2.0

#: Steps to the time at which an even rotor has turned as far: each leaves a hundredth of what the one before did.
FIXED_STEPS = 3

#: So many samples at each end, in which a comb that goes on fades out, keep a record from a step where it repeats.
MARGIN = 64

#: A change is one where it is sure by so many standard deviations; by each line over the dwell, which says less, by
#: so many.
SURE_DEVIATIONS, ROUGHLY_SURE = 5.0, 3.0


@dataclass(frozen=True)
class Straightened:
    """A record as if its rotor had turned evenly.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Its samples; the body's line is what it was.
    bend : float
        By how much the rate changed evenly, relative [1 / sample].
    """

    samples: NDArray[np.complex128]
    bend: float


def _time(pulses: int) -> NDArray[np.float64]:
    """Of each sample, from the middle of the dwell [samples]."""
    return np.asarray(np.arange(pulses) - (pulses - 1) / 2, np.float64)


def _shapes(time: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """The polynomials of `DEGREES` at times from the middle of the dwell [samples], shape (degrees, times)."""
    values = np.polynomial.legendre.legvander(2 * time / pulses, max(DEGREES)).T[list(DEGREES)]
    return np.asarray(values, np.float64)


def resampled(samples: NDArray[np.complex128], centre: float, late: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Samples read at other times, about a line that stays.

    Parameters
    ----------
    samples : ndarray of complex128, shape (margin + pulses + margin,)
        A record and what comes before and after it; the whole is taken to repeat.
    centre : float
        Frequency of the line [cycles a sample].
    late : ndarray, shape (pulses,)
        By how much later each is read [samples].

    Returns
    -------
    ndarray of complex128, shape (pulses,)
    """
    size, pulses = len(samples), len(late)
    spectrum = fft.fftshift(fft.fft(samples * np.exp(-2j * np.pi * centre * _time(size))))
    # a spectrum's samples seen by a unit line are the record's at a time
    place = (np.arange(pulses) + (size - pulses) / 2 + late) / size
    off = size // 2 - (size - 1) / 2  # of the spectrum's zero from its middle
    read = LineSpace(spectrum).at(-place)[0]
    return np.asarray(read * np.exp(2j * np.pi * (centre * _time(pulses) - off * place)), np.complex128)


def _continued(samples: NDArray[np.complex128], fit: CombFit, ahead: NDArray[np.float64]) -> NDArray[np.complex128]:
    """A record with margins in which its comb goes on and fades out: it repeats without a step between its ends.

    `fit` is of the record as it is with `ahead` taken out.
    """
    pulses = len(samples)
    away = np.arange(1, MARGIN + 1)
    time = np.concatenate([-away[::-1], away]) + np.repeat([-1, 1], MARGIN) * (pulses - 1) / 2
    even = time + (ahead * (np.array(DEGREES) > 1)) @ _shapes(time, pulses)
    lines = (
        np.exp(2j * np.pi * (fit.frequencies * even[:, None] - fit.centre * (even - time)[:, None])) @ fit.amplitudes
    )
    fade = np.cos(np.pi / 2 * away / (MARGIN + 1)) ** 2
    return np.concatenate([lines[:MARGIN] * fade[::-1], samples, lines[MARGIN:] * fade])


def straightened(
    samples: NDArray[np.complex128], data: Periodogram, comb: Comb, edge: float, *, narrow: bool, least_gain: float
) -> Straightened | None:
    """Take out of a record what its rotor's rate changed by.

    By Gauss-Newton steps on the phases of the comb's lines over the dwell: first of each line by itself, from the inner
    orders outwards, then of all together.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        The record over the rms of its noise, nothing taken out: a band that was would be smeared.
    data : Periodogram
        The same from `prepare`.
    comb : Comb
        The comb found in it.
    edge : float
        Edge of the line family [cycles a sample from the body].
    narrow : bool
        True where the change leaves the lines narrow: all together will do.
    least_gain : float
        What each line by itself must at least tell of the rate once the change is taken out, over what it told before.

    Returns
    -------
    Straightened or None
        None where no change is sure, or it is larger than `MOST_CHANGE`.
    """
    pulses, rate, centre = data.pulses, comb.chopping, comb.fit.centre
    furthest = max(int(0.45 / rate), 1)
    reach = min(max(comb.last // comb.per_turn, round(edge / rate), LEAST_ORDERS), furthest)
    ahead, gain = np.zeros(len(DEGREES)), 0.0
    if not narrow:
        rough, gain = _each_by_itself(data, rate, centre, reach)
        ahead = rough if gain > 1 else ahead
    if gain < least_gain:
        return None
    outermost = min(int(FURTHER * reach), furthest) * comb.per_turn
    lines, spacing = [(-outermost, outermost)], rate / comb.per_turn
    whole = _continued(samples, comb.fit, np.zeros(len(DEGREES)))
    for _ in range(FITTED_STEPS):
        spacing *= 1 + 2 * float(ahead[0]) / pulses
        even = data.left(remove_bands(resampled(whole, centre, _late(ahead, pulses)), data.bands))
        fitted = fit_combs(even, centre, [spacing], lines)
        if fitted is None:
            return None
        (fit,), rest = fitted
        whole = _continued(samples, fit, ahead)
        step, std = ahead_left(even, fit, rest)
        ahead, spacing = np.append(step[0], ahead[1:] + step[1:]), fit.spacing
        if not _change(ahead, pulses) < MOST_CHANGE:
            return None
        if np.all(np.abs(step[1:]) < ENOUGH * std[1:]):
            break
    if not is_sure(ahead, std):
        return None
    return Straightened(resampled(whole, centre, _late(ahead, pulses)), bend(ahead, pulses))


def _each_by_itself(data: Periodogram, rate: float, centre: float, reach: int) -> tuple[NDArray[np.float64], float]:
    """How far ahead of an even rotor one is, by each line over the dwell, and what the lines then tell over before.

    That is 0 where no change is sure, or it is larger than `MOST_CHANGE`.
    """
    pulses = data.pulses
    orders = np.concatenate([np.arange(-reach, 0), np.arange(1, reach + 1)])
    orders = orders[data.usable(centre + rate * orders)]
    seen, time = _over_time(data.samples, centre + rate * orders)
    # towards the ends parts count less, or each line's neighbours would leak into it
    taper = np.cos(np.pi * time / pulses) ** 2
    taper /= taper.sum()
    shapes = _shapes(time, pulses)
    about = shapes - (shapes @ taper)[:, None]
    products = (about * taper) @ about.T
    noise = data.level_at(centre + rate * orders) / pulses * len(time) * float((taper**2).sum())
    lead = 2 * np.pi * rate * orders
    ahead = np.zeros(len(DEGREES))
    # an even change of the whole puts the ends ahead by an eighth of it
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
        if not _change(ahead, pulses) < MOST_CHANGE:
            return ahead, 0.0
        if last == LAST_STEPS or (last and np.all(np.abs(step) < ENOUGH * std)):
            break
        order = min(int(MORE_ORDERS * order) + 1, reach)
    sure = is_sure(ahead, std, ROUGHLY_SURE)
    return ahead, float((lead**2 * snr).sum()) / max(before, 1e-9) if sure else 0.0


def is_sure(ahead: NDArray[np.float64], std: NDArray[np.float64], deviations: float = SURE_DEVIATIONS) -> bool:
    """True where a rate changes for sure, by polynomials of `DEGREES` and their deviations [samples]."""
    return bool(np.any(np.abs(ahead[1:]) > deviations * std[1:]))


def bend(ahead: NDArray[np.float64], pulses: int) -> float:
    """Even relative change of the rate a sample that puts a rotor so far ahead."""
    return 12 * float(ahead[1]) / pulses**2


def _late(ahead: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """By how much later than an even rotor one that is ahead has turned as far, but for another rate [samples]."""
    own = ahead * (np.array(DEGREES) > 1)
    time, late = _time(pulses), np.zeros(pulses)
    for _ in range(FIXED_STEPS):
        late = -own @ _shapes(time + late, pulses)
    return late


def _excess(amplitude: NDArray[np.complex128], noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of lines over that of noise, without it, at least 0."""
    return np.maximum(squared(amplitude) / noise - 1, 0)


def _over_time(
    samples: NDArray[np.complex128], frequency: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """What unit lines see in each part of a dwell, shape (lines, parts), and the parts' middles [samples]."""
    pulses = len(samples)
    length = max(pulses // PARTS, 1)
    parts = samples[: pulses // length * length].reshape(-1, length)
    within = np.arange(length) - (length - 1) / 2
    time = np.asarray(np.arange(len(parts)) * length + (length - pulses) / 2, np.float64)
    short = np.exp(-2j * np.pi * frequency[:, None] * within) / length
    return short @ parts.T * np.exp(-2j * np.pi * frequency[:, None] * time), time


def _change(ahead: NDArray[np.float64], pulses: int) -> float:
    """How far the rate departs from the one that was known, relative."""
    return float(np.abs(np.diff(ahead @ _shapes(_time(pulses), pulses))).max())


def ahead_left(
    data: Periodogram, fit: CombFit, rest: NDArray[np.complex128]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far ahead of an even rotor a comb's is, by what its lines leave.

    Parameters
    ----------
    data : Periodogram
        The record.
    fit : CombFit
        The comb.
    rest : ndarray of complex128, shape (pulses,)
        Samples that it leaves.

    Returns
    -------
    ahead, std : ndarray, shape (degrees,)
        Of each of `DEGREES`, and standard deviations at the fitted amplitudes [samples]: one Gauss-Newton step, near to
        the truth where the change leaves the lines narrow.
    """
    pulses, frequency = data.pulses, fit.frequencies
    lead = 2 * np.pi * fit.spacing * fit.orders
    turned = 1j * lead * fit.amplitudes
    # what the record gains by each polynomial, without what other amplitudes would make of it
    gained = _shapes(_time(pulses), pulses) * sum_of_lines(pulses, frequency, turned)
    seen = against_lines(gained, frequency)
    products = notched_products(frequency, pulses, data.bands).plain
    products.flat[:: len(products) + 1] += LEAST_RIDGE
    as_lines = times(np.asarray(np.linalg.inv(products), np.float64), seen.T)
    own = np.stack([g - sum_of_lines(pulses, frequency, line) for g, line in zip(gained, as_lines.T, strict=True)])
    level = float(np.average(data.level_of(rest)(frequency), weights=squared(turned) + 1e-30))
    information = 2 * (own @ own.conj().T).real / level
    score = 2 * (own.conj() @ rest).real / level
    covariance = np.linalg.pinv(information, hermitian=True)
    return covariance @ score, np.sqrt(np.maximum(np.diag(covariance), 0))
