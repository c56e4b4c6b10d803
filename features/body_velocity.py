"""The body's velocity with a deviation that knows what else may be the body's line, and what lies beside it."""

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

#: What the interpolation between bins is off by [bins], and by how much noise moves it where a line stands at its floor
#: [bins]: it falls with the line's amplitude. The window makes it 2.5 times the bound of a line's frequency.
INTERPOLATION_BINS, NOISE_BINS = 0.01, 0.68

#: And what the slow part of a background moves it by, where a line lies in one: leaves in a wind [bins].
BACKGROUND_BINS = 0.05

#: Where the body's line and its comb's centre differ by so many deviations, the comb is not one.
APART_DEVIATIONS = 3.0

#: Without a comb that tells which line is the body's, one that is so much weaker than the strongest is as likely
#: beside it as 1 to e, and none that is weaker by more than the second [dB].
RIVAL_DB, WEAKEST_DB = 2.0, 8.0

#: Nor one that noise alone might be: the highest bin of 10 000 spectra stood at 13 dB.
NOISE_TOP_DB = 13.5

#: Before something at rest a line that moves is the body's where it stands so far over all on the other side of rest
#: [dB]: a moving body's did in all but 5 of 2900 (drones, birds and cars before ground, 3.3 to 35 GHz), the strongest
#: line of a hovering drone's blades in none of 351.
OTHER_SIDE_DB = 8.0

#: Nor where a line stands on that side as far from the one at rest as this on its own, to so many bins: blades whose
#: edges reflect unlike leave there a line of any level.
MIRROR_BINS = 1.5

#: One that does not is the body's all the same so often, at most: 5 of 450 were.
MOVES_SHARE = 0.05

#: What is stronger at rest is a hovering body and no background where its top is so far off rest [bins] and all that
#: lies about it stands so far below it [dB]: of 351 hovering drones 222 were, of 3200 backgrounds one.
OFF_REST_BINS, PURE_DB = 1.0, 25.0

#: A line is the one at a comb's centre up to so far from it [bins].
AT_CENTRE_BINS = 1.0

#: What is known to this share of the unambiguous span is not known: anywhere in it is 0.29.
UNTOLD_SHARE = 0.2

#: Lines from and up to so far off pull at the body's [bins]: nearer ones are one with it, the lobe ends further out.
BESIDE_BINS = (1.5, 8.0)

#: Noise beside the line is hardly above this, in units of the floor: the bound of the line's frequency knows it.
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
        False for unresolved rotors, or a rate that is not steady: the comb's centre has no true deviation then.
    open_std : float
        What the choice of the comb's centre adds to the deviation [cycles a sample].
    blades : bool
        Where no comb is given: that one is there, and lines that move are blades'.

    Returns
    -------
    velocity_mps, std_mps : float
        Positive when the range grows. Without a comb, that of the strongest line, if one moves of that; NaN where none
        stands out, or where it may lie anywhere.
    """
    own, level_db = data.strong.lines[0]
    if fit is not None:
        # before a background that is stronger: the line at the comb's centre, where one is seen
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
        # rotors that were taken for one move its comb, and a body that turns has a line whose top is not its mean
        apart = offset if offset > APART_DEVIATIONS * np.hypot(std, fit.centre_std) else 0.0
        if offset * data.pulses > AT_CENTRE_BINS:
            # no background lies beside rest: a line there is as likely a slow body's
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
    """The line that is the body's most likely where no comb tells, its level [dB], and its deviation by the others.

    It is the strongest that leaves do not make in a wind, or one that stands out of what they make, if there is any and
    blades do not: what stands at rest is a background then, or a rival where it is hardly stronger. Where it is much
    stronger, and a hovering body's by its shape, or lines that move are as strong on both sides of it, these are a
    hovering drone's blades. Places in [cycles a sample].
    """
    lines = data.strong.lines
    loud = [] if blades else [line for line in lines if line[1] >= LINE_DB]
    moving = [line for line in loud if abs(line[0]) >= data.rest_half]
    if not moving and abs(lines[0][0]) * data.pulses <= LOBE_BINS:  # else the strongest is leaves' own
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
    """Whether what is on the other side of rest, further from it than so much, says that a line is one of blades.

    It is about as strong, or a line as far from that at rest.
    """
    turns = spectrum.frequency_hz / spectrum.prf_hz
    across = (np.abs(turns) > rest) & (turns * line < 0)
    mirror = across & tops(spectrum.relative_power) & (np.abs(_bins_from(spectrum, 2 * slow - line)) <= MIRROR_BINS)
    as_strong = float(spectrum.level_db[across].max(initial=-np.inf)) > max(level_db - OTHER_SIDE_DB, NOISE_TOP_DB)
    return as_strong or float(spectrum.level_db[mirror].max(initial=-np.inf)) > NOISE_TOP_DB


def _is_hovering(spectrum: Spectrum, line: float, level_db: float, rest: float) -> bool:
    """Whether a line that is slower than so much is a body's, as no background is: off rest, and nothing about it."""
    turns = np.abs(spectrum.frequency_hz) / spectrum.prf_hz
    about = (turns <= rest) & (np.abs(_bins_from(spectrum, line)) > LOBE_BINS)
    pure = bool(about.any()) and float(spectrum.level_db[about].max()) < level_db - PURE_DB
    return abs(line) * spectrum.pulses >= OFF_REST_BINS and pure


def folded(turns: float) -> float:
    """A frequency within the unambiguous span, -0.5 to 0.5 [cycles a sample]: a comb's centre may be fitted beyond."""
    return turns - round(turns)


def _lobe(bins: NDArray[np.floating]) -> NDArray[np.floating]:
    """Amplitude of the window's main lobe (Kaiser and Schafer 1980)."""
    root = np.sqrt(np.maximum(KAISER_BETA**2 - (np.pi * bins) ** 2, 1e-9))
    return np.asarray(np.sinh(root) / root * (KAISER_BETA / np.sinh(KAISER_BETA)))


def _bins_from(spectrum: Spectrum, place: float) -> NDArray[np.float64]:
    """Distance of each bin from a frequency [cycles a sample], around the circle [bins]."""
    return np.asarray(from_whole(spectrum.frequency_hz / spectrum.prf_hz - place) * spectrum.bins, np.float64)


def _pulled_bins(spectrum: Spectrum, own: float) -> float:
    """How far lines beside a line may pull the top of its lobe [bins].

    A share d of the amplitude at one of the two bins beside the top moves the parabola's top by d over twice its curve.
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
    """Deviation of a line's place, where others may be the body's: so far from rest and further, or at these places.

    One of the line's own level is as likely as that, or one of the level given.
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
