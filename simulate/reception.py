"""A scene's randomness and its receiver: a random stream for every part, clutter of a given level, effects by name."""

import zlib
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from .clutter import draw_clutter
from .discretes import DISCRETES, draw_discrete
from .generator import generator
from .laws import LAWS, WIDTH, Draws
from .parts import ClutterPart
from .radar import Radar
from .receiver import NormalsOf, Receiver
from .setting import Setting
from .target import mean_power

#: Values that clutter of a kind has in a scene unless its own `values` say otherwise: a person walks, at `person_mps`;
#: ground moves by Billingsley's law.
USUAL = {"person": {"pace": 1.0, "pedalling": 0.0}, "ground": {"ground_law": 1.0}}


def generator_of(seed: int, name: str) -> Generator:
    """Make the generator of one part; it depends on the seed and the part's name alone."""
    return generator(seed, zlib.crc32(name.encode()))


class Chosen(Draws):
    """Draws with some parameters fixed by name; `unused` holds the names of fixed ones that were not asked for yet."""

    def __init__(self, uniforms: NDArray[np.float64], values: dict[str, float]) -> None:
        super().__init__(uniforms)
        self._values = values
        self.unused = set(values)

    def value(
        self, law: str, columns: int | None = None, *, least: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Draw by the law of that name, or give the value that is fixed."""
        return self._fixed(LAWS[law](self.uniform(columns), least), law)

    def change(self, law: str, dwell_s: float) -> NDArray[np.float64]:
        """Draw a rate of change, or give the value that is fixed."""
        return self.value(law) if law in self._values else super().change(law, dwell_s)

    def acceleration_mps2(self, law: str, dwell_s: float = 0.0) -> NDArray[np.float64]:
        """Draw an acceleration, or give the value that is fixed, which is not reduced for a steady body."""
        return self._fixed(super().acceleration_mps2(law, dwell_s), law)

    def either(self, usual: str, other: str, share: float) -> NDArray[np.float64]:
        """Draw by one of two laws, or give the value that either is fixed to."""
        return self._fixed(super().either(usual, other, share), usual, other)

    def _fixed(self, drawn: NDArray[np.float64], *laws: str) -> NDArray[np.float64]:
        """What was drawn, or the value that the first of these laws is fixed to, of the same shape."""
        self.unused.difference_update(laws)
        fixed = next((self._values[law] for law in laws if law in self._values), drawn)
        return np.broadcast_to(fixed, drawn.shape).copy()


def pulse_times_s(scene: Setting, seed: int) -> NDArray[np.float64]:
    """Instants of the pulses, with the PRF's jitter [s], shape (pulses,)."""
    times = scene.sight.times_s
    if scene.receiver.jitter_s:
        times = times + scene.receiver.jitter_s * generator_of(seed, "jitter").standard_normal(len(times))
    return times


def clutter_echo(part: ClutterPart, radar: Radar, seed: int) -> tuple[NDArray[np.complex64], dict[str, Any], list[str]]:
    """Echo of clutter of mean power `level_db`, what was drawn for it, and names of its `values` without effect."""
    rng = generator_of(seed, part.name)
    draws = Chosen(rng.random((1, WIDTH)), USUAL.get(part.kind, {}) | part.values)
    if part.kind in DISCRETES:
        target = draw_discrete(draws, radar, part.kind)
    else:
        target = draw_clutter(draws, radar, part.kind, NormalsOf([rng])(np.array([0])))
    iq = target.micro
    if target.body is not None and target.body_db is not None:
        iq = _unit(iq) + _unit(target.body) * (10 ** (target.body_db / 20)).astype(np.float32)[:, None]
    drawn = {name: float(values[0]) for name, values in target.truth.items() if not np.isnan(values[0])}
    if part.kind == "ground":  # the parameters of both its laws are drawn, but one law alone is used
        other = {"wind_mph"} if "width_mps" in drawn else {"ground_width_mps", "ground_still_db"}
        draws.unused |= other & set(part.values)
    return (_unit(iq) * np.float32(10 ** (part.level_db / 20)))[0], drawn, sorted(draws.unused)


def _unit(iq: NDArray[np.complex64]) -> NDArray[np.complex64]:
    power = mean_power(iq)
    gain = 1 / np.sqrt(np.where(power > 0, power, 1))
    return iq * gain.astype(np.float32)[:, None]


class Reception:
    """The receiver of one rendering of a scene.

    Parameters
    ----------
    scene : Setting
        The scene.
    seed : int
        Root of all randomness, >= 0.
    """

    def __init__(self, scene: Setting, seed: int) -> None:
        part, self.radar, self._seed = scene.receiver, scene.sight, seed
        draws = Chosen(generator_of(seed, "receiver").random((1, WIDTH)), part.values)
        self.drawn = Receiver(draws)
        self.drawn.gain_db = np.zeros(1)  # the levels of a scene are those of its samples
        #: Names of fixed values that have no effect.
        self.unused = sorted(draws.unused | ({"gain_db"} & set(part.values)))
        if part.mains_hz is not None:
            follow = np.where(self.drawn.bursts_of_mains, part.mains_hz / self.drawn.mains_hz, 1.0)
            self.drawn.burst_hz = self.drawn.burst_hz * follow
            self.drawn.mains_hz = np.array([part.mains_hz])
        if "burst_hz" in part.values:  # else most bursts come at the mains' rate, as in training records
            self.drawn.burst_hz = np.array([part.values["burst_hz"]])
        # evenly spaced or at random times, half of each in training records; here the parameter that is fixed decides
        if "impulse_pulses" in part.values or "impulse_count" in part.values:
            self.drawn.impulse_even = np.array(["impulse_pulses" in part.values])
        #: Names of the effects that are on; "dc" is the offset.
        self.effects = {name for name in part.effects if name not in scene.off}
        if part.dc_db is not None:
            self.effects.add("dc")
        self.offset = np.complex64(0 if part.dc_db is None else 10 ** (part.dc_db / 20))
        self.noise = np.zeros((1, self.radar.pulses), np.complex64)
        if scene.noise:
            white = generator_of(seed, "noise").standard_normal((1, self.radar.pulses, 2), dtype=np.float32)
            self.noise = white.view(np.complex64)[..., 0] * np.float32(np.sqrt(0.5))

    def receive(
        self, signal: NDArray[np.complex64], effects: Collection[str], *, quiet: bool = False
    ) -> NDArray[np.complex64]:
        """Pass a signal, shape (pulses,), through these effects.

        Leaving one out changes no random number of the others; `quiet` leaves out the thermal noise.
        """
        self.drawn.on = {name: np.array([name in effects]) for name in self.drawn.on}
        if "dc" in effects:
            signal = signal + self.offset
        iq = self.drawn.receive(
            np.array(signal[None, :], np.complex64),
            np.zeros_like(self.noise) if quiet else self.noise,
            self.radar,
            lambda effect: NormalsOf([generator_of(self._seed, f"receiver {effect}")]),
        )
        return iq[0].astype(np.complex64, copy=False)
