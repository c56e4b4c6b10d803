"""The body's velocity and its standard deviation, which allows for rival lines and for what lies beside the line."""

import numpy as np
from numpy.typing import NDArray

from .bodies import LINE_DB, tops
from .lines import from_whole
from .notch import LOBE_BINS
from .rotor.comb_centre import AT_REST_BINS
from .rotor.comb_fit import CombFit
from .rotor.periodogram import Periodogram
from .spectrum import Spectrum
from .window import KAISER, KAISER_BETA

#: INTERPOLATION_BINS: error of the interpolation between bins [bins]. NOISE_BINS: standard deviation by noise of a line
#: as strong as the noise floor [bins]; it falls with the line's amplitude. The window makes it 2.5 times the bound of a
#: line's frequency.
INTERPOLATION_BINS, NOISE_BINS = 0.01, 0.68

#: Standard deviation that the slow part of a background, leaves in a wind, adds to a line within it [bins].
BACKGROUND_BINS = 0.05

#: If the body's line and its comb's centre differ by more than this many standard deviations, the comb is not that of a
#: single rotor, and the difference adds to the standard deviation.
APART_DEVIATIONS = 3.0

#: Without a comb, several lines may be the body's. One that is RIVAL_DB weaker than the line chosen is less likely by a
#: factor of e; one that is weaker by more than WEAKEST_DB does not count [dB].
RIVAL_DB, WEAKEST_DB = 2.0, 8.0

#: A line up to this level may be noise alone and does not count [dB]: the highest bin of 10 000 spectra stood at 13 dB.
NOISE_TOP_DB = 13.5

#: In front of something at rest, a line that moves is the body's if it stands this far over all on the other side of
#: rest [dB]: a moving body's did in all but 5 of 2900 (drones, birds and cars before ground, 3.3 to 35 GHz), the
#: strongest line of a hovering drone's blades in none of 351.
OTHER_SIDE_DB = 8.0

#: The line that moves is not the body's if another line lies, within this many bins, at its mirror image about the line
#: at rest: blades whose edges reflect unlike leave a line of any level there.
MIRROR_BINS = 1.5

#: Probability, at most, that a line that moves is the body's although it fails these tests: 5 of 450 were.
MOVES_SHARE = 0.05

#: A stronger line near rest is that of a hovering body, not of a background, if its top is at least OFF_REST_BINS off
#: rest [bins] and all else about rest is more than PURE_DB weaker [dB]: so were 222 of 351 hovering drones and one of
#: 3200 backgrounds.
OFF_REST_BINS, PURE_DB = 1.0, 25.0

#: A line no further than this from a comb's centre is the line at that centre [bins].
AT_CENTRE_BINS = 1.0

#: Standard deviation, as a share of the unambiguous span, from which on no velocity is reported: that of a velocity
#: anywhere in the span is 0.29.
UNTOLD_SHARE = 0.2

#: Lines at distances from the first to the second of these pull at the body's [bins]: nearer lines are one with the
#: body's, and the lobe of a line further out ends before it.
BESIDE_BINS = (1.5, 8.0)

#: Noise beside the line is hardly above this, in units of the floor. That much is left out: NOISE_BINS allows for it.
NOISE_BESIDE = 4.0


