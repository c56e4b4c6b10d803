"""Body velocities from `measure` where the body's own line does not show: python -m tests.benchmarks.bodies_table.

Cases: multirotors that hover before stronger ground, rotors of nearly equal rates, and single rotors without a visible
body. A body velocity counts as wrong where its error exceeds five of its standard deviations and 0.2 m/s. The run takes
a quarter of an hour.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from bladewing.features import measure
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS

from . import records

BLADE_M, ROTOR_DB = 0.1, 10.0


@dataclass(frozen=True)
class Case:
    """A radar, a body, ground, and rotors of two equal blades, their rates within a relative `spread` of a middle."""

    carrier_hz: float = 9.4e9
    prf_hz: float = 10e3
    pulses: int = 800
    ground_db: float = 20.0
    body_db: float = 15.0
    velocity_mps: float = 0.3
    rotors: int = 4
    rate_hz: float = 70.0
    spread: float = 0.02

    def record(self, seed: int) -> np.ndarray:
        """Make the samples; levels are over the noise power of one sample, and all rotors have the same."""
        rng, per_m = np.random.default_rng(seed), 4 * np.pi * self.carrier_hz / SPEED_OF_LIGHT_MPS
        time_s = np.arange(self.pulses) / self.prf_hz
        moved_rad = per_m * self.velocity_mps * time_s
        rates_hz = self.rate_hz * (1 + rng.uniform(-self.spread, self.spread, self.rotors)) * rng.uniform(0.93, 1.07)
        iq = 10 ** (self.body_db / 20) * np.exp(-1j * (moved_rad + rng.uniform(0, 6)))
        iq += 10 ** (self.ground_db / 20) * np.exp(1j * rng.uniform(0, 6))
        for rate_hz in rates_hz:
            turned_rad = 2 * np.pi * (rate_hz * time_s + rng.random())
            reach_rad = [per_m * BLADE_M * np.cos(turned_rad + place) for place in (0, np.pi)]
            blades = sum(np.exp(-0.5j * reach) * np.sinc(reach / 2 / np.pi) for reach in reach_rad)
            blades *= 10 ** (ROTOR_DB / 20) / np.sqrt(np.mean(np.abs(blades) ** 2))
            iq += blades * np.exp(-1j * moved_rad - 1j * rng.uniform(0, 6))
        return (iq + records.white(rng, self.pulses)).astype(np.complex64)


NO_GROUND_DB = -99.0
HOVERING = {
    "four at 9.4 GHz": Case(),
    "the same, all 10 dB more": Case(ground_db=30, body_db=25),
    "the same, 0.6 m/s": Case(velocity_mps=0.6),
    "the same, no ground": Case(ground_db=NO_GROUND_DB),
    "two": Case(rotors=2),
    "six, within 8 %": Case(rotors=6, spread=0.08),
    "four, 160 ms": Case(pulses=1600),
    "four, ground 15 dB over the body": Case(ground_db=35, body_db=20),
    "four at 24 GHz, 40 kHz": Case(24e9, 40e3, 3200, velocity_mps=0.2),
    "four at 24 GHz, 10 kHz: tips alias": Case(24e9, velocity_mps=0.37),
    "four at 3 GHz, within a bin of rest": Case(3e9, velocity_mps=0.6, rate_hz=90),
    "one": Case(rotors=1),
    "four, 1.2 m/s": Case(velocity_mps=1.2),
    "four, 5 m/s": Case(velocity_mps=5.0),
    "four, at rest": Case(velocity_mps=0.0),
    "four, a weak body": Case(body_db=5),
    "four, ground 25 dB over the body, 0.8 m/s": Case(ground_db=40, velocity_mps=0.8),
}
NEARLY_ONE = {
    "two within 1 %, ground": Case(rotors=2, spread=0.01),
    "two within 0.3 %, ground": Case(rotors=2, spread=0.003),
    "two within 1 %, no ground, a body of -5 dB": Case(
        rotors=2, spread=0.01, ground_db=NO_GROUND_DB, body_db=-5, velocity_mps=5.0
    ),
    "four within 0.3 %, ground": Case(spread=0.003),
}


def rows(cases: dict[str, Case], seeds: Iterable[int]) -> int:
    """Print one row per case; return how many bodies are wrong in all."""
    total, seeds = 0, list(seeds)
    for name, case in cases.items():
        wrong, stds = 0, []
        for seed in seeds:
            found = measure(case.record(seed), carrier_hz=case.carrier_hz, prf_hz=case.prf_hz)
            if np.isfinite(found.chopping_hz):
                wrong += is_wrong(found.body_velocity_mps, found.body_velocity_mps_std, case.velocity_mps)
                stds.append(float(found.body_velocity_mps_std))
        total += wrong
        print(f"{name:44s} {len(stds):3d} combs, {wrong:2d} wrong, deviation {np.nanmedian(stds):.4f} m/s", flush=True)
    return total


def is_wrong(found_mps: float, std_mps: float, true_mps: float) -> bool:
    """Whether a body velocity is off by more than 0.2 m/s and five of its standard deviations."""
    return bool(abs(found_mps - true_mps) > max(0.2, 5 * std_mps))


def without_body(seed: int) -> tuple[np.ndarray, float, float]:
    """Make a record of one rotor without a visible body; give it with the body's velocity and the tip speed [m/s]."""
    rng = np.random.default_rng(seed)
    rate_hz = rng.uniform(30, 80)
    tip_mps = rng.uniform(0.3, 0.62) * records.PRF_HZ / 4 * records.WAVELENGTH_M
    velocity_mps = rng.uniform(-25, 25)
    shown = {"snr_db": rng.uniform(5, 25), "body_db": -99, "velocity_mps": velocity_mps}
    iq = records.record(rng, np.array([rate_hz]), length_m=tip_mps / (2 * np.pi * rate_hz), **shown)
    return iq, velocity_mps, tip_mps


if __name__ == "__main__":
    print(f"hovering: {rows(HOVERING, range(24))} wrong of {24 * len(HOVERING)}\n")
    print(f"of nearly one rate: {rows(NEARLY_ONE, range(200, 260))} wrong of {60 * len(NEARLY_ONE)}\n")
    lone = 0
    for drawn in range(300):
        iq, true_mps, _ = without_body(drawn)
        told = measure(iq, **records.RADAR)
        lone += is_wrong(told.body_velocity_mps, told.body_velocity_mps_std, true_mps)
    print(f"lone, no body seen: {lone} wrong of 300")
