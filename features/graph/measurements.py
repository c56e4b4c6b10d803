"""The numbers of the feature vector in graph operators, each as defined in the module that its docstring names.

A number of a record has the shape (n, 1), a spectrum (n, bins).
"""

from dataclasses import dataclass

import numpy as np

from .. import bandwidth, chopping, notch, shape, smearing, vector
from ..axis import UNSEEN_DB, axis_velocities_mps
from ..change import CENTROID_DB
from ..fast import LOWEST_DB
from ..spectrum import Spectrum
from .operators import Value
from .spectrum import dft_power, to_db

LOG10 = 1 / np.log(10)


def log10(value: Value) -> Value:
    """Logarithm to base 10."""
    return value.apply("Log") * LOG10


def ratio(above: Value, below: Value) -> Value:
    """Ratio of two values; the divisor counts as 1 where it is not above 0."""
    return above / below.graph.where(below > 0.0, below, 1.0)


@dataclass(frozen=True)
class Body:
    """The strongest line: its bin (int64), velocity [m/s] and level [dB]."""

    index: Value
    velocity_mps: Value
    level_db: Value


def _vertex(left: Value, middle: Value, right: Value) -> Value:
    """Where a parabola through three neighbours peaks, -0.5 to 0.5 from the middle one."""
    curve = 2.0 * middle - left - right
    where = middle.graph.where
    curved = (curve > 0.0) & (curve > middle.apply("Abs") * float(notch.LEAST_CURVE))
    offset = where(curved, (right - left) / where(curved, 2.0 * curve, 1.0), 0.0)
    return offset.at_least(-0.5).at_most(0.5)


def _around(index: Value, bins: int) -> Value:
    """Index modulo the number of bins, which lie on a circle."""
    return index.graph.op("Mod", index, np.array(bins))


def body_line(radar: Spectrum, relative_power: Value) -> Body:
    """As `notch.body_line`."""
    index = (relative_power >= relative_power.max() * float(notch.EQUAL_SHARE)).to(np.float32).argmax()
    places = _around(index + np.array([radar.bins - 1, 0, 1]), radar.bins)
    top = to_db(relative_power.pick(places))
    left, middle, right = (top.slice(i, i + 1) for i in range(3))
    step = radar.prf_hz / radar.bins * radar.wavelength_m / 2
    at_bin = index.graph.constant(radar.velocity_mps, np.float32).take_rows(index)
    return Body(index, at_bin - _vertex(left, middle, right) * step, middle)


def notch_weights(radar: Spectrum, body: Body) -> Value:
    """As `notch.weights` of `notch.notch_mask`."""
    bins, half = radar.bins, notch.half_width_bins(radar)
    keep, _ = notch.notches(bins, half)
    distance = (np.arange(bins, dtype=np.float32) - body.index.to(np.float32)).apply("Abs")
    far = distance.at_most(float(bins) - distance) > float(half)
    return far.to(np.float32) * keep.astype(np.float32)


def threshold_width_hz(radar: Spectrum, relative_power: Value, kept: Value) -> Value:
    """Width of the band that `bandwidth.threshold_band_hz` gives at `bandwidth.noise_threshold_db` [Hz]."""
    threshold = 10 ** (bandwidth.noise_threshold_db(radar.bins) / 10)
    over = (relative_power > threshold).to(np.float32) * kept
    frequency = over.graph.constant(radar.frequency_hz, np.float32)
    first = over.argmax()
    last = over.graph.op("ArgMax", over, dtype=np.int64, axis=-1, keepdims=1, select_last_index=1)
    width = frequency.take_rows(last) - frequency.take_rows(first)
    return over.graph.where(over.max() > 0.0, width, 0.0)


