"""Chopping frequencies of single rotors whose combs interleave: found one by one, fitted jointly.

Rotors of nearly equal rates are resolved at the high orders, where their lines lie more than one Doppler bin apart.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..bodies import LINE_DB
from ..lines import energy, squared
from .candidate_rates import FURTHEST_SPREAD, GEAR_FACTOR, INNER_ORDERS, RATE_SPREAD, is_between, is_twice, lines_apart
from .comb import Comb
from .comb_fit import CombFit, fit_combs
from .comb_scores import even_scores
from .flashes import LEAST_LINES, flash_nats
from .periodogram import Level, Periodogram
from .unlike_blades import MOST_BLADES, UNEQUAL_FACTOR

#: Most rotors sought.
MAX_ROTORS = 8

#: A candidate may share every third to fifth line of a rotor whose rate is one of these times the candidate's.
RATIOS = np.array([2 / 3, 3 / 4, 4 / 5, 5 / 4, 4 / 3])

#: Least reach of a rotor of a far rate, as a share of the furthest reach of the rotors found: a shorter one is residue
#: of unresolved rotors.
APART_REACH = 0.5

#: Most lines fitted jointly, as memory and time grow with their square and cube; rotors that would need more are
#: unresolved.
MOST_LINES = 2000

#: Least evidence for a second rotor, and for a third and further ones, since two fits leave more by chance [nats]; also
#: at least LEAST_SHARE of the first one's. Below DOUBTFUL_SHARE of the largest seen it may be fit residue, so the
#: rotors found are first fitted to convergence.
LEAST_EVIDENCE, FURTHER_EVIDENCE = 13.0, 28.0
LEAST_SHARE, DOUBTFUL_SHARE = 0.1, 0.5

#: A comb with less than this share of the strongest one's power is residue of a rate that changed within the dwell.
LEAST_POWER_SHARE = 0.12

#: A comb with more than this many times the power of the weakest may be that many unresolved rotors. Where four like
#: rotors were resolved, their powers were within a factor of 1.7 in 94 of 100 records; where two were merged, they were
#: not in 92.
TWO_POWER = 1.7

#: Gauss-Newton steps of the joint fit: JOINT_STEPS as each rotor is added; LAST_STEPS once all are found, as only then
#: their standard deviations matter; FURTHER_STEPS before a residual is called unresolved, as strong lines not fitted to
#: convergence leave part of themselves.
JOINT_STEPS, LAST_STEPS, FURTHER_STEPS = 2, 1, 4

#: The joint fit is repeated until its residual exceeds FITTED_SHARE of the one before, MOST_FITS times at most.
FITTED_SHARE, MOST_FITS = 0.9, 8

#: Lines are sought out to this multiple of the family's edge: further out, residue of strong ones may pass for more.
FURTHEST = 1.5

#: Two rates are resolved if their lines at the outermost order lie this far apart [bins].
RESOLVED_BINS = 0.9


def resolution(pulses: int, reach: int) -> float:
    """Least difference of two rates that is resolved by lines out to an order [cycles a sample]."""
    return RESOLVED_BINS / (reach * pulses)


@dataclass(frozen=True)
class Rotors:
    """Single rotors of one record.

    Parameters
    ----------
    rates, stds : ndarray, shape (rotors,)
        Chopping frequency of each, rising, and its standard deviation [cycles a sample].
    resolved : bool
        False where a residual remains between the combs that is no further comb: rates lie closer than the dwell
        resolves, or changed within it. The number of rotors is then a lower bound.
    spread : float
        Range of the rates [cycles a sample], unresolved ones included as far as they show; 0 for a single rotor.
    fits : list of CombFit
        Their lines.
    rest : ndarray of complex128, shape (pulses,)
        Residual samples of these fits.
    next_rate : float
        The rate near those found that had the most evidence when a further rotor was last sought, whether it was one or
        not [cycles a sample].
    row_edge : (float, float) or None
        Edge of the lines of a lone rotor whose blades are rows of points, and its standard deviation [cycles a sample
        from the body].
    unseen : float
        Range of rates that may hold further rotors of wandering rate, none of whose lines are seen [cycles a sample].
    """

    rates: NDArray[np.float64]
    stds: NDArray[np.float64]
    resolved: bool
    spread: float
    fits: list[CombFit]
    rest: NDArray[np.complex128]
    next_rate: float
    row_edge: tuple[float, float] | None = None
    unseen: float = 0.0

    @classmethod
    def of(
        cls,
        fits: Sequence[CombFit],
        rest: NDArray[np.complex128],
        *,
        resolved: bool,
        next_rate: float,
        least_spread: float = 0.0,
    ) -> Self:
        """Rotors of these combs, one rotor per comb, their rates rising."""
        rising = sorted(fits, key=lambda fit: fit.spacing)
        rates, stds = np.array([(fit.spacing, fit.spacing_std) for fit in rising]).T.copy()
        return cls(rates, stds, resolved, max(float(np.ptp(rates)), least_spread), rising, rest, next_rate)


def powers_of(fits: Sequence[CombFit]) -> list[float]:
    """Median line power of each comb, over the orders that all of them reach.

    Not the mean: overlapping lines of two rotors may be fitted as large amplitudes that cancel.
    """
    return [float(np.median(powers)) for powers in _line_powers(fits)]


def _line_powers(fits: Sequence[CombFit]) -> list[NDArray[np.floating]]:
    """Power of each line of each comb, over the orders that all of them reach."""
    common = min(fit.outermost for fit in fits)
    return [squared(fit.amplitudes[np.abs(fit.orders) <= common]) for fit in fits]


def may_hold(fits: Sequence[CombFit], least: float = TWO_POWER) -> NDArray[np.float64]:
    """How many rotors each comb may hold: its power over the weakest comb's where that exceeds `least`, else 1."""
    powers = np.array([powers.mean() for powers in _line_powers(fits)])
    times = np.minimum(powers / powers.min(), MAX_ROTORS)
    return np.where(times > least, times, 1.0)


