"""Radial acceleration of the body, and samples without the smear that it causes."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .dropouts import NOTHING, mended
from .inputs import in_blocks
from .lines import middle_times, squared
from .notch import parabola_offset
from .one_channel import made_analytic
from .samples import LEAST_PART, finite_complex, largest_part, require_radar, scaled, unit_scale
from .spectrum import SPEED_OF_LIGHT_MPS

#: Largest acceleration tried [m/s^2]: five times gravity. In long dwells of short waves the limit is lower: there it is
#: the acceleration that smears a line over an eighth of the unambiguous span.
MAX_MPS2 = 50.0

#: Least height of a body line over the noise, which is told from the median of the spectrum [dB].
LEAST_LINE_DB = 20.0

#: BESIDE_BINS: what lies within this many bins beside the line (blades, wings, a background) moves the line as noise of
#: that power would. LEAST_OVER_BESIDE_DB: least height of the line over that power [dB].
BESIDE_BINS, LEAST_OVER_BESIDE_DB = 6, 10.0

#: The smear is sure, and taken out, if the acceleration exceeds this many standard deviations. Even a third of a bin of
#: smear, if left in, leaves enough of strong lines to pass for a second rotor. (In front of ground, one dwell in a
#: hundred seems surely smeared, by up to half a bin, where there is no smear.)
SURE_DEVIATIONS = 5.0

#: Least height of a line about velocity zero over what lies beside it, if its smear seems sure [dB]. Ground that sways
#: in the wind smears its own line by up to ten bins: where ground is the strongest line, the smear seems sure in three
#: to eight of a hundred dwells. A hovering body 15 dB over ground stands high enough.
LEAST_OVER_BESIDE_AT_REST_DB = 22.0

#: A line about velocity zero is moved by more than shows beside it. Its standard deviation is multiplied by SWAY_FACTOR
#: where what lies beside it stands more than SWAY_DB over the noise of the span [dB]. (Of a hovering drone before
#: ground the errors were 2.7 deviations, rms.)
SWAY_FACTOR, SWAY_DB = 2.5, 6.0

#: A line smeared over n bins, more than SHOWN_STEPS, must rise by a factor n^RISE_EXPONENT when the smear is taken out;
#: else it is no line. (A single line rises by 2.4 dB from three bins, 4.2 from four and 8.8 from eleven; blades' lines
#: that coincide by chance rise by 2 to 3 dB from six to eleven.)
SHOWN_STEPS, RISE_EXPONENT = 3.2, 0.4

#: Least number of pulses that show a line's smear.
LEAST_PULSES = 32

#: PARTS, MANY_STEPS: a dwell of more than MANY_STEPS steps to each side is searched in fourths, then in halves, then as
#: a whole. The acceleration that smears a line over one bin of a part grows with the square of the number of parts, so
#: fourths need only a sixteenth of the steps. CANDIDATES: this many of the best steps are searched more closely, and
#: zero acceleration, which most targets have.
PARTS, MANY_STEPS, CANDIDATES = (4, 2, 1), 256, 8


def body_acceleration(
    iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Acceleration at which the strongest line is sharpest: the maximum-likelihood estimate for a steady echo.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Dwells over which the acceleration is steady.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    acceleration_mps2, std_mps2 : ndarray of float64, shape (...)
        Positive when the radial velocity grows; NaN where no line stands out, where the line may be that of swaying
        ground, or where more pulses were lost than can be filled in. The standard deviation is the bound of a chirp's
        rate, 90 / (SNR pulses^5) rad^2 (Peleg and Porat 1991), and `SWAY_FACTOR` times that for a line about velocity
        zero beside a background.
    smeared : ndarray of bool, shape (...)
        Whether the smear is sure (see `SURE_DEVIATIONS`), so that `without_acceleration` is of use.

    Raises
    ------
    ValueError
        If `iq` is not complex, holds no pulse or a value that is not finite, or the frequencies are not positive.
    """
    samples = finite_complex(iq)
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    pulses = samples.shape[-1]
    flat, stretches = mended(samples.reshape(-1, pulses))
    flat = made_analytic(flat)
    value, std, smeared = np.full(len(flat), np.nan), np.full(len(flat), np.nan), np.zeros(len(flat), bool)
    wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
    # one step smears a line over one bin of the dwell
    step = wavelength_m / 2 * (prf_hz / pulses) ** 2
    reach = int(min(MAX_MPS2 / step, pulses / 8)) + 1
    size = fft.next_fast_len(2 * pulses)

    def heights_at(
        steps: NDArray, dwells: NDArray[np.complex64], parts: int = 1, finer: int = 1
    ) -> NDArray[np.float32]:
        # one step at a time: a long dwell has hundreds of steps, which together would fill the memory
        values = (_sharpened(dwells, one * step, wavelength_m, prf_hz, finer * size, parts) for one in steps)
        return np.stack([value.max(axis=-1).sum(axis=-1) for value in values], axis=-1)

    first, *further = PARTS if reach > MANY_STEPS else (1,)
    tried = np.arange(-(reach // first**2), reach // first**2 + 1) * first**2
    told = largest_part(flat) >= LEAST_PART
    told[[row for (row,) in stretches]] = False
    held = np.flatnonzero(told) if pulses >= LEAST_PULSES else np.zeros(0, np.intp)
    loud = in_blocks(scaled(flat[held], unit_scale(flat[held])))
    each = (pair for block in loud for pair in zip(block, heights_at(tried, block, first), strict=True))
    for index, (one, heights) in zip(held, each, strict=True):
        steps, apart = np.append(tried[np.argsort(-heights)[:CANDIDATES]], 0), first**2
        for parts in further:
            steps = np.unique(steps[:, None] + np.arange(-apart, apart + 1, parts**2))
            steps, apart = steps[np.argsort(-heights_at(steps, one, parts))[:CANDIDATES]], parts**2
        best = int(steps[0])
        sharp, steady = (_sharpened(one, at * step, wavelength_m, prf_hz, size) for at in (best, 0))
        height = float(sharp.max())
        noise = float(np.median(sharp)) / np.log(2)
        if abs(best) >= reach or height < noise * 10 ** (LEAST_LINE_DB / 10):
            continue
        at = float(best)
        for share in (0.5, 0.1):
            left, middle, right = np.log(heights_at(at + share * np.array([-1, 0, 1]), one, finer=4))
            curve = 2 * middle - left - right
            at += share * (np.clip((right - left) / (2 * curve), -1, 1) if curve > 0 else 0.0)
        beside = _beside(one, at * step, wavelength_m, prf_hz, size)
        risen = height > float(steady.max()) * abs(at) ** RISE_EXPONENT
        if height < beside * 10 ** (LEAST_OVER_BESIDE_DB / 10) or (abs(at) > SHOWN_STEPS and not risen):
            continue
        value[index] = at * step
        # the line's height is pulses^2 A^2, the noise's pulses sigma^2
        snr = height / beside / pulses
        std[index] = np.sqrt(90 / (snr * float(pulses) ** 5)) * prf_hz**2 * wavelength_m / (2 * np.pi)
        at_rest = abs(np.fft.fftfreq(size)[int(sharp.argmax())]) * pulses < abs(at) / 2 + 1
        if at_rest and beside > noise * 10 ** (SWAY_DB / 10):
            std[index] *= SWAY_FACTOR
        smeared[index] = abs(value[index]) > SURE_DEVIATIONS * std[index]
        if smeared[index] and at_rest and height < beside * 10 ** (LEAST_OVER_BESIDE_AT_REST_DB / 10):
            value[index], std[index], smeared[index] = np.nan, np.nan, False
    for (row,), stretch in stretches.items():  # of a dwell broken by silence, the longest whole stretch is measured
        if stretch != NOTHING:
            own = body_acceleration(flat[row, stretch], carrier_hz=carrier_hz, prf_hz=prf_hz)
            value[row], std[row], smeared[row] = own
    lead = samples.shape[:-1]
    return value.reshape(lead), std.reshape(lead), smeared.reshape(lead)


def without_acceleration(
    iq: NDArray[np.complexfloating], acceleration_mps2: NDArray[np.float64], *, carrier_hz: float, prf_hz: float
) -> NDArray[np.complex64]:
    """Take a steady acceleration out: each dwell keeps the velocity of its middle.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Dwells.
    acceleration_mps2 : ndarray, shape (...)
        Acceleration to take out [m/s^2]; 0 leaves the samples as they are.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    ndarray of complex64, shape (..., pulses)

    Raises
    ------
    ValueError
        If `iq` is not complex, holds no pulse or a value that is not finite, the frequencies are not positive, or an
        acceleration is not finite or there is not one for every record.
    """
    samples = finite_complex(iq)
    carrier_hz, prf_hz = require_radar(carrier_hz, prf_hz)
    acceleration = np.asarray(acceleration_mps2, np.float64)
    if not np.isfinite(acceleration).all():
        raise ValueError(
            "acceleration_mps2 holds a value that is not finite, as `body_acceleration` gives where it finds none: "
            "put 0 there"
        )
    records = samples.shape[:-1]
    try:
        each = np.broadcast_to(acceleration, records)[..., None]
    except ValueError:
        raise ValueError(
            f"acceleration_mps2 has shape {acceleration.shape}: it must have that of the records of iq, {records}"
        ) from None
    if np.count_nonzero(each):  # turned in phase, one channel would pass for two: it is made analytic before
        samples = np.where(each != 0, made_analytic(mended(samples)[0]), samples)
    return _steadied(samples, each, SPEED_OF_LIGHT_MPS / carrier_hz, prf_hz)


def _steadied(
    samples: NDArray[np.complex64], acceleration_mps2: NDArray[np.float64], wavelength_m: float, prf_hz: float
) -> NDArray[np.complex64]:
    """Samples (..., pulses) with an acceleration taken out; the phase grows large and so is float64."""
    pulses = samples.shape[-1]
    time_s = middle_times(pulses) / prf_hz
    phase = 2 * np.pi / wavelength_m * acceleration_mps2 * time_s**2
    return np.asarray(samples * np.exp(1j * phase).astype(np.complex64))


def _beside(
    samples: NDArray[np.complex64], acceleration_mps2: float, wavelength_m: float, prf_hz: float, size: int
) -> float:
    """Power of the noise that would move the strongest line of one dwell as much as what lies beside it does.

    The acceleration and the line are taken out first. Power k bins off bends the line's phase by its component along
    the second Legendre polynomial, whose amplitude falls with 1 / k^2: the nearest bins count most. In noise all bins
    are alike. The larger of both means is returned, and at least the noise of the whole span and the rounding error of
    the line itself in single precision.
    """
    pulses = len(samples)
    steady = _steadied(samples, np.asarray(acceleration_mps2), wavelength_m, prf_hz)
    spectrum = fft.fft(steady, n=size)
    top = int(squared(spectrum).argmax())
    offset = parabola_offset(*np.log(np.abs(spectrum[np.array([top - 1, top, top + 1]) % size])))
    still = steady * np.exp(-2j * np.pi * ((top + offset) / size) * np.arange(pulses))
    half = pulses // 2
    for _ in range(2):  # the parabola is off by a hundredth of a bin, which would leave much of a strong line
        turn = np.angle(still[-half:].sum() * still[:half].sum().conj()) / (pulses - half)
        still = still * np.exp(-1j * turn * np.arange(pulses))
    rest = fft.fft(still - still.mean())
    bins = np.arange(1, BESIDE_BINS + 1)
    power = (np.abs(rest[bins]) ** 2 + np.abs(rest[-bins]) ** 2) / 2
    floor = np.median(np.abs(rest) ** 2) / np.log(2)
    rounding = np.sum(np.abs(still) ** 2) * np.finfo(np.float32).eps ** 2
    return float(max(power.mean(), np.average(power, weights=bins**-4.0), floor, rounding))


def _sharpened(
    samples: NDArray[np.complex64],
    acceleration_mps2: float,
    wavelength_m: float,
    prf_hz: float,
    size: int,
    parts: int = 1,
) -> NDArray[np.float32]:
    """Power spectra of parts of dwells (..., pulses) with an acceleration taken out, shape (..., parts, bins)."""
    steady = _steadied(samples, np.asarray(acceleration_mps2), wavelength_m, prf_hz)
    each = samples.shape[-1] // parts
    cut = steady[..., : each * parts].reshape(*samples.shape[:-1], parts, each)
    spectrum = fft.fft(cut, n=fft.next_fast_len(-(-size // parts)))
    return squared(spectrum)
