"""From a scene to slow-time IQ: radar, rotors, birds, clutter, receiver, and labelled records of them."""

from .airframe import Rotor, body_echo, rotors_echo
from .dataset import CLASSES, KIND_CLASS, KINDS, TRUTH_UNITS, Records, draw_radar, draw_records, stream
from .radar import SPEED_OF_LIGHT_MPS, Radar
from .rotor import RotorMotion, rotor_echo

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
    "body_echo",
    "draw_radar",
    "draw_records",
    "rotor_echo",
    "rotors_echo",
    "stream",
]
