"""Rotors of changing rate: how far ahead of a constant-rate rotor they are, and records read at other times."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import LinesSeen, middle_times

#: The time by which a rotor is ahead of one of constant rate is a sum of Legendre polynomials in time, of these
#: DEGREES. The first is an offset of the rate, the second a linear change. A change is first sought as linear, by
#: FIRST_DEGREES of them.
DEGREES, FIRST_DEGREES = (1, 2, 3, 4, 5), 2

#: Largest departure of a rate from its mean, relative.
MOST_CHANGE = 0.06

#: Fixed-point steps to the time at which a rotor has turned as far as one of constant rate: each multiplies the error
#: by the relative change of the rate.
FIXED_STEPS = 4

#: Samples at each end, beyond those that may be read, in which a continued comb fades out: the repeated record then has
#: no step.
FADING = 64

#: A change is sure above this many standard deviations.
SURE_DEVIATIONS = 5.0

#: Least eigenvalue of a Fisher matrix scaled to a unit diagonal.
LEAST_INFORMATION = 1e-9


def polynomials(time: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """The polynomials of `DEGREES` at times from the middle of the dwell [samples], shape (degrees, times)."""
    values = np.polynomial.legendre.legvander(2 * time / pulses, max(DEGREES)).T[list(DEGREES)]
    return np.asarray(values, np.float64)


@lru_cache(maxsize=4)
def own_polynomials(pulses: int) -> NDArray[np.float64]:
    """The same at the times of the pulses themselves, shape (degrees, pulses), read-only."""
    values = polynomials(middle_times(pulses), pulses)
    values.setflags(write=False)
    return values


def bend(ahead: NDArray[np.float64], pulses: int) -> float:
    """Linear relative change of the rate in the coefficients `ahead` [1 / sample]."""
    return 12 * float(ahead[1]) / pulses**2


def even_change(change: float, pulses: int) -> NDArray[np.float64]:
    """Coefficients `ahead`, by `DEGREES`, of a linear relative change over the dwell [samples]."""
    return np.where(np.array(DEGREES) == 2, change * pulses / 12, 0.0)


def other_rate(ahead: float, pulses: int) -> float:
    """Relative offset of the mean rate for a coefficient `ahead` of the first of `DEGREES`."""
    return 2 * float(ahead) / pulses


def change_of(ahead: NDArray[np.float64], pulses: int) -> float:
    """Largest relative departure of the rate from the one assumed."""
    return float(np.abs(np.diff(ahead @ own_polynomials(pulses))).max())


def changed(ahead: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients `ahead` of the change of the rate alone, without an offset of its mean [samples]."""
    return np.asarray(ahead * (np.array(DEGREES) > 1), np.float64)


def late_by(ahead: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """By how much later a rotor has turned as far as one of its constant mean rate, at each pulse [samples]."""
    time, departs = middle_times(pulses), -changed(ahead)
    late = departs @ own_polynomials(pulses)
    for _ in range(FIXED_STEPS - 1):
        late = departs @ polynomials(time + late, pulses)
    return np.asarray(late, np.float64)


def margin_of(pulses: int) -> int:
    """How far past each end of a record `Resampling` may read [samples]."""
    return FADING + int(MOST_CHANGE * pulses / 6)


class Resampling:
    """A record read at other times, about a line that stays as it is.

    Parameters
    ----------
    samples : ndarray of complex128, shape (margin + pulses + margin,)
        A record with a margin before and after it; taken to repeat.
    centre : float
        Frequency of the line [cycles a sample].
    """

    def __init__(self, samples: NDArray[np.complex128], centre: float) -> None:
        self._size, self._centre = len(samples), centre
        spectrum = fft.fftshift(fft.fft(samples * np.exp(-2j * np.pi * centre * middle_times(self._size))))
        self._spectrum = LinesSeen(spectrum[None])

    def read(self, late: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The record's samples, each read `late` later [samples], both of shape (pulses,)."""
        size, pulses = self._size, len(late)
        # a unit line applied to the spectrum gives the record at one time
        place = (np.arange(pulses) + (size - pulses) / 2 + late) / size
        off = size // 2 - (size - 1) / 2  # of frequency 0 from the spectrum's middle
        turns = self._centre * middle_times(pulses) - off * place
        return np.asarray(self._spectrum.means(-place)[0] * np.exp(2j * np.pi * turns), np.complex128)


def is_sure(ahead: NDArray[np.float64], std: NDArray[np.float64], deviations: float = SURE_DEVIATIONS) -> bool:
    """True where the linear change of any rotor's rate exceeds `deviations` of its standard deviations."""
    return bool(np.any(np.abs(ahead[..., 1]) > deviations * std[..., 1]))


def inverse_of(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a Fisher matrix of mixed units; what it says nothing of gets a large variance."""
    scale = np.sqrt(np.maximum(information.diagonal(), 1e-30))
    value, vector = np.linalg.eigh(information / np.outer(scale, scale))
    return np.asarray((vector / np.maximum(value, LEAST_INFORMATION)) @ vector.T / np.outer(scale, scale), np.float64)
