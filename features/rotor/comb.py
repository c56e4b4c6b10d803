"""The comb of a rotor in one record: searched, judged against chance and fitted; or the reason why there is none."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..chopping import CHOPPING_RANGE_HZ
from ..lines import squared
from ..reasons import LOW_PRF, SHORT_DWELL
from .comb_centre import TELLS, centred
from .comb_fit import CombFit, fit_combs
from .comb_scores import even_scores, heights
from .comb_search import (
    FINE_STEPS,
    LEAST_FRACTION_HZ,
    MIN_SPACING_BINS,
    SEARCHED_RATIO,
    Candidate,
    best_candidate,
    factors_about,
    fastest_chopping,
    fine_factors,
    spacing_limits,
    with_faster,
)
from .common_fraction import of_one_rotor
from .flash_rate import of_flashes
from .folding import may_come_back
from .past_edge import unseen_tip_reason
from .periodogram import Periodogram
from .unlike_blades import lines_a_turn, weak_lines_show
from .wide_line import beside_line

#: Score that noise alone exceeds in under 1 % of the records [nats]. THRESHOLD: white noise, also where a body line was
#: taken out. THRESHOLD_AT_REST: where the static background with its skirt was taken out, or in one channel, whose
#: combs are sought about two places. Checked by tests/benchmarks/measurement_tables.py.
THRESHOLD, THRESHOLD_AT_REST = 18.0, 25.0

#: A rotor's lines reach at least this far from the body [m/s]; if so few, those of wings, limbs and wheels seldom do.
LEAST_REACH_MPS = 12.0

#: The lines of a rolling wheel reach from rest to twice the body's velocity: as far from the body as the body is fast.
#: A rotor's must reach further, by this factor. On simulated tracks of 2.5 s, 0.02 of vehicles pass (0.12 without it).
OVER_BODY = 1.15

#: A comb has at least this many lines.
LEAST_LINES = 4

#: A comb is the supply's if its spacing is one of MAINS_MULTIPLES of a mains frequency and its lines lie on multiples
#: of that. MAINS_SHARE: relative tolerance of the spacing, as a simple converter's clock is off by some thousandths.
#: MAINS_SHARE_OF_TWO: the same in two channels for scores from MAINS_SCORE up, what the mains themselves are off by.
MAINS_HZ = (50.0, 60.0)
MAINS_MULTIPLES = (1, 2, 3, 4, 6)
MAINS_SHARE, MAINS_SHARE_OF_TWO = 0.0055, 0.0025

#: If multiples of the mains are nearer together than this [bins], any centre lies near one: then only rest counts.
MAINS_BINS = 4.0

#: Beside a static background a comb of such a spacing is the supply's wherever its centre is, if its score is below
#: this [nats] or the record is of one channel: supplies click.
MAINS_SCORE = 70.0

#: The true spacing may be that found over one of FRACTIONS, too fine for the search: if the finer comb scores more than
#: FRACTION_SHARE of the one found. Most rotors chop faster than USUAL_HZ [Hz]. If the dwell is too short to search from
#: there on, USUAL_FRACTIONS and USUAL_SHARE hold instead, for finer combs above USUAL_HZ.
FRACTIONS, FRACTION_SHARE = (2, 3), 0.9
USUAL_HZ, USUAL_FRACTIONS, USUAL_SHARE = 60.0, (2, 3, 4, 5, 6, 7, 8), 0.85

#: A comb is no rotor's if one SLOWER_FRACTIONS times as dense, slower than rotors chop, scores more than SLOWER_SHARE
#: times as much: that of a full-size helicopter scores twice as much; noise between a rotor's lines lowers the score.
#: SLOWER_BINS: least spacing of the denser comb [bins], below the search's, as it is about a comb already found.
SLOWER_FRACTIONS, SLOWER_SHARE, SLOWER_BINS = (2, 3, 4), 1.3, 1.5


@dataclass(frozen=True)
class Comb:
    """A rotor's comb.

    Parameters
    ----------
    fit : CombFit
        All its lines; where `per_turn` is more than 1, weak ones between the strong included.
    rest : ndarray of complex128, shape (pulses,)
        Samples that its lines leave.
    last : int
        Outermost order that counts in its score.
    per_turn : int
        Strong lines are this many spacings apart: 1 for equal blades (or a lone one), else the number of blades.
    body_std : float
        Standard deviation of the body's frequency where several lines may be the body's, else 0 [cycles a sample].
    line_nats : float
        Evidence that the line counted from is the body's, by how far it stands out; 0 where it does not [nats].
    blades : int
        Number of blades by lines of unequal power; 1 where they are equal.
    blades_sure : bool
        Whether that is sure: neither chance nor folded lines or a missed comb may explain it.
    """

    fit: CombFit
    rest: NDArray[np.complex128]
    last: int
    per_turn: int
    body_std: float
    line_nats: float
    blades: int
    blades_sure: bool

    @property
    def body_has_line(self) -> bool:
        """Whether the body is told by a line that stands out."""
        return self.line_nats >= TELLS

    @property
    def chopping(self) -> float:
        """Spacing of the strong lines [cycles a sample]."""
        return self.fit.spacing * self.per_turn

    @property
    def chopping_std(self) -> float:
        """Standard deviation of `chopping` [cycles a sample]."""
        return self.fit.spacing_std * self.per_turn


def powers_over_noise(data: Periodogram, fit: CombFit, rest: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of each line over the local noise of a bin [1]: of the fitted line plus what the residual holds there."""
    return squared(fit.seen_beside(rest)) * data.pulses / data.level_of(rest)(fit.frequencies)


