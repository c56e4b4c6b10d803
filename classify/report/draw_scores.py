"""Figures of what the models get right."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from .series import looks
from .svg import MUTED, NARROW_IN, SERIES, Panel, banded, drawing, panel
from .ticks import percent_ticks, share_axis
from .words import percent, spoken

GROUPS = ("all", "uav", "bird", "clutter")
_TITLES = {"all": "All records", "uav": "UAV records", "bird": "Bird records", "clutter": "Clutter records"}
# A point over fewer records than this says little: the line breaks there, but the tables keep the value.
LEAST_SHOWN = 10
_GAP = dict.fromkeys(("value", "low", "high"), math.nan)


def accuracy_by_snr(report: Mapping[str, Any]) -> list[Panel]:
    """Draw accuracy against SNR, one panel over all records and one per class."""
    panels = []
    for group in GROUPS:
        with drawing(height_in=2.5, width_in=NARROW_IN) as (figure, axes):
            alt = _lines(axes, report, "by_snr", group, centre=lambda low, high: (low + high) / 2)
            axes.set_xlabel("SNR, a sample [dB]")
            share_axis(axes, "answered right")
            alt = f"Accuracy against SNR, {_TITLES[group].lower()}. {alt}"
            panels.append(panel(figure, name=f"snr-{group}", title=_TITLES[group], alt=alt))
    return panels


def accuracy_by_dwell(report: Mapping[str, Any]) -> list[Panel]:
    """Draw accuracy against the length of the record, one panel over all records and one per class."""
    panels = []
    for group in GROUPS:
        with drawing(height_in=2.5, width_in=NARROW_IN) as (figure, axes):
            axes.set_xscale("log")
            alt = _lines(axes, report, "by_dwell", group, centre=lambda low, high: (low * high) ** 0.5, unit=1e3)
            axes.set_xlabel("dwell [ms]")
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.xaxis.set_minor_formatter(FuncFormatter(lambda *_: ""))
            share_axis(axes, "answered right")
            alt = f"Accuracy against dwell, {_TITLES[group].lower()}. {alt}"
            panels.append(panel(figure, name=f"dwell-{group}", title=_TITLES[group], alt=alt))
    return panels


def _lines(axes: Axes, report: Mapping[str, Any], by: str, group: str, *, centre: Any, unit: float = 1.0) -> str:
    """Draw one line per model with its Wilson band; return in words where each line begins and ends."""
    names = [model["name"] for model in report["models"]]
    words = []
    for name, look in looks(names).items():
        slices = report["scores"][name][by]
        rates = [one[group] if one[group]["count"] >= LEAST_SHOWN else _GAP for one in slices]
        known = [rate for rate in rates if rate is not _GAP]
        if not known:
            continue
        x = [centre(one["from"] * unit, one["to"] * unit) for one in slices]
        banded(axes, x, rates, look.colour, look.marker)
        words.append(
            f"{name}: {percent(known[0]['value'])} at the left end, {percent(known[-1]['value'])} at the right."
        )
    axes.axhline(1 / 3, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
    return " ".join(words)


def accuracy_by_beta(report: Mapping[str, Any]) -> list[Panel]:
    """Draw UAVs answered right and UAVs found against the angle between line of sight and rotor plane."""
    panels = []
    names = [model["name"] for model in report["models"]]
    for key, title in (("answered", "UAVs answered right"), ("found", "UAVs found at the false-alarm rate")):
        with drawing(height_in=2.7) as (figure, axes):
            words = []
            for name, look in looks(names).items():
                slices = [one for one in report["scores"][name]["by_beta"] if one[key]["count"] >= LEAST_SHOWN]
                if not slices:
                    continue
                x = [(one["from"] + one["to"]) / 2 for one in slices]
                rates = [one[key] for one in slices]
                banded(axes, x, rates, look.colour, look.marker)
                words.append(f"{name}: {percent(rates[0]['value'])} from the side, {percent(rates[-1]['value'])} last.")
            axes.set_xlim(0, 90)
            axes.set_xticks(range(0, 91, 15))
            axes.set_xlabel("β, line of sight to rotor plane [°]")
            share_axis(axes, "share of UAVs")
            alt = f"{title} against the angle beta. {' '.join(words)}"
            panels.append(panel(figure, name=f"beta-{key}", title=title, alt=alt))
    return panels


def reliability(report: Mapping[str, Any]) -> list[Panel]:
    """Draw reliability diagrams, one panel per model: on the diagonal the probability equals the accuracy."""
    names = [model["name"] for model in report["models"]]
    panels = []
    for name, look in looks(names).items():
        found = report["scores"][name]["reliability"]
        total = sum(one["accuracy"]["count"] for one in found["bins"])
        with drawing(height_in=3.0) as (figure, axes):
            axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
            for one in found["bins"]:
                share = one["accuracy"]["count"] / total
                # Bars at the bottom show the share of records with a confidence in this bin.
                axes.bar(one["from"], share, width=one["to"] - one["from"], align="edge", color=MUTED, alpha=0.35)
            x = [one["confidence"] for one in found["bins"]]
            y = [one["accuracy"]["value"] for one in found["bins"]]
            below = [one["accuracy"]["value"] - one["accuracy"]["low"] for one in found["bins"]]
            above = [one["accuracy"]["high"] - one["accuracy"]["value"] for one in found["bins"]]
            axes.errorbar(x, y, yerr=[below, above], color=look.colour, marker=look.marker, elinewidth=0.9)
            axes.set_xlim(0, 1.02)
            percent_ticks(axes.xaxis)
            axes.set_xlabel("probability given to the answer")
            share_axis(axes, "answered right")
            ece = f"expected calibration error {percent(found['ece'])}"
            title = f"{name}, error {percent(found['ece'])}"
            alt = f"Reliability of {name}: {ece} over {total} records; {_worst_bin(found['bins'])}"
            panels.append(panel(figure, name=f"reliability-{_slug(name)}", title=title, alt=alt))
    return panels


def _worst_bin(bins: Sequence[Mapping[str, Any]]) -> str:
    big = [one for one in bins if one["accuracy"]["count"] >= LEAST_SHOWN]
    if not big:
        return "no bin holds enough records to judge."
    worst = max(big, key=lambda one: abs(one["accuracy"]["value"] - one["confidence"]))
    return (
        f"furthest off where it says {percent(worst['confidence'])} and is right {percent(worst['accuracy']['value'])}."
    )


def called_uav(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the share of each kind that is called UAV: false drones in one panel, found drones in the other."""
    return [
        _called_uav(report, "false", "Birds and clutter called UAV (should be 0)", wanted=False),
        _called_uav(report, "found", "UAVs called UAV (should be 100 %)", wanted=True),
    ]


