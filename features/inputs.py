"""From slow-time samples to the named inputs that models take: only the inputs asked for are computed."""

from collections.abc import Collection, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .axis import Pooling, pooling
from .cadence import cadence_db
from .change import change_db, parts_db
from .comb_levels import comb_levels_db
from .empty_side import filled_sides
from .joint import joint_vector, stft_image
from .notch import Body, body_line, notch_mask, strongest_bin, weights
from .one_channel import made_analytic
from .samples import as_complex
from .schema import AXIS_BINS, INPUT_SHAPES
from .spectrum import doppler_spectrum
from .stop_band import filled_ends
from .vector import feature_vector
from .window import HANN

#: Fewest pulses that leave anything to measure outside the notches.
MIN_PULSES = 16

#: BLOCK_SAMPLES: samples worked on at a time, so that scratch memory stays small whatever the batch. IMAGE_SHARE: their
#: number is divided by this for images, whose overlapping frames hold each sample several times: fewer records then
#: fill a processor's cache.
BLOCK_SAMPLES = 1 << 17
IMAGE_SHARE = 2


def model_inputs(
    iq: ArrayLike, *, carrier_hz: float, prf_hz: float, names: Collection[str] = ("features", "spectrum")
) -> dict[str, NDArray[np.float32]]:
    """Compute named model inputs from slow-time samples.

    Parameters
    ----------
    iq : array_like of complex, shape (..., pulses)
        Slow-time samples of one range cell, any gain. A record of one channel (I without Q) that holds noise is made
        analytic. An empty side of the spectrum, as such a record then has, is filled with noise (`empty_side`). So are
        the outer ends of the spectrum where a filter took them out (`stop_band`).
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    names : collection of str
        Which of `INPUT_SHAPES`: "features", "levels" (one FFT of the dwell), "spectrum" (the same and one of the
        dwell's parts), "cadence" (an inverse FFT and half an FFT more), "combs" (a quarter of an FFT more),
        "joint_features", "image" (an STFT).

    Returns
    -------
    dict of str to ndarray of float32
        Each of shape (..., *INPUT_SHAPES[name]), finite.

    Raises
    ------
    ValueError
        If a name is unknown, `iq` is not complex or not finite or has fewer than `MIN_PULSES` pulses, or a frequency is
        not positive.
    """
    wanted = frozenset(names)
    unknown = wanted - INPUT_SHAPES.keys()
    if unknown:
        raise ValueError(f"model input {sorted(unknown)[0]!r} is unknown: it must be one of {', '.join(INPUT_SHAPES)}")
    samples = as_complex(iq, MIN_PULSES)
    flat = samples.reshape(-1, samples.shape[-1])
    each = dwells_of(flat, carrier_hz=carrier_hz, prf_hz=prf_hz, names=wanted)
    blocks = [dwells.inputs(wanted) for dwells in each]
    made = blocks[0] if len(blocks) == 1 else {name: np.concatenate([b[name] for b in blocks]) for name in blocks[0]}
    return {name: rows.reshape(samples.shape[:-1] + INPUT_SHAPES[name]) for name, rows in made.items()}


