"""Wingbeat of a bird, and the trend of its body, from the sequence of spectra of a long recording."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .notch import body_line
from .periodogram import LINE_DB
from .spectrum import SPEED_OF_LIGHT_MPS, doppler_spectrum
from .stft import stft

#: Wingbeats that are sought [Hz]: the slowest is a swan's in a slow beat, the fastest a small songbird's.
WINGBEAT_RANGE_HZ = (2.4, 20.0)

#: Shortest recording [s]: several beats of a slow bird.
LEAST_S = 1.5

#: Frames of the sequence [s], and from frame to frame.
FRAME_S, HOP_S = 0.012, 0.003

#: Dwells by which the body is followed [s].
BODY_DWELL_S = 0.1

#: Wings move within this of the body [m/s]; what is over the noise further out must be below this share of the bins.
WING_MPS, FAR_SHARE = 25.0, 0.1

#: How well the pattern must repeat after a beat, over what it does between beats [1 of the pattern's power].
LEAST_REPEAT = 0.5

#: The earliest repetition with this share of the best is the beat, not a multiple.
FIRST_SHARE = 0.8


@dataclass(frozen=True)
class Wingbeat:
    """Wingbeat and body of each recording of a batch; NaN where there is no value.

    Parameters
    ----------
    wingbeat_hz, wingbeat_hz_std : ndarray of float64, shape (...)
        Wingbeat rate [Hz].
    repeat : ndarray of float64, shape (...)
        How well the pattern repeats, 0..1.
    velocity_mps : ndarray of float64, shape (...)
        Radial velocity of the body in the middle of the recording [m/s].
    acceleration_mps2, acceleration_mps2_std : ndarray of float64, shape (...)
        Mean radial acceleration of the body, from the track of its line [m/s^2].
    reason : ndarray of str, shape (...)
        Why there is no wingbeat; empty where there is one.
    """

    wingbeat_hz: NDArray[np.float64]
    wingbeat_hz_std: NDArray[np.float64]
    repeat: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    acceleration_mps2: NDArray[np.float64]
    acceleration_mps2_std: NDArray[np.float64]
    reason: NDArray[np.str_]


def wingbeat(iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float) -> Wingbeat:
    """Wingbeat rate and body acceleration of long recordings, or why there is no wingbeat.

    The body's trend is taken out first. Then the pattern of levels over velocity and time is compared with itself some
    time later: it repeats after one beat. Up and down stroke lie on different sides of the body, so half a beat later
    it does not.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Slow-time samples of one range cell.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    Wingbeat
    """
    samples = np.asarray(iq, np.complex64)
    lead = samples.shape[:-1]
    rows = [_one(samples[index], carrier_hz, prf_hz) for index in np.ndindex(lead)]
    columns = [np.array(column).reshape(lead) for column in zip(*rows, strict=True)]
    return Wingbeat(*columns)


def _one(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple:
    """The fields of `Wingbeat` of one recording."""
    nothing = (np.nan,) * 6
    if len(iq) < LEAST_S * prf_hz:
        return (*nothing, f"no wingbeat: {len(iq) / prf_hz:.2g} s, less than {LEAST_S:g} s")
    scale = np.abs(iq).max()
    if scale == 0 or round(FRAME_S * prf_hz) < 8:
        return (*nothing, "no wingbeat: no signal" if scale == 0 else f"no wingbeat: PRF {prf_hz:g} Hz is too low")
    wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
    if prf_hz * wavelength_m / 4 < 1.1 * WING_MPS:
        # a rotor folded into the wings' speeds cannot be told from them
        return (*nothing, f"no wingbeat: unambiguous only to {prf_hz * wavelength_m / 4:.1f} m/s")
    velocity, acceleration, std = _track(iq / scale, carrier_hz, prf_hz)
    if np.isnan(velocity):
        return (*nothing, "no wingbeat: no body line")
    body = (velocity, acceleration, std)
    time_s = (np.arange(len(iq)) - (len(iq) - 1) / 2) / prf_hz
    turns = 2 / wavelength_m * (velocity * time_s + acceleration / 2 * time_s**2)
    steady = iq / scale * np.exp(2j * np.pi * (turns - np.rint(turns))).astype(np.complex64)
    frames = stft(steady, carrier_hz=carrier_hz, prf_hz=prf_hz, window_s=FRAME_S, overlap=1 - HOP_S / FRAME_S)
    speed = np.abs(frames.frequency_hz) * wavelength_m / 2
    # the floor from a low quantile of each bin's mean: wings fill the middle
    mean = frames.power.mean(axis=0)
    floor = float(np.quantile(mean, 0.2))
    far = speed > WING_MPS
    if far.any() and (mean[far] > 2 * floor).mean() > FAR_SHARE:
        return (
            np.nan,
            np.nan,
            np.nan,
            *body,
            f"no wingbeat: echoes beyond {WING_MPS:g} m/s of the body, too fast for wings",
        )
    level = np.log1p(frames.power[:, ~far] / np.float32(floor)).astype(np.float64)
    # bouts and fading are slower than a beat
    span = round(frames.frame_rate_hz / WINGBEAT_RANGE_HZ[0])
    from scipy.ndimage import uniform_filter1d  # here, because predicting needs no such import

    level -= uniform_filter1d(level, span, axis=0, mode="nearest")
    count = len(level)
    size = fft.next_fast_len(2 * count, real=True)
    power = np.abs(fft.rfft(level, n=size, axis=0)) ** 2
    # cells of noise alone say nothing of the beat
    weight = np.maximum(mean[~far] / floor - 1.3, 0)
    weight /= weight + 1
    correlation = fft.irfft(power @ weight, n=size)[:count] * (count / (count - np.arange(count)))
    if correlation[0] <= 0:
        return (np.nan, np.nan, np.nan, *body, "no wingbeat: nothing moves")
    row = correlation / correlation[0]
    low, high = WINGBEAT_RANGE_HZ
    lag, lag_std, repeat = _repetition(row, FRAME_S * frames.frame_rate_hz, frames.frame_rate_hz / low)
    if not repeat >= LEAST_REPEAT:
        return (np.nan, np.nan, repeat, *body, f"no wingbeat: the pattern repeats by {max(repeat, 0):.2f} only")
    rate = frames.frame_rate_hz / lag
    if rate > high:
        return (np.nan, np.nan, repeat, *body, f"no wingbeat: the pattern repeats at {rate:.0f} Hz, too fast for wings")
    return (rate, rate * lag_std / lag, repeat, *body, "")


def _track(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple[float, float, float]:
    """Velocity in the middle, acceleration and its deviation, from a line through the velocities of the dwells."""
    length = round(BODY_DWELL_S * prf_hz)
    count = len(iq) // length
    spectrum = doppler_spectrum(iq[: count * length].reshape(count, length), carrier_hz=carrier_hz, prf_hz=prf_hz)
    body = body_line(spectrum)
    if np.median(body.level_db) < LINE_DB:
        return np.nan, np.nan, np.nan
    velocity = body.velocity_mps.astype(np.float64)
    ambiguous = prf_hz * spectrum.wavelength_m / 2
    velocity = np.unwrap(velocity, period=ambiguous)
    when = ((np.arange(count) + 0.5) * length - (len(iq) - 1) / 2) / prf_hz
    # a dwell whose strongest line is a wing's must not turn the line: medians of slopes (Theil and Sen)
    first, second = np.triu_indices(count, 1)
    slope = float(np.median((velocity[second] - velocity[first]) / (when[second] - when[first])))
    rest = velocity - slope * when
    middle = float(np.median(rest))
    spread = 1.4826 * float(np.median(np.abs(rest - middle)))
    return middle, slope, spread / float(np.sqrt(((when - when.mean()) ** 2).sum()))


def _repetition(row: NDArray[np.float64], shortest: float, longest: float) -> tuple[float, float, float]:
    """Lag after which a pattern repeats, its deviation, and how well: over the correlation between the beats."""
    first, last = max(2, int(shortest)), min(int(longest) + 1, len(row) // 3)
    inner = row[first : last + 1]
    peaks = first + np.flatnonzero((inner >= row[first - 1 : last]) & (inner > row[first + 1 : last + 2]))
    best = (np.nan, np.nan, -1.0)
    if not len(peaks):
        return best
    heights = np.array([_over(row, int(peak)) for peak in peaks])
    top = heights.max()
    chosen = int(np.flatnonzero(heights >= FIRST_SHARE * top)[0])
    lag, height = float(peaks[chosen]), float(heights[chosen])
    found, weights = [], []
    for number in range(1, 8):
        near, reach = round(number * lag), max(1, int(0.15 * lag))
        if near + reach + 1 >= len(row) // 2:
            break
        peak = near - reach + int(row[near - reach : near + reach + 1].argmax())
        if abs(peak - near) == reach or row[peak] < 0.4 * row[peaks[chosen]]:
            break
        left, middle, right = row[peak - 1 : peak + 2]
        curve = 2 * middle - left - right
        place = peak + (float(np.clip((right - left) / (2 * curve), -0.5, 0.5)) if curve > 0 else 0.0)
        found.append(place / number)
        weights.append(float(number**2))
        lag = float(np.average(found, weights=weights))
    if not found:
        return best
    scatter = float(np.sqrt(np.average((np.array(found) - lag) ** 2, weights=weights)))
    # no better than a thirtieth of a frame's step at the last multiple
    return lag, float(np.hypot(scatter, 0.03 / len(found))), height


def _over(row: NDArray[np.float64], peak: int) -> float:
    """Correlation after one and two beats over the lowest between and after them."""
    if 5 * peak // 2 >= len(row):
        return -1.0
    reach = max(1, peak // 8)
    again = row[2 * peak - reach : 2 * peak + reach + 1].max()
    between = row[peak // 2 : peak].min(), row[peak : 2 * peak].min()
    return float((row[peak] + again - sum(between)) / 2)
