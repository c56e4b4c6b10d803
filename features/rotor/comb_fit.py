"""Combs fitted line by line, several jointly: spacings and centre to a fraction of a bin, with the bound's variance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lines import LinesSeen, sum_of_lines
from .folding import comes_back, outermost_orders
from .periodogram import LEAST_LEVEL, Level, Periodogram
from .slow_lines import LineProducts, notched_products, parts, remove_bands, times, whole

#: STEPS: most Gauss-Newton steps. They end after a step below ENOUGH standard deviations: the next would be a tenth of
#: it.
STEPS = 8
ENOUGH = 0.1

#: Orders to each side over which line powers are averaged to weigh the lines.
SMOOTHED_ORDERS = 2

#: Added to one over the lines' snr: a line half inside a band that was taken out has little power left to fit.
LEAST_RIDGE = 1e-6

#: Added besides where the Cholesky factor fails.
NOTCH_RIDGE = 1e-2

#: Well above this snr the amplitude of an isolated line is not shrunk: what that leaves would bias other lines.
CLEAR_SNR = 30.0

#: Lines nearer than this share the power seen there [bins].
ONE_BINS = 1.0

#: Orders fitted beyond the outermost with evidence for the comb: what they hold must not leak into the others.
MARGIN_ORDERS = 3


@dataclass(frozen=True)
class CombFit:
    """A comb of lines at centre + order x spacing.

    Parameters
    ----------
    spacing, centre : float
        [cycles a sample].
    spacing_std, centre_std : float
        Their standard deviations [cycles a sample].
    orders : ndarray of int, shape (lines,)
        Orders of the lines that take part.
    amplitudes : ndarray of complex128, shape (lines,)
        Their amplitudes, shrunk as far as noise requires, in units of the noise's rms a sample.
    snr : ndarray of float64, shape (lines,)
        Power of each line over the local noise of a bin, smoothed over neighbouring orders [1].
    """

    spacing: float
    centre: float
    spacing_std: float
    centre_std: float
    orders: NDArray[np.intp]
    amplitudes: NDArray[np.complex128]
    snr: NDArray[np.float64]

    @property
    def outermost(self) -> int:
        """Its outermost order to either side, the margin included."""
        return int(np.abs(self.orders).max(initial=0))

    @property
    def is_folded(self) -> bool:
        """Whether its outer lines come back from the other end of the span."""
        return bool(comes_back(self.outermost, self.spacing))

    @property
    def reach(self) -> tuple[int, int]:
        """Outermost orders, without the margin beyond them that was fitted as well: low <= 0 <= high."""
        margin = 0 if self.is_folded else MARGIN_ORDERS
        return min(int(self.orders.min()) + margin, 0), max(int(self.orders.max()) - margin, 0)

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Where its lines are [cycles a sample]."""
        return np.asarray(self.centre + self.spacing * self.orders, np.float64)

    def amplitudes_at(self, orders: NDArray[np.intp]) -> NDArray[np.complex128]:
        """Amplitudes of its lines of these orders, 0 where it has none, same shape."""
        widest = max(int(np.abs(orders).max(initial=0)), self.outermost)
        table = np.zeros(2 * widest + 1, np.complex128)
        table[widest + self.orders] = self.amplitudes
        return table[widest + orders]

    def seen_beside(self, rest: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Amplitudes of its lines, not shrunk, given the residual of all combs in the record, shape (lines,)."""
        return self.amplitudes + LinesSeen(rest[None]).means(self.frequencies)[0]


def over_orders(
    comb: NDArray[np.intp], order: NDArray[np.intp], used: NDArray[np.bool_]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Means over used neighbouring orders of the same comb; combs one after the other, orders rising."""
    place = order + comb * (2 * np.abs(order).max() + 4 * SMOOTHED_ORDERS)
    known = place[used]
    first = np.searchsorted(known, place - SMOOTHED_ORDERS)
    last = np.searchsorted(known, place + SMOOTHED_ORDERS, side="right")
    alone = first == last  # then the next used ones to either side
    first, last = np.maximum(first - alone, 0), np.minimum(last + alone, len(known))

    def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.concatenate([[0.0], np.cumsum(values[used])])
        return np.asarray((sums[last] - sums[first]) / (last - first), np.float64)

    return smooth


def orders_within(data: Periodogram, centre: float, spacing: float, reach: tuple[int, int]) -> NDArray[np.intp]:
    """Orders of the lines to fit: `MARGIN_ORDERS` past the outermost, and none that were taken out."""
    (low, high), widest = reach, int(0.49 / spacing)
    if comes_back(max(high, -low), spacing):
        widest = int(outermost_orders(data, spacing))
    own = np.arange(max(low - MARGIN_ORDERS, -widest), min(high + MARGIN_ORDERS, widest) + 1)
    return np.asarray(own[~data.removed(centre + spacing * own)], np.intp)


def lines_at_one_place(frequency: NDArray[np.float64], pulses: int) -> NDArray[np.intp]:
    """How many lines, itself among them, lie within `ONE_BINS` of each."""
    first, last = np.sort(frequency).searchsorted(frequency + np.array([[-ONE_BINS], [ONE_BINS]]) / pulses)
    return np.asarray(last - first, np.intp)


def ridges(snr: NDArray[np.float64], together: NDArray[np.intp], used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Ridge that shrinks the amplitudes, added to the lines' products with themselves.

    Parameters
    ----------
    snr : ndarray, shape (lines,)
        Power of each over the noise of a bin.
    together : ndarray, shape (lines,)
        From `lines_at_one_place`. Overlapping lines are shrunk however strong they are: otherwise they come out as
        large ones that cancel.
    used : ndarray of bool, shape (lines,)
        Lines not used are shrunk too: so little is left of one half inside a band taken out that anything would explain
        it.
    """
    let_go = np.where(used & (together == 1), 1 + (snr / CLEAR_SNR) ** 2, 1.0)
    return np.asarray(1 / (snr * let_go) + LEAST_RIDGE, np.float64)


def _factored(plain: NDArray[np.float64], ridge: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Cholesky factor of symmetric products with a ridge, and whether that failed."""
    from scipy.linalg import lapack  # here, because predicting needs no such import

    ridged = plain.copy()
    ridged.flat[:: len(ridged) + 1] += ridge
    factor, failed = lapack.dpotrf(ridged.T, overwrite_a=True)
    return np.asarray(factor, np.float64), int(failed)


def _fisher(
    weighed: NDArray[np.complex128],
    design: NDArray[np.float64],
    factor: NDArray[np.float64],
    products: LineProducts,
    pulses: int,
) -> NDArray[np.float64]:
    """Fisher matrix of centre and spacings with the amplitudes eliminated.

    `weighed` are the amplitudes over the rms of the noise about them. The other arguments are those of `fit_combs`: the
    products of the lines, and the factor of the plain ones.
    """
    from scipy.linalg import lapack

    sway = np.asarray(weighed[:, None] * design, np.complex128)
    leaked = products.with_time(sway)
    kept = whole(lapack.dpotrs(factor, parts(leaked))[0])
    fisher = (sway.conj().T @ products.with_time_squared(sway) - leaked.conj().T @ kept).real
    fisher *= 8 * np.pi**2 * pulses
    fisher.flat[:: len(fisher) + 1] *= 1 + 1e-9
    return np.asarray(fisher, np.float64)


def fit_combs(
    data: Periodogram,
    centre: float,
    spacings: Sequence[float],
    reaches: Sequence[tuple[int, int]],
    steps: int = STEPS,
    *,
    level_about: Level | None = None,
    own_centres: bool = False,
) -> tuple[list[CombFit], NDArray[np.complex128]] | None:
    """Refine combs about one centre, jointly, by Gauss-Newton steps on the frequencies of their lines.

    Amplitudes of lines are complex Gaussian with the power seen about them, in noise; given the frequencies their means
    are a linear estimate, so that no line leaks into its neighbours. The steps and the variances come from the Fisher
    matrix of centre and spacings with the amplitudes eliminated, at the estimated amplitudes: for one comb the
    Cramer-Rao bound for unknown body frequency, with each line's snr replaced by snr^2 / (1 + snr).

    Parameters
    ----------
    data : Periodogram
        The record.
    centre : float
        Start of the centre [cycles a sample].
    spacings : sequence of float
        Starts of the spacings [cycles a sample].
    reaches : sequence of (int, int)
        Outermost orders of each, low <= 0 <= high.
    steps : int
        Steps at most, >= 1.
    level_about : callable, optional
        Local level without the combs known already: the first step takes the level about the lines from it.
    own_centres : bool
        Each comb has a centre of its own, all start at the one given.

    Returns
    -------
    (list of CombFit, ndarray of complex128 of shape (pulses,)) or None
        A fit for each spacing and the residual samples. None where a comb has fewer than three usable lines, or lines
        overlap too closely.
    """
    from scipy.linalg import lapack  # here, because predicting needs no such import

    pulses = data.pulses
    which, orders = [], []
    for number, (spacing, reach) in enumerate(zip(spacings, reaches, strict=True)):
        own = orders_within(data, centre, spacing, reach)
        orders.append(own)
        which.append(np.full(len(own), number))
    count = len(orders)
    comb, order = np.concatenate(which), np.concatenate(orders)
    centres = count if own_centres else 1
    values = np.array([*[centre] * centres, *spacings])
    own_centre = comb if own_centres else np.zeros(len(comb), np.intp)

    def frequencies() -> NDArray[np.float64]:
        return np.asarray(values[own_centre] + values[centres + comb] * order, np.float64)

    frequency = frequencies()
    used = data.usable(frequency)
    if min(np.bincount(comb, used, count)) < 3:
        return None
    # change of each line's frequency with the centres and the spacings
    design = np.zeros((len(order), centres + count))
    design[np.arange(len(order)), own_centre] = 1.0
    design[np.arange(len(order)), centres + comb] = order
    smooth = over_orders(comb, order, used)
    limit = np.array([0.5] * centres + [0.5 / max(1, np.abs(own).max()) for own in orders]) / pulses
    # lines of several combs take out so much of the noise that their residual says little of it
    least = LEAST_LEVEL if count == 1 else 1.0
    snr = np.full(len(order), np.inf)
    level = data.level_at(frequency) if level_about is None else np.maximum(level_about(frequency), least)

    def left_by(frequency: NDArray[np.float64], amplitudes: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return remove_bands(data.samples - sum_of_lines(pulses, frequency, amplitudes), data.strong.bands)

    for number in range(steps):
        seen, moment = data.lines.at(frequency)
        products = notched_products(frequency, pulses, data.strong.bands)
        # overlapping lines may come out as large ones that cancel: together they hold no more than is seen
        most = smooth(np.abs(seen) ** 2 * pulses / level) - 1
        together = lines_at_one_place(frequency, pulses)
        snr = np.minimum(snr, np.maximum(most / together, 1e-3))
        held_back = ridges(snr, together, used)
        factor, failed = _factored(products.plain, held_back)
        if failed:  # the notch's table is slightly off where nearly all was taken out
            factor, failed = _factored(products.plain, held_back + NOTCH_RIDGE)
        if failed:
            return None
        amplitudes: NDArray[np.complex128] = whole(lapack.dpotrs(factor, parts(seen))[0])[:, 0]
        left = seen - times(products.plain, amplitudes)
        snr = np.maximum(smooth(np.abs(amplitudes + left) ** 2 * pulses / level) - 1, 1e-3)
        slope = moment - 1j * products.time_with(amplitudes)[:, 0]
        # the score of each line's frequency, and the Fisher matrix of centre and spacings
        pull = np.where(used, (amplitudes.conj() * slope).imag / level * (4 * np.pi * pulses), 0.0)
        fisher = _fisher(amplitudes * used / np.sqrt(level), design, factor, products, pulses)
        step = np.linalg.solve(fisher, design.T @ pull)
        step = np.clip(step, -limit, limit)
        values = values + step
        frequency = frequencies()
        if number == steps - 1 or (number and np.all(step**2 * np.diag(fisher) < ENOUGH**2)):
            break
        # leakage of the lines lifts the level between them: once fitted, it is taken from their residual
        level = np.maximum(data.level_of(left_by(frequency, amplitudes))(frequency), least)
    variance = np.diag(np.linalg.inv(fisher))
    std = np.sqrt(np.where(variance > 0, variance, np.inf) * data.ends_noise)  # rounding may make unknown ones negative
    out = []
    for number in range(count):
        own, middle = (comb == number) & used, number if own_centres else 0
        out.append(
            CombFit(
                float(values[centres + number]),
                float(values[middle]),
                float(std[centres + number]),
                float(std[middle]),
                order[own],
                amplitudes[own],
                snr[own],
            )
        )
    # the amplitudes change little with the last step
    return out, left_by(frequency, amplitudes)
