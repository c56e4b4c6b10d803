"""How the spectrum changes within the dwell: short spectra of its parts, in units of the whole dwell's floor."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .axis import pooling
from .spectrum import Spectrum, centred_power, scaled

#: Parts of a dwell, half overlapping, each a quarter of it long.
PARTS = 7


@dataclass(frozen=True)
class Parts:
    """Short spectra of the parts of each dwell.

    Parameters
    ----------
    relative_power : ndarray of float32, shape (..., PARTS, bins)
        Power over the dwell's noise floor, centred.
    axis_db : ndarray of float32, shape (..., PARTS, axis bins)
        Mean level on the shared velocity axis, not below the floor [dB].
    """

    relative_power: NDArray[np.float32]
    axis_db: NDArray[np.float32]


def part_length(pulses: int) -> int:
    """Samples of a part: a quarter of the dwell, at least 8 (or all there are)."""
    return min(pulses, max(8, pulses // 4))


def frames(iq: NDArray[np.complex64], length: int, count: int) -> NDArray[np.complex64]:
    """Evenly spaced frames of a record as a view, shape (..., count, length); the last ends within the record.

    Parameters
    ----------
    iq : ndarray, shape (..., pulses)
        Samples.
    length : int
        Samples a frame, at most `pulses`.
    count : int
        Frames, at least 2. Where the record is too short for a hop of one sample, the last frame repeats.
    """
    starts, hop = _frame_starts(iq.shape[-1], length, count)
    if hop:
        shape, strides = (*iq.shape[:-1], count, length), (*iq.strides[:-1], hop * iq.strides[-1], iq.strides[-1])
        return np.lib.stride_tricks.as_strided(iq, shape, strides, writeable=False)
    return np.lib.stride_tricks.sliding_window_view(iq, length, axis=-1)[..., starts, :]


@lru_cache(maxsize=64)
def _frame_starts(pulses: int, length: int, count: int) -> tuple[NDArray[np.intp], int]:
    """First sample of each frame, and the hop between them if it is the same for all, else 0."""
    starts = np.rint(np.linspace(0, pulses - length, count)).astype(np.intp)
    hops = set(np.diff(starts).tolist())
    return starts, hops.pop() if len(hops) == 1 else 0


def frame_power(iq: NDArray[np.complex64], spectrum: Spectrum, length: int, count: int) -> NDArray[np.float32]:
    """Power spectra of frames in units of the dwell's noise floor, shape (..., count, bins)."""
    parts = frames(scaled(iq, spectrum.scale), length, count)
    floor = (spectrum.floor * spectrum.scale[..., 0].astype(np.float64) ** 2).astype(np.float32)
    power = centred_power(parts)
    return np.divide(power, np.where(floor > 0, floor, np.float32(1))[..., None, None], out=power)


def parts_of(iq: NDArray[np.complex64], spectrum: Spectrum, axis_bins: int) -> Parts:
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
    Parts
    """
    power = frame_power(iq, spectrum, part_length(spectrum.pulses), PARTS)
    pool = pooling(power.shape[-1], spectrum.carrier_hz, spectrum.prf_hz, axis_bins)
    return Parts(power, np.maximum(pool.mean_db(power), 0))


def change_db(parts: Parts) -> NDArray[np.float32]:
    """Standard deviation of the level over the parts, on the shared axis [dB], shape (..., axis bins)."""
    count = np.float32(PARTS)
    mean = np.add.reduce(parts.axis_db, axis=-2) / count
    away = (
        parts.axis_db - mean[..., None, :]
    )  # not the difference of squares: that is mostly rounding where it is small
    away *= away
    return np.sqrt(np.add.reduce(away, axis=-2) / count)


def centroid_mps(parts: Parts, axis_mps: NDArray[np.float64]) -> NDArray[np.float32]:
    """Centroid of the level over the velocity in each part [m/s], shape (..., PARTS); 0 where nothing is seen."""
    weight = np.maximum(parts.axis_db - np.float32(6), np.float32(0))
    total = np.add.reduce(weight, axis=-1)
    sums = weight @ axis_mps.astype(np.float32)
    return np.where(total > 0, sums / np.where(total > 0, total, 1), np.float32(0))


def busy_db(parts: Parts) -> NDArray[np.float32]:
    """Mean level over the axis in each part [dB], shape (..., PARTS): flashes and wing strokes lift single parts."""
    return parts.axis_db.mean(axis=-1)
