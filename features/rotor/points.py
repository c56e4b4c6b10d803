"""Blades that are rows of a few points: whether a comb's lines are those of one such rotor, and their edge.

A point passes every speed below its own twice a period and side, and several points flash at any times, which passes
for the flashes of several rotors. But of one rotor lines n and -n are equal but for the angle of the rotor, as it looks
the same before and after its blades point at the radar; and each is a sum of a few J_Nn(Gamma), with Gamma the phase
deviation of each point and N the number of blades (the paper's eq. 24).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import energy, squared
from .comb_fit import CombFit

#: At most MOST_POINTS points are fitted, with fewer parameters than there are lines: each has NUMBERS_OF_POINT.
MOST_POINTS, NUMBERS_OF_POINT = 6, 3

#: Cost of a point, times the logarithm of the number of data [nats]: 1.5 for its three parameters, as in BIC, and as
#: much for its place, which is sought among as many as there may be.
COST = 3.0

#: Least lines on each side.
LEAST_LINES = 6

#: Phase deviations are tried in steps of STEP_GAMMA [rad], and refined in REFINED_STEPS Gauss-Newton steps at most,
#: none of them longer, until all are below REFINED_ENOUGH of it.
STEP_GAMMA, REFINED_STEPS, REFINED_ENOUGH = 0.5, 6, 0.01

#: If FIRST_POINTS points leave more than FIRST_LEFT of the lines' power, blades are no such row.
FIRST_POINTS, FIRST_LEFT = 3, 0.6

#: Two points that the lines do not resolve, each up to MOST_HIDDEN off their middle [rad], pass for one there: the
#: outermost is off by HIDDEN_SHARE of that, rms.
MOST_HIDDEN, HIDDEN_SHARE = 1.5, 0.15

#: Lines with more than this share of noise in their power are not fitted: anything would explain them.
MOST_NOISE = 0.1

#: Most values of Bessel functions: if more are needed, points are not sought, as high carriers have thousands of
#: orders.
MOST_CELLS = 4_000_000

#: Least power of a point's lines that known points do not explain, over the largest of any place: two nearer points
#: come out as large ones that cancel.
LEAST_OWN = 0.02

#: Places per line at which the rotor's angle is tried.
PADDING = 16


@dataclass(frozen=True)
class PointsFit:
    """Points along the blades that explain the lines of a comb.

    Parameters
    ----------
    edge, edge_std : float
        Doppler frequency of the outermost point and its standard deviation [chopping frequencies].
    left : float
        Share of the lines' power that is neither explained nor noise.
    blades, points : int
        Numbers of them.
    """

    edge: float
    edge_std: float
    left: float
    blades: int
    points: int


def fit_points(fit: CombFit, per_turn: int, pulses: int, numbers: Iterable[int]) -> PointsFit | None:
    """Explain the lines of a comb by points along the blades of one rotor.

    Parameters
    ----------
    fit : CombFit
        The comb.
    per_turn : int
        Strong lines are this many spacings apart.
    pulses : int
        Samples that it was fitted to.
    numbers : iterable of int
        Numbers of blades that are tried.

    Returns
    -------
    PointsFit or None
        The best; None where too few or too many lines are seen on both sides, or they hardly exceed the noise.
    """
    own = (fit.orders > 0) & (fit.orders % per_turn == 0) & np.isin(-fit.orders, fit.orders)
    order, numbers = fit.orders[own] // per_turn, sorted(numbers)
    if fit.is_folded or len(order) < LEAST_LINES:
        return None
    ahead, behind = fit.amplitudes[own], fit.amplitudes[np.isin(fit.orders, -fit.orders[own])][::-1]
    widest = numbers[-1] * int(order[-1])
    if 2 * widest**2 / STEP_GAMMA > MOST_CELLS:
        return None
    gamma = np.arange(1.0, widest / STEP_GAMMA) * STEP_GAMMA
    bessel = bessel_functions(gamma, widest + 1)
    turn, apart = _turn(order, ahead, behind)
    # the fit shrinks the amplitudes, and the noise in them by as much
    noise = float(((fit.snr[own] / (1 + fit.snr[own])) ** 2).mean()) / (2 * pulses)
    total = (energy(ahead) + energy(behind)) / 2
    if len(order) * noise > MOST_NOISE * total:
        return None
    rows: list[_Row] = []
    for number in numbers:
        for half in (0, 1):  # the angle is known up to half a turn
            line = np.exp(-1j * order * (turn + np.pi * ((number % 2) + 2 * half)) / 2)
            lines = (ahead * line + (-1.0) ** (number * order) * behind * line.conj()) / 2
            near = gamma <= number * order[-1]
            rows += _rows_of_points(lines, bessel[number * order][:, near], gamma[near], number, order, noise)
    cost = np.array([row.cost for row in rows])
    best = rows[int(cost.argmin())]
    # whether a weak point lies outside the others is no surer than this
    weight = np.exp(cost.min() - cost)
    edges, stds = np.array([(row.edge, row.edge_std) for row in rows]).T
    edge = float(np.average(edges, weights=weight))
    std = float(np.sqrt(np.average(stds**2 + (edges - edge) ** 2, weights=weight)))
    expected = (2 * len(order) - NUMBERS_OF_POINT * best.points / 2) * noise
    return PointsFit(edge, std, (best.left + apart - expected) / total, best.blades, best.points)


@dataclass(frozen=True)
class _Row:
    """A row of points: its cost [nats], what it leaves [power], its edge [chopping frequencies], numbers."""

    cost: float
    left: float
    edge: float
    edge_std: float
    blades: int
    points: int


def _rows_of_points(
    lines: NDArray[np.complex128],
    bessel: NDArray[np.float64],
    gamma: NDArray[np.float64],
    blades: int,
    order: NDArray[np.intp],
    noise: float,
) -> list[_Row]:
    """The rows of one point, of two and so on that explain lines best.

    Parameters
    ----------
    lines : ndarray, shape (lines,)
        Mean of both sides, the angle taken out.
    bessel : ndarray, shape (lines, phase deviations)
        Lines of a point of each.
    gamma : ndarray, shape (phase deviations,)
        [rad].
    blades : int
        Number of blades.
    order : ndarray of int, shape (lines,)
        Of the chopping lines.
    noise : float
        Power of the noise in each line.
    """
    row, rows, total = np.empty(0), [], energy(lines)
    numbers, turns = 2 * len(lines), blades * order
    while len(row) < MOST_POINTS and NUMBERS_OF_POINT * (len(row) + 1) < len(lines):
        known = np.linalg.qr(bessel_functions(row, int(turns[-1]))[turns])[0] if len(row) else np.empty((len(lines), 0))
        own = bessel - known @ (known.T @ bessel)
        power = (own**2).sum(axis=0)
        gain = np.where(power > LEAST_OWN * power.max(), squared(own.T @ lines) / np.maximum(power, 1e-30), 0.0)
        row, left, information, bent = _refined(lines, np.append(row, gamma[gain.argmax()]), turns)
        # noise of each number: estimated from what is left, but no less than is known
        unsure = max(left / max(numbers - NUMBERS_OF_POINT * len(row), 1), noise / 2)
        price = COST * np.log(numbers)
        cost = left / (2 * unsure) + numbers / 2 * np.log(unsure) + price * len(row)
        edge = int(row.argmax())
        # two points this far to either side of the outermost would fit no better than the cost of one more
        hidden = min((8 * price * unsure / max(bent, 1e-30)) ** 0.25, MOST_HIDDEN)
        std = float(np.hypot(np.sqrt(unsure * np.linalg.pinv(information)[edge, edge]), HIDDEN_SHARE * hidden))
        rows.append(_Row(float(cost), left, float(row[edge]) / blades, std / blades, blades, len(row)))
        if len(row) == FIRST_POINTS and left > FIRST_LEFT * total:
            break
    return rows


def _refined(
    lines: NDArray[np.complex128], row: NDArray[np.float64], order: NDArray[np.intp]
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], float]:
    """Refine points to those nearby that explain lines best.

    Returns
    -------
    row : ndarray, shape (points,)
        Phase deviations [rad].
    left : float
        Power that is left.
    information : ndarray, shape (points, points)
        Information on the phase deviations, in units of 1 / noise.
    bent : float
        Power of the second derivative of the outermost point's lines by its phase deviation, less what others explain:
        so do the lines of two nearby points differ from those of one.
    """
    best = (row, np.inf, np.eye(len(row)), 0.0)
    for _ in range(REFINED_STEPS):
        bessel = bessel_functions(row, int(order[-1]) + 1)
        known = bessel[order]
        inverse = np.linalg.pinv(known)
        strength = inverse @ lines
        rest = lines - known @ strength
        change = (bessel[order - 1] - bessel[order + 1]) / 2
        slope = change * strength
        slope = slope - known @ (inverse @ slope)
        information = (slope.conj().T @ slope).real
        left = energy(rest)
        if left < best[1]:
            edge = int(row.argmax())
            # Bessel's equation
            curve = -change[:, edge] / row[edge] - (1 - (order / row[edge]) ** 2) * known[:, edge]
            both = np.linalg.qr(np.concatenate([known, change], axis=1))[0]
            curve = strength[edge] * (curve - both @ (both.T @ curve))
            best = row, left, information, energy(curve)
        information = information + 1e-9 * np.trace(information) * np.eye(len(row))
        step = np.linalg.solve(information, (slope.conj().T @ rest).real)
        if np.abs(step).max() < REFINED_ENOUGH * STEP_GAMMA:
            break
        row = np.maximum(row + np.clip(step, -STEP_GAMMA, STEP_GAMMA), STEP_GAMMA)
    return best


def bessel_functions(gamma: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """J_0 to J_count of `gamma`, shape (count + 1, arguments): as Fourier coefficients, a fiftieth of the time."""
    widest = float(gamma.max())
    size = fft.next_fast_len(int(max(count, widest) + 12 + 6 * widest ** (1 / 3)), real=True)
    phase = gamma[:, None] * np.cos(np.pi * np.arange(size + 1) / size)
    coefficients = fft.dct(np.cos(phase) + np.sin(phase), 1)[:, : count + 1] / (2 * size)
    return np.asarray((coefficients * np.array([1, 1, -1, -1])[np.arange(count + 1) % 4]).T, np.float64)


def _turn(
    order: NDArray[np.intp], ahead: NDArray[np.complex128], behind: NDArray[np.complex128]
) -> tuple[float, float]:
    """Twice the rotor's angle [rad a line] at which both sides agree best, and the power in which they differ."""
    both = np.zeros(order[-1] + 1, np.complex128)
    both[order] = ahead * behind.conj()
    size = PADDING * len(both)
    turn = 2 * np.pi * int(fft.fft(both, size).real.argmax()) / size
    for _ in range(3):
        seen = ahead * behind.conj() * np.exp(-1j * order * turn)
        turn += float((order * seen.imag).sum() / max(float((order**2 * seen.real).sum()), 1e-30))
    seen = ahead * behind.conj() * np.exp(-1j * order * turn)
    return turn, float((squared(ahead) + squared(behind)).sum() / 2 - seen.real.sum()) / 2
