"""Joint fit of combs whose rates change within the dwell, each in its own way, to the record as it is.

The phase of a line follows its rotor's turn. Inner products of such lines have no closed form and are formed at each
step.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lines import middle_times, squared
from .comb_fit import ENOUGH, NOTCH_RIDGE, CombFit, lines_at_one_place, orders_within, over_orders, ridges
from .periodogram import LEAST_LEVEL, Level, Periodogram
from .slow_lines import band_basis, remove_bands
from .turning import inverse_of, other_rate, own_polynomials
from .turning_lines import TurningLines

#: A step takes lines^2 x pulses multiplications (MOST_PRODUCTS), and holds several times lines x pulses samples
#: (MOST_SAMPLES limits that product).
MOST_PRODUCTS, MOST_SAMPLES = 3_000_000_000, 8_000_000


def most_lines(pulses: int) -> int:
    """How many lines are fitted together at most."""
    return min(int(np.sqrt(MOST_PRODUCTS / pulses)), MOST_SAMPLES // pulses)


@dataclass(frozen=True)
class Start:
    """Where the fit of a comb begins.

    Parameters
    ----------
    rate : float
        Spacing of its lines [cycles a sample].
    reach : int
        Outermost order to both sides.
    ahead : ndarray, shape (degrees,)
        Time ahead of a constant-rate rotor: coefficients of the polynomials of `DEGREES` [samples].
    """

    rate: float
    reach: int
    ahead: NDArray[np.float64]


@dataclass(frozen=True)
class ChangingFit(CombFit):
    """A comb of lines that follow a rotor whose rate changes.

    Parameters
    ----------
    ahead, ahead_std : ndarray of float64, shape (degrees,)
        Time ahead of a constant-rate rotor: coefficients of the polynomials of `DEGREES`, and standard deviations
        [samples], infinite for those that were not fitted.
    """

    ahead: NDArray[np.float64]
    ahead_std: NDArray[np.float64]


def _factored(
    products: NDArray[np.complex128], held_back: NDArray[np.float64]
) -> tuple[tuple[NDArray[np.complex128], bool], NDArray[np.float64]] | None:
    """Cholesky factor of products with a ridge added to their diagonal, and that ridge, raised if it must be."""
    from scipy.linalg import LinAlgError, cho_factor

    diagonal = products.diagonal().copy()
    for more in (0.0, NOTCH_RIDGE):
        products.flat[:: len(products) + 1] = diagonal + held_back + more
        try:
            return cho_factor(products, check_finite=False), held_back + more
        except LinAlgError:
            continue
    return None


class _Turning:
    """State of the fit of rotors about a body: rates, `ahead` polynomials, and the lines that follow them."""

    def __init__(self, data: Periodogram, starts: Sequence[Start], centre: float, degrees: int) -> None:
        self.pulses, self.count, self.degrees = data.pulses, len(starts), degrees
        self.time = middle_times(data.pulses)
        self.shapes = own_polynomials(data.pulses)[:degrees]
        self.centre, self.pull = centre, 0.0
        self.rates, self.ahead = np.array([one.rate for one in starts]), np.array([one.ahead for one in starts])
        self.orders = [orders_within(data, centre, one.rate, (-one.reach, one.reach)) for one in starts]
        self.order = np.concatenate(self.orders)
        self.comb = np.repeat(np.arange(self.count), [len(own) for own in self.orders])
        self.used = data.usable(self.frequency)
        # no step turns an outermost line by more than half a turn
        self._furthest = 0.5 / np.array([max(1, np.abs(own).max(initial=0)) for own in self.orders]) / self.rates

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Mean frequency of each line [cycles a sample]."""
        return np.asarray(self.centre + self.rates[self.comb] * self.order, np.float64)

    def lines(self) -> TurningLines:
        """All lines."""
        body = self.centre * self.time + self.pull * self.shapes[1]
        return TurningLines(body, list(zip(self.rates, self.ahead, strict=True)), self.comb, self.order)

    def gained(self, lines: TurningLines, counted: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Derivatives of a record by the body's velocity and acceleration and by each polynomial of each rotor.

        Shape (2 + rotors x degrees, pulses), for lines of the amplitudes `counted`.
        """
        leads = np.where(self.comb == np.arange(self.count)[:, None], counted * self.order * self.rates[self.comb], 0)
        turned = 2j * np.pi * lines.sums(np.concatenate([counted[None], leads]))
        return np.concatenate([turned[:1] * self.shapes[:2], *(one * self.shapes for one in turned[1:])])

    def take(self, step: NDArray[np.float64]) -> None:
        """Take a step in the parameters of `gained`."""
        self.centre += float(np.clip(2 * step[0] / self.pulses, -0.5 / self.pulses, 0.5 / self.pulses))
        self.pull += float(np.clip(step[1], -0.5, 0.5))
        limit = self._furthest[:, None]
        self.ahead[:, : self.degrees] += np.clip(step[2:].reshape(self.count, self.degrees), -limit, limit)
        # the first polynomial is a rate offset
        faster = 1 + np.array([other_rate(first, self.pulses) for first in self.ahead[:, 0]])
        self.rates, self.ahead = self.rates * faster, self.ahead / faster[:, None]
        self.ahead[:, 0] = 0

    def fits(
        self, std: NDArray[np.float64], amplitudes: NDArray[np.complex128], snr: NDArray[np.float64]
    ) -> list[ChangingFit]:
        """Each rotor's comb, with standard deviations in the order of `gained`."""
        out = []
        own_std = np.full(self.ahead.shape, np.inf)
        own_std[:, : self.degrees] = std[2:].reshape(self.count, self.degrees)
        centre_std = other_rate(std[0], self.pulses)
        for rotor, rate in enumerate(self.rates):
            own = (self.comb == rotor) & self.used
            rate_std = other_rate(own_std[rotor, 0], self.pulses) * rate
            known = (float(rate), self.centre, rate_std, centre_std)
            lines = (self.order[own], amplitudes[own], snr[own])
            out.append(ChangingFit(*known, *lines, self.ahead[rotor], own_std[rotor]))
        return out


def fit_changing(
    data: Periodogram,
    starts: Sequence[Start],
    centre: float,
    *,
    degrees: int,
    steps: int,
    level_about: Level,
) -> tuple[list[ChangingFit], NDArray[np.complex128]] | None:
    """Fit combs whose rates change, by Gauss-Newton steps on the `ahead` of each and on the body's motion.

    The body may accelerate. As in `fit_combs`, amplitudes are Gaussian with the power seen about their lines, and
    eliminated.

    Parameters
    ----------
    data : Periodogram
        The record.
    starts : sequence of Start
        Start of each comb.
    centre : float
        Start of the centre [cycles a sample].
    degrees : int
        How many of `DEGREES` are fitted, from the first.
    steps : int
        Steps at most, >= 1.
    level_about : callable
        Local level without the combs known already.

    Returns
    -------
    (list of ChangingFit, ndarray of complex128 of shape (pulses,)) or None
        A fit for each and the residual samples. None where a comb has fewer than three usable lines, or lines overlap
        too closely.
    """
    from scipy.linalg import cho_solve  # here, because predicting needs no such import

    pulses, turning = data.pulses, _Turning(data, starts, centre, degrees)
    if min(np.bincount(turning.comb[turning.used], minlength=turning.count)) < 3:
        return None
    smooth = over_orders(turning.comb, turning.order, turning.used)
    basis = band_basis(pulses, data.strong.bands)
    least = LEAST_LEVEL if turning.count == 1 else 1.0
    level = level_about
    snr = np.full(len(turning.order), np.inf)
    for number in range(steps):
        frequency, lines = turning.frequency, turning.lines()
        noise = np.maximum(level(frequency), least)
        seen = lines.means(data.samples[None])[:, 0]
        together = lines_at_one_place(frequency, pulses)
        snr = np.minimum(snr, np.maximum((smooth(squared(seen) * pulses / noise) - 1) / together, 1e-3))
        factored = _factored(lines.products(basis), ridges(snr, together, turning.used))
        if factored is None:
            return None
        factor, held_back = factored
        amplitudes = cho_solve(factor, seen, check_finite=False)
        snr = np.maximum(smooth(squared(amplitudes * (1 + held_back)) * pulses / noise) - 1, 1e-3)
        rest = remove_bands(data.samples - lines.sums(amplitudes[None])[0], data.strong.bands)
        counted = amplitudes * turning.used
        columns = remove_bands(turning.gained(lines, counted), data.strong.bands)
        leaked = lines.means(columns)
        kept = leaked.conj().T @ cho_solve(factor, leaked, check_finite=False)
        counts = squared(counted * turning.order) + 1e-30
        mean_noise = float(np.average(noise, weights=counts))
        covariance = inverse_of(2 / mean_noise * (columns.conj() @ columns.T - pulses * kept).real)
        step = covariance @ (2 / mean_noise * (columns.conj() @ rest).real)
        std = np.sqrt(covariance.diagonal())
        turning.take(step)
        if number and np.all(np.abs(step) < ENOUGH * std):
            break
        level = data.level_of(rest)
    # the noise is taken from the residual of the last step, not of the one before
    left = float(np.average(np.maximum(data.level_of(rest)(frequency), least), weights=counts))
    return turning.fits(std * np.sqrt(left / mean_noise * data.ends_noise), amplitudes, snr), rest
