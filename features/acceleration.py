"""Radial acceleration of the body, and samples without the smear that it causes."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .spectrum import LEAST_PART, SPEED_OF_LIGHT_MPS

#: Accelerations that are tried [m/s^2]: five times gravity.
MAX_MPS2 = 50.0

#: A body line must stand so high over the median of the spectrum [dB].
LEAST_LINE_DB = 20.0

#: The smear is taken out where it is over a bin, sure by so many standard deviations, and the line rises so much [dB].
SURE_DEVIATIONS, LEAST_RISE_DB = 5.0, 2.0


def body_acceleration(
    iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Acceleration at which the strongest line is sharpest: its maximum likelihood for a steady echo.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Dwells over which the acceleration is steady.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    acceleration_mps2, std_mps2 : ndarray of float64, shape (...)
        Positive when the radial velocity grows; NaN where no line stands out. The deviation is the bound of a chirp's
        rate, 90 / (SNR pulses^5) rad^2 (Peleg and Porat 1991).
    smeared : ndarray of bool, shape (...)
        Whether the line is smeared for sure, so that `without_acceleration` is of use.
    """
    samples = np.asarray(iq, np.complex64)
    pulses = samples.shape[-1]
    lead = samples.shape[:-1]
    value, std, smeared = np.full(lead, np.nan), np.full(lead, np.nan), np.zeros(lead, bool)
    wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
    # one step smears a line over one bin of the dwell
    step = wavelength_m / 2 * (prf_hz / pulses) ** 2
    reach = int(min(MAX_MPS2 / step, pulses / 8)) + 1
    if pulses < 32:
        return value, std, smeared
    tried = np.arange(-reach, reach + 1) * step
    size = fft.next_fast_len(2 * pulses)
    rates = np.exp(1j * _phase_rad(tried[:, None], pulses, wavelength_m, prf_hz)).astype(np.complex64)
    for index in np.ndindex(lead):
        scale = np.abs(samples[index]).max()
        if scale < LEAST_PART:
            continue
        one = samples[index] / scale
        heights = np.array([_power(one * turn, size).max() for turn in rates])
        best = int(heights.argmax())
        sharp = _power(one * rates[best], size)
        noise = float(np.median(sharp)) / np.log(2)
        if best in (0, 2 * reach) or heights[best] < noise * 10 ** (LEAST_LINE_DB / 10):
            continue
        at = tried[best]
        for finer in (0.5, 0.1):
            near = at + finer * step * np.array([-1, 0, 1])
            turns = np.exp(1j * _phase_rad(near[:, None], pulses, wavelength_m, prf_hz)).astype(np.complex64)
            left, middle, right = np.log([_power(one * turn, 4 * size).max() for turn in turns])
            curve = 2 * middle - left - right
            at += finer * step * (np.clip((right - left) / (2 * curve), -1, 1) if curve > 0 else 0.0)
        value[index] = at
        # the line's height is pulses^2 A^2, the noise's pulses sigma^2
        snr = heights[best] / noise / pulses
        std[index] = np.sqrt(90 / (snr * float(pulses) ** 5)) * prf_hz**2 * wavelength_m / (2 * np.pi)
        rise = heights[best] / heights[reach]
        smeared[index] = abs(at) > max(step, SURE_DEVIATIONS * std[index]) and rise > 10 ** (LEAST_RISE_DB / 10)
    return value, std, smeared


def without_acceleration(
    iq: NDArray[np.complexfloating], acceleration_mps2: NDArray[np.float64], *, carrier_hz: float, prf_hz: float
) -> NDArray[np.complex64]:
    """Take a steady acceleration out: each dwell keeps the velocity of its middle.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Dwells.
    acceleration_mps2 : ndarray, shape (...)
        What to take out [m/s^2]; 0 leaves the samples as they are.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    ndarray of complex64, shape (..., pulses)
    """
    samples = np.asarray(iq, np.complex64)
    acceleration = np.asarray(acceleration_mps2, np.float64)[..., None]
    phase = _phase_rad(acceleration, samples.shape[-1], SPEED_OF_LIGHT_MPS / carrier_hz, prf_hz)
    return samples * np.exp(1j * phase).astype(np.complex64)


def _phase_rad(acceleration: NDArray[np.float64], pulses: int, wavelength_m: float, prf_hz: float) -> NDArray:
    time_s = (np.arange(pulses) - (pulses - 1) / 2) / prf_hz
    return np.asarray(2 * np.pi / wavelength_m * acceleration * time_s**2)


def _power(samples: NDArray[np.complex64], size: int) -> NDArray[np.float32]:
    spectrum = fft.fft(samples, n=size)
    return np.asarray(spectrum.real**2 + spectrum.imag**2)
