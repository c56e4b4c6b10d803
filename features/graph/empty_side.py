"""An empty side of the spectrum filled with noise in graph operators (definitions: `empty_side`)."""

import numpy as np
from numpy.typing import NDArray

from .. import empty_side as definition
from ..spectrum import centred_transform
from ..window import Window
from .operators import Value
from .spectrum import noise_floor, noise_shows, side_floors


def filled_sides(
    packed: Value, transform: Value, power: Value, pulses: int, bins: int, window: Window
) -> tuple[Value, Value]:
    """As `empty_side.filled_sides`, for samples and for their transform, to which the transform of the noise is added.

    Parameters
    ----------
    packed : Value
        Samples, shape (n, 2, pulses).
    transform : Value
        Their transform, shape (n, 2, bins).
    power : Value
        Power of the transform, shape (n, bins).
    pulses, bins : int
        Pulses of a record, and bins of its transform.
    window : Window
        Window of the transform.

    Returns
    -------
    packed, transform : Value
        With noise on empty sides.
    """
    graph = packed.graph
    sides = side_floors(power, bins, window)
    floor = noise_floor(power, sides)
    other = graph.concat(sides.slice(1, 2), sides.slice(0, 1))
    empty = (sides < other * float(definition.EMPTY_SHARE)) & noise_shows(power, floor)
    amplitude = empty.to(np.float32) * floor.apply("Sqrt")
    noise = definition.side_noise(pulses)

    def with_noise(values: Value, lines: NDArray[np.complex64]) -> Value:
        own = np.concatenate([lines.real, lines.imag], axis=-1)
        return values + graph.matmul(amplitude, own).reshape(-1, 2, lines.shape[-1])

    return with_noise(packed, noise), with_noise(transform, centred_transform(noise, bins, window=window))
