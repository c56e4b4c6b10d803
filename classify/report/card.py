"""The model card and the README's figures, in Markdown, from the content of ``report.json`` alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bladewing.simulate.dataset import KIND_CLASS

from .summary import front_budgets, headline_model, sentences
from .words import count, micros, number, percent, size, spoken


def model_card(report: Mapping[str, Any]) -> str:
    """Write the card of the models in a report.

    Parameters
    ----------
    report : mapping
        The content of ``report.json``, as read.

    Returns
    -------
    str
        Markdown; equal content gives equal text.
    """
    name = headline_model(report)
    model = next(one for one in report["models"] if one["name"] == name)
    found = report["scores"][name]
    parts = [
        "# Model card",
        "",
        f"The models of bladewing; where one is meant, it is `{name}`. "
        f"Figures: `{report['made']['command']}`, {report['made']['date'][:10]}, "
        f"{count(report['records']['total'])} synthetic test records of {count(report['records']['radars'])} radars.",
        "",
        *_section("Where it fails", [line for head, lines in sentences(report) if "fails" in head for line in lines]),
        *_section("What it can do", [line for head, lines in sentences(report) if "can do" in head for line in lines]),
        "## Models",
        "",
        *_table(report),
        "",
        "95 % intervals in brackets. Every one reads IQ of one range cell through features of this package, and "
        "answers UAV, bird or clutter with calibrated probabilities, or “unknown”.",
        "",
        "## Intended use",
        "",
        "To name what moves in one range cell of a pulse-Doppler or CW radar, dwell by dwell, beside a signal "
        "processor, and to compare what inputs and models cost. Not meant for fire control or any decision without a "
        "person; not for imaging, and not to tell makes of UAV apart.",
        "",
        "## Envelope",
        "",
        *[f"- {line}" for line in _envelope(model["envelope"])],
        "",
        "Outside of it the answer is “unknown”, with the reason.",
        "",
        "## Training data",
        "",
        _training(report),
        "",
        "## Kinds, and what they are called",
        "",
        "| kind | class | records | called UAV | declined |",
        "|---|---|---:|---:|---:|",
        *[
            f"| {spoken(row['kind'])} | {row['class']} | {count(row['called']['uav']['count'])} "
            f"| {_rate(row['called']['uav'])} | {percent(row['unknown']['value'])} |"
            for row in found["by_kind"]
        ],
        "",
        *_section("Cost (chosen on half of the test records, quoted from the other)", front_budgets(report)),
    ]
    return "\n".join(parts).rstrip() + "\n"


def expectations(report: Mapping[str, Any]) -> str:
    """Write the README's section on what to expect, the failures first."""
    name = headline_model(report)
    found, scores = report["scores"][name], report["scores"]
    others = ", ".join(
        f"`{other}` {percent(scores[other]['balanced_accuracy']['value'])}" for other in scores if other != name
    )
    accepted, at_pfa = found["acceptance"], found["uav_at_pfa"]
    low, high = report["records"]["snr_db"] or (float("nan"), float("nan"))
    shortest = 1e3 * report["records"]["dwell_s"][0]
    wider = ""
    if found["design_effect"] is not None:
        times = number(found["design_effect"] ** 0.5)
        wider = f": those of one radar are alike, so read them as {times} times as wide"
    lines = [
        f"Frankly, what fails first (shipped `{name}`; figures from `docs/report.json`: "
        f"{count(report['records']['total'])} synthetic test records of {count(report['records']['radars'])} radars "
        f"over the whole envelope, many of which hold nothing to see: SNR of nine in ten {number(low)} to "
        f"{number(high)} dB, dwells from {number(shortest)} ms, rotors seen up to 80° off their plane; in brackets "
        f"95 % intervals as of independent records{wider}):",
        "",
        f"- balanced accuracy over the three classes {_rate(found['balanced_accuracy'])}"
        + (f" ({others})" if others else "")
        + ";",
        f"- {percent(accepted['coverage']['value'])} of the records are named at all, the rest is “unknown”; of the "
        f"named ones {_rate(accepted['accuracy'])} are right;",
        f"- {_rate(found['false_uav']['accepted'])} of birds and clutter are named UAV; at "
        f"{number(100 * at_pfa['allowed'])} % false alarms {_rate(at_pfa['detection'])} of all UAVs are found.",
    ]
    return "\n".join(lines).replace("\u00a0", " ")


