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
from .lines import against_lines, middle_times, squared, sum_of_lines
from .periodogram import Periodogram
from .slow_lines import notched_products, parts, remove_bands, whole

#: How far a rotor is ahead of an even one is a sum of Legendre polynomials in time, of these degrees. The first is
#: another rate, the second one that changes evenly.
DEGREES = (1, 2, 3, 4, 5)

#: Lines are seen in so many parts of the dwell, or parts of so many samples where those are longer: within one of them
#: hardly a line turns out of phase.
PARTS, LONGEST_PART = 64, 48

#: A rate departs from its mean by no more than this share of it.
MOST_CHANGE = 0.06

#: The change is sought by the inner orders first, on which an even one that large has about this effect [rad], and then
#: by so many times more of them, up to all. Before that it is taken to be even: the first so many degrees.
FIRST_RAD, MORE_ORDERS, LEAST_ORDERS, FIRST_DEGREES = 1.0, 1.3, 4, 2

#: Steps at all orders, at most; they end after one below this many standard deviations.
LAST_STEPS, ENOUGH = 6, 0.1

#: Steps after that, each from a fit of all lines, at most, out to so many times the edge, which smeared lines hide.
FITTED_STEPS, FURTHER = 8, 2.0

#: Steps to the time at which an even rotor has turned as far: each leaves of what the one before did the share by which
#: the rate changes.
FIXED_STEPS = 4

#: At each end so many samples, in which a comb that goes on fades out, beside those that may be read keep a record
#: from a step where it repeats.
FADING = 64

#: So near to its ends a record holds what the step there, where notches end as well, makes of it [samples].
END_SAMPLES = 8

#: A change is one where it is sure by so many standard deviations; by each line over the dwell, which says less, by
#: so many.
SURE_DEVIATIONS, ROUGHLY_SURE = 5.0, 3.0


@dataclass(frozen=True)
class Straightened:
    """A record as if its rotor had turned evenly.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Its samples, those of `Periodogram` read at other times; the body's line is what it was.
    within : ndarray of bool, shape (pulses,)
        False near the ends, where they are as the comb would go on and not what was measured.
    bend : float
        By how much the rate changed evenly, relative [1 / sample].
    """

    samples: NDArray[np.complex128]
    within: NDArray[np.bool_]
    bend: float


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
    spectrum = fft.fftshift(fft.fft(samples * np.exp(-2j * np.pi * centre * middle_times(size))))
    # a spectrum's samples seen by a unit line are the record's at a time
    place = (np.arange(pulses) + (size - pulses) / 2 + late) / size
    off = size // 2 - (size - 1) / 2  # of the spectrum's zero from its middle
    read = against_lines(spectrum[None], -place)[0]
    return np.asarray(read * np.exp(2j * np.pi * (centre * middle_times(pulses) - off * place)), np.complex128)


