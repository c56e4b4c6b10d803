"""The rates of single rotors whose combs lie in one another: found in turn, fitted together.

Rotors of nearly one rate part at the high orders, where the lines lie further from one another than the dwell's bin.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .bodies import LINE_DB
from .comb import Comb, strong_multiple
from .comb_fit import CombFit, fit_combs
from .comb_search import even_scores
from .evidence import Evidence
from .flashes import flash_nats
from .lines import squared
from .periodogram import Periodogram

#: Rotors looked for at most.
MAX_ROTORS = 8

#: How far the rates of one airframe's rotors lie from the comb found first, relative: in hover, and in a manoeuvre or
#: where rotors are not alike. The latter are sought by their inner orders, which part such rates already.
RATE_SPREAD, FURTHEST_SPREAD, INNER_ORDERS = 0.05, (-0.25, 0.33), 10

#: A rotor that turns slower still has lines at twice its rate, which may lie among these: those at halves of that, out
#: to so many orders, which other rotors' lines have not filled yet, have this share of their power and so many times
#: that of noise, all but so large a share of them.
HALF_ORDERS, HALF_SHARE, HALF_POWER, HALF_QUANTILE = 6, 0.05, 4.0, 0.3

#: What lies within so many bins of a line that is known says nothing of these; so many must be left.
NEAR_BINS, LEAST_BETWEEN = 2.0, 4

#: The lines of one of these reach this share of what the others' do: else they are what rotors not told apart leave.
APART_REACH = 0.5

#: Lines that are fitted together at most, memory and time growing with their square and cube; rotors that would have
#: more are not told apart.
MOST_LINES = 2000

#: A further rotor must have this much evidence [nats], and this share of the strongest one's.
LEAST_EVIDENCE = 13.0
LEAST_SHARE = 0.03

#: A comb weaker than this share of the strongest is what a rate that changed within the dwell leaves behind.
LEAST_POWER_SHARE = 0.12

#: Steps of the joint fit each time a rotor is added, and once all are found: only then their deviations matter.
JOINT_STEPS, LAST_STEPS = 2, 1

#: A helicopter's tail rotor turns at most so many times as fast as its main rotor: at a fraction of its rate every so
#: many-th line is there, and that fraction may lie among the rates of rotors like the first one. By so much are these
#: stronger: 20 times and more where a tail is 8 dB under a main rotor of 5 dB, up to 8 where rotors' lines cross.
MOST_GEAR, GEAR_FACTOR = 9, 12.0

#: A rotor flashes once a period on each side of the body. A second flash of this share of the first one's power is
#: another rotor's, of a rate that the dwell does not tell apart; so far from the first it is no part of it [1 / lines].
SECOND_FLASH_SHARE, FLASH_WIDTH, FLASH_PADDING = 0.3, 2.5, 16
LEAST_FLASH_LINES = 6

#: What is left between the lines within the band, over what is left beyond it, and as a share of the lines' power,
#: speaks of rotors that were not found where it exceeds both of these.
LEFT_OVER, LEFT_SHARE = 0.3, 0.05
LEAST_BINS = 100

#: What a lone rotor leaves may be a change of its rate; from this share of its lines' power on they say little of it.
LEFT_ALONE = 0.25

#: As does what is left where it comes, with so many of its deviations, to the mean rotor found: one more like it would
#: not have been seen.
HIDDEN_DEVIATIONS = 1.5

#: What stands past the edge of a lone rotor's family, out to so many times it, speaks of rotors whose outer lines part
#: where it comes to so many deviations, and to this share of the lines' power.
PAST_EDGE, PAST_DEVIATIONS, PAST_SHARE = 4.0, 4.0, 0.2

#: Lines are looked for so far past the edge of the line family: what strong ones leave there may pass for more.
FURTHEST = 1.5

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
    next_rate : float
        The rate that speaks loudest in these, be it of a rotor or not [cycles a sample].
    """

    rates: NDArray[np.float64]
    stds: NDArray[np.float64]
    resolved: bool
    spread: float
    fits: list[CombFit]
    rest: NDArray[np.complex128]
    next_rate: float


