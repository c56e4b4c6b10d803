"""Lines of bodies beside the strongest one of a spectrum: what hides in the flank or the skirt of another."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .lines import from_whole
from .notch import LOBE_BINS, Body, body_line
from .spectrum import Spectrum

#: A line counts as present from this level over the floor [dB]. Noise alone stays 3 dB and more below it: the highest
#: bin of 10 000 spectra stood at 13 dB.
LINE_DB = 17.0

#: A second body's line stands so far over all others but the first one's [dB]: a bird's beside a drone, or a drone's.
OTHER_OVER_DB = 8.0

#: A slow body's line stands so far over all that lies across velocity zero, within so many bins [dB]: of two places in
#: a background's skirt one is 13 dB over the other once in twenty times.
ACROSS_DB, ACROSS_BINS = 13.0, 1


def within(size: int, centre: float, half: float) -> NDArray[np.bool_]:
    """True in the bins of a spectrum in FFT order so near to a place [cycles a sample]."""
    return np.asarray(np.abs(from_whole(np.arange(size) / size - centre)) <= half)


def turns_of(spectrum: Spectrum, line: Body) -> float:
    """Frequency of a line [cycles a sample]."""
    return float(-2 * line.velocity_mps / spectrum.wavelength_m / spectrum.prf_hz)


def tops(levels: NDArray[np.floating]) -> NDArray[np.bool_]:
    """True in the bins no lower than both beside them, around the circle."""
    return np.asarray((levels >= np.roll(levels, 1)) & (levels >= np.roll(levels, -1)))


def _strongest(spectrum: Spectrum, where: NDArray[np.bool_]) -> Body:
    """The strongest line where this is True."""
    return body_line(replace(spectrum, relative_power=np.where(where, spectrum.relative_power, np.float32(0))))


def line_among(spectrum: Spectrum, where: NDArray[np.bool_], known: list[float]) -> Body:
    """The strongest line of a part of the spectrum, whole where only its flank lies there.

    Parameters
    ----------
    spectrum : Spectrum
        Of one record.
    where : ndarray of bool, shape (bins,)
        True where it is looked for.
    known : list of float
        Lines whose flanks are no other's [cycles a sample].
    """
    power, place = spectrum.relative_power, np.arange(spectrum.bins)
    first = top = int(_strongest(spectrum, where).index)
    while power[(top + 1) % len(power)] > power[top]:
        top = (top + 1) % len(power)
    while power[top - 1] > power[top]:
        top = (top - 1) % len(power)
    away = np.rint(np.abs(from_whole((place - top) / spectrum.bins)) * spectrum.bins)
    own = away <= LOBE_BINS + 1
    known_bins = (np.rint(np.array(known) * spectrum.bins).astype(np.intp) + spectrum.bins // 2) % spectrum.bins
    # with both bins beside it, wherever it is looked for
    return _strongest(spectrum, where & ~own if top != first and own[known_bins].any() else away <= 1)


def _beside(spectrum: Spectrum, lines: list[float], half_bins: float) -> NDArray[np.bool_]:
    """True in the bins further than so much from all these lines [cycles a sample]."""
    near = [within(spectrum.bins, line, half_bins / spectrum.pulses) for line in lines]
    return np.asarray(~fft.fftshift(np.logical_or.reduce(near)))


def other_body(spectrum: Spectrum, known: list[float], half_bins: float) -> Body | None:
    """A line that stands out of all others beside these [cycles a sample], each with so much about it: another body."""
    left = _beside(spectrum, known, half_bins)
    line = line_among(spectrum, left, known)
    left &= _beside(spectrum, [turns_of(spectrum, line)], half_bins)
    highest = float(spectrum.relative_power[left].max(initial=1.0))
    over_db = float(line.level_db) - 10 * float(np.log10(highest))
    return line if line.level_db > LINE_DB and over_db > OTHER_OVER_DB else None


def slow_body(spectrum: Spectrum, known: list[float], rest: NDArray[np.bool_]) -> Body | None:
    """A line near velocity zero that is no background's: nothing is as strong on the other side.

    Parameters
    ----------
    spectrum : Spectrum
        Of one record.
    known : list of float
        Lines that are known [cycles a sample].
    rest : ndarray of bool, shape (bins,)
        True in what is taken out about velocity zero: there it is looked for.
    """
    from scipy.ndimage import maximum_filter1d  # here, because predicting needs no such import

    level_db, place = spectrum.level_db, np.arange(spectrum.bins)
    apart = _beside(spectrum, [0.0, *known], LOBE_BINS)
    across_db = maximum_filter1d(level_db[2 * (spectrum.bins // 2) - place - spectrum.bins], 2 * ACROSS_BINS + 1)
    over_db = np.where(rest & apart & tops(level_db), level_db - across_db, -np.inf)
    top = int(over_db.argmax())
    least_db = max(float(level_db[apart & ~rest].max(initial=-np.inf)) + OTHER_OVER_DB, LINE_DB)
    if over_db[top] < ACROSS_DB or level_db[top] < least_db:
        return None
    return _strongest(spectrum, np.abs(place - top) <= 1)