def hidden_shift(fits: Sequence[CombFit]) -> float:
    """Error of the combs' mean rate if those that may hold several rotors do so [cycles a sample]."""
    rates = np.array([fit.spacing for fit in fits])
    return float(np.average(rates, weights=np.rint(may_hold(fits))) - rates.mean())


def nearer_than(fits: Sequence[CombFit], resolution: float) -> bool:
    """True where two rates lie closer than the dwell resolves."""
    rates = np.sort([fit.spacing for fit in fits])
    return len(rates) > 1 and float(np.diff(rates).min()) < resolution


@dataclass(frozen=True)
class _Verdict:
    """Verdict on a candidate rate: added as a rotor, unresolved from those found, or no rotor's (both False).

    `spread` is the range of the unresolved rates [cycles a sample].
    """

    added: bool = False
    unresolved: bool = False
    spread: float = 0.0


_ADDED, _NO_ROTOR = _Verdict(added=True), _Verdict()


@dataclass(frozen=True)
class Sought:
    """A candidate for a rotor.

    Parameters
    ----------
    rate : float
        [cycles a sample].
    reach : int
        Outermost order.
    evidence : float
        [nats].
    is_apart : bool
        Whether its rate is far from the first one's.
    change : float
        Relative change of the rate over the dwell.
    """

    rate: float
    reach: int
    evidence: float
    is_apart: bool
    change: float = 0.0