def _strongest(
    data: Periodogram, centre: float, rates: NDArray[np.float64], furthest: float, evidence: Evidence
) -> tuple[float, int, float]:
    """Rate whose lines speak loudest by their powers and their flashes, how far they reach, and their evidence."""
    size = len(data.power)
    powers, reach = even_scores(evidence, rates, np.full(len(rates), centre), furthest)
    order = np.arange(1, reach.max() + 1)
    frequency = centre + np.array([-1, 1])[:, None, None] * rates[:, None] * order
    seen = data.usable(frequency) & (order <= reach[:, None])
    place = np.rint(frequency * size).astype(np.intp) % size
    flashes = flash_nats(np.where(seen, data.amplitude[place], 0)).sum(axis=0)
    sums = powers + flashes
    best = int(sums.argmax())
    return float(rates[best]), int(reach[best]), float(sums[best])


def _flashes_twice(fit: CombFit, per_turn: int, tip: float) -> bool:
    """True where a comb's phases show the flashes of two rotors in each period.

    A blade that reflects along its length flashes once on each side. One that reflects at its tip alone is seen twice
    at every speed below the tip's, before and after that comes straight on: its lines are J_n(Gamma) (the paper's eq.
    24), and flash once when these are taken for what they are; `tip` is the order its edge has.
    """
    return all(_second_flashes(fit, per_turn, blade) for blade in (None, (1, tip), (2, tip), (3, tip)))


