"""`measure` on every airframe of the catalogue at radars of chance: python -m tests.benchmarks.catalogue_table.

The accuracy tables of `measurement_tables` are of one radar at 9.85 GHz. Here carrier, PRF, velocity, aspect and level
are drawn, and ground lies in two of five scenes.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from bladewing.features import measure
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS
from bladewing.simulate import Scene
from bladewing.simulate.catalogue import AIRFRAMES

CARRIERS_HZ = (3.3e9, 9.85e9, 24.1e9, 77e9)

#: FOLDS: range of the tip speed over the unambiguous velocity. LOWERED_DB: the UAV, body and blades, is below its level
#: in the catalogue by one of these [dB].
FOLDS, LOWERED_DB = (0.3, 0.8), (0.0, 0.0, 10.0, 20.0)

#: The unambiguous velocity is at least this [m/s], so that the body's velocity is not folded.
LEAST_SPAN_MPS = 22.0
FASTEST_MPS, DWELL_S, MOST_PULSES = 20.0, 0.08, 6000


@dataclass(frozen=True)
class Found:
    """Errors in one scene: body velocity [m/s] and tip speed [relative], with deviations; NaN where none is given."""

    airframe: str
    body_mps: float
    body_std_mps: float
    tip: float
    tip_std: float


def drawn(rng: np.random.Generator, airframe: str, fastest_mps: float = FASTEST_MPS) -> tuple[Scene, float, float]:
    """Draw a scene with one UAV, its velocity [m/s] and its fastest tip's speed along the line of sight [m/s]."""
    fields = AIRFRAMES[airframe].fields
    lowered_db, beta_deg, velocity_mps = rng.choice(LOWERED_DB), rng.uniform(0, 60), rng.uniform(-1, 1) * fastest_mps
    rotors = [
        rotor | {"beta_deg": beta_deg, "phase_deg": rng.uniform(0, 360), "hub_phase_deg": rng.uniform(0, 360)}
        for rotor in fields["rotors"]
    ]
    tip_mps = max(2 * np.pi * abs(rotor["rotation_hz"]) * rotor["blade_length_m"] for rotor in rotors)
    tip_mps *= np.cos(np.radians(beta_deg))
    carrier_hz = rng.choice(CARRIERS_HZ)
    prf_hz = 4 * max(tip_mps / rng.uniform(*FOLDS), LEAST_SPAN_MPS) * carrier_hz / SPEED_OF_LIGHT_MPS
    scene = {
        "radar": {"carrier_hz": carrier_hz, "prf_hz": prf_hz, "pulses": int(min(DWELL_S * prf_hz, MOST_PULSES))},
        "uav": [
            fields | {"name": "uav", "velocity_mps": velocity_mps, "rotors": rotors, "gain_db": -float(lowered_db)}
        ],
    }
    if rng.random() < 0.4:
        scene["clutter"] = [{"name": "ground", "kind": "ground", "level_db": rng.uniform(10, 40)}]
    return Scene.build(scene), velocity_mps, tip_mps


def table(scenes: int, seed: int, fastest_mps: float) -> list[Found]:
    """Measure a number of scenes, taking the airframes in turn."""
    out = []
    for number in range(scenes):
        rng = np.random.default_rng((seed, number))
        airframe = sorted(AIRFRAMES)[number % len(AIRFRAMES)]
        scene, velocity_mps, tip_mps = drawn(rng, airframe, fastest_mps)
        radar = {"carrier_hz": scene.radar.carrier_hz, "prf_hz": scene.radar.prf_hz}
        blades = AIRFRAMES[airframe].fields["rotors"][0].get("blades", 2)
        found = measure(scene.render(number).iq, **radar, blades=blades)
        out.append(
            Found(
                airframe,
                float(found.body_velocity_mps) - velocity_mps,
                float(found.body_velocity_mps_std),
                float(found.tip_speed_mps) / tip_mps - 1,
                float(found.tip_speed_mps_std) / tip_mps,
            )
        )
    return out


def row(name: str, found: list[Found]) -> str:
    """Give one line of the table."""
    fields = ("body_mps", "body_std_mps", "tip", "tip_std")
    body, body_std, tip, std = (np.array([getattr(f, field) for f in found]) for field in fields)
    given = np.isfinite(tip)
    off = np.abs(tip[given])
    sure = (off > 4 * std[given]) & (off > 0.01)
    body_sure = (np.abs(body) > 4 * body_std) & (np.abs(body) > 0.2)
    return (
        f"{name:18s} {len(found):6d} {100 * np.mean(np.abs(body) < 0.2):6.0f} {100 * body_sure.mean():6.0f} "
        f"{100 * given.mean():6.0f} "
        f"{100 * np.median(off):8.2f} {100 * np.mean(off < 0.02):6.0f} {100 * np.mean(off < 0.05):6.0f} "
        f"{100 * sure.mean():6.0f}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=240)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fastest-mps", type=float, default=FASTEST_MPS, help="0: all hover")
    given = parser.parse_args()
    found = table(given.scenes, given.seed, given.fastest_mps)
    print("shares [%]: body within 0.2 m/s, wrongly sure: off by more than that and four of its deviations; tip given;")
    print("of these median error, within 2 and 5 %, and wrongly sure: off by more than 1 % and four of its deviations")
    heads = ("scenes", "body", "sure", "given", "median", "2 %", "5 %", "sure")
    print("airframe".ljust(18), *(head.rjust(8 if head == "median" else 6) for head in heads))
    for airframe in sorted(AIRFRAMES):
        print(row(airframe, [one for one in found if one.airframe == airframe]))
    print(row("all", found))


if __name__ == "__main__":
    main()
