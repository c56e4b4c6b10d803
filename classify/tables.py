"""The paper's tables reproduced: theory, what the paper measured, and what this product measures on its own scenes.

The paper is "Analysis of Micro-Doppler Signatures of Small UAVs Based on Doppler Spectrum". Its on-bin rates test no
estimator (116.667 Hz is exactly ten bins of 35 kHz / 3000), so off-bin rates stand beside them.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from bladewing.features.measure_record import PAPER_THRESHOLD_DB
from bladewing.features.notch import body_line
from bladewing.features.spectrum import doppler_spectrum
from bladewing.simulate.scene import Scene

from .errors import unwritable
from .files import result_folder, write_together
from .measure_words import with_error
from .table_measures import SIMULATED_DB, PaperMeasures, by_the_papers_rules, strongest_line_db, theory
from .table_rotors import EXPLAINED, gear_rows, rotor_rows, velocity_rows

#: Paper, Table III: bandwidth theory and measured, chopping theory and measured, Doppler shift measured [Hz].
TABLE_III = {
    "type1": (7220.4, 7469.2, 116.67, 116.70, None),
    "type2": (14441.0, 14705.0, 116.7, 116.7, None),
    "type3": (14441.0, 14938.0, 233.33, 233.50, None),
    "type4": (7220.4, 7235.7, 116.67, 116.70, None),
    "type5": (7220.4, 7235.7, 116.67, 117.00, 1325.0),
    "type6": (3610.2, 3617.9, 116.67, 116.70, None),
}

#: Paper, Table VII: bandwidth, chopping [Hz], strongest and weakest blade line under the body [dB].
TABLE_VII = {
    "fixed_wing": (5647.6, 94.0, 23.0, 39.0),
    "quadcopter": (7093.3, 140.0, 26.0, 45.0),
    "hexacopter": (8761.7, 70.0, 10.0, 25.0),
    "helicopter": (13918.0, 82.0, 10.0, 24.0),
}

#: Paper: the helicopter's tail chopping frequency [Hz] and its gear's ratio.
TAIL = {"helicopter": (397.0, 4.73)}

#: Paper, Table IX, in manoeuvres: Doppler shift, bandwidth, chopping [Hz]. Taken for the first two UAVs of Table VII.
TABLE_IX = {"fixed_wing": (921.7, 6160.0, 157.5), "quadcopter": (653.4, 8284.7, 163.3)}

#: Paper, Table X: UAV, aspect beta [deg], bandwidth, chopping [Hz].
TABLE_X = (
    ("fixed_wing", 30.0, 4924.2, 93.3),
    ("fixed_wing", 60.0, 2753.8, 93.4),
    ("fixed_wing", 90.0, 1190.2, 81.7),
    ("quadcopter", 23.0, 7187.9, 163.4),
    ("quadcopter", 40.0, 5554.3, 175.0),
)

#: Chopping frequencies tried within one bin of the paper's.
OFF_BIN_STEPS = 8

Row = dict[str, Any]


def changed(scene: Scene, *, rates: float = 1.0, **fields: Any) -> Scene:
    """Return a scene whose UAV has other `fields`, and whose rotors turn at `rates` times their rates."""
    part = scene.uav[0]
    rotors = [{**dict(rotor), "rotation_hz": rotor.rotation_hz * rates} for rotor in part.rotors]
    return Scene.build({**dict(scene), "uav": [{**dict(part), "airframe": None, "rotors": rotors, **fields}]})


def table_iii(seed: int) -> Iterator[Row]:
    """The six simulated types: theory, the paper, and this product at the paper's on-bin rates and at off-bin rates."""
    for name, (band, band_seen, chop, chop_seen, shift_seen) in TABLE_III.items():
        scene = Scene.load(name)
        expected, found = theory(scene), by_the_papers_rules(scene.render(seed), SIMULATED_DB)
        bin_hz = scene.radar.prf_hz / scene.radar.pulses
        chop_errors, cepstral_errors, band_errors = [], [], []
        for step in range(OFF_BIN_STEPS):
            rates = 1 + (step + 0.5) / OFF_BIN_STEPS * bin_hz / expected[1]
            off = changed(scene, rates=rates)
            seen, true = by_the_papers_rules(off.render(seed), SIMULATED_DB), theory(off)
            chop_errors.append(seen.chopping_hz - true[1])
            cepstral_errors.append(abs(seen.cepstral_hz - true[1]))
            band_errors.append(100 * (seen.bandwidth_hz / true[0] - 1))
        yield {
            "scene": name,
            "bandwidth paper theory": band,
            "bandwidth theory": expected[0],
            "bandwidth paper measured": band_seen,
            "bandwidth measured": found.bandwidth_hz,
            "bandwidth off-bin error, mean [%]": float(np.mean(band_errors)),
            "chopping paper theory": chop,
            "chopping theory": expected[1],
            "chopping paper measured": chop_seen,
            "chopping, first two lines": found.chopping_hz,
            "chopping, cepstrum": found.cepstral_hz,
            "chopping, first two lines: off-bin error, rms": float(np.sqrt(np.mean(np.square(chop_errors)))),
            "chopping, cepstrum: off-bin error, median": float(np.median(cepstral_errors)),
            "shift theory": expected[2],
            "shift paper measured": shift_seen,
            "shift measured": found.shift_hz,
        }


