"""Figures of what an answer costs and what a record weighs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter

from .series import looks
from .svg import MUTED, PAPER, SERIES, Panel, drawing, panel
from .ticks import log_ticks, percent_ticks
from .words import batch_words, count, micros, number, percent, size, spoken

_BLUE = SERIES[2]


def _log_times(axes: Axes, label: str) -> None:
    axes.set_xscale("log")
    log_ticks(axes.xaxis, axes.get_xlim())
    axes.set_xlabel(label)


def front(report: Mapping[str, Any]) -> list[Panel]:
    """Draw accuracy against the whole chain's cost, one panel per batch size; unbeaten ones are filled and joined."""
    panels = []
    look = looks([model["name"] for model in report["models"]])
    for part in report["trade"]:
        with drawing(height_in=2.9) as (figure, axes):
            kept = [point for point in part["points"] if point["front"]]
            axes.step(
                [point["cost_us"] for point in kept],
                [point["balanced_accuracy"] for point in kept],
                where="post",
                color=MUTED,
                linewidth=0.9,
            )
            for point in part["points"]:
                name = point["model"]
                rate = report["scores"][name]["balanced_accuracy"]
                spread = [[rate["value"] - rate["low"]], [rate["high"] - rate["value"]]]
                axes.errorbar(
                    [point["cost_us"]],
                    [rate["value"]],
                    yerr=spread,
                    color=look[name].colour,
                    marker=look[name].marker,
                    markersize=7,
                    markerfacecolor=look[name].colour if point["front"] else PAPER,
                    elinewidth=0.9,
                )
            axes.margins(x=0.12, y=0.12)
            _log_times(axes, "whole chain, IQ to probabilities [µs a record]")
            percent_ticks(axes.yaxis)
            axes.set_ylabel("balanced accuracy")
            title = batch_words(part["batch"])
            words = [
                f"{point['model']}: {micros(point['cost_us'])}, {percent(point['balanced_accuracy'])}"
                f"{'' if point['front'] else ' (beaten by another)'}."
                for point in part["points"]
            ]
            alt = f"Balanced accuracy against cost, {title}. {' '.join(words)}"
            panels.append(panel(figure, name=f"front-{part['batch']}", title=title.capitalize(), alt=alt))
    return panels


