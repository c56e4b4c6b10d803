"""Blades that are rows of a few points: whether a comb's lines are one rotor's with such blades, and where they end.

A point seen at every speed below its own flashes twice a period and side, and several do at any times, which passes for
the flashes of several rotors. But of one rotor the line of order n on either side of the body is the same but for the
turn it stands at, as it looks the same before and after its blades point at the radar; and that line is a sum of few
J_Nn(Gamma), Gamma the phase deviation of each point and N the number of blades (the paper's eq. 24).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import energy, squared
from .comb_fit import CombFit

#: Points are taken for this many at most, and for no more than so many lines tell: each takes three numbers.
MOST_POINTS, NUMBERS_OF_POINT = 6, 3

#: A point costs so many times the logarithm of how many numbers the lines are [nats]: 1.5 for its three numbers, as in
#: any such choice (BIC), and as much for its place, which is sought among as many as there may be.
COST = 3.0

#: Each side must have so many lines.
LEAST_LINES = 6

#: Phase deviations are tried in such steps [rad], and refined in so many Gauss-Newton steps at most, none of them
#: longer, until all are below this share of it.
STEP_GAMMA, REFINED_STEPS, REFINED_ENOUGH = 0.5, 6, 0.01

#: Of rows of points, so many leave less than this share of the lines' power: else it is none.
FIRST_POINTS, FIRST_LEFT = 3, 0.6

#: Two points that lie so near to one another that the lines do not tell them apart, by no more than this [rad], pass
#: for one between them: the outermost is off by this share of that, at the root of the mean square.
MOST_HIDDEN, HIDDEN_SHARE = 1.5, 0.15

#: Lines that have more than this share of their power from noise would be explained by anything.
MOST_NOISE = 0.1

#: Where more Bessel functions are asked for, blades of points are not sought: at high carriers there are thousands.
MOST_CELLS = 4_000_000

#: A point must add so much of its own to those known: two nearer than that come out as large ones that cancel.
LEAST_OWN = 0.02

#: The turn is read from the lines at so many places for each.
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
        Strong lines' spacing in lines of it.
    pulses : int
        Samples that they were fitted to.
    numbers : iterable of int
        Numbers of blades that are tried.

    Returns
    -------
    PointsFit or None
        The best; None where too few lines are seen on both sides, or too many, or they hardly stand in the noise.
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
    # held back as the amplitudes are, they have so much less of it
    noise = float(((fit.snr[own] / (1 + fit.snr[own])) ** 2).mean()) / (2 * pulses)
    total = (energy(ahead) + energy(behind)) / 2
    if len(order) * noise > MOST_NOISE * total:
        return None
    rows: list[_Row] = []
    for number in numbers:
        for half in (0, 1):  # the turn is known but for half of one
            line = np.exp(-1j * order * (turn + np.pi * ((number % 2) + 2 * half)) / 2)
            lines = (ahead * line + (-1.0) ** (number * order) * behind * line.conj()) / 2
            near = gamma <= number * order[-1]
            rows += _rows_of_points(lines, bessel[number * order][:, near], gamma[near], number, order, noise)
    cost = np.array([row.cost for row in rows])
    best = rows[int(cost.argmin())]
    # whether a weak point stands outside of others is no surer than this
    weight = np.exp(cost.min() - cost)
    edges, stds = np.array([(row.edge, row.edge_std) for row in rows]).T
    edge = float(np.average(edges, weights=weight))
    std = float(np.sqrt(np.average(stds**2 + (edges - edge) ** 2, weights=weight)))
    expected = (2 * len(order) - NUMBERS_OF_POINT * best.points / 2) * noise
    return PointsFit(edge, std, (best.left + apart - expected) / total, best.blades, best.points)


@dataclass(frozen=True)
class _Row:
    """A row of points: what it costs [nats], what it leaves [power], its edge [chopping frequencies], numbers."""

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
        Mean of both sides about the turn.
    bessel : ndarray, shape (lines, phase deviations)
        What a point of each has of them.
    gamma : ndarray, shape (phase deviations,)
        [rad].
    blades : int
        Their number.
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
        # of as many numbers, noise that the lines themselves tell but is no less than is known
        unsure = max(left / max(numbers - NUMBERS_OF_POINT * len(row), 1), noise / 2)
        price = COST * np.log(numbers)
        cost = left / (2 * unsure) + numbers / 2 * np.log(unsure) + price * len(row)
        edge = int(row.argmax())
        # two points so far to either side of the outermost would be no worse, at a price that hides them
        hidden = min((8 * price * unsure / max(bent, 1e-30)) ** 0.25, MOST_HIDDEN)
        std = float(np.hypot(np.sqrt(unsure * np.linalg.pinv(information)[edge, edge]), HIDDEN_SHARE * hidden))
        rows.append(_Row(float(cost), left, float(row[edge]) / blades, std / blades, blades, len(row)))
        if len(row) == FIRST_POINTS and left > FIRST_LEFT * total:
            break
    return rows


def _refined(
    lines: NDArray[np.complex128], row: NDArray[np.float64], order: NDArray[np.intp]
) -> tuple[NDArray[np.float64], float, NDArray[np.float64], float]:
    """Points nearby that explain lines best, and what these come to.

    Returns
    -------
    row : ndarray, shape (points,)
        Phase deviations [rad].
    left : float
        Power that they leave.
    information : ndarray, shape (points, points)
        On the phase deviations, in units of the noise's inverse.
    bent : float
        Power, but for what others explain, by which the lines of the outermost change with the square of its phase
        deviation, as those of two that stand nearby do.
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
    """J_0 to J_count of these, shape (count + 1, arguments): as Fourier coefficients, a fiftieth of the time."""
    widest = float(gamma.max())
    size = fft.next_fast_len(int(max(count, widest) + 12 + 6 * widest ** (1 / 3)), real=True)
    phase = gamma[:, None] * np.cos(np.pi * np.arange(size + 1) / size)
    coefficients = fft.dct(np.cos(phase) + np.sin(phase), 1)[:, : count + 1] / (2 * size)
    return np.asarray((coefficients * np.array([1, 1, -1, -1])[np.arange(count + 1) % 4]).T, np.float64)


def _turn(
    order: NDArray[np.intp], ahead: NDArray[np.complex128], behind: NDArray[np.complex128]
) -> tuple[float, float]:
    """Twice the turn [rad a line] about which both sides are most alike, and the power in which they differ."""
    both = np.zeros(order[-1] + 1, np.complex128)
    both[order] = ahead * behind.conj()
    size = PADDING * len(both)
    turn = 2 * np.pi * int(fft.fft(both, size).real.argmax()) / size
    for _ in range(3):
        seen = ahead * behind.conj() * np.exp(-1j * order * turn)
        turn += float((order * seen.imag).sum() / max(float((order**2 * seen.real).sum()), 1e-30))
    seen = ahead * behind.conj() * np.exp(-1j * order * turn)
    return turn, float((squared(ahead) + squared(behind)).sum() / 2 - seen.real.sum()) / 2
