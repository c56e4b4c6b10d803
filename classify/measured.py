"""What was measured in one recording, and the summary of its dwells."""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from bladewing.features.dropouts import unbroken
from bladewing.features.measurements import BODY, EACH_ROTOR, Measurements
from bladewing.features.reasons import BLIND
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS
from bladewing.features.wingbeat import Wingbeat

from .errors import BadInput
from .measure_body import KNOWN_MPS, over_dwells
from .recording import Recording

#: What a dwell's JSON object holds after its times and the body's velocity, in this order.
VALUES = (
    "body_velocity_mps_std",
    "chopping_hz",
    "chopping_hz_std",
    "chopping_drift_hz_per_s",
    "chopping_drift_hz_per_s_std",
    "comb_order",
    "comb_snr_db",
    "rotor_count",
    "rotor_spread_hz",
    "smearing_index",
    "bandwidth_hz",
    "bandwidth_hz_std",
    "threshold_bandwidth_hz",
    "tip_speed_mps",
    "tip_speed_mps_std",
    "notch_residual_db",
    "rotation_hz",
    "rotation_hz_std",
    "blade_length_m",
    "blade_length_m_std",
    "main_chopping_hz",
    "main_chopping_hz_std",
    "tail_chopping_hz",
    "tail_chopping_hz_std",
    "gear_ratio",
    "gear_ratio_std",
)

#: Those of VALUES, and of the fields of alternatives, that are whole numbers.
WHOLE = ("comb_order", "rotor_count", "blades")

#: What a recording's JSON object holds of combs: medians over the dwells.
OF_COMBS = ("chopping_hz", "bandwidth_hz", "tip_speed_mps", "rotation_hz", "blade_length_m")

#: If the middle half of LEAST_COMBS or more chopping frequencies spans a ratio of UNSTEADY or more, the combs are not
#: the same in all dwells, and no rotor is named: a wind turbine's blades, hundreds of echoes each, show another comb in
#: every second dwell.
LEAST_COMBS, UNSTEADY = 4, 1.25

#: What a recording's JSON object holds of the wingbeat and of the body's motion.
WINGBEAT = ("wingbeat_hz", "wingbeat_hz_std", "acceleration_mps2", "acceleration_mps2_std")

#: The range of a body's velocity leaves out this share, at either end, of the dwells that know it well.
ENDS = 0.05

