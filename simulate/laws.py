"""What the training records are drawn from: one table of laws, and the cursor that draws by it.

Every record owns one row of uniform numbers; each parameter maps one of them through its law. The bounds are physical,
the sources stand beside them ("P": the paper).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Uniform numbers a record owns: one for its kind, then up to 1696 (a vehicle and its receiver need the most).
WIDTH = 1697

#: Factor on the drawn acceleration of a steady body. Half of all bodies are steady, whatever their class: if one class
#: alone accelerated, a model would learn nothing of it but that its line bends.
STEADY = 0.05


@dataclass(frozen=True)
class Law:
    """One parameter's distribution.

    Parameters
    ----------
    kind : {"uniform", "log", "rising"}
        Uniform in the value, uniform in its logarithm, or with a density that rises towards the upper end.
    low, high : float
        Range, in `unit`.
    unit : str
        Unit of the range.
    source : str
        Where the range comes from.
    """

    kind: str
    low: float
    high: float
    unit: str
    source: str

    def __call__(self, u: NDArray[np.float64], least: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Map uniform numbers in [0, 1) to values; where `least` is above `low` the range begins there."""
        low = self.low if least is None else np.maximum(self.low, least)
        if self.kind == "log":
            return low * (self.high / low) ** u
        return low + (self.high - low) * (u**0.7 if self.kind == "rising" else u)


