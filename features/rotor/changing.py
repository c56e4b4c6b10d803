"""Several rotors whose rates change within the dwell, each in its own way: told apart.

What `drift` does for one rotor, to read the record at the times at which it turns evenly, narrows the lines of that one
alone. So each is sought among rates and changes at once, and all are fitted to the record as it is.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..lines import energy
from .changing_fit import ChangingFit, Start, fit_changing, most_lines
from .comb import Comb
from .comb_fit import CombFit, fit_combs
from .periodogram import Periodogram
from .rotors import RESOLVED_BINS, Rotors, Separation, Sought, nearer_than
from .slow_lines import remove_bands
from .turning import DEGREES, FIRST_DEGREES, Resampling, even_change, late_by, margin_of
from .unresolved import LEFT_WANDERING, left_over, power_about

#: Rotors are sought that change by up to this over the dwell, relative, in steps that put the outermost lines at its
#: ends out by half of so many radians; so many steps to each side at most.
FURTHEST_CHANGE, STEP_RAD, MOST_STEPS = 0.03, 1.6, 12

#: And over so many periods of the chopping frequency at most: rates change in more ways in more of them.
MOST_PERIODS = 100.0

#: Gauss-Newton steps at most as a rotor comes in, of even changes alone, and once all are found.
COMING_STEPS, ALL_STEPS = 3, 8

#: Steady rotors are fitted in so many steps at most. What changing ones leave less than these, over the noise of a
#: sample, is no change up to so much for each number that tells of one: by chance it is half. (Four like rotors that
#: change by up to 0.3 % leave 33 and more at 0 dB, 44 to 180 at 10, where 20 are asked; steady ones -6 to 0.)
STEADY_STEPS, STEADY_FALL = 30, 1.0

#: Lines are looked for so many times further than those of steady rotors: smeared ones hide how far they reach.
FURTHER = 1.5


def may_be_sought(data: Periodogram, nominal: float, reach: int) -> bool:
    """True where changing rotors about a rate [cycles a sample] and of that reach are not too much to seek and fit."""
    return 4 * reach <= most_lines(data.pulses) and nominal * data.pulses < MOST_PERIODS


def as_steady(data: Periodogram, apart: Rotors) -> Rotors | None:
    """Rotors told apart as changing ones, fitted as steady ones; None where they do change.

    Steady rotors that were not all found, or not fitted to the end, leave as much as if they changed. Where lines take
    up most of the record, changes that are none then bend the rates by many deviations.

    Parameters
    ----------
    data : Periodogram
        The record.
    apart : Rotors
        From `separate_rotors` with `ChangingSeparation`.
    """
    fits, starts = apart.fits, [fit.spacing for fit in apart.fits]
    level = data.level_of(apart.rest)
    steady = fit_combs(data, fits[0].centre, starts, [fit.reach for fit in fits], STEADY_STEPS, level_about=level)
    numbers = len(fits) * len(DEGREES)
    if steady is None or energy(steady[1]) - energy(apart.rest) > STEADY_FALL * numbers:
        return None
    known, rest = steady
    reach = max(max(map(abs, fit.reach)) for fit in known)
    if nearer_than(known, RESOLVED_BINS / (reach * data.pulses)):
        return None
    rates, stds = np.array([fit.spacing for fit in known]), np.array([fit.spacing_std for fit in known])
    return replace(apart, rates=rates, stds=stds, spread=float(np.ptp(rates)), fits=known, rest=rest)


class ChangingSeparation(Separation):
    """Rotors found so far, each of a rate that changes.

    All are like the comb found: what the fit of another leaves may be one of a far rate and some change as well.
    """

    def __init__(self, data: Periodogram, comb: Comb, centre: float, reach: int) -> None:
        super().__init__(data, comb, centre, reach)
        self.seeks_apart = False
        self.furthest = min(FURTHER * self.furthest, 0.5)
        self._read: dict[float, Periodogram] = {}  # what is left, by the change at which it was read
        # by how much later each of the changes that are tried has turned as far
        self._late = {change: late_by(even_change(change, data.pulses), data.pulses) for change in self._changes()}
        self._left: Resampling | None = None

    @property
    def is_hopeless(self) -> bool:
        """Of rates that change smoothly hardly anything is left by now; what wanders is seldom told, for all that."""
        if self.fitted_out or not self.fits:
            return False
        about = power_about(self.data, self.rest.samples, self.fits[0].centre)
        return left_over(about, self.fits, self.reach * self.nominal).share > LEFT_WANDERING

    def in_turn(self, sought: list[Sought]) -> Iterator[Sought]:
        """These."""
        return iter(sought)

    def _strongest(self, rates: NDArray[np.float64], *, is_apart: bool = False) -> Sought:
        return max((self._by(change, rates, is_apart=is_apart) for change in self._late), key=lambda s: s.evidence)

    def _changes(self) -> list[float]:
        """Changes over the dwell that are tried, relative."""
        turns = self.nominal * self.reach * self.data.pulses  # an even change puts the ends out by an eighth of these
        step = STEP_RAD * 8 / (2 * np.pi * turns)
        count = min(int(FURTHEST_CHANGE / step), MOST_STEPS)
        return [float(change) for change in step * np.arange(-count, count + 1)]

    def _by(self, change: float, rates: NDArray[np.float64], *, is_apart: bool) -> Sought:
        """The loudest in what is left, read as a rotor of that change turns evenly."""
        held = self._read_at(change) if change else self.rest
        return replace(self._loudest_in(held, rates, is_apart=is_apart), change=change)

    def _read_at(self, change: float) -> Periodogram:
        if change not in self._read:
            if self._left is None:
                self._left = Resampling(np.pad(self.rest.samples, margin_of(self.data.pulses)), self.centre)
            even = self._left.read(self._late[change])
            self._read[change] = self.data.left(remove_bands(even, self.data.strong.bands), self.level)
        return self._read[change]

    def _take(self, fits: Sequence[CombFit], samples: NDArray[np.complex128]) -> None:
        super()._take(fits, samples)
        outermost = max(reach * fit.spacing for reach, fit in zip(self.reaches, fits, strict=True))
        self.furthest = min(max(self.furthest, FURTHER * outermost), 0.5)
        self._read, self._left = {}, None

    def _is_the_comb(self, rate: float) -> bool:
        return False  # that was fitted as if it did not change

    def _may_fit(self, reaches: list[int]) -> bool:
        return super()._may_fit(reaches) and 2 * sum(reaches) <= most_lines(self.data.pulses)

    def _alike(self) -> list[int]:
        return self.reaches  # lines that are smeared end elsewhere for each

    def _further(self) -> list[int]:
        """Outermost orders with some more, if those may be fitted: weak ones are held back."""
        more = [
            min(int(FURTHER * reach), int(0.45 / rate)) for reach, rate in zip(self.reaches, self.rates, strict=True)
        ]
        return more if self._may_fit(more) else self.reaches

    def _fitted(
        self, further: Sought | None, steps: int
    ) -> tuple[Sequence[ChangingFit], NDArray[np.complex128]] | None:
        """As of `Separation`, but of its own numbers of steps."""
        reaches = self.reaches if further else self._further()
        starts = [
            Start(fit.spacing, reach, fit.ahead)
            for fit, reach in zip(self.fits, reaches, strict=True)
            if isinstance(fit, ChangingFit)
        ]
        if further is None:
            centre, degrees, most = self.fits[0].centre, len(DEGREES), ALL_STEPS
        else:
            starts.append(Start(further.rate, further.reach, even_change(further.change, self.data.pulses)))
            centre, degrees, most = self.centre, FIRST_DEGREES, COMING_STEPS
        level = self._level_about()
        return fit_changing(self.data, starts, centre, degrees=degrees, steps=most, level_about=level)
