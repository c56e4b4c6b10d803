"""The periodogram that combs are sought in: strong slow lines removed, noise and skirt whitened."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .notch import NOTCH_MPS, Body, body_line
from .slow_lines import remove_bands
from .spectrum import NOISE_BANDWIDTH_BINS, Spectrum, doppler_spectrum

#: A line counts as present from this level over the floor [dB]: noise alone reaches it in one of 10 000 spectra.
LINE_DB = 17.0

#: Half width taken out about the body line [m/s]. A body is steadier than the clutter about velocity zero.
BODY_NOTCH_MPS = 0.5

#: Transform length in units of the dwell: between two bins a line loses 0.2 dB.
PADDING = 4

#: The local level is followed in blocks of so many independent bins, by their lower quartile: lines
#: may fill the rest. What that is of the mean of an exponential stands beside it.
BLOCK_BINS = 24
LEVEL_QUANTILE = -np.log(3 / 4)

#: Lines over the floor by more than this [dB] leak past the plain periodogram: it is then tapered.
TAPER_FROM_DB = 23.0
TAPER_BETA = 3.0

#: A line weaker than its neighbourhood by this factor in power is a leak or an imbalance, not a line of the comb.
NEIGHBOUR_SHARE = 0.03


@dataclass(frozen=True)
class Periodogram:
    """One record made ready for the search.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        Samples of unit noise power, the strong slow lines taken out, whitening not applied.
    power : ndarray of float64, shape (PADDING * pulses, about)
        Power over the local level in FFT order: noise has mean 1.
    level : ndarray of float64, same shape
        The local level [noise power a sample].
    blocked : tuple of (float, float)
        Centre and half width [cycles a sample] of what was taken out.
    centres : tuple of float
        Where the body line may be [cycles a sample], strongest first: about these a comb is sought.
    centres_db : tuple of float
        Their levels over the floor [dB].
    wavelength_m, prf_hz : float
        Of the radar.
    """

    samples: NDArray[np.complex128]
    power: NDArray[np.float64]
    level: NDArray[np.float64]
    blocked: tuple[tuple[float, float], ...]
    centres: tuple[float, ...]
    centres_db: tuple[float, ...]
    wavelength_m: float
    prf_hz: float

    @property
    def rest_half(self) -> float:
        """Half width of what was taken out about velocity zero [cycles a sample]; 0 if nothing was."""
        return max((half for turn, half in self.blocked if turn == 0.0), default=0.0)

    @property
    def pulses(self) -> int:
        """Pulses of the record."""
        return len(self.samples)

    def at(self, frequency: NDArray[np.floating]) -> NDArray[np.float64]:
        """Power over the local level at frequencies [cycles a sample], any shape; aliases are folded."""
        size = len(self.power)
        return self.power[np.rint(frequency * size).astype(np.intp) % size]

    def level_at(self, frequency: NDArray[np.floating]) -> NDArray[np.float64]:
        """Local level at frequencies [cycles a sample]."""
        size = len(self.level)
        return self.level[np.rint(frequency * size).astype(np.intp) % size]

    def usable(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where a line at this frequency [cycles a sample] is not touched by what was taken out."""
        ok = np.ones(np.shape(frequency), bool)
        for centre, half in self.blocked:
            away = frequency - centre
            ok &= np.abs(away - np.rint(away)) > half + 1.5 / self.pulses
        return ok

    def removed(self, frequency: NDArray[np.floating]) -> NDArray[np.bool_]:
        """True where a line at this frequency [cycles a sample] was taken out."""
        out = np.zeros(np.shape(frequency), bool)
        for centre, half in self.blocked:
            away = frequency - centre
            out |= np.abs(away - np.rint(away)) < half - 1.0 / self.pulses
        return out

    def level_of(self, rest: NDArray[np.complex128]) -> Callable[[NDArray[np.floating]], NDArray[np.float64]]:
        """Local level of samples that lines were taken from, as a function of the frequency [cycles a sample]."""
        power = _power(rest, len(self.power), tapered=False)
        keep = np.ones(len(power), bool)
        for centre, half in self.blocked:
            keep &= ~_within(len(power), centre, half)
        level = local_level(power, keep, 1.0, int(BLOCK_BINS * len(power) / self.pulses))
        return lambda frequency: level[np.rint(frequency * len(level)).astype(np.intp) % len(level)]

    def without(self, part: NDArray[np.complex128]) -> "Periodogram":
        """The same record with a part of its samples subtracted, at the same local level."""
        samples = self.samples - part
        power = _power(samples, len(self.power), tapered=False) / self.level
        for centre, half in self.blocked:
            power[_within(len(power), centre, half)] = 1.0
        return Periodogram(
            samples, power, self.level, self.blocked, self.centres, self.centres_db, self.wavelength_m, self.prf_hz
        )


@lru_cache(maxsize=16)
def _taper(pulses: int) -> NDArray[np.float64]:
    window = np.kaiser(pulses, TAPER_BETA)
    return window / np.sqrt(np.mean(window**2))


