"""The radars a model answers for, and what to do where one lies outside."""

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields

from bladewing.features.samples import beyond_radars
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS

from .errors import BadInput
from .samples import positive

_ROUNDING = 1e-9  # relative: 0.005 s x 25 kHz must be 125 pulses, whatever the last bit says
_ADC_HZ = 1e6  # no radar repeats its pulses faster: such a rate is a converter's, which samples within each pulse


def exchanged(carrier_hz: float, prf_hz: float) -> str:
    """Error text for a carrier and a PRF that seem to be exchanged."""
    return f"carrier {carrier_hz:g} Hz and PRF {prf_hz:g} Hz stand in each other's place: exchange them"


def in_kilohertz(prf_hz: float) -> str:
    """The cure for a PRF that seems to be given in kilohertz; empty for any other."""
    low, high = Envelope.prf_min_hz, Envelope.prf_max_hz
    return f"give {prf_hz:g} kHz as {prf_hz:g}e3" if low <= prf_hz * 1e3 <= high and prf_hz < low else ""


def require_hertz(name: str, carrier_hz: float, prf_hz: float) -> None:
    """Refuse a recording whose carrier or PRF is no radar's (`Recording` itself refuses exchanged ones).

    Raises
    ------
    BadInput
        One of them is out of the range of radars.
    """
    if beyond := beyond_radars(carrier_hz, prf_hz):
        raise BadInput(f"{name}: {beyond}: give 9.85 GHz as 9.85e9 and 20 kHz as 20e3")


def refuse_exchanged(name: str, carrier_hz: float, prf_hz: float) -> None:
    """Refuse a recording whose carrier and PRF are a radar's only if exchanged.

    Raises
    ------
    BadInput
        They are exchanged.
    """
    if beyond_radars(carrier_hz, prf_hz) and not beyond_radars(prf_hz, carrier_hz):
        raise BadInput(f"{name}: {exchanged(carrier_hz, prf_hz)}")


