"""The gain that all lines of a record share over the dwell: a beam that sweeps past, a range cell that is left, fading.

Lines that swell and fall are wider than steady ones, all alike, and what a fit of steady ones leaves of them passes for
more rotors. The gain is told from the lines fitted, as a factor on their sum, and divided out: lines are then what they
would be, and noise is louder where they were weak.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..lines import energy, middle_times, squared
from ..spectrum import Spectrum
from .comb_fit import CombFit, fit_combs
from .periodogram import Periodogram, prepared_again

#: The gain is a sum of Legendre polynomials in time up to this degree, and to this share of the flashes in the dwell.
DEGREE, FLASH_SHARE = 8, 0.75

#: What the lines explain more by it is no chance from so many nats on.
LEAST_NATS = 15.0

#: Nowhere is it taken to be below this share of the root of its mean square.
LEAST_GAIN = 0.1

#: Combs are fitted so many times at most as their gain becomes known.
FITTED_STEPS = 4


def gain_left(data: Periodogram, rest: NDArray[np.complex128], chopping: float) -> tuple[NDArray[np.float64], float]:
    """Gain over the dwell that lines still have, and how much of what they leave it explains.

    Parameters
    ----------
    data : Periodogram
        The record.
    rest : ndarray of complex128, shape (pulses,)
        What the lines fitted leave of its samples.
    chopping : float
        Chopping frequency [cycles a sample].

    Returns
    -------
    gain : ndarray of float64, shape (pulses,)
        Its mean, weighed by the power of the lines, is 1.
    share : float
        Share of the power left, without the noise, that it explains, 0 to 1; 0 where it may be chance.
    """
    pulses = data.pulses
    degree = min(DEGREE, int(FLASH_SHARE * chopping * pulses))
    shapes = np.polynomial.legendre.legvander(2 * middle_times(pulses) / pulses, degree).T
    lines = data.samples - rest
    seen = shapes @ (lines.conj() * data.samples).real
    products = (shapes * squared(lines)) @ shapes.T
    factors = np.linalg.solve(products, seen)
    nats = float(seen @ factors - seen[0] ** 2 / products[0, 0])
    if nats < LEAST_NATS:
        return np.ones(pulses), 0.0
    left = energy(rest) - pulses
    return factors @ shapes, nats / max(left, nats)


@dataclass(frozen=True)
class Evened:
    """A record as if its lines had been as strong all the time, as far as their gain is known.

    Parameters
    ----------
    whole : Periodogram
        The record as it is.
    spectrum : Spectrum
        What that was prepared with.
    gain : ndarray of float64, shape (pulses,)
        What its lines have.
    record : Periodogram
        The record with that divided out.
    """

    whole: Periodogram
    spectrum: Spectrum
    gain: NDArray[np.float64]
    record: Periodogram

    @classmethod
    def of(cls, data: Periodogram, spectrum: Spectrum) -> Self:
        """A record as it is."""
        return cls(data, spectrum, np.ones(data.pulses), data)

    def by(self, gain: NDArray[np.float64]) -> Self:
        """With a gain that its lines have besides divided out."""
        gain = self.gain * gain
        noise = np.maximum(gain / np.sqrt((gain**2).mean()), LEAST_GAIN) ** -2.0
        noise /= noise.mean()
        away = middle_times(len(gain)) ** 2
        ends_noise = self.whole.ends_noise * float((away * noise).mean() / away.mean())
        record = prepared_again(self.whole.samples * np.sqrt(noise), self.spectrum, ends_noise)
        return replace(self, gain=gain, record=record)

    def further(
        self, data: Periodogram, rest: NDArray[np.complex128], chopping: float, least_share: float
    ) -> Self | None:
        """By what lines in it, or in what was made of it, leave; None where a gain explains less than a share of it."""
        gain, share = gain_left(data, rest, chopping)
        return self.by(gain) if share >= least_share else None

    def fitted_to(self, fits: Sequence[CombFit], least_share: float) -> Self:
        """The same once combs are fitted to it, as often as that tells more of their gain."""
        even = self
        for _ in range(FITTED_STEPS):
            spacings = [fit.spacing for fit in fits]
            fitted = fit_combs(even.record, fits[0].centre, spacings, [fit.reach for fit in fits])
            if fitted is None:
                break
            fits, rest = fitted
            further = even.further(even.record, rest, min(fit.spacing for fit in fits), least_share)
            if further is None:
                break
            even = further
        return even
