"""The body line, and what is left outside a notch about it and about velocity zero."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .fast import at_least, sums, to_db
from .spectrum import Spectrum

#: Half width of the notch [m/s]. Set in velocity, not in Hz: a wingbeat of 18 Hz is not a Doppler of 18 Hz, and a
#: bird's body with its heave stays within this of its mean at every carrier.
NOTCH_MPS = 3.0

#: The notch is never narrower than the main lobe of the wider window, this many bins to each side.
LOBE_BINS = 5

#: The first bin of at least this share of the top power is the strongest: in a flat spectrum rounding must not choose.
EQUAL_SHARE = np.float32(1 - 1e-5)

#: Lower bound of the mean power outside the notches, over the noise floor [1].
LEAST_RESIDUAL = 1e-2

#: A top that curves less than this, relative to its height, is flat.
LEAST_CURVE = np.float32(1e-5)

_AROUND = np.array([-1, 0, 1])

#: True, or 1, in the bins of a spectrum that count.
Mask = NDArray[np.bool_] | NDArray[np.float32]


@dataclass(frozen=True)
class Body:
    """The strongest line of each spectrum.

    Parameters
    ----------
    index : ndarray of int, shape (...)
        Bin of the strongest line.
    velocity_mps : ndarray of float32, shape (...)
        Its radial velocity [m/s], refined below the bin.
    level_db : ndarray of float32, shape (...)
        Its level over the noise floor [dB].
    """

    index: NDArray[np.intp]
    velocity_mps: NDArray[np.float32]
    level_db: NDArray[np.float32]

    def rows(self, rows: NDArray[np.intp]) -> "Body":
        """The lines of some of the records."""
        return Body(self.index[rows], self.velocity_mps[rows], self.level_db[rows])


def strongest_bin(spectrum: Spectrum) -> NDArray[np.intp]:
    """The strongest bin of each spectrum, the first of equal ones, shape (...)."""
    power = spectrum.relative_power
    return (power >= np.maximum.reduce(power, axis=-1, keepdims=True) * EQUAL_SHARE).argmax(axis=-1)


def body_line(spectrum: Spectrum, index: NDArray[np.intp] | None = None) -> Body:
    """Find the strongest line of each spectrum, refined by a parabola through three levels in dB.

    The window's main lobe is close to a Gaussian, of which the logarithm is a parabola: the error stays below 2 % of a
    bin through Hann's window and 0.4 % through Kaiser's.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    index : ndarray of int, shape (...), optional
        From `strongest_bin`, where it is known.

    Returns
    -------
    Body
    """
    power, bins = spectrum.relative_power, spectrum.bins
    index = strongest_bin(spectrum) if index is None else index
    around = (index + _AROUND.reshape(-1, *([1] * index.ndim))) % bins
    around += np.arange(0, index.size * bins, bins).reshape(index.shape)  # spectra lie one behind the other
    left, middle, right = to_db(power.reshape(-1)[around])
    step = spectrum.prf_hz / bins * spectrum.wavelength_m / 2
    velocity = spectrum.velocity_mps[index] - parabola_offset(left, middle, right) * step
    return Body(index, velocity.astype(np.float32), middle)


def parabola_offset(
    left: NDArray[np.floating], middle: NDArray[np.floating], right: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Where a parabola through three neighbours has its top, -0.5..0.5 from the middle one; 0 where it has none."""
    curve = 2 * middle - left - right
    # between equal neighbours the curvature is rounding alone
    offset = (right - left) * (curve > LEAST_CURVE * np.abs(middle)) / np.maximum(2 * curve, np.float32(1e-30))
    return np.minimum(np.maximum(offset, np.float32(-0.5)), np.float32(0.5))


def notch_mask(spectrum: Spectrum, index: NDArray[np.intp]) -> NDArray[np.bool_]:
    """True outside the notches about the body line and about velocity zero, shape (..., bins).

    They reach `NOTCH_MPS` to each side, within the limits of `half_width_bins`. Distances are taken around the circle
    of the unambiguous velocities. The bin at half the PRF does not count: it is on neither side, and no measurement
    shall depend on the sign of the velocity.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    index : ndarray of int, shape (...)
        Bin of their strongest lines.

    Returns
    -------
    ndarray of bool, shape (..., bins)
    """
    keep, away = notches(spectrum.bins, half_width_bins(spectrum))
    return away[spectrum.bins - index] & keep


def half_width_bins(spectrum: Spectrum) -> int:
    """Half width of a notch: bins that it takes out to each side of its middle."""
    step = spectrum.prf_hz / spectrum.bins * spectrum.wavelength_m / 2
    # At least the main lobe, at most a third of the span: a slow radar must keep something to look at.
    return min(max(LOBE_BINS, int(np.ceil(NOTCH_MPS / step))), max(1, spectrum.bins // 6))


@lru_cache(maxsize=64)
def notches(bins: int, half: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Mask with a notch about the middle bin, and a table whose row bins - i is the mask with a notch about bin i."""
    position = np.arange(2 * bins)
    distance = position % bins
    far = np.minimum(distance, bins - distance) > half
    keep = np.abs(position[:bins] - bins // 2) > half
    keep[: (bins + 1) % 2] = False
    return keep, np.lib.stride_tricks.sliding_window_view(far, bins)


def weights(mask: Mask) -> NDArray[np.float32]:
    """A mask as numbers to multiply by: cheaper than choosing bin by bin."""
    return mask.astype(np.float32, copy=False)


def residual(spectrum: Spectrum, mask: Mask | None = None) -> NDArray[np.float32]:
    """Power less the floor outside the notches (if any), in units of the floor, shape (..., bins); 0 below it."""
    excess = at_least(spectrum.relative_power, 1)
    excess -= np.float32(1)
    if mask is not None:
        excess *= weights(mask)
    return excess


def notch_residual_db(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Notch-residual energy: mean power outside the notches over the noise floor [dB].

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool or float32, shape (..., bins)
        From `notch_mask`, or its `weights`.

    Returns
    -------
    ndarray of float32, shape (...)
        0 dB for noise alone; micro-Doppler lifts it.
    """
    kept = weights(mask)
    mean = np.vecdot(spectrum.relative_power, kept) / np.maximum(sums(kept), np.float32(1))
    return np.float32(10) * np.log10(np.maximum(mean, np.float32(LEAST_RESIDUAL)))
