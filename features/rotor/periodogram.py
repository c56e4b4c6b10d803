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

#: So many bins beside what was taken out the noise is thinner: it would lower the level of its block.
THINNED_BINS = 4

#: Transform length in units of the dwell: between two bins a line loses 0.2 dB.
PADDING = 4

#: The same where only the level is wanted: half of what lies between the bins tells nothing new.
LEVEL_PADDING = 2

#: The local level is followed in blocks of so many independent bins, by their lower quartile: lines
#: may fill the rest. What that is of the mean of an exponential stands beside it.
BLOCK_BINS = 24
LEVEL_QUANTILE = -np.log(3 / 4)

#: Of noise alone the logarithms of blocks' levels, transformed as `LEVEL_PADDING` says, are too high by this and have
#: this variance.
BLOCK_BIAS, BLOCK_SCATTER = 0.05, 0.106

#: What fitted lines leave is not taken to be below this share of the floor: the fit takes noise out too.
LEAST_LEVEL = 0.8

#: Lines over the floor by more than this [dB] leak past the plain periodogram: it is then tapered.
TAPER_FROM_DB = 23.0
TAPER_BETA = 3.0

#: A receiver's filter stops what lies where the local level is below this share of the floor.
STOP_SHARE = 0.3


#: A local level as a function of the frequency [cycles a sample].
Level = Callable[[NDArray[np.floating]], NDArray[np.float64]]


#: The skirt of a static background falls by so much from one octave of the velocity to the next [nats], over so many.
SKIRT_FALL, SKIRT_OCTAVES = 0.3, 2


