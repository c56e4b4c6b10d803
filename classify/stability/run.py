"""The work behind `bladewing stability`: take every stage to its extremes and write the table of what holds there."""

import html
import json
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import fields
from itertools import groupby
from pathlib import Path
from typing import Any

from ..errors import BadInput
from ..files import read_bounded, result_folder, write_together
from ..limits import MOST_TEXT_BYTES
from ..progress import Progress
from .cell import Cell

#: Version of `stability.json`.
FORMAT = 2


def run_stability(out: Path, *, quick: bool = False, progress: bool = True) -> dict[str, Any]:
    """Measure every cell and write ``stability.json``, ``stability.md`` and ``stability.html``.

    Parameters
    ----------
    out : Path
        Folder for the three files; made if it is missing. The files are replaced together at the end.
    quick : bool
        Leave out what takes minutes.
    progress : bool
        Show progress and the summary.

    Returns
    -------
    dict
        The content of ``stability.json``.

    Raises
    ------
    BadInput
        The folder cannot be made.
    """
    result_folder(out)
    found: list[Cell] = []
    parts = _parts()
    with Progress(visible=progress) as bars:
        for title, cells in parts.items():
            with bars.phase(title, 1):
                found += cells(quick)
        table = {"format": FORMAT, "quick": quick, "cells": [cell.as_dict() for cell in found]}
        files: dict[str, bytes | str] = {
            "stability.json": json.dumps(table, indent=1, allow_nan=False) + "\n",
            "stability.md": markdown(found),
            "stability.html": page(found),
        }
        write_together(out, files)
    lost = [cell for cell in found if not cell.holds]
    for cell in lost:
        bars.say(f"does not hold: {cell.stage}, {cell.parameter} {cell.value}: {_shown(cell)}")
    bars.say(f"{len(found) - len(lost)} of {len(found)} cells hold; {out / 'stability.html'} has them all")
    return table


def worst_of_each(folder: Path) -> list[dict[str, Any]] | None:
    """Read the worst cell of every stage and parameter from a table written earlier, for the report.

    Parameters
    ----------
    folder : Path
        Where ``stability.json`` may lie.

    Returns
    -------
    list of dict or None
        A cell that does not hold, else the one nearest to its limit; with ``cells`` and ``held``: the number of cells
        of this stage and parameter, and how many of them hold. None where there is no table.

    Raises
    ------
    BadInput
        If the file is not such a table.
    """
    path = folder / "stability.json"
    try:
        table = json.loads(read_bounded(path, MOST_TEXT_BYTES))
        if table["format"] != FORMAT:
            raise ValueError(f"format {table['format']!r}, this version reads {FORMAT}")
        names = {field.name for field in fields(Cell)}
        cells = [Cell(**{name: cell[name] for name in names}) for cell in table["cells"]]
        found = []
        for _, group in groupby(cells, key=lambda cell: (cell.stage, cell.parameter)):
            same = list(group)
            worst = max(same, key=lambda cell: (not cell.holds, (cell.error or 0.0) / (cell.limit or 1.0)))
            held = sum(cell.holds for cell in same)
            found.append({**worst.as_dict(), "shown": _shown(worst), "cells": len(same), "held": held})
        return found
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise BadInput(
            f"{path}: not a stability table ({error}): run `bladewing stability` again, or remove it"
        ) from None


def _parts() -> dict[str, Callable[[bool], Iterator[Cell]]]:
    from . import chain, networks, spectra, waves

    return {
        "simulator": waves.cells,
        "features": spectra.cells,
        "models": networks.cells,
        "whole chain": chain.cells,
    }


def _shown(cell: Cell) -> str:
    """Write the error, or the reason why there is none, and any warning."""
    text = cell.said if cell.error is None else f"{cell.error:.2g}"
    return f"{text or 'no number and no reason'}{f' ({cell.warned})' if cell.warned else ''}"


_HEADS = ("parameter", "at", "error", "allowed", "holds", "guard")


def _row(cell: Cell) -> tuple[str, ...]:
    return cell.parameter, cell.value, _shown(cell), f"{cell.limit:g}", "yes" if cell.holds else "NO", cell.guard


def markdown(cells: list[Cell]) -> str:
    """Write the table in Markdown, one section per stage and quantity."""
    lines = ["# Stability", "", "Errors against a more precise oracle; a reason stands where there is no number.", ""]
    for (stage, measure), group in groupby(cells, key=lambda cell: (cell.stage, cell.measure)):
        lines += [
            f"## {stage}",
            "",
            f"Error: {measure}.",
            "",
            "| " + " | ".join(_HEADS) + " |",
            "|---" * len(_HEADS) + "|",
        ]
        lines += ["| " + " | ".join(text.replace("|", "\\|") for text in _row(cell)) + " |" for cell in group]
        lines.append("")
    return "\n".join(lines)


