"""Figures of the front: accuracy against time and storage, against the dwell, and against the SNR beside the bound."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from .draw_scores import LEAST_SHOWN
from .letters import write_letters
from .series import choice_looks
from .svg import INK, MUTED, PAPER, SERIES, Panel, banded, drawing, panel
from .ticks import log_ticks, percent_ticks, share_axis
from .words import batch_words, count, micros, millis, percent

#: Letters of the points that no other beats, in the order of their cost.
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_BIT_LOOKS = {32: (2, "D"), 16: (3, "o"), 8: (1, "s"), 4: (4, "v")}


def best_points(report: Mapping[str, Any], place: int) -> list[tuple[str, Mapping[str, Any], Mapping[str, Any]]]:
    """Give letter, choice and dwell of every point that no other beats at one batch size, the cheapest first."""
    points = [
        (row, point)
        for row in report["front"]["choices"]
        for point in row["dwells"]
        if point["cost"][place]["front"] and point["balanced_accuracy"]["count"]
    ]
    points.sort(key=lambda pair: pair[1]["cost"][place]["median_us"])
    return [(LETTERS[i % len(LETTERS)], row, point) for i, (row, point) in enumerate(points)]


def time_front(report: Mapping[str, Any]) -> list[Panel]:
    """Draw accuracy against time per record, one panel a batch size; unbeaten points are joined and lettered."""
    panels = []
    choices = report["front"]["choices"]
    looks = choice_looks(choices)
    for place, first in enumerate(choices[0]["dwells"][0]["cost"]):
        with drawing(height_in=3.4) as (figure, axes):
            for row in choices:
                look = looks[row["name"], row["kind"]]
                x = [point["cost"][place]["median_us"] for point in row["dwells"]]
                y = [point["balanced_accuracy"]["value"] for point in row["dwells"]]
                axes.plot(x, y, color=look.colour, linewidth=0.6, alpha=0.45)
                axes.plot(
                    x,
                    y,
                    color=look.colour,
                    marker=look.marker,
                    linestyle="none",
                    markersize=4.2,
                    markerfacecolor=PAPER,
                    markeredgewidth=0.8,
                )
            best = best_points(report, place)
            x = [point["cost"][place]["median_us"] for _, _, point in best]
            y = [point["balanced_accuracy"]["value"] for _, _, point in best]
            axes.step(x, y, where="post", color=MUTED, linewidth=0.9, zorder=1)
            axes.set_xscale("log")
            axes.margins(x=0.08, y=0.12)
            for _, row, point in best:
                look = looks[row["name"], row["kind"]]
                axes.plot(
                    [point["cost"][place]["median_us"]],
                    [point["balanced_accuracy"]["value"]],
                    color=look.colour,
                    marker=look.marker,
                    markersize=6,
                )
            log_ticks(axes.xaxis, axes.get_xlim())
            axes.set_xlabel("IQ to probabilities [µs a record]")
            percent_ticks(axes.yaxis)
            axes.set_ylabel("balanced accuracy")
            write_letters(axes, x, y, [letter for letter, _, _ in best])
            title = batch_words(first["batch"]).capitalize()
            words = "; ".join(
                f"{letter}: {row['words']}, {row['model']}, {millis(point['dwell_s'])}, "
                f"{micros(point['cost'][place]['median_us'])}, {percent(point['balanced_accuracy']['value'])}"
                for letter, row, point in best
            )
            alt = f"Balanced accuracy against time, {title.lower()}. Not beaten: {words}."
            panels.append(panel(figure, name=f"choices-{first['batch']}", title=title, alt=alt))
    return panels


def by_dwell(report: Mapping[str, Any]) -> list[Panel]:
    """Draw balanced accuracy and UAVs found against the dwell, in separate panels for trained and given choices."""
    panels = []
    for slug, title, rows in _groups(report):
        for key, label in (("balanced_accuracy", "balanced accuracy"), ("uav_found", "UAVs found")):
            with drawing(height_in=2.7) as (figure, axes):
                words = []
                for row, look in rows:
                    x = [1e3 * point["dwell_s"] for point in row["dwells"]]
                    rates = [point[key] for point in row["dwells"]]
                    banded(axes, x, rates, look.colour, look.marker)
                    words.append(f"{_name(row)}: {percent(rates[0]['value'])} to {percent(rates[-1]['value'])}.")
                axes.set_xscale("log")
                axes.set_xticks(x, [f"{value:g}" for value in x])
                axes.xaxis.set_minor_locator(NullLocator())
                axes.set_xlabel("dwell [ms]")
                share_axis(axes, label)
                said = label[0].upper() + label[1:]
                alt = f"{said} against the dwell, {title}, shortest to longest. {' '.join(words)}"
                panels.append(panel(figure, name=f"dwells-{slug}-{key}", title=f"{title}: {label}", alt=alt))
    return panels


def by_snr(report: Mapping[str, Any]) -> list[Panel]:
    """Draw UAVs found against SNR at one dwell, with the bound in white noise; groups with too few UAVs are omitted."""
    panels = []
    front = report["front"]
    for slug, title, rows in _groups(report):
        if not any(one["found"]["count"] >= LEAST_SHOWN for row, _ in rows for one in row["uav_by_snr"]):
            continue
        with drawing(height_in=3.0) as (figure, axes):
            for curve, style in zip(front["bounds"], ((0, ()), (0, (5, 2)), (0, (1, 1.5))), strict=True):
                axes.plot(curve["snr_db"], curve["found"], color=INK, linewidth=1.0, linestyle=style)
            words = []
            for row, look in rows:
                slices = [one for one in row["uav_by_snr"] if one["found"]["count"] >= LEAST_SHOWN]
                if not slices:
                    continue
                x = [(one["from"] + one["to"]) / 2 for one in slices]
                rates = [one["found"] for one in slices]
                banded(axes, x, rates, look.colour, look.marker)
                words.append(f"{_name(row)}: {percent(rates[-1]['value'])} at the highest SNR.")
            axes.set_xlim(left=-35)
            axes.set_xlabel("SNR of the rotors, a sample [dB]")
            share_axis(axes, "UAVs found")
            alt = f"UAVs found against SNR, {title}, beside the bound of detection. {' '.join(words)}"
            panels.append(panel(figure, name=f"bound-{slug}", title=title, alt=alt))
    return panels


def stored(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the balanced accuracy of spectra stored in fewer bins and bits, one line per number of bits."""
    rows = report["front"]["stored"]
    with drawing(height_in=3.2) as (figure, axes):
        words = []
        for bits, (colour, marker) in _BIT_LOOKS.items():
            mine = [row for row in rows if row["bits"] == bits]
            x = [row["bytes"] for row in mine]
            rates = [row["balanced_accuracy"] for row in mine]
            y = [one["value"] for one in rates]
            banded(axes, x, rates, SERIES[colour], marker)
            words.append(
                f"{bits} bits: {percent(y[0])} at {mine[0]['bins']} bins, {percent(y[-1])} at {mine[-1]['bins']}."
            )
        kept = [row for row in rows if row["front"]]
        axes.scatter(
            [row["bytes"] for row in kept],
            [row["balanced_accuracy"]["value"] for row in kept],
            s=80,
            facecolors="none",
            edgecolors=INK,
            linewidths=0.8,
            zorder=4,
        )
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_locator(LogLocator(base=4))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: count(round(value))))  # powers of two, whole
        axes.set_xlabel("bytes a record")
        percent_ticks(axes.yaxis)
        axes.set_ylabel("balanced accuracy")
        alt = f"Balanced accuracy against stored bytes. {' '.join(words)}"
        return [panel(figure, name="stored", title="64 to 1024 bins, left to right; ringed: not beaten", alt=alt)]


def _groups(report: Mapping[str, Any]) -> list[tuple[str, str, list[tuple[Mapping[str, Any], Any]]]]:
    """Group the choices into those trained here and the given models: slug, title, and each choice with its look."""
    rows = report["front"]["choices"]
    looks = choice_looks(rows)
    return [
        (slug, title, [(row, looks[row["name"], row["kind"]]) for row in rows if (row["kind"] == "model") is given])
        for slug, title, given in (("here", "Trained here", False), ("given", "The models", True))
    ]


def _name(row: Mapping[str, Any]) -> str:
    return str(row["name"] if row["kind"] == "model" else row["words"])