def _called_uav(report: Mapping[str, Any], slug: str, title: str, *, wanted: bool) -> Panel:
    """Draw one row per kind and one point per model; if ``wanted``, kinds of UAV, else all others."""
    names = [model["name"] for model in report["models"]]
    rates = {
        name: {
            row["kind"]: row["called"]["uav"]
            for row in report["scores"][name]["by_kind"]
            if (row["class"] == "uav") is wanted
        }
        for name in names
    }
    kinds = list(dict.fromkeys(kind for name in names for kind in rates[name]))
    words = []
    with drawing(height_in=1.0 + 0.34 * max(len(kinds), 1)) as (figure, axes):
        for place, (name, look) in enumerate(looks(names).items()):
            shift = (place - (len(names) - 1) / 2) * 0.72 / len(names)
            for kind, one in rates[name].items():
                y = kinds.index(kind) + shift
                axes.plot([one["low"], one["high"]], [y, y], color=look.colour, linewidth=0.9)
                axes.plot([one["value"]], [y], color=look.colour, marker=look.marker, markersize=3.4)
            if rates[name]:
                worst = (min if wanted else max)(rates[name].items(), key=lambda pair: pair[1]["value"])
                words.append(f"{name}: worst {spoken(worst[0])}, {percent(worst[1]['value'])}.")
        _named_rows(axes, [spoken(kind) for kind in kinds])
        axes.set_xlim(-0.02, 1.02)
        axes.set_xlabel("called UAV")
        return panel(figure, name=f"kinds-{slug}", title=title, alt=f"{title}. {' '.join(words)}")


def families(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the accuracy on each family of a model trained with it and of one trained without it."""
    rows = report["families"]["families"]
    kept, gone = SERIES[2], SERIES[3]
    title = "Accuracy on a family, with and without it in the training"
    words = []
    with drawing(height_in=1.0 + 0.34 * len(rows)) as (figure, axes):
        for y, row in enumerate(rows):
            ends = []
            for key, colour, marker, shift in (("kept", kept, "o", -0.12), ("left_out", gone, "D", 0.12)):
                one = row[key]["accuracy"]
                if one["value"] is None:
                    continue
                axes.plot([one["low"], one["high"]], [y + shift] * 2, color=colour, linewidth=0.9)
                axes.plot([one["value"]], [y + shift], color=colour, marker=marker, markersize=4)
                ends.append(percent(one["value"]))
            words.append(f"{row['name']}: {' with, '.join(ends)} without.")
        _named_rows(axes, [row["name"] for row in rows])
        axes.set_xlabel("balanced accuracy")
        return [panel(figure, name="families", title=title, alt=f"{title}. {' '.join(words)}")]


def _named_rows(axes: Axes, names: Sequence[str]) -> None:
    """Lay out shares along x in named rows, the first on top, with a thin line between neighbouring rows."""
    for line in range(1, len(names)):
        axes.axhline(line - 0.5, color=MUTED, linewidth=0.3)
    axes.grid(visible=False, axis="y")
    axes.set_ylim(max(len(names), 1) - 0.5, -0.5)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", length=0)
    percent_ticks(axes.xaxis)


def _slug(name: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in name)
