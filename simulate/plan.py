"""The plan of a rendering: each effect's error bound against the noise, and the cheapest renderer that is sufficient.

The error of leaving an effect out is its energy over the dwell, relative to the noise power of a sample. No line of the
error's spectrum can then stand further over the noise floor than that, whatever the window. No test, even one that
knows both signals, can tell them apart once the energy is well below one (its deflection is twice the energy): hence
the tolerance of -10 dB. Errors of several effects are added as amplitudes.

Two things are not counted. First, a converter that is kept rounds a changed record otherwise: but rounding is done to
the record, and nothing that is done to a record makes two signals easier to tell apart. Second, the rounding error of
the closed form (float32 phases, 1e-7 of a blade's amplitude a radian) shows only at tolerances far below that.
"""

from dataclasses import dataclass

import numpy as np

from .bounds import UavBounds, bird_bound
from .bounds_receiver import ReceiverBounds
from .fidelity import BIRD_EFFECTS, UAV_EFFECTS, Fidelity
from .parts import UavPart
from .radar import Radar, whole
from .reception import pulse_times_s
from .render_uav import full_fidelity
from .setting import Setting

#: Level that errors are compared with where there is no receiver noise: the resolution of complex64, relative to the
#: strongest target [dB].
DIGITS_DB = -140.0

#: Cap of the tolerance [dB]: anything may be left out at this level, and as a power ratio it is still finite.
_ANY_DB = 2000.0

#: What each effect is, and what stands in its place.
WORDS = {
    "blade_curvature": ("range curvature along the blades", "far field, eq. 4: blades in closed form"),
    "hub_curvature": ("range curvature over the airframe", "far field, eq. 2: every part's path is the centre's"),
    "acceleration": ("acceleration over the dwell", "constant radial velocity"),
    "vibration": ("vibration of the airframe, body and hubs", "an airframe at rest on its path"),
    "wander": ("drift and wander of the rotor rates", "constant rates"),
    "heave": ("heave of the body against the wings", "a steady body"),
    "jitter": ("jitter of the pulses' instants", "an even PRF"),
    "dc": ("offset at velocity zero", "none"),
    "fading": ("slow rise and fall of all echoes", "constant levels"),
    "phase_noise": ("phase noise", "a clean oscillator"),
    "impulses": ("spoilt pulses", "none"),
    "steps": ("steps of gain and phase", "one gain and phase"),
    "limiter": ("a limiter", "none"),
    "flicker": ("1/f noise", "white noise alone"),
    "spurs": ("steady lines of the receiver's own", "none"),
    "mains": ("mains lines", "none"),
    "bursts": ("bursts of noise", "none"),
    "colour": ("a band that is not flat", "a flat band"),
    "high_pass": ("a stop band about velocity zero", "none"),
    "canceller": ("clutter cancelled from pulse to pulse", "none"),
    "image": ("I/Q imbalance", "balanced channels"),
    "real_only": ("a real receiver", "both channels"),
    "analytic": ("a one-sided record made of a real one", "both sides"),
    "converter": ("quantisation and clipping", "numbers as they are"),
}


@dataclass(frozen=True)
class Decision:
    """One effect of one part.

    Parameters
    ----------
    part, effect : str
        Names.
    bound_db : float
        Upper bound of the error energy of leaving the effect out, over the noise power of a sample [dB]; -inf if the
        scene does not have the effect.
    kept : bool
        Whether the renderer keeps it.
    """

    part: str
    effect: str
    bound_db: float
    kept: bool

    def line(self) -> str:
        """The decision in words and numbers."""
        what, instead = WORDS[self.effect]
        if self.bound_db == -np.inf:
            return f"{self.part}: {what}: not in this scene"
        verdict = "kept" if self.kept else f"left out ({instead})"
        line = f"{self.part}: {what}: {verdict}; leaving it out changes at most {self.bound_db:+.1f} dB re noise"
        anew = self.effect == "converter" and self.kept
        return f"{line}; what it rounds anew of a changed record is counted nowhere" if anew else line


@dataclass(frozen=True)
class Plan:
    """How a scene is rendered.

    Parameters
    ----------
    tolerance_db : float
        Most error energy over the noise power of a sample [dB].
    error_db : float
        Upper bound of the error energy of all that is left out together, and of blades as points, over the noise power
        of a sample [dB]; -inf if it is zero.
    decisions : tuple of Decision
        One an effect and part.
    fidelity : dict of str to Fidelity
        The renderer of each UAV and bird.
    receiver : frozenset of str
        Effects of the receiver that are kept.
    notes : tuple of str
        Renderers and their costs in words.
    """

    tolerance_db: float
    error_db: float
    decisions: tuple[Decision, ...]
    fidelity: dict[str, Fidelity]
    receiver: frozenset[str]
    notes: tuple[str, ...]

    def explain(self) -> str:
        """The plan in words and numbers, one line a decision."""
        together = "nothing is left out" if self.error_db == -np.inf else f"at most {self.error_db:+.1f} dB re noise"
        points = any(one.points for one in self.fidelity.values())
        what = f"error of all that is left out{' and of blades as so few points' if points else ''}, over the dwell"
        head = f"{what}: {together} (tolerance {self.tolerance_db:+.1f} dB)"
        return "\n".join([head, *(decision.line() for decision in self.decisions), *self.notes])


