"""Measurements of a dwell with their standard deviations: body, chopping, single rotors, band, blade."""

import math
from collections.abc import Callable
from dataclasses import fields
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .allocator import keep_freed
from .clicks import clicks_filled
from .dropouts import BEYOND_FILLING_IN, NOTHING, mended
from .measure_record import measure_record, unmeasured
from .measurements import EACH_ROTOR, Measurements
from .one_channel import made_analytic
from .one_thread import one_thread
from .rotor.rotors import MAX_ROTORS
from .samples import beyond_radars, finite_complex, largest_part, require_radar
from .spectrum import doppler_spectrum

#: No rotor has more blades; eight is the most that fly.
MOST_BLADES_GIVEN = 64

#: A beta_rad of this or more was probably meant in degrees; between pi/2 and this it is just out of range [rad].
LEAST_DEGREES = 2.0


def measure(
    iq: ArrayLike,
    *,
    carrier_hz: float,
    prf_hz: float,
    blades: int | None = None,
    beta_rad: float | None = None,
    on_record: Callable[[int], None] | None = None,
) -> Measurements:
    """Measure the rotor in each record, or say why there is none.

    Parameters
    ----------
    iq : array_like of complex, shape (..., pulses)
        Slow-time samples of one range cell, any gain. A single noisy channel, I without Q, gives what both sides of the
        spectrum share, and no band. Lost pulses, which are exactly 0, are predicted from those beside them; a record
        with a gap too long for that is measured over its longest unbroken stretch.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], within `CARRIER_RANGE_HZ` and `PRF_RANGE_HZ`.
    blades : int, optional
        Blades of a rotor, 1 to `MOST_BLADES_GIVEN`.
    beta_rad : float, optional
        Angle between the line of sight and the rotor plane [rad], 0 <= beta < pi/2.
    on_record : callable, optional
        Called after each record with the number of those done. A record of 3000 pulses takes some hundredths of a
        second, up to two seconds where several rotors change or are unresolved; at 77 GHz half a second to five, up to
        ten with eight rotors. One of 65 536 pulses takes a quarter of a minute.

    Returns
    -------
    Measurements
        Standard deviations hold for the model: rates that are steady within the dwell or change smoothly, white noise
        about each line. A body that accelerates smears all lines; `bladewing measure` takes that out first
        (`body_acceleration`, `without_acceleration`).

    Raises
    ------
    ValueError
        If `iq` is not complex, has fewer than 2 pulses or holds a value that is not finite, or an argument is out of
        its range.
    """
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    if beyond := beyond_radars(carrier_hz, prf_hz):
        raise ValueError(f"{beyond}: give 9.85 GHz as 9.85e9, 20 kHz as 20e3")
    if blades is not None and not (_is_number(blades) and 1 <= blades == int(blades) <= MOST_BLADES_GIVEN):
        raise ValueError(f"blades is {blades!r}: it must be a whole number of 1 to {MOST_BLADES_GIVEN}")
    if beta_rad is not None and not (_is_number(beta_rad) and 0 <= beta_rad < np.pi / 2):
        in_degrees = _is_number(beta_rad) and LEAST_DEGREES <= beta_rad < 90
        cure = f": {beta_rad:g} degrees are np.radians({beta_rad:g})" if in_degrees else ""
        raise ValueError(f"beta_rad is {beta_rad!r}: it must be at least 0 and below pi/2 [rad]{cure}")
    blades = None if blades is None else int(blades)
    given, stretches = mended(finite_complex(iq, least=2))
    samples = _cleaned(given)
    shape = samples.shape[:-1]
    some = samples if samples.size else np.zeros((1, *samples.shape[-1:]), np.complex64)  # an empty batch needs a dummy
    spectrum = doppler_spectrum(some, carrier_hz=carrier_hz, prf_hz=prf_hz)
    rows = []
    keep_freed()
    with one_thread:
        for index in np.ndindex(some.shape[:-1]):
            record, own = some[index], spectrum.rows(index)
            stretch = stretches.get(index)
            if stretch not in (None, NOTHING):
                record = _cleaned(given[index][stretch])
                own = doppler_spectrum(record, carrier_hz=carrier_hz, prf_hz=prf_hz)
            told = stretch != NOTHING
            rows.append(measure_record(record, own, blades, beta_rad) if told else unmeasured(BEYOND_FILLING_IN))
            if on_record and samples.size:
                on_record(len(rows))
    columns = {}
    for field in fields(Measurements):
        if field.name != "length_is_lower_bound":
            values = np.array([row[field.name] for row in rows])[: math.prod(shape)]
            extra = (MAX_ROTORS,) if field.name in EACH_ROTOR else ()
            columns[field.name] = values.reshape((*shape, *extra))
    return Measurements(**columns, length_is_lower_bound=beta_rad is None)


def _cleaned(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Records (..., pulses) without clicks, which lift the floor under all lines; one-channel ones made analytic."""
    flat = iq.reshape(-1, iq.shape[-1])
    return made_analytic(clicks_filled(flat, largest_part(flat)).reshape(iq.shape))


def _is_number(value: object) -> bool:
    """Whether a value is a finite number, and no bool."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
