"""Lines of further bodies beside the strongest line of a spectrum, also in its flank or in a background's skirt."""

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

#: A second body's line stands more than this over all lines that are not known [dB]: that of a bird beside a drone, or
#: of another drone.
OTHER_OVER_DB = 8.0

#: A slow body's line stands at least ACROSS_DB [dB] over the level at the opposite velocity, the highest within
#: ACROSS_BINS of that place. Of two places in a background's skirt one is 13 dB over the other once in twenty times.
ACROSS_DB, ACROSS_BINS = 13.0, 1


def within(size: int, centre: float, half: float) -> NDArray[np.bool_]:
    """True in the bins of a spectrum in FFT order that are within `half` of `centre` [cycles a sample]."""
    return np.asarray(np.abs(from_whole(np.arange(size) / size - centre)) <= half)


def turns_of(spectrum: Spectrum, line: Body) -> float:
    """Frequency of a line [cycles a sample]."""
    return float(-2 * line.velocity_mps / spectrum.wavelength_m / spectrum.prf_hz)


def tops(levels: NDArray[np.floating]) -> NDArray[np.bool_]:
    """True in the bins that are no lower than either neighbour, around the circle."""
    return np.asarray((levels >= np.roll(levels, 1)) & (levels >= np.roll(levels, -1)))


def _strongest(spectrum: Spectrum, where: NDArray[np.bool_]) -> Body:
    """The strongest line among the bins where `where` is True."""
    return body_line(replace(spectrum, relative_power=np.where(where, spectrum.relative_power, np.float32(0))))


def line_among(spectrum: Spectrum, where: NDArray[np.bool_], known: list[float]) -> Body:
    """The strongest line that reaches into a part of the spectrum; its top may lie outside.

    Parameters
    ----------
    spectrum : Spectrum
        Of one record.
    where : ndarray of bool, shape (bins,)
        True in the part in which the line is looked for.
    known : list of float
        Known lines, whose flanks are no lines of their own [cycles a sample].
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
    # the top counts with both bins beside it, also outside `where`
    return _strongest(spectrum, where & ~own if top != first and own[known_bins].any() else away <= 1)


def _beside(spectrum: Spectrum, lines: list[float], half_bins: float) -> NDArray[np.bool_]:
    """True in the bins further than `half_bins` from each of the lines [cycles a sample]."""
    near = [within(spectrum.bins, line, half_bins / spectrum.pulses) for line in lines]
    return np.asarray(~fft.fftshift(np.logical_or.reduce(near)))


def other_body(spectrum: Spectrum, known: list[float], half_bins: float) -> Body | None:
    """Another body's line, which stands out of all others; None where there is none.

    Not looked at is what lies within `half_bins` of the lines `known` [cycles a sample].
    """
    left = _beside(spectrum, known, half_bins)
    line = line_among(spectrum, left, known)
    left &= _beside(spectrum, [turns_of(spectrum, line)], half_bins)
    highest = float(spectrum.relative_power[left].max(initial=1.0))
    over_db = float(line.level_db) - 10 * float(np.log10(highest))
    return line if line.level_db > LINE_DB and over_db > OTHER_OVER_DB else None


def slow_body(spectrum: Spectrum, known: list[float], rest: NDArray[np.bool_]) -> Body | None:
    """A line near velocity zero that is no background's, as nothing is as strong on the other side; None if none is.

    Parameters
    ----------
    spectrum : Spectrum
        Of one record.
    known : list of float
        Lines that are known [cycles a sample].
    rest : ndarray of bool, shape (bins,)
        True in the band taken out about velocity zero, in which the line is looked for.
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
