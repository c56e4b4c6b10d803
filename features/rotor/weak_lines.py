"""Weak lines between those of a comb: slightly unlike blades have them at every multiple of the rotation rate.

Left out of the fit they leak into the strong ones, all in the same way, and this bias passes for another rate or for
one that changes: for two blades 0.1 rad apart, a quarter of a millimetre at 10 GHz, by some ten standard deviations.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..lines import LinesSeen, squared, sum_of_lines
from .comb import LEAST_LINES, Comb
from .comb_fit import CombFit, fit_combs
from .comb_search import MIRROR_BINS, from_mirror_bins
from .folding import may_come_back
from .periodogram import Level, Periodogram
from .rate_sidebands import Between, wanders
from .slow_lines import remove_bands
from .unlike_blades import UNEQUAL_NATS, blade_numbers, two_means_nats

#: Weak lines are fitted from this evidence on, against places as far from any line [nats]: fitting noise does no harm.
#: They must lie LEAST_BINS from the strong ones and from one another [bins].
LEAST_NATS, LEAST_BINS = 3.0, 2.5

#: The mirror image of a comb, from an imbalance of I and Q, is as much weaker as the body's is, within this factor.
IMAGE_FACTOR = 6.0

#: They are as even as noise: if the strongest of them holds more than this share of all, it is another's line.
MOST_SHARE = 0.3


def without_weak_lines(data: Periodogram, comb: Comb, blades: int | None) -> tuple[Periodogram, Comb]:
    """Fit a comb again with the lines that unlike blades have between its own, and take these out of the record.

    Parameters
    ----------
    data : Periodogram
        The record.
    comb : Comb
        The comb found in it.
    blades : int or None
        Blades of a rotor, where known: else any of `blade_numbers` that the lines show.

    Returns
    -------
    data : Periodogram
        The record without the lines between; the one given where there are none.
    comb : Comb
        The comb as fitted jointly with them.
    """
    fit, best, most, sure = comb.fit, 1, 0.0, True
    if comb.per_turn > 1 or data.one_channel:
        return data, comb
    left, level = LinesSeen(comb.rest[None]), data.level_of(comb.rest)
    last = fit.outermost
    image, wandering = _image_of_lines(data, fit, left, level), _asked_once(data, fit, left, level)
    for parts in blade_numbers(blades):
        nats, excess = _between(data, fit, left, level, parts, wandering)
        if nats > LEAST_NATS:
            best, most = parts, nats
            sure = not _mirrored(fit, parts, data.pulses) or excess > IMAGE_FACTOR * image
            sure &= not may_come_back(last, fit.spacing)  # folded lines fall between
    if best == 1:
        return data, comb
    reach = (int(fit.orders.min()) * best, int(fit.orders.max()) * best)
    fitted = fit_combs(data, fit.centre, [fit.spacing / best], [reach])
    if fitted is None:
        return data, comb
    (whole,), rest = fitted
    strong = whole.orders % best == 0
    weak = sum_of_lines(data.pulses, whole.frequencies[~strong], whole.amplitudes[~strong])
    own = CombFit(
        whole.spacing * best,
        whole.centre,
        whole.spacing_std * best,
        whole.centre_std,
        whole.orders[strong] // best,
        whole.amplitudes[strong],
        whole.snr[strong],
    )
    told = replace(comb, fit=own, rest=rest, blades=best, blades_sure=sure and most > UNEQUAL_NATS)
    return data.left(data.samples - remove_bands(weak, data.strong.bands)), told


def with_all_lines(data: Periodogram, comb: Comb, blades: int | None) -> Comb:
    """A comb of unlike blades with the lines that it lacks: the search may take two of four blades for all.

    Parameters
    ----------
    data, comb, blades
        As in `without_weak_lines`.

    Returns
    -------
    Comb
        The one given where nothing more lies between its lines, or it has no weak ones.
    """
    fit = comb.fit
    numbers = [number for number in blade_numbers(blades) if number > comb.per_turn and number % comb.per_turn == 0]
    if comb.per_turn == 1 or not numbers or data.one_channel or may_come_back(comb.last, fit.spacing):
        return comb
    left, level = LinesSeen(comb.rest[None]), data.level_of(comb.rest)
    image, wandering = _image_of_lines(data, fit, left, level), _asked_once(data, fit, left, level)
    for parts in (number // comb.per_turn for number in numbers):
        nats, excess = _between(data, fit, left, level, parts, wandering)
        if nats < UNEQUAL_NATS:
            continue
        reach = (int(fit.orders.min()) * parts, int(fit.orders.max()) * parts)
        fitted = fit_combs(data, fit.centre, [fit.spacing / parts], [reach])
        if fitted is None or (_mirrored(fit, parts, data.pulses) and excess < IMAGE_FACTOR * image):
            return replace(comb, blades_sure=False)
        (whole,), rest = fitted
        turn = comb.per_turn * parts
        return replace(comb, fit=whole, rest=rest, last=comb.last * parts, per_turn=turn, blades=turn)
    return comb


def _asked_once(data: Periodogram, fit: CombFit, left: LinesSeen, level: Level) -> Callable[[], bool]:
    """Whether the rate of a comb wanders, worked out when first asked: few records have lines between to doubt."""
    return cache(lambda: wanders(data, fit, left, level))


def _between(
    data: Periodogram, fit: CombFit, left: LinesSeen, level: Level, parts: int, wandering: Callable[[], bool]
) -> tuple[float, float]:
    """Evidence of lines at fractions 1 / `parts` of a comb's spacing, against places as far from any [nats].

    Where the rate is `wandering`, what sidebands of the comb's lines explain is no evidence.

    Returns
    -------
    nats : float
        0 where there is none, or one line holds too much of all.
    excess : float
        Mean power of the lines over the noise, less 1.
    """
    if fit.spacing * data.pulses < LEAST_BINS * parts:
        return 0.0, 0.0
    last = fit.outermost
    order = np.arange(-last * parts, last * parts)
    own = order[np.gcd(order, parts) == 1]  # lines of fewer blades may be there without these
    between = Between.of(data, fit, left, level, own / parts)
    beside = Between.of(data, fit, left, level, (order + 0.5) / parts).powers
    nats, excess = _evidence(between.powers, beside)
    if nats > LEAST_NATS and wandering():
        return _evidence(between.powers_without_sidebands, beside)
    return nats, excess


def _evidence(there: NDArray[np.float64], beside: NDArray[np.float64]) -> tuple[float, float]:
    """What `_between` gives, for powers at the places of lines and beside them."""
    few = min(len(there), len(beside)) < LEAST_LINES
    if few or there.max() > MOST_SHARE * there.sum() or there.mean() <= beside.mean():
        return 0.0, 0.0
    return two_means_nats(there, beside), float(there.mean()) - 1


def _mirrored(fit: CombFit, parts: int, pulses: int) -> bool:
    """True where the mirror image of a comb, about velocity zero, lies at fractions 1 / `parts` of its spacing."""
    part = fit.spacing / parts
    return round(2 * fit.centre / part) % parts != 0 and bool(from_mirror_bins(part, fit.centre, pulses) < MIRROR_BINS)


def _image_of_lines(data: Periodogram, fit: CombFit, rest: LinesSeen, level: Level) -> float:
    """Mean power over noise of the mirror image of a comb's lines, if as much weaker as that of the body's line.

    Infinite where unknown: the body's line or its image was taken out with the background.
    """

    def line_at(place: float) -> float:
        near = (db for line, db in data.strong.lines if abs(line - place) * data.pulses < 1)
        return max((10 ** (db / 10) for db in near), default=0.0)

    body, mirror = line_at(fit.centre), np.array([-fit.centre])
    if not body or not (line_at(-fit.centre) or data.usable(mirror)[0]):
        return np.inf
    left = float((squared(rest.means(mirror)[0]) * data.pulses / level(mirror))[0])
    return max(line_at(-fit.centre), left) / body * float(fit.snr.mean())


def by_rotation(comb: Comb) -> Comb:
    """The same comb at the spacing of the rotation rate, so that the weak lines between its own belong to it."""
    parts, fit = comb.blades // comb.per_turn, comb.fit
    finer = replace(fit, spacing=fit.spacing / parts, spacing_std=fit.spacing_std / parts, orders=fit.orders * parts)
    return replace(comb, fit=finer, last=comb.last * parts, per_turn=comb.per_turn * parts)
