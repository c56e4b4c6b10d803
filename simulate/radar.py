"""The radar as the slow-time sees it: carrier, pulse repetition and number of pulses."""

import math
from dataclasses import dataclass
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

#: Speed of light [m/s], exact. (The paper's tables used 3e8.)
SPEED_OF_LIGHT_MPS = 299_792_458.0

#: Least carrier [Hz]: a smaller number was given in another unit.
LEAST_CARRIER_HZ = 1e6


def no_carrier(carrier_hz: float) -> str:
    """Say why a frequency is no radar's carrier; the text is empty if it may be one's."""
    if carrier_hz >= LEAST_CARRIER_HZ:
        return ""
    return f"{carrier_hz:g} Hz is no radar's: it must be {LEAST_CARRIER_HZ:g} Hz or more: 10 GHz is 10e9"


def whole(value: object, name: str, least: int = 0) -> int:
    """Check a whole number, as a count or a seed is.

    Raises
    ------
    ValueError
        If `value` is no whole number, or below `least`.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ValueError(f"{name} is {value!r}: it must be a whole number of at least {least}")
    return int(value)


@dataclass(frozen=True)
class Radar:
    """A pulsed radar looking at one range cell, one complex sample a pulse.

    Parameters
    ----------
    carrier_hz : float
        Carrier frequency [Hz], 1e6 or more.
    prf_hz : float
        Pulse repetition frequency [Hz], > 0.
    pulses : int
        Pulses in one coherent processing interval, >= 1.

    Raises
    ------
    ValueError
        If a value is not finite or outside its range.

    Notes
    -----
    Numbers of any type are kept as float64 and int: phases need all digits.
    """

    carrier_hz: float
    prf_hz: float
    pulses: int

    def __post_init__(self) -> None:
        for name in ("carrier_hz", "prf_hz"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value!r}: it must be a finite number above 0 [Hz]")
            object.__setattr__(self, name, float(value))
        if why := no_carrier(self.carrier_hz):
            raise ValueError(f"carrier_hz: {why}")
        object.__setattr__(self, "pulses", whole(self.pulses, "pulses", 1))

    @property
    def wavelength_m(self) -> float:
        """Wavelength [m]."""
        return SPEED_OF_LIGHT_MPS / self.carrier_hz

    @property
    def dwell_s(self) -> float:
        """Coherent processing interval [s], pulses / PRF."""
        return self.pulses / self.prf_hz

    @property
    def unambiguous_mps(self) -> float:
        """Largest radial speed without aliasing [m/s], one side: wavelength x PRF / 4."""
        return self.wavelength_m * self.prf_hz / 4

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Slow-time instants [s], shape (pulses,), from 0."""
        return np.arange(self.pulses) / self.prf_hz
