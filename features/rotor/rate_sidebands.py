"""Sidebands that a wandering rate puts beside each line of a comb, the stronger the higher its order.

They pass for the weak lines of unlike blades. A rotor that is ahead by the angle phi(t) has its line n turned by n phi.
While that is small, it has n times the line's amplitude times j Phi(f) at the frequency f above the line, and times
j conj(Phi(f)) as far below, with one Phi for all lines.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lines import LinesSeen, energy, squared
from .comb_fit import CombFit
from .periodogram import Level, Periodogram

#: A rate wanders if sidebands this far from the lines [bins] have more than WANDER_NATS. Smooth changes are fitted and
#: leave none nearer. Noise has as much in one place of exp(WANDER_NATS).
AWAY_BINS, WANDER_NATS = (2.0, 2.5, 3.0, 3.5, 4.0), 12.0

#: Distances from the nearest line that differ by less are the same [orders].
SAME = 1e-6


@dataclass(frozen=True)
class Between:
    """What a comb leaves at places between its lines.

    Parameters
    ----------
    fit : CombFit
        The comb.
    place : ndarray, shape (places,)
        Usable places, in orders, none whole.
    seen : ndarray of complex128, shape (places,)
        Amplitudes there, over the rms of the noise of a bin.
    scale : ndarray, shape (places,)
        That of an amplitude of 1.
    """

    fit: CombFit
    place: NDArray[np.float64]
    seen: NDArray[np.complex128]
    scale: NDArray[np.float64]

    @classmethod
    def of(
        cls, data: Periodogram, fit: CombFit, left: LinesSeen, level: Level, place: NDArray[np.float64]
    ) -> "Between":
        """Read the places of these that are usable.

        Parameters
        ----------
        data, fit : Periodogram, CombFit
            The record, and its comb.
        left, level : LinesSeen, Level
            What the comb leaves, and the local level of that.
        place : ndarray
            Orders.
        """
        frequency = fit.centre + fit.spacing * place
        usable = data.usable(frequency)
        scale = np.sqrt(data.pulses / level(frequency[usable]))
        return cls(fit, place[usable], left.means(frequency[usable])[0] * scale, scale)

    @property
    def powers(self) -> NDArray[np.float64]:
        """Power over noise [1]."""
        return squared(self.seen).astype(np.float64)

    @property
    def powers_without_sidebands(self) -> NDArray[np.float64]:
        """The same of what `sidebands` leaves."""
        return squared(self.seen - self.sidebands()).astype(np.float64)

    def sidebands(self) -> NDArray[np.complex128]:
        """The part that sidebands of the comb's lines explain, with a Phi for each distance from the nearest line."""
        away = np.rint(np.abs(self.place - np.rint(self.place)) / SAME)
        below, above = np.floor(self.place), np.ceil(self.place)
        from_below, from_above = (
            np.where(np.abs(self.place - line) < 0.5 + SAME, self._strength(line), 0) for line in (below, above)
        )
        # columns of the real and the imaginary part of j Phi
        columns = np.stack([from_below - from_above, 1j * (from_below + from_above)], axis=1)
        out = np.zeros(len(self.place), np.complex128)
        for distance in np.unique(away):
            own = away == distance
            real, seen = (np.concatenate([each.real, each.imag]) for each in (columns[own], self.seen[own]))
            out[own] = columns[own] @ np.linalg.lstsq(real, seen, rcond=None)[0]
        return out

    def _strength(self, order: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Order times amplitude of lines, as seen at the places; 0 where the comb has none."""
        return np.asarray(order * self.fit.amplitudes_at(order.astype(np.intp)) * self.scale, np.complex128)


def wanders(data: Periodogram, fit: CombFit, left: LinesSeen, level: Level) -> bool:
    """Whether sidebands of a comb's lines show a rate that changed faster than any fit follows.

    Parameters
    ----------
    data, fit, left, level
        As in `Between.of`.
    """
    bins = fit.spacing * data.pulses
    for away in AWAY_BINS:
        if 2 * away < bins:
            place = np.concatenate([fit.orders - away / bins, fit.orders + away / bins])
            # of noise twice this is chi-square distributed with two degrees of freedom
            if energy(Between.of(data, fit, left, level, place).sidebands()) > WANDER_NATS:
                return True
    return False