def energy_band(radar: Spectrum, energy: Value) -> tuple[Value, Value, Value]:
    """As `bandwidth.energy_band_mps`: low and high edge [m/s] and occupancy."""
    graph, bins = energy.graph, radar.bins
    upto = energy.cumsum()
    total = upto.slice(bins - 1, bins)
    first, last = (
        (upto < share * total).count().at_most(float(bins - 1))
        for share in (bandwidth.TAIL_SHARE, 1 - bandwidth.TAIL_SHARE)
    )
    position = graph.constant(np.arange(bins), np.float32)
    within = (position >= first) & (position <= last) & (energy > 0.0)
    velocity = graph.constant(radar.velocity_mps, np.float32)
    some = total > 0.0
    low, high = (graph.where(some, velocity.take_rows(bin_.to(np.int64)), 0.0) for bin_ in (last, first))
    return low, high, graph.where(some, within.count() / (last - first + 1.0), 0.0)


def entropy(energy: Value, bins: int) -> Value:
    """As `shape.entropy`."""
    share = ratio(energy, energy.max())
    total = share.sum()
    safe = energy.graph.where(total > 0.0, total, 1.0)
    bits = (safe.apply("Log") - (share * share.at_least(1e-12).apply("Log")).sum() / safe) / np.log(bins)
    return energy.graph.where(total > 0.0, bits.at_least(0.0).at_most(1.0), 1.0)


def ripple_db(level_db: Value, kept: Value) -> Value:
    """As `shape.ripple_db`."""
    count = kept.sum().at_least(1.0)
    level = level_db * kept
    mean = level.sum() / count
    return ((level * level).sum() / count - mean * mean).at_least(0.0).apply("Sqrt")


def symmetry(radar: Spectrum, energy: Value, body: Body) -> Value:
    """As `shape.symmetry`."""
    bins, reach = radar.bins, radar.bins // 2 - 1
    root = energy.apply("Sqrt").apply("Sqrt")
    twice = energy.graph.concat(root, root)  # the circle of bins twice, so that no side is cut
    away = np.arange(reach) + 1
    right, left = (twice.pick(body.index + places) for places in (away, bins - away))
    right, left = right - right.mean(), left - left.mean()
    norm = ((right * right).sum() * (left * left).sum()).apply("Sqrt")
    return energy.graph.where(norm > 0.0, ratio((right * left).sum(), norm), 0.0)


def band_levels_db(axis_db: Value, bins: int) -> tuple[Value, Value]:
    """As `shape.band_levels_db`, shape (n, bands) each."""
    one, other = (_marked(axis_db.graph.matmul(axis_db, side.T)) for side in np.split(shape.band_shares(bins), 2))
    return one.at_least(other), one.at_most(other)


def _marked(level_db: Value) -> Value:
    """Levels, set to exactly `LOWEST_DB` or `UNSEEN_DB` where they are that but for rounding: trees split there."""
    for mark_db in (LOWEST_DB, UNSEEN_DB):
        level_db = level_db.graph.where((level_db - mark_db).apply("Abs") > 1e-4, level_db, mark_db)
    return level_db


def change_levels_db(change: Value, bins: int) -> Value:
    """Mean change at slow, middle and fast speeds as in `vector.feature_vector`, shape (n, 3)."""
    return change.graph.matmul(change, vector.axis_plan(bins)[1].T)


def centroid_mps(parts_db: Value, bins: int) -> Value:
    """As `change.centroid_mps`, shape (n, parts)."""
    weight = (parts_db - CENTROID_DB).at_least(0.0)
    sums = weight.graph.matmul(weight, axis_velocities_mps(bins)[:, None])
    return ratio(sums, weight.sum()).squeeze()


@dataclass(frozen=True)
class Chopping:
    """Whether there is an estimate, and its frequency [Hz], strength and repeats."""

    given: Value
    frequency_hz: Value
    strength: Value
    repeats: Value


