"""The rates of single rotors whose combs lie in one another: found in turn, fitted together.

Rotors of nearly one rate part at the high orders, where the lines lie further from one another than the dwell's bin.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .comb import Comb
from .comb_fit import CombFit, fit_combs
from .comb_search import line_evidence, score
from .flashes import flash_nats
from .periodogram import BLOCK_BINS, LINE_DB, Periodogram

#: Rotors looked for at most.
MAX_ROTORS = 8

#: How far the rates of one airframe's rotors lie from the comb found first, relative.
RATE_SPREAD = 0.05

#: A further rotor must have this much evidence [nats], and this share of the strongest one's.
LEAST_EVIDENCE = 13.0
LEAST_SHARE = 0.03

#: A comb weaker than this share of the strongest is what a rate that changed within the dwell leaves behind.
LEAST_POWER_SHARE = 0.12

#: Steps of the joint fit each time a rotor is added.
JOINT_STEPS = 3

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
    spread : float
        Range of the rates [cycles a sample], of the unresolved ones as far as they show; 0 for a single rotor.
    fits : list of CombFit
        Their lines.
    rest : ndarray of complex128, shape (pulses,)
        Samples that these leave.
    """

    rates: NDArray[np.float64]
    stds: NDArray[np.float64]
    resolved: bool
    spread: float
    fits: list[CombFit]
    rest: NDArray[np.complex128]


def _strongest(data: Periodogram, centre: float, rates: NDArray[np.float64]) -> tuple[float, int, float]:
    """Rate whose lines speak loudest by their powers and their flashes, how far they reach, and their evidence."""
    size = len(data.power)
    evidence = line_evidence(data.power, int(BLOCK_BINS * size / data.pulses))
    evidence[:, ~data.usable(np.arange(size) / size)] = 0.0
    powers, _, reach = score(evidence, rates, np.full(len(rates), centre), even=True)
    order = np.arange(1, reach.max() + 1)
    flashes = np.zeros(len(rates))
    for sign in (-1, 1):
        frequency = centre + sign * rates[:, None] * order
        seen = data.usable(frequency) & (order <= reach[:, None])
        place = np.rint(frequency * size).astype(np.intp) % size
        flashes += flash_nats(np.where(seen, data.amplitude[place], 0))
    sums = powers + flashes
    best = int(sums.argmax())
    return float(rates[best]), int(reach[best]), float(sums[best])


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
    # one comb fitted to several finds its centre between them: a strong line near it tells better
    for line, level_db in zip(data.centres, data.centres_db, strict=True):
        if level_db > LINE_DB and abs(line - centre) * data.pulses < 1.5:
            centre = line
    reach = max(comb.last // comb.per_turn, int(np.clip(round(edge / nominal), 1, 0.45 / nominal)))
    resolution = RESOLVED_BINS / (reach * data.pulses)
    alone = Rotors(np.array([nominal]), np.array([comb.chopping_std]), True, 0.0, [comb.fit], comb.rest)
    if reach * RATE_SPREAD * nominal * data.pulses < 2:
        return alone
    rates = np.arange(nominal * (1 - RATE_SPREAD), nominal * (1 + RATE_SPREAD), resolution / 4)
    fits: list[CombFit] = []
    reaches: list[int] = []
    rest = data
    first, spread = 0.0, 0.0
    resolved = True
    while len(fits) < MAX_ROTORS:
        rate, far, evidence = _strongest(rest, centre, rates)
        first = first or evidence
        if evidence < max(LEAST_EVIDENCE, LEAST_SHARE * first):
            break
        spread = float(np.ptp([rate, *(fit.spacing for fit in fits)]))
        if any(abs(rate - fit.spacing) < resolution for fit in fits):
            resolved = False
            break
        if not fits and comb.per_turn == 1 and abs(rate - nominal) < resolution:
            fits, rest, reaches = [comb.fit], data.left(comb.rest), [far]
            continue
        spacings = [*(fit.spacing for fit in fits), rate]
        fitted = fit_combs(data, centre, spacings, [(-r, r) for r in (*reaches, far)], JOINT_STEPS)
        if fitted is None:
            break
        together, samples = fitted
        power = [float((np.abs(fit.amplitudes) ** 2).sum()) for fit in together]
        if power[-1] < LEAST_POWER_SHARE * max(power):
            resolved = False
            break
        fits, rest, reaches = together, data.left(samples), [*reaches, far]
    if not fits:
        return alone
    fits.sort(key=lambda fit: fit.spacing)
    found = np.array([fit.spacing for fit in fits])
    if len(found) > 1 and np.diff(found).min() < resolution:
        return replace(alone, resolved=False, spread=float(np.ptp(found)))
    spread = float(np.ptp(found)) if resolved else max(spread, float(np.ptp(found)))
    return Rotors(found, np.array([fit.spacing_std for fit in fits]), resolved, spread, fits, rest.samples)
