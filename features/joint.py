"""The joint time-frequency inputs: an STFT image on the shared velocity axis, and numbers read off it."""

import numpy as np
from numpy.typing import NDArray

from .axis import axis_velocities_mps, pooling
from .change import frame_power
from .schema import IMAGE_BINS, IMAGE_FRAMES, JOINT_FEATURES
from .shape import SPEED_BANDS_MPS, entropy
from .spectrum import Spectrum
from .vector import lay_out, radar_columns

#: A frame is the dwell divided by this; the IMAGE_FRAMES frames of an image then overlap by about 77 %.
FRAME_SHARE = 8

#: A frame's band is where its level exceeds this [dB over the floor].
FRAME_BAND_DB = 6.0

#: Flashes are sought in bins faster than this [m/s]: bodies and limbs are slower.
FLASH_MPS = 8.0


def frame_length(pulses: int) -> int:
    """Samples of a frame of an image: an eighth of the dwell, at least 16 (or all there are)."""
    return min(pulses, max(16, pulses // FRAME_SHARE))


def stft_image(iq: NDArray[np.complex64], spectrum: Spectrum) -> NDArray[np.float32]:
    """STFT of each dwell on the shared velocity axis.

    Parameters
    ----------
    iq : ndarray of complex64, shape (..., pulses)
        The samples that `spectrum` was made from.
    spectrum : Spectrum
        Their spectra; its noise floor scales the image.

    Returns
    -------
    ndarray of float32, shape (..., IMAGE_BINS, IMAGE_FRAMES)
        Level over the floor [dB].
    """
    power = frame_power(iq, spectrum, frame_length(spectrum.pulses), IMAGE_FRAMES)
    pool = pooling(power.shape[-1], spectrum.carrier_hz, spectrum.prf_hz, IMAGE_BINS)
    return np.ascontiguousarray(np.swapaxes(pool.mean_db(power), -1, -2))


def joint_vector(image: NDArray[np.float32], spectrum: Spectrum) -> NDArray[np.float32]:
    """Every number of the schema's `JOINT_FEATURES`, in its order.

    Parameters
    ----------
    image : ndarray of float32, shape (..., IMAGE_BINS, IMAGE_FRAMES)
        From `stft_image`.
    spectrum : Spectrum
        The dwells' spectra, for the features of the radar and the leading shape.

    Returns
    -------
    ndarray of float32, shape (..., len(JOINT_FEATURES))
    """
    axis_mps = axis_velocities_mps(image.shape[-2]).astype(np.float32)
    level = np.maximum(image, 0)
    over = image > FRAME_BAND_DB
    fastest = np.where(over, axis_mps[:, None], -np.inf).max(axis=-2)
    slowest = np.where(over, axis_mps[:, None], np.inf).min(axis=-2)
    width = np.where(over.any(axis=-2), fastest - slowest, np.float32(0))
    weight = level.sum(axis=-2)
    centroid = (level * axis_mps[:, None]).sum(axis=-2) / np.where(weight > 0, weight, 1)

    power = 10 ** (level / 10) - 1
    fast = power[..., np.abs(axis_mps) > FLASH_MPS, :].sum(axis=-2)
    flash_hz, flash_strength, kurtosis = _flashes(fast, spectrum)

    columns: dict[str, NDArray | float] = {
        **radar_columns(spectrum.carrier_hz, spectrum.prf_hz, spectrum.pulses),
        "joint_bandwidth_mps": width.mean(axis=-1),
        "joint_bandwidth_swing_mps": width.std(axis=-1),
        "joint_centroid_swing_mps": centroid.std(axis=-1),
        "joint_entropy": entropy(level.reshape(*level.shape[:-2], level.shape[-2] * level.shape[-1])),
        "flash_log": np.log10(np.maximum(flash_hz, 1)),
        "flash_strength": flash_strength,
        "frame_swing_db": level.mean(axis=-2).std(axis=-1),
        "frame_kurtosis": kurtosis,
    }
    edges = np.searchsorted(axis_mps, SPEED_BANDS_MPS)
    folded = np.maximum(image, image[..., ::-1, :])
    for a, b, low, high in zip(edges[:-1], edges[1:], SPEED_BANDS_MPS[:-1], SPEED_BANDS_MPS[1:], strict=True):
        band = folded[..., a : max(b, a + 1), :].mean(axis=-2)
        columns[f"joint_mean_{low:g}_{high:g}_db"] = band.mean(axis=-1)
        columns[f"joint_swing_{low:g}_{high:g}_db"] = band.std(axis=-1)
        columns[f"joint_peak_{low:g}_{high:g}_db"] = band.max(axis=-1)
    return lay_out(columns, JOINT_FEATURES, spectrum.transform_floor.shape)


def _flashes(fast: NDArray[np.float32], spectrum: Spectrum) -> tuple[NDArray, NDArray, NDArray]:
    """Rate and strength of the strongest cadence of the fast bins' power, and the power's peakedness."""
    # relative to the mean: a strong target's power to the fourth would overflow float32, and no result depends on scale
    mean = fast.mean(axis=-1, keepdims=True)
    swing = fast / np.where(mean > 0, mean, 1) - (mean > 0)
    frames = fast.shape[-1]
    cadence = np.abs(np.fft.rfft(swing * np.hanning(frames + 2)[1:-1].astype(np.float32), axis=-1))[..., 2:]
    rms = np.sqrt(np.mean(cadence**2, axis=-1))
    top = cadence.argmax(axis=-1)
    hop_s = (spectrum.pulses - frame_length(spectrum.pulses)) / (frames - 1) / spectrum.prf_hz
    some = (rms > 0) & (hop_s > 0)
    rate = np.where(some, (top + 2) / (frames * max(hop_s, 1e-9)), 0)
    strength = np.where(some, cadence.max(axis=-1) / np.where(rms > 0, rms, 1), 0)
    variance = np.mean(swing**2, axis=-1)
    kurtosis = np.where(variance > 0, np.mean(swing**4, axis=-1) / np.where(variance > 0, variance, 1) ** 2, 0)
    return rate, strength, kurtosis
