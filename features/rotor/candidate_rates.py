"""Whether a rate that speaks for a rotor is one's own, or a multiple or a part of a rate."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .comb_fit import CombFit
from .periodogram import Periodogram
from .unlike_blades import MOST_BLADES, strong_multiple

#: RATE_SPREAD: how far the rates of one airframe's rotors lie from those known in hover, relative. FURTHEST_SPREAD: the
#: same from the first comb's rate in a manoeuvre or for unlike rotors; these rates are sought by their first
#: INNER_ORDERS orders, which resolve them already. (The first 10 hold next to nothing of blades that begin beyond the
#: hub: of 250 such pairs at -6 to 15 dB 165 were resolved by these, 221 by 40.)
RATE_SPREAD, FURTHEST_SPREAD, INNER_ORDERS = 0.05, (-0.25, 0.33), 40

#: A candidate is twice a rotor's rate if its half-integer orders, out to HALF_ORDERS and away from known lines, are
#: also occupied: their HALF_QUANTILE power exceeds HALF_SHARE of that at its integer orders and HALF_POWER times the
#: noise.
HALF_ORDERS, HALF_SHARE, HALF_POWER, HALF_QUANTILE = 6, 0.05, 4.0, 0.3

#: A candidate consists of lines of a known rotor's unlike blades if the other multiples of that rotation rate have
#: HALF_QUANTILE power above BETWEEN_SHARE of its own lines' and BETWEEN_POWER times the noise. (False rotors had half
#: and more, real ones a fiftieth.)
BETWEEN_SHARE, BETWEEN_POWER = 0.25, 1.0

#: Places within NEAR_BINS of a known line do not count in these tests; LEAST_BETWEEN places must be left.
NEAR_BINS, LEAST_BETWEEN = 2.0, 4

#: A tail rotor turns at most MOST_GEAR times as fast as its main rotor. A comb at a fraction of its rate, which may lie
#: among the rates sought, has lines at every so-many-th order only: these have GEAR_FACTOR times the power of the
#: others (20 times and more where a tail is 8 dB under a main rotor of 5 dB, up to 8 where rotors' lines cross).
MOST_GEAR, GEAR_FACTOR = 9, 12.0


def _low_power(rest: Periodogram, places: NDArray[np.float64], fits: Sequence[CombFit]) -> float:
    """Power exceeded at most places away from known lines (`HALF_QUANTILE`); 0 where few such places are left."""
    known = np.concatenate([fit.frequencies for fit in fits])
    near = np.abs(places[:, None] - known).min(axis=1) * rest.pulses
    places = places[rest.usable(places) & (near > NEAR_BINS)]
    return float(np.quantile(rest.at(places), HALF_QUANTILE)) if len(places) >= LEAST_BETWEEN else 0.0


def is_twice(rest: Periodogram, centre: float, rate: float, fits: Sequence[CombFit]) -> bool:
    """True where a comb's half-integer inner orders are occupied too: its rate is then twice a rotor's."""
    order = np.arange(-HALF_ORDERS, HALF_ORDERS, dtype=float)
    own, half = (_low_power(rest, centre + rate * tried, fits) for tried in (order, order + 0.5))
    return half > max(HALF_SHARE * own, HALF_POWER)


def is_between(rest: Periodogram, centre: float, rate: float, fits: Sequence[CombFit], reach: int) -> bool:
    """True where a comb's lines are some of those that a known rotor's unlike blades have at its rotation rate.

    Unlike blades have lines at every multiple of the rotation rate, a further rotor only at multiples of its own rate.
    Like rotors not found yet have such lines too, so rates need only agree to within `RATE_SPREAD`.
    """
    for known in (fit.spacing for fit in fits):
        for parts in range(2, MOST_BLADES + 1):
            times = round(rate / known * parts)
            if np.gcd(times, parts) > 1 or abs(rate * parts / (times * known) - 1) > RATE_SPREAD:
                continue
            last = min(HALF_ORDERS, reach) * parts
            order = np.arange(-last, last + 1)
            order = order[order % parts != 0]
            is_own = order % times == 0
            own, other = (_low_power(rest, centre + rate / times * order[some], fits) for some in (is_own, ~is_own))
            if own > 0 and other > max(BETWEEN_SHARE * own, BETWEEN_POWER):
                return True
    return False


def lines_apart(fit: CombFit, pulses: int, factor: float) -> int:
    """Every how many-th line of a comb is occupied; more than 1 means a rotor at that multiple of the rate."""
    power = 1 + pulses * np.abs(fit.amplitudes) ** 2
    return strong_multiple(fit.orders, power, range(2, MOST_GEAR + 1), factor)
