"""From slow-time samples to the named inputs that models take: only what is asked for is computed."""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .axis import pooling
from .cadence import cadence_db
from .change import change_db, parts_db
from .joint import joint_vector, stft_image
from .notch import body_line, notch_mask
from .schema import AXIS_BINS, INPUT_SHAPES
from .spectrum import doppler_spectrum
from .vector import feature_vector

#: Fewest pulses that leave anything to measure outside the notches.
MIN_PULSES = 16

#: Samples worked on at a time: scratch memory stays small whatever the batch. The overlapping frames of an image hold
#: each sample several times, so fewer records of it fill a processor's cache.
BLOCK_SAMPLES = 1 << 17
IMAGE_SHARE = 2


def model_inputs(
    iq: ArrayLike, *, carrier_hz: float, prf_hz: float, names: Collection[str] = ("features", "spectrum")
) -> dict[str, NDArray[np.float32]]:
    """Compute named model inputs from slow-time samples.

    Parameters
    ----------
    iq : array_like of complex, shape (..., pulses)
        Slow-time samples of one range cell, any gain.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    names : collection of str
        Which of `INPUT_SHAPES`: "features", "levels" (one FFT of the dwell), "spectrum" (the same and one of its
        parts), "cadence" (an FFT back and half of one more), "joint_features", "image" (an STFT).

    Returns
    -------
    dict of str to ndarray of float32
        Each of shape (..., *INPUT_SHAPES[name]), finite.

    Raises
    ------
    ValueError
        If a name is unknown, there are fewer than `MIN_PULSES` pulses, or a frequency is not positive.
    """
    wanted = frozenset(names)
    unknown = wanted - INPUT_SHAPES.keys()
    if unknown:
        raise ValueError(f"model input {sorted(unknown)[0]!r} is unknown: it must be one of {', '.join(INPUT_SHAPES)}")
    samples = np.asarray(iq, np.complex64)
    if samples.ndim < 1 or samples.shape[-1] < MIN_PULSES:
        raise ValueError(f"iq has shape {samples.shape}: its last axis must hold at least {MIN_PULSES} pulses")
    framed = "image" in wanted or "joint_features" in wanted
    high = max(1, BLOCK_SAMPLES // (IMAGE_SHARE if framed else 1) // samples.shape[-1])
    flat = samples.reshape(-1, samples.shape[-1])
    if len(flat) <= high:
        made = _inputs(flat, carrier_hz, prf_hz, wanted)
    else:
        blocks = [_inputs(flat[i : i + high], carrier_hz, prf_hz, wanted) for i in range(0, len(flat), high)]
        made = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    return {name: rows.reshape(samples.shape[:-1] + INPUT_SHAPES[name]) for name, rows in made.items()}


def _inputs(
    samples: NDArray[np.complex64], carrier_hz: float, prf_hz: float, names: frozenset[str]
) -> dict[str, NDArray[np.float32]]:
    """The inputs of a batch that is worked on as a whole."""
    spectrum = doppler_spectrum(samples, carrier_hz=carrier_hz, prf_hz=prf_hz)
    out: dict[str, NDArray[np.float32]] = {}
    if names & {"features", "cadence"}:
        body = body_line(spectrum)
        mask = notch_mask(spectrum, body)
        if "cadence" in names:
            out["cadence"] = cadence_db(spectrum, mask)
    if names & {"levels", "spectrum", "features"}:
        pool = pooling(spectrum.bins, spectrum.carrier_hz, spectrum.prf_hz, AXIS_BINS)
        if names & {"levels", "spectrum"}:
            levels = pool.mean_and_peak_db(spectrum.relative_power)
            mean = levels[..., 0, :]
            if "levels" in names:
                out["levels"] = levels
        else:
            mean = pool.mean_db(spectrum.relative_power)
    if names & {"spectrum", "features"}:
        parts = parts_db(samples, spectrum, AXIS_BINS)
        change = change_db(parts)
        if "spectrum" in names:
            out["spectrum"] = np.concatenate([levels, change[..., None, :]], axis=-2)
        if "features" in names:
            out["features"] = feature_vector(spectrum, body, mask, np.ascontiguousarray(mean), parts, change)
    if names & {"image", "joint_features"}:
        image = stft_image(samples, spectrum)
        if "image" in names:
            out["image"] = image[..., None, :, :]
        if "joint_features" in names:
            out["joint_features"] = joint_vector(image, spectrum)
    return out
