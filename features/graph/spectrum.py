"""The Doppler spectrum, its noise floor and the shared axis in graph operators (definitions: `spectrum`, `axis`)."""

import numpy as np
from numpy.typing import NDArray

from .. import spectrum as definition
from ..axis import UNSEEN_DB, Pooling
from ..cadence import CadencePlan
from ..fast import LOWEST_DB
from ..window import Window
from .operators import Value


def dft(packed: Value, length: int, count: int) -> Value:
    """Discrete Fourier transform as two matrix products with twiddle factors between (Cooley and Tukey 1965).

    Lengths that transform fast have factors near their root, so this costs 8 length^1.5 multiplications and runs on
    any runtime's matrix product; the standard's own operator is slower and, off powers of two, less exact.

    Parameters
    ----------
    packed : Value
        Shape (n, 2, length): real and imaginary parts.
    length : int
        Of the transform.
    count : int
        How many coefficients are wanted, from 0 on.

    Returns
    -------
    Value
        Shape (n, 2, count).
    """
    full, rows, wanted = _by_rows(packed, length, count, parts=2)
    line = full.reshape(-1, rows, 2, wanted).transpose(0, 2, 3, 1).reshape(-1, 2, rows * wanted)
    return line if rows * wanted == count else line.slice(0, count)


def dft_power(samples: Value, length: int, count: int, *, parts: int = 1, conjugate: bool = False) -> Value:
    """Squared magnitude of the transform of real samples (n, length), or, for 2 `parts`, (n, 2, length): (n, count).

    With `conjugate` the samples are conjugated first: this gives that of the inverse transform, without 1 / length.
    """
    full, rows, wanted = _by_rows(samples, length, count, parts=parts, conjugate=conjugate)
    squares = full * full
    line = (squares.slice(0, wanted) + squares.slice(wanted, 2 * wanted)).transpose(0, 2, 1).reshape(-1, rows * wanted)
    return line if rows * wanted == count else line.slice(0, count)


