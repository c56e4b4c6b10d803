"""Matplotlib figures as inline SVG in the page's own colours; equal numbers give equal bytes.

Figures are drawn in stand-in colours that are then replaced by CSS variables: one drawing suits light and dark pages.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Stand-in colours, and the CSS that replaces each. The series' colours are the page's variables --s0, --s1, ...
INK, GRID, MUTED, PAPER = "#010101", "#020202", "#030303", "#040404"
SERIES = tuple(f"#0a00{number:02x}" for number in range(11))
_CSS = {INK: "currentColor", GRID: "var(--grid)", MUTED: "var(--muted)", PAPER: "var(--paper)"} | {
    colour: f"var(--s{number})" for number, colour in enumerate(SERIES)
}
MARKERS = ("o", "s", "D", "^", "v", "P", "X", "*", "<", ">")

# Widths of panels [inch] of 96 CSS pixels. One wide panel fills a phone's width; three wide or four narrow ones fill a
# desktop's.
WIDE_IN, NARROW_IN = 3.75, 3.0

# Typed Any because matplotlib has a type of its own for every setting's name.
_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "bladewing",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.facecolor": "none",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "lines.linewidth": 1.4,
    "lines.markersize": 4.0,
}


@dataclass(frozen=True)
class Panel:
    """One drawing of the page.

    Attributes
    ----------
    title : str
        Shown above the drawing.
    svg : str
        The drawing, an ``<svg>`` element labelled with what it shows in words.
    """

    title: str
    svg: str


def banded(axes: Axes, x: Sequence[float], rates: Sequence[Mapping[str, Any]], colour: str, marker: str) -> None:
    """Draw a line of rates, with their intervals as a band around it."""
    low, high = [one["low"] for one in rates], [one["high"] for one in rates]
    axes.fill_between(x, low, high, color=colour, alpha=0.1, linewidth=0)
    axes.plot(x, [one["value"] for one in rates], color=colour, marker=marker)


@contextmanager
def drawing(*, height_in: float, width_in: float = WIDE_IN) -> Iterator[tuple[Figure, Axes]]:
    """Give a figure and one axes on it, in the page's style.

    Parameters
    ----------
    height_in, width_in : float
        Size [inch].
    """
    with rc_context(_STYLE):
        figure = Figure(figsize=(width_in, height_in), layout="constrained")
        yield figure, figure.add_subplot()


def panel(figure: Figure, *, name: str, title: str, alt: str) -> Panel:
    """Turn a figure into a panel.

    Parameters
    ----------
    figure : Figure
        Made by `drawing`, whose ``with`` block must still be open.
    name : str
        Unique on the page; letters, digits and hyphens.
    title, alt : str
        Plain text.

    Returns
    -------
    Panel
    """
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = _own_ids(text, name)
    for stand_in, css in _CSS.items():
        text = text.replace(stand_in, css)
    label = f'<svg role="img" aria-label="{escape(alt, quote=True)}" '
    return Panel(title=title, svg=text.replace("<svg ", label, 1).rstrip())


def _own_ids(text: str, name: str) -> str:
    """Remove ids that nothing refers to and prefix the others with the name, so that ids are unique within the page."""
    used = set(re.findall(r'(?:url\(#|href="#)([^)"]+)', text))

    def renamed(match: re.Match[str]) -> str:
        return f' id="{name}-{match[1]}"' if match[1] in used else ""

    text = re.sub(r' id="([^"]+)"', renamed, text)
    return re.sub(r'(url\(#|href="#)', rf"\g<1>{name}-", text)
