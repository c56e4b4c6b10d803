"""Main and tail rotor of a helicopter: a second comb about the same body line, a gear ratio away from the first.

The first comb is fitted and subtracted, and bins near its lines no longer count; the lines left over give the second
one. Unequal blades, further rotors of nearly the same rate, or a rate that changed leave lines between those of a comb
too. None of these repeats at a gear ratio without repeating as well at a fraction or a multiple of it, so a second comb
must beat its own fractions and multiples.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..evidence import MOST_SNRS, Evidence, line_evidence
from ..lines import from_whole, sum_of_lines
from .candidate_rates import MOST_GEAR
from .comb import Comb, powers_over_noise
from .comb_fit import CombFit, fit_combs
from .comb_scores import heights, running_sums, score
from .comb_search import FINE_STEPS, Candidate, factors_about, spacing_limits
from .periodogram import LEAST_LEVEL, Periodogram, local_level
from .rotors import Rotors, separate_rotors
from .slow_lines import remove_bands
from .unlike_blades import strong_multiple
from .unresolved import judged, left_over, power_about

#: Ratio of tail to main chopping frequency: 4.73 in the paper, 4 to 6 in general, with some margin.
GEAR_RANGE = (2.5, float(MOST_GEAR))

#: Score a second comb must exceed [nats]. Checked by tests/benchmarks/measurement_tables.py.
THRESHOLD = 16.0

#: A comb at a multiple of the second one's spacing must not reach this share of its score.
MULTIPLES = np.array([3 / 2, 2.0, 3.0, 4.0, 5.0])
MULTIPLE_SHARE = 0.9

#: The lines that a fraction of the spacing adds must not reach this share of its lines' mean power over the noise.
FRACTIONS = (2, 3, 4, 5, 6, 7, 8)
FRACTION_SHARE = 0.12

#: Places this near to a line of the first comb do not count [bins].
SHADOW_BINS = 1.3

#: Lines of the two combs nearer than this coincide [bins].
MEETING_BINS = 1.5

#: Main and tail rotor have about equal tip speeds: the second comb's lines are sought out to this multiple of the first
#: one's edge.
FURTHEST_TIP = 2.0

#: Least power of the second comb's strong lines over its weak ones for the strong ones alone to give its chopping
#: frequency. Points at the tips of three blades make every second line five times stronger.
UNLIKE_FACTOR = 7.0

#: A comb about another strong line is another body's if its score exceeds the second comb's by this factor: for most
#: drones in one cell by 1.7 and more, about a strong line of a tail itself by 0.98 at most.
FOREIGN_SHARE = 1.2

#: Candidates that are refined.
CLOSER = 4

#: Most power left between the first comb's lines once the second is taken out, over theirs: what leaves more is several
#: rotors, of whose lines some repeat at a gear ratio. Steady helicopters leave a hundredth.
MOST_LEFT = 1.0

SEVERAL = "no second comb: several rotors of nearly one rate, or of a changing one"


@dataclass(frozen=True)
class Gear:
    """Two combs of one record.

    Parameters
    ----------
    first : Comb
        The comb that was found first, fitted again jointly with the second.
    second : CombFit
        The second comb.
    alone : Periodogram
        The record without the second comb.
    per_turn : int
        Every how many-th line of the second comb is strong and gives its chopping frequency: unlike blades have lines
        at every multiple of their rotation rate, and other residue of the first comb may lie at a fraction of both.
    """

    first: Comb
    second: CombFit
    alone: Periodogram
    per_turn: int = 1

    @property
    def rates(self) -> NDArray[np.float64]:
        """Chopping frequency of main and tail rotor and their standard deviations, shape (2, 2) [cycles a sample]."""
        one = (self.first.chopping, self.first.chopping_std)
        other = (self.second.spacing * self.per_turn, self.second.spacing_std * self.per_turn)
        return np.array(sorted((one, other)))

    @property
    def ratio(self) -> float:
        """Tail over main chopping frequency: the gear ratio where both rotors have as many blades."""
        (main, _), (tail, _) = self.rates
        return float(tail / main)

    @property
    def ratio_std(self) -> float:
        """Its standard deviation."""
        return self.ratio * float(np.hypot(*(self.rates[:, 1] / self.rates[:, 0])))


def find_gear(data: Periodogram, comb: Comb, edge: float, blades: int | None) -> tuple[Gear | None, Rotors, str]:
    """Find a second comb a gear ratio from the first, and the single rotors of the first.

    Several rotors of nearly one rate have so many lines that some pass for a second comb. If such rotors explain the
    record, no second comb is sought. Otherwise rotors are separated again without the second comb's lines: a helicopter
    then leaves a single one.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it; it may be the main rotor's or the tail's.
    edge : float
        Edge of its line family [cycles a sample from the body].
    blades : int or None
        Of a rotor, where that is known.

    Returns
    -------
    gear : Gear or None
        None where there is no second comb.
    rotors : Rotors
        Single rotors of the comb given.
    reason : str
        Why there is no second comb; empty where there is one.
    """
    rotors = judged(separate_rotors(data, comb, edge), data, comb, edge, blades)
    if len(rotors.rates) > 1 and rotors.resolved:
        return None, rotors, SEVERAL
    gear, reason = _second_comb(data, comb, min(FURTHEST_TIP * edge, 0.5))
    if gear is None:
        return None, rotors, reason
    alone = separate_rotors(gear.alone, gear.first, edge)
    if len(alone.rates) > 1 or not alone.resolved:
        return None, rotors, SEVERAL
    about = power_about(gear.alone, alone.rest, alone.fits[0].centre)
    if left_over(about, alone.fits, edge).share > MOST_LEFT:
        return None, rotors, SEVERAL
    return gear, alone, ""


def _second_comb(data: Periodogram, comb: Comb, furthest: float) -> tuple[Gear | None, str]:
    """The second comb of a record, of lines out to `furthest` from the body [cycles a sample], or why there is none."""
    if comb.fit.spacing * data.pulses < 2 * SHADOW_BINS + 1:
        return None, "dwell too short: a second comb could not be told from the first one's lines"
    rest, hidden = _left_over(data, comb)
    evidence = _evidence(rest, hidden)
    limits = spacing_limits(data.pulses, data.prf_hz)
    best = _loudest(rest, evidence, comb, limits, furthest)
    if best is None or best.score < THRESHOLD:
        return None, f"no second comb: evidence {best.score if best else 0.0:.1f} nats, {THRESHOLD:.0f} are needed"
    if _foreign(rest, evidence, comb, limits, furthest) > FOREIGN_SHARE * best.score:
        return None, "no second comb: the lines left over are as much those of another body"
    rival = _rival(rest, evidence, hidden, best)
    if rival > 0:
        return None, f"no second comb: the lines left over repeat every {rival * data.prf_hz:.1f} Hz as well"
    spacings = [comb.fit.spacing, best.spacing]
    fitted = fit_combs(data, comb.fit.centre, spacings, [comb.fit.reach, (best.low, best.high)])
    if fitted is None:
        return None, "no second comb: fewer than three lines of it are usable"
    (first, second), samples = fitted
    lines = remove_bands(sum_of_lines(data.pulses, second.frequencies, second.amplitudes), data.strong.bands)
    gear = Gear(replace(comb, fit=first, rest=samples), second, data.left(data.samples - lines))
    if not GEAR_RANGE[0] <= gear.ratio <= GEAR_RANGE[1]:
        return None, "no second comb: its fit left the range of gear ratios"
    # integer ratio: every line of one comb falls on one of the other, as with unequal blades
    (main, _), (tail, _) = gear.rates
    off = abs(gear.ratio - round(gear.ratio)) * main
    outer = max(-best.low, best.high) * best.spacing
    if off * outer / tail * data.pulses < MEETING_BINS:
        return None, f"no second comb: {gear.ratio:.3f} to 1 is a whole ratio, as of unequal blades"
    gear = replace(gear, per_turn=_lines_per_turn(second.orders, powers_over_noise(data, second, samples)))
    if gear.ratio < GEAR_RANGE[0]:  # above the range is possible: tails have up to four blades for each main one
        return None, f"no second comb: its strong lines are {gear.ratio:.3f} to 1, which is no gear's"
    return gear, ""


def _lines_per_turn(orders: NDArray[np.intp], power: NDArray[np.float64]) -> int:
    """Every how many-th line is strong: of four blades alike in pairs every second, then every second of those."""
    more = strong_multiple(orders, power, range(2, MOST_GEAR + 1), UNLIKE_FACTOR)
    if more == 1:
        return 1
    strong = orders % more == 0
    return more * _lines_per_turn(orders[strong] // more, power[strong])


def _left_over(data: Periodogram, comb: Comb) -> tuple[Periodogram, NDArray[np.bool_]]:
    """The residual of a comb over its own local level, as strong lines leak into the old one; and the bins hidden."""
    rest = data.left(comb.rest)
    hidden = _hidden(rest, comb.fit)
    power = rest.power * rest.level
    level = np.maximum(local_level(power, ~hidden, rest.block), LEAST_LEVEL)
    return replace(rest, power=(power / level).astype(np.float32), level=level), hidden


def _hidden(rest: Periodogram, first: CombFit) -> NDArray[np.bool_]:
    """True in the bins hidden by lines of the first comb or by what was taken out."""
    bins = np.arange(len(rest.power)) / len(rest.power)
    orders = from_whole(bins - first.centre) / first.spacing
    near = np.abs(from_whole(orders)) * first.spacing * rest.pulses < SHADOW_BINS
    return np.asarray(near | ~rest.usable(bins), np.bool_)


def _evidence(rest: Periodogram, hidden: NDArray[np.bool_]) -> Evidence:
    """Evidence of a line in every bin [nats], 0 where it is hidden."""
    evidence = line_evidence(np.where(hidden, 1.0, rest.power), rest.block)
    evidence[:, hidden] = 0.0
    return Evidence(evidence)


def _rival(rest: Periodogram, evidence: Evidence, hidden: NDArray[np.bool_], best: Candidate) -> float:
    """A fraction or multiple of a spacing that explains the lines as well [cycles a sample]; 0 if none does."""
    multiple = _closest(rest, evidence, best.spacing * MULTIPLES[best.spacing * MULTIPLES < 0.4], best.centre)
    if multiple.score > MULTIPLE_SHARE * best.score:
        return multiple.spacing

    def mean_excess(orders: NDArray[np.floating]) -> float:
        place = rest.bins_of(best.centre + best.spacing * orders)
        place = place[~hidden[place]]
        return float(rest.power[place].mean() - 1) if len(place) else 0.0

    own = mean_excess(np.arange(best.low, best.high + 1.0))
    for part in FRACTIONS:
        order = np.arange(best.low * part, best.high * part + 1)
        if mean_excess(order[order % part != 0] / part) > FRACTION_SHARE * own:
            return best.spacing / part
    return 0.0


def _loudest(
    rest: Periodogram, evidence: Evidence, first: Comb, limits: tuple[float, float], furthest: float
) -> Candidate | None:
    """The comb at a gear ratio from the first that has the highest score."""
    low, high = GEAR_RANGE
    chopping, centre = first.chopping, first.fit.centre
    spacings = np.concatenate(
        [
            _geometric(max(chopping / high, limits[0]), chopping / low, rest.pulses),
            _geometric(chopping * low, min(chopping * high, limits[1]), rest.pulses),
        ]
    )
    return _loudest_of(spacings, rest, evidence, centre, furthest) if len(spacings) else None


def _foreign(rest: Periodogram, evidence: Evidence, first: Comb, limits: tuple[float, float], furthest: float) -> float:
    """Highest score of a comb of any spacing about a strong line that is none of the first comb's [nats]."""
    fit, spacings, most = first.fit, _geometric(*limits, rest.pulses), 0.0
    for centre in rest.strong.centres if len(spacings) else ():
        off = (centre - fit.centre) / fit.spacing
        if abs(off - round(off)) * fit.spacing * rest.pulses > SHADOW_BINS:
            most = max(most, _loudest_of(spacings, rest, evidence, float(centre), furthest).score)
    return most


