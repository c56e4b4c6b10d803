"""The parts a scene is built from, each validated by itself: what it holds, its units, its ranges and its defaults.

Levels are powers over the receiver's noise power, in one sample [dB]. Angles are in degrees here, because people write
them.
"""

import math
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator, model_validator

from .bird import wing_size
from .catalogue import AIRFRAMES, BIRDS, Entry
from .discretes import MAX_BLADE_POINTS, MAX_BODY_POINTS, MAX_TYRE_POINTS, MAX_WHEELS
from .insects import MAX_INSECTS
from .laws import LAWS
from .radar import no_carrier
from .receiver import FAULT_CHANCE, MAX_STEPS, SPURS

#: Largest size of any number: beyond every real scene, and small enough that all samples are finite.
MOST = 1e12

#: Most scatterers of a blade that is a row of them.
MOST_POINTS = 1000

#: Least and largest value that a scene may fix a parameter to, where its law does not say. The limits are how many of a
#: thing can be rendered, where a gait, a texture or a spectrum still exists (Billingsley's has none in still air), and
#: what float32 holds.
BOUNDS = {
    "wheels": (1, MAX_WHEELS),
    "body_points": (1, MAX_BODY_POINTS),
    "sight_rad": (-1.56, 1.56),
    "spokes": (1, 10),
    "tyre_points": (1, MAX_TYRE_POINTS),
    "turbine_points": (3, MAX_BLADE_POINTS),
    "turbine_row_points": (2, 1e6),
    "insect_count": (1, MAX_INSECTS),
    "wind_mph": (0.5, 200),
    "ground_law": (0, 1),
    "ground_width_mps": (1e-6, 0.6),
    "gait_hz": (0.05, 20),
    "texture_hz": (1e-6, 1000),
    "texture_shape": (0.05, 1e12),  # below, the power of most samples is too small for float32
    "high_pass_hz": (1e-6, 1e9),
    "canceller_pulses": (2, 3),
    "adc_bits": (1, 24),
    "spur_count": (0.5, SPURS + 0.5),  # as the law draws it: it is rounded
    "step_count": (1, MAX_STEPS),
}

#: The same for every level [dB].
LEVEL_BOUNDS_DB = (-200, 200)

Real = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Number = Annotated[Real, Field(ge=-MOST, le=MOST)]
Positive = Annotated[Real, Field(gt=0, le=MOST)]
NotNegative = Annotated[Real, Field(ge=0, le=MOST)]
Level = Annotated[Real, Field(ge=LEVEL_BOUNDS_DB[0], le=LEVEL_BOUNDS_DB[1])]
Aspect = Annotated[Real, Field(ge=0, le=90)]
Share = Annotated[Real, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=60)]


def bounds_of(name: str) -> tuple[float, float]:
    """Least and largest value that a scene may fix a parameter to, in its law's unit."""
    law = LAWS[name]
    return BOUNDS.get(name, LEVEL_BOUNDS_DB if law.unit == "dB" else (-math.inf, math.inf))


def _known_laws(values: dict[str, float]) -> dict[str, float]:
    """Refuse a parameter that no law knows, or a value that its law's meaning forbids."""
    for name, value in values.items():
        if name not in LAWS:
            near = ", ".join(get_close_matches(name, LAWS, n=5, cutoff=0.3)) or "none"
            raise ValueError(
                f"{name!r} is unknown: of the {len(LAWS)} parameters (simulate/laws.py) near it are {near}"
            )
        law = LAWS[name]
        if law.kind == "log" and value <= 0:
            raise ValueError(f"{name} is {value}: it must be above 0 [{law.unit}]")
        low, high = bounds_of(name)
        if not low <= value <= high:
            raise ValueError(f"{name} is {value}: it must be {low:g} to {high:g} [{law.unit}]")
    return values


LawValues = Annotated[dict[str, Number], AfterValidator(_known_laws)]


def _of_catalogue(values: Any, field: str, entries: dict[str, Entry]) -> Any:
    """Fields of a part; those not given come from the catalogue's entry that it names, if it names one."""
    name = values.get(field) if isinstance(values, dict) else None
    if not isinstance(name, str):  # a value that is no name is refused later, by the field's own type
        return values
    if name not in entries:
        raise ValueError(f"{field} is {name!r}: it must be one of {', '.join(entries)}")
    return {**entries[name].fields, **values}


