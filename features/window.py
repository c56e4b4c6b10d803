"""The windows of Doppler spectra."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Shape parameter of the Kaiser window.
KAISER_BETA = 12.5

#: Share of both neighbours that is added to each bin of a transform through Hann's window to make it one through
#: `BROAD_HANN`.
NEIGHBOUR_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class Window:
    """A taper over a dwell.

    Parameters
    ----------
    shape : callable
        From a number of pulses to the taper, of any scale, shape (pulses,).
    noise_bandwidth_bins : float
        Equivalent noise bandwidth [bins].
    """

    shape: Callable[[int], NDArray[np.float64]]
    noise_bandwidth_bins: float

    def taper(self, pulses: int) -> NDArray[np.float64]:
        """Values of the taper, of unit noise gain, shape (pulses,)."""
        window = self.shape(pulses)
        return np.asarray(window / np.sqrt(np.sum(window**2)), np.float64)


def _hann(pulses: int) -> NDArray[np.float64]:
    return np.sin(np.pi * (np.arange(pulses) + 0.5) / pulses) ** 2


def _broad_hann(pulses: int) -> NDArray[np.float64]:
    return _hann(pulses) * (1 + 2 * NEIGHBOUR_SHARE * np.cos(2 * np.pi * (np.arange(pulses) + 0.5) / pulses))


def _kaiser(pulses: int) -> NDArray[np.float64]:
    return np.kaiser(pulses, KAISER_BETA)


#: For models. Lines stand 1.4 dB higher over the noise than with `KAISER`, and parts that overlap by half miss nothing.
#: Side lobes fall by 18 dB an octave: -54 dB past five bins, where the notch about a body ends at the earliest, -81
#: past fifteen. Accuracy 0.774 with it, 0.765 with `KAISER` (docs/ablation.md).
HANN = Window(_hann, 1.5)

#: For the comb levels. Lines stand half a decibel higher than with `HANN`, from whose transform this one is made at the
#: cost of a third of an FFT. Side lobes fall as fast, from -47 dB past five bins. In the levels birds are told less
#: well with it, as the lines of wings lie right beside the body's (docs/ablation.md).
BROAD_HANN = Window(_broad_hann, 1.278)

#: For `measure`, which looks for lines right beside strong ones: static returns stand 35 to 54 dB above a drone's
#: blades. Side lobes are under -93 dB, past a main lobe of 4.1 bins.
KAISER = Window(_kaiser, 2.056)