@dataclass(frozen=True)
class Periodogram:
    """One record made ready for the search.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Samples of unit noise power, the strong slow lines taken out, whitening not applied.
    amplitude : ndarray of complex64, shape (PADDING * pulses, about)
        Amplitude over the root of the local level in FFT order, its phase that in the middle of the record.
    power : ndarray of float32, same shape
        Its square: noise has mean 1.
    level : ndarray of float64, same shape
        The local level [noise power a sample].
    strong : StrongLines
        The strong slow lines: what was taken out, and the centres about which a comb is sought.
    wavelength_m, prf_hz : float
        Of the radar.
    one_channel : bool
        Whether one side of the spectrum is empty: both sides of all lines lie on the other, see `half_empty`.
    ends_noise : float
        Noise power over the dwell, weighed by the time from its middle squared, as rates are told, over its mean.
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
        """The unambiguous span: what a cycle a sample is as a velocity [m/s]."""
        return self.prf_hz * self.wavelength_m / 2

    @cached_property
    def lines(self) -> LineSpace:
        """The samples, to be read at any frequency."""
        return LineSpace(self.samples)

    @cached_property
    def contrast(self) -> Evidence:
        """Evidence of a line in every bin, over what any place near by has where lines fill that: see `octaves`."""
        return Evidence(over_neighbours(line_evidence(self.power, self.block), self.block) * self.seen)

    @property
    def block(self) -> int:
        """Bins of a neighbourhood."""
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
        """True where a line at this frequency [cycles a sample] is not touched by what was taken out."""
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
        """True at frequencies [cycles a sample] where the level is that of the skirt of a static background.

        That falls from velocity zero to both sides, and no level further out is higher; where lines fill their band it
        rises towards the tips.
        """
        return np.asarray(np.abs(from_whole(frequency)) < self._skirt_half, np.bool_)

    def in_band(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where the receiver lets noise through: past its filter there is less than anywhere within."""
        return self.level_at(frequency) > STOP_SHARE

    def removed(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where a line at this frequency [cycles a sample] was taken out."""
        out = np.zeros(np.shape(frequency), bool)
        for centre, half in self.blocked:
            out |= np.abs(from_whole(frequency - centre)) < half - 3.0 / self.pulses
        return out

    def level_of(self, rest: NDArray[np.complex128], *, evened: bool = False) -> Level:
        """Local level of samples that lines were taken from, as a function of the frequency [cycles a sample].

        Evened, blocks whose levels differ by no more than chance have their common one.
        """
        size = fft.next_fast_len(LEVEL_PADDING * self.pulses)
        power = squared(fft.fft(rest.astype(np.complex64), size)) * np.float32(1 / self.pulses)
        keep = _kept(size, self.blocked, THINNED_BINS / self.pulses)
        level = _level_at_bins(power, keep, _block(size, self.pulses), evened=evened)
        return lambda frequency: np.maximum(level(np.rint(frequency * size) % size), LEAST_LEVEL)

    def left(self, samples: NDArray[np.complex128], own_level: Level | None = None) -> "Periodogram":
        """What is left of the same record, at the same local level.

        Where its own, from `level_of`, is given and lower, at that: lines that fill all there is between them have
        lifted the record's.
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
    """Centre and half width [cycles a sample] of bands, given as `Periodogram` has them, with a margin."""
    return tuple((turn, (half + 2) / pulses) for turn, half in bands)


def _block(size: int, pulses: int) -> int:
    """Bins of a neighbourhood in a transform of that size."""
    return int(BLOCK_BINS * size / pulses)


@lru_cache(maxsize=16)
def _taper(pulses: int) -> NDArray[np.float64]:
    window = np.kaiser(pulses, TAPER_BETA)
    taper = window / np.sqrt(np.mean(window**2))
    taper.setflags(write=False)
    return taper


@lru_cache(maxsize=16)
def _middle(pulses: int, size: int) -> NDArray[np.complex64]:
    """Turns the phases of a spectrum to those in the middle of the record, and norms noise to the power 1."""
    turn = (np.exp(1j * np.pi * (pulses - 1) * fft.fftfreq(size)) / np.sqrt(pulses)).astype(np.complex64)
    turn.setflags(write=False)
    return turn


def _spectrum(samples: NDArray[np.complex128], size: int, *, tapered: bool) -> NDArray[np.complex64]:
    shaped = samples * _taper(len(samples)) if tapered else samples
    return np.asarray(fft.fft(shaped.astype(np.complex64), size) * _middle(len(samples), size), np.complex64)


@lru_cache(maxsize=8)
def _kept(size: int, blocked: tuple[tuple[float, float], ...], margin: float = 0.0) -> NDArray[np.bool_]:
    """False in the bins of what was taken out, and so far beside [cycles a sample]."""
    keep = np.ones(size, bool)
    for centre, half in blocked:
        keep &= ~within(size, centre, half + margin)
    keep.setflags(write=False)
    return keep


def local_level(power: NDArray[np.floating], keep: NDArray[np.bool_], block: int) -> NDArray[np.float64]:
    """Smooth level of a spectrum in FFT order that lines do not lift: lower quartiles of blocks, joined by lines.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power spectrum over the noise floor: the level is never below a tenth of that, and is it where too little is
        kept.
    keep : ndarray of bool, shape (bins,)
        False where it was notched.
    block : int
        Bins of a block.
    """
    return _level_at_bins(power, keep, block)(np.arange(len(power)))


@lru_cache(maxsize=16)
def _blocks(size: int, block: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Bins of the blocks of a spectrum in FFT order, shape (blocks, bins), and their middles, rising.

    Those of the one side are the mirror images of the other's, that a record's conjugate has its level mirrored.
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
    """`local_level` as a function of the bin, from 0 to below their number; evened as in `Periodogram.level_of`."""
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
    if evened:  # by the share of their scatter that is chance
        away = logs - logs.mean()
        logs = logs - BLOCK_BIAS - BLOCK_SCATTER / max(float(away.var()), BLOCK_SCATTER) * away
    middles = middles[known]
    # the blocks at the ends once more around the circle: `interp` would turn every bin by its period
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
    """`prepared` for what was made of the samples of such a record; of unit noise power, and how loud at its ends."""
    again = prepared((samples * np.sqrt(spectrum.floor)).astype(np.complex64), spectrum)
    assert again is not None  # a record that was prepared has a floor
    return replace(again, ends_noise=ends_noise)
