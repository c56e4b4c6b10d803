"""The paper's measured UAVs by this product's measurements: truth, the paper's value and ours.

The paper turns its bandwidths, chopping frequencies and shifts into blade lengths and velocities. What it prints is
`PRINTED_FACTOR` times what its own equations (26 and 2 v / wavelength) give for its frequencies at 9.85 GHz, as if the
carrier had been 8.94 GHz. Both stand in the tables.
"""

import math
from typing import Any

import numpy as np
from bladewing.features import Measurements, measure
from bladewing.simulate.render import Rendering
from bladewing.simulate.scene import Scene

from .table_measures import theory

#: Printed lengths and velocities over what the paper's equations give at 9.85 GHz.
PRINTED_FACTOR = 1.101

#: The scenes' rotors have two blades, as the paper's have.
BLADES = 2

Row = dict[str, Any]

EXPLAINED = (
    "'truth' is what the scene was made of, 'paper' what the paper measured on the real UAV, 'ours' what "
    "`bladewing measure` finds in the scene's samples, with its standard deviation, 2 blades and the aspect given. "
    f"The paper's printed blade lengths and velocities are {PRINTED_FACTOR} times what its own equations give for its "
    "printed frequencies at its 9.85 GHz, as if the carrier had been 8.94 GHz: 'paper, printed' is with that factor, "
    "'paper, eq. 26' and 'paper, 2 v / wavelength' are the equations at 9.85 GHz. The equations come nearer to the "
    "blades' true lengths. Of several unlike rotors, chopping is the mean in 'truth' and one rotor's in 'ours'; the "
    "single rotors are below it, 'and more' where the dwell is seen not to part them all: six rotors within 1.6 Hz, as "
    "the hexacopter's, lie nearer than 80 ms part, but their band and blade do not depend on that."
)


def rotor_rows(scene: Scene, rendering: Rendering, *, band_hz: float, chopping_hz: float) -> tuple[Row, Measurements]:
    """Bandwidth, chopping frequency and blade length: truth, paper and ours; and all that was measured.

    Parameters
    ----------
    scene
        One UAV.
    rendering
        Its dwell.
    band_hz, chopping_hz
        The paper's measured values [Hz].
    """
    (part, *_), wavelength_m = scene.uavs, scene.sight.wavelength_m
    beta_rad = math.radians(part.beta_deg)
    edge_on = math.cos(beta_rad) < 1e-9
    found = measure(
        rendering.iq,
        carrier_hz=scene.sight.carrier_hz,
        prf_hz=scene.sight.prf_hz,
        blades=BLADES,
        beta_rad=None if edge_on else beta_rad,
    )
    true_band, true_chopping, _ = theory(scene)
    rotors = [] if edge_on else [r for r in part.rotors if r.blade_length_m == part.rotors[0].blade_length_m]
    true_rates = sorted(abs(r.rotation_hz) * r.blades for r in rotors)  # without a helicopter's tail
    by_equation_m = None if edge_on else band_hz * wavelength_m / (4 * np.pi * chopping_hz * math.cos(beta_rad))
    row: Row = {
        "bandwidth, truth": true_band,
        "bandwidth, paper": band_hz,
        **_ours("bandwidth", found, "bandwidth_hz"),
        "chopping, truth": None if edge_on else true_chopping,
        "chopping, paper": chopping_hz,
        **_ours("chopping", found, "chopping_hz"),
        "single rotors, truth": " ".join(f"{rate:.4g}" for rate in true_rates) or None,
        "single rotors, ours": _rates(found),
        "blade [cm], truth": 100 * part.rotors[0].blade_length_m,
        "blade [cm], paper, printed": by_equation_m and 100 * PRINTED_FACTOR * by_equation_m,
        "blade [cm], paper, eq. 26": by_equation_m and 100 * by_equation_m,
        **_ours("blade [cm]", found, "blade_length_m", 100),
    }
    return row, found


def gear_rows(scene: Scene, found: Measurements, *, tail_hz: float | None, gear_ratio: float | None) -> Row:
    """Tail comb and gear ratio: truth, paper and ours; the truth is None where the paper gives no tail comb."""
    rates = sorted({abs(r.rotation_hz) * r.blades for r in scene.uavs[0].rotors})
    geared = tail_hz is not None
    return {
        "tail chopping, truth": rates[-1] if geared else None,
        "tail chopping, paper": tail_hz,
        **_ours("tail chopping", found, "tail_chopping_hz"),
        "gear ratio, truth": rates[-1] / rates[0] if geared else None,
        "gear ratio, paper, of the airframe": gear_ratio,
        **_ours("gear ratio", found, "gear_ratio"),
    }


def velocity_rows(scene: Scene, found: Measurements, *, shift_hz: float) -> Row:
    """Closing speed: truth, paper and ours."""
    by_equation_mps = shift_hz * scene.sight.wavelength_m / 2
    return {
        "closing [m/s], truth": 0.0 - scene.uavs[0].velocity_mps,
        "closing [m/s], paper, printed": PRINTED_FACTOR * by_equation_mps,
        "closing [m/s], paper, 2 v / wavelength": by_equation_mps,
        **_ours("closing [m/s]", found, "body_velocity_mps", -1),
    }


def _rates(found: Measurements) -> str | None:
    """Chopping frequencies of the single rotors; "and more" where the dwell does not part them all."""
    rates = found.rotor_rates_hz[np.isfinite(found.rotor_rates_hz)]
    if not len(rates):
        return None
    return " ".join(f"{rate:.1f}" for rate in rates) + ("" if found.rotors_resolved else " and more")


def _ours(quantity: str, found: Measurements, name: str, factor: float = 1) -> Row:
    value, std = float(getattr(found, name)), float(getattr(found, f"{name}_std"))
    return {f"{quantity}, ours": factor * value, f"{quantity}, ours, std": abs(factor) * std}
