"""Edge of the line family of one or several rotors, from the fitted lines or from all power about the orders."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..lines import LinesSeen
from .comb import Comb
from .comb_fit import CombFit
from .folding import fastest_tip, outermost_orders
from .periodogram import Periodogram
from .rotor_band import LEAK_SHARE, fit_edge
from .rotors import Rotors

#: Rotors whose lines at an order lie nearer than this [bins] have one line there.
MERGED_BINS = 1.0

#: The edge of unresolved rotors' fitted lines is kept if that of all power about the orders agrees within
#: AGREED_DEVIATIONS of the latter's. Agreement may be chance: the kept edge's standard deviation includes APART_SHARE
#: of their difference, at least CHANCE_SHARE of the other's deviation.
AGREED_DEVIATIONS, APART_SHARE, CHANCE_SHARE = 2.0, 0.7, 0.25

#: Power about the orders includes the fitted lines, under more noise. If its edge lies below theirs by more than
#: BELOW_DEVIATIONS of both, its outer lines are lost: those of blades that are points lie far under the inner ones, or
#: all are nothing beside a background's skirt. Theirs must be known to BELOW_SURE of itself: rates that part past the
#: edge alone leave no line to see.
BELOW_DEVIATIONS, BELOW_SURE = 1.0, 0.2

#: Share of the power of several rotors' family that is ignored past its edge: residue of their inner lines lifts the
#: level that the outer ones are compared with.
SEVERAL_LEAK = 0.005

#: Rotors with less than this share of the fastest one's chopping frequency have blades of another number or length, and
#: an edge at another order: the band is that of those which reach further.
LIKE_SHARE = 0.75

#: For sums of power about an order. AROUND_SCATTER: variance over the square, beyond what the fit finds by itself,
#: where the rotors' lines overlap. AROUND_LINES: least standard deviation of an edge [lines].
AROUND_SCATTER, AROUND_LINES = 0.2, 0.035

#: Orders mix at the edge where the tips of the rotors, spread evenly from the slowest to the fastest, have more than
#: this standard deviation [lines].
MIXED_LINES = 0.25

#: With fewer orders seen below an edge, the level from which the family falls there is unknown.
LEVEL_ORDERS = 4

#: Lines of two rotors at different orders, nearer than this [bins], cover one another.
COVERED_BINS = 1.5

#: A line FOREIGN_FACTOR times stronger than its counterpart on the other side and than the median within FOREIGN_ORDERS
#: is another target's.
FOREIGN_FACTOR, FOREIGN_ORDERS = 10.0, 8

#: Lines are sought out to SPAN from the body [cycles a sample], further where folded ones are told from the others. A
#: family that has SPAN_SHARE of its mean power there, by SPAN_DEVIATIONS of the noise, has no visible edge: its further
#: lines are folded back between the others.
SPAN, SPAN_SHARE, SPAN_DEVIATIONS = 0.49, 0.05, 4.0

#: Orders beyond this share of the span show whether lines fill it.
SPAN_OUTER = 0.9

#: At least this share of the orders is taken to lie beyond the edge: that quantile of the power about the orders bounds
#: the noise. For noise alone it lies NOISE_BELOW standard deviations below the mean.
NOISE_ORDERS, NOISE_BELOW = 0.1, 1.28

#: Beyond NOISE_FROM times the edge there is noise alone. If its nearer and its further half differ by more than
#: UNEVEN_NATS plus three standard deviations [nats], and by more than UNEVEN_SHARE of the family's power, which leaks
#: there, the receiver's band is not flat.
NOISE_FROM, UNEVEN_NATS, UNEVEN_SHARE = 1.15, 0.1, 5e-4

#: Noise shows between the lines of unresolved rotors where these are spread over less than this [orders].
GAPS_SHOW = 0.4

#: Least relative spread assumed of the rates of unresolved rotors.
LEAST_SPREAD = 0.02


def span_of(data: Periodogram, fits: Sequence[CombFit] = ()) -> float:
    """How far from the body lines of a rotor are sought [cycles a sample].

    `SPAN`, or further for one rotor whose fitted lines are folded; at most the fastest tip's Doppler.
    """
    span = SPAN
    if len(fits) == 1 and fits[0].is_folded:
        span = 2 * SPAN * int(outermost_orders(data, fits[0].spacing)) * fits[0].spacing
    return min(span, fastest_tip(data))


def _orders(spacing: float, span: float) -> NDArray[np.intp]:
    """Orders of the lines within a span, the first at least."""
    return np.arange(1, max(int(span / spacing), 1) + 1)


def edge_of_lines(
    data: Periodogram,
    fits: list[CombFit],
    rest: NDArray[np.complex128],
    per_turn: int,
    blades: int | None,
    others: ArrayLike = (),
) -> tuple[float, float]:
    """Edge of the line family by the fitted lines, both sides together.

    Each line's power is measured with all other fitted lines subtracted; an order's is the mean over both sides and all
    rotors, since their lines separate at the outer orders.

    Parameters
    ----------
    data : Periodogram
        The record.
    fits : list of CombFit
        The rotors' combs.
    rest : ndarray of complex128, shape (pulses,)
        Samples that these leave.
    per_turn : int
        Strong lines are this many spacings of a fit apart.
    blades : int, optional
        Of a rotor.
    others : array_like, optional
        Spacings of other combs about the same centre [cycles a sample], whose outer lines may not have been fitted.

    Returns
    -------
    edge, edge_std : float
        The tip's Doppler frequency and its standard deviation [cycles a sample from the body]; 0 and infinity where no
        lines are resolved, both infinite where they fill the span.
    """
    spacings = np.array([fit.spacing * per_turn for fit in fits])
    fastest = float(spacings.max())
    like = spacings > LIKE_SHARE * fastest
    if not like.all():
        edges = (
            edge_of_lines(
                data,
                [fit for fit, own in zip(fits, group, strict=True) if own],
                rest,
                per_turn,
                blades,
                np.append(others, spacings[~group]),
            )
            for group in (like, ~like)
        )
        return max(edges)
    span = span_of(data, fits)
    order = _orders(fastest, span)
    sides = np.array([[-1], [1]]) * order
    centres = np.array([fit.centre for fit in fits])
    frequency = np.asarray(centres[:, None, None] + spacings[:, None, None] * sides, np.float64)
    fitted = np.stack([fit.amplitudes_at(per_turn * sides) for fit in fits])
    left = LinesSeen(rest[None]).means(frequency.ravel()).reshape(frequency.shape)
    usable = data.usable(frequency) & ~_covered(np.append(spacings, others), order, data.pulses)[: len(fits), None]
    power = np.abs(left + fitted) ** 2 * data.pulses
    usable &= ~_foreign(np.where(usable, power, 0.0).sum(axis=0), usable.sum(axis=0))
    total = np.where(usable, power, 0.0).sum(axis=(0, 1))
    noise = np.where(usable, data.level_of(rest, evened=True)(frequency), 0.0).sum(axis=(0, 1))
    number = usable.sum(axis=(0, 1)).astype(float)
    # where the rotors' lines overlap they add up: those orders are too strong beside the outer ones
    nearest = float(np.diff(np.sort(spacings)).min()) if len(fits) > 1 else 1.0
    seen = (number > 0) & (order * nearest * data.pulses >= MERGED_BINS)
    if not seen.any():
        return 0.0, np.inf
    count = number[seen]
    if _fills_span(order[seen] * fastest, total[seen], noise[seen], count, span):
        return np.inf, np.inf
    leak = SEVERAL_LEAK if len(fits) > 1 else LEAK_SHARE
    edge, std = fit_edge(order[seen], total[seen] / count, noise[seen] / count, count, blades, leak=leak)
    std = float(np.hypot(std, _unseen_about(order[seen], edge) / np.sqrt(12)))
    return edge * fastest, std * fastest


def _unseen_about(seen: NDArray[np.intp], edge: float) -> int:
    """Number of unseen orders in one row about an edge, or below it: it may be anywhere among them."""
    above = int(np.searchsorted(seen, edge))
    if above < LEVEL_ORDERS:
        return int(seen[0]) - 1
    return int(seen[above] - seen[above - 1]) - 1 if above < len(seen) else 0


def _covered(spacings: NDArray[np.float64], order: NDArray[np.intp], pulses: int) -> NDArray[np.bool_]:
    """True where a line of another order of another rotor covers a rotor's, shape (rotors, orders).

    Past a slower rotor's edge it would pass for that rotor's line, as the fit divides the power between both.
    """
    own, others = spacings[:, None, None], spacings[:, None]
    there = np.rint(order * own / others)
    away = np.abs(order * own - there * others) * pulses
    return np.asarray(((there != order) & (away < COVERED_BINS)).any(axis=1))


def _foreign(power: NDArray[np.float64], number: NDArray[np.floating]) -> NDArray[np.bool_]:
    """True where another target's echo lies on an order, shape (sides, orders).

    Parameters
    ----------
    power : ndarray, shape (2, orders)
        Power of the lines on each side of the body, summed.
    number : ndarray, same shape
        Number of lines in each sum.
    """
    known = number > 0
    mean = np.where(known, power / np.maximum(number, 1e-9), np.inf)
    around = np.pad(mean, ((0, 0), (FOREIGN_ORDERS, FOREIGN_ORDERS)), constant_values=np.inf)
    near = np.sort(np.lib.stride_tricks.sliding_window_view(around, 2 * FOREIGN_ORDERS + 1, axis=-1), axis=-1)
    middle = np.isfinite(near).sum(axis=-1) // 2
    median = np.take_along_axis(near, middle[..., None], axis=-1)[..., 0]
    # a rotor's line is about as strong as its neighbours, or as its counterpart on the other side
    return np.asarray(known & (mean > FOREIGN_FACTOR * np.maximum(median, mean[::-1])))


def _fills_span(
    away: NDArray[np.float64],
    total: NDArray[np.float64],
    noise: NDArray[np.float64],
    bins: NDArray[np.float64],
    span: float,
) -> bool:
    """True where a line family still stands at the end of the span.

    Parameters
    ----------
    away : ndarray, shape (orders,)
        Distance of each order from the body, rising [cycles a sample].
    total, noise : ndarray, shape (orders,)
        Summed power of its lines with noise, and of noise alone.
    bins : ndarray, shape (orders,)
        Bins in each sum.
    span : float
        From `span_of`.
    """
    outer = (away > SPAN_OUTER * span) | (away == away[-1])
    excess, about = total - noise, float(noise[outer].sum())
    # a sum of few exponentials is often far above its mean: Wilson and Hilferty's cube root is nearly normal
    number = about**2 / float((noise[outer] ** 2 / bins[outer]).sum())
    deviations = 3 * np.sqrt(number) * (np.cbrt(total[outer].sum() / about) - 1 + 1 / (9 * number))
    mean, outer_mean = float(excess.sum() / bins.sum()), float(excess[outer].sum() / bins[outer].sum())
    return bool(away[-1] > span / 2 and deviations > SPAN_DEVIATIONS and outer_mean > SPAN_SHARE * mean)


def surer_edge(lines: tuple[float, float], around: tuple[float, float]) -> tuple[float, float]:
    """Edge of unresolved rotors and its deviation: of the lines if that is surer, else of all power about the orders.

    Only the second includes unresolved rotors. It keeps its own standard deviation. The first keeps its own where it
    surely lies past the second. Else it is known no better than both agree, since lines of rotors not found may pass
    for lines past the edge.

    Parameters
    ----------
    lines, around : (float, float)
        From `edge_of_lines` and `edge_around`.
    """
    if not np.isfinite(lines[0] + around[0]):
        return np.inf, np.inf
    if np.isinf(around[1]):  # nothing was seen
        return lines
    past = lines[0] - around[0]
    is_lost = past > max(AGREED_DEVIATIONS * around[1], BELOW_DEVIATIONS * np.hypot(lines[1], around[1]))
    if is_lost and lines[1] < BELOW_SURE * lines[0]:
        return lines
    apart = abs(past)
    std = float(np.hypot(lines[1], max(APART_SHARE * apart, CHANCE_SHARE * around[1])))
    return (lines[0], std) if apart < AGREED_DEVIATIONS * around[1] and std < around[1] else around


def _uneven_past(order: NDArray[np.intp], mean: NDArray[np.float64], bins: NDArray[np.float64], edge: float) -> bool:
    """True where the noise past an edge is not flat, by more than what leaks there from within.

    Parameters
    ----------
    order : ndarray of int, shape (orders,)
        Rising.
    mean, bins : ndarray, shape (orders,)
        Mean power about each order, and of how many bins.
    edge : float
        Edge of the family [orders].
    """
    past = np.flatnonzero(order > NOISE_FROM * edge)
    if len(past) < 2:
        return False
    parts = np.array_split(past, 2)
    near, far = (max(float(np.average(mean[part], weights=bins[part])), 1e-9) for part in parts)
    deviation = float(np.sqrt(sum(1 / bins[part].sum() for part in parts)))
    within = float(mean[: max(int((order < edge).sum()), 1)].mean())
    return abs(np.log(near / far)) > UNEVEN_NATS + 3 * deviation and abs(near - far) > UNEVEN_SHARE * within


def _noise_about(smear: NDArray[np.float64], level: NDArray[np.float64], flat: float) -> NDArray[np.float64]:
    """Noise about each order of unresolved rotors, for a receiver whose band is not flat.

    It is the local level where the lines leave gaps. Where they fill the gaps they lift that level: there the noise is
    at most an interpolation from the last sure level to the lowest of all.

    Parameters
    ----------
    smear : ndarray, shape (orders,)
        How far the lines about each order are spread, rising [orders].
    level : ndarray, same shape
        Local level.
    flat : float
        The lowest of all.
    """
    last = int((smear < GAPS_SHOW).sum())
    if last in (0, len(level)):
        return level if last else np.full(len(level), flat)
    start = float(np.log(level[max(last - 3, 0) : last].mean()))
    way = np.linspace(start, min(float(np.log(flat)), start), len(level) - last + 1)[1:]
    return np.concatenate([level[:last], np.minimum(level[last:], np.exp(way))])


def edge_around(
    data: Periodogram, comb: Comb, rotors: Rotors, blades: int | None, lines: tuple[float, float]
) -> tuple[float, float]:
    """Edge of the line family from all power about each order, so that unresolved rotors count too.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it.
    rotors : Rotors
        The rotors found in it.
    blades : int, optional
        Of a rotor.
    lines : (float, float)
        From `edge_of_lines`, infinite too: decides where noise and lines may be taken for one another.

    Returns
    -------
    edge, edge_std : float
        As from `edge_of_lines`, of the fastest rotor.
    """
    nominal, centre = float(np.mean([rotors.rates.min(), rotors.rates.max()])), rotors.fits[0].centre
    size, pulses = len(data.power), data.pulses
    span = span_of(data)
    order = _orders(nominal, span)
    spread = max(rotors.spread, LEAST_SPREAD * nominal)
    half_bins = min(nominal * pulses / 2, 1 + comb.last / comb.per_turn * spread * pulses)
    half = int(half_bins * size / pulses)
    middle = np.rint((centre + np.array([[-1], [1]]) * order * nominal) * size).astype(np.intp)
    frequency = (middle[..., None] + np.arange(-half, half + 1)) / size
    usable = data.usable(frequency) & data.in_band(frequency)
    sides = np.where(usable, data.at(frequency) * data.level_at(frequency), 0.0).sum(axis=-1) * pulses / size
    numbers = usable.sum(axis=-1) * pulses / size
    own = ~_foreign(sides, numbers)
    total, number = (sides * own).sum(axis=0), (numbers * own).sum(axis=0)
    seen = number > 2
    if not seen.any():
        return 0.0, np.inf
    count = number[seen]
    # power between the lines lifts the local level, and lines that fill most of the span the floor; `lowest` is that
    # quantile for the mean of so many exponentials, by Wilson and Hilferty's cube
    lowest = (1 - 1 / (9 * count) - NOISE_BELOW / (3 * np.sqrt(count))) ** 3
    mean = total[seen] / count
    flat = min(float(np.quantile(mean / lowest, NOISE_ORDERS)), 1.0)
    noise = np.full(len(count), flat)
    if _fills_span(np.asarray(order[seen] * nominal, np.float64), total[seen], noise * count, count, span):
        return np.inf, np.inf
    # once the lines separate, their mutual leakage falls with the square of their distance
    scatter = np.asarray(AROUND_SCATTER / (1 + (2 * order[seen] * rotors.spread * pulses) ** 2), np.float64)
    relative = spread / nominal

    def fitted(noise: NDArray[np.float64]) -> tuple[float, float]:
        return fit_edge(
            order[seen],
            mean,
            noise,
            count,
            blades,
            scatter=scatter,
            leak=SEVERAL_LEAK,
            plain=True,
            spread=relative,
        )

    edge, std = fitted(noise)
    fastest = float(max(nominal, rotors.rates.max()))
    if _uneven_past(order[seen], mean, count, edge):
        level = np.where(usable, data.level_at(frequency), 0.0).sum(axis=-1) * pulses / size
        other = fitted(_noise_about(order[seen] * relative, (level * own).sum(axis=0)[seen] / count, flat))
        # strong lines close together lift the level between them as an uneven band does: the fitted lines decide
        one, another = (
            abs(tried * fastest - lines[0]) / np.hypot(its_std * fastest, lines[1]) if np.isfinite(lines[0]) else np.inf
            for tried, its_std in ((edge, std), other)
        )
        apart = abs(edge - other[0])
        if not (one < AGREED_DEVIATIONS and another > 2 * AGREED_DEVIATIONS):
            edge, std = other
            if not (another < AGREED_DEVIATIONS and one > 2 * AGREED_DEVIATIONS):
                std = float(np.hypot(std, CHANCE_SHARE * apart))
    # where orders mix at the edge, it is known only to lie between the tips of the slowest and the fastest
    mixed = edge * relative / np.sqrt(12)
    # rotors not found may turn faster than the fastest found: the edge is uncertain by that
    hidden = edge * max(spread - float(np.ptp(rotors.rates)), 0.0) / nominal / 2
    return edge * fastest, float(np.hypot(std, mixed if mixed > MIXED_LINES else max(hidden, AROUND_LINES))) * fastest