def table_vii(seed: int) -> Iterator[Row]:
    """The four measured UAVs, hovering."""
    for name, (band, chop, strongest, weakest) in TABLE_VII.items():
        scene = Scene.load(name)
        expected, found = theory(scene), by_the_papers_rules(scene.render(seed), PAPER_THRESHOLD_DB)
        yield {
            "scene": name,
            "bandwidth paper measured": band,
            "bandwidth theory": expected[0],
            "bandwidth measured": found.bandwidth_hz,
            "chopping paper measured": chop,
            "chopping theory": expected[1],
            "chopping, first two lines": found.chopping_hz,
            "chopping, cepstrum": found.cepstral_hz,
            "lines under body, paper [dB]": f"{strongest:g} to {weakest:g}",
            "strongest line under body [dB]": strongest_line_db(scene),
        }


def table_vi(seed: int) -> Iterator[Row]:
    """The four measured UAVs, hovering: what their spectra say of the rotors."""
    for name, (band, chop, *_) in TABLE_VII.items():
        scene = Scene.load(name)
        row, found = rotor_rows(scene, scene.render(seed), band_hz=band, chopping_hz=chop)
        tail, ratio = TAIL.get(name, (None, None))
        yield {"scene": name, **row, **gear_rows(scene, found, tail_hz=tail, gear_ratio=ratio)}


def table_ix(seed: int) -> Iterator[Row]:
    """The UAVs in manoeuvres: speed from the paper's shift, rates from its chopping, aspect from its bandwidth."""
    for name, (shift, band, chop) in TABLE_IX.items():
        scene = Scene.load(name)
        rates = chop / theory(scene)[1]
        level = changed(scene, rates=rates, velocity_mps=-shift * scene.sight.wavelength_m / 2)
        beta_deg = float(np.rad2deg(np.arccos(min(1.0, band / theory(level)[0]))))
        moving = changed(level, beta_deg=beta_deg)
        rendering = moving.render(seed)
        expected, found = theory(moving), by_the_papers_rules(rendering, PAPER_THRESHOLD_DB)
        rotor, fitted = rotor_rows(moving, rendering, band_hz=band, chopping_hz=chop)
        yield {
            "scene": name,
            "beta [deg]": beta_deg,
            "shift, truth": expected[2],
            "shift, paper": shift,
            "shift, strongest line": found.shift_hz,
            **velocity_rows(moving, fitted, shift_hz=shift),
            **_with_rules(rotor, found),
        }


def table_x(seed: int) -> Iterator[Row]:
    """The band shrinks with the aspect; at 90 degrees none is left (the paper's airframe still showed one)."""
    for name, beta_deg, band, chop in TABLE_X:
        scene = Scene.load(name)
        tilted = changed(scene, rates=chop / theory(scene)[1], beta_deg=beta_deg)
        rendering = tilted.render(seed)
        found = by_the_papers_rules(rendering, PAPER_THRESHOLD_DB)
        rotor, _ = rotor_rows(tilted, rendering, band_hz=band, chopping_hz=chop)
        yield {"scene": name, "beta [deg]": beta_deg, **_with_rules(rotor, found)}


def _with_rules(rotor: Row, found: PaperMeasures) -> Row:
    """The rotor's rows with what the paper's rules find in the same samples."""
    there = rotor["chopping, truth"] is not None
    return {
        **rotor,
        "bandwidth, paper's rule": found.bandwidth_hz,
        "chopping, paper's rule (first two lines)": found.chopping_hz if there else None,
        "chopping, cepstrum": found.cepstral_hz if there else None,
    }


