"""Whether blades still flash past the edge of their lines: the lines then fill the span and have no edge in it.

Noise, a background and leakage of strong lines have no rhythm. Lines of tips several times faster than the unambiguous
velocity fold all over the span: between resolved lines they pass for noise, but pulse with the blades.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from ..lines import from_whole, squared
from ..reasons import TOLD_NO_FURTHER
from .comb_fit import CombFit
from .periodogram import PADDING, Periodogram
from .slow_lines import remove_bands

#: Past the edge: further out by EDGE_DEVIATIONS of its standard deviations and ROLL_OFF widths of its roll-off,
#: Gamma^(1/3) orders; and in any case all from LAST on [cycles a sample], the last of the span.
EDGE_DEVIATIONS, ROLL_OFF, LAST = 3.0, 1.0, 0.46

#: Least bins past the edge, and within it.
LEAST_BINS = 50

#: Step of the flash rates tried [bins].
RATE_BINS = 0.25

#: Up to HARMONICS harmonics of the flash rate are summed, at frequencies up to HIGHEST [cycles a sample]; none by which
#: the band, if shifted, overlaps itself by less than LEAST_OVER: little of it beats there.
HARMONICS, HIGHEST, LEAST_OVER = 8, 0.25, 0.1

#: Power past the edge flashes if noise does as much less than once in exp(LEAST_NATS) records, and the flashing part
#: exceeds LEAST_SHARE of the power within the edge. Of 169 tips reported at 0.3 to 1 times the unambiguous velocity, at
#: 0 to 20 dB, those of a share over 0.02 had 6.9 nats at most, those over 0.1 had 5.2. Of tips 1.8 to 3 times as fast
#: as that, which had passed for 0.2 to 0.8 times, all had 6.9 and more, most over 20, and shares of 0.13 up.
LEAST_NATS, LEAST_SHARE = 6.0, 0.1


@dataclass(frozen=True)
class PastEdge:
    """What lies past the edge of a line family.

    Parameters
    ----------
    seen : bool
        Whether enough of the span lies there, and within the edge, to tell.
    flashes : bool
        Whether its power flashes as the rotors do.
    """

    seen: bool
    flashes: bool


def past_edge_of(
    data: Periodogram,
    samples: NDArray[np.complexfloating],
    centre: float,
    rates: Sequence[float],
    spread: float,
    edge: tuple[float, float],
) -> PastEdge:
    """What lies past the edge of rotors' lines; nothing is seen in one channel or if the edge is past the span.

    Parameters
    ----------
    data, samples, centre, edge
        As in `past_edge`.
    rates : sequence of float
        Known rates [cycles a sample].
    spread : float
        How far from these others may lie [cycles a sample].
    """
    if data.one_channel or not 0 < edge[0] < 0.5:
        return PastEdge(seen=False, flashes=False)
    least = 1 / data.pulses
    around = max(spread, least)
    tried = np.arange(max(min(rates) - around, least), max(rates) + around, RATE_BINS * least)
    return past_edge(data, samples, centre, np.append(rates, tried), edge)


def unseen_tip_reason(data: Periodogram, fit: CombFit, edge: float, edge_std: float = 0.0) -> str:
    """Why a comb whose lines seem to end at an edge [cycles a sample] may reach further; empty where they end there."""
    if not past_edge_of(data, data.samples, fit.centre, [fit.spacing], 0.0, (edge, edge_std)).flashes:
        return ""
    return f"{TOLD_NO_FURTHER} to {edge * data.span_mps:.1f} m/s, and blades flash past that: raise the PRF"


def past_edge(
    data: Periodogram,
    samples: NDArray[np.complexfloating],
    centre: float,
    rates: NDArray[np.float64],
    edge: tuple[float, float],
) -> PastEdge:
    """What lies past the edge of a line family about a body.

    Parameters
    ----------
    data : Periodogram
        The record.
    samples : ndarray of complex, shape (pulses,)
        Its samples, any unit, if possible before clicks are cut out: cutting out flashes as clicks makes noise pulse
        too.
    centre : float
        Centre of the family [cycles a sample].
    rates : ndarray, shape (rates,)
        Flash rates tried, as finely as the dwell resolves them [cycles a sample].
    edge : (float, float)
        The edge and its standard deviation [cycles a sample from the centre].
    """
    frequency = fft.fftfreq(data.pulses)
    away = np.abs(from_whole(np.abs(frequency - centre)))
    usable, spacing = data.usable(frequency), float(rates.mean())
    end = edge[0] + EDGE_DEVIATIONS * edge[1] + ROLL_OFF * spacing * max(edge[0] / spacing, 1.0) ** (1 / 3)
    past = usable & (away > max(edge[0], min(end, LAST)))
    within = usable & (away < edge[0])
    if min(past.sum(), within.sum()) < LEAST_BINS:
        return PastEdge(seen=False, flashes=False)
    spectrum = fft.fft(remove_bands(samples.astype(np.complex128), data.strong.bands))
    power = squared(spectrum)
    level = np.where(past, data.level_at(frequency), 0.0)
    nats, depth = _rhythm(fft.ifft(np.where(past, spectrum, 0.0)), level, rates)
    share = depth * float(power[past].mean()) / max(float(power[within].mean()), 1e-300)
    return PastEdge(seen=True, flashes=nats > LEAST_NATS and share > LEAST_SHARE)


def _rhythm(
    samples: NDArray[np.complex128], level: NDArray[np.float64], rates: NDArray[np.float64]
) -> tuple[float, float]:
    """How clearly, and how deeply, the power of samples pulses, at the one of some rates where it does most.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Of a band alone.
    level : ndarray, shape (pulses,)
        Noise of that band, in FFT order, any unit.
    rates : ndarray, shape (rates,)
        [cycles a sample].

    Returns
    -------
    nats : float
        The logarithm of the odds against noise of this band pulsing as much at any of the rates.
    depth : float
        Root of the power of all harmonics, less noise, over that of the mean.
    """
    pulses, size = len(samples), fft.next_fast_len(PADDING * len(samples), real=True)
    window = np.hanning(pulses)
    power = squared(samples)
    lines = squared(fft.rfft((power - power.mean()) * window, size)) / max(float((power * window).sum()) ** 2, 1e-300)
    # noise beats with itself where the band overlaps its own shifted copy
    over = np.abs(fft.ifft(squared(fft.fft(level)))) / float(level.sum()) ** 2
    noise = over * pulses * float((window**2).sum()) / float(window.sum()) ** 2
    chances = np.log(max(len(rates) * RATE_BINS, 1.0))
    best = (0.0, 0.0)
    for rate in rates:
        harmonics = rate * np.arange(1, min(HARMONICS, int(HIGHEST / rate)) + 1)
        own = noise[np.rint(harmonics * pulses).astype(np.intp)]
        harmonics, own = (values[own > LEAST_OVER * noise[0]] for values in (harmonics, own))
        if not len(own):
            continue
        sums = float((lines[np.rint(harmonics * size).astype(np.intp)] / own).sum())
        nats = -np.log(max(float(special.gammaincc(len(own), sums)), 1e-300)) - chances
        depth = float(np.sqrt(max((sums - len(own)) * own.mean(), 0.0)))
        best = max(best, (float(nats), depth))
    return best
