"""Joint time-frequency counterparts of the spectrum: STFT, flashes, band, cadences, cepstrogram, HERM lines."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .chopping import CHOPPING_RANGE_HZ
from .lines import squared
from .notch import NOTCH_MPS, parabola_offset
from .samples import as_complex, require_radar
from .spectrum import SPEED_OF_LIGHT_MPS

#: Window length [s] and overlap [1] of the paper's Fig. 21: 20, 80 and 200 samples at 20 kHz, 50 to 90 %.
PAPER_SETTINGS = ((1e-3, 0.9), (4e-3, 0.9), (4e-3, 0.5), (10e-3, 0.9))

#: Window of HERM lines [s]: several turns of a rotor, so that its flashes are lines.
HERM_WINDOW_S = 0.04

#: Least autocorrelation of a flash train at its period: FLASH_CORRELATION [1] and FLASH_DEVIATIONS [standard deviations
#: of noise], whichever is more.
FLASH_CORRELATION, FLASH_DEVIATIONS = 0.15, 3.5

#: Frames this share of a window apart count as independent.
SHARED = 0.6

#: The earliest lag with this share of the highest correlation is the period, not one of its multiples.
FIRST_SHARE = 0.7


@dataclass(frozen=True)
class Stft:
    """Short-time spectra of a batch.

    Parameters
    ----------
    power : ndarray of float32, shape (..., frames, bins)
        Power, centred in Doppler: bin `bins // 2` is velocity zero.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    hop : int
        Samples from frame to frame, at least 1.
    """

    power: NDArray[np.float32]
    carrier_hz: float
    prf_hz: float
    hop: int

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Doppler of each bin [Hz], shape (bins,)."""
        return fft.fftshift(fft.fftfreq(self.power.shape[-1], 1 / self.prf_hz))

    @property
    def frame_rate_hz(self) -> float:
        """Frames a second [Hz]."""
        return self.prf_hz / self.hop

    @property
    def floor(self) -> NDArray[np.float32]:
        """Noise power of a bin, shape (...): from the median over all frames and bins, for exponential noise."""
        return np.median(self.power, axis=(-2, -1)) / np.float32(np.log(2))


def stft(
    iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float, window_s: float = 4e-3, overlap: float = 0.9
) -> Stft:
    """Short-time spectra with a Hann window, whole frames only.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Samples.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.
    window_s : float
        Window length [s].
    overlap : float
        Share of a window that the next one repeats, 0 <= overlap < 1.

    Returns
    -------
    Stft

    Raises
    ------
    ValueError
        If the overlap is not in 0..1 (1 excluded), the window is shorter than 4 samples or longer than the record, `iq`
        is not complex or holds no pulse, or a frequency is not positive.

    Notes
    -----
    The same numbers as `scipy.signal.ShortTimeFFT`, which loops over the frames and over no batch.
    """
    samples = as_complex(iq)
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    if not 0 <= overlap < 1:
        raise ValueError(f"overlap is {overlap!r}: it must be at least 0 and below 1")
    window, pulses = round(window_s * prf_hz), samples.shape[-1]
    if not 4 <= window <= pulses:
        raise ValueError(f"window_s is {window_s!r}, {window} samples: it must hold 4 to {pulses} (all) samples")
    hop = max(1, round(window * (1 - overlap)))
    cut = np.lib.stride_tricks.sliding_window_view(samples, window, axis=-1)[..., ::hop, :]
    taper = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(window) / window)).astype(np.float32)
    spectra = fft.fftshift(fft.fft(cut * taper, axis=-1), axes=-1)
    return Stft(squared(spectra), carrier_hz, prf_hz, hop)