#: CSS of the page, for light and dark screens. Tables wider than the screen scroll; a shade at the right shows this.
_STYLE = (
    ":root{--paper:#fff;--ink:#1b1f24;--muted:#66707a;--line:#d9dee4;--shade:#9aa4ae80;--no:#fbe3e0;--link:#005a8f;"
    "color-scheme:light}"
    "@media(prefers-color-scheme:dark){:root{--paper:#14181c;--ink:#e4e8ec;--muted:#98a3ad;--line:#2e363d;"
    "--shade:#4a555f80;--no:#4a2320;--link:#6bbcf0;color-scheme:dark}}"
    "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:70rem;padding:0 1rem;color:var(--ink);"
    "background:var(--paper)}a{color:var(--link)}nav{columns:16rem;margin:1rem 0 2rem}nav a{display:block}"
    "table{border-collapse:collapse;width:100%;margin:.5rem 0 2rem}th,td{text-align:left;padding:.25rem .6rem;"
    "border-bottom:1px solid var(--line);vertical-align:top}td{font-variant-numeric:tabular-nums}"
    "td:not(.error,.guard),.number{white-space:nowrap}.no td:not([rowspan]){background:var(--no)}"
    "@media(max-width:60rem){.guard{min-width:18rem}}"
    "@media(max-width:40rem){td,th{padding:.25rem .5rem .25rem 0;font-size:.85rem}"
    ".parameter,.at{white-space:normal!important}}"
    ".scroll{overflow-x:auto;background:linear-gradient(to left,var(--paper) 14px,transparent) right/17px 100% "
    "no-repeat local,linear-gradient(to left,var(--shade),transparent) right/14px 100% no-repeat scroll}"
)


def page(cells: list[Cell]) -> str:
    """Write the table as one HTML page that loads nothing from elsewhere."""
    stages = [(named, list(group)) for named, group in groupby(cells, key=lambda cell: (cell.stage, cell.measure))]
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8>"
        "<meta name=viewport content='width=device-width,initial-scale=1'><title>Stability</title>",
        f"<style>{_STYLE}</style><h1>Stability</h1>",
        f"<p>Every stage at its extremes: errors against a more precise oracle, what is allowed, and what guards the "
        f"numbers there. {_held(cells)} hold.</p><nav>",
    ]
    for stage, alike in groupby(enumerate(stages), key=lambda part: part[1][0][0]):  # a stage may have several measures
        (number, (_, some)), *more = alike
        every = [*some, *(cell for _, (_, others) in more for cell in others)]
        parts.append(f"<a href='#s{number}'>{html.escape(stage)}: {_held(every)}</a>")
    parts.append("</nav>")
    for number, ((stage, measure), some) in enumerate(stages):
        heads = "".join(f"<th>{head}" for head in _HEADS)
        parts.append(f"<h2 id=s{number}>{html.escape(stage)}</h2><p>Error: {html.escape(measure)}.</p>")
        parts.append(f"<div class=scroll><table><tr>{heads}")
        rows = [_row(cell) for cell in some]
        spans = {0: _spans([row[0] for row in rows]), len(_HEADS) - 1: _spans([(row[0], row[-1]) for row in rows])}
        for n, (cell, row) in enumerate(zip(some, rows, strict=True)):
            parts.append(f"<tr{'' if cell.holds else ' class=no'}>")
            for column, (head, text) in enumerate(zip(_HEADS, row, strict=True)):
                span = spans[column][n] if column in spans else 1
                whole = head == "error" and cell.error is not None and not cell.warned  # a number's line must not break
                if span:
                    told = f" rowspan={span}" if span > 1 else ""
                    kind = "number" if whole else head
                    parts[-1] += f"<td class={kind}{told}>{html.escape(text)}"
        parts.append("</table></div>")
    return "\n".join(parts) + "\n"


def _held(cells: list[Cell]) -> str:
    return f"{sum(cell.holds for cell in cells)} of {len(cells)}"


def _spans(texts: Sequence[Hashable]) -> list[int]:
    """Give the rows that each cell of a column spans: the first of equal neighbours their number, the others 0.

    Examples
    --------
    >>> _spans(["a", "a", "b", "a"])
    [2, 0, 1, 1]
    """
    runs = [len(list(group)) for _, group in groupby(texts)]
    return [length if first == 0 else 0 for length in runs for first in range(length)]
