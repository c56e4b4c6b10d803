"""Strong slow lines of a record, the static background and bodies: to be taken out and to count combs from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bodies import LINE_DB, line_among, other_body, slow_body, turns_of
from ..notch import LOBE_BINS, NOTCH_MPS, Body, body_line
from ..spectrum import Spectrum

#: Noise alone seldom has a bin this strong in the notch about velocity zero; a background's skirt has [dB].
SKIRT_DB = 9.0

#: The skirt is looked for up to this many bins from rest, right beside a hovering body's lobe; further out lie the
#: first lines of rotors.
SKIRT_BINS = LOBE_BINS + 2.5

#: Half width taken out about the body line [m/s]. A body is steadier than the clutter about velocity zero.
BODY_NOTCH_MPS = 0.5

#: Largest half width taken out [bins], 3 m/s of 80 ms at 100 GHz: the sequences of a wider band fill memory.
MOST_NOTCH_BINS = 160


@dataclass(frozen=True)
class StrongLines:
    """What is strong and slow in one record.

    Parameters
    ----------
    bands : tuple of (float, float)
        Centre [cycles a sample] and half width [bins] of each band to be taken out.
    centres : tuple of float
        Possible body lines [cycles a sample], strongest first: combs are sought about these.
    centres_db : tuple of float
        Their levels over the floor [dB].
    """

    bands: tuple[tuple[float, float], ...]
    centres: tuple[float, ...]
    centres_db: tuple[float, ...]

    @property
    def lines(self) -> tuple[tuple[float, float], ...]:
        """Each line's place [cycles a sample] and level [dB]."""
        return tuple(zip(self.centres, self.centres_db, strict=True))


def strong_lines(spectrum: Spectrum) -> StrongLines:
    """Find the background at rest and the lines that may be a body's."""
    body, pulses = body_line(spectrum), spectrum.pulses
    rest_half = _half_bins(spectrum, NOTCH_MPS)
    offset = np.abs(spectrum.frequency_hz) * pulses / spectrum.prf_hz
    middle = spectrum.bins // 2
    rest_db = float(spectrum.level_db[middle - 1 : middle + 2].max())
    background = rest_db > LINE_DB and not _hovers(spectrum, body, offset, rest_half)
    centres = [_seen(spectrum, body)]
    if background:
        # what stands at rest may be the background; the body is then the strongest line that moves
        line = body
        # the strongest line of all is kept as the one at rest if it is that slow; else it is the one that moves
        if abs(turns_of(spectrum, body)) * pulses <= rest_half:
            line = line_among(spectrum, offset > rest_half + 2 * spectrum.window.noise_bandwidth_bins, [0.0])
        else:
            centres = [(0.0, rest_db)]
        if line.level_db > LINE_DB:
            centres.append(_seen(spectrum, line))
    other = other_body(spectrum, [turn for turn, _ in centres], max(rest_half if background else 0.0, LOBE_BINS))
    if other is not None:
        centres.append(_seen(spectrum, other))
    hidden = slow_body(spectrum, [turn for turn, _ in centres], offset <= rest_half) if background else None
    if hidden is not None:
        centres.append(_seen(spectrum, hidden))
    centres.sort(key=lambda centre: -centre[1])
    bodies = [
        (turn, _half_bins(spectrum, BODY_NOTCH_MPS))
        for turn, level_db in centres
        if level_db > LINE_DB and (abs(turn) * pulses > rest_half or not background)
    ]
    bands = ((0.0, rest_half), *bodies) if background else tuple(bodies)
    return StrongLines(bands, tuple(turn for turn, _ in centres), tuple(level_db for _, level_db in centres))


def _seen(spectrum: Spectrum, line: Body) -> tuple[float, float]:
    """Place [cycles a sample] and level [dB] of a line."""
    return turns_of(spectrum, line), float(line.level_db)


def _half_bins(spectrum: Spectrum, half_mps: float) -> float:
    """Half width of a band to be taken out [bins], rounded up to half a bin."""
    bin_mps = spectrum.prf_hz / spectrum.pulses * spectrum.wavelength_m / 2
    widest = min(spectrum.pulses / 16, MOST_NOTCH_BINS)  # a slow radar must keep something to look at
    return float(np.ceil(2 * min(max(half_mps / bin_mps, 1.0), widest)) / 2)


def _hovers(spectrum: Spectrum, body: Body, offset: NDArray[np.float64], rest_half: float) -> bool:
    """Whether the only strong line is at rest and has no skirt: a body that hovers, not a background.

    Parameters
    ----------
    spectrum, body
        The record and its strongest line.
    offset : ndarray, shape (bins,)
        Distance of each bin from velocity zero [bins].
    rest_half : float
        Half width of the band that would be taken out at rest [bins].
    """
    # a skirt falls with the offset: what stands only further out is a rotor's line
    skirt = (offset <= min(rest_half, SKIRT_BINS)) & (np.abs(np.arange(spectrum.bins) - body.index) > LOBE_BINS + 1)
    return (
        abs(turns_of(spectrum, body)) * spectrum.pulses <= rest_half
        and 2 * rest_half > 3 * LOBE_BINS
        and float(spectrum.level_db[skirt].max()) < SKIRT_DB
        and float(spectrum.level_db[offset > rest_half].max()) < LINE_DB
    )
