"""The rates of single rotors whose combs lie in one another: taken out in turn, each fitted without the rest.

Rotors of nearly one rate part at the high orders, where the lines lie further from one another than the dwell's bin.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .comb import Comb
from .comb_fit import CombFit, fit_comb, line_matrix
from .comb_search import Candidate, line_evidence
from .periodogram import BLOCK_BINS, Periodogram

#: Rotors looked for at most.
MAX_ROTORS = 8

#: How far the rates of one airframe's rotors lie from the comb found first, relative.
RATE_SPREAD = 0.05

#: A further rotor must have this much evidence [nats], and this share of the strongest one's.
LEAST_EVIDENCE = 14.0
LEAST_SHARE = 0.03

#: A comb weaker than this share of the strongest is what a rate that changed within the dwell leaves behind.
LEAST_POWER_SHARE = 0.12

#: Rates nearer than this are one: so many bins apart at the outermost order.
RESOLVED_BINS = 0.9


@dataclass(frozen=True)
class Rotors:
    """Single rotors of one record.

    Parameters
    ----------
    rates, stds : ndarray, shape (rotors,)
        Chopping frequency of each, rising, and its standard deviation [cycles a sample].
    resolved : bool
        False where something is left between the combs that is no further comb: the rates lie nearer than the dwell
        tells apart, or they changed within it. The number of rotors is then a lower bound.
    """

    rates: NDArray[np.float64]
    stds: NDArray[np.float64]
    resolved: bool


def _strongest(data: Periodogram, centre: float, rates: NDArray[np.float64], reach: int) -> tuple[int, float]:
    """Index and evidence of the rate whose lines speak loudest within the reach."""
    evidence = line_evidence(data.power, int(BLOCK_BINS * len(data.power) / data.pulses))
    evidence[:, ~data.usable(np.arange(len(data.power)) / len(data.power))] = 0.0
    order = np.concatenate([np.arange(-reach, 0), np.arange(1, reach + 1)])
    place = np.rint((centre + rates[:, None] * order) * len(data.power)).astype(np.intp) % len(data.power)
    sums = np.stack([row[place].sum(axis=1) for row in evidence]).max(axis=0)
    best = int(sums.argmax())
    return best, float(sums[best])


def _lines(data: Periodogram, fit: CombFit) -> NDArray[np.complex128]:
    """The part of the samples that a fitted comb explains, weak lines held back as far as noise makes them."""
    amplitudes = fit.amplitudes
    return amplitudes @ line_matrix(data.pulses, fit.centre, fit.spacing, fit.orders)


def separate_rotors(data: Periodogram, comb: Comb, edge: float) -> Rotors:
    """Separate the rotors of one record.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it.
    edge : float
        Edge of the line family [cycles a sample from the body].

    Returns
    -------
    Rotors
        At least one.
    """
    nominal, centre = comb.chopping, comb.fit.centre
    reach = int(np.clip(round(edge / nominal), 1, 0.45 / nominal))
    resolution = RESOLVED_BINS / (reach * data.pulses)
    alone = Rotors(np.array([nominal]), np.array([comb.chopping_std]), True)
    if reach * RATE_SPREAD * nominal * data.pulses < 2:
        return alone
    rates = np.arange(nominal * (1 - RATE_SPREAD), nominal * (1 + RATE_SPREAD), resolution / 4)
    fits: list[CombFit] = []
    rest = data
    first = 0.0
    resolved = True
    while len(fits) < MAX_ROTORS:
        index, evidence = _strongest(rest, centre, rates, reach)
        first = first or evidence
        if evidence < max(LEAST_EVIDENCE, LEAST_SHARE * first):
            break
        if any(abs(rates[index] - fit.spacing) < resolution for fit in fits):
            resolved = False
            break
        fit = fit_comb(rest, Candidate(float(rates[index]), evidence, -reach, reach, centre))
        if fit is None:
            break
        power = [float((np.abs(known.amplitudes) ** 2).sum()) for known in (*fits, fit)]
        if power[-1] < LEAST_POWER_SHARE * max(power):
            resolved = False
            break
        fits.append(fit)
        fits = _again(data, fits, centre, reach)
        rest = data
        for known in fits:
            rest = rest.without(_lines(data, known))
    if not fits:
        return alone
    order = np.argsort([fit.spacing for fit in fits])
    found = np.array([fits[i].spacing for i in order])
    if len(found) > 1 and np.diff(found).min() < resolution:
        return Rotors(alone.rates, alone.stds, False)
    return Rotors(found, np.array([fits[i].spacing_std for i in order]), resolved)


def _again(data: Periodogram, fits: list[CombFit], centre: float, reach: int) -> list[CombFit]:
    """Fit each comb once more with the others taken out."""
    if len(fits) == 1:
        return fits
    out = list(fits)
    for number, fit in enumerate(fits):
        rest = data.samples
        for other, known in enumerate(out):
            if other != number:
                rest = rest - _lines(data, known)
        again = fit_comb(data.without(data.samples - rest), Candidate(fit.spacing, fit.score, -reach, reach, centre))
        out[number] = again or fit
    return out
