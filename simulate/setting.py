"""What a radar looks at, checked as a whole: the parts together, and what is valid but may not be meant."""

import math

from pydantic import BaseModel, ConfigDict, model_validator

from .parts import BirdPart, ClutterPart, RadarPart, ReceiverPart, TargetPart, UavPart
from .radar import Radar
from .receiver import EFFECT_OF, FAULT_CHANCE
from .render_bird import members

_SOUND_MPS = 340.0

#: A PRF below this may have been given in kHz [Hz].
_LEAST_PRF_HZ = 100.0

#: A bird heavier than this, which no wings carry, may have been given in grams [kg].
_HEAVIEST_KG = 25.0

#: Rms jitter over the time between pulses above which a warning is given: one pulse in 400 then comes after the next.
_MOST_JITTER = 0.25

#: Names of the receiver's random streams, which no part may have.
_RESERVED = ("noise", "jitter", "receiver")


class Setting(BaseModel):
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
    def _names(self) -> "Setting":
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
    def _ranges(self) -> "Setting":
        for part in (*self.uav, *self.bird):
            dwell_s = self.radar.pulses / self.radar.prf_hz
            nearest = _nearest_m(part, dwell_s)
            if not nearest > part.reach_m:
                raise ValueError(
                    f"{part.name}: range_m is {part.range_m}: within the dwell of {dwell_s:.6g} s (pulses / PRF) it "
                    f"comes to {nearest:.6g} m, which must exceed its own reach of {part.reach_m:.6g} m"
                )
        return self

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
        """Tell what is valid but may not be meant, one line each."""
        radar, said = self.sight, []
        if radar.prf_hz < _LEAST_PRF_HZ:
            said.append(f"radar.prf_hz is {radar.prf_hz:g}: in Hz, so that {radar.prf_hz:g} kHz is {radar.prf_hz:g}e3")
        if self.receiver.jitter_s * radar.prf_hz > _MOST_JITTER:
            said.append(
                f"receiver.jitter_s is {self.receiver.jitter_s:g} s: pulses come {1 / radar.prf_hz:g} s apart, and "
                "change places"
            )
        for part in self.uavs:
            beyond: dict[str, float] = {}
            along: list[str] = []
            for number, rotor in enumerate(part.rotors):
                where = f"{part.name}: rotors[{number}]"
                tip = rotor.tip_mps(radar.dwell_s)
                fastest = part.fastest_tip_mps(rotor, radar.dwell_s)
                if tip > _SOUND_MPS:
                    units = "blade_length_m is in metres, rotation_hz in turns a second, so that 3500 rpm are 58.3"
                    said.append(f"{where}: its tips move at {tip:.1f} m/s, faster than sound: {units}")
                if math.cos(part.beta_rad(rotor)) < 1e-9:
                    along.append(f"rotors[{number}]")
                elif fastest > radar.unambiguous_mps:
                    beyond[f"rotors[{number}]"] = fastest
            if along:
                seen = "seen along its axis (90 degrees) each shows no micro-Doppler"
                said.append(f"{part.name}: {', '.join(along)}: {seen}")
            if beyond:
                fastest = max(beyond.values())
                enough_hz = math.ceil(4 * fastest / radar.wavelength_m)
                tips = "its tips show" if len(beyond) == 1 else "their tips show up to"
                said.append(
                    f"{part.name}: {', '.join(beyond)}: {tips} {fastest:.1f} m/s, beyond the unambiguous "
                    f"{radar.unambiguous_mps:.1f} m/s (wavelength x PRF / 4): they alias; a PRF of {enough_hz} Hz "
                    "would not"
                )
        for bird in self.birds:
            if bird.mass_kg > _HEAVIEST_KG:
                said.append(
                    f"{bird.name}: mass_kg is {bird.mass_kg:g}, heavier than any bird that flies: 350 g are 0.35"
                )
        for target in (*self.uavs, *self.birds):
            fastest = target.fastest_mps(radar.dwell_s)
            if fastest > _SOUND_MPS:
                said.append(f"{target.name}: it moves at {fastest:.4g} m/s, faster than sound")
            if fastest > radar.unambiguous_mps:
                said.append(
                    f"{target.name}: it moves at {fastest:.1f} m/s, beyond the unambiguous {radar.unambiguous_mps:.1f} "
                    "m/s: its line aliases"
                )
        if self.receiver.jitter_s and self.clutters:
            said.append("receiver.jitter_s moves UAVs and birds alone: clutter is rendered at even instants")
        if self.receiver.mains_hz and not {"mains", "bursts"} & set(self.receiver.effects):
            said.append('receiver.mains_hz changes nothing without "mains" or "bursts" among the effects')
        for name in self.receiver.values:
            effect = EFFECT_OF.get(name)
            if effect is not None and effect not in self.receiver.effects:
                said.append(f'receiver.values: {name} changes nothing without "{effect}" among the effects')
        return said


def _nearest_m(part: TargetPart, dwell_s: float) -> float:
    """Smallest range of a target's centre within the dwell [m]; for a flock, that of its nearest member."""
    if isinstance(part, BirdPart):
        return min(part.nearest_m(dwell_s, bird.velocity_mps) + bird.place_m for bird in members(part))
    return part.nearest_m(dwell_s)
