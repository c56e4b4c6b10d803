"""How symmetric a comb's levels are about a line, or whether all its lines lie on one side of that line.

A blade that reflects only as it approaches, or only as it recedes, has lines on one side of the body alone. They reach
equally far from their own middle as well. A true centre has levels more like their mirror images than like their
neighbours.
"""

import numpy as np
from numpy.typing import NDArray

from .comb_search import Candidate
from .periodogram import Periodogram

#: Powers are compared above OVER times the highest local level. An order shows if a place within NEAR_SHARE of a
#: spacing of it stands more than SHOWS over that [nats].
OVER, NEAR_SHARE, SHOWS = 3.0, 0.25, 1.0

#: All lies on one side of a line if that side is stronger at this share or more of the orders that show.
SAME_SIDE = 0.85

#: Fewer orders than this tell nothing.
LEAST_ORDERS = 4

#: Added to differences between levels: LEAST_UNLIKE to medians [nats], LEAST_UNEVEN to mean squares [nats^2].
LEAST_UNLIKE, LEAST_UNEVEN = 0.02, 0.01

#: The mirror image of an order may lie up to BESIDE bins of the padded spectrum off its place; a line fills LINE_BINS.
BESIDE, LINE_BINS = 4, 12

#: A filter took out a line nearer than AT_REST_BINS to rest [bins] if it lies more than FILTERED_BELOW [nats] under the
#: median of NEIGHBOURS orders to each side. HOLE_BINS: its level is read up to this many bins of the padded spectrum
#: from its place; lines of other rotors lie beside.
AT_REST_BINS, FILTERED_BELOW, NEIGHBOURS, HOLE_BINS = 1.0, 2.0, 4, 2


class Sides:
    """Levels on both sides of a line of a comb.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Candidate
        The comb, counted from that line.
    """

    def __init__(self, data: Periodogram, comb: Candidate) -> None:
        size, reach = len(data.power), max(min(comb.last, int(0.49 / comb.spacing)), 1)
        half = int(comb.spacing * size / 2)
        near = max(int(2 * NEAR_SHARE * half), 2)
        middles = np.rint((comb.centre + comb.spacing * np.arange(-reach, reach + 1)) * size).astype(np.intp)
        bins = (middles[:, None] + np.arange(-half, half + 1)) % size
        level = data.level[bins]  # lines lift the level, unequally on both sides: powers are compared instead
        nats = np.log(np.maximum(data.power[bins] * data.seen[bins] * level / (OVER * level.max()), 1))
        tops = nats[:, half - near : half + near + 1].max(axis=1)
        self._is_at_rest = abs(comb.centre) * data.pulses < AT_REST_BINS
        own = np.log(level[reach] * np.maximum(data.power[bins[reach]] * data.seen[bins[reach]], 1))
        beside = np.log(level * np.maximum(data.power[bins], 1))[:, half - near : half + near + 1].max(axis=1)
        beside = np.delete(beside, reach)[max(reach - NEIGHBOURS, 0) : reach + NEIGHBOURS]
        self._below = float(np.median(beside) - own[half - HOLE_BINS : half + HOLE_BINS + 1].max())
        self._after, self._before = nats[reach + 1 :], nats[:reach][::-1, ::-1]
        self._tops_after, self._tops_before = tops[reach + 1 :], tops[:reach][::-1]

    @property
    def filtered_out(self) -> bool:
        """Whether the line itself is missing and at rest, where a filter takes lines out."""
        return self._is_at_rest and self._below > FILTERED_BELOW

    @property
    def one_sided(self) -> bool:
        """Whether nearly all that shows is stronger on the same side of the line."""
        after, before = self._tops_after, self._tops_before
        either = np.maximum(after, before) > SHOWS
        stronger = float((after > before)[either].mean()) if either.sum() >= LEAST_ORDERS else 0.5
        return max(stronger, 1 - stronger) >= SAME_SIDE

    def even_nats(self) -> float:
        """Symmetry evidence: how much more levels resemble their mirror images than their neighbours [nats].

        Of the levels of orders, one side may be weaker by any factor: the edges of a blade reflect unlike.
        """
        both = self._both
        return self._of_levels(both) + self._of_places(both) if self.compares else 0.0

    @property
    def compares(self) -> bool:
        """Whether enough shows on both sides of the line to say how even it is."""
        return int(self._both.sum()) >= LEAST_ORDERS

    @property
    def _both(self) -> NDArray[np.bool_]:
        return np.asarray(np.minimum(self._tops_after, self._tops_before) > SHOWS, np.bool_)

    def _of_levels(self, both: NDArray[np.bool_]) -> float:
        """Symmetry evidence by the highest level of each order [nats]."""
        after, before = self._tops_after, self._tops_before
        unlike = (after - before)[both]
        in_a_row = both[1:] & both[:-1]
        steps = np.abs(np.concatenate([np.diff(after)[in_a_row], np.diff(before)[in_a_row]]))
        if len(steps) < LEAST_ORDERS:
            return 0.0
        images = float(np.median(np.abs(unlike - np.median(unlike))))
        return len(unlike) * float(np.log((np.median(steps) + LEAST_UNLIKE) / (images + LEAST_UNLIKE)))

    def _of_places(self, both: NDArray[np.bool_]) -> float:
        """Symmetry evidence by all bins about each order [nats]: where lines of several rotors part."""
        images, bins = self._uneven(both, 0)
        neighbours, _ = self._uneven(both, 1)
        ratio = (neighbours + LEAST_UNEVEN) / (images + LEAST_UNEVEN)
        return bins / LINE_BINS / 2 * float(np.log(ratio))

    def _uneven(self, both: NDArray[np.bool_], apart: int) -> tuple[float, int]:
        """Mean square difference of orders and mirror images `apart` orders off [nats^2], and number of bins."""
        kept = slice(None, len(both) - apart), slice(apart, None)
        out = []
        for shift in range(-BESIDE, BESIDE + 1):
            beside = np.roll(self._before, shift, axis=1)
            square, bins = 0.0, 0
            for one, other in (kept, kept[::-1])[: apart + 1]:
                here = (both[one] & both[other])[:, None]
                after, before = self._after[one], beside[other]
                here = here & ((after > 0) | (before > 0))
                square += float(((after - before)[here] ** 2).sum())
                bins += int(here.sum())
            out.append((square / max(bins, 1), bins))
        return min(out)
