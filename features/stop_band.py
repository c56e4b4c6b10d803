"""The outer ends of a spectrum that a filter took out, filled with noise.

A record that was sampled faster than its filter passes, or resampled, holds noise up to the filter's edge and next to
nothing beyond, on both sides alike. Models have seen noise end like this with rotors alone, and are sure that such a
record is a UAV (docs/ablation.md).
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .empty_side import noise_transform
from .fast import means, sums
from .lines import squared
from .spectrum import Spectrum

#: Each side is split into LEAST_BLOCKS to MOST_BLOCKS blocks of neighbouring bins. ENOUGH_BINS: bins of a block that
#: suffice to tell noise. LEAST_BINS: with fewer bins a block nothing is filled.
LEAST_BLOCKS, MOST_BLOCKS, ENOUGH_BINS, LEAST_BINS = 24, 32, 16, 8

#: Beyond the band no block has more than 1 / DROP of the power of any of WITHIN blocks further in; the NEXT blocks
#: between them are left out.
DROP, WITHIN, NEXT = 200.0, 3, 5

#: Those WITHIN blocks hold noise: none has FLAT times the power of another, and the median of their bins is over this
#: share (LIKE_NOISE) of that of noise of their mean.
FLAT, LIKE_NOISE = 6.0, 0.7

#: Further in, but for the innermost block, the power must be over this share of that noise.
LEAST_SHARE = 0.25

#: A rotor's band may end so too, but its blades flash. FLASHES: mean fourth power of the amplitude over the square of
#: the mean power, above which they do; noise has 2. OUTER_SHARE: share of the band beyond which its bins count. MIDDLE:
#: share of the dwell, about its middle, that counts.
FLASHES, OUTER_SHARE, MIDDLE = 2.7, 0.5, 0.6

#: Seed of the noise.
_SEED = 21

_NONE = np.empty(0, np.intp)


def filled_ends(iq: NDArray[np.complex64], spectrum: Spectrum) -> tuple[NDArray[np.intp], NDArray[np.complex64]]:
    """Find records whose outer ends a filter took out, and fill these ends with noise as strong as within.

    Parameters
    ----------
    iq : ndarray of complex64, shape (records, pulses)
        Slow-time samples.
    spectrum : Spectrum
        Their spectra.

    Returns
    -------
    rows : ndarray of int, shape (filled,)
        Which of the records.
    samples : ndarray of complex64, shape (filled, pulses)
        These records, filled.
    """
    middle, half = spectrum.bins // 2, (spectrum.bins - 1) // 2
    size = max(half // MOST_BLOCKS, min(ENOUGH_BINS, half // LEAST_BLOCKS))
    if size < LEAST_BINS:
        return _NONE, iq[:0]
    count, power = half // size, spectrum.relative_power

    # most records have as much noise at the ends as further in: they are passed over here
    near, far = half // 8, half * 3 // 16
    within = np.minimum(sums(power[:, middle - far : middle - near]), sums(power[:, middle + near : middle + far]))
    ends = np.maximum(sums(power[:, middle - half : middle - half + size]), sums(power[:, middle + half - size :]))
    low = within > np.float32(DROP * (far - near) / size) * ends
    if not np.count_nonzero(low):
        return _NONE, iq[:0]
    rows, found = [], []
    for row in map(int, np.flatnonzero(low)):
        sides = power[row, middle - count * size : middle][::-1], power[row, middle + 1 : middle + 1 + count * size]
        end, level = _end_of_noise(np.stack(sides).reshape(2, count, size))
        if end and not _flashes(spectrum, row, end * size, real=not iq[row].imag.any()):
            away = np.abs(fft.fftfreq(spectrum.pulses)) * spectrum.bins
            filling = np.where(away > end * size, noise_transform(spectrum.pulses, _SEED), 0)
            rows.append(row)
            found.append(iq[row] + fft.ifft(filling) * np.sqrt(level * spectrum.floor[row]))
    return np.array(rows, np.intp), np.array(found, np.complex64).reshape(len(rows), iq.shape[-1])


def _end_of_noise(blocks: NDArray[np.float32]) -> tuple[int, float]:
    """Blocks a side that a filter passes, of (2, blocks, bins), and the noise power there; 0 if noise has no end."""
    mean = means(blocks)
    most, least = mean.max(axis=0), mean.min(axis=0)
    beyond = np.maximum.accumulate(most[::-1])[::-1]  # largest power from each block outwards
    inner = np.minimum(np.minimum(least[:-2], least[1:-1]), least[2:])
    falls = inner[: len(least) - WITHIN - NEXT] > DROP * beyond[WITHIN + NEXT :]
    for end in np.flatnonzero(falls) + WITHIN:
        level = _noise_level(blocks[:, end - WITHIN : end])
        if level and least[1:end].min() > LEAST_SHARE * level:
            return int(end + (most[end:] < level / 2).argmax()), level
    return 0, 0.0


def _noise_level(power: NDArray[np.float32]) -> float:
    """Mean power of bins, shape (2, blocks, bins), if they hold noise alone, of one level; else 0."""
    blocks, level = power.mean(axis=-1), float(power.mean())
    even = blocks.max() < FLAT * blocks.min() and np.median(power) > LIKE_NOISE * np.log(2) * level
    return level if even else 0.0


def _flashes(spectrum: Spectrum, row: int, end: int, *, real: bool) -> bool:
    """Whether the outer part of a band of `end` bins to each side comes and goes as blades do.

    For one channel (`real`) one side is used: both together are a real signal, whose noise has 3 in place of 2.
    """
    away = np.arange(spectrum.bins) - spectrum.bins // 2
    away = away if real else np.abs(away)
    outer = np.where((away <= end) & (away > OUTER_SHARE * end), spectrum.transform[row], 0)
    some = slice(round((1 - MIDDLE) / 2 * spectrum.pulses), round((1 + MIDDLE) / 2 * spectrum.pulses))
    power = squared(fft.ifft(outer)[some] / spectrum.window.taper(spectrum.pulses)[some])
    return bool(np.mean(power**2) > FLASHES * np.mean(power) ** 2)