class Separation:
    """The rotors found so far; one is added at a time."""

    def __init__(self, data: Periodogram, comb: Comb, centre: float, reach: int) -> None:
        self.data, self.comb, self.centre = data, comb, centre
        self.nominal = comb.chopping
        self.reach = reach
        self.resolution = resolution(data.pulses, reach)
        self.furthest = min(FURTHEST * self.nominal * reach, 0.5)
        self.fits: Sequence[CombFit] = []
        self.reaches: list[int] = []
        self.rest = data
        self.level: Level | None = None  # of the residual, once computed
        self.fitted_out = True  # no gain from fitting these once more
        self.seeks_apart = True

    @property
    def is_hopeless(self) -> bool:
        """Whether the residual is more than a closer fit, or one more rotor, will ever explain."""
        return False

    @property
    def rates(self) -> list[float]:
        """Rates of the rotors found [cycles a sample]."""
        return [fit.spacing for fit in self.fits]

    def sought(self) -> list[Sought]:
        """Candidates with the most evidence near the known rates and far from them; the strongest first."""
        ends = [self.nominal, *self.rates]
        rates = np.arange(min(ends) * (1 - RATE_SPREAD), max(ends) * (1 + RATE_SPREAD), self.resolution / 4)
        out = [self._strongest(rates)]
        if self.fits and self.seeks_apart:
            apart = self._strongest_apart()
            known = max(reach * rate for reach, rate in zip(self.reaches, self.rates, strict=True))
            if apart.rate * apart.reach > APART_REACH * known:
                out.append(apart)
        return sorted(out, key=lambda one: -one.evidence)

    def _strongest(self, rates: NDArray[np.float64], *, is_apart: bool = False) -> Sought:
        """The candidate with the most evidence among rising rates."""
        return self._loudest_in(self.rest, rates, is_apart=is_apart)

    def _loudest_in(self, data: Periodogram, rates: NDArray[np.float64], *, is_apart: bool) -> Sought:
        """The same in a given record, by the evidence of line powers and flashes."""
        sums, reach = even_scores(data.contrast, rates, np.full(len(rates), self.centre), self.furthest)
        order, far = np.arange(1, reach.max() + 1), np.flatnonzero(reach >= LEAST_LINES)  # fewer lines show no flash
        frequency = self.centre + np.array([-1, 1])[:, None, None] * rates[far, None] * order
        seen = data.usable(frequency) & (order <= reach[far, None])
        sums[far] += flash_nats(np.where(seen, data.amplitude[data.bins_of(frequency)], 0)).sum(axis=0)
        best = int(sums.argmax())
        return Sought(float(rates[best]), int(reach[best]), float(sums[best]), is_apart)

    def _strongest_apart(self) -> Sought:
        """The same among rates further from the nominal one than those of rotors in hover.

        If such rates were not sought, their lines would pass for combs of rates in between that have only every third
        or fourth line. Where unresolved lines fill all places, no far rate gains evidence.
        """
        step = max(resolution(self.data.pulses, INNER_ORDERS), self.resolution) / 4
        low, high = FURTHEST_SPREAD
        rates = np.arange(self.nominal * (1 + low), self.nominal * (1 + high), step)
        rates = rates[np.abs(rates / self.nominal - 1) > RATE_SPREAD]
        inner_reach = min(INNER_ORDERS * self.nominal, self.furthest)
        inner, _ = even_scores(self.rest.contrast, rates, np.full(len(rates), self.centre), inner_reach)
        near = np.arange(-step, step * 1.01, self.resolution / 4)
        return self._strongest(float(rates[inner.argmax()]) + near, is_apart=True)

    def in_turn(self, sought: list[Sought]) -> Iterator[Sought]:
        """The candidates; then, if none was added, the rotor of which the strongest may hold some lines."""
        yield from sought
        if self.fits:
            yield from self._louder_whole(sought[0])

    def _louder_whole(self, one: Sought) -> list[Sought]:
        """The rotor at one of `RATIOS` times a candidate's rate: at most one, if it has more evidence."""
        low, high = FURTHEST_SPREAD
        rates = one.rate * RATIOS
        away = rates / self.nominal - 1
        rates = rates[(away > low - RATE_SPREAD) & (away < high + RATE_SPREAD)]
        tried = np.sort((rates[:, None] + self._near()).ravel())
        if not len(tried):
            return []
        found = self._strongest(tried, is_apart=True)
        return [found] if found.evidence > one.evidence else []

    def _near(self) -> NDArray[np.float64]:
        """Offsets at which rates are tried about one that is roughly right [cycles a sample]."""
        return np.arange(-1, 1.01, 0.25) * self.resolution

    def join(self, one: Sought) -> _Verdict:
        """Add a candidate if it is a rotor's."""
        if one.is_apart and is_twice(self.rest, self.centre, one.rate, self.fits):
            one = replace(one, rate=one.rate / 2, reach=2 * one.reach)
        if one.is_apart and is_between(self.rest, self.centre, one.rate, self.fits, self.reach):
            return _NO_ROTOR
        rate, reach = one.rate, one.reach
        same = [abs(rate - known) < self.resolution for known in self.rates]
        if any(same):  # lines of a known rotor, perhaps further out than those fitted
            further = [max(r, reach) if own else r for r, own in zip(self.reaches, same, strict=True)]
            if further != self.reaches and self._may_fit(further):
                self.reaches, self.fitted_out = further, False
            return self._unresolved(rate)
        if not self.fits and self._is_the_comb(rate):
            self.fits, self.reaches = [self.comb.fit], [reach]
            self.rest, self.level = self.data.left(self.comb.rest), None
            return _ADDED
        if not self._may_fit([*self.reaches, reach]):
            return self._unresolved(rate)
        fitted = self._fitted(one, JOINT_STEPS)
        if fitted is None:
            return _NO_ROTOR
        together, _ = fitted
        if self.fits and lines_apart(together[-1], self.data.pulses, GEAR_FACTOR) > 1:
            self.seeks_apart &= not one.is_apart
            return _NO_ROTOR
        if nearer_than(together, self.resolution):
            return self._unresolved(rate)
        powers = powers_of(together)
        if powers[-1] < LEAST_POWER_SHARE * max(powers):  # beside several, such a rate is residue
            return self._unresolved(rate) if len(self.fits) == 1 else _Verdict(unresolved=True)
        self.reaches = [*self.reaches, reach]
        self._take(*fitted)
        self.fitted_out = False
        return _ADDED

    def _unresolved(self, rate: float) -> _Verdict:
        return _Verdict(unresolved=True, spread=float(np.ptp([rate, *self.rates])))

    def fit_out(self, steps: int) -> bool:
        """Fit the rotors found again, repeatedly while the residual falls much; whether anything was done."""
        if self.fitted_out:
            return False
        self.fitted_out, done = True, False
        self.reaches = self._alike()
        for _ in range(MOST_FITS):
            fitted = self._fitted(None, steps)
            if fitted is None or nearer_than(fitted[0], self.resolution):
                return done
            left = energy(self.rest.samples)
            self._take(*fitted)
            done = True
            if energy(self.rest.samples) > FITTED_SHARE * left:
                break
        return done

    def _alike(self) -> list[int]:
        """Outermost orders of the rotors: each raised to that of the like rotor that reaches furthest.

        When a rotor was added, rotors not found yet hid its outer lines.
        """
        pairs = list(zip(self.reaches, self.rates, strict=True))
        alike = [max(r for r, other in pairs if abs(other / rate - 1) < 2 * RATE_SPREAD) for _, rate in pairs]
        return alike if self._may_fit(alike) else self.reaches

    def make_whole(self) -> None:
        """Seek again rotors that have only every so-many-th line, now that the others are known.

        When each was added, lines of rotors not found yet stood between its own or passed for some of them.
        """
        for known in 2 * self.rates:  # twice: some show only once others are whole
            number = int(np.abs(np.array(self.rates) - known).argmin())
            times = lines_apart(self.fits[number], self.data.pulses, UNEQUAL_FACTOR) if len(self.fits) > 1 else 1
            if times == 1:
                continue
            whole = times * self.rates[number]
            before = self.fits, self.reaches, self.rest, self.level
            self.fits = [fit for other, fit in enumerate(self.fits) if other != number]
            self.reaches = [reach for other, reach in enumerate(self.reaches) if other != number]
            self.fitted_out = False
            if not self.fit_out(FURTHER_STEPS):
                self.fits, self.reaches, self.rest, self.level = before
                continue
            rates = whole / np.arange(1, max(times, MOST_BLADES) + 1)
            one = self._strongest(np.sort((rates[:, None] + self._near()).ravel()))
            if one.evidence > FURTHER_EVIDENCE and self.join(one).added:
                self.fit_out(FURTHER_STEPS)

    def _take(self, fits: Sequence[CombFit], samples: NDArray[np.complex128]) -> None:
        """Store these fits and their residual."""
        self.fits, self.level = fits, self.data.level_of(samples)
        self.rest = self.data.left(samples, self.level)

    def _is_the_comb(self, rate: float) -> bool:
        """True where a rate is that of the comb found, whose fit is known."""
        return self.comb.per_turn == 1 and abs(rate - self.nominal) < self.resolution

    def _may_fit(self, reaches: list[int]) -> bool:
        """True where combs out to these orders have no more lines than may be fitted jointly."""
        return 2 * sum(reaches) <= MOST_LINES

    def _level_about(self) -> Level:
        """Local level of the residual, without the combs known already."""
        self.level = self.level or self.data.level_of(self.rest.samples)
        return self.level

    def _fitted(self, further: Sought | None, steps: int) -> tuple[Sequence[CombFit], NDArray[np.complex128]] | None:
        """Joint fit of the rotors found, and of a further one if given: as from `fit_combs`."""
        centre = self.centre if further else self.fits[0].centre
        rates = [*self.rates, further.rate] if further else self.rates
        reaches = [*self.reaches, further.reach] if further else self.reaches
        outermost = [(-reach, reach) for reach in reaches]
        return fit_combs(self.data, centre, rates, outermost, steps, level_about=self._level_about())