def budgets(report: Mapping[str, Any]) -> str:
    """Write the most accurate choice within each of three time budgets, for answers in batches."""
    batch = report["cost"]["batches"][-1]["batch"]
    return "\n".join(f"- {line}" for line in front_budgets(report, batch=batch)).replace("\u00a0", " ")


def costs(report: Mapping[str, Any]) -> str:
    """Write what an answer costs in batches, from samples to probabilities."""
    timed = report["cost"]["batches"][-1]
    models = ", ".join(
        f"`{row['name']}` {number(row['ratio_to_fft'])}" for row in timed["stages"] if row["stage"] == "chain"
    )
    return (
        f"In batches of {timed['batch']} records of {report['reference']['pulses']} pulses an answer takes so many "
        f"times as long as the bare FFT: {models}."
    )


def _section(title: str, lines: list[str]) -> list[str]:
    return [f"## {title}", "", *[f"- {line}" for line in lines], ""]


def _table(report: Mapping[str, Any]) -> list[str]:
    batch = report["cost"]["batches"][-1]["stages"]
    chain = {row["name"]: row["median_us"] for row in batch if row["stage"] == "chain"}
    first = report["scores"][report["models"][0]["name"]]
    allowed = percent(first["uav_at_pfa"]["allowed"])
    size_of = report["cost"]["batches"][-1]["batch"]
    return [
        f"| model | balanced accuracy | UAVs found at {allowed} false alarms | false UAVs, may decline "
        f"| a record, batch of {size_of} | file |",
        "|---|---:|---:|---:|---:|---:|",
    ] + [
        f"| {model['name']} | {_rate(found['balanced_accuracy'])} | {_rate(found['uav_at_pfa']['detection'])} "
        f"| {_rate(found['false_uav']['accepted'])} | {micros(chain[model['name']])} | {size(model['bytes'])} |"
        for model in report["models"]
        for found in [report["scores"][model["name"]]]
    ]


def _rate(rate: Mapping[str, Any]) -> str:
    if rate["value"] is None:
        return "–"
    return f"{percent(rate['value'])} [{100 * rate['low']:.1f}, {100 * rate['high']:.1f}]"


def _envelope(limits: Mapping[str, float]) -> list[str]:
    """List the limits of the radars that the model answers for, in customary units."""

    def between(low: str, high: str, one: float, unit: str) -> str:
        return f"{number(limits[low] / one)} to {number(limits[high] / one)} {unit}"

    return [
        f"carrier: {between('carrier_min_hz', 'carrier_max_hz', 1e9, 'GHz')}",
        f"PRF: {between('prf_min_hz', 'prf_max_hz', 1e3, 'kHz')}",
        f"pulses of a dwell: {count(int(limits['pulses_min']))} to {count(int(limits['pulses_max']))}",
        f"dwell: {number(1e3 * limits['dwell_min_s'])} ms to {number(limits['dwell_max_s'])} s",
        f"unambiguous velocity, wavelength × PRF / 4: {number(limits['unambiguous_min_mps'])} m/s or more",
    ]


def _training(report: Mapping[str, Any]) -> str:
    given = report["training"]
    kinds = "; ".join(
        f"{name}: {', '.join(spoken(kind) for kind, label in sorted(KIND_CLASS.items()) if label == name)}"
        for name in report["classes"]
    )
    drawn = (
        "Only synthetic records, drawn from the laws in `simulate/laws.py` over the whole envelope, through imperfect "
        f"receivers. No measured record was trained on. Kinds: {kinds}. A mover is a body that moves and shows nothing "
        "else, as a far vehicle, a boat or a balloon."
    )
    if given is None:
        return f"{drawn} There is no account of how these models were trained."
    took = "" if given.get("resumed") else f"; {number(given['seconds'])} s"  # a resumed training's time is incomplete
    return (
        f"{drawn} {count(given['records']['train'])} records, seed {given['settings']['seed']}, and "
        f"{count(given['records']['calibrate'])} others to calibrate{took}."
    )
