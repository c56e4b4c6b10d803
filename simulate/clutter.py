"""Clutter as a random process: wind-blown ground, rain, sea, and plain noise.

Each is a Gaussian process with a given Doppler spectrum, made by shaping white noise in the frequency domain; the sea
carries a slow gamma texture on top (K distribution).
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft, special

from .laws import LAWS, Draws
from .motion import GRAVITY_MPS2, TWO_PI
from .radar import Radar
from .target import Normals, Target

#: Share of the ground that moves by a Gaussian law: where `ground_law` is below this.
GAUSSIAN_GROUND = 0.35

#: Rms width of a Bragg line [m/s].
BRAGG_WIDTH_MPS = 0.1

#: Surface tension of sea water over its density (0.0728 N/m over 1000 kg/m^3 within 3 %).
_TENSION_M3_PER_S2 = 7.3e-5


def billingsley(wind_mph: ArrayLike, carrier_hz: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Billingsley's spectrum of wind-blown ground: P(v) = a/(a+1) delta(v) + 1/(a+1) (b/2) exp(-b |v|).

    Parameters
    ----------
    wind_mph : array_like
        Wind speed [mph], > 0.
    carrier_hz : float
        Carrier [Hz].

    Returns
    -------
    dc_ratio : ndarray
        a, power at rest over moving power [1].
    shape_s_per_m : ndarray
        b, decay of the moving part [s/m].

    References
    ----------
    Billingsley, "Low-Angle Radar Land Clutter" (2002): a = 489.8 w^-1.55 f^-1.21, 1/b = 0.1048 (log10 w + 0.4147).
    """
    wind = np.asarray(wind_mph, np.float64)
    a = 489.8 * wind**-1.55 * (carrier_hz / 1e9) ** -1.21
    return a, 1 / (0.1048 * (np.log10(wind) + 0.4147))


def shaped_noise(
    normals: Normals, radar: Radar, velocity_psd: NDArray[np.floating], velocities_mps: NDArray[np.float64]
) -> NDArray[np.complex64]:
    """Complex Gaussian process of unit power with a given velocity spectrum.

    Parameters
    ----------
    normals : callable
        Source of standard normal numbers, one row a record.
    radar : Radar
        The radar that looks; all lines lie within its unambiguous span.
    velocity_psd : ndarray, shape (records, lines) or (1, lines)
        Power at each of `velocities_mps`, any scale; there is none at other velocities.
    velocities_mps : ndarray, shape (lines,)
        Velocities of the lines in FFT order: all of `process_velocities`, or only the slow ones, which are at both ends
        of that order (`slow_velocities`).

    Returns
    -------
    ndarray of complex64, shape (records, pulses)
    """
    lines, whole = len(velocities_mps), fft.next_fast_len(2 * radar.pulses)
    amplitude = _amplitude(velocity_psd)
    white = normals(2 * lines)
    out = np.empty((len(white), radar.pulses), np.complex64)
    spectrum, positive = np.zeros(whole, np.complex64), (lines + 1) // 2
    ends = ((spectrum[:positive], slice(0, positive)), (spectrum[whole - lines + positive :], slice(positive, lines)))
    for row in range(len(white)):  # row by row: the bits of a record must not depend on its batch
        weight = amplitude[row if len(amplitude) > 1 else 0]
        for end, some in ends:
            np.multiply(white[row, :lines][some], weight[some], out=end.real)
            np.multiply(white[row, lines:][some], weight[some], out=end.imag)
        out[row] = fft.ifft(spectrum, norm="forward")[: radar.pulses]
    return out


def real_noise(normals: Normals, radar: Radar, psd: NDArray[np.floating]) -> NDArray[np.float32]:
    """Real Gaussian process of unit power whose spectrum is the same for all records.

    Parameters
    ----------
    normals : callable
        Source of standard normal numbers, one row a record.
    radar : Radar
        The radar that looks.
    psd : ndarray, shape (lines,)
        Power at the lines of one side of the spectrum: the first half of `process_velocities`, from rest on.

    Returns
    -------
    ndarray of float32, shape (records, pulses)
    """
    whole, lines = fft.next_fast_len(2 * radar.pulses), len(psd)
    amplitude = _amplitude(psd[None, :])[0] / np.float32(np.sqrt(2))
    white = normals(2 * lines)
    out = np.empty((len(white), radar.pulses), np.float32)
    spectrum = np.empty(lines, np.complex64)
    for row in range(len(white)):
        np.multiply(white[row, :lines], amplitude, out=spectrum.real)
        np.multiply(white[row, lines:], amplitude, out=spectrum.imag)
        out[row] = fft.irfft(spectrum, n=whole, norm="forward")[: radar.pulses]
    return out


def _amplitude(psd: NDArray[np.floating]) -> NDArray[np.float32]:
    """Amplitude of the real and of the imaginary part of each line, for unit total power, shape of `psd`."""
    total = psd.sum(axis=-1, keepdims=True)
    return np.sqrt(psd / np.where(total > 0, total, 1) / 2).astype(np.float32)