def separate_rotors(data: Periodogram, comb: Comb, edge: float, how: type[Separation] = Separation) -> Rotors:
    """Separate the rotors of one record.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it.
    edge : float
        Edge of the line family [cycles a sample from the body].
    how : type
        How they are sought and fitted.

    Returns
    -------
    Rotors
        At least one.
    """
    nominal, centre = comb.chopping, comb.fit.centre
    # one comb fitted to several rotors has its centre between theirs: the line of a body near it is a better centre
    for line, level_db in data.strong.lines:
        if level_db > LINE_DB and abs(line - centre) * data.pulses < 1.5 and abs(line) > data.rest_half:
            centre = line
    reach = max(comb.last // comb.per_turn, int(np.clip(round(edge / nominal), 1, 0.45 / nominal)))
    alone = Rotors(np.array([nominal]), np.array([comb.chopping_std]), True, 0.0, [comb.fit], comb.rest, nominal)
    if reach * RATE_SPREAD * nominal * data.pulses < 2:
        return alone
    found = how(data, comb, centre, reach)
    left_open = replace(alone, resolved=False, spread=found.resolution)
    first, most, rate, last = 0.0, 0.0, nominal, _NO_ROTOR
    while len(found.fits) < MAX_ROTORS:
        sought = found.sought()
        evidence = sought[0].evidence
        rate = next(one.rate for one in sought if not one.is_apart)
        most = max(most, evidence)
        if not found.fits:
            first = evidence
        least = max(FURTHER_EVIDENCE if len(found.fits) > 1 else LEAST_EVIDENCE, LEAST_SHARE * first)
        if evidence < max(least, DOUBTFUL_SHARE * most) and found.is_hopeless:
            return left_open
        if evidence < least:
            break
        if evidence < DOUBTFUL_SHARE * most and found.fit_out(FURTHER_STEPS):
            continue
        said = []
        for one in found.in_turn(sought):
            verdict = found.join(one) if one.evidence >= least else _NO_ROTOR
            if verdict.added:
                break
            # a far candidate that is no rotor, as a tail's lines, says nothing of rotors near the first
            if one in sought and (verdict.unresolved or not one.is_apart):
                said.append(verdict)
        else:
            if found.is_hopeless:
                return left_open
            if found.fit_out(FURTHER_STEPS):
                continue
            last = said[0]
            break
    if not found.fits:
        return left_open if last.unresolved else alone
    found.fit_out(LAST_STEPS)
    found.make_whole()
    least = max(last.spread, found.resolution) if last.unresolved else 0.0
    resolved = not last.unresolved
    return Rotors.of(found.fits, found.rest.samples, resolved=resolved, next_rate=rate, least_spread=least)