def make_plan(scene: Setting, seed: int = 0, *, tolerance_db: float = -10.0) -> Plan:
    """Decide for each effect whether the scene needs it.

    Parameters
    ----------
    scene : Setting
        The scene.
    seed : int
        Root of the rendering's randomness: the receiver is judged with the parameters that this seed draws for it.
    tolerance_db : float
        Most error energy over the dwell, over the noise power of a sample [dB]. At -10 dB no receiver can tell the
        difference.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        If the tolerance is NaN, or the seed no whole number or negative.
    """
    seed = whole(seed, "seed")
    if np.isnan(tolerance_db):
        raise ValueError(f"tolerance_db is {tolerance_db}: it must be a number [dB]")
    radar = scene.sight
    noise = 1.0 if scene.noise else 10 ** (DIGITS_DB / 10) * _strongest(scene)
    times = pulse_times_s(scene, seed)
    bounds = {uav.name: UavBounds(uav, radar, times) for uav in scene.uavs}
    receiver = ReceiverBounds(scene, seed, bounds)
    # norms of the errors, divided below by the rms noise of a sample; the receiver may amplify a target's error
    errors: dict[tuple[str, str], float] = {}
    for uav in scene.uavs:
        for effect in UAV_EFFECTS:
            errors[uav.name, effect] = receiver.total_gain * float(np.linalg.norm(bounds[uav.name].of(effect)))
    for bird in scene.birds:
        for effect in BIRD_EFFECTS:
            bound = bird_bound(bird, radar, effect, times)
            errors[bird.name, effect] = receiver.total_gain * float(np.linalg.norm(bound))
    if scene.receiver.jitter_s:
        errors["receiver", "jitter"] = receiver.jitter()
    for effect in receiver.effects:
        errors["receiver", effect] = receiver.own(effect)
    scale = 1 / np.sqrt(noise)
    errors = {key: scale * error for key, error in errors.items()}
    # half of the tolerated amplitude is for effects left out, the rest for the spacing of scatterers where needed
    allowed, used, dropped = 10 ** (min(tolerance_db, _ANY_DB) / 20), 0.0, set()
    for key, error in sorted(errors.items(), key=lambda item: item[1]):
        if error == 0 or used + error <= allowed / 2:
            used += error
            dropped.add(key)
    fidelity: dict[str, Fidelity] = {}
    notes: list[str] = []
    rest = (allowed - used) / max(1, len(scene.uavs))
    for uav in scene.uavs:
        kept = frozenset(effect for effect in UAV_EFFECTS if (uav.name, effect) not in dropped)
        points = None
        if "blade_curvature" in kept:
            points, missed = _points(bounds[uav.name], uav, radar, (rest / (scale * receiver.total_gain)) ** 2)
            used += scale * receiver.total_gain * np.sqrt(missed)
        fidelity[uav.name] = Fidelity(kept, points)
        notes += [_renderer(uav, radar, points), _aliasing(uav, radar)]
    for bird in scene.birds:
        kept = frozenset(effect for effect in BIRD_EFFECTS if (bird.name, effect) not in dropped)
        fidelity[bird.name] = Fidelity(kept)
    decisions = tuple(Decision(*key, _db(error**2), key not in dropped) for key, error in errors.items())
    kept_by_receiver = frozenset(effect for part, effect in errors.keys() - dropped if part == "receiver")
    return Plan(tolerance_db, _db(used**2), decisions, fidelity, kept_by_receiver, tuple(notes))


def _strongest(scene: Setting) -> float:
    """Power of the strongest body, rotor or bird of the scene; 1 if it has none."""
    levels = [point.level_db + uav.gain_db for uav in scene.uavs for point in uav.body]
    levels += [rotor.flash_db + uav.gain_db for uav in scene.uavs for rotor in uav.rotors]
    levels += [max(bird.wing_db, bird.body_db) for bird in scene.birds]
    return float(10 ** (max(levels, default=0.0) / 10))


def _db(energy: float) -> float:
    return float(10 * np.log10(energy)) if energy > 0 else -np.inf


def _points(bounds: UavBounds, uav: UavPart, radar: Radar, allowed: float) -> tuple[int, float]:
    """Fewest Gauss points a blade whose error energy stays below what is allowed, and that energy."""
    low, high = 1, full_fidelity(uav, radar).points or 1
    if bounds.spacing(high) > allowed:
        return high, bounds.spacing(high)
    while low < high:
        middle = (low + high) // 2
        if bounds.spacing(middle) <= allowed:
            high = middle
        else:
            low = middle + 1
    return high, bounds.spacing(high)


def _renderer(uav: UavPart, radar: Radar, points: int | None) -> str:
    """The renderer chosen and its cost against full fidelity."""

    def scatterers(stand_for_a_line: int) -> int:
        return sum(rotor.blades * (rotor.points or stand_for_a_line) for rotor in uav.rotors)

    full = f"(full fidelity: {2 * scatterers(full_fidelity(uav, radar).points or 1)})"
    if points is None:
        blades = sum(rotor.blades for rotor in uav.rotors)
        return f"{uav.name}: closed form, 2 sines a blade and pulse, {2 * blades} in all {full}"
    each = f", {points} a blade" if any(rotor.points is None for rotor in uav.rotors) else ""
    return f"{uav.name}: point scatterers at exact ranges{each}, {2 * scatterers(points)} sines a pulse {full}"


def _aliasing(uav: UavPart, radar: Radar) -> str:
    """Tell whether the UAV's Doppler is aliased. Sampling does that by itself, at no cost: nothing is decided here."""
    tips = [uav.fastest_tip_mps(rotor, radar.dwell_s) for rotor in uav.rotors]
    fastest = max([uav.fastest_mps(radar.dwell_s), *tips])
    verdict = "none" if fastest <= radar.unambiguous_mps else "the samples fold it, as a radar's do"
    return f"{uav.name}: aliasing: {verdict}; it shows {fastest:.1f} m/s of {radar.unambiguous_mps:.1f} m/s unambiguous"