def _second_flashes(fit: CombFit, per_turn: int, tip: tuple[int, float] | None) -> bool:
    """True where the second flashes on both sides are as strong as another rotor's, for blades of one kind.

    Parameters
    ----------
    fit, per_turn
        The comb, and the strong lines' spacing in lines of it.
    tip : (int, float), optional
        Blades that reflect at their tips, and the tip's order; else they reflect along their length.
    """
    from scipy.special import jv  # here, because predicting needs no such import

    shares = []
    for sign in (-1, 1):
        side = np.flatnonzero((sign * fit.orders > 0) & (fit.orders % per_turn == 0))
        order = np.abs(fit.orders[side]) // per_turn
        if len(side) < LEAST_FLASH_LINES:
            continue
        lines = np.zeros(order.max() + 1, np.complex128)
        lines[order] = fit.amplitudes[side]
        if tip is not None:
            lines *= jv(tip[0] * np.arange(len(lines)), tip[0] * tip[1])
        size = FLASH_PADDING * len(lines)
        power = np.abs(fft.fft(lines, size)) ** 2
        first = int(power.argmax())
        lines_away = np.abs((np.arange(size) - first + size // 2) % size - size // 2) / FLASH_PADDING
        other = lines_away > FLASH_WIDTH
        for part in (2, 3):  # unequal blades of one rotor flash at fractions of the turn
            other &= np.abs(lines_away - len(lines) / part) > 1
        shares.append(power[other].max(initial=0) / power[first])
    return len(shares) == 2 and min(shares) > SECOND_FLASH_SHARE / 2 and sum(shares) > 2 * SECOND_FLASH_SHARE


def _strongest_apart(
    data: Periodogram, centre: float, nominal: float, resolution: float, furthest: float
) -> tuple[float, int, float]:
    """The same among rates further from the nominal one than those of rotors in hover.

    Were these not sought, their lines would pass for those of rates in between at which only every third or fourth line
    is there. Where lines not told apart fill all places, none of these speaks for one.
    """
    step = max(RESOLVED_BINS / (4 * INNER_ORDERS * data.pulses), resolution / 4)
    low, high = FURTHEST_SPREAD
    rates = np.arange(nominal * (1 + low), nominal * (1 + high), step)
    rates = rates[np.abs(rates / nominal - 1) > RATE_SPREAD]
    inner, _ = even_scores(data.contrast, rates, np.full(len(rates), centre), min(INNER_ORDERS * nominal, furthest))
    rate = float(rates[inner.argmax()])
    near = np.arange(-step, step * 1.01, resolution / 4)
    return _strongest(data, centre, rate + near, furthest, data.contrast)


def _is_twice(rest: Periodogram, centre: float, rate: float, fits: list[CombFit]) -> bool:
    """True where a comb has its inner lines at halves of its rate too, which then is twice a rotor's."""
    known = np.concatenate([fit.frequencies for fit in fits])

    def low(orders: NDArray[np.floating]) -> float:
        places = centre + rate * orders
        near = np.abs(places[:, None] - known).min(axis=1) * rest.pulses
        places = places[rest.usable(places) & (near > NEAR_BINS)]
        return float(np.quantile(rest.at(places), HALF_QUANTILE)) if len(places) >= LEAST_BETWEEN else 0.0

    order = np.arange(-HALF_ORDERS, HALF_ORDERS, dtype=float)
    return low(order + 0.5) > max(HALF_SHARE * low(order), HALF_POWER)


def _holds_another(fit: CombFit, pulses: int) -> bool:
    """True where only every so many-th line of a comb is there: a tail rotor's, whose rate is that multiple."""
    return strong_multiple(fit.orders, 1 + pulses * np.abs(fit.amplitudes) ** 2, MOST_GEAR, GEAR_FACTOR) > 1


#: Of each bin: how far from a centre it is [cycles a sample], its power, whether it can be seen.
_About = tuple[NDArray[np.float64], NDArray[np.floating], NDArray[np.bool_]]


def _power_about(rest: Periodogram, centre: float) -> _About:
    """Of each bin of what is left: how far from a centre it is [cycles a sample], its power, whether it can be seen."""
    frequency = fft.fftfreq(rest.pulses)
    away = np.abs(frequency - centre)
    seen = rest.usable(frequency) & rest.in_band(frequency)
    return np.abs(away - np.rint(away)), squared(fft.fft(rest.samples)) / rest.pulses, seen


def _left_over(about: _About, fits: list[CombFit], edge: float) -> tuple[float, bool]:
    """What is left within the band: its share of the lines' power, and whether it may be a rotor.

    The share is 0 where that is not clearly more than the noise beyond the band.

    Fitted lines take noise out with them: each as much as it was let free, those that lie in one another only once.
    """
    away, power, usable = about
    pulses = len(power)
    low, high = 2 * fits[0].spacing, 0.9 * edge
    within = usable & (away < high) & (away > low)
    beyond = usable & (away > 1.1 * edge)
    if within.sum() < LEAST_BINS or beyond.sum() < LEAST_BINS:
        return 0.0, False
    noise = float(power[beyond].mean())
    over = float(power[within].mean()) - noise
    lines = sum(float((np.abs(fit.amplitudes) ** 2).sum()) for fit in fits) * pulses
    share = over * within.sum() / lines if over > LEFT_OVER * noise else 0.0
    range_bins = float(np.ptp([fit.spacing for fit in fits])) * pulses
    held, taken = 0.0, 0.0
    for fit in fits:
        order = np.abs(fit.orders)
        inside = (order * fit.spacing < high) & (order * fit.spacing > low)
        held += float((np.abs(fit.amplitudes[inside]) ** 2).sum()) * pulses / len(fits)
        apart = np.minimum(1.0, (1 + order[inside] * range_bins) / len(fits))
        taken += float((apart * fit.snr[inside] / (1 + fit.snr[inside])).sum())
    deviation = noise * float(np.sqrt(1 / within.sum() + 1 / beyond.sum()))
    most = over + noise * taken / within.sum() + HIDDEN_DEVIATIONS * deviation
    return share, most * within.sum() > held


def _stands_past(about: _About, fit: CombFit, edge: float) -> bool:
    """True where more than noise stands past the edge of a line family: near the noise its inner lines alone are seen.

    Rotors of unlike rates have their lines in one another at the inner orders, and apart at the outer ones.
    """
    away, power, usable = about
    furthest = min(PAST_EDGE * edge, (edge + 0.5) / 2)
    past = usable & (away > 1.1 * edge) & (away < furthest)
    far = usable & (away > furthest)
    if past.sum() < LEAST_BINS or far.sum() < LEAST_BINS:
        return False
    noise = float(power[far].mean())
    over = float(power[past].mean()) - noise
    lines = float((np.abs(fit.amplitudes) ** 2).sum()) * len(power)
    deviation = noise * float(np.sqrt(1 / past.sum() + 1 / far.sum()))
    return over > PAST_DEVIATIONS * deviation and over * past.sum() > PAST_SHARE * lines


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
    alone = Rotors(np.array([nominal]), np.array([comb.chopping_std]), True, 0.0, [comb.fit], comb.rest, nominal)
    if reach * RATE_SPREAD * nominal * data.pulses < 2:
        return alone
    rates = np.arange(nominal * (1 - RATE_SPREAD), nominal * (1 + RATE_SPREAD), resolution / 4)
    furthest = min(FURTHEST * nominal * reach, 0.5)
    fits: list[CombFit] = []
    reaches: list[int] = []
    rest = data
    first, spread, rate = 0.0, 0.0, nominal
    resolved, seek_apart = True, True
    while len(fits) < MAX_ROTORS:
        rate, far, evidence = _strongest(rest, centre, rates, furthest, rest.evidence)
        is_apart = False
        if fits and seek_apart:
            apart = _strongest_apart(rest, centre, nominal, resolution, furthest)
            known = max(r * fit.spacing for r, fit in zip(reaches, fits, strict=True))
            if apart[0] * apart[1] > APART_REACH * known and apart[2] > evidence:
                (rate, far, evidence), is_apart = apart, True
                if _is_twice(rest, centre, rate, fits):
                    rate, far = rate / 2, 2 * far
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
        if 2 * (sum(reaches) + far) > MOST_LINES:
            resolved = False
            break
        spacings = [*(fit.spacing for fit in fits), rate]
        outermost = [(-r, r) for r in (*reaches, far)]
        fitted = fit_combs(data, centre, spacings, outermost, JOINT_STEPS, rest=rest.samples)
        if fitted is None:
            break
        together, samples = fitted
        if fits and _holds_another(together[-1], data.pulses):
            if not is_apart:
                break
            seek_apart = False
            continue
        power = [float((np.abs(fit.amplitudes) ** 2).sum()) for fit in together]
        if power[-1] < LEAST_POWER_SHARE * max(power):
            resolved = False
            break
        fits, rest, reaches = together, data.left(samples), [*reaches, far]
    if not fits:
        return alone
    if len(fits) > 1:
        spacings, outermost = [fit.spacing for fit in fits], [(-r, r) for r in reaches]
        polished = fit_combs(data, fits[0].centre, spacings, outermost, LAST_STEPS, rest=rest.samples)
        if polished is not None:
            fits, samples = polished
            rest = data.left(samples)
    fits.sort(key=lambda fit: fit.spacing)
    found = np.array([fit.spacing for fit in fits])
    if len(found) > 1 and np.diff(found).min() < resolution:
        return replace(alone, resolved=False, spread=float(np.ptp(found)))
    spread = float(np.ptp(found)) if resolved else max(spread, float(np.ptp(found)))
    return Rotors(found, np.array([fit.spacing_std for fit in fits]), resolved, spread, fits, rest.samples, rate)


def judged(rotors: Rotors, data: Periodogram, comb: Comb, edge: float) -> Rotors:
    """Rotors, called unresolved where their flashes, or what they leave, speak of more than were found.

    Parameters
    ----------
    rotors : Rotors
        From `separate_rotors`.
    data, comb, edge
        As there.
    """
    if not rotors.resolved:
        return rotors
    several = len(rotors.fits) > 1
    per_turn = comb.per_turn if rotors.fits[0] is comb.fit else 1
    tip = edge / (per_turn * max(fit.spacing for fit in rotors.fits))  # an order is the same for all: blades are alike
    twice = any(_flashes_twice(fit, per_turn, tip) for fit in rotors.fits)
    about = _power_about(data.left(rotors.rest), rotors.fits[0].centre)
    share, hidden = _left_over(about, rotors.fits, edge)
    past = not several and _stands_past(about, rotors.fits[0], edge)
    if not (twice or hidden or past or share > (LEFT_SHARE if several else LEFT_ALONE)):
        return rotors
    reach = max(int(np.abs(rotors.fits[0].orders).max()), 1)
    spread = max(rotors.spread, RESOLVED_BINS / (reach * data.pulses))
    if hidden and not several:
        spread = max(spread, abs(rotors.next_rate - float(rotors.rates[0])))
    return replace(rotors, resolved=False, spread=spread)
