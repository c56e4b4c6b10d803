"""From a scene to slow-time IQ, at the fidelity that a plan asks for or at the full one."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .fidelity import WHOLE_BIRD
from .plan import Plan
from .radar import Radar, whole
from .reception import Reception, clutter_echo, pulse_times_s
from .render_bird import bird_echo, bird_truth
from .render_uav import full_fidelity, uav_echo, uav_truth
from .setting import Setting


@dataclass(frozen=True)
class Rendering:
    """A rendered scene.

    Parameters
    ----------
    radar : Radar
        The radar.
    iq : ndarray of complex64, shape (pulses,)
        One range cell, one sample a pulse; thermal noise has unit power.
    truth : list of dict
        What is in it, one a part: "name", "label", "kind" and numbers that carry their units.
    warnings : list of str
        What is valid but may not be meant.
    """

    radar: Radar
    iq: NDArray[np.complex64]
    truth: list[dict[str, Any]]
    warnings: list[str] = field(default_factory=list)


def render(
    scene: Setting, seed: int = 0, *, plan: Plan | None = None, on_part: Callable[[int], None] | None = None
) -> Rendering:
    """Render a scene.

    Parameters
    ----------
    scene : Setting
        What the radar looks at.
    seed : int
        Root of all randomness, >= 0. Every part has a stream of its own, so switching one off changes no other.
    plan : Plan, optional
        What to keep, planned for the same seed; by default everything, at full fidelity.
    on_part : callable, optional
        Called after each UAV, bird and clutter with the number of those rendered.

    Returns
    -------
    Rendering

    Raises
    ------
    ValueError
        If `seed` is no whole number, or negative.
    """
    seed = whole(seed, "seed")
    radar = scene.sight
    jitters = plan is None or "jitter" in plan.receiver
    times = pulse_times_s(scene, seed) if jitters else radar.times_s
    signal = np.zeros(radar.pulses, np.complex128)
    truth: list[dict[str, Any]] = []

    def rendered(part: dict[str, Any]) -> None:
        truth.append(part)
        if on_part:
            on_part(len(truth))

    for uav in scene.uavs:
        how = plan.fidelity[uav.name] if plan else full_fidelity(uav, radar)
        signal += uav_echo(uav, radar, times, how)
        rendered(uav_truth(uav))
    for bird in scene.birds:
        how = plan.fidelity[bird.name] if plan else WHOLE_BIRD
        signal += bird_echo(bird, radar, times, how)
        rendered(bird_truth(bird))
    warnings = scene.warnings()
    for part in scene.clutters:
        iq, drawn, unused = clutter_echo(part, radar, seed)
        signal += iq
        warnings += [f"{part.name}.values: {name} changes nothing of a clutter of kind {part.kind}" for name in unused]
        rendered({"name": part.name, "label": "clutter", "kind": part.kind, "level_db": part.level_db, **drawn})
    reception = Reception(scene, seed)
    warnings += [f"receiver.values: {name} changes nothing of a receiver" for name in reception.unused]
    kept = plan.receiver & reception.effects if plan else reception.effects
    iq = reception.receive(signal.astype(np.complex64), kept)
    return Rendering(radar, iq, truth, warnings)
