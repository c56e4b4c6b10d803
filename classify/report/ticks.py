"""Numbers on the axes of the report's figures."""

from __future__ import annotations

from math import ceil, floor, log10

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from .words import number

#: What is numbered in each decade of a logarithmic axis: the first that makes so many numbers.
_IN_A_DECADE, _LEAST_NUMBERS = ((1,), (1, 3), (1, 2, 5)), 3


def percent_ticks(axis: Axis) -> None:
    """Write shares in percent, in steps that need no decimals where there is room."""
    axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.4g} %"))


def share_axis(axes: Axes, label: str) -> None:
    """Make the vertical axis one of shares, from nothing to all."""
    axes.set_ylim(0, 1.02)
    percent_ticks(axes.yaxis)
    axes.set_ylabel(label)


def log_ticks(axis: Axis, ends: tuple[float, float]) -> None:
    """Number a logarithmic axis between its ends: every decade alone would leave a short one without any."""
    decades = range(floor(log10(ends[0])), ceil(log10(ends[1])) + 1)
    for steps in _IN_A_DECADE:
        places = [step * 10.0**decade for decade in decades for step in steps]
        places = [place for place in places if ends[0] <= place <= ends[1]]
        if len(places) >= _LEAST_NUMBERS:
            break
    if len(places) < _LEAST_NUMBERS - 1:  # within a part of one
        places = [place for place in MaxNLocator(4).tick_values(*ends) if ends[0] <= place <= ends[1]]
    axis.set_major_locator(FixedLocator(places))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())
