"""Several rotors whose rates change within the dwell, each in its own way: resolved.

Resampling the record for one rotor, as `drift` does, narrows the lines of that rotor alone. So each is sought over
rates and changes at once, and all are fitted to the record as it is.
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
from .rotors import Rotors, Separation, Sought, nearer_than, resolution
from .slow_lines import remove_bands
from .turning import DEGREES, FIRST_DEGREES, Resampling, even_change, late_by, margin_of
from .unresolved import LEFT_WANDERING, left_over, power_about

#: Relative changes over the dwell are tried up to FURTHEST_CHANGE, in MOST_STEPS steps to each side at most. A step
#: moves the outermost lines at the ends of the dwell by STEP_RAD, so that they are at most half of that off.
FURTHEST_CHANGE, STEP_RAD, MOST_STEPS = 0.03, 1.6, 12

#: Changing rotors are sought only over fewer chopping periods than this: over more, rates change in more ways.
MOST_PERIODS = 100.0

#: Most Gauss-Newton steps as a rotor is added, with linear changes alone, and once all are found.
COMING_STEPS, ALL_STEPS = 3, 8

#: STEADY_STEPS: most steps of a fit with steady rates. STEADY_FALL: rates are steady unless the changing fit lowers the
#: residual energy by more than this for each parameter of change, in noise powers of a sample; chance gives half. (Four
#: like rotors that change by up to 0.3 % lower it by 33 and more at 0 dB, 44 to 180 at 10, where 20 are asked; steady
#: ones by -6 to 0.)
STEADY_STEPS, STEADY_FALL = 30, 1.0

#: Lines are sought this many times further out than for steady rotors: smeared lines hide their reach.
FURTHER = 1.5


def may_be_sought(data: Periodogram, nominal: float, reach: int) -> bool:
    """True where changing rotors about a rate [cycles a sample], of that reach, are within the cost limits."""
    return 4 * reach <= most_lines(data.pulses) and nominal * data.pulses < MOST_PERIODS


def as_steady(data: Periodogram, apart: Rotors) -> Rotors | None:
    """Rotors resolved as changing ones, fitted with steady rates; None where the rates do change.

    Steady rotors not all found, or not fitted to convergence, leave as large a residual as changing ones. Where lines
    take up most of the record, spurious changes then bias the rates by many standard deviations.

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
    reach = max(max(map(abs, fit.reach)) for fit in steady[0])
    if nearer_than(steady[0], resolution(data.pulses, reach)):
        return None
    return Rotors.of(*steady, resolved=apart.resolved, next_rate=apart.next_rate)


class ChangingSeparation(Separation):
    """Rotors found so far, each with a changing rate.

    All are sought near the rate of the comb found: residue of another's fit may also look like a far rate with some
    change.
    """

    def __init__(self, data: Periodogram, comb: Comb, centre: float, reach: int) -> None:
        super().__init__(data, comb, centre, reach)
        self.seeks_apart = False
        self.furthest = min(FURTHER * self.furthest, 0.5)
        self._read: dict[float, Periodogram] = {}  # resampled residuals, by the change taken out
        # for each change tried, the delays at which a record is read to take it out
        self._late = {change: late_by(even_change(change, data.pulses), data.pulses) for change in self._changes()}
        self._left: Resampling | None = None

    @property
    def is_hopeless(self) -> bool:
        """Whether rates wander, which are seldom resolved: smooth changes leave hardly any residual by now."""
        if self.fitted_out or not self.fits:
            return False
        about = power_about(self.data, self.rest.samples, self.fits[0].centre)
        return left_over(about, self.fits, self.reach * self.nominal).share > LEFT_WANDERING

    def in_turn(self, sought: list[Sought]) -> Iterator[Sought]:
        """The candidates."""
        return iter(sought)

    def _strongest(self, rates: NDArray[np.float64], *, is_apart: bool = False) -> Sought:
        return max((self._by(change, rates, is_apart=is_apart) for change in self._late), key=lambda s: s.evidence)

    def _changes(self) -> list[float]:
        """Relative changes over the dwell that are tried."""
        turns = self.nominal * self.reach * self.data.pulses  # a linear change c shifts the ends by c / 8 of these
        step = STEP_RAD * 8 / (2 * np.pi * turns)
        count = min(int(FURTHEST_CHANGE / step), MOST_STEPS)
        return [float(change) for change in step * np.arange(-count, count + 1)]

    def _by(self, change: float, rates: NDArray[np.float64], *, is_apart: bool) -> Sought:
        """The strongest candidate in the residual, resampled for a rotor of that change."""
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
        return False  # its fit assumes a steady rate

    def _may_fit(self, reaches: list[int]) -> bool:
        return super()._may_fit(reaches) and 2 * sum(reaches) <= most_lines(self.data.pulses)

    def _alike(self) -> list[int]:
        return self.reaches  # lines that are smeared end elsewhere for each

    def _further(self) -> list[int]:
        """Outermost orders extended by `FURTHER`, if so many may be fitted: weak lines are shrunk."""
        more = [
            min(int(FURTHER * reach), int(0.45 / rate)) for reach, rate in zip(self.reaches, self.rates, strict=True)
        ]
        return more if self._may_fit(more) else self.reaches

    def _fitted(
        self, further: Sought | None, steps: int
    ) -> tuple[Sequence[ChangingFit], NDArray[np.complex128]] | None:
        """As in `Separation`, with step limits of its own in place of `steps`."""
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
