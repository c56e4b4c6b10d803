"""A scene: a radar, what is in its range cell, and its receiver; from Python or from TOML, checked before use."""

import os
import tomllib
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from .parts import BirdPart, BodyPart, ClutterPart, RadarPart, ReceiverPart, RotorPart, UavPart
from .plan import Plan, make_plan
from .render import Rendering, render
from .setting import Setting

_MOST_BYTES = 16 << 20


class SceneError(ValueError):
    """Raised for an invalid scene: one line a problem, each with the field, the value and the rule.

    Parameters
    ----------
    problems : list of str
        The lines.
    """

    def __init__(self, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join(problems))


class Scene(Setting):
    """A setting that is read from plain values or from a file, planned and rendered."""

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
            raise SceneError([f"{where}: {_line(dict(problem))}" for problem in error.errors()]) from None

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
        name = os.fspath(path) or repr("")
        file: Any = Path(path)
        try:
            if not file.is_file() and name in shipped():
                file = files("bladewing.simulate") / "scenes" / f"{name}.toml"
            if isinstance(file, Path) and file.exists() and not (file.is_file() and file.stat().st_size <= _MOST_BYTES):
                raise ValueError(f"it must be a file of at most {_MOST_BYTES} bytes")
            values = tomllib.loads(file.read_text(encoding="utf-8-sig"))  # some editors begin with a byte-order mark
        except OSError as error:
            meant = _meant(name) if isinstance(error, FileNotFoundError) else []
            cure = " or ".join(meant) or f"a TOML file, or a shipped scene: {', '.join(shipped())}"
            raise SceneError([f"{name}: cannot be read: {error.strerror}: give {cure}"]) from None
        except (ValueError, RecursionError) as error:  # not UTF-8, not TOML, or nested beyond reason
            what = "is a directory" if isinstance(file, Path) and file.is_dir() else f"not TOML: {error}"
            raise SceneError([f"{name}: {what}: give a TOML file, or a shipped scene"]) from None
        return cls.build(values, name)

    def without(self, *names: str) -> "Scene":
        """Give the same scene with these parts or receiver effects off.

        Raises
        ------
        SceneError
            If a name is none of the scene's parts, nor of its effects, nor "noise".
        """
        return self.build({**dict(self), "off": (*self.off, *names)})

    def plan(self, seed: int = 0, *, tolerance_db: float = -10.0) -> Plan:
        """Decide what this scene requires (see `plan.make_plan`).

        Raises
        ------
        ValueError
            If the tolerance is NaN, or the seed no whole number or negative.
        """
        return make_plan(self, seed, tolerance_db=tolerance_db)

    def render(self, seed: int = 0, *, full: bool = False) -> Rendering:
        """Render to slow-time IQ (see `render.render`), as planned, or leaving nothing out.

        Raises
        ------
        ValueError
            If the seed is no whole number, or negative.
        """
        return render(self, seed, plan=None if full else self.plan(seed))


def shipped() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = files("bladewing.simulate") / "scenes"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def _meant(name: str) -> list[str]:
    """Suggest what a name without a file may stand for: the file with its suffix, a shipped scene of similar name."""
    return [file for file in (f"{name}.toml",) if os.path.isfile(file)] + get_close_matches(name, shipped(), n=1)


def _line(problem: dict[str, Any]) -> str:
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
    table = ".".join(part for part in problem["loc"] if isinstance(part, str))  # the name in the table's header
    rule = _RULES.get(problem["type"], problem["msg"].removeprefix("Input ").removeprefix("Value error, "))
    if problem["type"] == "value_error":
        return f"{field}: {rule}" if field else rule
    if problem["type"] == "tuple_type" and isinstance(problem["input"], dict):
        return f"{field} is one table: there may be several: write [[{table}]] above each"
    if problem["type"] == "model_type":
        return f"{field} is {problem['input']!r}: it must be a table: write [{table}] above its fields"
    return f"{field} is {problem['input']!r}: it {rule}"


#: Rule for each type of error whose message by the library does not say what to do.
_RULES = {
    "string_pattern_mismatch": "must begin with a letter, and hold letters, digits, _ and - alone",
    "tuple_type": "must be a list: write [...] about it",
    "int_type": "must be a whole number, without point or exponent",
    "dict_type": "must be a table: write { name = number }",
}

#: Model that each name within a field's path stands for.
_PARTS: dict[str, type[BaseModel]] = {
    "radar": RadarPart,
    "uav": UavPart,
    "bird": BirdPart,
    "clutter": ClutterPart,
    "receiver": ReceiverPart,
    "rotors": RotorPart,
    "body": BodyPart,
}
