"""The gain that all lines of a record share over the dwell: a beam sweeping past, a target leaving its cell, fading.

Lines of varying gain are wider than steady ones, all alike, and the residual of a steady fit passes for more rotors.
The gain is estimated as a factor on the sum of the fitted lines, and divided out. Lines are then steady, and noise is
louder where the gain was low.
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

#: The gain is a sum of Legendre polynomials in time, up to DEGREE and up to FLASH_SHARE of the number of flashes in the
#: dwell.
DEGREE, FLASH_SHARE = 8, 0.75

#: Least increase in log likelihood for a gain that is not chance [nats].
LEAST_NATS = 15.0

#: The gain is nowhere taken to be below this share of its root mean square.
LEAST_GAIN = 0.1

#: Fits of the combs at most, each after a better estimate of their gain.
FITTED_STEPS = 4


def gain_left(data: Periodogram, rest: NDArray[np.complex128], chopping: float) -> tuple[NDArray[np.float64], float]:
    """Gain over the dwell that lines still have, and the share of their residual that it explains.

    Parameters
    ----------
    data : Periodogram
        The record.
    rest : ndarray of complex128, shape (pulses,)
        Residual of the lines fitted to its samples.
    chopping : float
        Chopping frequency [cycles a sample].

    Returns
    -------
    gain : ndarray of float64, shape (pulses,)
        Its mean, weighed by the power of the lines, is 1.
    share : float
        Share of the residual power, less noise, that the gain explains, 0 to 1; 0 where it may be chance.
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
class GainCorrected:
    """A record with the gain of its lines, as far as known, divided out.

    Parameters
    ----------
    whole : Periodogram
        The record as it is.
    spectrum : Spectrum
        Spectrum it was prepared with.
    gain : ndarray of float64, shape (pulses,)
        Gain of its lines.
    record : Periodogram
        The record with that gain divided out.
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
        """The same with a further gain of its lines divided out."""
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
        """The same with the gain seen in a residual divided out; None where that explains less than a share of it."""
        gain, share = gain_left(data, rest, chopping)
        return self.by(gain) if share >= least_share else None

    def fitted_to(self, fits: Sequence[CombFit], least_share: float) -> Self:
        """The same after repeated fits of combs, while each shows more of their gain."""
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
