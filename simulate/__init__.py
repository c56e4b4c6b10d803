"""From a scene to slow-time IQ: radar, rotors, birds, clutter, receiver, and labelled records of them.

`Scene` is imported on first use, because checking a scene needs pydantic and drawing records does not.
"""

from typing import TYPE_CHECKING

from .airframe import Rotor, body_echo, rotors_echo
from .dataset import CLASSES, KIND_CLASS, KINDS, TRUTH_UNITS, Records, draw_radar, draw_records, stream
from .radar import SPEED_OF_LIGHT_MPS, Radar
from .rotor import RotorMotion, rotor_echo

if TYPE_CHECKING:
    from .scene import Scene, SceneError

__all__ = [
    "CLASSES",
    "KINDS",
    "KIND_CLASS",
    "SPEED_OF_LIGHT_MPS",
    "TRUTH_UNITS",
    "Radar",
    "Records",
    "Rotor",
    "RotorMotion",
    "Scene",
    "SceneError",
    "body_echo",
    "draw_radar",
    "draw_records",
    "rotor_echo",
    "rotors_echo",
    "stream",
]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def __getattr__(name: str) -> object:
    if name in ("Scene", "SceneError"):
        from . import scene

        return getattr(scene, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