LAWS: dict[str, Law] = {
    # radars
    "carrier_hz": Law("log", 2e9, 100e9, "Hz", "envelope"),
    "dwell_s": Law("log", 5e-3, 1.0, "s", "envelope; dwells of 2.7-89 ms in Gong 2022"),
    "long_dwell_s": Law("log", 1.0, 5.0, "s", "staring radars; the paper's bird: 2.5 s"),
    "unambiguous_mps": Law("log", 10.0, 260.0, "m/s", "from slow-body radars to tips of 200 m/s and a margin"),
    # every scene
    # rising: a model that is shown many UAVs too weak to be seen learns to call an empty cell a UAV
    "snr_db": Law("rising", -20.0, 32.0, "dB", "micro-motion power over noise, a sample"),
    # up to the level of a UAV with its body: a level that one class alone reached would reveal the class
    "clutter_snr_db": Law("uniform", -20.0, 60.0, "dB", "whole clutter return over noise, a sample"),
    "quiet_db": Law("uniform", 0.0, 100.0, "dB", "thermal noise under the usual, to none that float32 holds"),
    "phase_rad": Law("uniform", -np.pi, np.pi, "rad", "no phase is special"),
    "background_db": Law(
        "uniform", -10.0, 65.0, "dB", "static return over noise; measured drone: 35-54 dB over blades"
    ),
    "weather_db": Law("uniform", -10.0, 35.0, "dB", "rain or sea behind a target, over noise"),
    "wind_mph": Law("log", 2.0, 35.0, "mph", "Billingsley"),
    "ground_law": Law("uniform", 0.0, 1.0, "1", "below 0.35 ground moves by a Gaussian law, as many models have it"),
    "ground_width_mps": Law("log", 0.01, 0.5, "m/s", "its rms; 0.01-0.32 m/s from bare hills to woods in a gale"),
    "ground_still_db": Law("uniform", -25.0, 25.0, "dB", "what stands still over what moves by it"),
    # rotors
    "blade_length_m": Law("log", 0.06, 0.7, "m", "0.075-0.41 m (P); 0.7 m on agricultural drones"),
    "tip_mps": Law("log", 28.0, 190.0, "m/s", "idling 33 m/s (measured) to fast racing props, below Mach 0.6"),
    "main_length_m": Law("log", 0.25, 1.0, "m", "RC helicopters, 0.407 m (P)"),
    "gear_ratio": Law("uniform", 3.8, 6.2, "1", "tail over main, 4.73 (P), 4-6 in general"),
    "tail_ratio": Law("uniform", 0.12, 0.25, "1", "tail over main blade length"),
    "hover_spread": Law("log", 5e-4, 0.03, "1", "3395-3500 rpm is 3 % (P)"),
    "manoeuvre_spread": Law("log", 0.03, 0.18, "1", "mixing of thrust in manoeuvres"),
    "drift_per_s": Law("log", 1e-3, 0.3, "1/s", "relative change of a rate"),
    "wander": Law("log", 1e-4, 2e-2, "1", "lines decorrelate in tens to hundreds of ms (IET RSN 2022)"),
    "wander_rate_hz": Law("log", 0.5, 20.0, "Hz", "governor and gusts"),
    "uav_beta_rad": Law("uniform", 0.0, np.deg2rad(80.0), "rad", "0-90 degrees (P), the last 10 show no blade"),
    "root_fraction": Law("uniform", 0.0, 0.6, "1", "hub and cuff reflect little"),
    "edge_asymmetry": Law("uniform", -0.9, 0.9, "1", "advancing and receding edges unlike"),
    "blade_inequality": Law("log", 0.01, 1.0, "1", "spread of blade amplitudes, natural log"),
    "uav_body_db": Law("uniform", -10.0, 35.0, "dB", "body over blade power; blade lines 10-45 dB under body (P)"),
    "uav_mps": Law("uniform", 4.0, 30.0, "m/s", "small UAVs under way"),
    "fast_uav_mps": Law("uniform", 4.0, 65.0, "m/s", "racing drones and fast fixed wings"),
    "tilt_rad": Law("uniform", 0.0, np.deg2rad(30.0), "rad", "discs of multirotors in fast flight"),
    "climb_mps": Law("uniform", -6.0, 6.0, "m/s", "small UAVs; the wind as well for a fixed wing"),
    "uav_acceleration_mps2": Law("uniform", -4.0, 4.0, "m/s^2", "small UAVs"),
    "vibration_m": Law("log", 1e-6, 3e-4, "m", "airframe shaken at the rotor rate, within `uav.SHAKEN_MPS2`"),
    # birds
    "bird_mass_kg": Law("log", 0.008, 10.0, "kg", "goldcrest to swan"),
    "wingbeat_scatter": Law("log", 0.75, 1.33, "1", "about Pennycuick 1996"),
    "bird_speed_mps": Law("uniform", 0.0, 22.0, "m/s", "migrants 8-17 m/s; 0 is hovering or crossing"),
    "bird_acceleration_mps2": Law("uniform", -5.0, 5.0, "m/s^2", "the paper's bird: about 4"),
    "stroke_scale": Law("uniform", 0.6, 1.25, "1", "about the stroke of JEES 2021"),
    "sweep_scale": Law("uniform", -1.0, 1.25, "1", "about the sweep of JEES 2021; models differ in its sign"),
    # with the wings' own SNR added nearly as high as `clutter_snr_db`: else a strong lone line is never a gliding bird
    "bird_body_db": Law("uniform", -12.0, 27.0, "dB", "body over wing power; 17-27 in the catalogue"),
    "down_stroke": Law("uniform", 0.0, 0.7, "1", "down-stroke stronger than up-stroke"),
    "feather_weight": Law("log", 0.05, 2.0, "1", "wrist and tip scatterers against the wing's line"),
    "flock_velocity_mps": Law("uniform", -2.5, 2.5, "m/s", "spread of a loose flock about its mean"),
    "flock_spread": Law("uniform", 0.1, 1.0, "1", "a close flock's spread over a loose one's"),
    "members": Law("log", 2.0, 21.0, "1", "birds that a flock brings into one range cell"),
    # clutter
    "rain_velocity_mps": Law("uniform", -18.0, 18.0, "m/s", "wind up to a storm's, and fall"),
    "rain_width_mps": Law("log", 0.4, 2.5, "m/s", "1-4 m/s wide overall"),
    "sea_velocity_mps": Law("uniform", -4.5, 4.5, "m/s", "Bragg and wind-driven lines"),
    "sea_width_mps": Law("log", 0.15, 1.5, "m/s", "measured sea spectra"),
    "texture_shape": Law("log", 0.1, 10.0, "1", "K distribution, nu 0.1-10"),
    "texture_hz": Law("log", 0.2, 2.5, "Hz", "swells and gusts; decorrelation 0.1-1 s"),
    "person_mps": Law("uniform", -3.5, 3.5, "m/s", "walking to jogging"),
    "pace": Law("log", 1.0, 2.5, "1", "over that: runners and cyclists, to 8.75 m/s"),
    "pedalling": Law("uniform", 0.0, 1.0, "1", "above 0.75 a person rides a bicycle"),
    "gait_hz": Law("uniform", 0.8, 2.2, "Hz", "1-2 Hz"),
    # uniform, not log: if vehicles at 20 to 30 m/s are rarer than UAVs that fast, a model takes their wheels for rotors
    "vehicle_mps": Law("uniform", 1.5, 42.0, "m/s", "along the road, from a crawl over towns to motorways"),
    "engine_hz": Law("log", 10.0, 120.0, "Hz", "four-stroke engines fire at 20-30 Hz idling, to 100 Hz driven"),
    "engine_m": Law("log", 1e-6, 3e-4, "m", "panels shaken by it, micrometres to tenths of a millimetre"),
    "road_acceleration_mps2": Law("uniform", -4.0, 4.0, "m/s^2", "pulling away and braking"),
    "road_m": Law("log", 1.5, 3000.0, "m", "from the verge to far away, where a vehicle is one line"),
    "verge_m": Law("log", 1.5, 12.0, "m", "as a radar on the verge sees every vehicle pass"),
    "sight_rad": Law("uniform", np.deg2rad(-85.0), np.deg2rad(85.0), "rad", "line of sight off the square of the road"),
    "vehicle_length_m": Law("log", 1.5, 13.0, "m", "motorcycle to bus"),
    "body_points": Law("log", 4.0, 49.0, "1", "echoes of a body: few corners, or all of a bus near by"),
    "beam_rad": Law("log", 0.2, 4.0, "rad", "width of the beam that looks along or across a road, to none at all"),
    "company_db": Law("uniform", -25.0, -3.0, "dB", "another vehicle in the beam, under the first"),
    "mover_mps": Law("uniform", -60.0, 60.0, "m/s", "far vehicles, aircraft on a slant path"),
    "drifter_mps": Law(
        "uniform", -15.0, 15.0, "m/s", "boats, balloons: slow ones must not be rarer than birds that glide"
    ),
    "wheel_radius_m": Law("log", 0.2, 0.55, "m", "motorcycle to lorry"),
    "wheel_db": Law("uniform", -35.0, 0.0, "dB", "wheels under the body; measured beside a road: 10 dB"),
    "wheels": Law("uniform", 1.0, 5.0, "1", "wheels that the radar sees"),
    "spokes": Law("uniform", 1.0, 11.0, "1", "even echoes on each: a valve to ten spokes"),
    "tyre_points": Law("log", 1.0, 61.0, "1", "uneven ones: a valve to all blocks of a tyre, made not to sing"),
    "turbine_length_m": Law("log", 15.0, 60.0, "m", "small to large wind turbines"),
    "turbine_tip_mps": Law("uniform", 15.0, 90.0, "m/s", "tips 60-90 m/s at rated wind, less below"),
    "cell_m": Law("log", 3.0, 200.0, "m", "part of a blade inside the range cell, often the whole"),
    "turbine_points": Law("log", 3.0, 101.0, "1", "echoes along a blade; many fill its speeds as noise does"),
    "turbine_row_points": Law("log", 3.0, 3e4, "1", "the same where a model draws them even, up to a smooth line"),
    "chord_m": Law("log", 0.05, 2.0, "m", "half the blade's chord: how far its echoes lie off its axis"),
    "insect_count": Law("uniform", 1.0, 12.0, "1", "in one range cell, from single ones to a swarm's edge"),
    "insect_velocity_mps": Law("uniform", -8.0, 8.0, "m/s", "they drift with the wind"),
    "insect_spread_mps": Law("log", 0.2, 3.0, "m/s", "rms of their own flight; airspeeds of 1-6 m/s"),
    "insect_wingbeat_hz": Law("log", 20.0, 600.0, "Hz", "locusts at 20 Hz, bees at 200 Hz, mosquitoes at 600 Hz"),
    "insect_depth": Law("uniform", 0.05, 0.5, "1", "swing of the amplitude: wings are small beside the body"),
    # receivers
    "gain_db": Law("uniform", -80.0, 80.0, "dB", "no gain is special"),
    "phase_noise_rad": Law(
        "log", 1e-4, 0.1, "rad", "rms over the dwell, from good synthesisers to free-running CW modules"
    ),
    "flicker_db": Law("uniform", -20.0, 30.0, "dB", "1/f noise at 1 % of the PRF over the thermal floor"),
    "fading_db": Law("uniform", 0.0, 12.0, "dB", "swing of glint and multipath"),
    "fading_hz": Law("log", 0.3, 25.0, "Hz", "lines decorrelate in tens to hundreds of ms (IET RSN 2022)"),
    "impulse_db": Law("uniform", 6.0, 50.0, "dB", "a spoilt pulse over noise"),
    "impulse_count": Law("log", 1.0, 100.0, "1", "spoilt stretches at any time; of single pulses a few percent"),
    "impulse_pulses": Law("log", 3.0, 500.0, "1", "between two pulses that another radar spoils; its PRF is alike"),
    "impulse_lasts": Law("log", 0.02, 100.0, "1", "pulses in a row that a packet or a chirp spoils; one, if below 1.5"),
    "impulse_turns": Law("uniform", -0.5, 0.5, "1", "turns a pulse of its phase when it begins"),
    "impulse_sweep": Law("log", 0.01, 1.0, "1", "by how much those rise or fall until it ends"),
    "step_db": Law("log", 0.05, 12.0, "dB", "most by which the gain steps down: attenuators of 1-10 dB"),
    "step_rad": Law("log", 0.02, np.pi, "rad", "most by which the phase steps to either side"),
    "step_count": Law("log", 1.0, 8.0, "1", "such steps of both, at any time"),
    "limit_db": Law("uniform", -10.0, 30.0, "dB", "a limiter's level over noise: under strong echoes phase is left"),
    "spur_db": Law("uniform", -30.0, 25.0, "dB", "a steady line of the receiver's own over noise"),
    "spur_turns": Law("uniform", -0.5, 0.5, "1", "turns a pulse of its phase"),
    "spur_count": Law("uniform", 0.5, 3.5, "1", "such lines"),
    "high_pass_hz": Law("log", 3.0, 150.0, "Hz", "capacitor-coupled audio front ends"),
    "canceller_pulses": Law("uniform", 2.0, 3.0, "1", "moving-target indication by two or three pulses"),
    "mains_db": Law("uniform", -25.0, 15.0, "dB", "mains lines together over noise"),
    "burst_hz": Law("log", 10.0, 1000.0, "Hz", "ignition, switched supplies, other radars; or the mains' rate"),
    "burst_share": Law("log", 0.0003, 0.3, "1", "share of its period that a burst lasts, from a rectifier's tick"),
    "burst_db": Law("uniform", -25.0, 10.0, "dB", "mean power of the bursts over noise; seen in a measured CW module"),
    "tilt_db": Law("uniform", -25.0, 0.0, "dB", "receiver band edges under its middle"),
    "hump_db": Law("uniform", 0.0, 5.0, "dB", "half the swing of a smooth hump in the receiver's band"),
    "hump_turns": Law("log", 0.2, 8.0, "1", "humps across half the band, from one slope to several swells"),
    "full_scale_db": Law("uniform", -3.0, 20.0, "dB", "full scale over the largest sample; below 0 it clips"),
    "adc_bits": Law("uniform", 6.0, 16.0, "bit", "converters"),
    "image_db": Law("uniform", -50.0, -15.0, "dB", "I/Q imbalance image"),
}


