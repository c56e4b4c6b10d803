"""The pictures of a dwell that the front compares, all on one velocity axis and of one small size.

A picture is what a small network reads: levels in decibels, channels first. Whatever the transform behind it costs and
however large it is, the picture ends on the axis that all radars share, so that networks of one architecture can be
compared. To put another representation on the front, add a line to `PICTURES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from bladewing.features import doppler_spectrum
from bladewing.features import stft as joint
from bladewing.features.axis import pooling
from bladewing.features.schema import AXIS_BINS, IMAGE_BINS, IMAGE_FRAMES
from bladewing.features.vector import radar_columns
from bladewing.features.window import HANN
from bladewing.simulate import Radar
from numpy.typing import NDArray

from .fft_against_stft import STFT_BINS, frames, transformed

#: The four STFTs of the paper that are pictured and weighed: window [samples], overlap.
STFT_SETTINGS = ((80, 0.9), (200, 0.9), (20, 0.9), (80, 0.5))

#: Window of the cadence-velocity diagram [s], the paper's middle one.
CADENCE_WINDOW_S = 4e-3

#: Samples processed at a time: an STFT with a short window is hundreds of times larger than the record.
_BLOCK_SAMPLES = 1 << 16

#: Approximate number of STFT frames that are transformed at a time, so that they stay in the cache.
_CACHED_FRAMES = 256

Maker = Callable[[NDArray[np.complex64], Radar], NDArray[np.float32]]


@dataclass(frozen=True)
class Picture:
    """One way to show a dwell to a network.

    Attributes
    ----------
    words : str
        Its usual name.
    shape : tuple of int
        Shape of one record: (channels, bins of velocity or period), or (channels, such bins, frames).
    make : callable
        From samples (n, pulses) and their radar to float32 (n, *shape) [dB].
    has_velocity : bool
        Whether the axis behind the channels is one of velocity, symmetric about zero.
    """

    words: str
    shape: tuple[int, ...]
    make: Maker
    has_velocity: bool = True


def spectrum_picture(iq: NDArray[np.complex64], radar: Radar, *, bins: int = AXIS_BINS) -> NDArray[np.float32]:
    """Make a picture of one FFT over the whole dwell: mean and peak level of each velocity bin.

    Parameters
    ----------
    iq : (n, pulses) complex64
    radar : Radar
        Radar of the records.
    bins : int
        Number of velocity bins.

    Returns
    -------
    (n, 2, bins) float32
        Levels over the noise floor [dB].
    """
    spectrum = doppler_spectrum(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, window=HANN)
    pool = pooling(spectrum.bins, radar.carrier_hz, radar.prf_hz, bins)
    return pool.mean_and_peak_db(spectrum.relative_power)


def stft_picture(iq: NDArray[np.complex64], radar: Radar, *, window: int, overlap: float) -> NDArray[np.float32]:
    """Make one of the paper's STFTs, pooled to velocity bins and frames.

    Parameters
    ----------
    iq : (n, pulses) complex64
    radar : Radar
        Radar of the records.
    window : int
        Window [samples]; a dwell shorter than this is one window.
    overlap : float
        Share of a window that the next one covers.

    Returns
    -------
    (n, 1, velocity bins, frames) float32
        Levels over the median of the record's STFT power [dB].
    """
    pool = pooling(STFT_BINS, radar.carrier_hz, radar.prf_hz, IMAGE_BINS)
    out = np.empty((len(iq), 1, IMAGE_BINS, IMAGE_FRAMES), np.float32)
    for row, record in enumerate(iq):
        power = np.fft.fftshift(_pooled_power(frames(record, window=min(window, radar.pulses), overlap=overlap)), -1)
        level = np.median(power)
        out[row, 0] = pool.mean_db(power / (level if level > 0 else np.float32(1))).T
    return out


def _pooled_power(some: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Average the power spectra of neighbouring frames to `IMAGE_FRAMES` in all; too few frames are repeated."""
    count = len(some)
    starts = np.arange(IMAGE_FRAMES) * count // IMAGE_FRAMES
    if count < IMAGE_FRAMES:
        return _squares(transformed(some))[starts]
    ends = np.append(starts[1:], count)
    pooled = np.empty((IMAGE_FRAMES, STFT_BINS), np.float32)
    # A few pools at a time: the whole STFT of a short window fits no cache.
    step = max(1, IMAGE_FRAMES * _CACHED_FRAMES // count)
    for first in range(0, IMAGE_FRAMES, step):
        part = slice(first, first + step)
        begin, end = starts[part][0], ends[part][-1]
        pooled[part] = np.add.reduceat(_squares(transformed(some[begin:end])), starts[part] - begin, axis=0)
    pooled /= (ends - starts)[:, None].astype(np.float32)
    return pooled


def cadence_picture(iq: NDArray[np.complex64], radar: Radar) -> NDArray[np.float32]:
    """Make a cadence-velocity diagram: how fast each velocity's level varies, (n, 1, velocity bins, cadences) [dB]."""
    swings, _ = joint.cadence_velocity(_frames_of(iq, radar, CADENCE_WINDOW_S))
    few = _grouped(swings**2)
    level = np.median(few, axis=(1, 2), keepdims=True)
    few /= np.where(level > 0, level, np.float32(1))
    pool = pooling(few.shape[-1], radar.carrier_hz, radar.prf_hz, IMAGE_BINS)
    return np.swapaxes(pool.mean_db(few), -1, -2)[:, None]


def cepstral_picture(iq: NDArray[np.complex64], radar: Radar) -> NDArray[np.float32]:
    """Make a cepstrogram: comb periods, evenly spaced in their logarithm, (n, 1, periods, frames) [dB]."""
    heights, _ = joint.cepstrogram(_frames_of(iq, radar, joint.HERM_WINDOW_S))
    few = _grouped(heights)
    edges = np.geomspace(1, few.shape[-1], IMAGE_BINS + 1)[:-1].astype(int)
    # A comb's peak is narrow, so a group of periods is represented by its highest value.
    return np.swapaxes(np.maximum.reduceat(few, edges, axis=-1), -1, -2)[:, None]


def herm_picture(iq: NDArray[np.complex64], radar: Radar) -> NDArray[np.float32]:
    """Make HERM lines: what persists in each velocity bin from long frame to long frame, (n, 1, velocity bins) [dB]."""
    lines = 10 ** (joint.herm_lines_db(_frames_of(iq, radar, joint.HERM_WINDOW_S)) / 10)
    pool = pooling(lines.shape[-1], radar.carrier_hz, radar.prf_hz, AXIS_BINS)
    return pool.mean_db(lines.astype(np.float32, copy=False))[:, None]


def _frames_of(iq: NDArray[np.complex64], radar: Radar, window_s: float) -> joint.Stft:
    """Compute short-time spectra; a dwell shorter than the window is one frame."""
    window_s = min(window_s, radar.dwell_s)
    return joint.stft(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, window_s=window_s, overlap=0.9)


def _grouped(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average neighbouring rows (axis 1) to `IMAGE_FRAMES` in all; too few rows are repeated."""
    count = rows.shape[1]
    starts = np.arange(IMAGE_FRAMES) * count // IMAGE_FRAMES
    if count < IMAGE_FRAMES:
        return rows[:, starts]
    sizes = np.diff(starts, append=count).astype(np.float32)
    means: NDArray[np.float32] = np.add.reduceat(rows, starts, axis=1) / sizes[:, None]
    return means


def _squares(lines: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Compute the power of each line; the input is overwritten."""
    parts = lines.view(np.float32)
    np.multiply(parts, parts, out=parts)
    squares: NDArray[np.float32] = parts[..., ::2] + parts[..., 1::2]
    return squares


def radar_numbers(radar: Radar, count: int) -> NDArray[np.float32]:
    """Give four numbers that describe the radar, repeated for each of `count` records, shape (count, 4)."""
    columns = radar_columns(radar.carrier_hz, radar.prf_hz, radar.pulses)
    return np.tile(np.array(list(columns.values()), np.float32), (count, 1))


def in_blocks(make: Maker, iq: NDArray[np.complex64], radar: Radar) -> NDArray[np.float32]:
    """Make pictures of many records, a few at a time, so that scratch memory stays small."""
    step = max(1, _BLOCK_SAMPLES // radar.pulses)
    return np.concatenate([make(iq[at : at + step], radar) for at in range(0, len(iq), step)])


def quantised(picture: NDArray[np.floating], bits: int) -> NDArray[np.floating]:
    """Round levels to what storing them in a number of bits leaves.

    Parameters
    ----------
    picture : ndarray of float32
        Levels [dB].
    bits : int
        32: float32, unchanged; 16: float16; fewer: equal steps from -20 to 80 dB, levels outside clipped to the ends.

    Returns
    -------
    ndarray of float32, same shape
    """
    if bits == 32:
        return picture
    if bits == 16:
        return picture.astype(np.float16).astype(np.float32)
    low, high = np.float32(-20.0), np.float32(80.0)
    step = (high - low) / np.float32(2**bits - 1)
    return np.rint((np.clip(picture, low, high) - low) / step) * step + low


def _stft_line(window: int, overlap: float) -> tuple[str, Picture]:
    words = f"STFT, window {window}, overlap {overlap:.0%}".replace("%", "\N{NO-BREAK SPACE}%")
    make = partial(stft_picture, window=window, overlap=overlap)
    return f"stft-{window}-{100 * overlap:.0f}", Picture(words, (1, IMAGE_BINS, IMAGE_FRAMES), make)


#: Name to picture, the cheapest transform first.
PICTURES: dict[str, Picture] = {
    "spectrum": Picture("Doppler spectrum", (2, AXIS_BINS), spectrum_picture),
    "herm": Picture("HERM lines", (1, AXIS_BINS), herm_picture),
    **dict(_stft_line(*setting) for setting in STFT_SETTINGS),
    "cadence": Picture("cadence-velocity diagram", (1, IMAGE_BINS, IMAGE_FRAMES), cadence_picture),
    "cepstrogram": Picture("cepstrogram", (1, IMAGE_BINS, IMAGE_FRAMES), cepstral_picture, has_velocity=False),
}
