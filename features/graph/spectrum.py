"""The Doppler spectrum, its noise floor and the shared axis in graph operators (definitions: `spectrum`, `axis`)."""

import numpy as np
from numpy.typing import NDArray

from .. import spectrum as definition
from ..axis import UNSEEN_DB, Pooling
from ..cadence import CadencePlan
from .operators import Value


def dft(packed: Value, length: int, count: int, *, real: bool = False) -> tuple[Value, Value]:
    """Discrete Fourier transform as two matrix products with twiddle factors between (Cooley and Tukey 1965).

    Lengths that transform fast have factors near their root, so this costs 8 length^1.5 multiplications and runs on
    any runtime's matrix product; the standard's own operator is slower and, off powers of two, less exact.

    Parameters
    ----------
    packed : Value
        Shape (n, 2, length): real and imaginary parts; (n, length) where `real`.
    length : int
        Of the transform.
    count : int
        How many coefficients are wanted, from 0 on.
    real : bool
        Whether the samples are real.

    Returns
    -------
    real, imaginary : Value
        Shape (n, count).
    """
    graph = packed.graph
    rows = next(n for n in range(int(np.sqrt(length)), 0, -1) if length % n == 0)
    columns = length // rows
    wanted = -(-count // rows)

    def turns(left: NDArray, right: NDArray, period: int) -> tuple[NDArray, NDArray]:
        phase = np.exp(-2j * np.pi * (np.outer(left, right) % period) / period)
        return phase.real.astype(np.float32), phase.imag.astype(np.float32)

    across = np.arange(rows)
    cosine, sine = turns(across, across, rows)
    first = np.block([[cosine], [sine]]) if real else np.block([[cosine, -sine], [sine, cosine]])
    half = graph.matmul(first, packed.reshape(-1, first.shape[1], columns))
    re, im = half.slice(0, rows, axis=-2), half.slice(rows, 2 * rows, axis=-2)
    cosine, sine = turns(across, np.arange(columns), length)
    turned = graph.concat(re * cosine - im * sine, re * sine + im * cosine)
    cosine, sine = turns(np.arange(columns), np.arange(wanted), columns)
    full = graph.matmul(turned, np.block([[cosine, sine], [-sine, cosine]]))

    def laid_out(part: Value) -> Value:
        line = part.transpose(0, 2, 1).reshape(-1, rows * wanted)
        return line if rows * wanted == count else line.slice(0, count)

    return laid_out(full.slice(0, wanted)), laid_out(full.slice(wanted, 2 * wanted))


def centred_transform(packed: Value, pulses: int, bins: int) -> tuple[Value, Value]:
    """As `spectrum.centred_transform`: from samples (n, 2, pulses) to two parts (n, bins)."""
    even = bins % 2 == 0
    parts = dft((packed * definition._window(pulses, even)[::2]).pad(0, bins - pulses), bins, bins)
    half = (bins + 1) // 2
    if even:
        return parts
    re, im = (packed.graph.concat(part.slice(half, bins), part.slice(0, half)) for part in parts)
    return re, im


def power_of(parts: tuple[Value, Value]) -> Value:
    """As `spectrum.power_of`."""
    re, im = parts
    return re * re + im * im


def centred_power(packed: Value, pulses: int, bins: int) -> Value:
    """As `spectrum.centred_power`: from samples (n, 2, pulses) to power (n, bins)."""
    return power_of(centred_transform(packed, pulses, bins))


def unit_scale(largest: Value) -> Value:
    """As `spectrum.unit_scale`: a power of two that brings each record's largest part into about [0.5, 1)."""
    exponent = (largest.to(np.float64).at_least(2.0**-126).apply("Log") / np.log(2)).apply("Floor") + 1.0
    two = largest.graph.constant(np.float64(2))
    return largest.graph.op("Pow", two, -exponent.at_most(126.0).at_least(-126.0)).to(np.float32)


def noise_floor(power: Value, bins: int) -> Value:
    """As `spectrum.noise_floor`, shape (n, 1)."""
    half, lower = bins // 2, (bins + 1) % 2
    size = max(1, half // definition._FLOOR_BLOCKS)
    blocks = half // size
    rank = definition.quartile_rank(blocks)
    sides = [
        side.reshape(-1, blocks, size).sum(keep=False)
        for side in (power.slice(lower, lower + blocks * size), power.slice(bins - blocks * size, bins))
    ]
    one, other = (side.ranked(rank) for side in sides)
    least, most = one.at_most(other), one.at_least(other)
    level = power.graph.where(most > definition._EMPTY_RATIO * least, most, (least + most) / 2)
    return level / float(definition.quartile_of_noise(bins, size, blocks))


def to_db(relative_power: Value) -> Value:
    """As `spectrum.to_db`."""
    return relative_power.at_least(10 ** (definition.LOWEST_DB / 10)).apply("Log") * (10 / np.log(10))


def pooled(relative_power: Value, pool: Pooling | CadencePlan) -> tuple[Value, Value]:
    """As `Pooling.mean_and_peak_db`, shape (n, axis bins) each."""
    starts, counts = pool.spans
    place = np.arange(counts.max())
    gathered = relative_power.take(starts[:, None] + np.minimum(place, counts[:, None] - 1))
    share = ((place < counts[:, None]) / counts[:, None]).astype(np.float32)
    mean = (gathered * share).sum(keep=False)
    return _place(mean, pool), _place(gathered.max(keep=False) / pool.expected_peak, pool)


def pooled_mean(relative_power: Value, pool: Pooling) -> Value:
    """As `Pooling.mean_db` where levels far under the strongest need not be exact."""
    starts, counts = pool.spans
    upto = relative_power.cumsum().pad(1, 0)
    total = upto.take(starts + counts) - upto.take(starts)
    return _place((total / counts.astype(np.float64)).to(np.float32), pool)


def _place(relative_power: Value, pool: Pooling | CadencePlan) -> Value:
    return to_db(relative_power).pad(pool.seen.start, pool.bins - pool.seen.stop, UNSEEN_DB)