@dataclass(frozen=True)
class Envelope:
    """The limits within which a model was trained; each limit itself counts as inside.

    Attributes
    ----------
    carrier_min_hz, carrier_max_hz
        Carrier [Hz].
    prf_min_hz, prf_max_hz
        Pulse repetition frequency [Hz].
    pulses_min, pulses_max
        Number of pulses of a dwell.
    dwell_min_s
        Shortest dwell, pulses / PRF [s].
    dwell_max_s
        Longest dwell [s].
    unambiguous_min_mps
        Smallest unambiguous velocity to one side, wavelength x PRF / 4 [m/s].
    """

    carrier_min_hz: float = 2e9
    carrier_max_hz: float = 100e9
    prf_min_hz: float = 1e3
    prf_max_hz: float = 100e3
    pulses_min: int = 64
    pulses_max: int = 65536
    dwell_min_s: float = 5e-3
    dwell_max_s: float = 5.0
    unambiguous_min_mps: float = 10.0

    def to_json(self) -> str:
        """Give the limits as they stand in a model's metadata (a JSON object of the attributes)."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Envelope":
        """Read the limits from a model's metadata.

        Parameters
        ----------
        text
            JSON object with exactly the attributes of this class.

        Raises
        ------
        ValueError
            A limit is missing, unknown, or not a number above 0.
        """
        limits = json.loads(text)
        names = {field.name for field in fields(cls)}
        if not isinstance(limits, dict) or set(limits) != names:
            raise ValueError(f"the envelope must hold {', '.join(sorted(names))}, it is {text}")
        checked = {name: positive(value, name) for name, value in limits.items()}
        pulses_min, pulses_max = int(checked.pop("pulses_min")), int(checked.pop("pulses_max"))
        return cls(**checked, pulses_min=pulses_min, pulses_max=pulses_max)

    def reason(self, carrier_hz: float, prf_hz: float, pulses: int) -> str | None:
        """Say why a dwell of a radar lies outside, or None where it lies inside.

        Parameters
        ----------
        carrier_hz, prf_hz
            Carrier and pulse repetition frequency [Hz], above 0.
        pulses
            Number of pulses of the dwell.

        Returns
        -------
        str or None
            The first rule that is broken: the value, the rule and the cure.
        """
        return self._radar_reason(carrier_hz, prf_hz) or self._dwell_reason(prf_hz, pulses)

    def _radar_reason(self, carrier_hz: float, prf_hz: float) -> str | None:
        wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
        unambiguous_mps = wavelength_m * prf_hz / 4
        if not self.carrier_min_hz <= carrier_hz <= self.carrier_max_hz:
            if self.carrier_min_hz <= prf_hz <= self.carrier_max_hz and prf_hz > carrier_hz:
                return exchanged(carrier_hz, prf_hz)
            for unit, power in (("GHz", 9), ("MHz", 6)):
                if self.carrier_min_hz <= carrier_hz * 10.0**power <= self.carrier_max_hz:
                    return (
                        f"carrier {carrier_hz:g} Hz is no radar's: give {carrier_hz:g} {unit} as {carrier_hz:g}e{power}"
                    )
            return (
                f"carrier {carrier_hz / 1e9:g} GHz is outside {self.carrier_min_hz / 1e9:g} to "
                f"{self.carrier_max_hz / 1e9:g} GHz, the bands that models are trained for: of others nothing is known"
            )
        if prf_hz < self.prf_min_hz:
            cure = f"{meant}, or " if (meant := in_kilohertz(prf_hz)) else ""
            return f"PRF {prf_hz:g} Hz is below {self.prf_min_hz:g} Hz: {cure}{self._raise_prf(carrier_hz)}"
        if prf_hz > self.prf_max_hz:
            step = math.ceil(prf_hz / self.prf_max_hz)
            cure = f"sum every {step} pulses into one"
            if prf_hz > _ADC_HZ:
                cure = (
                    "of a pulsed or FMCW radar give one range cell, one sample a pulse or chirp, and their rate; "
                    f"of CW alone sum every {step} samples into one"
                )
            return (
                f"PRF {prf_hz:g} Hz is above {self.prf_max_hz:g} Hz: {cure}, "
                f"for a PRF of {prf_hz / step:g} Hz (PRF / {step})"
            )
        if unambiguous_mps < self.unambiguous_min_mps * (1 - _ROUNDING):
            return (
                f"unambiguous velocity {_under(unambiguous_mps, self.unambiguous_min_mps)} m/s is below "
                f"{self.unambiguous_min_mps:g} m/s (wavelength x PRF / 4): {self._raise_prf(carrier_hz)}"
            )
        return None

    def _dwell_reason(self, prf_hz: float, pulses: int) -> str | None:
        dwell_s = pulses / prf_hz
        if pulses < self.pulses_min:
            few = "1 pulse is" if pulses == 1 else f"{pulses} pulses are"
            return f"{few} fewer than {self.pulses_min}: {self._lengthen(prf_hz)}"
        if pulses > self.pulses_max:
            return f"{pulses} pulses are more than {self.pulses_max}: {self._shorten(prf_hz)}"
        if dwell_s > self.dwell_max_s * (1 + _ROUNDING):
            return f"dwell {dwell_s:.7g} s is above {self.dwell_max_s:g} s: {self._shorten(prf_hz)}"
        if dwell_s < self.dwell_min_s * (1 - _ROUNDING):
            shortest_ms = self.dwell_min_s * 1e3
            short_ms = _under(dwell_s * 1e3, shortest_ms)
            return f"dwell {short_ms} ms is below {shortest_ms:g} ms: {self._lengthen(prf_hz)}"
        return None

    def _raise_prf(self, carrier_hz: float) -> str:
        needed_hz = math.ceil(max(self.prf_min_hz, self._prf_for_velocity_hz(carrier_hz)) * (1 - _ROUNDING))
        return f"raise the PRF to {needed_hz} Hz or more"

    def _lengthen(self, prf_hz: float) -> str:
        needed = max(self.pulses_min, math.ceil(self.dwell_min_s * prf_hz * (1 - _ROUNDING)))
        return f"take {needed} pulses, {_up(needed / prf_hz)} s, or more (dwell = pulses / PRF)"

    def _shorten(self, prf_hz: float) -> str:
        # in whole pulses: a dwell in seconds is rounded to them and must not be rounded up past the limit
        longest = min(self.pulses_max, math.floor(self.dwell_max_s * prf_hz * (1 + _ROUNDING)))
        return f"take dwells of {_down(longest / prf_hz)} s or less (dwell = pulses / PRF)"

    def _prf_for_velocity_hz(self, carrier_hz: float) -> float:
        return 4 * self.unambiguous_min_mps * carrier_hz / SPEED_OF_LIGHT_MPS


def _under(value: float, limit: float) -> str:
    """Write a value with one decimal, or with as many as show that it is under the limit."""
    return next((text for d in range(1, 7) if float(text := f"{value:.{d}f}") < limit), f"{value:.9g}")


def _up(value: float) -> str:
    """Round up to 4 digits, so that the value named as the cure is not itself just too small."""
    return _four_digits(value, math.ceil, 1 - _ROUNDING)


def _down(value: float) -> str:
    """Round down to 4 digits, so that the value named as the cure is not itself just too large."""
    return _four_digits(value, math.floor, 1 + _ROUNDING)


def _four_digits(value: float, whole: Callable[[float], int], slack: float) -> str:
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return f"{whole(value / step * slack) * step:.4g}"


def dwell_length(value: object, name: str = "dwell_s") -> float:
    """Check the length of a dwell [s]: above 0 and at most `Envelope.dwell_max_s`.

    A longer one was probably given in milliseconds: models are trained on none, and rotors keep their rates for tenths
    of a second only.

    Parameters
    ----------
    value
        What was given.
    name
        Name of the argument or the option, for the error.

    Raises
    ------
    BadInput
        It is out of range.
    """
    dwell_s = positive(value, name)
    if dwell_s > Envelope.dwell_max_s * (1 + _ROUNDING):
        raise BadInput(f"{name} is {dwell_s:g}: it must be at most {Envelope.dwell_max_s:g} [s]: 80 ms are 0.08")
    return dwell_s
