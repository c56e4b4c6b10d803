"""Where the line family of a rotor ends: the tip's order fitted to all its lines, instead of a threshold and a count.

The line of rotation order n of a blade whose reflectivity is g(u), u = 0..1 from the hub to the tip, has the amplitude
of the n-th Fourier coefficient of the integral of g(u) exp(j Gamma u cos(theta)): for all of it at the tip J_n(Gamma),
the paper's eq. (24). Gamma, the phase deviation at the tip (eq. 16), is the tip's Doppler frequency in rotation rates.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

#: Blades that a fit to an unknown number of them tries, and how likely they are beforehand.
BLADES = {1: 0.1, 2: 0.65, 3: 0.25}

#: Likewise blades that reflect evenly, points at their tips, a model of the literature rather than a blade, and blades
#: that begin anywhere between these shares of their length.
PROFILES, ROOTS = (0.55, 0.05, 0.4), (0.03, 0.6)

#: No blade reflects quite evenly: where a line is strong, at so large a share of the tip's order, tells how that place
#: on the blade reflects. The logarithm of the powers follows these powers of the distance from the tip, each by a
#: factor of this standard deviation, or next to nothing. (Chords that taper to half at the tip are off by 2 % with none
#: of it, and then by less than 1 %.)
BENDS, BEND_STD, PLAIN_BEND = (0.5, 1.0, 2.0), 1.0, 0.05

#: Lines so far below the family's level do not count: a share of its power, added to noise and lines alike. There is
#: what strong lines leak, and what blades unlike the ideal ones put past the tip.
LEAK_SHARE = 0.002

#: As likely they leak no more than this share of it, or of that once more; which, shows where it is more than so large
#: a share of the noise.
LEAST_LEAK, LEAK_SEEN, MOST_LEAKS = 0.01, 0.1, 3

#: How unlike the model the powers of the lines may be: variances over the mean's square. The lines decide.
SHARES = tuple(1e-6 * 4.0**step for step in range(11))

#: The first search tries every so many-th of these, the others those about what is left.
FIRST_SHARES = 5

#: Each of these is so likely beforehand beside the one before it.
SHARE_FALL = 0.6

#: Widths of the roll-off, Gamma^(1/3) orders, past the tip that lines are followed.
REACH = 3.0

#: Gauss-Newton steps of the level and its bends, none of them larger than this [nepers of power].
LEVEL_STEPS, LONGEST_STEP = 2, 3.0

#: Lines this weak beside a blade at rest, 60 dB under any that counts, are none: single precision leaves a third of it,
#: and beyond so large a phase deviation [rad] more with its root.
LEAST_AMPLITUDE, EXACT_TO = 1e-6, 300.0

#: In place of 0 [rad], and of sums that may be it.
NEAR_ZERO, LEAST_SUM = 1e-4, 1e-300

#: Step of the first search [lines]: the lines' ripple repeats every pi of the phase deviation.
STEP = 0.2

#: The first search goes so far about all lines that may be the last [lines], and so many widths of the roll-off, over
#: which strong lines still show; which these are the coarse search has as likely as this [nats]. It takes so many steps
#: at most, and goes no nearer to the body than this.
HALF_RANGE, HALF_WIDTHS, COARSE_NATS, MOST_STEPS, LEAST_EDGE = 2.5, 1.5, 6.0, 100, 0.7

#: Searches, each about what is left of the one before in so many steps, until the deviation is so many of these.
SEARCHES, FINE, FINE_ENOUGH = 6, 30, 1.5

#: Hypotheses less likely than this are left out.
NEGLIGIBLE = 1e-3

#: What lies about an order reaches to the middle between its neighbours: as good as so far more to either side [1].
WINDOW_ORDERS = 0.35

#: The coarse search has no model of the roll-off: what lies so far below the level is not seen there.
COARSE_LEAK_SHARE = 0.03


def line_powers(gamma: NDArray[np.float64], blades: int, count: int) -> NDArray[np.float64]:
    """Powers of the lines of rotors whose blades reflect as `PROFILES` says.

    Parameters
    ----------
    gamma : ndarray, shape (tips,)
        Phase deviation at the tip [rad].
    blades : int
        Equal blades: only every so many-th order has a line.
    count : int
        Lines wanted, orders `blades` to `count` x `blades`.

    Returns
    -------
    ndarray of float64, shape (profiles, tips, count)
        Relative to a blade at rest.
    """
    widest = float(gamma.max())
    # of an even number of blades only the real part is there, the same on both sides of a right angle
    fold = 2 - blades % 2
    orders = blades // fold * np.arange(1, count + 1)
    # orders past the middle of the transform stand for what lies beyond the tip, where nothing is
    beyond = int(widest + 6 * widest ** (1 / 3)) // fold
    steps = fft.next_fast_len(max(count * blades // fold, (count * blades // fold + beyond) // 2) + 8, real=True)
    # single precision, 1e-7 of a blade at rest: lines weaker than 1e-3 of the family's do not count
    z = (gamma[:, None] * np.cos(np.pi / fold * np.arange(steps + 1) / steps)).astype(np.float32)
    z[np.abs(z) < NEAR_ZERO] = NEAR_ZERO
    sine, cosine = np.sin(z), np.cos(z)
    parts = [np.stack([sine / z, cosine])]
    if fold == 1:
        parts.append(np.stack([(1 - cosine) / z, sine]))
    amplitudes = np.empty((2, len(gamma), count))
    for odd, part in enumerate(parts):
        own = orders % 2 == odd if fold == 1 else slice(None)
        amplitudes[..., own] = fft.dct(part, 1)[..., orders[own]]
    amplitudes /= 2 * steps
    # or rounding would be lines of a family that ends far below them
    amplitudes *= np.abs(amplitudes) > LEAST_AMPLITUDE * np.sqrt(np.maximum(gamma / EXACT_TO, 1.0))[:, None]
    even, tip = amplitudes**2
    # a blade that begins further out has no lines of inner orders but what both its ends leave of each other's ripple
    begins = np.clip((blades * np.arange(1, count + 1) / gamma[:, None] - ROOTS[0]) / (ROOTS[1] - ROOTS[0]), 0, 1)
    level = 1 / gamma[:, None]
    ends = (np.abs(amplitudes[0]) - level) ** 2 + level**3 / (np.pi * np.mean(ROOTS))
    return np.stack([even, tip, begins * even + (1 - begins) * ends])


def _spread_powers(gamma: NDArray[np.float64], blades: int, count: int, spread: float) -> NDArray[np.float64]:
    """`line_powers` as they lie about each order where the rotors' rates differ by so much, relative.

    The line of order n of a rotor whose rate is r stands where that of order n r of the mean rate would. What lies
    about an order is then the mean over those that come to lie there, each line's power spread evenly to the middle
    between its neighbours.
    """
    half = WINDOW_ORDERS + np.arange(1, count + 1) * spread / 2
    if half[-1] < 0.5:
        return line_powers(gamma, blades, count)
    powers = line_powers(gamma, blades, count + int(np.ceil(half[-1])))
    mixed = half > 0.5
    ends = np.arange(count)[mixed] + 0.5 + np.array([[-1], [1]]) * half[mixed]
    whole = ends.astype(np.intp)
    padded = np.pad(powers, ((0, 0), (0, 0), (1, 1)))
    upto = np.cumsum(padded, axis=-1)[..., whole] + (ends - whole) * padded[..., whole + 1]
    powers = powers[..., :count]
    powers[..., mixed] = (upto[..., 1, :] - upto[..., 0, :]) / (2 * half[mixed])
    return powers


def _solved(
    matrix: dict[tuple[int, int], NDArray[np.float64]], vector: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Solutions of many small positive definite systems, and the logarithms of their determinants, by Cholesky.

    The entries of the lower triangles stand by (row, column), those of each over the systems; likewise the vectors.
    """
    size = len(vector)
    root: dict[tuple[int, int], NDArray[np.float64]] = {}
    out = vector.copy()
    for row in range(size):
        for column in range(row + 1):
            left = matrix[row, column] - sum(root[row, k] * root[column, k] for k in range(column))
            root[row, column] = np.sqrt(left) if row == column else left / root[column, column]
        for k in range(row):
            out[row] -= root[row, k] * out[k]
        out[row] /= root[row, row]
    for row in reversed(range(size)):
        for k in range(row + 1, size):
            out[row] -= root[k, row] * out[k]
        out[row] /= root[row, row]
    return out, 2 * np.sum([np.log(root[row, row]) for row in range(size)], axis=0)