def process_velocities(radar: Radar) -> NDArray[np.float64]:
    """Velocities of a noise process's lines [m/s], FFT order.

    The process is periodic; its period is at least two dwells, so that the end of a record does not join its beginning.
    """
    lines = fft.next_fast_len(2 * radar.pulses)
    return -fft.fftfreq(lines, 1 / radar.prf_hz) * radar.wavelength_m / 2


#: Share of the moving ground's power that may be left out beyond the fastest line: far under any receiver's noise.
_BEYOND = 1e-12


def slow_velocities(radar: Radar, wind_mph: float) -> NDArray[np.float64]:
    """The lines of `process_velocities` that hold the power of ground in winds up to `wind_mph`, FFT order."""
    v = process_velocities(radar)
    step = np.abs(v[1]) if len(v) > 1 else 1.0
    fastest = -np.log(_BEYOND) / billingsley(wind_mph, radar.carrier_hz)[1] / step
    if 2 * fastest + 3 > len(v):
        return v
    each = math.ceil(fastest)
    return np.concatenate([v[: each + 1], v[-each:]])


def ground_psd(
    radar: Radar, wind_mph: NDArray[np.float64], velocities_mps: NDArray[np.float64]
) -> tuple[NDArray, NDArray]:
    """Moving part of wind-blown ground, shape (records, lines), and the share of power at rest, shape (records,)."""
    a, b = billingsley(wind_mph, radar.carrier_hz)
    v = velocities_mps
    b = np.asarray(b)[:, None]
    # Integral of exp(-b|v|) over each line's width: right also where the width of a line exceeds 1/b.
    width = np.abs(v[1]) if len(v) > 1 else 1.0
    edge = np.abs(v)[None, :]
    over_line = 2 * np.sinh(np.minimum(b * width / 2, 300))
    psd = np.where(edge == 0, 2 * (1 - np.exp(-b * width / 2)), np.exp(-b * edge) * over_line)
    # velocities beyond the unambiguous span fold back into it: a geometric series to each side
    span = 2 * radar.unambiguous_mps
    psd += (np.exp(-b * (span - edge)) + np.exp(-b * (span + edge))) / -np.expm1(-b * span) * over_line
    return psd, a / (a + 1)


