"""Whether blades still flash past where their lines are said to end: those then fill the span, and end nowhere in it.

Noise, a background and what strong lines leak have no rhythm. Lines of tips some times faster than the unambiguous
velocity come back all over the span: between those that are told apart they pass for noise, but come and go with the
blades.
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

#: Past the edge is what lies further than so many of its deviations and this times the width of its roll-off,
#: Gamma^(1/3) orders; and all the last of the span in any case, from here on [cycles a sample].
EDGE_DEVIATIONS, ROLL_OFF, LAST = 3.0, 1.0, 0.46

#: Bins past the edge, and within it, that tell.
LEAST_BINS = 50

#: Rates so far apart have their flashes told apart [bins].
RATE_BINS = 0.25

#: Harmonics of the flashes that are added up, at most, and up to this frequency [cycles a sample]; not those that are
#: about as far apart as the band is wide, or between its parts: they beat with so small a share of it.
HARMONICS, HIGHEST, LEAST_OVER = 8, 0.25, 0.1

#: What lies past the edge flashes where noise does as much once in exp(this) records, and by this share of what lies
#: within it. Of 169 tips of 0.3 to 1 times the unambiguous velocity that were told, at 0 to 20 dB, those of a share
#: over 0.02 had 6.9 at most, those over 0.1 had 5.2. Of tips 1.8 to 3 times as fast as that, which had passed for 0.2
#: to 0.8 times, all had 6.9 and more, most over 20, and shares of 0.13 up.
LEAST_NATS, LEAST_SHARE = 6.0, 0.1


@dataclass(frozen=True)
class PastEdge:
    """What lies past the edge of a line family.

    Parameters
    ----------
    seen : bool
        Whether enough of the span lies there, and within it, to tell.
    flashes : bool
        Whether it flashes as the rotors do.
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
    """What lies past the edge of rotors' lines; nothing is seen there of one channel, or where it is past the span.

    Parameters
    ----------
    data, samples, centre, edge
        As in `past_edge`.
    rates : sequence of float
        Those known [cycles a sample].
    spread : float
        How far from these others may be [cycles a sample].
    """
    if data.one_channel or not 0 < edge[0] < 0.5:
        return PastEdge(seen=False, flashes=False)
    least = 1 / data.pulses
    around = max(spread, least)
    tried = np.arange(max(min(rates) - around, least), max(rates) + around, RATE_BINS * least)
    return past_edge(data, samples, centre, np.append(rates, tried), edge)


def told_no_further(data: Periodogram, fit: CombFit, edge: float, edge_std: float = 0.0) -> str:
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
        Its samples, any unit: where flashes passed for clicks and were cut out, noise is cut out in their rhythm too.
    centre : float
        Of the family [cycles a sample].
    rates : ndarray, shape (rates,)
        Of the flashes, as finely as the dwell tells them apart [cycles a sample].
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
    """How clearly, and by what share, the power of samples comes and goes at the one of some rates where it does most.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Of nothing but a band.
    level : ndarray, shape (pulses,)
        Of its noise, in FFT order, any unit.
    rates : ndarray, shape (rates,)
        [cycles a sample].

    Returns
    -------
    nats : float
        The logarithm of the odds against noise in this band doing so at any of the rates.
    depth : float
        Root of the power of all harmonics over the mean's, beyond noise.
    """
    pulses, size = len(samples), fft.next_fast_len(PADDING * len(samples), real=True)
    window = np.hanning(pulses)
    power = squared(samples)
    lines = squared(fft.rfft((power - power.mean()) * window, size)) / max(float((power * window).sum()) ** 2, 1e-300)
    # noise beats with itself where the band lies over itself, shifted
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
