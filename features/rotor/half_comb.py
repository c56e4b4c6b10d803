"""Whether a comb was found on one side of the body only although the rotors' lines lie on both.

Lines of several rotors that are not told apart crowd: a spacing that meets many on one side of the body may meet few on
the other, more so where the body turns and its line is not where the rotors' mean velocity is. The comb found is then
half of the family, and its middle lies half a tip speed beside the body. Where the power ends does not depend on which
lines are met: it ends as far from the body on both sides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .comb_search import Candidate
from .periodogram import Periodogram

#: An order shows if the mean power of the spacing about it is more than this many times that of noise: the mean of
#: three bins of noise, fewer than any spacing has, exceeds that once in two thousand times.
SHOWS = 4.0

#: The family ends as far to both sides of a line if no more than this share of the orders that show has no mirror image
#: about it: the line of a body that is a tenth of the tips' speed off has one in ten.
EVEN_SHARE = 0.1

#: It does not about a place where this share or more has none; about the middle of one of two sides two thirds have.
UNEVEN_SHARE = 0.3

#: If fewer of the comb's own orders than this share show, its ends are not seen.
OWN_SHOW_SHARE = 0.5


@dataclass(frozen=True)
class Extent:
    """Which orders of a comb show around the whole circle of frequencies.

    Parameters
    ----------
    shows : ndarray of bool, shape (orders,)
        Whether there is power about an order, from the comb's order 0 upwards, around the circle.
    seen : ndarray of bool, same shape
        Whether that can be told: False for orders in a band that was taken out or in a background's skirt.
    """

    shows: NDArray[np.bool_]
    seen: NDArray[np.bool_]

    @classmethod
    def of(cls, data: Periodogram, comb: Candidate) -> "Extent | None":
        """Of a comb in a record; None where too few of the comb's orders show."""
        size, orders = len(data.power), int(1 / comb.spacing)
        borders = np.rint((comb.centre + comb.spacing * (np.arange(orders + 1) - 0.5)) * size).astype(np.intp)
        bins = np.arange(borders[0], borders[-1]) % size
        told = data.seen[bins] & ~data.in_skirt(bins / size)
        power = np.add.reduceat(data.power[bins] * data.level[bins] * told, borders[:-1] - borders[0])
        count = np.add.reduceat(told.astype(np.intp), borders[:-1] - borders[0])
        seen = 2 * count > np.diff(borders)
        out = cls(seen & (power > SHOWS * np.maximum(count, 1)), seen)
        own = np.arange(comb.low, comb.high + 1) % orders
        known = max(int(out.seen[own].sum()), 1)
        return out if out.shows[own].sum() > OWN_SHOW_SHARE * known else None

    def tells(self, order: int, other: int) -> bool:
        """Whether the family surely ends as far to both sides of one order, and not of another."""
        return self._without_image(order) <= EVEN_SHARE and self._without_image(other) >= UNEVEN_SHARE

    def _without_image(self, order: int) -> float:
        """Share of the orders that show and whose mirror image about an order of the comb can be told but is none."""
        image = (2 * order - np.arange(len(self.shows))) % len(self.shows)
        told = self.shows & self.seen[image]
        return float((told & ~self.shows[image]).sum() / max(int(told.sum()), 1))
