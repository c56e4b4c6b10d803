"""A comb that stays: the same chopping frequency in dwell after dwell of a recording, as a rotor's does.

In one dwell a few strong bins of noise, or a spur together with a fading target, may pass for a comb. In other dwells
they do not pass for the same comb again.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .body_velocity import folded
from .dropouts import unbroken
from .following import by_recording, normed
from .rotor.comb import OVER_BODY, find_comb
from .rotor.even_pulses import even_pulses
from .rotor.periodogram import prepare
from .spectrum import SPEED_OF_LIGHT_MPS

#: DWELL_S: length of a dwell [s], short enough for a rate that changes. PULSES: its fewest and most pulses; more would
#: cost time and find little more.
DWELL_S, PULSES = 0.08, (32, 4096)

#: DWELLS: most dwells that are looked at, spread over the recording. LEAST: fewest of them that must show the comb.
DWELLS, LEAST = 8, 3

#: Chopping frequencies count as the same if their logarithms differ by less: a controller moves them so far in flight.
SAME = 0.08


@dataclass(frozen=True)
class SteadyComb:
    """The comb that stays in each recording of a batch; NaN where there is none.

    Parameters
    ----------
    chopping_hz : ndarray of float64, shape (...)
        Its chopping frequency, the median of the first dwells that show it [Hz].
    """

    chopping_hz: NDArray[np.float64]


def steady_comb(iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float) -> SteadyComb:
    """Seek one comb in several dwells of each recording.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Slow-time samples of one range cell; in fewer than three dwells, or below a PRF of 400 Hz, nothing is found.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    SteadyComb

    Raises
    ------
    ValueError
        If the samples are not complex or not finite, or the frequencies are not positive.
    """
    return SteadyComb(*by_recording(iq, _one, carrier_hz, prf_hz))


def _one(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple[float]:
    """The fields of `SteadyComb` of one recording."""
    pulses = round(min(DWELL_S * prf_hz, PULSES[1]))
    count = min(len(iq) // max(pulses, 1), DWELLS)
    if pulses < PULSES[0] or count < LEAST or not iq.any():
        return (np.nan,)
    iq = normed(iq)
    choppings = np.zeros(0)
    for start in np.rint(np.linspace(0, len(iq) - pulses, count)).astype(np.intp):
        chopping_hz = _rotor_hz(iq[start : start + pulses], carrier_hz, prf_hz)
        if chopping_hz is None:
            continue
        choppings = np.append(choppings, chopping_hz)
        same = np.abs(np.log(choppings[:, None] / choppings)) < SAME
        shown = same.sum(axis=1)
        if shown.max() >= LEAST:  # enough: further dwells would only take time
            return (float(np.median(choppings[same[shown.argmax()]])),)
    return (np.nan,)


def _rotor_hz(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> float | None:
    """Chopping frequency of a dwell whose comb is no wheel's [Hz], or None."""
    data = prepare(iq[unbroken(iq)], carrier_hz=carrier_hz, prf_hz=prf_hz)
    if data is None:
        return None
    comb, _ = find_comb(data)
    if comb is None or len(even_pulses(data, comb.fit.spacing)):  # or they are another radar's pulses
        return None
    per_mps = 2 * carrier_hz / SPEED_OF_LIGHT_MPS
    reach_mps = comb.last * comb.fit.spacing * prf_hz / per_mps
    body_mps = abs(folded(comb.fit.centre)) * prf_hz / per_mps
    return comb.chopping * prf_hz if reach_mps > OVER_BODY * body_mps else None
