"""To and fro of a body along the line of sight: wings lift a bird at every beat, a walker's torso sways at every step.

Wings are often too weak to be seen beside the body they move. The body's own line is strong, and its phase shows a
motion of a small part of the wavelength.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .dropouts import unbroken
from .following import by_recording, followed, normed, standing
from .lines import squared
from .spectrum import SPEED_OF_LIGHT_MPS
from .wingbeat import GAIT_HZ, GAIT_MPS, LEAST_S, WING_MPS

#: Range of the rates that are reported [Hz]: from a slow walker's steps to the fastest wings.
HEAVE_RANGE_HZ = (1.6, 18.5)

#: SOUGHT_HZ: range in which the strongest line is sought [Hz], wider than HEAVE_RANGE_HZ: a strongest line below that
#: range is the skirt of a slow change of course. HIGHEST_HZ: fluctuation and multiples count up to this [Hz].
SOUGHT_HZ, HIGHEST_HZ = (1.4, 19.0), 30.0

#: Half width of the band about the body in which its phase is followed, the larger of the two: wide enough for its
#: velocity [m/s] and for the rates [Hz].
BAND_MPS, BAND_HZ = 1.5, 40.0

#: Length of the window over which turns of the phase are averaged [s]: in a deep fade a single turn is noise alone.
SMOOTH_S = 0.025

#: LEAST_DB: least level of the rate's line over the continuum [dB]. LEAST_SHARE: least share of all fluctuation in the
#: first MULTIPLES multiples of the rate, the rate itself included. On simulated tracks of 2.5 s at 0 dB and above a
#: heave is found in 0.63 of walkers and 0.53 of flapping birds; of others in 0.04 of vehicles (their parts' lines beat)
#: and 0.07 of helicopters.
LEAST_DB, LEAST_SHARE, MULTIPLES = 20.0, 0.5, 3

#: Least amplitude of the path [m]. Engines and rotors shake an airframe by tenths of a millimetre (the law of
#: `vibration_m`), wings lift a bird by some thousandths of its span, and a torso sways by a centimetre or two
#: (Inman, Human Walking, 1981).
LEAST_M = 0.5e-3

_PADDING = 8


@dataclass(frozen=True)
class Heave:
    """Periodic motion of the body in each recording of a batch; NaN where there is none.

    Parameters
    ----------
    heave_hz : ndarray of float64, shape (...)
        Rate of the motion [Hz].
    amplitude_m : ndarray of float64, shape (...)
        Amplitude of the body's path along the line of sight [m].
    walks : ndarray of bool, shape (...)
        Whether it may be the step of a walker: rate below `GAIT_HZ` and speed below `GAIT_MPS`.
    """

    heave_hz: NDArray[np.float64]
    amplitude_m: NDArray[np.float64]
    walks: NDArray[np.bool_]


def heave(iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float) -> Heave:
    """Find the rate at which the body itself goes to and fro.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Slow-time samples of one range cell; in less than 1.5 s nothing is found.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    Heave

    Raises
    ------
    ValueError
        If the samples are not complex or not finite, or the frequencies are not positive.
    """
    return Heave(*by_recording(iq, _one, carrier_hz, prf_hz))


def _one(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple[float, float, bool]:
    """The fields of `Heave` of one recording."""
    nothing = (np.nan, np.nan, False)
    iq = iq[unbroken(iq)]
    if len(iq) < LEAST_S * prf_hz or not iq.any():
        return nothing
    shown, course = followed(normed(iq), carrier_hz, prf_hz)
    speed = abs(course[0])
    if not speed <= WING_MPS:  # NaN where there is no body
        return nothing
    steady = standing(shown, course, carrier_hz, prf_hz)
    velocity, rate_hz = _velocity(steady, carrier_hz, prf_hz)
    size = fft.next_fast_len(_PADDING * len(velocity), real=True)
    taper = np.hanning(len(velocity) + 2)[1:-1]
    lines = fft.rfft(velocity * taper, size)
    power, rates = squared(lines), fft.rfftfreq(size, 1 / rate_hz)
    sought = np.flatnonzero((rates >= SOUGHT_HZ[0]) & (rates <= SOUGHT_HZ[1]))
    top = int(sought[power[sought].argmax()])
    found = float(rates[top])
    continuum = float(np.median(power[sought])) / np.log(2)
    if not HEAVE_RANGE_HZ[0] <= found <= HEAVE_RANGE_HZ[1] or power[top] < continuum * 10 ** (LEAST_DB / 10):
        return nothing
    resolved = 2 * prf_hz / len(iq)
    multiples = np.any([np.abs(rates - k * found) < resolved for k in range(1, MULTIPLES + 1)], axis=0)
    all_ = (rates >= SOUGHT_HZ[0]) & (rates <= HIGHEST_HZ)
    amplitude = 2 * float(np.sqrt(power[top])) / taper.sum() / (2 * np.pi * found)
    if power[multiples & all_].sum() < LEAST_SHARE * power[all_].sum() or amplitude < LEAST_M:
        return nothing
    return found, amplitude, found < GAIT_HZ and speed < GAIT_MPS


def _velocity(steady: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple[NDArray[np.float64], float]:
    """Velocity of the body about its course [m/s], shape (steps,), and steps a second [Hz].

    It is computed from the turn of the phase at each step. Turns are weighted by the power, up to its median: so it is
    the mean frequency of a narrow line. A cubic trend is taken out.
    """
    per_hz = SPEED_OF_LIGHT_MPS / carrier_hz / 2
    half_hz = max(BAND_HZ, BAND_MPS / per_hz)
    pulses = len(steady)
    away = np.abs(fft.fftfreq(pulses, 1 / prf_hz))
    lines = fft.fft(steady) * np.clip((1.3 - away / half_hz) / 0.3, 0, 1)
    count = min(round(4 * half_hz * pulses / prf_hz), pulses)
    few = fft.ifft(np.concatenate([lines[: count - count // 2], lines[pulses - count // 2 :]]))
    rate_hz = count * prf_hz / pulses
    turns = few[1:] * few[:-1].conj()
    size = np.abs(turns)
    turns /= np.maximum(np.maximum(size, np.median(size)), 1e-30)  # a strong step counts no more than a median one
    smooth = np.hanning(max(round(SMOOTH_S * rate_hz), 1) + 2)[1:-1]
    turns = np.convolve(turns, smooth, "same")
    velocity = np.angle(turns) * rate_hz / (2 * np.pi) * per_hz
    when = np.linspace(-1, 1, len(velocity))
    return velocity - np.polyval(np.polyfit(when, velocity, 3), when), rate_hz
