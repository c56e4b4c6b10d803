"""What repeats in a pattern of levels over velocity and time, apart from what rises and falls at all velocities alike.

Fading, a gain that wanders and two lines that beat lift and lower the level of every cell together: a pattern of rank
one. What moves through the velocities, as wings do, is a pattern of a higher rank. So the common course is taken out
first, and a rate is sought at whose multiples enough is left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .lines import squared

#: Multiples of the rate that are looked at.
HARMONICS = 6

#: Taken off the evidence for each multiple that is used, the first included [standard deviations of noise].
HARMONIC_COST = 1.0

#: The fastest rate that has nearly the best evidence is the rate: the best one is then a fraction of it. Its evidence
#: may be less by FASTER_LESS [standard deviations], or by FASTER_SHARE of the best one's, whichever is more.
FASTER_LESS, FASTER_SHARE = 15.0, 0.03

#: The rate itself, or twice the rate, must hold at least this share of the evidence.
LOW_SHARE = 0.15

#: Transform length over that of the record: zeros are appended, so that the spectrum can be read between its bins.
_PADDING = 8

#: _CONTINUUM_HZ: width of the running median that gives the continuum of fluctuations [Hz]. _SLOWEST_HZ: lowest rate
#: that its level is taken from [Hz].
_CONTINUUM_HZ, _SLOWEST_HZ = 6.0, 2.0

#: A level that fluctuates by less than this only shows rounding [natural logarithm of a float32 power].
_ROUNDING = 1e-5

#: Wings that pause, their phase held meanwhile, spread the power about their rate over several lines. They pause where
#: lines within _ABOUT_HZ of the rate [Hz] hold at least _PAUSES_SHARE of their power outside the main line, which
#: reaches _MAIN_BINS bins of the recording to each side. Lines of steady wings held none outside it, those of birds
#: that glide or bound in between a fifth to a third.
_ABOUT_HZ, _PAUSES_SHARE, _MAIN_BINS = 1.8, 0.05, 2.0

#: _OVER_CHANCE: power counts there only above this many times that of chance. _CENTRE_SHARE: least standard deviation
#: of the centre of these lines, as a share of their spread.
_OVER_CHANCE, _CENTRE_SHARE = 2.0, 1 / 4

#: Factor by which stated variances allow for neighbouring cells and frames that are not independent [1].
_OVERLAP = 2.3


@dataclass(frozen=True)
class Repetition:
    """The rate at which a pattern repeats, and what speaks for it.

    Parameters
    ----------
    rate_hz, rate_hz_std : float
        [Hz]
    evidence : float
        Power at the rate's multiples without the common course, in excess of that of chance [standard deviations].
    moving_share : float
        Share of the repeating pattern that no common course of all velocities explains, 0..1.
    cells : ndarray of bool, shape (cells,)
        Where the pattern repeats.
    """

    rate_hz: float
    rate_hz_std: float
    evidence: float
    moving_share: float
    cells: NDArray[np.bool_]


@dataclass(frozen=True)
class LevelSpectrum:
    """Spectrum over time of each cell's level, relative to its continuum.

    Parameters
    ----------
    whole : ndarray of complex128, shape (rates, cells)
        In units of the continuum's rms.
    moving : ndarray of complex128, same shape
        The same without the common course.
    weight : ndarray of float64, shape (cells,)
        Weight of a cell, 0..1: 0 where it holds noise alone.
    step_hz : float
        Step between the rates [Hz].
    """

    whole: NDArray[np.complex128]
    moving: NDArray[np.complex128]
    weight: NDArray[np.float64]
    step_hz: float

    def excess(self, amplitudes: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Weighted power of the cells at each rate over that of chance [standard deviations], shape (rates,)."""
        over = (squared(amplitudes) - 1) @ self.weight
        return np.asarray(over / np.sqrt(2 * (self.weight**2).sum() + 1e-9), np.float64)

    def used(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The given cells, or, if there are none, all of a weight above 0, shape (cells,)."""
        return cells if cells.any() else self.weight > 0

    def at(self, rate_hz: float) -> float:
        """Excess without the common course at the first multiples of a rate together [standard deviations]."""
        place = self.places(rate_hz, 1) * np.arange(1, HARMONICS + 1)
        excess = self.excess(self.moving)
        place = place[place < len(excess)]
        return float(excess[place].sum() / np.sqrt(len(place)))

    def places(self, rate_hz: NDArray[np.float64] | float, order: int) -> NDArray[np.intp]:
        """Index of the multiple `order` of each rate."""
        return np.asarray(np.rint(np.asarray(rate_hz) * order / self.step_hz), np.intp)


def level_spectrum(
    power: NDArray[np.float32], floor: float, frame_rate_hz: float, highest_hz: float
) -> LevelSpectrum | None:
    """Spectra of the levels of cells over time.

    Parameters
    ----------
    power : ndarray of float32, shape (frames, cells)
        Power of each cell over time.
    floor : float
        Noise power of a cell.
    frame_rate_hz : float
        Frames a second [Hz].
    highest_hz : float
        Highest rate that is kept [Hz].

    Returns
    -------
    LevelSpectrum or None
        None where no cell is over the noise, or nothing fluctuates.
    """
    from scipy.ndimage import median_filter  # here, because judging dwells needs no such import

    mean = power.mean(axis=0, dtype=np.float64)
    weight = np.maximum(mean / floor - 1.3, 0)  # cells of noise alone say nothing
    weight /= weight + 1
    if not weight.any():
        return None
    level = np.log1p(power / np.float32(floor)).astype(np.float64)
    level -= level.mean(axis=0)
    if np.abs(level).max() < _ROUNDING:
        return None
    size = fft.next_fast_len(_PADDING * len(level), real=True)
    step_hz = frame_rate_hz / size
    taper = np.hanning(len(level) + 2)[1:-1, None]
    spectrum = fft.rfft(level * taper, size, axis=0)[: int(highest_hz / step_hz) + 2]
    lines = squared(spectrum)
    slowest = int(_SLOWEST_HZ / step_hz)
    own = np.median(lines[slowest:], axis=0) + 1e-12
    lines /= own
    course = median_filter(lines.mean(axis=1), size=int(_CONTINUUM_HZ / step_hz) | 1, mode="nearest")
    # the median of an exponential is log 2 times its mean
    course *= np.median(lines[slowest:] / course[slowest:, None]) / np.log(2)
    whole = spectrum / np.sqrt(own * course[:, None])
    # a common gain changes the level of a cell the more, the further its echo is over the noise
    common = mean / (mean + floor) / np.sqrt(own)
    weighed = common * weight
    moving = whole - np.outer(whole @ weighed / (weighed @ common), common)
    return LevelSpectrum(whole, moving, weight, step_hz)


def repetition(levels: LevelSpectrum, low_hz: float, high_hz: float) -> Repetition:
    """The rate between two limits at which a pattern repeats best.

    Parameters
    ----------
    levels : LevelSpectrum
        From `level_spectrum`.
    low_hz, high_hz : float
        Limits [Hz].

    Returns
    -------
    Repetition
    """
    excess = levels.excess(levels.moving)
    rates = np.arange(low_hz, high_hz, levels.step_hz / 3)
    total, best, orders = np.zeros(len(rates)), np.full(len(rates), -np.inf), np.ones(len(rates), np.intp)
    for order in range(1, HARMONICS + 1):
        place = levels.places(rates, order)
        inside = place < len(excess)
        total += np.where(inside, excess[np.minimum(place, len(excess) - 1)] - HARMONIC_COST, -np.inf)
        better = total > best
        best[better], orders[better] = total[better], order
    # a rate of which only a high multiple is seen is a fraction of the true rate
    low = np.maximum(*(excess[np.minimum(levels.places(rates, k), len(excess) - 1)] for k in (1, 2)))
    best[low < LOW_SHARE * best] = -np.inf
    peaks = 1 + np.flatnonzero((best[1:-1] >= best[:-2]) & (best[1:-1] > best[2:]))
    most = best.max()
    good = peaks[best[peaks] >= most - max(FASTER_LESS, FASTER_SHARE * most)]
    chosen = int(good[-1]) if len(good) else int(best.argmax())
    multiples = np.arange(1, int(orders[chosen]) + 1)
    place = np.array([levels.places(rates[chosen], int(k)) for k in multiples])
    power = np.abs(levels.whole[place]) ** 2
    moving = np.abs(levels.moving[place]) ** 2
    limit = 5 * np.sqrt(len(multiples))
    cells = ((moving - 1).sum(axis=0) > max(limit, 0.03 * (moving - 1).sum(axis=0).max())) & (
        (power - 1).sum(axis=0) > max(limit, 0.03 * (power - 1).sum(axis=0).max())
    )
    rate, std = _refined(levels, float(rates[chosen]), multiples, cells)
    return Repetition(rate, std, float(best[chosen]), _moving_share(levels, place), cells)


def while_moving(levels: LevelSpectrum, found: Repetition) -> tuple[float, float]:
    """Rate of a motion while it lasts, and its standard deviation: not the pattern's rate where the motion pauses.

    Parameters
    ----------
    levels : LevelSpectrum
        From `level_spectrum`.
    found : Repetition
        From `repetition`. Where the motion pauses, this is one of several lines, spaced by the rate of the pauses.

    Returns
    -------
    rate_hz, rate_hz_std : float
        [Hz]
    """
    used = levels.used(found.cells)
    rates = np.arange(len(levels.moving)) * levels.step_hz
    about = (np.abs(rates - found.rate_hz) < _ABOUT_HZ) & (rates >= _SLOWEST_HZ)
    power = np.maximum(squared(levels.moving[np.ix_(about, used)]).mean(axis=1) - _OVER_CHANCE, 0.0)
    total = float(power.sum())
    main = np.abs(rates[about] - found.rate_hz) <= _MAIN_BINS * _PADDING * levels.step_hz
    if total == 0 or float(power[~main].sum()) < _PAUSES_SHARE * total:
        return found.rate_hz, found.rate_hz_std
    centre = float(power @ rates[about]) / total
    spread = float(np.sqrt(power @ (rates[about] - centre) ** 2 / total))
    return centre, max(found.rate_hz_std, _CENTRE_SHARE * spread)


def _moving_share(levels: LevelSpectrum, place: NDArray[np.intp]) -> float:
    """Share of the pattern at these places that no course over time common to all cells explains."""
    rows = levels.whole[place] * np.sqrt(levels.weight)
    strength = np.linalg.svd(np.concatenate([rows.real, rows.imag]), compute_uv=False) ** 2
    number = 2 * len(place)
    noise = levels.weight.sum() * len(place)
    over = strength[1:].sum() - noise * (number - 1) / number
    return float(np.clip(over / max(strength.sum() - noise, 1e-9), 0, 1))


def _refined(
    levels: LevelSpectrum, rate: float, order: NDArray[np.intp], cells: NDArray[np.bool_]
) -> tuple[float, float]:
    """The rate from the tops of its multiples, and its deviation: by their curvature, or their scatter if that is more.

    The power at a multiple is the log likelihood of its place, so the curvature at its top is one over the variance.
    """
    used = levels.used(cells)
    power = (np.abs(levels.moving[:, used]) ** 2).sum(axis=1)
    places, weights = [], []
    for k in order:
        near = int(levels.places(rate, int(k)))
        reach = _PADDING // 2
        low = max(near - reach, 1)
        top = low + int(power[low : near + reach + 1].argmax())
        if not low < top < min(near + reach, len(power) - 2):
            continue
        left, middle, right = power[top - 1 : top + 2]
        curve = 2 * middle - left - right
        if curve > 0:
            places.append((top + (right - left) / (2 * curve)) * levels.step_hz / k)
            weights.append(curve * k**2 / levels.step_hz**2)
    if not places:
        return rate, levels.step_hz * _PADDING
    rates, weight = np.array(places), np.array(weights)
    found = float(np.average(rates, weights=weight))
    variance = _OVERLAP / weight.sum()
    if len(rates) > 1:
        variance *= max(1.0, float((weight * (rates - found) ** 2).sum()) / (len(rates) - 1) / _OVERLAP)
    return found, float(np.sqrt(variance))
