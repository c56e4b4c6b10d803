"""Several rotors whose rates change within the dwell, each in its own way: told apart.

What `drift` does for one rotor, to read the record at the times at which it turns evenly, narrows the lines of that one
alone. So each is sought among rates and changes at once, and all are fitted to the record as it is.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .changing_fit import ChangingFit, Start, fit_changing
from .comb_fit import CombFit
from .periodogram import Periodogram
from .rotors import Separation, Sought
from .slow_lines import remove_bands
from .turning import DEGREES, FIRST_DEGREES, even_change, late_by, margin_of, resampled

#: Rotors are sought that change by up to this over the dwell, relative, in steps that put the outermost lines at its
#: ends out by half of so many radians; so many steps to each side at most.
FURTHEST_CHANGE, STEP_RAD, MOST_STEPS = 0.03, 1.6, 12

#: Gauss-Newton steps at most as a rotor comes in, of even changes alone, and once all are found.
ADDING_STEPS, LAST_STEPS = 3, 8

#: Samples of all lines together, at most: memory grows with them, and time with their product with the lines.
MOST_SAMPLES = 6_000_000


class ChangingSeparation(Separation):
    """Rotors found so far, each of a rate that changes."""

    _read: dict[float, Periodogram] | None = None

    def _strongest(self, rates: NDArray[np.float64], *, is_apart: bool = False) -> Sought:
        return max((self._by(change, rates, is_apart=is_apart) for change in self._changes()), key=lambda s: s.evidence)

    def _changes(self) -> NDArray[np.float64]:
        """Changes over the dwell that are tried, relative."""
        turns = self.nominal * self.reach * self.data.pulses  # an even change puts the ends out by an eighth of it
        step = STEP_RAD * 8 / (2 * np.pi * turns)
        count = min(int(FURTHEST_CHANGE / step), MOST_STEPS)
        return np.asarray(step * np.arange(-count, count + 1), np.float64)

    def _by(self, change: float, rates: NDArray[np.float64], *, is_apart: bool) -> Sought:
        """The loudest in what is left, read as a rotor of that change turns evenly."""
        held = self._read_at(float(change)) if change else self.rest
        return replace(self._loudest_in(held, rates, is_apart=is_apart), change=float(change))

    def _read_at(self, change: float) -> Periodogram:
        if self._read is None:
            self._read = {}
        if change not in self._read:
            pulses, margin = self.data.pulses, margin_of(self.data.pulses)
            late = late_by(even_change(change, pulses), pulses)
            even = resampled(np.pad(self.rest.samples, margin), self.centre, late)
            self._read[change] = self.data.left(remove_bands(even, self.data.bands), self.level)
        return self._read[change]

    def _take(self, fits: Sequence[CombFit], samples: NDArray[np.complex128]) -> None:
        super()._take(fits, samples)
        self._read = None

    def _is_the_comb(self, rate: float) -> bool:
        return False  # that was fitted as if it did not change

    def _may_fit(self, reaches: list[int]) -> bool:
        return super()._may_fit(reaches) and 2 * sum(reaches) * self.data.pulses <= MOST_SAMPLES

    def _fitted(
        self, further: Sought | None, steps: int
    ) -> tuple[Sequence[ChangingFit], NDArray[np.complex128]] | None:
        self.level = self.level or self.data.level_of(self.rest.samples)
        starts = [
            Start(fit.spacing, reach, fit.ahead)
            for fit, reach in zip(self.fits, self.reaches, strict=True)
            if isinstance(fit, ChangingFit)
        ]
        if further is None:
            centre, degrees, most = self.fits[0].centre, len(DEGREES), LAST_STEPS
        else:
            starts.append(Start(further.rate, further.reach, even_change(further.change, self.data.pulses)))
            centre, degrees, most = self.centre, FIRST_DEGREES, ADDING_STEPS
        return fit_changing(self.data, starts, centre, degrees=degrees, steps=most, level_about=self.level)
