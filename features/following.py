"""A body followed through a long recording: its steady course, and the samples as if it stood still."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .bodies import LINE_DB
from .dropouts import NOTHING, mended
from .lines import from_whole
from .notch import body_line
from .one_thread import one_thread
from .samples import finite_complex, require_radar, scaled, unit_scale
from .spectrum import SPEED_OF_LIGHT_MPS, doppler_spectrum
from .window import KAISER

#: BODY_DWELL_S: dwells by which the body is followed [s]. OVERLAP: dwells that hold each moment. (In dwells side by
#: side a heave at their rate would be aliased to a slow slope.)
BODY_DWELL_S, OVERLAP = 0.1, 3

#: Least number of pulses of such a dwell: at a PRF with fewer no body is seen.
LEAST_PULSES = 16

#: The course's slope is told from at most this many dwells, spread over all: the number of slopes between all pairs
#: grows with the square of theirs.
MOST_DWELLS = 400

#: CLIPPED: residuals of dwells are clipped at this many standard deviations. ROBUST_LOSS: standard deviation of the
#: median of slopes over that of a least-squares line in white noise, in which errors of overlapping dwells cancel.
CLIPPED, ROBUST_LOSS = 3.0, 2.0

#: A line slower than REST_MPS [m/s], with an acceleration below REST_MPS2 [m/s^2], is taken for the background: all
#: slower than REST_NOTCH_MPS is then taken out [m/s].
REST_MPS, REST_MPS2, REST_NOTCH_MPS = 0.4, 0.15, 0.5

#: Velocity in the middle of the recording [m/s], acceleration and its standard deviation [m/s^2]; NaN where no line
#: stands out.
Course = tuple[float, float, float]


def by_recording(
    iq: NDArray[np.complexfloating],
    one: Callable[[NDArray[np.complex64], float, float], tuple[Any, ...]],
    carrier_hz: float,
    prf_hz: float,
) -> list[NDArray]:
    """Results of `one` for each recording of a batch (..., pulses), in turn, on one thread: an array a field.

    Lost pulses are filled in; a recording that lost too many for that is taken for silence.

    Raises
    ------
    ValueError
        If the samples are not complex or not finite, there are none, or a frequency is not positive.
    """
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    samples, stretches = mended(finite_complex(iq))
    lead, pulses = samples.shape[:-1], samples.shape[-1:]
    silence = np.zeros(pulses, np.complex64)
    each = [silence if stretches.get(index) == NOTHING else samples[index] for index in np.ndindex(lead)] or [silence]
    with one_thread:
        rows = [one(recording, carrier_hz, prf_hz) for recording in each]
    return [np.array(column)[: math.prod(lead)].reshape(lead) for column in zip(*rows, strict=True)]


def normed(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Samples, not all zero, over the size of the largest; scaled before, as float32 may not hold that size."""
    unit = scaled(iq, unit_scale(iq))
    return np.asarray(unit / np.abs(unit).max(), np.complex64)


