"""Upper bounds of a record's error when an effect of the receiver, or the jitter of its PRF, is left out.

Running a receiver is cheap, so the change is measured: the closed-form signal passes through the chain, and each effect
is switched at its own place. What the closed form may miss of the signal is added. The sum is multiplied by the largest
gain of the later effects. All errors are norms: roots of energies over the dwell.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .bounds import Amplitude, UavBounds
from .fidelity import CLOSED_FORM, WHOLE_BIRD
from .reception import Reception, clutter_echo, pulse_times_s
from .render_bird import bird_echo
from .render_uav import uav_echo
from .setting import Setting

#: Effects of a receiver in the order in which a signal meets them.
CHAIN = (
    "dc",
    "fading",
    "phase_noise",
    "impulses",
    "steps",
    "limiter",
    "flicker",
    "spurs",
    "mains",
    "bursts",
    "colour",
    "high_pass",
    "canceller",
    "image",
    "real_only",
    "analytic",
    "converter",
)


class ReceiverBounds:
    """Bounds of one rendering's receiver.

    Parameters
    ----------
    scene : Setting
        The scene.
    seed : int
        Root of its randomness.
    uavs : dict of str to UavBounds
        Bounds of its UAVs by name, at the instants of the pulses.
    """

    def __init__(self, scene: Setting, seed: int, uavs: dict[str, UavBounds]) -> None:
        self._scene, self._seed, self._uavs = scene, seed, uavs
        self.reception = Reception(scene, seed)
        self.effects = tuple(effect for effect in CHAIN if effect in self.reception.effects)

    @cached_property
    def _signal(self) -> NDArray[np.complex64]:
        """What reaches the antenna, without range curvature along the blades."""
        return self._signal_at(pulse_times_s(self._scene, self._seed))

    def _signal_at(self, times: NDArray[np.float64]) -> NDArray[np.complex64]:
        scene, radar = self._scene, self._scene.sight
        signal = np.zeros(radar.pulses, np.complex128)
        for uav in scene.uavs:
            signal += uav_echo(uav, radar, times, CLOSED_FORM)
        for bird in scene.birds:
            signal += bird_echo(bird, radar, times, WHOLE_BIRD)
        for part in scene.clutters:
            signal += clutter_echo(part, radar, self._seed)[0]
        return signal.astype(np.complex64)

    @cached_property
    def _missed(self) -> float:
        """Largest norm of what the closed form misses of the signal: the range curvature along the blades."""
        curved = sum((bounds.blade_curvature() for bounds in self._uavs.values()), np.zeros(len(self._signal)))
        return _norm(curved)

    def _multiplier(self, effect: str) -> float:
        """Largest relative change of any sample by an effect that multiplies the signal."""
        turned = self.reception.receive(np.ones_like(self._signal), {effect}, quiet=True)
        return float(np.max(np.abs(turned - 1), initial=0.0))

    def gain(self, effect: str) -> float:
        """Largest factor by which an effect amplifies a change made before it: a ratio of norms, at least 1."""
        drawn = self.reception.drawn
        return {
            "fading": float(10 ** (abs(drawn.fading_db[0]) / 20)),
            "steps": float(10 ** (max(-drawn.step_db[0], 0) / 20)),
            "colour": float(10 ** ((np.abs(drawn.hump_db[0]).sum() + max(drawn.tilt_db[0], 0)) / 20)),
            "canceller": float(2 ** (drawn.canceller_pulses[0] - 1)),
            "image": float(1 + 10 ** (drawn.image_db[0] / 20)),
            "analytic": float(np.sqrt(2)),
        }.get(effect, 1.0)

    @property
    def total_gain(self) -> float:
        """Largest factor by which the receiver amplifies a change of the signal, its converter's rounding apart."""
        return float(np.prod([self.gain(effect) for effect in self.effects], initial=1.0))

    def own(self, effect: str) -> float:
        """Bound of the change by an effect of `CHAIN`; that the converter then rounds otherwise is not counted."""
        if effect == "converter":
            return self.rounding()
        place = self.effects.index(effect)
        before = self.effects[:place]
        changed, plain = (self.reception.receive(self._signal, some) for some in ((*before, effect), before))
        reaches = self._missed * float(np.prod([self.gain(name) for name in before], initial=1.0))
        if effect in ("fading", "phase_noise", "steps"):
            spread = self._multiplier(effect)
        elif effect in ("dc", "impulses", "flicker", "spurs", "mains", "bursts"):
            spread = 0.0
        else:
            spread = 1 + self.gain(effect)
        after = float(np.prod([self.gain(name) for name in self.effects[place + 1 :]], initial=1.0))
        return after * (_norm(changed - plain) + spread * reaches)

    def rounding(self) -> float:
        """Bound of the change by the converter; 0 if there is none."""
        if "converter" not in self.effects:
            return 0.0
        drawn, before = self.reception.drawn, self.effects[:-1]
        iq = self.reception.receive(self._signal, before)
        missed = self._missed * self.total_gain
        parts = np.abs(np.stack([iq.real, iq.imag]).astype(np.float64))
        full_scale, largest = 10 ** (drawn.full_scale_db[0] / 20), float(parts.max())
        step = full_scale * (largest + missed) / 2 ** (drawn.bits[0] - 1)
        cut = _norm(np.maximum(parts - full_scale * max(largest - missed, 0.0), 0.0))
        clips = full_scale < 1 or missed > 0
        return float(step * np.sqrt(len(iq) / 2) + cut + missed * clips)

    def jitter(self) -> float:
        """Bound of the change by even instants in place of the jittered ones; the converter's rounding is not counted.

        It is the smaller of two bounds. One is from how far blades and paths move between the instants. The other is
        the change measured on the closed form, plus what that may miss of both signals.
        """
        radar = self._scene.sight
        even, true = radar.times_s, pulse_times_s(self._scene, self._seed)
        changed = sum((bounds.jitter(even) for bounds in self._uavs.values()), np.zeros(radar.pulses))
        for bird in self._scene.birds:
            changed += np.abs(bird_echo(bird, radar, true, WHOLE_BIRD) - bird_echo(bird, radar, even, WHOLE_BIRD))
        before = tuple(effect for effect in self.effects if effect != "converter")
        seen = self.reception.receive(self._signal, before) - self.reception.receive(self._signal_at(even), before)
        return min(self.total_gain * _norm(changed), _norm(seen) + 2 * self.total_gain * self._missed)


def _norm(values: Amplitude | NDArray[np.complex64]) -> float:
    return float(np.sqrt(np.sum(np.abs(values).astype(np.float64) ** 2)))
