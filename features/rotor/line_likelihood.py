"""Likelihood of line powers for a family of given shape, at the likeliest level and bends."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

#: No blade reflects quite evenly: a line at some share of the tip's order shows how the blade reflects at that share of
#: its length. The logarithm of the powers gets terms in the powers BENDS of the distance from the tip, each with a
#: factor of prior standard deviation BEND_STD, or PLAIN_BEND for next to none. (Edges of chords that taper to half at
#: the tip are off by 2 % without these terms, by less than 1 % with them.)
BENDS, BEND_STD, PLAIN_BEND = (0.5, 1.0, 2.0), 1.0, 0.05

#: Gauss-Newton steps of the level and its bends, none of them larger than this [nepers of power].
LEVEL_STEPS, LONGEST_STEP = 2, 3.0

#: Replaces sums that may be 0.
LEAST_SUM = 1e-30

#: Least pivot over its diagonal element: what single precision leaves of a direction that the others explain.
LEAST_PIVOT = 1e-6


@dataclass(frozen=True)
class OrderPowers:
    """Powers seen at the orders of a line family.

    Parameters
    ----------
    order : ndarray of int, shape (lines,)
        Orders of the chopping lines, rising, >= 1.
    power, noise : ndarray, shape (lines,)
        Mean power of each line with its noise, and of the noise alone, > 0, in units in which its mean is 1.
    bins : ndarray, shape (lines,)
        Independent bins in each mean.
    scatter : ndarray, shape (lines,)
        Known variance of the powers about the model, over the mean's square.
    """

    order: NDArray[np.intp]
    power: NDArray[np.float64]
    noise: NDArray[np.float64]
    bins: NDArray[np.float64]
    scatter: NDArray[np.float64]

    @property
    def loud(self) -> float:
        """Level of the lines that stand out: mean excess over the noise, weighted by itself."""
        excess = np.maximum(self.power - self.noise, 0.0)
        return float((excess**2).sum() / max(excess.sum(), 1e-9))

    def upto(self, furthest: float) -> Self:
        """Those up to an order, the first at least: empty orders are evidence too."""
        near = self.order <= max(furthest, self.order[0])
        return type(self)(self.order[near], self.power[near], self.noise[near], self.bins[near], self.scatter[near])


def log_likelihood(
    lines: OrderPowers,
    shape: NDArray[np.float64],
    away: NDArray[np.float64],
    start: NDArray[np.float64],
    bend_std: float,
    shares: NDArray[np.float64],
    leaks: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Log likelihood of line powers in noise, at the likeliest level and bends of the family.

    A mean of |line + noise|^2 is taken as a gamma variate of the same mean and variance: exact for noise alone.

    Parameters
    ----------
    lines : OrderPowers
        What was seen.
    shape : ndarray, shape (lines, families)
        Line powers of each family; the families lie side by side in memory, as all lines are treated alike.
    away : ndarray, shape (lines,)
        Distance from the tip that each line stands for, 0 at the tip to 1 at the hub.
    start : ndarray, shape (len(BENDS),)
        Bends to begin from.
    bend_std : float
        Prior deviation of each.
    shares : ndarray, shape (shares,)
        Variances of the powers about the model, beyond their `scatter`, over the mean's square.
    leaks : ndarray, shape (leaks,)
        Leakage powers, each tried with each of the shares.

    Returns
    -------
    nats : ndarray, shape (leaks, shares, families)
        Up to a constant.
    bends : ndarray, shape (len(BENDS),)
        Those of the likeliest.
    """
    unit = 1 / float(lines.power.max() + leaks.max())  # keeps squared powers within single precision
    power, noise, bins = lines.power * unit, lines.noise * unit, lines.bins
    leak, share = np.repeat(leaks * unit, len(shares)), np.tile(shares, len(leaks))
    bends = np.stack([away**exponent for exponent in (0.0, *BENDS)], axis=1)
    each = (len(power), len(leak), shape.shape[1])
    # exponentials take a fifth of the time in single precision, whose errors do not matter here
    single = [
        values.astype(np.float32)
        for values in (
            (power - noise)[:, None, None],
            shape[:, None],
            (share[:, None] + lines.scatter).T[:, :, None],
            (2 * noise / bins)[:, None, None],
            ((noise[:, None] + leak) ** 2 / bins[:, None])[..., None],
        )
    ]
    excess, family, by_line, beat, own = single
    # a narrow family may have no line at the orders seen: its level is then arbitrary
    like = family * np.exp(bends[:, 1:] @ start).astype(np.float32)[:, None, None]
    level = np.maximum((excess * like).sum(axis=0) / np.maximum((like**2).sum(axis=0), LEAST_SUM), 1e-6 * unit)
    bent = np.empty((bends.shape[1], each[1] * each[2]))
    bent[0] = np.broadcast_to(np.log(level), each[1:]).ravel()
    bent[1:] = start[:, None]
    left = _stepped(bent, bends, bend_std, each, single)
    held = (bend_std**-2 * (np.arange(len(bent)) > 0))[:, None]
    line = np.exp((bends @ bent).astype(np.float32)).reshape(each)
    line *= family
    mean = line + (noise[:, None] + leak)[..., None].astype(np.float32)
    number = mean**2
    number /= _variance(line, by_line, beat, own)
    # with numbers this large small deviations of the ratio from 1 count: its logarithm in double precision
    ratio = (power[:, None] + leak)[..., None] / mean
    nats = np.log(ratio)
    nats -= ratio
    nats += 1
    nats *= number
    # Stirling's series for the gamma function
    nats += np.float32(0.5) * np.log(number)
    nats -= np.float32(1 / 12) / number
    total = nats.sum(axis=0) - 0.5 * ((held * bent**2).sum(axis=0) + left).reshape(each[1:])
    return total.reshape(len(leaks), len(shares), -1), bent[1:, int(total.argmax())]