def of_mains(fit: CombFit, data: Periodogram, score: float, per_turn: int = 1) -> bool:
    """True where strong lines (`per_turn` apart) have the mains' spacing and centre, or a weak comb the spacing alone.

    The spacing alone counts only beside a static background.
    """
    spacing = fit.spacing * per_turn
    share = MAINS_SHARE if data.one_channel or score < MAINS_SCORE else MAINS_SHARE_OF_TWO
    for mains_hz in MAINS_HZ:
        multiple = round(spacing * data.prf_hz / mains_hz)
        if multiple in MAINS_MULTIPLES and abs(spacing * data.prf_hz / (multiple * mains_hz) - 1) < share:
            base = spacing / multiple
            nearest = base * round(fit.centre / base) if base * data.pulses >= MAINS_BINS else 0.0
            off = abs(fit.centre - nearest) * data.pulses
            clicks = data.rest_half > 0 and (data.one_channel or score < MAINS_SCORE)
            return clicks or off < max(0.2, 3 * fit.centre_std * data.pulses)
    return False


def is_short(data: Periodogram) -> bool:
    """True where a dwell is too short to resolve the lines of all rotors that chop faster than `USUAL_HZ`."""
    return MIN_SPACING_BINS / data.pulses * data.prf_hz > USUAL_HZ


def finer_spacing(data: Periodogram, fit: CombFit) -> float | None:
    """Spacing too fine for the search if lines stand between those of a comb, else None [cycles a sample].

    Parameters
    ----------
    data : Periodogram
        The record.
    fit : CombFit
        The comb found: every second, third, ... or eighth line of the finer one.
    """
    fractions, share, least_hz = (
        (USUAL_FRACTIONS, USUAL_SHARE, USUAL_HZ)
        if is_short(data)
        else (FRACTIONS, FRACTION_SHARE, CHOPPING_RANGE_HZ[0])
    )
    spacings = fit.spacing / np.array([1, *fractions])
    finer = (spacings * data.pulses < MIN_SPACING_BINS) & (spacings * data.prf_hz > least_hz)
    if not finer.any() or fit.is_folded:  # folded lines lie between the others as well
        return None
    finer[0] = True
    spacings = spacings[finer]
    scores = _scores_near(data, fit, spacings)
    as_loud = np.flatnonzero(scores[1:] > share * scores[0]) + 1
    return float(spacings[as_loud[0]]) if len(as_loud) else None


def slower_spacing(data: Periodogram, fit: CombFit) -> float | None:
    """Spacing below any rotor's if lines stand between those of a comb, else None [cycles a sample].

    Parameters
    ----------
    data, fit
        As in `finer_spacing`.
    """
    spacings = fit.spacing / np.array([1, *SLOWER_FRACTIONS])
    slower = (spacings * data.prf_hz < CHOPPING_RANGE_HZ[0]) & (spacings * data.pulses >= SLOWER_BINS)
    if not slower[1:].any() or fit.is_folded:  # as in `finer_spacing`
        return None
    slower[0] = True
    scores = _scores_near(data, fit, spacings[slower])
    best = int(scores.argmax())
    least = SLOWER_SHARE * max(scores[0], threshold(data))
    return float(spacings[slower][best]) if scores[best] > least else None


