"""Checks of samples and radars before anything is computed from them, and a scale that is safe for float32."""

import math
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .fast import ones

#: Ranges of a radar's frequencies [Hz]: a value outside was given in another unit.
CARRIER_RANGE_HZ, PRF_RANGE_HZ = (1e8, 1e12), (1.0, 1e8)

#: Advice about missing samples.
FILL_IN = "interpolate them from their neighbours (zeros in their place, or a cut, would draw lines beside every line)"

#: Error text for samples that are not finite.
NOT_FINITE = f"iq holds values that are not finite: {FILL_IN}"

#: Error text for samples that are finite as given, but not in complex64.
TOO_LARGE = "iq holds values that are too large for complex64: lower the gain"

#: Error text for a record that is not 0 as given, but is in complex64.
TOO_SMALL = "iq holds a record that complex64 holds as 0: raise the gain"

#: A record whose largest part is below this has lost its digits among float32's denormal numbers: 9 bits are left here.
LEAST_PART = 2.0**-140

# Range of a record's energy in which float32 holds the powers of its lines, at most that strong, and its floor.
_SAFE_ENERGY = np.array(1e-14, np.float32), np.array(1e30, np.float32)

# An array without axes, because NumPy would convert a plain number at every call.
_ONE = np.array(1, np.float32)


def as_complex(iq: ArrayLike, least: int = 1) -> NDArray[np.complex64]:
    """Samples as complex64.

    Real samples are refused, because they have a spectrum of two equal sides; masked ones, because their mask would be
    dropped.

    Raises
    ------
    ValueError
        If they are not complex, some are masked, rows differ in length, or the last axis holds fewer than `least`
        pulses.
    """
    if np.ma.is_masked(iq):
        raise ValueError(f"iq holds masked samples: {FILL_IN}")
    try:
        samples = np.asarray(iq)
    except ValueError:
        raise ValueError("iq holds rows of unequal length: every record must have as many pulses") from None
    if samples.dtype.kind != "c":
        raise ValueError(f"iq holds {samples.dtype}: its samples must be complex, I + jQ")
    if samples.ndim < 1 or samples.shape[-1] < least:
        pulses = f"{least} pulse{'s' * (least > 1)}"
        raise ValueError(f"iq has shape {samples.shape}: its last axis must hold at least {pulses}")
    if samples.dtype == np.complex64:
        return samples
    with np.errstate(over="ignore"):  # a sample that overflows is refused later, as not finite
        return samples.astype(np.complex64)


def finite_complex(iq: ArrayLike, least: int = 1) -> NDArray[np.complex64]:
    """Samples as complex64, all of them finite.

    Raises
    ------
    ValueError
        If they are not complex or not finite, some are masked, a record is 0 in complex64 but not as given, or the
        last axis holds fewer than `least` pulses.
    """
    samples = as_complex(iq, least)
    if not np.isfinite(samples).all():
        raise ValueError(NOT_FINITE if not np.isfinite(iq).all() else TOO_LARGE)
    if samples is not iq and np.asarray(iq)[~samples.any(axis=-1)].any():
        raise ValueError(TOO_SMALL)
    return samples


def require_radar(carrier_hz: float, prf_hz: float) -> tuple[float, float]:
    """Check both frequencies, and return them in float64, as phases need them [Hz].

    Raises
    ------
    ValueError
        If one is no finite number above 0.
    """
    for name, value in (("carrier_hz", carrier_hz), ("prf_hz", prf_hz)):
        is_one = isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
        if not (is_one and math.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value!r}: it must be a finite number above 0 [Hz]")
    return float(carrier_hz), float(prf_hz)


def beyond_radars(carrier_hz: float, prf_hz: float) -> str:
    """Which of the two is out of a radar's range, and that range; empty where neither is."""
    for name, value, (low, high) in (("carrier", carrier_hz, CARRIER_RANGE_HZ), ("PRF", prf_hz, PRF_RANGE_HZ)):
        if not low <= value <= high:
            return f"the {name} is {value:g} Hz: it must be {low:g} to {high:g} Hz"
    return ""


def largest_part(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Largest real or imaginary part of each record, by magnitude, shape (...)."""
    parts = np.ascontiguousarray(iq).view(np.float32)
    # two passes that write nothing take half the time of one over magnitudes
    return np.maximum(np.maximum.reduce(parts, axis=-1), -np.minimum.reduce(parts, axis=-1))


def unit_scale(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Power of two that brings each record's largest part into [0.5, 1), shape (..., 1); 1 for an all-zero record.

    A power of two changes no digit, so results do not depend on the gain; the square of the scaled samples can neither
    overflow nor vanish.

    Raises
    ------
    ValueError
        If a sample is not finite.
    """
    largest = largest_part(iq)
    if not np.isfinite(largest).all():
        raise ValueError(NOT_FINITE)
    _, exponent = np.frexp(largest[..., None])
    return np.ldexp(np.float32(1), -np.minimum(np.maximum(exponent, -126), 126))


def energies(iq: NDArray[np.complex64]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Energy of each record, shape (...), and whether float32 holds the squares that it sums."""
    parts = np.ascontiguousarray(iq).view(np.float32)
    with np.errstate(over="ignore", under="ignore"):
        energy = np.vecdot(parts, parts)
    least, most = _SAFE_ENERGY
    return energy, np.asarray((energy > least) & (energy < most), np.bool_)


def safe_scale(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """`unit_scale` of the records that need it, 1 of the others: scaling changes no digit, and takes another pass."""
    _, safe = energies(iq)
    if np.count_nonzero(safe) == safe.size:
        return ones(safe.size).reshape(*safe.shape, 1)
    return np.where(safe[..., None], np.float32(1), unit_scale(iq))


def scaled(iq: NDArray[np.complex64], scale: NDArray[np.float32]) -> NDArray[np.complex64]:
    """Samples times a real factor a record: part by part, for half the price of a complex product."""
    if np.count_nonzero(scale == _ONE) == scale.size:
        return np.ascontiguousarray(iq)
    return (np.ascontiguousarray(iq).view(np.float32) * scale).view(np.complex64)
