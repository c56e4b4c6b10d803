"""What is kept of a target when it is rendered, and where its centre then is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .parts import TargetPart

#: Effects that a plan may leave out of a UAV, and out of a bird.
UAV_EFFECTS = ("blade_curvature", "hub_curvature", "acceleration", "vibration", "wander")
BIRD_EFFECTS = ("acceleration", "heave")


@dataclass(frozen=True)
class Fidelity:
    """How one target is rendered.

    Parameters
    ----------
    effects : frozenset of str
        Which of its effects are kept.
    points : int or None
        Point scatterers in place of each blade that is a line, in float64 (a row keeps its own points); None for the
        closed form of a blade, which has no range curvature along it.
    """

    effects: frozenset[str]
    points: int | None = None


#: CLOSED_FORM: a UAV whose blades are in closed form, with every other effect; WHOLE_BIRD: a bird with every effect.
CLOSED_FORM, WHOLE_BIRD = Fidelity(frozenset(UAV_EFFECTS) - {"blade_curvature"}), Fidelity(frozenset(BIRD_EFFECTS))


def centre_range_m(part: TargetPart, times_s: NDArray[np.float64], accelerates: bool) -> NDArray[np.float64]:
    """Range of a target's centre [m], shape (pulses,)."""
    acceleration = part.acceleration_mps2 if accelerates else 0.0
    return part.range_m + times_s * (part.velocity_mps + 0.5 * acceleration * times_s)