def body_velocity(
    data: Periodogram,
    spectrum: Spectrum,
    fit: CombFit | None,
    *,
    steady: bool = True,
    open_std: float = 0.0,
    blades: bool = False,
) -> tuple[float, float]:
    """The body's velocity: from its own line, or from the comb's centre where background may hide that line.

    Parameters
    ----------
    data : Periodogram
        The record.
    spectrum : Spectrum
        The spectrum that it was made from.
    fit : CombFit, optional
        The rotor's comb, or that of one of several; None where there is none.
    steady : bool
        False for unresolved rotors, or a rate that is not steady: the centre's standard deviation is then not true.
    open_std : float
        What the choice of the comb's centre adds to the standard deviation [cycles a sample].
    blades : bool
        Where no comb is given: True if there is one all the same, so that lines that move are blades'.

    Returns
    -------
    velocity_mps, std_mps : float
        Positive when the range grows. Without a comb, the velocity of the line that is most likely the body's: as a
        rule the strongest that moves, if any does. NaN where no line stands out, or where it may lie anywhere.
    """
    own, level_db = data.strong.lines[0]
    if fit is not None:
        # a background may be stronger than the body: take the line at the comb's centre, where one is seen
        at_centre = (
            line for line in data.strong.lines if abs(folded(line[0] - fit.centre)) * data.pulses < AT_CENTRE_BINS
        )
        own, level_db = next(at_centre, (own, level_db))
    else:
        if level_db < LINE_DB:
            return np.nan, np.nan
        own, level_db, open_std = _likeliest(data, spectrum, blades)
    noise_bins = NOISE_BINS * 10 ** (-level_db / 20)
    at_rest_bins = BACKGROUND_BINS if abs(own) < data.rest_half else 0.0
    own_std = float(np.linalg.norm([noise_bins, INTERPOLATION_BINS, at_rest_bins, _pulled_bins(spectrum, own)]))
    turns, std = own, own_std / data.pulses
    if fit is not None:
        offset = abs(folded(own - fit.centre))
        # several rotors taken for one displace the comb; the line of a body that turns has its top beside its mean
        apart = offset if offset > APART_DEVIATIONS * np.hypot(std, fit.centre_std) else 0.0
        if offset * data.pulses > AT_CENTRE_BINS:
            # a background lies at rest itself: a line beside rest is as likely a slow body's
            slow = AT_REST_BINS < abs(own) * data.pulses <= data.rest_half * data.pulses
            turns, std = fit.centre, float(np.hypot(fit.centre_std, offset * slow))
        elif abs(own) < min(data.rest_half, AT_REST_BINS / data.pulses):
            # a background's line tells nothing of a body that hovers before it
            turns, std = fit.centre, float(np.hypot(fit.centre_std, 0.0 if steady else offset))
        elif steady:
            turns, std = (fit.centre, fit.centre_std) if fit.centre_std < std else (own, std)
            std = float(np.hypot(std, apart))
    std = float(np.hypot(std, open_std))
    return (-folded(turns) * data.span_mps, std * data.span_mps) if std < UNTOLD_SHARE else (np.nan, np.nan)


def _likeliest(data: Periodogram, spectrum: Spectrum, blades: bool) -> tuple[float, float, float]:
    """The line most likely the body's where no comb tells, its level [dB], and its standard deviation by rival lines.

    The strongest line that moves is taken: one faster than leaves in a wind, or else one that stands out of theirs. If
    there is none, or if lines that move are blades', the strongest line of all is taken. What stands at rest beside a
    line that moves is a background, or a rival if it is hardly stronger. If it is much stronger, it is a hovering
    drone's body, and the lines that move are its blades', in two cases: its shape is that of a hovering body, or the
    lines that move are as strong on both sides of it. Places in [cycles a sample].
    """
    lines = data.strong.lines
    loud = [] if blades else [line for line in lines if line[1] >= LINE_DB]
    moving = [line for line in loud if abs(line[0]) >= data.rest_half]
    if not moving and abs(lines[0][0]) * data.pulses <= LOBE_BINS:  # further out, the strongest line is that of leaves
        moving = [line for line in loud if abs(line[0]) * data.pulses > LOBE_BINS]
    own, level_db = (moving or lines)[0]
    slow, slow_db = lines[0]
    if moving and slow_db > level_db + WEAKEST_DB:
        if _is_hovering(spectrum, slow, slow_db, data.rest_half):
            return slow, slow_db, 0.0
        if _on_both_sides(spectrum, own, level_db, slow, data.rest_half):
            return slow, slow_db, MOVES_SHARE**0.5 * _rivals_std(spectrum, slow, data.rest_half, [], level_db)
    rest = data.rest_half if moving else 0.0
    at_rest = [place for place, db in lines if place != own and abs(place) < rest and db < level_db + WEAKEST_DB]
    return own, level_db, _rivals_std(spectrum, own, rest, at_rest)


