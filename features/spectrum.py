"""The Doppler spectrum of a dwell, scaled to its own noise floor."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft, special

from .fast import means, ones, power_of, sums, to_db, windows
from .samples import as_complex, require_radar, safe_scale, scaled
from .window import KAISER, Window

#: Speed of light [m/s].
SPEED_OF_LIGHT_MPS = 299_792_458.0

#: Least noise floor, as a share of the record's mean power: without any noise (a synthetic line) rounding would set it.
LEAST_FLOOR = np.float32(1e-9)

# An array without axes, because NumPy would convert a plain number at every call.
_HALF = np.array(0.5, np.float32)

#: Least divisor in place of a power that may be 0; smaller than any power that is not.
LEAST_POWER = np.array(1e-36, np.float32)

#: Noise shows where the least floor is below this share of the floor: less than 1, because a mean is rounded.
SHOWN_SHARE = np.float32(0.99)

_FLOOR_QUANTILE = 0.25

#: FLOOR_BLOCKS: a side of the spectrum is summed in this many blocks, up to twice as many, or one a bin if it has fewer
#: bins; their lower quartile gives its floor. EMPTY_RATIO: a side whose floor is more than this many times below the
#: other's holds no noise.
FLOOR_BLOCKS, EMPTY_RATIO = 64, np.array(4, np.float32)

#: Fields of `Spectrum` that hold values of each record.
_OF_RECORDS = ("relative_power", "transform_floor", "scale", "transform", "side_floors")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Power spectra on their own axes, in units of their noise floors.

    Parameters
    ----------
    relative_power : ndarray of float32, shape (..., bins)
        Power over the noise floor [1], centred (fftshift): noise alone has mean 1 within 3 % from 700 pulses on; in
        shorter dwells the floor is too high, through Kaiser's window by 0.2 dB at 128 to 500 pulses, 0.4 at 64, 1 at 32
        and 1.7 at 16, through Hann's by 0.6 times that.
    transform_floor : ndarray of float32, shape (...)
        Noise power of a bin of `transform`; 0 for an all-zero record.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    pulses : int
        Pulses of the dwell.
    scale : ndarray of float32, shape (..., 1)
        Power of two by which the samples were scaled before the transform.
    transform : ndarray of complex64, shape (..., bins)
        The centred transform of the scaled and windowed samples, whose power this is.
    window : Window
        Window of those samples.
    side_floors : ndarray of float32, shape (..., 2)
        Noise power of a bin of `transform` on the lower and on the upper side, from which the floor is taken.
    """

    relative_power: NDArray[np.float32]
    transform_floor: NDArray[np.float32]
    carrier_hz: float
    prf_hz: float
    pulses: int
    scale: NDArray[np.float32]
    transform: NDArray[np.complex64]
    window: Window
    side_floors: NDArray[np.float32]

    def rows(self, rows: NDArray[np.intp] | tuple[int, ...]) -> "Spectrum":
        """The spectra of some records of a batch (records, bins), or of the one record at an index of any batch."""
        return replace(self, **{name: getattr(self, name)[rows] for name in _OF_RECORDS})

    def with_rows(self, rows: NDArray[np.intp], others: "Spectrum") -> "Spectrum":
        """Replace some of the spectra, shape (records, bins), by others; arrays other than `scale` are overwritten."""
        scale = self.scale.copy()  # it may be a shared array that must not be written to
        out = replace(self, scale=scale)
        for name in _OF_RECORDS:
            getattr(out, name)[rows] = getattr(others, name)
        return out

    @property
    def bins(self) -> int:
        """Number of frequency bins."""
        return self.relative_power.shape[-1]

    @property
    def floor(self) -> NDArray[np.float64]:
        """Noise power a sample, in the square of the input's unit, shape (...).

        float64, because the square of a sample may leave float32.
        """
        return np.asarray(self.transform_floor / np.square(self.scale[..., 0], dtype=np.float64), np.float64)

    @property
    def noise_shows(self) -> NDArray[np.bool_]:
        """Whether there is noise between the lines, more than `LEAST_FLOOR`, shape (...)."""
        shows = means(self.relative_power) * LEAST_FLOOR < SHOWN_SHARE
        return np.asarray(shows & (self.transform_floor > 0), np.bool_)

    @property
    def wavelength_m(self) -> float:
        """Wavelength [m]."""
        return SPEED_OF_LIGHT_MPS / self.carrier_hz

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Doppler frequency of each bin [Hz], rising, shape (bins,), not to be written to."""
        return _frequencies_hz(self.bins, self.prf_hz)

    @property
    def frequency_hz_float32(self) -> NDArray[np.float32]:
        """The same in float32."""
        return _frequencies_hz_float32(self.bins, self.prf_hz)

    @property
    def velocity_mps(self) -> NDArray[np.float64]:
        """Radial velocity of each bin [m/s], falling: Doppler = -2 v / wavelength, shape (bins,), read-only."""
        return _velocities_mps(self.bins, self.prf_hz, self.wavelength_m)

    @cached_property
    def level_db(self) -> NDArray[np.float32]:
        """Level over the noise floor [dB], not below `LOWEST_DB`, shape (..., bins)."""
        return to_db(self.relative_power)


@lru_cache(maxsize=64)
def _frequencies_hz(bins: int, prf_hz: float) -> NDArray[np.float64]:
    """Centred frequencies of a transform [Hz], shape (bins,)."""
    frequencies = fft.fftshift(fft.fftfreq(bins, 1 / prf_hz))
    frequencies.flags.writeable = False
    return frequencies


@lru_cache(maxsize=64)
def _frequencies_hz_float32(bins: int, prf_hz: float) -> NDArray[np.float32]:
    """Centred frequencies of a transform [Hz], shape (bins,), in float32."""
    frequencies = _frequencies_hz(bins, prf_hz).astype(np.float32)
    frequencies.flags.writeable = False
    return frequencies


@lru_cache(maxsize=64)
def _velocities_mps(bins: int, prf_hz: float, wavelength_m: float) -> NDArray[np.float64]:
    """Velocities of those frequencies [m/s], shape (bins,)."""
    velocities = -_frequencies_hz(bins, prf_hz) * wavelength_m / 2
    velocities.flags.writeable = False
    return velocities


@lru_cache(maxsize=64)
def packed_window(pulses: int, centred_by_sign: bool, window: Window) -> NDArray[np.float32]:
    """A window of unit noise gain, each value twice, for a sample's two parts, shape (2 pulses,).

    With alternating signs it also centres the spectrum, which saves the shift.
    """
    taper = window.taper(pulses)
    if centred_by_sign:
        taper[1::2] *= -1
    return np.repeat(taper.astype(np.float32), 2)


def bins_alike(pulses: int, bins: int, window: Window) -> NDArray[np.float64]:
    """Squared correlation of white noise in two bins, by how far they are apart, shape (bins,): 1 at 0."""
    squared = window.taper(pulses) ** 2
    return np.asarray(np.minimum(np.abs(fft.fft(squared / squared.sum(), n=bins)) ** 2, 1), np.float64)


def centred_power(iq: NDArray[np.complex64], bins: int | None = None, *, window: Window) -> NDArray[np.float32]:
    """Windowed power spectrum, centred: white noise of unit power a sample gives mean 1 in every bin.

    Parameters
    ----------
    iq : ndarray of complex64, shape (..., pulses)
        Slow-time samples, of a size whose square float32 holds.
    bins : int, optional
        Transform length, at least `pulses`; by default the next one that transforms fast.
    window : Window
        The taper.

    Returns
    -------
    ndarray of float32, shape (..., bins)
    """
    return power_of(centred_transform(iq, bins, window=window))


def centred_transform(iq: NDArray[np.complex64], bins: int | None = None, *, window: Window) -> NDArray[np.complex64]:
    """The transform whose power `centred_power` gives, of the same samples; its phases refer to the first of them."""
    pulses = iq.shape[-1]
    bins = fft.next_fast_len(pulses) if bins is None else bins
    even = bins % 2 == 0
    parts = iq.astype(np.complex64, copy=False).view(np.float32)
    tapered = (parts * packed_window(pulses, even, window)).view(np.complex64)
    transform = fft.fft(tapered, bins if bins != pulses else None, overwrite_x=True)
    return transform if even else fft.fftshift(transform, axes=-1)


def per_floor(floor: NDArray[np.float32]) -> NDArray[np.float32]:
    """Factor that brings a power into units of its floor; finite also where the floor, and so the power, is 0."""
    return np.reciprocal(np.maximum(floor, LEAST_POWER))


def noise_floor(power: NDArray[np.float32], window: Window) -> NDArray[np.float32]:
    """Noise floor of centred power spectra, robust to lines, bands and an empty side.

    The mean of both sides' floors counts, or the larger one where the other side is empty, as it is in recordings made
    analytic from a single real channel.

    Parameters
    ----------
    power : ndarray of float32, shape (..., bins)
        Power spectrum.
    window : Window
        Window of the samples, which correlates neighbouring bins.

    Returns
    -------
    ndarray of float32, shape (...)
        Mean noise power of a bin.
    """
    return _floor_of(_side_floors(power, window))


def _side_floors(power: NDArray[np.float32], window: Window) -> NDArray[np.float32]:
    """Noise floor of the lower and of the upper side of centred power spectra, shape (..., 2).

    Each side is averaged in blocks of neighbouring bins; the lower quartile of the blocks, corrected for its bias on
    white noise, is that side's floor.
    """
    if power.shape[-1] < 4:
        return power.mean(axis=-1, keepdims=True).repeat(2, axis=-1)
    blocks, size = side_sums(power)
    count = blocks.shape[-1]
    rank = quartile_rank(count)
    blocks.partition(rank, axis=-1)
    return np.divide(blocks[..., rank], quartile_of_noise(power.shape[-1], size, count, window))


def _floor_of(sides: NDArray[np.float32]) -> NDArray[np.float32]:
    """Noise floor of spectra, shape (...), from those of their two sides, shape (..., 2)."""
    one, other = sides[..., 0], sides[..., 1]
    least, most = np.minimum(one, other), np.maximum(one, other)
    return np.where(most > EMPTY_RATIO * least, most, (least + most) * _HALF)


def side_sums(power: NDArray[np.float32]) -> tuple[NDArray[np.float32], int]:
    """Sums over blocks of neighbouring bins on both sides of centred power spectra of at least 4 bins.

    Returns
    -------
    sums : ndarray of float32, shape (..., 2, blocks)
        From the lowest frequency up.
    size : int
        Bins of a block.
    """
    half = power.shape[-1] // 2
    size = max(1, half // FLOOR_BLOCKS)
    blocks = half // size
    # two sides alike, each in its blocks, without the bin at half the PRF, which has no mirror
    lower = (power.shape[-1] + 1) % 2
    sides = windows(power, (2, blocks, size), (power.shape[-1] - lower - blocks * size, size, 1), lower)
    # short rows are read in whole registers: a NaN in memory behind the last number would cause a warning
    with np.errstate(invalid="ignore"):
        return np.matmul(sides, ones(size)), size


@lru_cache(maxsize=64)
def quartile_of_noise(bins: int, size: int, blocks: int, window: Window) -> NDArray[np.float32]:
    """Lower quartile of `blocks` sums of `size` neighbouring bins each, in white noise of unit power."""
    # a gamma law with the sum's degrees of freedom: fewer than its bins, because the window correlates neighbours
    alike = bins_alike(bins, bins, window)[1:size]
    shape_k = size**2 / (size + 2 * np.arange(size - 1, 0, -1) @ alike)
    share = (quartile_rank(blocks) + 1) / (blocks + 1)  # mean of that rank among uniform numbers
    return np.array(size / shape_k * special.gammaincinv(shape_k, share), np.float32)


def quartile_rank(blocks: int) -> int:
    """Rank of the lower quartile of so many blocks, counted from 0."""
    return round(_FLOOR_QUANTILE * (blocks - 1))


def _least_floor(power: NDArray[np.float32]) -> NDArray[np.float32]:
    """Lower bound of the floor of power spectra, shape (...)."""
    return sums(power) * (LEAST_FLOOR / np.float32(power.shape[-1]))


def doppler_spectrum(iq: ArrayLike, *, carrier_hz: float, prf_hz: float, window: Window = KAISER) -> Spectrum:
    """Doppler spectrum of a dwell, in units of its own noise floor.

    Parameters
    ----------
    iq : array_like of complex, shape (..., pulses)
        Slow-time samples of one range cell, any gain; at least 2 pulses.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.
    window : Window
        `KAISER`, whose side lobes hide no line beside a strong one, or `HANN`, in which weak ones stand higher.

    Returns
    -------
    Spectrum
        For an all-zero record the relative power is 0 and so is the floor.

    Raises
    ------
    ValueError
        If `iq` is not complex or not finite, it has fewer than 2 pulses, or the frequencies are not positive.
    """
    samples = as_complex(iq, least=2)
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    scale = safe_scale(samples)
    transform = centred_transform(scaled(samples, scale), window=window)
    power = power_of(transform)
    sides = _side_floors(power, window)
    floor = np.maximum(_floor_of(sides), _least_floor(power))
    relative = np.multiply(power, per_floor(floor)[..., None], out=power)
    return Spectrum(relative, floor, carrier_hz, prf_hz, samples.shape[-1], scale, transform, window, sides)