def _stepped(
    bent: NDArray[np.float64],
    bends: NDArray[np.float64],
    bend_std: float,
    each: tuple[int, int, int],
    single: Sequence[NDArray[np.float32]],
) -> NDArray[np.float64]:
    """Step level and bends, in place, to each family's likeliest; the log determinants of their informations.

    The entries of `single` are in single precision: near the likeliest, an error of 1e-6 in a step does not matter.
    """
    excess, family, by_line, beat, own = single
    places = [(row, column) for row in range(len(bent)) for column in range(row + 1)]
    pairs = np.stack([bends[:, row] * bends[:, column] for row, column in places]).astype(np.float32)
    along = bends.astype(np.float32)
    # the level has a flat prior; its information counts as if its logarithm were known to 1
    known = np.array([1.0, *[bend_std**-2] * (len(bent) - 1)])
    held = known * (np.arange(len(bent)) > 0)
    left = np.zeros(bent.shape[1])
    for _ in range(LEVEL_STEPS):
        line = np.exp(along @ bent.astype(np.float32)).reshape(each)
        line *= family
        pull = line / _variance(line, by_line, beat, own)
        score = along.T @ ((excess - line) * pull).reshape(each[0], -1) - held[:, None] * bent
        line *= pull
        informations = (pairs @ line.reshape(each[0], -1)).astype(np.float64)
        information = dict(zip(places, informations, strict=True))
        for row, information_before in enumerate(known):
            information[row, row] += information_before
        step, left = solved(information, score)
        bent += np.clip(step, -LONGEST_STEP, LONGEST_STEP)
    return left


def _variance(
    line: NDArray[np.floating], share: NDArray[np.floating], beat: NDArray[np.floating], own: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Variance of the mean power of a line: (share x line + beat) x line + own."""
    out = share * line
    out += beat
    out *= line
    out += own
    return out


def solved(
    matrix: dict[tuple[int, int], NDArray[np.float64]], vector: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Solutions of many small positive definite systems, and the logarithms of their determinants, by Cholesky.

    `matrix` has the lower triangles by (row, column), each entry over all systems; `vector` likewise by row.
    """
    size = len(vector)
    root: dict[tuple[int, int], NDArray[np.float64]] = {}
    out = vector.copy()
    for row in range(size):
        for column in range(row + 1):
            left = matrix[row, column] - sum(root[row, k] * root[column, k] for k in range(column))
            if row == column:
                root[row, row] = np.sqrt(np.maximum(left, LEAST_PIVOT * matrix[row, row]))
            else:
                root[row, column] = left / root[column, column]
        for k in range(row):
            out[row] -= root[row, k] * out[k]
        out[row] /= root[row, row]
    for row in reversed(range(size)):
        for k in range(row + 1, size):
            out[row] -= root[k, row] * out[k]
        out[row] /= root[row, row]
    return out, 2 * np.sum([np.log(root[row, row]) for row in range(size)], axis=0)
