"""Edge of a rotor's line family: the tip's order fitted to all lines, instead of a threshold and a count."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .line_likelihood import BEND_STD, BENDS, PLAIN_BEND, OrderPowers, log_likelihood
from .line_shapes import PROFILES, spread_powers

#: Numbers of blades that are tried where theirs is unknown, and their prior probabilities.
BLADES = {1: 0.1, 2: 0.6, 3: 0.2, 4: 0.1}

#: Leakage: a share of the family's power, added to noise and lines alike, so that weaker lines do not count. It covers
#: what strong lines leak and what non-ideal blades have past the tip.
LEAK_SHARE = 0.002

#: A leakage of LEAST_LEAK times that, and of as much less again, is tried as equally likely, while the one before
#: exceeds LEAK_SEEN of the noise; MOST_LEAKS in all.
LEAST_LEAK, LEAK_SEEN, MOST_LEAKS = 0.01, 0.1, 3

#: Variances of line powers about the model, over the mean's square, that are tried: the lines decide.
SHARES = tuple(1e-6 * 4.0**step for step in range(11))

#: The first search tries every FIRST_SHARES-th of these, later ones those within SHARES_ABOUT of the likely ones.
#: Shares below OUTWEIGHED of the noise's are not told apart.
FIRST_SHARES, SHARES_ABOUT, OUTWEIGHED = 5, 2, 0.1

#: Prior probability of each of these over that of the one before it.
SHARE_FALL = 0.6

#: Lines are used out to this many widths of the roll-off, Gamma^(1/3) orders, past the tip.
REACH = 3.0

#: Step of the first search [lines]; for more blades than BLADES has, STEP_GAMMA [rad of phase deviation], as the lines'
#: ripple repeats every pi.
STEP, STEP_GAMMA = 0.2, 0.4

#: The first search covers all lines that may be the last, within COARSE_NATS of the likeliest in the coarse search
#: [nats], and beyond these HALF_RANGE [lines] or HALF_WIDTHS of the roll-off, over which strong lines still show. It
#: takes MOST_STEPS steps at most, none nearer to the body than LEAST_EDGE [lines].
HALF_RANGE, HALF_WIDTHS, COARSE_NATS, MOST_STEPS, LEAST_EDGE = 2.5, 1.5, 6.0, 100, 0.7

#: At most SEARCHES searches, each over what the one before left in FINE steps, until the standard deviation exceeds
#: FINE_ENOUGH of these.
SEARCHES, FINE, FINE_ENOUGH = 6, 30, 1.5

#: Hypotheses less probable than this are dropped.
NEGLIGIBLE = 1e-3

#: Leakage of the coarse search, which has no model of the roll-off: weaker lines do not count there.
COARSE_LEAK_SHARE = 0.03


@dataclass(frozen=True)
class _Hypotheses:
    """What is tried with each edge: every combination of these.

    Parameters
    ----------
    blades : tuple of int
        Numbers of them.
    profiles : ndarray of int
        Indices in `line_powers`.
    shares : ndarray of int
        Indices of the variances about the model.
    leaks : tuple of float
        Shares of the family's power that leak.
    """

    blades: tuple[int, ...]
    profiles: NDArray[np.intp]
    shares: NDArray[np.intp]
    leaks: tuple[float, ...]

    def log_prior(self, share_prior: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float64]:
        """Logarithm of the prior of each [nats], shape (blades, profiles, edges, shares, 1)."""
        own = np.outer([BLADES.get(number, 1.0) for number in self.blades], np.array(PROFILES)[self.profiles])
        return np.log(own)[..., None, None, None] + np.log(share_prior[self.shares] / edges[:, None])[..., None]

    def held(self, weight: NDArray[np.float64], all_shares: int) -> Self:
        """Hypotheses that are still likely, with the shares about theirs.

        Parameters
        ----------
        weight : ndarray, shape (blades, profiles, edges, shares, leaks)
            Probability of each; where it has fewer leaks, the others were not tested and stay.
        all_shares : int
            Number of all shares.
        """
        blades, profiles, _, shares, leaks = (
            np.flatnonzero(weight.sum(axis=tuple(set(range(weight.ndim)) - {axis})) > NEGLIGIBLE)
            for axis in range(weight.ndim)
        )
        asked = weight.shape[-1] == len(self.leaks)
        live = self.shares[shares]
        return type(self)(
            tuple(self.blades[one] for one in blades),
            self.profiles[profiles],
            np.arange(max(live.min() - SHARES_ABOUT, 0), min(live.max() + SHARES_ABOUT + 1, all_shares)),
            tuple(self.leaks[one] for one in leaks) if asked else self.leaks,
        )


def fit_edge(
    order: NDArray[np.intp],
    power: NDArray[np.float64],
    noise: NDArray[np.float64],
    bins: NDArray[np.float64],
    blades: int | None = None,
    *,
    scatter: NDArray[np.float64] | float = 0.0,
    leak: float = LEAK_SHARE,
    plain: bool = False,
    spread: float = 0.0,
) -> tuple[float, float]:
    """Fit the edge of a line family.

    Parameters
    ----------
    order, power, noise, bins, scatter : ndarray, shape (lines,)
        As in `OrderPowers`, of any unit.
    blades : int, optional
        Blades of the rotor: they set how sharp the edge is. Those of `BLADES` are tried where it is not known.
    leak : float
        Share of the family's power that lines may leak past its edge; smaller ones, by `LEAST_LEAK`, are tried too.
    plain : bool
        Take blades to reflect evenly or at their tips alone: where the lines of several rotors merge, the shape of the
        roll-off says no more of the blades.
    spread : float
        Range of several rotors' rates over their mean, whose multiples the orders are: power about a high order then
        includes that of its neighbours.

    Returns
    -------
    edge, edge_std : float
        The tip's Doppler frequency and its standard deviation [chopping frequencies].
    """
    unit = noise.mean()
    lines = OrderPowers(order, power / unit, noise / unit, bins, np.broadcast_to(scatter, power.shape))
    loud = lines.loud
    shares, share_prior = _shares(lines, loud)
    leaks = [leak]
    while len(leaks) < MOST_LEAKS and leaks[-1] * loud > LEAK_SEEN:
        leaks.append(LEAST_LEAK * leaks[-1])
    tried = _Hypotheses(
        tuple(BLADES) if blades is None else (blades,),
        np.arange(2 if plain else len(PROFILES)),
        np.arange(len(shares))[::-FIRST_SHARES],
        tuple(leaks),
    )
    fewest = min(tried.blades)
    maybe = order[_coarse_nats(lines, loud) > -COARSE_NATS]
    low, high = maybe[0] - _half_range(maybe[0], fewest), maybe[-1] + _half_range(maybe[-1], fewest)
    furthest = float(order[-1]) + _half_range(order[-1], fewest)  # no line supports an edge further out
    most = max(tried.blades)
    step = max(STEP if most <= max(BLADES) else STEP_GAMMA / most, (high - low) / MOST_STEPS)
    bend_std = PLAIN_BEND if plain else BEND_STD
    bent, edge = np.zeros(len(BENDS)), high
    for search in range(SEARCHES):
        apart, edges = step, np.arange(max(low, LEAST_EDGE), high + step, step)
        near = lines.upto(high + REACH * high ** (1 / 3) / min(tried.blades) ** (2 / 3))
        count = int(near.order[-1])
        each = [spread_powers(number * edges, number, count, spread)[tried.profiles] for number in tried.blades]
        shape = np.ascontiguousarray(np.stack(each)[..., near.order - 1].reshape(-1, len(near.order)).T)
        away = np.clip(1 - near.order / edge, 0, 1)
        # the first search tests the largest leakage alone: it only finds about which lines to look
        asked = loud * np.array(tried.leaks if search else tried.leaks[:1])
        nats, bent = log_likelihood(near, shape, away, bent, bend_std, shares[tried.shares], asked)
        by_axis = (*nats.shape[:2], len(tried.blades), len(tried.profiles), len(edges))
        weight = np.moveaxis(nats.reshape(by_axis), (0, 1), (4, 3)) + tried.log_prior(share_prior, edges)
        weight = np.exp(weight - weight.max())
        weight /= weight.sum()
        along = weight.sum(axis=(0, 1, 3, 4))
        edge = float((along * edges).sum())
        std = float(np.sqrt((along * (edges - edge) ** 2).sum()))
        held = np.flatnonzero(along > NEGLIGIBLE)
        low, high = edges[held[0]] - step, edges[held[-1]] + step
        further = min(high - low, HALF_RANGE) if search else HALF_RANGE
        wider = further * np.array([held[0] == 0 and low > LEAST_EDGE, held[-1] == len(edges) - 1])
        if search and not wider.any() and std > FINE_ENOUGH * step:
            break
        low, high = low - wider[0], min(high + wider[1], max(furthest, high))
        step = (high - low) / FINE
        tried = tried.held(weight, len(shares))
    return edge, float(np.hypot(std, apart / np.sqrt(12)))  # known no better than to a step


def _shares(lines: OrderPowers, loud: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The variances about the model that may be told from each other, and the prior of each."""
    least = OUTWEIGHED * float((lines.noise / lines.bins).mean()) / max(loud, 1e-9)
    shares = np.array([share for share in SHARES if share >= least or share == SHARES[-1]])
    prior = SHARE_FALL ** np.arange(len(SHARES))
    alike = len(SHARES) - len(shares) + 1
    return shares, np.append(prior[:alike].sum(), prior[alike:])


def _half_range(order: int, blades: int) -> float:
    """How far the edge may be from a line that may be the last [lines]."""
    return float(max(HALF_RANGE, HALF_WIDTHS * order ** (1 / 3) / blades ** (2 / 3)))


def _coarse_nats(lines: OrderPowers, loud: float) -> NDArray[np.float64]:
    """Log likelihood of each line to be the last of a family of one level, less that of the likeliest.

    Powers are exponentially distributed; lines far below the level, in the roll-off, do not count.
    """
    ratio = (lines.power + COARSE_LEAK_SHARE * loud) / (lines.noise + COARSE_LEAK_SHARE * loud)
    total, number = np.cumsum(lines.bins * ratio), np.cumsum(lines.bins)
    mean = np.maximum(total / number, 1.0)
    nats = number * (mean - 1 - np.log(mean))
    return np.asarray(nats - nats.max(), np.float64)