#: Combs in at most this share of the dwells may be chance: of noise alone one dwell in some 300 shows one.
CHANCE = 0.1


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured in one recording.

    Attributes
    ----------
    recording
        As it was read.
    iq
        Its dwells, shape (dwells, pulses).
    start_s, stop_s
        Shape (dwells,): where each dwell begins and ends [s].
    values
        The measurements, shape (dwells,).
    acceleration_mps2, acceleration_mps2_std
        Shape (dwells,): acceleration of the body over each dwell, NaN where no line stands out [m/s^2]. Where it smears
        the lines it is taken out of `iq`.
    beat
        Wingbeat and body over the whole recording; None where that is too short.
    remarks
        Remarks on the recording, a sentence each.
    direction_known
        False for one channel: whether a body comes or goes is then unknown, and its speed and the rate of change of its
        speed are given in place of its velocity and acceleration; `values` are as measured.
    """

    recording: Recording
    iq: np.ndarray
    start_s: np.ndarray
    stop_s: np.ndarray
    values: Measurements
    acceleration_mps2: np.ndarray
    acceleration_mps2_std: np.ndarray
    beat: Wingbeat | None
    remarks: tuple[str, ...]
    direction_known: bool

    @property
    def combs(self) -> int:
        """How many dwells hold a comb."""
        return int(np.isfinite(self.values.chopping_hz).sum())

    @property
    def body_mps(self) -> np.ndarray:
        """The body's velocity in each dwell, its speed where its direction is not known, shape (dwells,) [m/s]."""
        return self._turn(self.values.body_velocity_mps) * self.values.body_velocity_mps

    def _turn(self, velocity_mps: np.ndarray) -> np.ndarray:
        """Factor from a velocity, and from its rate of change, to a speed's: -1 if negative without a direction.

        NaN without a direction where the velocity is not known: nor is then whether the speed grows or falls.
        """
        return np.where(self.direction_known | (velocity_mps == 0), 1.0, np.sign(velocity_mps))

    @property
    def looked_at(self) -> int:
        """In how many dwells a rotor could have been seen."""
        return sum(not reason.startswith(BLIND) for reason in self.values.reason.tolist())

    @property
    def has_rotor(self) -> bool:
        """Whether more dwells hold a comb than may by chance (`CHANCE`); the combs need not be one rotor's."""
        return self.combs > CHANCE * len(self.iq)

    def json_objects(self) -> Iterator[dict[str, Any]]:
        """One object a dwell and a closing one; what has no value is null."""
        body_mps = self.body_mps
        acceleration_mps2 = self._turn(self.values.body_velocity_mps) * self.acceleration_mps2
        for n in range(len(self.iq)):
            seen = np.isfinite(self.values.rotor_rates_hz[n])
            yield {
                "file": self.recording.name,
                "start_s": round(float(self.start_s[n]), 9),
                "stop_s": round(float(self.stop_s[n]), 9),
                "body_velocity_mps": _number(body_mps[n]),
                **{name: _number(getattr(self.values, name)[n], whole=name in WHOLE) for name in VALUES},
                "acceleration_mps2": _number(acceleration_mps2[n]),
                "acceleration_mps2_std": _number(self.acceleration_mps2_std[n]),
                **{name: [_number(value) for value in getattr(self.values, name)[n][seen]] for name in EACH_ROTOR},
                "rotors_resolved": bool(self.values.rotors_resolved[n]),
                "length_is_lower_bound": self.values.length_is_lower_bound,
                "alternatives": [
                    {name: _number(value, whole=name in WHOLE) for name, value in choice.items()}
                    for choice in self.values.alternatives((n,))
                ],
                "reason": str(self.values.reason[n]) or None,
                "gear_reason": str(self.values.gear_reason[n]) or None,
                "band_reason": str(self.values.band_reason[n]) or None,
            }
        yield {"file": self.recording.name, "recording": self.together()}

    def together(self) -> dict[str, Any]:
        """Medians over the dwells that hold a comb, or both combs of a helicopter, and the number of these dwells.

        Where there is no comb, or the combs are not one rotor's, the medians are None and a reason is given. The body's
        velocity is then that of the dwells without a comb, as it is where combs may be chance; see `body`.
        """
        held = np.isfinite(self.values.chopping_hz)
        reason = disagreement(self.values)
        if not held.any():
            reason = "no comb in any dwell" if self.looked_at else str(self.values.reason[0])
        medians: dict[str, Any] = dict.fromkeys(OF_COMBS)
        if not reason:
            medians = {name: _median(getattr(self.values, name)[held]) for name in OF_COMBS}
        telling = held if (self.has_rotor and not reason) or held.all() else ~held
        medians |= self.body(telling) | {"body_velocity_range_mps": self.body_range(telling)}
        geared = np.isfinite(self.values.gear_ratio)
        pair = ("main_chopping_hz", "tail_chopping_hz", "gear_ratio")
        gear = {name: _median(getattr(self.values, name)[geared]) for name in pair}
        counts = {"dwells": len(self.iq), "with_comb": self.combs, "with_second_comb": int(geared.sum())}
        beside = {
            "left_out_s": self.recording.left_out_s(self.iq),
            "remarks": list(self.remarks),
            "direction_known": self.direction_known,
        }
        return {**counts, "reason": reason or None, **beside, **medians, **gear, **self.over_all()}

    def body(self, dwells: np.ndarray) -> dict[str, float | None]:
        """The body's velocity over some of the dwells and its standard deviation; None where no dwell tells it.

        See `over_dwells`.
        """
        value, std = self._course(dwells)
        known = np.isfinite(value) & np.isfinite(std)
        if not known.any():
            return dict.fromkeys(BODY)
        middle, middle_std = over_dwells(value[known], std[known])
        return dict(zip(BODY, (middle - self._span_mps * round(middle / self._span_mps), middle_std), strict=True))

    def body_range(self, dwells: np.ndarray) -> list[float] | None:
        """Range of nine tenths of the body's velocities in single dwells; None where no dwell knows it well.

        If the velocity passes an end of the unambiguous span, one of the two limits lies beyond that end.
        """
        values, stds = self._course(dwells)
        known = values[np.isfinite(values) & (stds < KNOWN_MPS)]
        return [float(edge) for edge in np.quantile(known, [ENDS, 1 - ENDS])] if len(known) else None

    @property
    def _span_mps(self) -> float:
        """Width of the unambiguous span of velocities [m/s]."""
        return SPEED_OF_LIGHT_MPS / self.recording.carrier_hz * self.recording.prf_hz / 2

    def _course(self, dwells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The body's velocity in some of the dwells, unfolded to the span about the best known, and its deviation."""
        value, std = self.body_mps[dwells], self.values.body_velocity_mps_std[dwells]
        known = np.isfinite(value) & np.isfinite(std)
        if known.any():
            best = value[known][std[known].argmin()]
            value = value - self._span_mps * np.rint((value - best) / self._span_mps)
        return value, std

    def over_all(self) -> dict[str, Any]:
        """Wingbeat and acceleration over the whole recording; empty where the recording is too short.

        Where there is a rotor no wingbeat is given: the strong line that is followed may be a blade's.
        """
        if self.beat is None:
            return {}
        if self.has_rotor:  # a false comb must not hide a bird
            reason = f"no wingbeat: a comb, as of a rotor, in {self.combs} of {len(self.iq)} dwells"
            return dict.fromkeys(WINGBEAT) | {"wingbeat_reason": reason}
        beat = {name: _number(getattr(self.beat, name)) for name in WINGBEAT}
        beat["acceleration_mps2"] = _number(self._turn(self.beat.velocity_mps) * self.beat.acceleration_mps2)
        return beat | {"wingbeat_reason": str(self.beat.reason) or None}

    def clearest(self) -> int:
        """The dwell whose comb stands highest over the noise, among the half whose bands are nearest to the median.

        Where there is no comb, the first dwell. The highest comb of all may be an outlier.
        """
        snr, band = self.values.comb_snr_db, self.values.bandwidth_hz
        known = np.isfinite(band)
        if known.any():
            off = np.abs(band - np.median(band[known]))
            snr = np.where(off <= np.median(off[known]), snr, np.nan)
        return int(np.nanargmax(snr)) if np.isfinite(snr).any() else 0

    def clearer(self, other: "Measured | None") -> "Measured":
        """Of two, the one whose clearest dwell is the clearer; the other where neither holds a comb."""
        if other is None:
            return self
        mine, theirs = (np.nan_to_num(m.values.comb_snr_db[m.clearest()], nan=-np.inf) for m in (self, other))
        return self if mine > theirs else other

    def write_plot(self, path: str | os.PathLike[str]) -> None:
        """Draw the clearest dwell as an SVG file.

        Raises
        ------
        BadInput
            The file cannot be written.
        """
        from .files import write_whole
        from .measure_plot import spectrum_svg

        n = self.clearest()
        measured = self.iq[n][unbroken(self.iq[n])]
        drawing = spectrum_svg(measured, self.recording, self.values, n, float(self.start_s[n]))
        try:
            write_whole(path, drawing)
        except OSError as error:
            raise BadInput(f"--plot {path}: {error.strerror or error}: name a file that can be written") from error


def is_helicopter(values: Measurements) -> bool:
    """Whether most dwells with a comb hold a main and a tail rotor's: a single one of many may be chance."""
    return bool(np.isfinite(values.gear_ratio).sum() > 0.5 * np.isfinite(values.chopping_hz).sum())


def disagreement(values: Measurements) -> str:
    """Why the combs of the dwells are not one rotor's, where their rates differ too much (`UNSTEADY`); else ""."""
    known = np.sort(values.chopping_hz[values.chopping_hz_std < values.chopping_hz])  # lower bounds fit any rate
    if len(known) < LEAST_COMBS or is_helicopter(values):
        return ""
    low, high = known[len(known) // 4], known[-1 - len(known) // 4]
    if high < UNSTEADY * low:
        return ""
    return f"no steady rotor: half of their chopping frequencies lie within {low:.4g} to {high:.4g} Hz"


def _number(value: Any, *, whole: bool = False) -> float | None:
    return (int if whole else float)(value) if math.isfinite(value) else None


def _median(values: np.ndarray) -> float | None:
    """Median of those that have a value."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None
