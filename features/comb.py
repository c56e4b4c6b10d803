"""The comb of a rotor in one record: sought, judged against chance, fitted; or why there is none."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .comb_fit import CombFit, fit_comb
from .comb_search import best_candidate
from .periodogram import LINE_DB, Periodogram

#: Score that chance alone exceeds in under 1 % of the records: of white noise; where a line was taken out; where the
#: static background was, with its skirt [nats]. Checked by tests/benchmarks/measurement_tables.py.
THRESHOLDS = (13.0, 16.0, 25.0)

#: A rotor's lines reach at least so far from the body [m/s]; wings, limbs and wheels seldom do with so few lines.
LEAST_REACH_MPS = 12.0

#: A comb needs so many lines, at least.
LEAST_LINES = 4

#: A comb whose lines all lie on multiples of the mains is taken for the supply's, this near to them, relative.
MAINS_HZ = (50.0, 60.0)
MAINS_MULTIPLES = (1, 2, 3, 4, 6)
MAINS_SHARE = 0.005

#: Every k-th line stronger than the others by this factor in power: unequal blades, k to a turn.
UNEQUAL_FACTOR = 4.0


@dataclass(frozen=True)
class Comb:
    """A rotor's comb.

    Parameters
    ----------
    fit : CombFit
        All its lines, weak ones between the strong included.
    per_turn : int
        Strong lines are this many spacings apart: 1 for equal blades (or a lone one), else the number of blades.
    """

    fit: CombFit
    per_turn: int

    @property
    def chopping(self) -> float:
        """Spacing of the strong lines [cycles a sample]."""
        return self.fit.spacing * self.per_turn

    @property
    def chopping_std(self) -> float:
        """Its standard deviation [cycles a sample]."""
        return self.fit.spacing_std * self.per_turn


def strong_multiple(orders: NDArray[np.intp], power: NDArray[np.float64]) -> int:
    """Every how many-th line is strong: 1, 2, 3 or 4.

    Parameters
    ----------
    orders : ndarray of int, shape (lines,)
        Orders.
    power : ndarray, shape (lines,)
        Power of each line over the noise [1].
    """
    best, factor = 1, UNEQUAL_FACTOR
    for multiple in (2, 3, 4):
        strong = orders % multiple == 0
        # the outermost lines are edges; four of each kind tell them apart
        if strong.sum() < 4 or (~strong).sum() < 4:
            continue
        ratio = max(power[strong].mean() - 1, 0) / max(power[~strong].mean() - 1, 0.1)
        if ratio > factor:
            best, factor = multiple, ratio
    return best


def of_mains(fit: CombFit, data: Periodogram) -> bool:
    """True where spacing and centre of a comb are both multiples of the mains, and with them every line."""
    for mains_hz in MAINS_HZ:
        multiple = round(fit.spacing * data.prf_hz / mains_hz)
        if multiple in MAINS_MULTIPLES and abs(fit.spacing * data.prf_hz / (multiple * mains_hz) - 1) < MAINS_SHARE:
            base = fit.spacing / multiple
            off = abs(fit.centre - base * round(fit.centre / base)) * data.pulses
            return off < max(0.2, 3 * fit.centre_std * data.pulses)
    return False


def threshold(data: Periodogram) -> float:
    """Score a comb must exceed in this record [nats]."""
    if data.rest_half > 0:
        return THRESHOLDS[2]
    return THRESHOLDS[1] if data.centres_db[0] > LINE_DB else THRESHOLDS[0]


def find_comb(data: Periodogram) -> tuple[Comb | None, str]:
    """Find the comb of a record.

    Parameters
    ----------
    data : Periodogram
        From `prepare`.

    Returns
    -------
    comb : Comb or None
        None where there is none.
    reason : str
        Why not; empty where there is one.
    """
    start = best_candidate(data)
    if start is None:
        return None, "dwell too short: no chopping frequency could be told from its neighbours"
    if start.score < threshold(data):
        return None, f"no comb: evidence {start.score:.1f} below {threshold(data):.0f} nats"
    fit = fit_comb(data, start)
    if fit is None or len(fit.orders) < LEAST_LINES:
        return None, f"no comb: fewer than {LEAST_LINES} lines"
    reach_mps = max(start.high, -start.low) * fit.spacing * data.prf_hz * data.wavelength_m / 2
    if reach_mps < LEAST_REACH_MPS:
        return None, f"no rotor: lines reach {reach_mps:.1f} m/s, rotors {LEAST_REACH_MPS:.0f} m/s and more"
    if of_mains(fit, data):
        return None, f"no rotor: lines every {fit.spacing * data.prf_hz:.1f} Hz may be the mains"
    within = (fit.orders >= start.low) & (fit.orders <= start.high)
    fit = replace(fit, orders=fit.orders[within], amplitudes=fit.amplitudes[within], snr=fit.snr[within])
    power = np.abs(fit.amplitudes) ** 2 * data.pulses / data.level_at(fit.centre + fit.spacing * fit.orders)
    return Comb(fit, strong_multiple(fit.orders, power)), ""