def _on_both_sides(spectrum: Spectrum, line: float, level_db: float, slow: float, rest: float) -> bool:
    """Whether what lies on the other side of rest, further from it than `rest`, says that a line is one of blades.

    It does if it is about as strong as `line`, or if a line there is as far from `slow`, the line at rest.
    """
    turns = spectrum.frequency_hz / spectrum.prf_hz
    across = (np.abs(turns) > rest) & (turns * line < 0)
    mirror = across & tops(spectrum.relative_power) & (np.abs(_bins_from(spectrum, 2 * slow - line)) <= MIRROR_BINS)
    as_strong = float(spectrum.level_db[across].max(initial=-np.inf)) > max(level_db - OTHER_SIDE_DB, NOISE_TOP_DB)
    return as_strong or float(spectrum.level_db[mirror].max(initial=-np.inf)) > NOISE_TOP_DB


def _is_hovering(spectrum: Spectrum, line: float, level_db: float, rest: float) -> bool:
    """Whether a line slower than `rest` is a hovering body's: unlike a background, off rest, with nothing about it."""
    turns = np.abs(spectrum.frequency_hz) / spectrum.prf_hz
    about = (turns <= rest) & (np.abs(_bins_from(spectrum, line)) > LOBE_BINS)
    pure = bool(about.any()) and float(spectrum.level_db[about].max()) < level_db - PURE_DB
    return abs(line) * spectrum.pulses >= OFF_REST_BINS and pure


def folded(turns: float) -> float:
    """A frequency folded into the unambiguous span, -0.5 to 0.5 [cycles a sample]: comb centres may lie beyond."""
    return turns - round(turns)


def _lobe(bins: NDArray[np.floating]) -> NDArray[np.floating]:
    """Amplitude of the window's main lobe, 1 at its top, at distances from it [bins] (Kaiser and Schafer 1980)."""
    root = np.sqrt(np.maximum(KAISER_BETA**2 - (np.pi * bins) ** 2, 1e-9))
    return np.asarray(np.sinh(root) / root * (KAISER_BETA / np.sinh(KAISER_BETA)))


def _bins_from(spectrum: Spectrum, place: float) -> NDArray[np.float64]:
    """Distance of each bin from a frequency [cycles a sample], around the circle [bins]."""
    return np.asarray(from_whole(spectrum.frequency_hz / spectrum.prf_hz - place) * spectrum.bins, np.float64)


def _pulled_bins(spectrum: Spectrum, own: float) -> float:
    """How far lines beside a line may pull the top of its lobe [bins].

    If one of the two bins beside the top is raised by a share d of its amplitude, the parabola's top moves by d over
    twice the parabola's curvature.
    """
    away = np.abs(_bins_from(spectrum, own))
    near = (away >= BESIDE_BINS[0]) & (away <= BESIDE_BINS[1])
    if not near.any():
        return 0.0
    top = float(spectrum.relative_power[away <= 1].max())
    seen = np.sqrt(spectrum.relative_power[near] / top)
    unlike = np.sqrt(np.maximum((seen - _lobe(away[near])) ** 2 - NOISE_BESIDE / top, 0))
    share = float((unlike * _lobe(away[near] - 1)).max(initial=0)) / float(_lobe(np.array(1.0)))
    curve = np.pi / KAISER.noise_bandwidth_bins**2
    return share / (2 * curve)


def _rivals_std(
    spectrum: Spectrum, own: float, rest: float, at_rest: list[float], as_likely_db: float | None = None
) -> float:
    """Standard deviation of the body's place about a line, as other lines may be the body's [cycles a sample].

    Rivals are lines at least `rest` from velocity zero, and those at the places `at_rest`. A rival is as likely as the
    line itself if it has the same level, or the level `as_likely_db` where that is given.
    """
    power, level_db = spectrum.relative_power, spectrum.level_db
    away = _bins_from(spectrum, own)
    others = tops(power) & (np.abs(away) > LOBE_BINS)
    highest_db = float(level_db[np.abs(away) <= 1].max()) if as_likely_db is None else as_likely_db
    others &= np.abs(spectrum.frequency_hz) >= rest * spectrum.prf_hz
    for place in at_rest:
        others[np.where(np.abs(_bins_from(spectrum, place)) < LOBE_BINS, power, 0).argmax()] = True
    rivals = others & (level_db > max(highest_db - WEAKEST_DB, NOISE_TOP_DB))
    likely = np.exp((np.minimum(level_db[rivals], highest_db) - highest_db) / RIVAL_DB)
    return float(np.sqrt((likely * away[rivals] ** 2).sum() / (1 + likely.sum()))) / spectrum.bins