class Part(BaseModel):
    """What all parts share: unknown fields are refused, and a part cannot be changed once made."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class RadarPart(Part):
    """The radar: carrier [Hz], PRF [Hz], pulses."""

    carrier_hz: Positive
    prf_hz: Annotated[Real, Field(gt=0, le=1e9)]
    pulses: Annotated[int, Field(strict=True, ge=1, le=10_000_000)]

    @field_validator("carrier_hz")
    @classmethod
    def _of_a_radar(cls, value: float) -> float:
        if why := no_carrier(value):
            raise ValueError(why)
        return value


class BodyPart(Part):
    """One scatterer of a body, `offset_m` from its centre at `bearing_deg` from the line of sight (0: to the radar)."""

    level_db: Level
    offset_m: NotNegative = 0.0
    bearing_deg: Number = 0.0
    phase_deg: Number = 0.0


class RotorPart(Part):
    """One rotor; the sign of `rotation_hz` is its sense.

    `flash_db` is one blade's level at its flash, seen at a right angle, where all of it echoes in phase. A blade is a
    line that reflects evenly from `root_m` to its tip, or a row of `points` equal scatterers. A row of one point, and a
    line whose `root_m` equals `blade_length_m`, is a scatterer at the tip: the paper's model. `beta_deg` is the UAV's
    unless given here.
    """

    blade_length_m: Positive
    rotation_hz: Number
    flash_db: Level
    blades: Annotated[int, Field(strict=True, ge=1, le=12)] = 2
    root_m: NotNegative = 0.0
    points: Annotated[int, Field(strict=True, ge=1, le=MOST_POINTS)] | None = None
    beta_deg: Aspect | None = None
    phase_deg: Number = 0.0
    offset_m: NotNegative = 0.0
    bearing_deg: Number = 0.0
    hub_phase_deg: Number = 0.0
    blade_amplitudes: tuple[NotNegative, ...] | None = None
    edge_asymmetry: Annotated[Real, Field(ge=-1, le=1)] = 0.0
    drift_hz_per_s: Number = 0.0
    wander_hz: NotNegative = 0.0
    wander_rate_hz: Annotated[Real, Field(ge=1e-6, le=MOST)] = 1.0
    wander_phase_deg: Number = 0.0

    @model_validator(mode="after")
    def _consistent(self) -> "RotorPart":
        if self.root_m > self.blade_length_m:
            raise ValueError(f"root_m is {self.root_m}: it must not exceed blade_length_m = {self.blade_length_m}")
        if self.blade_amplitudes is not None and len(self.blade_amplitudes) != self.blades:
            raise ValueError(
                f"blade_amplitudes holds {len(self.blade_amplitudes)}: one a blade, blades = {self.blades}"
            )
        return self

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """Amplitude of each blade relative to that of `flash_db`."""
        return self.blade_amplitudes or (1.0,) * self.blades

    def tip_mps(self, dwell_s: float) -> float:
        """Upper bound of its tips' speed within the dwell, drift and wander of the rate included [m/s]."""
        drifted_hz = self.rotation_hz + self.drift_hz_per_s * dwell_s
        return 2 * math.pi * (max(abs(self.rotation_hz), abs(drifted_hz)) + self.wander_hz) * self.blade_length_m


class TargetPart(Part):
    """What every target has: a name, a switch, a range [m] and a radial motion (positive when the range grows)."""

    name: Name
    on: bool = True
    range_m: Positive = 1000.0
    velocity_mps: Number = 0.0
    acceleration_mps2: Number = 0.0

    @property
    def reach_m(self) -> float:
        """Distance of the farthest scatterer from the centre [m]."""
        return 0.0

    def nearest_m(self, dwell_s: float, drift_mps: float = 0.0) -> float:
        """Smallest range of the centre within the dwell [m], if `drift_mps` is added to the part's velocity [m/s]."""
        velocity, times = self.velocity_mps + drift_mps, [0.0, dwell_s]
        if self.acceleration_mps2 > 0:
            times.append(min(max(-velocity / self.acceleration_mps2, 0.0), dwell_s))
        return min(self.range_m + t * (velocity + 0.5 * self.acceleration_mps2 * t) for t in times)

    def fastest_mps(self, dwell_s: float) -> float:
        """Largest radial speed of the centre within the dwell [m/s]."""
        return max(abs(self.velocity_mps), abs(self.velocity_mps + self.acceleration_mps2 * dwell_s))


