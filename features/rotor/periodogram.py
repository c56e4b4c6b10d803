"""The periodogram that combs are sought in: strong slow lines removed, noise and skirt whitened."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..bodies import within
from ..clicks import without_clicks
from ..evidence import Evidence, line_evidence
from ..lines import LineSpace, from_whole, squared
from ..one_channel import half_empty
from ..spectrum import Spectrum, doppler_spectrum
from .octaves import over_neighbours
from .slow_lines import remove_bands
from .strong_lines import StrongLines, strong_lines

#: Up to this many bins beside a band taken out the noise is reduced: these bins do not count for the local level.
THINNED_BINS = 4

#: Transform length over the number of pulses: half way between two bins a line loses 0.2 dB.
PADDING = 4

#: The same where only the local level is wanted: a finer grid tells nothing new about it.
LEVEL_PADDING = 2

#: The local level is the lower quartile of blocks of BLOCK_BINS independent bins: lines may fill the rest.
#: LEVEL_QUANTILE: lower quartile of an exponential law over its mean.
BLOCK_BINS = 24
LEVEL_QUANTILE = -np.log(3 / 4)

#: For noise alone, padded by `LEVEL_PADDING`, the logarithms of block levels are too high by BLOCK_BIAS and have the
#: variance BLOCK_SCATTER.
BLOCK_BIAS, BLOCK_SCATTER = 0.05, 0.106

#: The level of the residual of fitted lines is at least this share of the noise floor: the fit removes noise too.
LEAST_LEVEL = 0.8

#: Lines more than TAPER_FROM_DB over the local level [dB] leak too far: a Kaiser window of TAPER_BETA is then applied.
TAPER_FROM_DB = 23.0
TAPER_BETA = 3.0

#: If the local level is below this share of the noise floor, the receiver's filter blocks these frequencies.
STOP_SHARE = 0.3


#: A local level as a function of the frequency [cycles a sample].
Level = Callable[[NDArray[np.floating]], NDArray[np.float64]]


#: In the skirt of a static background the level falls by more than SKIRT_FALL from each octave of velocity to the next
#: [nats], at least SKIRT_OCTAVES times.
SKIRT_FALL, SKIRT_OCTAVES = 0.3, 2


@dataclass(frozen=True)
class Periodogram:
    """One record made ready for the search.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Samples in units of the noise's rms, strong slow lines removed, not whitened.
    amplitude : ndarray of complex64, shape (PADDING * pulses, about)
        Spectrum over the square root of the local level, FFT order; phases refer to the middle of the record.
    power : ndarray of float32, same shape
        Its squared magnitude: noise has mean 1; 1 in bands taken out.
    level : ndarray of float64, same shape
        The local level [noise power a sample].
    strong : StrongLines
        The strong slow lines: what was taken out, and the centres about which a comb is sought.
    wavelength_m, prf_hz : float
        Wavelength and pulse repetition frequency of the radar.
    one_channel : bool
        Whether one side of the spectrum is empty: the other holds both sides of every comb, see `half_empty`.
    ends_noise : float
        Mean noise power weighted by the squared time from the middle of the dwell, as in the variance of a frequency,
        over its plain mean.
    """

    samples: NDArray[np.complex128]
    amplitude: NDArray[np.complex64]
    power: NDArray[np.float32]
    level: NDArray[np.float64]
    strong: StrongLines
    wavelength_m: float
    prf_hz: float
    one_channel: bool
    ends_noise: float = 1.0

    @cached_property
    def blocked(self) -> tuple[tuple[float, float], ...]:
        """Centre and half width [cycles a sample] of what was taken out, with a margin."""
        return _blocked(self.strong.bands, self.pulses)

    @property
    def rest_half(self) -> float:
        """Half width of what was taken out about velocity zero [cycles a sample]; 0 if nothing was."""
        return max((half for turn, half in self.blocked if turn == 0.0), default=0.0)

    @property
    def pulses(self) -> int:
        """Pulses of the record."""
        return len(self.samples)

    @property
    def span_mps(self) -> float:
        """The unambiguous span of velocities, one cycle a sample [m/s]."""
        return self.prf_hz * self.wavelength_m / 2

    @cached_property
    def lines(self) -> LineSpace:
        """The samples, to be read at any frequency."""
        return LineSpace(self.samples)

    @cached_property
    def contrast(self) -> Evidence:
        """Evidence of a line in every bin, less the mean nearby where lines fill that; 0 where not `seen`."""
        return Evidence(over_neighbours(line_evidence(self.power, self.block), self.block) * self.seen)

    @property
    def block(self) -> int:
        """Bins of a neighbourhood, which span `BLOCK_BINS` independent ones."""
        return _block(len(self.power), self.pulses)

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """True in the bins of `power` where a line can be seen."""
        size = len(self.power)
        return self.usable(np.arange(size) / size)

    def bins_of(self, frequency: NDArray[np.floating]) -> NDArray[np.intp]:
        """The bins of `power` at frequencies [cycles a sample], any shape; aliases are folded."""
        size = len(self.power)
        return np.rint(frequency * size).astype(np.intp) % size

    def at(self, frequency: NDArray[np.floating]) -> NDArray[np.float32]:
        """Power over the local level at frequencies [cycles a sample]."""
        return self.power[self.bins_of(frequency)]

    def level_at(self, frequency: NDArray[np.floating]) -> NDArray[np.float64]:
        """Local level at frequencies [cycles a sample]."""
        return self.level[self.bins_of(frequency)]

    def usable(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where a line at this frequency [cycles a sample] is clear of the bands taken out."""
        ok = np.ones(np.shape(frequency), bool)
        for centre, half in self.blocked:
            ok &= np.abs(from_whole(frequency - centre)) > half + 1.5 / self.pulses
        return ok

    @cached_property
    def _skirt_half(self) -> float:
        """How far the skirt of a static background reaches to both sides [cycles a sample], 0 where there is none."""
        if self.rest_half == 0:
            return 0.0
        size, first = len(self.level), int(self.rest_half * len(self.level)) + 1
        octaves = int(np.log2(size / 2 / first))
        both = np.minimum(self.level, np.roll(self.level[::-1], 1))[: size // 2]
        ends = first * 2 ** np.arange(octaves + 1)
        levels = [float(np.log(both[low:high]).mean()) for low, high in pairwise(ends)]
        falls = np.append(np.diff(levels) < -SKIRT_FALL, False)
        last = int(falls.argmin())
        if last < SKIRT_OCTAVES or np.log(both[ends[1] :].max()) > levels[0] + SKIRT_FALL:
            return 0.0
        return float(ends[last + 1]) / size

    def in_skirt(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True at frequencies [cycles a sample] within the skirt of a static background.

        In a skirt the level falls from velocity zero to both sides, and no level further out is higher. Where blade
        lines fill their band, the level rises towards the tips.
        """
        return np.asarray(np.abs(from_whole(frequency)) < self._skirt_half, np.bool_)

    def in_band(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where the receiver's filter passes noise: beyond, the level is lower than anywhere within."""
        return self.level_at(frequency) > STOP_SHARE

    def removed(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where a line at this frequency [cycles a sample] was taken out with a band."""
        out = np.zeros(np.shape(frequency), bool)
        for centre, half in self.blocked:
            out |= np.abs(from_whole(frequency - centre)) < half - 3.0 / self.pulses
        return out

    def level_of(self, rest: NDArray[np.complex128], *, evened: bool = False) -> Level:
        """Local level of samples from which lines were subtracted, as a function of frequency [cycles a sample].

        With `evened`, block levels that differ by no more than chance are replaced by their mean, others drawn to it.
        """
        size = fft.next_fast_len(LEVEL_PADDING * self.pulses)
        power = squared(fft.fft(rest.astype(np.complex64), size)) * np.float32(1 / self.pulses)
        keep = _kept(size, self.blocked, THINNED_BINS / self.pulses)
        level = _level_at_bins(power, keep, _block(size, self.pulses), evened=evened)
        return lambda frequency: np.maximum(level(np.rint(frequency * size) % size), LEAST_LEVEL)

    def left(self, samples: NDArray[np.complex128], own_level: Level | None = None) -> "Periodogram":
        """The same record with these samples, a residual, whitened by the same local level.

        The residual's `own_level`, from `level_of`, is used where it is given and lower: lines that fill the gaps
        between them have lifted the record's level.
        """
        size = len(self.power)
        level = self.level
        if own_level is not None:
            level = np.minimum(level, np.maximum(own_level(np.arange(size) / size), 1.0))
        amplitude = (_spectrum(samples, size, tapered=False) / np.sqrt(level)).astype(np.complex64)
        power = squared(amplitude)
        power[~_kept(size, self.blocked)] = 1.0
        return replace(self, samples=samples, amplitude=amplitude, power=power, level=level)


def _blocked(bands: tuple[tuple[float, float], ...], pulses: int) -> tuple[tuple[float, float], ...]:
    """Centre and half width [cycles a sample] of `StrongLines.bands`, widened by two bins to each side."""
    return tuple((turn, (half + 2) / pulses) for turn, half in bands)


def _block(size: int, pulses: int) -> int:
    """Bins that span `BLOCK_BINS` independent ones in a transform of that size."""
    return int(BLOCK_BINS * size / pulses)


@lru_cache(maxsize=16)
def _taper(pulses: int) -> NDArray[np.float64]:
    window = np.kaiser(pulses, TAPER_BETA)
    taper = window / np.sqrt(np.mean(window**2))
    taper.setflags(write=False)
    return taper


@lru_cache(maxsize=16)
def _middle(pulses: int, size: int) -> NDArray[np.complex64]:
    """Factors that refer the phases of a spectrum to the middle of the record and scale noise to power 1."""
    turn = (np.exp(1j * np.pi * (pulses - 1) * fft.fftfreq(size)) / np.sqrt(pulses)).astype(np.complex64)
    turn.setflags(write=False)
    return turn


def _spectrum(samples: NDArray[np.complex128], size: int, *, tapered: bool) -> NDArray[np.complex64]:
    shaped = samples * _taper(len(samples)) if tapered else samples
    return np.asarray(fft.fft(shaped.astype(np.complex64), size) * _middle(len(samples), size), np.complex64)


@lru_cache(maxsize=8)
def _kept(size: int, blocked: tuple[tuple[float, float], ...], margin: float = 0.0) -> NDArray[np.bool_]:
    """False in the bins of bands taken out, each widened by `margin` to both sides [cycles a sample]."""
    keep = np.ones(size, bool)
    for centre, half in blocked:
        keep &= ~within(size, centre, half + margin)
    keep.setflags(write=False)
    return keep


def local_level(power: NDArray[np.floating], keep: NDArray[np.bool_], block: int) -> NDArray[np.float64]:
    """Smooth level of a spectrum in FFT order, robust to lines: lower quartiles of blocks, their logs interpolated.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power spectrum over the noise floor. The level is at least a tenth of the floor, and equals it if no block
        keeps a third of its bins.
    keep : ndarray of bool, shape (bins,)
        False in notched bins.
    block : int
        Bins of a block, about.
    """
    return _level_at_bins(power, keep, block)(np.arange(len(power)))


@lru_cache(maxsize=16)
def _blocks(size: int, block: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Bins of the blocks of a spectrum in FFT order, shape (blocks, bins), and their middles, rising.

    Blocks of one side mirror those of the other, so that a conjugated record has the mirrored level.
    """
    half = (size - 1) // 2
    count = max(2, size // (2 * block))
    length = half // count
    # the few bins that whole blocks leave over are skipped, evenly
    upper = 1 + ((np.arange(count) * half) // count)[:, None] + np.arange(length)
    inside = np.concatenate([upper, size - upper[::-1]])
    middles = inside.mean(axis=1)
    for shared in (inside, middles):
        shared.setflags(write=False)
    return inside, middles


def _level_at_bins(
    power: NDArray[np.floating], keep: NDArray[np.bool_], block: int, *, evened: bool = False
) -> Callable[[NDArray], NDArray[np.float64]]:
    """`local_level` as a function of the bin, from 0 to size - 1; `evened` as in `Periodogram.level_of`."""
    size = len(power)
    inside, middles = _blocks(size, block)
    count, length = inside.shape
    kept = keep[inside]
    held = np.where(kept, power[inside], np.inf)
    number = kept.sum(axis=1)
    held.sort(axis=1)
    levels = held[np.arange(count), np.minimum(number // 4, length - 1)] / LEVEL_QUANTILE
    known = np.flatnonzero(number >= length / 3)
    if not len(known):
        return lambda bins: np.ones(np.shape(bins))
    logs = np.log(np.maximum(levels[known], 0.1))
    if evened:  # drawn to the mean by the share of their variance that is chance
        away = logs - logs.mean()
        logs = logs - BLOCK_BIAS - BLOCK_SCATTER / max(float(away.var()), BLOCK_SCATTER) * away
    middles = middles[known]
    # the end blocks repeated around the circle: this spares `interp` its period, by which it would fold every bin
    middles = np.concatenate([middles[-1:] - size, middles, middles[:1] + size])
    logs = np.concatenate([logs[-1:], logs, logs[:1]])
    return lambda bins: np.exp(np.interp(bins, middles, logs))


def prepare(iq: NDArray[np.complex64], *, carrier_hz: float, prf_hz: float) -> Periodogram | None:
    """Make one record ready: find the body line, take it and the static background out, whiten.

    Parameters
    ----------
    iq : ndarray of complex64, shape (pulses,)
        One record, finite.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].

    Returns
    -------
    Periodogram or None
        None for a record without power.
    """
    return prepared(iq, doppler_spectrum(iq, carrier_hz=carrier_hz, prf_hz=prf_hz))


def prepared(iq: NDArray[np.complex64], spectrum: Spectrum) -> Periodogram | None:
    """`prepare` for a record whose spectrum is known."""
    if not spectrum.floor > 0:
        return None
    pulses, strong = spectrum.pulses, strong_lines(spectrum)
    samples = iq.astype(np.complex128) / np.sqrt(spectrum.floor)
    samples = without_clicks(remove_bands(samples, strong.bands))
    blocked = _blocked(strong.bands, pulses)
    size = fft.next_fast_len(PADDING * pulses)
    keep, full = _kept(size, blocked), _kept(size, blocked, THINNED_BINS / pulses)
    block = _block(size, pulses)
    for tapered in (False, True):
        amplitude = _spectrum(samples, size, tapered=tapered)
        power = squared(amplitude)
        level = local_level(power, full, block)
        whitened = (power / level).astype(np.float32)
        if whitened[keep].max(initial=0) <= 10 ** (TAPER_FROM_DB / 10):
            break
    whitened[~keep] = 1.0
    return Periodogram(
        samples,
        (amplitude / np.sqrt(level)).astype(np.complex64),
        whitened,
        level,
        strong,
        spectrum.wavelength_m,
        spectrum.prf_hz,
        bool(half_empty(spectrum.relative_power)),
    )


def prepared_again(samples: NDArray[np.complex128], spectrum: Spectrum, ends_noise: float) -> Periodogram:
    """`prepared` for altered samples of a prepared record, in units of its noise; `ends_noise` as in `Periodogram`."""
    again = prepared((samples * np.sqrt(spectrum.floor)).astype(np.complex64), spectrum)
    assert again is not None  # a record that was prepared has a floor
    return replace(again, ends_noise=ends_noise)