class Draws:
    """A cursor over the uniform numbers of a batch of records.

    Parameters
    ----------
    uniforms : ndarray of float64, shape (records, WIDTH)
        Uniform in [0, 1); row i belongs to record i alone.
    """

    def __init__(self, uniforms: NDArray[np.float64]) -> None:
        self._u = uniforms
        self._at = 0

    def __len__(self) -> int:
        return len(self._u)

    @property
    def taken(self) -> int:
        """How many numbers of each record were taken."""
        return self._at

    def uniform(self, columns: int | None = None) -> NDArray[np.float64]:
        """Take the next uniform numbers: shape (records,), or (records, columns)."""
        width = 1 if columns is None else columns
        if self._at + width > self._u.shape[1]:
            raise RuntimeError(f"a target draws more than {self._u.shape[1]} numbers: widen laws.WIDTH")
        taken = self._u[:, self._at : self._at + width]
        self._at += width
        return taken[:, 0] if columns is None else taken

    def value(
        self, law: str, columns: int | None = None, *, least: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Draw by the law of that name, not below `least` if given: shape (records,), or (records, columns)."""
        return LAWS[law](self.uniform(columns), least)

    def either(self, usual: str, other: str, share: float) -> NDArray[np.float64]:
        """Draw by the law `usual`, or with probability `share` by the law `other`: shape (records,)."""
        one, two = self.value(usual), self.value(other)
        return np.where(self.chance(share), two, one)

    def change(self, law: str, dwell_s: float) -> NDArray[np.float64]:
        """Draw a rate of change; in dwells above 1 s it adds up to no more than the law's largest rate does in 1 s."""
        most = max(abs(LAWS[law].low), abs(LAWS[law].high)) / max(1.0, dwell_s)
        return np.clip(self.value(law), -most, most)

    def acceleration_mps2(self, law: str, dwell_s: float = 0.0) -> NDArray[np.float64]:
        """Draw an acceleration as `change` does; in half of the records it is multiplied by `STEADY`."""
        return self.change(law, dwell_s) * np.where(self.chance(0.5), STEADY, 1.0)

    def chance(self, probability: float) -> NDArray[np.bool_]:
        """Draw True with that probability: shape (records,)."""
        return self.uniform() < probability

    def sign(self, columns: int | None = None) -> NDArray[np.float64]:
        """Draw -1 or +1: shape (records,), or (records, columns)."""
        return np.where(self.uniform(columns) < 0.5, -1.0, 1.0)

    def normal(self, columns: int | None = None) -> NDArray[np.float64]:
        """Draw standard normal numbers by Box and Muller: shape (records,), or (records, columns)."""
        radius, turn = self.uniform(columns), self.uniform(columns)
        return np.sqrt(-2 * np.log1p(-radius)) * np.cos(2 * np.pi * turn)