def gaussian_ground(draws: Draws) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Draw in which records the ground moves by a Gaussian law, as in models older than Billingsley's.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.

    Returns
    -------
    width_mps : ndarray, shape (records,)
        Its rms velocity [m/s]; NaN where the ground moves by Billingsley's law.
    rest : ndarray, shape (records,)
        Share of the power that stands still.

    References
    ----------
    Barlow, "Doppler radar" (Proc. IRE 37, 1949); Skolnik, Introduction to Radar Systems, ch. 3.
    """
    gaussian = draws.value("ground_law") < GAUSSIAN_GROUND
    still = 10 ** (draws.value("ground_still_db") / 10)
    return np.where(gaussian, draws.value("ground_width_mps"), np.nan), still / (still + 1)


def draw_ground(
    normals: Normals,
    radar: Radar,
    wind_mph: NDArray[np.float64],
    phase_rad: NDArray,
    gaussian: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> NDArray[np.complex64]:
    """Wind-blown ground of unit mean power, shape (records, pulses); `gaussian` as `gaussian_ground` gives it."""
    # as many lines as the law's strongest wind needs, so that a record takes as many random numbers in any batch
    v = slow_velocities(radar, max(LAWS["wind_mph"].high, float(np.max(wind_mph, initial=0.0))))
    psd, rest = ground_psd(radar, wind_mph, v)
    if gaussian is not None:
        rows = np.flatnonzero(np.isfinite(gaussian[0]))
        psd[rows] = _gaussian(v, np.zeros(len(rows)), gaussian[0][rows], radar)
        rest = rest.copy()
        rest[rows] = gaussian[1][rows]
    moving = shaped_noise(normals, radar, psd, v)
    still = (np.sqrt(rest) * np.exp(1j * phase_rad)).astype(np.complex64)
    return still[:, None] + np.sqrt(1 - rest).astype(np.float32)[:, None] * moving


def draw_clutter(draws: Draws, radar: Radar, kind: str, normals: Normals) -> Target:
    """Draw and render a batch of one kind of distributed clutter.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.
    kind : {"ground", "rain", "sea", "noise"}
        The clutter; "noise" is an empty cell.
    normals : callable
        Source of standard normal numbers, one row a record.

    Returns
    -------
    Target
        `micro` is the whole process; for "noise" it is zero and its SNR has no meaning.
    """
    if kind == "noise":
        return Target(np.zeros((len(draws), radar.pulses), np.complex64), snr_law="clutter_snr_db")
    v = process_velocities(radar)
    if kind == "ground":
        wind = draws.value("wind_mph")
        phase, gaussian = draws.value("phase_rad"), gaussian_ground(draws)
        iq = draw_ground(normals, radar, wind, phase, gaussian)
        blown = np.where(np.isnan(gaussian[0]), wind, np.nan)
        return Target(iq, snr_law="clutter_snr_db", truth={"wind_mph": blown, "width_mps": gaussian[0]})
    if kind == "rain":
        mean, width = draws.value("rain_velocity_mps"), draws.value("rain_width_mps")
        iq = shaped_noise(normals, radar, _gaussian(v, mean, width, radar), v)
        return Target(iq, snr_law="clutter_snr_db", truth={"velocity_mps": mean, "width_mps": width})
    mean, width = draws.value("sea_velocity_mps"), draws.value("sea_width_mps")
    psd = _gaussian(v, mean, width, radar)
    # The Bragg lines of receding and advancing ripples, and a burst of fast scatterers from a breaking wave.
    for speed in bragg_mps(radar.wavelength_m) * np.array([1, -1]):
        line = _gaussian(v, np.full(len(draws), speed), np.full(len(draws), BRAGG_WIDTH_MPS), radar)
        psd = psd + 0.3 * draws.uniform()[:, None] * line
    breaking = np.where(draws.chance(0.35), draws.uniform(), 0.0)
    psd = psd + breaking[:, None] * _gaussian(v, mean * (1 + 2 * draws.uniform()), 2 * width, radar)
    shape = draws.value("texture_shape")
    iq = shaped_noise(normals, radar, psd, v) * _texture(draws, radar, shape)
    return Target(
        iq, snr_law="clutter_snr_db", truth={"velocity_mps": mean, "width_mps": width, "texture_shape": shape}
    )


def bragg_mps(wavelength_m: float) -> float:
    """Phase speed of the ripple of half the wavelength, which scatters back in phase, on deep water [m/s].

    Its squared frequency is g k + (surface tension over density) k^3 (Lamb, Hydrodynamics, art. 267): above 10 GHz the
    tension drives it, and the speed rises again.

    Parameters
    ----------
    wavelength_m : float
        Wavelength of the radar [m], > 0.
    """
    k = 4 * np.pi / wavelength_m
    return math.sqrt(GRAVITY_MPS2 / k + _TENSION_M3_PER_S2 * k)


def _gaussian(
    v: NDArray[np.float64], mean_mps: NDArray[np.float64], width_mps: NDArray[np.float64], radar: Radar
) -> NDArray[np.floating]:
    """Gaussian velocity spectrum wrapped onto the unambiguous span, shape (records, lines), unit sum."""
    span = 2 * radar.unambiguous_mps
    away = v[None, :] - mean_mps[:, None]
    away -= span * np.rint(away / span)
    step = np.abs(v[1]) if len(v) > 1 else span
    width = np.maximum(width_mps, step / 2)[:, None]  # never thinner than a line
    away /= width
    psd = np.exp(np.float32(-0.5) * np.square(away.astype(np.float32)))
    return psd / psd.sum(axis=-1, keepdims=True)


#: Sinusoids that make up the slow Gaussian behind a texture.
_SWELLS = 4


def _texture(draws: Draws, radar: Radar, shape: NDArray[np.float64]) -> NDArray[np.float32]:
    """Slow modulation of the sea's amplitude by a gamma texture, which makes the intensity K-distributed.

    A Gaussian of a few slow sinusoids (decorrelation 0.1 to 1 s, so a slope or a swell within a dwell) is mapped to the
    gamma law of unit mean and shape nu: a memoryless transform keeps the law exact at every instant.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.
    shape : ndarray, shape (records,)
        Shape nu of the texture [1]; its variance is 1 / nu.

    Returns
    -------
    ndarray of float32, shape (records, pulses)
        Amplitude, the root of the texture.

    References
    ----------
    Ward, Tough and Watts, "Sea Clutter: Scattering, the K Distribution and Radar Performance" (2006), ch. 5.
    """
    rate_hz = draws.value("texture_hz", _SWELLS)
    weights = draws.normal(2 * _SWELLS) / np.sqrt(_SWELLS)
    # The swells are slow: computed at 40 points a period of the fastest, and interpolated to the pulses.
    fastest_hz = max(LAWS["texture_hz"].high, float(rate_hz.max(initial=0)))
    points = max(33, math.ceil(40 * fastest_hz * radar.dwell_s))
    coarse_s = np.linspace(0, radar.dwell_s, points)
    turns = TWO_PI * rate_hz[:, :, None] * coarse_s
    gaussian = (weights[:, :_SWELLS, None] * np.cos(turns) + weights[:, _SWELLS:, None] * np.sin(turns)).sum(axis=1)
    texture = special.gammaincinv(shape[:, None], special.ndtr(gaussian)) / shape[:, None]
    amplitude = np.sqrt(texture)
    return np.stack([np.interp(radar.times_s, coarse_s, row) for row in amplitude]).astype(np.float32)