def cepstral_chopping(radar: Spectrum, level_db: Value, kept: Value) -> Chopping | None:
    """As `chopping.cepstral_chopping`; None where the dwell holds no range to search."""
    first, last = chopping.searched_periods(radar)
    if last - first < 4:
        return None
    graph, periods = level_db.graph, radar.bins // 2 + 1
    where = graph.where
    level = level_db.at_least(0.0).at_most(chopping.CLIP_DB) * kept
    level = level - kept * (level.sum() / kept.sum().at_least(1.0))
    noise = chopping.noise_shape(radar.pulses, radar.bins, radar.window)
    heights = dft_power(level, radar.bins, periods).apply("Sqrt") / noise
    flat = _prominence(heights, periods)

    window = flat.slice(first, last + 1)
    searched = last + 1 - first
    even = 1 - searched % 2
    rms = heights.slice(first, last + 1).ranked(searched // 2 - even, 1 + even).mean() / chopping.MEDIAN_OVER_RMS
    highest = _evidence(flat, first, last, periods).argmax()
    peak, top = window.pick(highest), highest.to(np.float32) + float(first)
    least = (chopping.FUNDAMENTAL_SHARE * peak).at_least(chopping.FUNDAMENTAL_STRENGTH * rms)
    best = top
    for divisor in chopping.DIVISORS.ravel():
        near = (top / float(divisor)).apply("Round")
        around = flat.pick(near + chopping.NEIGHBOURS.ravel().astype(np.float32))
        ok = (near >= float(first)) & (around.max() >= least)
        best = where(ok, near - 1.0 + around.argmax().to(np.float32), best)
    best = best.at_least(1.0).at_most(float(periods - 2))
    left, middle_, right = (flat.pick(best + float(shift)) for shift in (-1, 0, 1))
    period = best + _vertex(left, middle_, right)
    twice, thrice = (
        flat.pick((float(multiple) * period).apply("Round").at_most(float(periods - 1)))
        for multiple in chopping.MULTIPLES.ravel()
    )
    return Chopping(rms > 0.0, radar.prf_hz / period, ratio(middle_, rms), ratio((twice + thrice) / 2.0, middle_))


def _evidence(peaks: Value, first: int, last: int, periods: int) -> Value:
    """As `chopping._evidence`."""
    out = peaks.slice(first, last + 1)
    stop = min(last, (periods - 2) // 2)
    if stop >= first:
        twice = 2 * np.arange(first, stop + 1)
        again = peaks.take(twice - 1).at_least(peaks.take(twice)).at_least(peaks.take(twice + 1))
        out = out + (again * chopping.REPEAT_SHARE).pad(0, last - stop)
    return out * chopping.length_weights(first, last)


def _prominence(heights: Value, periods: int) -> Value:
    """As `chopping.prominence`."""
    (starts, stops), shares = chopping.surroundings(periods)
    upto = heights.cumsum().pad(1, 0)
    below, above = ((upto.take(stops[side]) - upto.take(starts[side])) * shares[side] for side in (0, 1))
    out = heights - below.at_least(above).to(np.float32) + heights.mean()
    return (out * (np.arange(periods) >= 2).astype(np.float32)).at_least(0.0)


def smearing_index(radar: Spectrum, energy: Value, body: Body, comb: Chopping) -> Value:
    """As `smearing.smearing_index`, 0 instead of no value."""
    where = energy.graph.where
    centre = body.velocity_mps * (-2 / radar.wavelength_m)
    order = (radar.frequency_hz.astype(np.float32) - centre) / where(comb.given, comb.frequency_hz, 1.0)
    nearest = order.apply("Round")
    x, y = nearest * nearest, (order - nearest) * (order - nearest)
    counts = (x <= float(smearing.MAX_ORDER**2)) & (x > 0.0)
    weight = energy.apply("Sqrt") * counts.to(np.float32)
    total = weight.sum()
    x = x - ratio((weight * x).sum(), total)
    weight = weight * x
    variance, covariance = ratio((weight * x).sum(), total), ratio((weight * y).sum(), total)
    slope = covariance / where(variance > smearing.LEAST_VARIANCE, variance, float("inf"))
    index = slope.at_least(0.0).at_most(smearing.FULLY_SMEARED**2).apply("Sqrt")
    return where((total > 0.0) & comb.given, index, 0.0)