def _scores_near(data: Periodogram, fit: CombFit, spacings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Highest score near each of these spacings, counted from the centre of `fit` [nats]."""
    tried = np.outer(spacings, factors_about(data.pulses, FINE_STEPS, FINE_STEPS))
    scores = heights(data.contrast, tried.ravel(), np.full(tried.size, fit.centre)).reshape(tried.shape)
    return np.asarray(scores.max(axis=1), np.float64)


def threshold(data: Periodogram) -> float:
    """Least score of a comb in this record [nats]."""
    return THRESHOLD_AT_REST if data.rest_half > 0 or data.one_channel else THRESHOLD


def _too_short(data: Periodogram) -> str:
    """The reason why no comb is searched for at all."""
    _, highest = spacing_limits(data.pulses, data.prf_hz)
    if CHOPPING_RANGE_HZ[0] * SEARCHED_RATIO >= highest * data.prf_hz:
        needed_hz = CHOPPING_RANGE_HZ[0] * SEARCHED_RATIO / highest
        rule = f"chopping frequencies from {CHOPPING_RANGE_HZ[0]:.0f} Hz up do not fit into {data.prf_hz:g} Hz"
        return low_prf_reason(data) or f"{LOW_PRF}: {rule}: raise it to {needed_hz:.0f} Hz at least"
    least_s = MIN_SPACING_BINS * SEARCHED_RATIO / highest / data.prf_hz
    return f"{SHORT_DWELL}: no chopping frequency can be told in less than {1e3 * least_s:.1f} ms at this PRF"


def low_prf_reason(data: Periodogram) -> str:
    """Why lines cannot be seen to reach as far as a rotor's: the span is too narrow; empty where they can."""
    unambiguous_mps = data.span_mps / 2
    if unambiguous_mps >= LEAST_REACH_MPS:
        return ""
    least_hz = data.prf_hz * LEAST_REACH_MPS / unambiguous_mps
    return (
        f"{LOW_PRF}: velocities are told to {unambiguous_mps:.1f} m/s, rotors' lines reach {LEAST_REACH_MPS:.0f} m/s "
        f"and more: raise it to {least_hz / 1e3:.1f} kHz at least"
    )


def find_comb(data: Periodogram, blades: int | None = None) -> tuple[Comb | None, str]:
    """Find the comb of a record.

    Parameters
    ----------
    data : Periodogram
        From `prepared`.
    blades : int, optional
        Number of blades of a rotor, if known.

    Returns
    -------
    comb : Comb or None
        None where there is none.
    reason : str
        Why there is no comb; empty where there is one.
    """
    start = best_candidate(data)
    if start is None:
        return None, _too_short(data)
    if start.score < threshold(data) or start.spacing * data.prf_hz >= LEAST_FRACTION_HZ:
        start = with_faster(data, start)
    if start.score < threshold(data):
        reason = f"no comb: evidence {start.score:.1f} nats, {threshold(data):.0f} are needed"
        return None, low_prf_reason(data) or reason
    start = of_flashes(data, of_one_rotor(data, beside_line(data, start)))
    return _counted(data, *centred(data, start), blades)


def counted_from(data: Periodogram, comb: Comb, place: float, blades: int | None) -> tuple[Comb | None, str]:
    """The comb counted anew from another of its lines, the likeliest body's, at `place` [cycles a sample]."""
    steps = comb.fit.spacing * fine_factors(data.pulses)
    scores, reaches = even_scores(data.contrast, steps, np.full(len(steps), place))
    best = int(scores.argmax())
    reach = int(reaches[best])
    return _counted(data, Candidate(float(steps[best]), place, -reach, reach, float(scores[best])), 0.0, 0.0, blades)


def _counted(
    data: Periodogram, start: Candidate, open_orders: float, line_nats: float, blades: int | None
) -> tuple[Comb | None, str]:
    """Fit and judge a comb whose body line is known; returns what `find_comb` does."""
    fitted = fit_combs(data, start.centre, [start.spacing], [(start.low, start.high)])
    if fitted is None or len(fitted[0][0].orders) < LEAST_LINES:
        return None, low_prf_reason(data) or f"no comb: fewer than {LEAST_LINES} lines"
    fit = fitted[0][0]
    reach = start.last * fit.spacing
    reach_mps = reach * data.span_mps
    if reach_mps < LEAST_REACH_MPS:
        reason = f"no rotor: lines reach {reach_mps:.1f} m/s, rotors {LEAST_REACH_MPS:.0f} m/s and more"
        return None, low_prf_reason(data) or unseen_tip_reason(data, fit, reach) or reason
    finer = finer_spacing(data, fit)
    if finer is not None:
        least_s = MIN_SPACING_BINS / finer / data.prf_hz
        return None, (
            f"{SHORT_DWELL}: lines {fit.spacing * data.prf_hz:.0f} Hz apart with others between them, "
            f"to tell them apart takes {1e3 * least_s:.0f} ms at least"
        )
    slower = slower_spacing(data, fit)
    if slower is not None:
        return None, (
            f"no rotor: lines every {slower * data.prf_hz:.1f} Hz, "
            f"rotors chop at {CHOPPING_RANGE_HZ[0]:.0f} Hz and more"
        )
    power = powers_over_noise(data, fit, fitted[1])
    within = (fit.orders >= start.low) & (fit.orders <= start.high)
    orders, power = fit.orders[within], power[within]
    per_turn = lines_a_turn(orders, power, blades, int(fastest_chopping(data) / fit.spacing))
    for number in sorted({1, per_turn}):
        if of_mains(fit, data, start.score, number):
            return None, f"no rotor: lines every {fit.spacing * number * data.prf_hz:.1f} Hz may be the mains"
    # not sure where folded lines may add to every k-th line, or beyond the usual range, where the search may have found
    # a fraction of the comb
    few = fit.spacing * per_turn * data.prf_hz > CHOPPING_RANGE_HZ[1]
    unlike = per_turn > 1 and weak_lines_show(orders, power, per_turn)
    is_sure = unlike and not few and not may_come_back(start.last, fit.spacing)
    return Comb(fit, fitted[1], start.last, per_turn, open_orders * fit.spacing, line_nats, per_turn, is_sure), ""