def in_blocks(samples: NDArray[np.complex64], *, framed: bool = False) -> list[NDArray[np.complex64]]:
    """Cut records (n, pulses) into the blocks that are worked on at a time, at least one; `framed` for an STFT."""
    high = max(1, BLOCK_SAMPLES // (IMAGE_SHARE if framed else 1) // samples.shape[-1])
    return [samples[first : first + high] for first in range(0, max(1, len(samples)), high)]


def dwells_of(
    samples: NDArray[np.complex64], *, carrier_hz: float, prf_hz: float, names: Collection[str]
) -> Iterator["Dwells"]:
    """Yield the `Dwells` of records (n, pulses), one block at a time, in blocks that suit the named inputs."""
    framed = "image" in names or "joint_features" in names
    for block in in_blocks(samples, framed=framed):
        yield Dwells(block, carrier_hz=carrier_hz, prf_hz=prf_hz)


def _analytic(samples: NDArray[np.complex64], *, carrier_hz: float, prf_hz: float) -> NDArray[np.complex64]:
    """Make records of one channel analytic, after filling the ends that a filter took out on both sides."""
    made = made_analytic(samples)
    if made is samples:  # no record is of one channel, as usual
        return made
    rows = np.flatnonzero((made != samples).any(axis=-1))
    channel = made[rows].real.astype(np.complex64)
    spectrum = doppler_spectrum(channel, carrier_hz=carrier_hz, prf_hz=prf_hz, window=HANN)
    ended, whole = filled_ends(channel, spectrum)
    if len(ended):
        added = np.sqrt(np.float32(2)) * (whole - channel[ended]).real  # real, as the channel is, and of the same power
        made[rows[ended]] = made_analytic((channel[ended].real + added).astype(np.complex64))
    return made


class Dwells:
    """Records of one radar and what is computed from them: each piece once, when an input first needs it.

    Parameters
    ----------
    samples : ndarray of complex64, shape (records, pulses)
        Slow-time samples, at least `MIN_PULSES` pulses.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.
    """

    def __init__(self, samples: NDArray[np.complex64], *, carrier_hz: float, prf_hz: float) -> None:
        radar = {"carrier_hz": carrier_hz, "prf_hz": prf_hz}
        self._given = _analytic(samples, **radar)
        spectrum = doppler_spectrum(self._given, **radar, window=HANN)
        rows, filled = filled_sides(self._given, spectrum)
        ended, whole = filled_ends(self._given, spectrum)
        if len(ended):  # none of these has an empty side too: `_analytic` filled the ends of one channel
            rows, filled = np.concatenate([rows, ended]), np.concatenate([filled, whole])
        self._filled = rows, filled
        if len(rows):
            spectrum = spectrum.with_rows(rows, doppler_spectrum(filled, **radar, window=HANN))
        self._spectrum_of_dwell = spectrum

    @cached_property
    def _samples(self) -> NDArray[np.complex64]:
        """Samples with the noise filled in: a copy, made only for inputs that need it."""
        rows, filled = self._filled
        if not len(rows):
            return self._given
        samples = self._given.copy()
        samples[rows] = filled
        return samples

    def rows(self, rows: NDArray[np.intp]) -> "Dwells":
        """Some of the records, with all that was already computed from them."""
        some = object.__new__(Dwells)
        some._samples = self._samples[rows]
        for name, piece in self.__dict__.items():
            if name == "_pool":
                some._pool = self._pool
            elif name not in ("_given", "_filled", "_samples"):
                some.__dict__[name] = piece[rows] if isinstance(piece, np.ndarray) else piece.rows(rows)
        return some

    def inputs(self, names: Collection[str]) -> dict[str, NDArray[np.float32]]:
        """The named inputs, each of shape (records, *INPUT_SHAPES[name]); see `model_inputs`."""
        # "features" last: they reuse the mean level of "levels" if that was computed
        return {name: getattr(self, f"_{name}") for name in sorted(names, key=lambda name: (name == "features", name))}

    @cached_property
    def _strongest(self) -> NDArray[np.intp]:
        return strongest_bin(self._spectrum_of_dwell)

    @cached_property
    def _body(self) -> Body:
        return body_line(self._spectrum_of_dwell, self._strongest)

    @cached_property
    def _mask(self) -> NDArray[np.bool_]:
        return notch_mask(self._spectrum_of_dwell, self._strongest)

    @cached_property
    def _kept(self) -> NDArray[np.float32]:
        return weights(self._mask)

    @cached_property
    def _cadence(self) -> NDArray[np.float32]:
        return cadence_db(self._spectrum_of_dwell, self._kept)

    @cached_property
    def _combs(self) -> NDArray[np.float32]:
        return comb_levels_db(self._spectrum_of_dwell, self._kept)

    @cached_property
    def _pool(self) -> Pooling:
        spectrum = self._spectrum_of_dwell
        return pooling(spectrum.bins, spectrum.carrier_hz, spectrum.prf_hz, AXIS_BINS)

    @cached_property
    def _levels(self) -> NDArray[np.float32]:
        return self._pool.mean_and_peak_db(self._spectrum_of_dwell.relative_power)

    @cached_property
    def _parts(self) -> NDArray[np.float32]:
        return parts_db(self._samples, self._spectrum_of_dwell, AXIS_BINS)

    @cached_property
    def _change(self) -> NDArray[np.float32]:
        return change_db(self._parts)

    @cached_property
    def _spectrum(self) -> NDArray[np.float32]:
        return np.concatenate([self._levels, self._change[..., None, :], self._parts], axis=-2)

    @cached_property
    def _features(self) -> NDArray[np.float32]:
        if "_levels" in self.__dict__:
            mean = np.ascontiguousarray(self._levels[..., 0, :])
        else:
            mean = self._pool.mean_db(self._spectrum_of_dwell.relative_power)
        return feature_vector(self._spectrum_of_dwell, self._body, self._mask, mean, self._parts, self._change)

    @cached_property
    def _frames(self) -> NDArray[np.float32]:
        return stft_image(self._samples, self._spectrum_of_dwell)

    @cached_property
    def _image(self) -> NDArray[np.float32]:
        return self._frames[..., None, :, :]

    @cached_property
    def _joint_features(self) -> NDArray[np.float32]:
        return joint_vector(self._frames, self._spectrum_of_dwell)