def _within(late: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True where samples are read from well within a record, by how much later each is read [samples]."""
    place = np.arange(len(late)) + late
    return (place >= END_SAMPLES) & (place <= len(late) - 1 - END_SAMPLES)


def _continued(samples: NDArray[np.complex128], fit: CombFit, ahead: NDArray[np.float64]) -> NDArray[np.complex128]:
    """A record with margins in which its comb goes on and fades out: it repeats without a step between its ends.

    `fit` is of the record as it is with `ahead` taken out.
    """
    pulses = len(samples)
    margin = FADING + int(MOST_CHANGE * pulses / 6)
    away = np.arange(1, margin + 1)
    time = np.concatenate([-away[::-1], away]) + np.repeat([-1, 1], margin) * (pulses - 1) / 2
    even = time + _changed(ahead) @ _shapes(time, pulses)
    lines = (
        np.exp(2j * np.pi * (fit.frequencies * even[:, None] - fit.centre * (even - time)[:, None])) @ fit.amplitudes
    )
    fade = np.cos(np.pi / 2 * away / (margin + 1)) ** 2
    return np.concatenate([lines[:margin] * fade[::-1], samples, lines[margin:] * fade])


def straightened(data: Periodogram, comb: Comb, edge: float, *, narrow: bool, least_gain: float) -> Straightened | None:
    """Take out of a record what its rotor's rate changed by.

    By Gauss-Newton steps on the phases of the comb's lines over the dwell: first of each line by itself, from the inner
    orders outwards, then of all together.

    Parameters
    ----------
    data : Periodogram
        The record.
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
    reaches, spacing = [(-outermost, outermost)], rate / comb.per_turn
    endless = _continued(data.samples, comb.fit, np.zeros(len(DEGREES)))
    for _ in range(FITTED_STEPS):
        spacing *= 1 + other_rate(ahead[0], pulses)
        late = _late(ahead, pulses)
        even = data.left(remove_bands(resampled(endless, centre, late), data.bands))
        fitted = fit_combs(even, centre, [spacing], reaches)
        if fitted is None:
            return None
        (fit,), rest = fitted
        endless = _continued(data.samples, fit, ahead)
        step, std = ahead_left(even, fit, rest * _within(late))
        ahead, spacing = np.append(step[0], ahead[1:] + step[1:]), fit.spacing
        if not is_sure(ahead, std) or not _change(ahead, pulses) < MOST_CHANGE:
            return None
        if np.all(np.abs(step[1:]) < ENOUGH * std[1:]):
            break
    late = _late(ahead, pulses)
    return Straightened(resampled(endless, centre, late), _within(late), bend(ahead, pulses))


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
    """True where a rate changes evenly for sure, by polynomials of `DEGREES` and their deviations [samples]."""
    return bool(abs(ahead[1]) > deviations * std[1])


def bend(ahead: NDArray[np.float64], pulses: int) -> float:
    """Even relative change of the rate a sample that puts a rotor so far ahead."""
    return 12 * float(ahead[1]) / pulses**2


def other_rate(ahead: float, pulses: int) -> float:
    """Relative difference of the mean rate that puts a rotor so far ahead, by the first of `DEGREES`."""
    return 2 * float(ahead) / pulses


def _changed(ahead: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far ahead a rotor is by the change of its rate, without what another mean rate makes of it [samples]."""
    return np.asarray(ahead * (np.array(DEGREES) > 1), np.float64)


def _late(ahead: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """By how much later than an even rotor one that is ahead has turned as far, but for another rate [samples]."""
    time, late = middle_times(pulses), np.zeros(pulses)
    for _ in range(FIXED_STEPS):
        late = -_changed(ahead) @ _shapes(time + late, pulses)
    return late


def _excess(amplitude: NDArray[np.complex128], noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of lines over that of noise, without it, at least 0."""
    return np.maximum(squared(amplitude) / noise - 1, 0)


def _over_time(
    samples: NDArray[np.complex128], frequency: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """What unit lines see in each part of a dwell, shape (lines, parts), and the parts' middles [samples]."""
    pulses = len(samples)
    length = min(max(pulses // PARTS, 1), LONGEST_PART)
    cut = samples[: pulses // length * length].reshape(-1, length)
    within = np.arange(length) - (length - 1) / 2
    time = np.asarray(np.arange(len(cut)) * length + (length - pulses) / 2, np.float64)
    short = np.exp(-2j * np.pi * frequency[:, None] * within) / length
    return short @ cut.T * np.exp(-2j * np.pi * frequency[:, None] * time), time


def _change(ahead: NDArray[np.float64], pulses: int) -> float:
    """How far the rate departs from the one that was known, relative."""
    return float(np.abs(np.diff(ahead @ _shapes(middle_times(pulses), pulses))).max())


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
        Of each of `DEGREES`, and standard deviations at the fitted amplitudes [samples], whatever velocity and even
        acceleration the body has: one Gauss-Newton step, near to the truth where the change leaves the lines narrow.
    """
    pulses, frequency = data.pulses, fit.frequencies
    shapes = _shapes(middle_times(pulses), pulses)
    lead = 2 * np.pi * fit.spacing * fit.orders
    turned, still = (sum_of_lines(pulses, frequency, 1j * a * fit.amplitudes) for a in (lead, 2 * np.pi))
    # what the record gains by each polynomial, and by another velocity or an acceleration of the body
    gained = np.concatenate([shapes * turned, shapes[:2] * still])
    # what other amplitudes would make of it does not count
    seen = against_lines(np.concatenate([gained, rest[None]]), frequency).T
    products = notched_products(frequency, pulses, data.bands).plain
    products.flat[:: len(products) + 1] += LEAST_RIDGE
    as_lines = whole(np.asarray(np.linalg.solve(products, parts(seen)), np.float64))
    own = gained.conj() @ np.vstack([gained, rest]).T - pulses * seen[:, :-1].conj().T @ as_lines
    level = float(np.average(data.level_of(rest)(frequency), weights=squared(lead * fit.amplitudes) + 1e-30))
    information, score = 2 * own[:, :-1].real / level, 2 * own[:, -1].real / level
    covariance = np.linalg.pinv(information, hermitian=True)
    step, std = covariance @ score, np.sqrt(np.maximum(np.diag(covariance), 0))
    return step[: len(DEGREES)], std[: len(DEGREES)]
