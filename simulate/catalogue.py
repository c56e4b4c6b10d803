"""Named airframes and birds, each with its source.

The paper is "Analysis of Micro-Doppler Signatures of Small UAVs Based on Doppler Spectrum". Levels are not from its
tables unless a line says so: they are set so that the blades stand out of the noise, and a scene may change them.
"""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Entry:
    """One named target.

    Parameters
    ----------
    fields : dict
        Fields of `parts.UavPart` or `parts.BirdPart`.
    source : str
        Where the values come from.
    """

    fields: dict[str, Any]
    source: str


#: Wavelength of the paper's radar, at 9.85 GHz [m].
_PAPER_WAVELENGTH_M = 0.0304357825


def _tips(length_m: float, rates_rpm: tuple[float, ...], *, arm_m: float = 0.0, flash_db: float = 17.0) -> list[dict]:
    """Rotors of point scatterers at the tip, as in the paper's model; neighbours turn in opposite senses."""
    count = len(rates_rpm)
    return [
        {
            "blade_length_m": length_m,
            "root_m": length_m,
            "rotation_hz": (-1) ** n * rpm / 60,
            "flash_db": flash_db,
            "offset_m": arm_m,
            "bearing_deg": 360.0 * (n + 0.5) / count if count > 1 else 0.0,
            "phase_deg": 37.0 * n,
        }
        for n, rpm in enumerate(rates_rpm)
    ]


def _blades(length_m: float, rates_hz: tuple[float, ...], *, arm_m: float, flash_db: float, **more: Any) -> list[dict]:
    """Rotors of uniform blades; neighbours turn in opposite senses."""
    count = len(rates_hz)
    return [
        {
            "blade_length_m": length_m,
            "root_m": round(0.15 * length_m, 6),
            "rotation_hz": (-1) ** n * rate,
            "flash_db": flash_db,
            "offset_m": arm_m,
            "bearing_deg": 360.0 * (n + 0.5) / count if count > 1 else 0.0,
            "phase_deg": 37.0 * n,
            **more,
        }
        for n, rate in enumerate(rates_hz)
    ]


_BODY = [{"level_db": 30.0}]
_FOUR_RPM = (3395.0, 3430.0, 3465.0, 3500.0)
_TABLE_II = "the paper, Table II, type {}"
_MEASURED = (
    "the paper, sections IV-X and Table VII: blade length; rotation rate from its measured chopping frequency of {} Hz"
)

AIRFRAMES: dict[str, Entry] = {
    "type1": Entry({"body": _BODY, "rotors": _tips(0.15, (3500.0,))}, _TABLE_II.format(1)),
    "type2": Entry({"body": _BODY, "rotors": _tips(0.30, (3500.0,))}, _TABLE_II.format(2)),
    "type3": Entry({"body": _BODY, "rotors": _tips(0.15, (7000.0,))}, _TABLE_II.format(3)),
    "type4": Entry({"body": _BODY, "rotors": _tips(0.15, _FOUR_RPM, arm_m=0.25, flash_db=14.0)}, _TABLE_II.format(4)),
    "type5": Entry(
        {"body": _BODY, "rotors": _tips(0.15, _FOUR_RPM, arm_m=0.25, flash_db=14.0), "velocity_mps": -20.0},
        _TABLE_II.format(5),
    ),
    "type6": Entry(
        {"body": _BODY, "rotors": _tips(0.15, _FOUR_RPM, arm_m=0.25, flash_db=14.0), "beta_deg": 60.0},
        _TABLE_II.format(6),
    ),
    # Levels: the strongest blade lines stand 23-39, 26-45, 10-25 and 10-24 dB under the body (Table VII).
    "fixed_wing_15cm": Entry(
        {"body": [{"level_db": 25.0}], "rotors": _blades(0.15, (47.0,), arm_m=0.3, flash_db=28.1)},
        _MEASURED.format(94),
    ),
    "quadcopter_12cm": Entry(
        {"body": [{"level_db": 25.0}], "rotors": _blades(0.12, (69.0, 69.7, 70.3, 71.0), arm_m=0.2, flash_db=23.1)},
        _MEASURED.format(140),
    ),
    "hexacopter_30cm": Entry(
        {
            "body": [{"level_db": 25.0}],
            "rotors": _blades(0.30, (34.6, 34.8, 34.9, 35.1, 35.2, 35.4), arm_m=0.5, flash_db=47.2),
        },
        _MEASURED.format(70),
    ),
    "helicopter_41cm": Entry(
        {
            "body": [{"level_db": 25.0}],
            "rotors": [
                *_blades(0.407, (41.0,), arm_m=0.0, flash_db=49.9),
                # gear ratio 4.73 : 1 is the paper's, the tail blade's length is not given there
                *_blades(0.08, (4.73 * 41.0,), arm_m=0.5, flash_db=21.7, bearing_deg=150.0),
            ],
        },
        _MEASURED.format("82 (tail 397)"),
    ),
}


def _bird(mass_kg: float, span_m: float, area_m2: float, **more: Any) -> Entry:
    """A species by its rounded handbook size; its wingbeat follows by Pennycuick (1996)."""
    fields = {"mass_kg": mass_kg, "span_m": span_m, "area_m2": area_m2, "wing_db": 15.0, "body_db": 20.0, **more}
    return Entry(
        fields, "rounded handbook mass, span and wing area (as in Pennycuick, Modelling the Flying Bird, 2008)"
    )


BIRDS: dict[str, Entry] = {
    "mute_swan": _bird(10.0, 2.30, 0.68),
    "herring_gull": _bird(1.0, 1.37, 0.197),
    "greylag_goose": _bird(3.3, 1.60, 0.34),
    "cormorant": _bird(2.2, 1.32, 0.224),
    "jackdaw": _bird(0.23, 0.67, 0.066, flight="flap_glide", flap_s=2.0, rest_s=0.8),
    "teal": _bird(0.32, 0.59, 0.044),
    "swallow": _bird(0.019, 0.32, 0.0135, flight="flap_glide", flap_s=0.8, rest_s=0.5),
    "starling": _bird(0.080, 0.384, 0.0251),
    "siskin": _bird(0.013, 0.215, 0.0085, flight="bound", flap_s=0.35, rest_s=0.25),
    "goldcrest": _bird(0.0056, 0.148, 0.0056),
    "paper_bird": Entry(
        {
            "mass_kg": 1.0,
            "span_m": 1.37,
            "area_m2": 0.197,
            "wingbeat_hz": 1 / 0.302,
            "wing_db": 18.0,
            "body_db": 25.0,
            "velocity_mps": 340 * _PAPER_WAVELENGTH_M / 2,
            "acceleration_mps2": -(340 + 316) * _PAPER_WAVELENGTH_M / 2 / 2.5,
        },
        "the paper's bird: flash period 0.302 s, line swept from -340 to +316 Hz in 2.5 s (at 9.85 GHz); a gull's size",
    ),
}
