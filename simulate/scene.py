"""A scene: a radar, what is in its range cell, and its receiver; from Python or from TOML, checked before use."""

import math
import os
import tomllib
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from .motion import TWO_PI
from .parts import BirdPart, BodyPart, ClutterPart, RadarPart, ReceiverPart, RotorPart, TargetPart, UavPart
from .radar import Radar
from .receiver import FAULT_CHANCE

if TYPE_CHECKING:
    from .plan import Plan
    from .render import Rendering

_SOUND_MPS = 340.0
_MOST_BYTES = 16 << 20

#: Names that random streams of the receiver go by.
_RESERVED = ("noise", "jitter", "receiver")


class SceneError(ValueError):
    """A scene that cannot be: one line a problem, each with the field, the value and the rule.

    Parameters
    ----------
    problems : list of str
        The lines.
    """

    def __init__(self, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join(problems))


class Scene(BaseModel):
    """What a radar looks at.

    Parameters
    ----------
    title, source : str
        What it is, and where its numbers come from.
    radar : RadarPart
        Carrier, PRF, pulses.
    uav, bird, clutter : tuple of parts
        What is in the range cell; names are unique.
    receiver : ReceiverPart
        Noise and effects.
    off : tuple of str
        Names of parts and receiver effects that are left out.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str = ""
    source: str = ""
    radar: RadarPart
    uav: tuple[UavPart, ...] = ()
    bird: tuple[BirdPart, ...] = ()
    clutter: tuple[ClutterPart, ...] = ()
    receiver: ReceiverPart = ReceiverPart()
    off: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _names(self) -> "Scene":
        parts: tuple[TargetPart | ClutterPart, ...] = (*self.uav, *self.bird, *self.clutter)
        names = [part.name for part in parts]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two parts are named {name!r}: every name must be its own")
            if name in _RESERVED or name in FAULT_CHANCE:
                raise ValueError(f"a part is named {name!r}: that is the receiver's: give it another name")
        known = [*names, *self.receiver.effects, "noise"]
        for name in self.off:
            if name not in known:
                raise ValueError(f"off holds {name!r}: it may hold {', '.join(known)}")
        return self

    @model_validator(mode="after")
    def _ranges(self) -> "Scene":
        for part in (*self.uav, *self.bird):
            nearest = part.nearest_m(self.radar.pulses / self.radar.prf_hz)
            if not nearest > part.reach_m:
                raise ValueError(
                    f"{part.name}: range_m is {part.range_m}: within the dwell it comes to {nearest:.6g} m, which must "
                    f"exceed its own reach of {part.reach_m:.6g} m"
                )
        return self

    @classmethod
    def build(cls, values: dict[str, Any], where: str = "scene") -> "Scene":
        """Build a scene from plain values.

        Parameters
        ----------
        values : dict
            As a TOML file holds them.
        where : str
            What the values are, for the errors.

        Raises
        ------
        SceneError
            A line for every field that is unknown, missing or out of its range.
        """
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            raise SceneError([f"{where}: {_line(dict(problem), values)}" for problem in error.errors()]) from None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Scene":
        """Read a scene file.

        Parameters
        ----------
        path
            A TOML file, or the name of a shipped scene (see `shipped`).

        Raises
        ------
        SceneError
            It cannot be read, is not TOML, or a field is wrong.
        """
        name = os.fspath(path)
        file: Any = Path(path)
        if not file.exists() and name in shipped():
            file = files("bladewing.simulate") / "scenes" / f"{name}.toml"
        try:
            if isinstance(file, Path) and file.exists() and not (file.is_file() and file.stat().st_size <= _MOST_BYTES):
                raise ValueError(f"it must be a file of at most {_MOST_BYTES} bytes")
            values = tomllib.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise SceneError(
                [
                    f"{name}: cannot be read: {error.strerror}: give a TOML file, or a shipped scene: "
                    + ", ".join(shipped())
                ]
            ) from None
        except (ValueError, RecursionError) as error:  # not UTF-8, not TOML, or nested beyond reason
            raise SceneError([f"{name}: not TOML: {error}"]) from None
        return cls.build(values, name)

    def without(self, *names: str) -> "Scene":
        """Give the same scene with these parts or receiver effects off."""
        return self.build({**dict(self), "off": (*self.off, *names)})

    @property
    def sight(self) -> Radar:
        """The radar."""
        return Radar(self.radar.carrier_hz, self.radar.prf_hz, self.radar.pulses)

    @property
    def uavs(self) -> list[UavPart]:
        """The UAVs that are on."""
        return [part for part in self.uav if part.on and part.name not in self.off]

    @property
    def birds(self) -> list[BirdPart]:
        """The birds that are on."""
        return [part for part in self.bird if part.on and part.name not in self.off]

    @property
    def clutters(self) -> list[ClutterPart]:
        """The clutter that is on."""
        return [part for part in self.clutter if part.on and part.name not in self.off]

    @property
    def noise(self) -> bool:
        """Whether thermal noise is on."""
        return self.receiver.noise and "noise" not in self.off

    def warnings(self) -> list[str]:
        """What is right but may not be meant: one line each."""
        radar, said = self.sight, []
        for part in self.uavs:
            for number, rotor in enumerate(part.rotors):
                where = f"{part.name}: rotors[{number}]"
                beta = math.radians(part.beta_deg if rotor.beta_deg is None else rotor.beta_deg)
                tip = TWO_PI * abs(rotor.rotation_hz) * rotor.blade_length_m
                fastest = tip * math.cos(beta) + abs(part.velocity_mps)
                if tip > _SOUND_MPS:
                    said.append(f"{where}: its tips move at {tip:.1f} m/s, faster than sound")
                if math.cos(beta) < 1e-9:
                    said.append(f"{where}: seen along its axis (90 degrees) it shows no micro-Doppler")
                elif fastest > radar.unambiguous_mps:
                    said.append(
                        f"{where}: its tips show {fastest:.1f} m/s, beyond the unambiguous {radar.unambiguous_mps:.1f} "
                        f"m/s (wavelength x PRF / 4): they alias; a PRF of "
                        f"{4 * fastest / radar.wavelength_m:.0f} Hz would not"
                    )
        for target in (*self.uavs, *self.birds):
            ends = [target.velocity_mps, target.velocity_mps + target.acceleration_mps2 * radar.dwell_s]
            fastest = max(abs(v) for v in ends)
            if fastest > radar.unambiguous_mps:
                said.append(
                    f"{target.name}: it moves at {fastest:.1f} m/s, beyond the unambiguous {radar.unambiguous_mps:.1f} "
                    "m/s: its line aliases"
                )
        return said

    def plan(self, *, tolerance_db: float = -10.0) -> "Plan":
        """Decide what this scene requires (see `plan.make_plan`)."""
        from .plan import make_plan

        return make_plan(self, tolerance_db=tolerance_db)

    def render(self, seed: int = 0, *, tolerance_db: float = -10.0, full: bool = False) -> "Rendering":
        """Render to slow-time IQ (see `render.render`)."""
        from .render import render

        return render(self, seed, plan=None if full else self.plan(tolerance_db=tolerance_db))


def shipped() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = files("bladewing.simulate") / "scenes"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def _line(problem: dict[str, Any], values: Any) -> str:
    """One problem in one line: field, value, rule."""
    field = ""
    model: type[BaseModel] = Scene
    for part in problem["loc"]:
        field += f"[{part}]" if isinstance(part, int) else f".{part}" if field else part
    if problem["type"] == "extra_forbidden":
        for part in problem["loc"][:-1]:
            model = _PARTS.get(part, model) if isinstance(part, str) else model
        return f"unknown field {field}: the fields are {', '.join(model.model_fields)}"
    if problem["type"] == "missing":
        return f"{field} is missing: it is required"
    rule = problem["msg"].removeprefix("Input ").removeprefix("Value error, ")
    if problem["type"] == "value_error":
        return f"{field}: {rule}" if field else rule
    return f"{field} is {problem['input']!r}: it {rule}"


#: The models that the names within a field's path stand for.
_PARTS: dict[str, type[BaseModel]] = {
    "radar": RadarPart,
    "uav": UavPart,
    "bird": BirdPart,
    "clutter": ClutterPart,
    "receiver": ReceiverPart,
    "rotors": RotorPart,
    "body": BodyPart,
}
