"""How the spectrum changes within the dwell: short spectra of its parts, in units of the whole dwell's floor."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .axis import pooling
from .fast import at_least, sums, windows
from .samples import scaled
from .spectrum import Spectrum, centred_power, per_floor

#: Parts of a dwell, half overlapping, each a quarter of it long.
PARTS = 7

#: Levels above this count towards a part's centroid, by their excess over it [dB].
CENTROID_DB = 6.0

#: Products with these matrices give the mean of the parts, and each part less that mean, in half the time of sums.
_MEAN = np.full(PARTS, 1 / PARTS, np.float32)
_LESS_MEAN = (np.eye(PARTS) - 1 / PARTS).astype(np.float32)


def part_length(pulses: int) -> int:
    """Samples of a part: a quarter of the dwell, at least 8 (or all there are)."""
    return min(pulses, max(8, pulses // 4))


def frames(iq: NDArray[np.complex64], length: int, count: int) -> NDArray[np.complex64]:
    """Evenly spaced frames of a record, shape (..., count, length), the last of which ends with the record.

    They are a view where `frame_starts` gives a hop, else a copy.

    Parameters
    ----------
    iq : ndarray, shape (..., pulses)
        Samples.
    length : int
        Samples a frame, at most `pulses`.
    count : int
        Frames, at least 2. Where the record is too short for hops of one sample, frames repeat.
    """
    starts, hop = frame_starts(iq.shape[-1], length, count)
    if hop:
        return windows(iq, (count, length), (hop, 1))
    return np.lib.stride_tricks.sliding_window_view(iq, length, axis=-1)[..., starts, :]


@lru_cache(maxsize=64)
def frame_starts(pulses: int, length: int, count: int) -> tuple[NDArray[np.intp], int]:
    """First sample of each frame, and the hop between them if it is the same for all, else 0."""
    starts = np.rint(np.linspace(0, pulses - length, count)).astype(np.intp)
    hops = set(np.diff(starts).tolist())
    return starts, hops.pop() if len(hops) == 1 else 0


def frame_power(iq: NDArray[np.complex64], spectrum: Spectrum, length: int, count: int) -> NDArray[np.float32]:
    """Power spectra of frames in units of the dwell's noise floor, shape (..., count, bins)."""
    power, per_unit = _frame_power(iq, spectrum, length, count)
    return np.multiply(power, per_unit, out=power)


def _frame_power(
    iq: NDArray[np.complex64], spectrum: Spectrum, length: int, count: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Power spectra of frames, shape (..., count, bins), and factors to units of the floor, shape (..., 1, 1)."""
    per_unit = per_floor(spectrum.transform_floor)[..., None, None]
    return centred_power(frames(scaled(iq, spectrum.scale), length, count), window=spectrum.window), per_unit


def parts_db(iq: NDArray[np.complex64], spectrum: Spectrum, axis_bins: int) -> NDArray[np.float32]:
    """Split dwells into parts and take their spectra.

    Parameters
    ----------
    iq : ndarray of complex64, shape (..., pulses)
        The samples that `spectrum` was made from.
    spectrum : Spectrum
        Their spectra.
    axis_bins : int
        Bins of the shared axis.

    Returns
    -------
    ndarray of float32, shape (..., PARTS, axis_bins)
        Mean level on the shared velocity axis, not below the floor [dB].
    """
    power, per_unit = _frame_power(iq, spectrum, part_length(spectrum.pulses), PARTS)
    pool = pooling(power.shape[-1], spectrum.carrier_hz, spectrum.prf_hz, axis_bins)
    return pool.mean_db(power, per_unit, from_floor=True)


def change_db(parts: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation of the level over the parts, on the shared axis [dB], shape (..., axis bins)."""
    # not the difference of squares: that is mostly rounding where it is small
    away = np.matmul(_LESS_MEAN, parts)
    away *= away
    out = np.matmul(_MEAN, away)
    return np.sqrt(out, out=out)


def centroid_mps(parts: NDArray[np.float32], axis_mps: NDArray[np.float32]) -> NDArray[np.float32]:
    """Centroid of the level over the velocity in each part [m/s], shape (..., PARTS); 0 where nothing is seen."""
    weight = at_least(parts, CENTROID_DB)
    weight -= np.float32(CENTROID_DB)
    return np.vecdot(weight, axis_mps) / np.maximum(sums(weight), np.float32(1e-6))


def swing(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation over the parts, shape (...), of values of shape (..., PARTS)."""
    share = np.float32(1 / values.shape[-1])
    away = values - np.add.reduce(values, axis=-1, keepdims=True) * share
    return np.sqrt(np.vecdot(away, away) * share)