def _by_rows(samples: Value, length: int, count: int, *, parts: int, conjugate: bool = False) -> tuple[Value, int, int]:
    """Transform of shape (n, rows, 2 wanted), coefficient k in row k % rows and column k // rows of both halves."""
    graph = samples.graph
    rows = next(n for n in range(int(np.sqrt(length)), 0, -1) if length % n == 0)
    columns = length // rows
    wanted = -(-count // rows)

    def turns(left: NDArray, right: NDArray, period: int) -> tuple[NDArray, NDArray]:
        phase = np.exp(-2j * np.pi * (np.outer(left, right) % period) / period)
        return phase.real.astype(np.float32), phase.imag.astype(np.float32)

    across = np.arange(rows)
    cosine, sine = turns(across, across, rows)
    first = np.block([[cosine, -sine], [sine, cosine]])[:, : parts * rows]
    if conjugate:
        first[:, rows:] *= -1
    half = graph.matmul(first, samples.reshape(-1, parts * rows, columns))
    re, im = half.slice(0, rows, axis=-2), half.slice(rows, 2 * rows, axis=-2)
    cosine, sine = turns(across, np.arange(columns), length)
    turned = graph.concat(re * cosine - im * sine, re * sine + im * cosine)
    cosine, sine = turns(np.arange(columns), np.arange(wanted), columns)
    return graph.matmul(turned, np.block([[cosine, sine], [-sine, cosine]])), rows, wanted


def centred_transform(packed: Value, pulses: int, bins: int, window: Window) -> Value:
    """As `spectrum.centred_transform`: from samples (n, 2, pulses) to real and imaginary parts (n, 2, bins)."""
    even = bins % 2 == 0
    transform = dft((packed * definition.packed_window(pulses, even, window)[::2]).pad(0, bins - pulses), bins, bins)
    half = (bins + 1) // 2
    return transform if even else packed.graph.concat(transform.slice(half, bins), transform.slice(0, half))


def power_of(transform: Value, bins: int) -> Value:
    """As `fast.power_of`: from parts (n, 2, bins) to power (n, bins)."""
    squares = (transform * transform).reshape(-1, 2 * bins)
    return squares.slice(0, bins) + squares.slice(bins, 2 * bins)


def unit_scale(largest: Value) -> Value:
    """Factor that brings each record's largest part to 1, at most 2^126 and at least 2^-126.

    `samples.unit_scale` takes a power of two.
    """
    return 1.0 / largest.at_least(2.0**-126).at_most(2.0**126)


def side_floors(power: Value, bins: int, window: Window) -> Value:
    """As `Spectrum.side_floors`, shape (n, 2)."""
    half, lower = bins // 2, (bins + 1) % 2
    size = max(1, half // definition.FLOOR_BLOCKS)
    blocks = half // size
    sides = power.graph.concat(power.slice(lower, lower + blocks * size), power.slice(bins - blocks * size, bins))
    levels = sides.reshape(-1, 2, blocks, size).sum(keep=False).ranked(definition.quartile_rank(blocks)).squeeze()
    return levels / float(definition.quartile_of_noise(bins, size, blocks, window))


def noise_floor(power: Value, sides: Value) -> Value:
    """As the floor that `spectrum.doppler_spectrum` takes, of power and `side_floors`, shape (n, 1)."""
    one, other = sides.slice(0, 1), sides.slice(1, 2)
    least, most = one.at_most(other), one.at_least(other)
    level = power.graph.where(most > definition.EMPTY_RATIO * least, most, (least + most) / 2)
    return level.at_least(power.mean() * float(definition.LEAST_FLOOR)).at_least(float(definition.LEAST_POWER))


def noise_shows(power: Value, floor: Value) -> Value:
    """Whether the floor is noise, more than its lower bound, as `Spectrum.noise_shows`, shape (n, 1)."""
    return power.mean() * float(definition.LEAST_FLOOR / definition.SHOWN_SHARE) < floor


def to_db(relative_power: Value, lowest_db: float = LOWEST_DB) -> Value:
    """As `fast.to_db`."""
    return relative_power.at_least(10 ** (lowest_db / 10)).apply("Log") * (10 / np.log(10))


def spans_of(
    values: Value, length: int, starts: NDArray[np.intp], counts: NDArray[np.intp]
) -> tuple[Value, NDArray[np.bool_]]:
    """Take spans of neighbouring elements of the last axis, one span a row.

    They are taken in whole blocks, which a runtime copies at once: one by one takes three times as long.

    Parameters
    ----------
    values : Value
        Shape (n, length).
    length : int
        Elements of the last axis.
    starts, counts : ndarray of int, shape (spans,)
        First element of each span, and how many it holds.

    Returns
    -------
    elements : Value
        Shape (n, spans, width): those of each span, others of their blocks beside them.
    within : ndarray of bool, shape (spans, width)
        Which of them are the span's.
    """
    size = int(2 ** np.round(np.log2(counts.max()) / 2))
    blocks, number = -(-length // size), int(counts.max() + size - 2) // size + 1  # in all, and touched by a span
    places = (starts // size)[:, None] + np.arange(number)
    tiles = values.pad(0, blocks * size - length).reshape(-1, blocks, size)
    taken = tiles.take(np.minimum(places, blocks - 1), axis=-2).reshape(-1, len(starts), number * size)
    element = (places[..., None] * size + np.arange(size)).reshape(len(starts), -1)
    return taken, (element >= starts[:, None]) & (element < (starts + counts)[:, None])


def pooled(relative_power: Value, length: int, pool: Pooling | CadencePlan) -> Value:
    """As `Pooling.mean_and_peak_db` of `length` bins or lines, shape (n, 2, axis bins)."""
    starts, counts = pool.spans
    elements, within = spans_of(relative_power, length, starts, counts)
    held = elements * within.astype(np.float32)
    units = 1 / np.concatenate([counts.astype(np.float32), pool.expected_peak])
    rows = relative_power.graph.concat(held.sum(keep=False), held.max(keep=False)) * units
    return _place(rows.reshape(-1, 2, len(starts)), pool)


def pooled_mean(relative_power: Value, pool: Pooling) -> Value:
    """As `Pooling.mean_db`, but levels far below the strongest are not exact."""
    starts, counts = pool.spans
    upto = relative_power.cumsum().pad(1, 0)
    total = upto.take(starts + counts) - upto.take(starts)
    return _place((total / counts.astype(np.float64)).to(np.float32), pool)


def _place(relative_power: Value, pool: Pooling | CadencePlan) -> Value:
    return to_db(relative_power).pad(pool.seen.start, pool.bins - pool.seen.stop, UNSEEN_DB)