def _log_likelihood(
    shape: NDArray[np.float64],
    power: NDArray[np.float64],
    noise: NDArray[np.float64],
    bins: NDArray[np.float64],
    bends: NDArray[np.float64],
    start: NDArray[np.float64],
    bend_std: float,
    shares: NDArray[np.float64],
    leak: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Log likelihood of line powers in noise, the family's level and bends the likeliest, shape (shares, families).

    A mean of |line + noise|^2 as a gamma law of the same mean and variance: exact for noise alone. The families of
    `shape`, (lines, families), lie side by side in memory, as what is done to each line is the same for all; `bends`,
    (lines, functions), begins with ones. The likeliest of all bends, from `start`, are given too.
    """
    lines, families = shape.shape
    each = (lines, shares.shape[1], families)
    excess = (power - noise)[:, None, None]
    beat, own = ((2 * noise / bins)[:, None, None], ((noise + leak) ** 2 / bins)[:, None, None])
    by_line, shape = shares[:, :, None], shape[:, None]
    # past the edge of a narrow family there may be no line at all: its level is then anyone's guess
    like = shape * np.exp(bends[:, 1:] @ start)[:, None, None]
    level = np.maximum((excess * like).sum(axis=0) / np.maximum((like**2).sum(axis=0), LEAST_SUM), 1e-6)
    bent = np.empty((bends.shape[1], each[1] * families))
    bent[0] = np.broadcast_to(np.log(level), each[1:]).ravel()
    bent[1:] = start[:, None]
    places = [(row, column) for row in range(len(bent)) for column in range(row + 1)]
    pairs = np.stack([bends[:, row] * bends[:, column] for row, column in places])
    # a level of any size is as likely, what is left of its logarithm counts as if it were known to one
    known = np.array([1.0, *[bend_std**-2] * (len(bent) - 1)])
    held = known * (np.arange(len(bent)) > 0)
    for _ in range(LEVEL_STEPS):
        line = np.exp(bends @ bent).reshape(each)
        line *= shape
        pull = line / _variance(line, by_line, beat, own)
        score = bends.T @ ((excess - line) * pull).reshape(lines, -1) - held[:, None] * bent
        information = dict(zip(places, pairs @ (line * pull).reshape(lines, -1), strict=True))
        for row, information_before in enumerate(known):
            information[row, row] += information_before
        step, left = _solved(information, score)
        bent += np.clip(step, -LONGEST_STEP, LONGEST_STEP)
    line = np.exp(bends @ bent).reshape(each)
    line *= shape
    mean = line + (noise + leak)[:, None, None]
    number = mean**2
    number /= _variance(line, by_line, beat, own)
    ratio = np.divide((power + leak)[:, None, None], mean, out=mean)
    nats = np.log(ratio)
    nats -= ratio
    nats += 1
    nats *= number
    # Stirling's series for the gamma function
    nats += np.multiply(0.5, np.log(number, out=ratio), out=ratio)
    nats -= np.divide(1 / 12, number, out=number)
    total = nats.sum(axis=0) - 0.5 * ((held[:, None] * bent**2).sum(axis=0) + left).reshape(each[1:])
    return np.asarray(total, np.float64), bent[1:, int(total.argmax())]


def _variance(
    line: NDArray[np.float64], share: NDArray[np.float64], beat: NDArray[np.float64], own: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Variance of the mean power of a line: (share x line + beat) x line + own."""
    out = share * line
    out += beat
    out *= line
    out += own
    return out


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
    order : ndarray of int, shape (lines,)
        Orders of the chopping lines, rising, >= 1.
    power : ndarray, shape (lines,)
        Mean power of each line with its noise, any unit.
    noise : ndarray, shape (lines,)
        Mean power of the noise there, > 0.
    bins : ndarray, shape (lines,)
        Independent bins in each mean.
    blades : int, optional
        Blades of the rotor: they set how sharp the edge is. Those of `BLADES` are tried where it is not known.
    scatter : ndarray, shape (lines,), or float
        What is known beforehand of how unlike the model the lines' powers are: variance over the mean's square.
    leak : float
        Share of the family's power that lines may leak past its edge: that much, or less by `LEAST_LEAK`.
    plain : bool
        Take blades to reflect evenly or at their tips alone: where the lines of several rotors run into one another,
        what falls off says nothing more of them.
    spread : float
        Range of several rotors' rates over their mean, in whose multiples the orders are counted: what lies about a
        high order is then of its neighbours too.

    Returns
    -------
    edge, edge_std : float
        The tip's Doppler frequency and its standard deviation [chopping frequencies].
    """
    power, noise = power / noise.mean(), noise / noise.mean()  # of noise of mean 1
    excess = np.maximum(power - noise, 0.0)
    loud = float((excess**2).sum() / max(excess.sum(), 1e-9))
    maybe = order[_coarse_nats(power, noise, bins, loud) > -COARSE_NATS]
    choices = list(BLADES) if blades is None else [blades]
    low, high = (maybe[end] - sign * _half_range(maybe[end], min(choices)) for end, sign in ((0, 1), (-1, -1)))
    furthest = float(order[-1]) + _half_range(order[-1], min(choices))  # nothing speaks for an edge that nothing shows
    step = max(STEP, (high - low) / MOST_STEPS)
    # shares that the noise outweighs are all alike
    least = 0.1 * float((noise / bins).mean()) / max(loud, 1e-9)
    every = np.array([share for share in SHARES if share >= least or share == SHARES[-1]])
    scatter = np.broadcast_to(scatter, power.shape)
    prior = SHARE_FALL ** np.arange(len(SHARES))
    prior = np.append(prior[: len(SHARES) - len(every) + 1].sum(), prior[len(SHARES) - len(every) + 1 :])
    few, profiles = np.arange(len(every))[::-FIRST_SHARES], np.arange(2 if plain else len(PROFILES))
    bend_std = PLAIN_BEND if plain else BEND_STD
    bent, edge = np.zeros(len(BENDS)), high
    leaks = [leak]
    while len(leaks) < MOST_LEAKS and leaks[-1] * loud > LEAK_SEEN:
        leaks.append(LEAST_LEAK * leaks[-1])
    for search in range(SEARCHES):
        apart, edges = step, np.arange(max(low, LEAST_EDGE), high + step, step)
        # the first that is seen may lie past where the edge is sought: that nothing is there speaks too
        near = order <= max(high + REACH * high ** (1 / 3) / min(choices) ** (2 / 3), order[0])
        count = int(order[near][-1])
        shapes = [_spread_powers(number * edges, number, count, spread)[profiles] for number in choices]
        families = np.ascontiguousarray(np.stack(shapes)[..., order[near] - 1].reshape(-1, int(near.sum())).T)
        # how far from the tip each line speaks of
        away = np.clip(1 - order[near] / edge, 0, 1)
        bends = np.stack([away**exponent for exponent in (0.0, *BENDS)], axis=1)
        data = (
            families,
            power[near],
            noise[near],
            bins[near],
            bends,
            bent,
            bend_std,
            (every[few, None] + scatter[near]).T,
        )
        # the first search asks the one of less sharp an edge alone: it only says about which lines to look
        said = [_log_likelihood(*data, share * loud) for share in (leaks if search else leaks[:1])]
        nats, bent = np.stack([one for one, _ in said]), max(said, key=lambda one: float(one[0].max()))[1]
        weight = np.moveaxis(nats.reshape(*nats.shape[:2], len(choices), len(profiles), len(edges)), (0, 1), (4, 3))
        likely = np.outer([BLADES.get(number, 1.0) for number in choices], np.array(PROFILES)[profiles])
        weight += np.log(likely)[..., None, None, None]
        weight += np.log(prior[few] / edges[:, None])[..., None]
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
        choices = [number for number, own in zip(choices, weight, strict=True) if own.sum() > NEGLIGIBLE]
        profiles = profiles[weight.sum(axis=(0, 2, 3, 4)) > NEGLIGIBLE]
        if search:
            leaks = [one for one, own in zip(leaks, weight.sum(axis=(0, 1, 2, 3)), strict=True) if own > NEGLIGIBLE]
        live = few[weight.sum(axis=(0, 1, 2, 4)) > NEGLIGIBLE]
        few = np.arange(max(live.min() - 2, 0), min(live.max() + 3, len(every)))
    return edge, float(np.hypot(std, apart / np.sqrt(12)))  # nor is it known better than to a step


def _half_range(order: int, blades: int) -> float:
    """How far from a line that may be the last the edge may be [lines]."""
    return float(max(HALF_RANGE, HALF_WIDTHS * order ** (1 / 3) / blades ** (2 / 3)))


def _coarse_nats(
    power: NDArray[np.float64], noise: NDArray[np.float64], bins: NDArray[np.float64], loud: float
) -> NDArray[np.float64]:
    """Log likelihood of each line to be the last of a family of one level, less that of the likeliest.

    Powers are exponentials; far under the level, where a family rolls off, nothing counts.
    """
    ratio = (power + COARSE_LEAK_SHARE * loud) / (noise + COARSE_LEAK_SHARE * loud)
    total, number = np.cumsum(bins * ratio), np.cumsum(bins)
    mean = np.maximum(total / number, 1.0)
    nats = number * (mean - 1 - np.log(mean))
    return np.asarray(nats - nats.max(), np.float64)