def stages(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the median time of every step with a tick at its 99th percentile, one panel per batch size."""
    panels = []
    look = looks([model["name"] for model in report["models"]])
    for part in report["cost"]["batches"]:
        rows = part["stages"]
        with drawing(height_in=0.8 + 0.2 * len(rows)) as (figure, axes):
            for i, row in enumerate(rows):  # dots, no bars: a bar's length means nothing on a scale without a zero
                colour = look[row["name"]].colour if row["stage"] in ("model", "chain") else MUTED
                axes.plot([row["median_us"], row["p99_us"]], [i, i], color=colour, linewidth=1.4)
                axes.plot([row["p99_us"]] * 2, [i - 0.25, i + 0.25], color=colour, linewidth=1.4)
                filled = colour if row["stage"] in ("chain", "fft") else PAPER
                axes.plot(row["median_us"], i, "o", color=colour, markersize=6, markerfacecolor=filled)
            _log_times(axes, "µs a record; tick: 99th percentile")
            axes.set_yticks(range(len(rows)), [stage_name(row) for row in rows])
            axes.set_ylim(len(rows) - 0.4, -0.6)
            axes.tick_params(axis="y", length=0)
            axes.grid(visible=False, axis="y")
            title = batch_words(part["batch"]).capitalize()
            words = ", ".join(f"{stage_name(row)} {micros(row['median_us'])}" for row in rows)
            alt = f"Median time of every step, {title.lower()}: {words}."
            panels.append(panel(figure, name=f"stages-{part['batch']}", title=title, alt=alt))
    return panels


def stage_name(row: Mapping[str, Any]) -> str:
    """Give the name of a step of the chain as shown on the page."""
    inputs = {
        "levels": "level input",
        "spectrum": "spectrum input",
        "cadence": "cadence input",
        "combs": "comb levels",
        "image": "STFT image",
        "features": "features",
        "joint_features": "joint features",
    }
    if row["stage"] == "fft":
        return "bare FFT"
    if row["stage"] == "input":
        return inputs.get(row["name"], row["name"])
    return f"{row['name']}, {'ONNX' if row['stage'] == 'model' else 'whole'}"


def fft_against_stft(report: Mapping[str, Any]) -> list[Panel]:
    """Draw how many times longer the STFT takes than the FFT, with the paper's range, one panel per record length."""
    panels = []
    for part in report["fft_against_stft"]:
        rows, (low, high) = part["stft"], part["paper_ratio"]
        with drawing(height_in=0.9 + 0.24 * len(rows)) as (figure, axes):
            axes.axvspan(low, high, color=SERIES[1], alpha=0.28, linewidth=0)
            for i, row in enumerate(rows):
                axes.barh(i, row["ratio_to_fft"], height=0.6, color=_BLUE, alpha=0.85)
            axes.set_yticks(range(len(rows)), [f"{row['window']} samples, {row['overlap']:.0%}" for row in rows])
            axes.set_ylim(len(rows) - 0.4, -0.6)
            axes.tick_params(axis="y", length=0)
            axes.grid(visible=False, axis="y")
            axes.set_xlim(0, max([high, *(row["ratio_to_fft"] for row in rows)]) * 1.06)
            axes.set_xlabel("STFT time / FFT time")
            axes.set_ylabel("STFT window, overlap")
            title = f"{count(part['pulses'])} samples; shaded: the paper's range"
            words = ", ".join(
                f"window {row['window']} overlap {row['overlap']:.0%}: {number(row['ratio_to_fft'])}" for row in rows
            )
            alt = (
                f"STFT time over FFT time at {count(part['pulses'])} samples: {words}; the paper: {low:g} to {high:g}."
            )
            panels.append(panel(figure, name=f"stft-{part['pulses']}", title=title, alt=alt))
    return panels


def time_law(report: Mapping[str, Any]) -> list[Panel]:
    """Draw time against operations with the fitted law, for one FFT and for the STFT."""
    panels = []
    for name, title in (("fft", "One FFT"), ("stft", "STFT")):
        law = report["time_law"][name]
        with drawing(height_in=2.7) as (figure, axes):
            x = [point["operations"] for point in law["points"]]
            axes.plot(x, [point["time_us"] for point in law["points"]], color=_BLUE, marker="o", linestyle="none")
            along = np.geomspace(min(x), max(x), 40)
            axes.plot(along, law["call_us"] + law["ns_each"] * along / 1e3, color=SERIES[1])
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel("operations, 5 N log₂ N a transform")
            axes.set_ylabel("time [µs]")
            log_ticks(axes.yaxis, axes.get_ylim())
            axes.xaxis.set_minor_formatter(NullFormatter())
            said = f"{micros(law['call_us'])} and {number(law['ns_each'])} ns an operation"
            alt = f"{title}: {said}; the farthest point lies {number(law['worst_factor'])} times off this law."
            panels.append(panel(figure, name=f"law-{name}", title=f"{title}: {said}", alt=alt))
    return panels


def storage(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the bytes per record of each form, uncompressed and compressed."""
    rows = report["storage"]
    with drawing(height_in=0.8 + 0.36 * len(rows)) as (figure, axes):
        # No bars: a logarithmic axis has no zero where they could begin.
        for i, row in enumerate(rows):
            ends = [row["compressed_bytes"], row["bytes"]]
            axes.plot(ends, [i, i], color=_BLUE, linewidth=1, zorder=2)
            axes.plot(ends[1], i, color=_BLUE, marker="o", zorder=3)
            axes.plot(ends[0], i, color=_BLUE, marker="o", markerfacecolor=PAPER, zorder=3)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: size(value)))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_yticks(range(len(rows)), [spoken(row["form"]) for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("bytes a record")
        words = ", ".join(f"{row['form']} {size(row['bytes'])}" for row in rows)
        return [panel(figure, name="storage", title="A record; hollow: compressed", alt=f"Bytes a record: {words}.")]
