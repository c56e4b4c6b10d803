"""The number of blades of a rotor whose blades are not quite alike: strong lines are then that many orders apart."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

#: Unlike blades show if the mean power of the weak lines is this many standard deviations over that of noise.
WEAK_DEVIATIONS = 3.0

#: Largest number of blades tried if the number is not known.
MOST_BLADES = 6

#: If every k-th line is stronger than the others by this factor in power, a rotor has k unequal blades.
UNEQUAL_FACTOR = 4.0

#: The least factor among the outer half of the lines alone.
OUTER_FACTOR = 2.5

#: In the outer half, lines of several rotors run into one another. Of combs of MANY_ORDERS or more the inner half alone
#: tells as well, by INNER_FACTOR: of blades that reflect at their tips the lines of one parity may be stronger, but not
#: over that many orders.
MANY_ORDERS, INNER_FACTOR = 30, 8.0

#: Least evidence of two kinds of lines [nats]: near the noise every other line is strong by chance.
UNEQUAL_NATS = 8.0


def blade_numbers(blades: int | None) -> range:
    """Numbers of blades, from two on, that lines of unlike strength may show: the one given, or up to MOST_BLADES."""
    return range(2, MOST_BLADES + 1) if blades is None else range(max(blades, 2), blades + 1)


def strong_multiple(
    orders: NDArray[np.intp], power: NDArray[np.float64], tried: Iterable[int], factor: float = UNEQUAL_FACTOR
) -> int:
    """Every how many-th line is strong: 1, or one of those tried.

    Parameters
    ----------
    orders : ndarray of int, shape (lines,)
        Orders.
    power : ndarray, shape (lines,)
        Power of each line over the noise [1].
    tried : iterable of int
        Multiples that are tried.
    factor : float
        By which the strong lines exceed the others in power.
    """
    multiples, away = np.array(tuple(tried), np.intp), np.abs(orders)
    if not len(multiples) or not len(orders):
        return 1
    outer = away > np.median(away)
    parts, least = np.ones((1, len(orders)), bool), np.array([factor])  # sets of lines, and the factor each needs
    if away.max() >= MANY_ORDERS:
        parts, least = np.stack([parts[0], ~outer]), np.array([factor, INNER_FACTOR])
    is_strong = orders % multiples[:, None] == 0
    number, total = (is_strong.astype(float) @ (parts * each).T for each in (1.0, power))
    weak_number, weak_total = parts.sum(axis=1) - number, parts @ power - total
    ratio = _contrast(total / np.maximum(number, 1), weak_total / np.maximum(weak_number, 1))
    # four lines of each kind at least: the outermost ones are the edges of the band
    tells = (np.minimum(number, weak_number) >= 4) & (ratio > least)
    best, best_ratio = 1, factor
    for place, part in np.argwhere(tells):
        if ratio[place, part] <= best_ratio * (1 + 1e-9):  # no better, or the very same lines
            continue
        strong, weak = parts[part] & is_strong[place], parts[part] & ~is_strong[place]
        # at the low orders lines of several rotors overlap and may cancel; further out they part
        far = power[outer & strong], power[outer & weak]
        if min(map(len, far)) and _contrast(far[0].mean(), far[1].mean()) <= OUTER_FACTOR:
            continue
        if two_means_nats(power[strong], power[weak]) > UNEQUAL_NATS:
            best, best_ratio = int(multiples[place]), float(ratio[place, part])
    return best


def weak_lines_show(orders: NDArray[np.intp], power: NDArray[np.float64], number: int) -> bool:
    """Whether the lines between every `number`-th are more than noise."""
    weak = power[orders % number != 0]
    return bool(len(weak) and weak.mean() > 1 + WEAK_DEVIATIONS / np.sqrt(len(weak)))


def lines_a_turn(orders: NDArray[np.intp], power: NDArray[np.float64], blades: int | None, most: int) -> int:
    """Every how many-th line is strong, up to `most`: 1, the number of blades given, or what else their comb may show.

    Of four blades given, every second may be alike: then every second line is strong. If the comb found is a fraction
    of theirs, the lines between are noise.
    """

    def strong(numbers: range) -> int:
        return strong_multiple(orders, power, range(numbers.start, min(numbers.stop, most + 1)))

    number = strong(blade_numbers(blades))
    if number > 1 and blades is not None:
        return _fewest_alike(orders, power, number)
    if number > 1 or blades is None or blades == 1:
        return number
    other = strong(blade_numbers(None))
    return other if blades % other == 0 or not weak_lines_show(orders, power, other) else 1


def _fewest_alike(orders: NDArray[np.intp], power: NDArray[np.float64], number: int) -> int:
    """`number`, or its smallest divisor at whose multiples all lines are about as strong as at those of `number`.

    The search may find only every second line of six unlike blades: of these, every third is strong.
    """
    for part in range(number // 2, 1, -1):
        strong = orders % number == 0
        between = power[(orders % part == 0) & ~strong]
        if number % part == 0 and len(between) and _contrast(power[strong].mean(), between.mean()) < UNEQUAL_FACTOR:
            number = part
    return number


def two_means_nats(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Log likelihood ratio of two means against one, for exponentially distributed powers of two kinds of lines."""
    means = (max(float(each.mean()), 1e-9) for each in (np.concatenate([one, other]), one, other))
    both, first, second = (float(np.log(mean)) for mean in means)
    return (len(one) + len(other)) * both - len(one) * first - len(other) * second


def _contrast(strong: NDArray[np.floating], weak: NDArray[np.floating]) -> NDArray[np.float64]:
    """Ratio of mean powers [noise power], the noise subtracted from each."""
    return np.asarray(np.maximum(strong - 1, 0) / np.maximum(weak - 1, 0.1), np.float64)