def bird(seed: int) -> Iterator[Row]:
    """The paper's bird: where its line is in the first and the last 50 ms, and how often its wings flash."""
    scene = Scene.load("paper_bird")
    rendering, radar = scene.render(seed), scene.sight
    short = round(0.05 * radar.prf_hz)
    ends = []
    for iq in (rendering.iq[:short], rendering.iq[-short:]):
        spectrum = doppler_spectrum(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
        ends.append(-2 * float(body_line(spectrum).velocity_mps) / radar.wavelength_m)
    slow = np.abs(rendering.iq).reshape(-1, 10).mean(axis=1)
    slow -= slow.mean()
    lags = np.arange(int(0.15 * radar.prf_hz / 10), int(0.45 * radar.prf_hz / 10))
    repeats = [np.dot(slow[:-lag], slow[lag:]) / (len(slow) - lag) for lag in lags]
    yield {
        "scene": "paper_bird",
        "line paper": "-340 to +316",
        "line first 50 ms": ends[0],
        "line last 50 ms": ends[1],
        "flash period paper [s]": 0.302,
        "flash period measured [s]": float(lags[int(np.argmax(repeats))] * 10 / radar.prf_hz),
    }


#: Title of each table, and what makes its rows.
TABLES = {
    "Tables I-III: six simulated types": table_iii,
    "Tables VI and VIII: four measured UAVs, their rotors and blades": table_vi,
    "Table VII: four measured UAVs, by the paper's rules": table_vii,
    "Table IX: manoeuvres": table_ix,
    "Table X: aspect": table_x,
    "The paper's bird": bird,
}

#: Title of a table to the text above it.
NOTES = {
    "Tables VI and VIII: four measured UAVs, their rotors and blades": EXPLAINED
    + " The tail's blade is not in the paper; the gear ratio, ours, is tail over main chopping frequency.",
    "Table IX: manoeuvres": "Scenes fly at the paper's shift and turn at its chopping frequency; the aspect is the one "
    "at which eq. 26 gives its bandwidth. Truth, paper and ours as above.",
    "Table X: aspect": "Scenes turn at the paper's chopping frequency. At 90 degrees a rotor shows no band by eq. 26, "
    "so 'ours' is empty there; the paper's airframe still showed one. Truth, paper and ours as above.",
}


def run_tables(out: Path, seed: int = 0) -> dict[str, list[Row]]:
    """Make all tables and write tables.md and tables.json.

    Parameters
    ----------
    out
        Folder; made where it is missing.
    seed
        Root of the scenes' noise.

    Returns
    -------
    dict
        Rows of each table.

    Raises
    ------
    BadInput
        The folder cannot be made, or not be written to.
    """
    result_folder(out)
    tables = make_tables(seed)
    notes = {title: NOTES[title] for title in tables if title in NOTES}
    text = json.dumps({"seed": seed, "notes": notes, "tables": tables}, indent=2, allow_nan=False) + "\n"
    try:
        write_together(out, {"tables.md": markdown(tables), "tables.json": text})
    except OSError as error:
        raise unwritable(out, error, "give a folder") from None
    return tables


def make_tables(seed: int = 0) -> dict[str, list[Row]]:
    """Rows of each table; None where nothing was found."""
    return {title: [_without_nan(row) for row in rows(seed)] for title, rows in TABLES.items()}


def _without_nan(row: Row) -> Row:
    """JSON knows no NaN: what was not found is null."""
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in row.items()}


def markdown(tables: dict[str, list[Row]]) -> str:
    """Lay the tables out, quantities down and scenes across."""
    lines = ["Frequencies in Hz where no unit is given; theory at c = 299 792 458 m/s (the paper took 3e8).", ""]
    for title, rows in tables.items():
        lines += [
            f"## {title}",
            "",
            *([NOTES[title], ""] if title in NOTES else []),
            "| | " + " | ".join(row["scene"] for row in rows) + " |",
        ]
        lines.append("|---" * (len(rows) + 1) + "|")
        for name in rows[0]:
            if name != "scene" and not name.endswith(", std"):
                lines.append(
                    f"| {name} | " + " | ".join(_cell(row[name], row.get(f"{name}, std")) for row in rows) + " |"
                )
        lines.append("")
    return "\n".join(lines)


def _cell(value: object, std: float | None = None) -> str:
    if value is None:
        return ""
    if isinstance(value, float) and std is not None:
        return with_error(value, std)
    return f"{value:.5g}" if isinstance(value, float) else str(value)