def _power(samples: NDArray[np.complex128], size: int, *, tapered: bool) -> NDArray[np.float64]:
    shaped = samples * _taper(len(samples)) if tapered else samples
    lines = fft.fft(shaped.astype(np.complex64), size)
    return (lines.real.astype(np.float64) ** 2 + lines.imag.astype(np.float64) ** 2) / len(samples)


def _within(size: int, centre: float, half: float) -> NDArray[np.bool_]:
    away = np.arange(size) / size - centre
    return np.abs(away - np.rint(away)) <= half


def local_level(power: NDArray[np.float64], keep: NDArray[np.bool_], floor: float, block: int) -> NDArray[np.float64]:
    """Smooth level of a spectrum in FFT order that lines do not lift: lower quartiles of blocks, joined by lines.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power spectrum.
    keep : ndarray of bool, shape (bins,)
        False where it was notched.
    floor : float
        The level is never below a tenth of this; it is this where too little is kept.
    block : int
        Bins of a block.
    """
    size = len(power)
    count = max(4, size // block)
    edges = np.linspace(0, size, count + 1).astype(np.intp)
    levels = np.full(count, np.nan)
    for number, (start, stop) in enumerate(pairwise(edges)):
        part = power[start:stop][keep[start:stop]]
        if len(part) >= (stop - start) / 3:
            levels[number] = np.partition(part, len(part) // 4)[len(part) // 4] / LEVEL_QUANTILE
    known = np.flatnonzero(np.isfinite(levels))
    if not len(known):
        return np.full(size, floor)
    levels = np.maximum(levels, 0.1 * floor)
    middles = (edges[:-1] + edges[1:]) / 2
    return np.exp(np.interp(np.arange(size), middles[known], np.log(levels[known]), period=size))


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
    spectrum = doppler_spectrum(iq, carrier_hz=carrier_hz, prf_hz=prf_hz)
    if not spectrum.floor > 0:
        return None
    return _prepare(iq, spectrum)


def _prepare(iq: NDArray[np.complex64], spectrum: Spectrum) -> Periodogram:
    pulses = spectrum.pulses
    bin_mps = spectrum.prf_hz / pulses * spectrum.wavelength_m / 2
    widest = pulses / 16  # a slow radar must keep something to look at

    def half_bins(half_mps: float) -> float:
        return float(np.ceil(2 * min(max(half_mps / bin_mps, 1.0), widest)) / 2)

    def turns(line: Body) -> float:
        return float(-2 * line.velocity_mps / spectrum.wavelength_m / spectrum.prf_hz)

    bands: list[tuple[float, float]] = []
    centres: list[tuple[float, float]] = []
    body = body_line(spectrum)
    middle = spectrum.bins // 2
    rest_db = float(spectrum.level_db[middle - 1 : middle + 2].max())
    rest_half = half_bins(NOTCH_MPS)
    if rest_db > LINE_DB:
        bands.append((0.0, rest_half))
        # what stands at rest may be the background; the body is then the strongest line that moves
        moving = np.abs(spectrum.frequency_hz) * pulses / spectrum.prf_hz > rest_half + 2 * NOISE_BANDWIDTH_BINS
        line = body_line(replace(spectrum, relative_power=np.where(moving, spectrum.relative_power, np.float32(0))))
        # the strongest line of all, if it is as slow as that, has its own level
        slow = abs(turns(body)) * pulses <= rest_half
        centres.append((turns(body), float(body.level_db)) if slow else (0.0, rest_db))
        if line.level_db > LINE_DB:
            centres.append((turns(line), float(line.level_db)))
    else:
        centres.append((turns(body), float(body.level_db)))
    centres.sort(key=lambda c: -c[1])
    bands += [
        (turn, half_bins(BODY_NOTCH_MPS))
        for turn, level in centres
        if level > LINE_DB and (abs(turn) * pulses > rest_half or not bands)
    ]
    samples = iq.astype(np.complex128) / np.sqrt(spectrum.floor)
    samples = remove_bands(samples, bands)
    blocked = tuple((turn, (half + 2) / pulses) for turn, half in bands)

    size = fft.next_fast_len(PADDING * pulses)
    power = _power(samples, size, tapered=False)
    keep = np.ones(size, bool)
    for middle_turns, half in blocked:
        keep &= ~_within(size, middle_turns, half)
    block = int(BLOCK_BINS * size / pulses)
    level = local_level(power, keep, 1.0, block)
    whitened = power / level
    if whitened[keep].max(initial=0) > 10 ** (TAPER_FROM_DB / 10):
        power = _power(samples, size, tapered=True)
        level = local_level(power, keep, 1.0, block)
        whitened = power / level
    whitened[~keep] = 1.0
    return Periodogram(
        samples,
        whitened,
        level,
        blocked,
        tuple(c for c, _ in centres),
        tuple(level for _, level in centres),
        spectrum.wavelength_m,
        spectrum.prf_hz,
    )
