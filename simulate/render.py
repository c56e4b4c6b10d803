"""From a scene to slow-time IQ, at the fidelity that a plan asks for or at the full one."""

import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator, Philox, SeedSequence
from numpy.typing import NDArray

from .clutter import draw_clutter
from .discretes import DISCRETES, draw_discrete
from .insects import INSECT_LAWS, draw_insects
from .laws import LAWS, WIDTH, Draws
from .parts import ClutterPart
from .radar import Radar
from .receiver import NormalsOf, Receiver
from .render_bird import BIRD_EFFECTS, bird_echo, bird_truth
from .render_uav import Fidelity, full_fidelity, uav_echo, uav_truth
from .target import mean_power

if TYPE_CHECKING:
    from .plan import Plan
    from .scene import Scene


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
        What is right but may not be meant.
    """

    radar: Radar
    iq: NDArray[np.complex64]
    truth: list[dict[str, Any]]
    warnings: list[str] = field(default_factory=list)


def render(scene: "Scene", seed: int = 0, *, plan: "Plan | None" = None) -> Rendering:
    """Render a scene.

    Parameters
    ----------
    scene : Scene
        What the radar looks at.
    seed : int
        Root of all randomness, >= 0. Every part has a stream of its own, so switching one off changes no other.
    plan : Plan, optional
        What to keep; by default everything, at full fidelity.

    Returns
    -------
    Rendering

    Raises
    ------
    ValueError
        If `seed` is negative.
    """
    if seed < 0:
        raise ValueError(f"seed is {seed}: it must not be negative")
    radar = scene.sight
    times = radar.times_s
    if scene.receiver.jitter_s:
        times = times + scene.receiver.jitter_s * _stream(seed, "jitter").standard_normal(radar.pulses)
    signal = np.zeros(radar.pulses, np.complex128)
    truth: list[dict[str, Any]] = []
    for uav in scene.uavs:
        how = plan.fidelity[uav.name] if plan else full_fidelity(uav, radar)
        signal += uav_echo(uav, radar, times, how)
        truth.append(uav_truth(uav))
    for bird in scene.birds:
        how = plan.fidelity[bird.name] if plan else Fidelity(frozenset(BIRD_EFFECTS), None)
        signal += bird_echo(bird, radar, times, how)
        truth.append(bird_truth(bird))
    for part in scene.clutters:
        iq, drawn = _clutter_echo(part, radar, _stream(seed, part.name))
        signal += iq
        truth.append({"name": part.name, "label": "clutter", "kind": part.kind, "level_db": part.level_db, **drawn})
    iq = _receive(scene, radar, signal.astype(np.complex64), seed)
    return Rendering(radar, iq, truth, scene.warnings())


class _Chosen(Draws):
    """Draws of which some parameters are fixed by name."""

    def __init__(self, uniforms: NDArray[np.float64], values: dict[str, float]) -> None:
        super().__init__(uniforms)
        self._values = values

    def value(self, law: str, columns: int | None = None) -> NDArray[np.float64]:
        drawn = (LAWS | INSECT_LAWS)[law](self.uniform(columns))
        return np.full_like(drawn, self._values[law]) if law in self._values else drawn


def _clutter_echo(part: ClutterPart, radar: Radar, rng: Generator) -> tuple[NDArray[np.complex64], dict[str, float]]:
    """Clutter of mean power `level_db`, and what was drawn of it."""
    draws = _Chosen(rng.random((1, WIDTH)), part.values)
    if part.kind == "insects":
        target = draw_insects(draws, radar)
    elif part.kind in DISCRETES:
        target = draw_discrete(draws, radar, part.kind)
    else:
        target = draw_clutter(draws, radar, part.kind, NormalsOf([rng])(np.array([0])))
    iq = target.micro
    if target.body is not None and target.body_db is not None:
        iq = _unit(iq) + _unit(target.body) * (10 ** (target.body_db / 20)).astype(np.float32)[:, None]
    drawn = {name: float(values[0]) for name, values in target.truth.items()}
    return (_unit(iq) * np.float32(10 ** (part.level_db / 20)))[0], drawn


def _unit(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    power = mean_power(iq)
    gain = 1 / np.sqrt(np.where(power > 0, power, 1))
    return iq * gain.astype(np.float32)[:, None]


def _receive(scene: "Scene", radar: Radar, signal: NDArray[np.complex64], seed: int) -> NDArray[np.complex64]:
    """Pass the signal through the receiver's effects that are on."""
    part, rng = scene.receiver, _stream(seed, "receiver")
    receiver = Receiver(_Chosen(rng.random((1, WIDTH)), part.values))
    wanted = {name for name in part.effects if name not in scene.off}
    receiver.on = {name: np.array([name in wanted]) for name in receiver.on}
    receiver.gain_db = np.zeros(1)
    if part.mains_hz is not None:
        receiver.mains_hz = np.array([part.mains_hz])
    noise = np.zeros((1, radar.pulses), np.complex64)
    if scene.noise:
        white = _stream(seed, "noise").standard_normal((1, radar.pulses, 2), dtype=np.float32)
        noise = white.view(np.complex64)[..., 0] * np.float32(np.sqrt(0.5))
    if part.dc_db is not None:
        signal = signal + np.complex64(10 ** (part.dc_db / 20))
    return receiver.receive(signal[None, :], noise, radar, NormalsOf([rng]))[0].astype(np.complex64, copy=False)


def _stream(seed: int, name: str) -> Generator:
    """The generator of one part: it depends on the seed and the part's name alone."""
    return Generator(Philox(SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),))))