def flash_period_s(frames: Stft) -> NDArray[np.float64]:
    """Period of the flashes: the reciprocal of the chopping frequency.

    Each side of the body line has its own train (an odd number of blades flashes on the two sides in turn), so the
    autocorrelations of both sides' power are added; the earliest high peak is refined at its multiples.

    Parameters
    ----------
    frames : Stft
        From `stft`, of a window shorter than the period.

    Returns
    -------
    ndarray of float64, shape (...)
        [s]; NaN where no train stands out.
    """
    power = frames.power
    count, bins = power.shape[-2:]
    lead = power.shape[:-2]
    mean = power.mean(axis=-2)
    body = mean.argmax(axis=-1)[..., None]
    away = (np.arange(bins) - body + bins // 2) % bins - bins // 2
    bin_mps = frames.prf_hz / bins * SPEED_OF_LIGHT_MPS / frames.carrier_hz / 2
    notch = max(3, int(np.ceil(NOTCH_MPS / bin_mps)))
    # power of each side over time, relative to its mean: the period does not depend on the gain
    sides = np.stack([(power @ ((sign * away > notch)[..., None]).astype(np.float32))[..., 0] for sign in (-1, 1)])
    level = sides.mean(axis=-1, keepdims=True, dtype=np.float64)
    swing = sides / np.where(level > 0, level, 1) - (level > 0)
    size = fft.next_fast_len(2 * count, real=True)
    spectrum = (np.abs(fft.rfft(swing, n=size, axis=-1)) ** 2).sum(axis=0)
    # coarse hops are interpolated: the correlation of a band-limited level is known between the frames too
    finer = int(np.ceil(8 * frames.hop / bins))
    lags = finer * count
    correlation = fft.irfft(spectrum, n=size * finer, axis=-1)[..., :lags] * (lags / (lags - np.arange(lags)))
    rate_hz = frames.frame_rate_hz * finer
    low, high = CHOPPING_RANGE_HZ
    # the last bound: frames less than SHARED windows apart share samples, so that no period can be told there
    first = max(2, int(np.ceil(rate_hz / high)), int(np.ceil(SHARED * bins / frames.hop * finer)))
    last = min(int(rate_hz / low), lags // 2)
    out = np.full(lead, np.nan)
    if last - first < 3:
        return out
    # number of independent frames, of both sides together
    independent = 2 * count * min(1.0, 1.5 * frames.hop / bins)
    least = max(FLASH_CORRELATION, FLASH_DEVIATIONS / np.sqrt(independent))
    for index in np.ndindex(lead):
        row = correlation[index]
        if row[0] > 0:
            out[index] = _period(row / row[0], first, last, least) / rate_hz
    return out


def _period(row: NDArray[np.float64], first: int, last: int, least: float) -> float:
    """Period of a correlation of height 1 at lag 0 [lags]."""
    inner = row[first : last + 1]
    peaks = first + np.flatnonzero((inner >= row[first - 1 : last]) & (inner > row[first + 1 : last + 2]))
    if not len(peaks) or row[peaks].max() < least:
        return np.nan
    lag = float(_top(row, int(peaks[row[peaks] >= FIRST_SHARE * row[peaks].max()][0])))
    for number in range(2, int(0.5 * len(row) / lag) + 1):
        near = round(number * lag)
        reach = max(1, int(0.2 * lag))
        high = near - reach + int(row[near - reach : near + reach + 1].argmax())
        if abs(high - near) == reach or high + 1 >= len(row) or row[high] < least:
            break
        lag = _top(row, high) / number
    return lag


def _top(row: NDArray[np.float64], peak: int) -> float:
    """Place of a peak, refined to a fraction of a lag by a parabola."""
    return peak + float(parabola_offset(*row[peak - 1 : peak + 2]))


def flash_bandwidth_hz(frames: Stft, threshold_db: float = 20.0) -> NDArray[np.float64]:
    """Doppler bandwidth by the paper's rule: the range over a threshold, in any frame.

    Parameters
    ----------
    frames : Stft
        From `stft`.
    threshold_db : float
        Threshold over the noise [dB]; the paper took 20 on measured data, 30 on simulated.

    Returns
    -------
    ndarray of float64, shape (...)
        [Hz]; 0 where nothing is over the threshold.
    """
    highest = frames.power.max(axis=-2)
    floor = frames.floor[..., None]
    over = (highest > floor * 10 ** (threshold_db / 10)) & (floor > 0)
    bins = over.shape[-1]
    span = bins - 1 - over[..., ::-1].argmax(axis=-1) - over.argmax(axis=-1)
    return np.where(over.any(axis=-1), span, 0) * (frames.prf_hz / bins)


def cadence_velocity(frames: Stft) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Cadence-velocity diagram: how fast the level of each Doppler bin swings.

    Parameters
    ----------
    frames : Stft
        From `stft`.

    Returns
    -------
    diagram : ndarray of float32, shape (..., frames // 2 + 1, bins)
        Magnitude over each record's mean amplitude [1]; the steady part is taken out.
    cadence_hz : ndarray of float64, shape (frames // 2 + 1,)
        Cadence of each row [Hz].
    """
    amplitude = np.sqrt(frames.power)
    count = amplitude.shape[-2]
    mean = amplitude.mean(axis=(-2, -1), keepdims=True)
    swing = (amplitude - amplitude.mean(axis=-2, keepdims=True)) / np.where(mean > 0, mean, 1)
    diagram = np.abs(fft.rfft(swing, axis=-2)) / np.float32(count)
    return diagram.astype(np.float32), fft.rfftfreq(count, 1 / frames.frame_rate_hz)


def cepstrogram(frames: Stft) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Cepstrum of each frame: the lines of a comb are one peak at their period, wherever the body is.

    Parameters
    ----------
    frames : Stft
        From `stft`, of a window of several periods.

    Returns
    -------
    heights : ndarray of float32, shape (..., frames, bins // 2 + 1)
        Magnitude of the transform of the level over the floor [dB].
    period_s : ndarray of float64, shape (bins // 2 + 1,)
        Period of each column [s].
    """
    bins = frames.power.shape[-1]
    floor = np.where(frames.floor > 0, frames.floor, 1)[..., None, None]
    level = 10 * np.log10(np.maximum(frames.power / floor, np.float32(1)))
    level -= level.mean(axis=-1, keepdims=True)
    return (np.abs(fft.rfft(level, axis=-1)) / bins).astype(np.float32), np.arange(bins // 2 + 1) / frames.prf_hz


def herm_lines_db(frames: Stft) -> NDArray[np.float32]:
    """HERM lines: what stays in each Doppler bin from long frame to long frame.

    Parameters
    ----------
    frames : Stft
        From `stft`, of a window of several turns (`HERM_WINDOW_S`).

    Returns
    -------
    ndarray of float32, shape (..., bins)
        Median level over the floor [dB], not below 0.
    """
    floor = np.where(frames.floor > 0, frames.floor, 1)[..., None]
    return 10 * np.log10(np.maximum(np.median(frames.power, axis=-2) / floor, np.float32(1)))