class UavPart(TargetPart):
    """A UAV: body scatterers and rotors, or the name of an `airframe` of the catalogue that brings both.

    `gain_db` is added to the levels of all of them: it sets the strength of a catalogue airframe in a scene.
    """

    airframe: str | None = None
    gain_db: Level = 0.0
    beta_deg: Aspect = 0.0
    vibration_rad: NotNegative = 0.0
    vibration_hz: Positive = 50.0
    body: tuple[BodyPart, ...] = ()
    rotors: tuple[RotorPart, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _from_catalogue(cls, values: Any) -> Any:
        return _of_catalogue(values, "airframe", AIRFRAMES)

    @model_validator(mode="after")
    def _consistent(self) -> "UavPart":
        if not self.body and not self.rotors:
            raise ValueError("it has neither body nor rotors: give one of them, or an airframe of the catalogue")
        return self

    @property
    def reach_m(self) -> float:
        """Distance of the farthest scatterer from the centre [m]."""
        return max([r.offset_m + r.blade_length_m for r in self.rotors] + [b.offset_m for b in self.body])

    def amplitude(self, level_db: float) -> float:
        """Amplitude of a scatterer of that level over the rms noise, `gain_db` included."""
        return float(10 ** ((level_db + self.gain_db) / 20))

    def rotor_beta_deg(self, rotor: RotorPart) -> float:
        """Angle between the line of sight and a rotor's plane [deg]: its own, or the UAV's."""
        return self.beta_deg if rotor.beta_deg is None else rotor.beta_deg

    def beta_rad(self, rotor: RotorPart) -> float:
        """Angle between the line of sight and a rotor's plane [rad]."""
        return math.radians(self.rotor_beta_deg(rotor))

    def fastest_tip_mps(self, rotor: RotorPart, dwell_s: float) -> float:
        """Upper bound of the radial speed of a rotor's tips within the dwell [m/s]."""
        return rotor.tip_mps(dwell_s) * math.cos(self.beta_rad(rotor)) + self.fastest_mps(dwell_s)


class BirdPart(TargetPart):
    """A bird, or a small flock of `members`: a `species` of the catalogue, or mass (and span, area).

    `wing_db` is the level of both wings with all their parts in phase, `body_db` that of the body. `heading_deg` is the
    direction of the radar in the bird's own plane (0: ahead), `elevation_deg` how far the radar looks up at it. The
    members of a flock differ in phase, wingbeat, place and speed (by `flock_velocity_mps` rms), drawn by `flock_seed`.
    """

    species: str | None = None
    mass_kg: Positive
    span_m: Positive | None = None
    area_m2: Positive | None = None
    wingbeat_hz: Annotated[Real, Field(gt=0, le=100)] | None = None
    wing_db: Level
    body_db: Level
    phase_deg: Number = 0.0
    heading_deg: Number = 0.0
    elevation_deg: Annotated[Real, Field(ge=-90, le=90)] = 20.0
    stroke_scale: Annotated[Real, Field(ge=0, le=2)] = 1.0
    down_stroke: Share = 0.3
    feather_weight: NotNegative = 0.3
    heave_m: NotNegative = 0.0
    flight: Literal["flap", "flap_glide", "bound"] = "flap"
    flap_s: Positive = 1.0
    rest_s: Positive = 1.0
    members: Annotated[int, Field(strict=True, ge=1, le=50)] = 1
    flock_velocity_mps: NotNegative = 1.0
    flock_seed: Annotated[int, Field(strict=True, ge=0)] = 0

    @property
    def reach_m(self) -> float:
        """Half the span, and how far the body heaves [m]."""
        return float((self.span_m or wing_size(self.mass_kg)[0]) / 2) + self.heave_m

    @model_validator(mode="before")
    @classmethod
    def _from_catalogue(cls, values: Any) -> Any:
        return _of_catalogue(values, "species", BIRDS)


class ClutterPart(Part):
    """Clutter or a confuser of one kind, of mean power `level_db`.

    Its parameters are drawn from the laws of the training records (`laws.LAWS`); `values` fixes any of them by name.
    """

    name: Name
    on: bool = True
    kind: Literal["ground", "rain", "sea", "person", "vehicle", "wind_turbine", "insects"]
    level_db: Level
    values: LawValues = {}


class ReceiverPart(Part):
    """The receiver: thermal noise of unit power, and effects by name; `values` fixes their parameters.

    `jitter_s` is the rms error of a pulse's instant; it affects UAVs and birds alone. `dc_db` is the level of an offset
    at velocity zero.
    """

    noise: bool = True
    effects: tuple[str, ...] = ()
    values: LawValues = {}
    mains_hz: Positive | None = None
    jitter_s: NotNegative = 0.0
    dc_db: Level | None = None

    @field_validator("effects")
    @classmethod
    def _effects(cls, effects: tuple[str, ...]) -> tuple[str, ...]:
        for effect in effects:
            if effect not in FAULT_CHANCE:
                raise ValueError(f"{effect!r} is unknown: the effects are {', '.join(FAULT_CHANCE)}")
        return effects
