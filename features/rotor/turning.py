"""Rotors that do not turn evenly: how far ahead of an even one they are, and records read at other times."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import LinesSeen, middle_times

#: How far a rotor is ahead of an even one is a sum of Legendre polynomials in time, of these degrees. The first is
#: another rate, the second one that changes evenly. Where a change is first sought it is taken to be even: the first so
#: many degrees.
DEGREES, FIRST_DEGREES = (1, 2, 3, 4, 5), 2

#: A rate departs from its mean by no more than this share of it.
MOST_CHANGE = 0.06

#: Steps to the time at which an even rotor has turned as far: each leaves of what the one before did the share by which
#: the rate changes.
FIXED_STEPS = 4

#: At each end so many samples, in which a comb that goes on fades out, beside those that may be read keep a record
#: from a step where it repeats.
FADING = 64

#: A change is one where it is sure by so many standard deviations.
SURE_DEVIATIONS = 5.0

#: Of a Fisher matrix whose diagonal is one, no eigenvalue is below this.
LEAST_INFORMATION = 1e-9


def polynomials(time: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """The polynomials of `DEGREES` at times from the middle of the dwell [samples], shape (degrees, times)."""
    values = np.polynomial.legendre.legvander(2 * time / pulses, max(DEGREES)).T[list(DEGREES)]
    return np.asarray(values, np.float64)


@lru_cache(maxsize=4)
def own_polynomials(pulses: int) -> NDArray[np.float64]:
    """The same at the times of the pulses themselves, shape (degrees, pulses), not to be written to."""
    values = polynomials(middle_times(pulses), pulses)
    values.setflags(write=False)
    return values


def bend(ahead: NDArray[np.float64], pulses: int) -> float:
    """Even relative change of the rate a sample that puts a rotor so far ahead."""
    return 12 * float(ahead[1]) / pulses**2


def even_change(change: float, pulses: int) -> NDArray[np.float64]:
    """How far ahead an even relative change over the dwell puts a rotor, by polynomials of `DEGREES` [samples]."""
    return np.where(np.array(DEGREES) == 2, change * pulses / 12, 0.0)


def other_rate(ahead: float, pulses: int) -> float:
    """Relative difference of the mean rate that puts a rotor so far ahead, by the first of `DEGREES`."""
    return 2 * float(ahead) / pulses


def change_of(ahead: NDArray[np.float64], pulses: int) -> float:
    """How far the rate departs from the one that was known, relative."""
    return float(np.abs(np.diff(ahead @ own_polynomials(pulses))).max())


def changed(ahead: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far ahead a rotor is by the change of its rate, without what another mean rate makes of it [samples]."""
    return np.asarray(ahead * (np.array(DEGREES) > 1), np.float64)


def late_by(ahead: NDArray[np.float64], pulses: int) -> NDArray[np.float64]:
    """By how much later than an even rotor one that is ahead has turned as far, but for another rate [samples]."""
    time, departs = middle_times(pulses), -changed(ahead)
    late = departs @ own_polynomials(pulses)
    for _ in range(FIXED_STEPS - 1):
        late = departs @ polynomials(time + late, pulses)
    return np.asarray(late, np.float64)


def margin_of(pulses: int) -> int:
    """How far past each end of a record `Resampling` may read [samples]."""
    return FADING + int(MOST_CHANGE * pulses / 6)


class Resampling:
    """Samples that are read at other times, about a line that stays.

    Parameters
    ----------
    samples : ndarray of complex128, shape (margin + pulses + margin,)
        A record and what comes before and after it; the whole is taken to repeat.
    centre : float
        Frequency of the line [cycles a sample].
    """

    def __init__(self, samples: NDArray[np.complex128], centre: float) -> None:
        self._size, self._centre = len(samples), centre
        spectrum = fft.fftshift(fft.fft(samples * np.exp(-2j * np.pi * centre * middle_times(self._size))))
        self._spectrum = LinesSeen(spectrum[None])

    def read(self, late: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The record's samples by so much later each, shape (pulses,) both [samples]."""
        size, pulses = self._size, len(late)
        # a spectrum's samples seen by a unit line are the record's at a time
        place = (np.arange(pulses) + (size - pulses) / 2 + late) / size
        off = size // 2 - (size - 1) / 2  # of the spectrum's zero from its middle
        turns = self._centre * middle_times(pulses) - off * place
        return np.asarray(self._spectrum.means(-place)[0] * np.exp(2j * np.pi * turns), np.complex128)


def is_sure(ahead: NDArray[np.float64], std: NDArray[np.float64], deviations: float = SURE_DEVIATIONS) -> bool:
    """True where the rate of any rotor changes evenly for sure, by polynomials of `DEGREES` and their deviations."""
    return bool(np.any(np.abs(ahead[..., 1]) > deviations * std[..., 1]))


def inverse_of(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a Fisher matrix of unlike units; what it says nothing of is unknown."""
    scale = np.sqrt(np.maximum(information.diagonal(), 1e-30))
    value, vector = np.linalg.eigh(information / np.outer(scale, scale))
    return np.asarray((vector / np.maximum(value, LEAST_INFORMATION)) @ vector.T / np.outer(scale, scale), np.float64)