def followed(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple[NDArray[np.complex64], Course]:
    """The samples without a background at rest, and the course of the body in them.

    Parameters
    ----------
    iq : ndarray of complex64, shape (pulses,)
        A recording of two `BODY_DWELL_S` and more, of a size whose square float32 holds.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    samples : ndarray of complex64, shape (pulses,)
        As given; or, where the strongest line was a background's and another is left without it, with all that is
        slower than `REST_NOTCH_MPS` taken out.
    course : Course
    """
    body = _track(iq, carrier_hz, prf_hz)
    if not (abs(body[0]) < REST_MPS and abs(body[1]) < REST_MPS2):
        return iq, body
    away = np.abs(fft.fftfreq(len(iq), 1 / prf_hz)) * SPEED_OF_LIGHT_MPS / carrier_hz / 2
    kept = np.clip((away / REST_NOTCH_MPS - 1) / 0.3, 0, 1).astype(np.float32)
    moving = fft.ifft(fft.fft(iq) * kept)
    other = _track(moving, carrier_hz, prf_hz)
    return (iq, body) if np.isnan(other[0]) else (moving, other)


def standing(iq: NDArray[np.complex64], course: Course, carrier_hz: float, prf_hz: float) -> NDArray[np.complex64]:
    """The samples as if the body stood still, shape (pulses,)."""
    velocity, acceleration, _ = course
    time_s = (np.arange(len(iq)) - (len(iq) - 1) / 2) / prf_hz
    turns = 2 * carrier_hz / SPEED_OF_LIGHT_MPS * (velocity * time_s + acceleration / 2 * time_s**2)
    return iq * np.exp(2j * np.pi * from_whole(turns)).astype(np.complex64)


def _track(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> Course:
    """Course of the body: a line through the velocities of the dwells."""
    length = round(BODY_DWELL_S * prf_hz)
    if length < LEAST_PULSES:
        return np.nan, np.nan, np.nan
    hop = max(length // OVERLAP, 1)
    starts = np.arange(0, len(iq) - length + 1, hop)
    dwells = np.lib.stride_tricks.sliding_window_view(iq, length)[starts]
    spectrum = doppler_spectrum(dwells, carrier_hz=carrier_hz, prf_hz=prf_hz)
    body = body_line(spectrum)
    if np.median(body.level_db) < LINE_DB:
        return np.nan, np.nan, np.nan
    velocity = body.velocity_mps.astype(np.float64)
    ambiguous = prf_hz * spectrum.wavelength_m / 2
    velocity = np.unwrap(velocity, period=ambiguous)
    count = len(starts)
    when = (starts + (length - len(iq)) / 2) / prf_hz
    # a dwell whose strongest line is a wing's must not tilt the course: medians of slopes (Theil and Sen)
    some = np.unique(np.linspace(0, count - 1, min(count, MOST_DWELLS)).astype(np.intp))
    first, second = some[np.stack(np.triu_indices(len(some), 1))]
    slope = float(np.median((velocity[second] - velocity[first]) / (when[second] - when[first])))
    rest = velocity - slope * when
    middle = float(np.median(rest))
    return middle, slope, _slope_std(rest - middle, when, length, hop)


def _slope_std(rest: NDArray[np.floating], when: NDArray[np.floating], length: int, hop: int) -> float:
    """Standard deviation of the slope of a line through the velocities of dwells that overlap.

    Parameters
    ----------
    rest : ndarray, shape (dwells,)
        Residual of each velocity about the line [m/s].
    when : ndarray, shape (dwells,)
        Middles of the dwells [s].
    length, hop : int
        Length of a dwell, and hop from one to the next [pulses].

    Returns
    -------
    float
        From the autocovariance of the residuals over lags of up to a quarter of the recording (Newey and West 1987),
        and no less than that of the median of slopes in white noise of the same spread [m/s^2].
    """
    count = len(rest)
    spread = 1.4826 * float(np.median(np.abs(rest)))
    away = when - when.mean()
    weight = _together(away / (away @ away))
    seen = _together(np.clip(rest, -CLIPPED * spread, CLIPPED * spread)) / count
    most = min(max(count // 4, OVERLAP), count - 1)
    lag = np.arange(most + 1)
    twice = np.where(lag > 0, 2.0, 1.0)
    found = float((twice * (1 - lag / (most + 1)) * weight[lag] * seen[lag]).sum())
    # the error of a line's frequency is the noise weighted by window times time from the middle: where two dwells
    # overlap, these weights have opposite signs
    score = KAISER.shape(length) * (np.arange(length) - (length - 1) / 2)
    alike = _together(score)[::hop][: min(OVERLAP, count)]
    white = spread**2 * float((twice[: len(alike)] * weight[: len(alike)] * alike).sum() / alike[0])
    return float(np.sqrt(max(found, ROBUST_LOSS**2 * white, 0.0)))


def _together(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Sums of the products of values that are 0 to len(values) - 1 places apart: their autocorrelation."""
    size = fft.next_fast_len(2 * len(values), real=True)
    return np.asarray(fft.irfft(np.abs(fft.rfft(values, size)) ** 2, size)[: len(values)], np.float64)
