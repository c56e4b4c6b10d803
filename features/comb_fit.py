"""A comb fitted line by line: spacing and centre below the bin, with the variance the bound gives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .comb_search import Candidate
from .periodogram import Periodogram

#: Gauss-Newton steps; the error of the start falls by an order of magnitude at each.
STEPS = 5

#: Orders to each side over which line powers are averaged to weigh the lines.
SMOOTHED_ORDERS = 2

#: Lines beyond the outermost that speak for the comb, fitted with it: what they hold must not leak into the others.
MARGIN_ORDERS = 3

#: The level under the lines is not taken to be below this share of the record's floor: the fit takes noise out too.
LEAST_LEVEL = 0.8


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
        Their amplitudes, least squares, in units of the noise's rms a sample.
    snr : ndarray of float64, shape (lines,)
        Power of each line over the local noise of a bin, smoothed over neighbouring orders [1].
    score : float
        Log likelihood ratio of the search [nats].
    """

    spacing: float
    centre: float
    spacing_std: float
    centre_std: float
    orders: NDArray[np.intp]
    amplitudes: NDArray[np.complex128]
    snr: NDArray[np.float64]
    score: float


def line_matrix(pulses: int, centre: float, spacing: float, orders: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Unit lines, shape (lines, pulses), with time counted from the middle of the record."""
    time = np.arange(pulses) - (pulses - 1) / 2
    step = np.exp(2j * np.pi * spacing * time)
    out = np.empty((len(orders), pulses), np.complex128)
    for row, order in enumerate(orders):
        if row and order == orders[row - 1] + 1:
            np.multiply(out[row - 1], step, out=out[row])
        else:
            out[row] = np.exp(2j * np.pi * (centre + order * spacing) * time)
    return out


def dirichlet(frequencies: NDArray[np.floating], pulses: int) -> NDArray[np.float64]:
    """Inner products of unit lines over the record's length, shape (lines, lines)."""
    difference = frequencies[:, None] - frequencies[None, :]
    below = pulses * np.sin(np.pi * difference)
    safe = np.where(np.abs(below) < 1e-9, 1.0, below)
    return np.where(np.abs(below) < 1e-9, 1.0, np.sin(np.pi * pulses * difference) / safe)


def smoothed(power: NDArray[np.float64], orders: NDArray[np.intp]) -> NDArray[np.float64]:
    """Mean of values over orders near each, itself included."""
    near = np.abs(orders[:, None] - orders[None, :]) <= SMOOTHED_ORDERS
    return (near @ power) / near.sum(axis=1)


def fit_comb(data: Periodogram, start: Candidate) -> CombFit | None:
    """Refine a candidate by Gauss-Newton steps on the frequencies of its lines.

    The lines are fitted jointly, so that no line leaks into its neighbours' frequencies. Each line's frequency error is
    read off its phase slope; a weighted regression on the order gives the steps of the centre and the spacing.

    The stated variance is the Cramer-Rao bound for unknown body frequency with each line's snr replaced by
    snr^2 / (1 + snr): near the noise a line's own phase is uncertain too.

    Parameters
    ----------
    data : Periodogram
        The record.
    start : Candidate
        From the search.

    Returns
    -------
    CombFit or None
        None where fewer than three usable lines are left.
    """
    widest = int(0.49 / start.spacing)
    orders = np.arange(max(start.low - MARGIN_ORDERS, -widest), min(start.high + MARGIN_ORDERS, widest) + 1)
    frequency = start.centre + start.spacing * orders
    orders = orders[~data.removed(frequency)]
    used = data.usable(start.centre + start.spacing * orders)
    if used.sum() < 3:
        return None
    pulses = data.pulses
    time = np.arange(pulses) - (pulses - 1) / 2
    moment = (pulses**2 - 1) / 12
    centre, spacing = start.centre, start.spacing
    information = np.zeros((2, 2))
    rest = data.samples
    for number in range(STEPS):
        frequency = centre + spacing * orders
        lines = line_matrix(pulses, centre, spacing, orders)
        # what the lines leak lifts the level between them: once they are fitted, it is taken from what they leave
        level = data.level_at(frequency) if number == 0 else np.maximum(data.level_of(rest)(frequency), LEAST_LEVEL)
        seen = lines.conj() @ data.samples / pulses
        power = np.abs(seen) ** 2 * pulses / level
        snr = np.maximum(smoothed(power, orders) - 1, 1e-3)
        gram = dirichlet(frequency, pulses) + np.diag(1 / snr)
        amplitudes = np.asarray(np.linalg.solve(gram, seen), np.complex128)
        rest = data.samples - amplitudes @ lines
        slope = (lines.conj() @ (time * rest)) / pulses
        # each line's own frequency error, times its weight: Im(conj(a) slope) = |a|^2 moment x 2 pi error
        pull = (amplitudes.conj() * slope).imag / level * pulses
        pull = np.where(used, pull, 0.0)
        weight = np.where(used, np.abs(amplitudes) ** 2 / level * pulses * moment, 0.0)
        design = np.stack([np.ones(len(orders)), orders])
        normal = (design * weight) @ design.T
        step = np.linalg.solve(normal + 1e-9 * np.trace(normal) * np.eye(2), design @ pull) / (2 * np.pi)
        limit = 0.5 / pulses / max(1, np.abs(orders).max())
        spacing += float(np.clip(step[1], -limit, limit))
        centre += float(np.clip(step[0], -0.5 / pulses, 0.5 / pulses))
        effective = np.where(used, snr**2 / (1 + snr), 0.0)
        information = np.asarray((design * (2 * (2 * np.pi) ** 2 * effective * moment)) @ design.T, np.float64)
    covariance = np.linalg.inv(information)
    return CombFit(
        spacing,
        centre,
        float(np.sqrt(covariance[1, 1])),
        float(np.sqrt(covariance[0, 0])),
        orders[used],
        amplitudes[used],
        snr[used],
        start.score,
    )