def _loudest_of(
    spacings: NDArray[np.float64], rest: Periodogram, evidence: Evidence, centre: float, furthest: float
) -> Candidate:
    """The comb about a centre, of rising spacings or ones near them, that has the highest score."""
    loudest = spacings[np.argsort(_even_heights(evidence, spacings, centre, furthest))[: -CLOSER - 1 : -1]]
    return _closest(rest, evidence, loudest, centre)


def _even_heights(
    evidence: Evidence, spacings: NDArray[np.float64], centre: float, furthest: float
) -> NDArray[np.float32]:
    """Highest evidence at each of rising spacings, both sides reaching equally far; at least 0."""
    size = evidence.rows.shape[-1]
    # both sides at once: the spectrum folded about the centre
    middle, away = round(centre * size), np.arange(size // 2 + 1)
    sides = (evidence.rows.take(middle + sign * away, axis=1, mode="wrap") for sign in (-1, 1))
    folded = Evidence(np.add(*sides))
    best = np.zeros((len(spacings), MOST_SNRS), np.float32)
    for sums in running_sums(folded, np.zeros((1, len(spacings))), spacings[None] * size, furthest * size):
        held = best[: sums.shape[2]]
        np.maximum(held, sums[:, 0].max(axis=0), out=held)
    return np.asarray(best.max(axis=1), np.float32)


def _geometric(low: float, high: float, pulses: int) -> NDArray[np.float64]:
    """Spacings in steps that move a line at the end of the span by a bin."""
    if low >= high:
        return np.empty(0)
    return np.geomspace(low, high, int(np.log(high / low) * pulses / 2) + 2)


def _closest(rest: Periodogram, evidence: Evidence, spacings: NDArray[np.float64], centre: float) -> Candidate:
    """The comb of the highest score at spacings or near them."""
    tried = np.outer(spacings, factors_about(rest.pulses, 2 * FINE_STEPS, FINE_STEPS)).ravel()
    best = tried[[heights(evidence, tried, np.full(len(tried), centre)).argmax()]]
    (height,), (low,), (high,) = score(evidence, best, np.array([centre]))
    return Candidate(float(best[0]), centre, int(low), int(high), float(height))
