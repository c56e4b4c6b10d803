"""Numbers on the axes of the report's figures."""

from __future__ import annotations

from math import ceil, floor, log10

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from .words import number

#: _IN_A_DECADE: sets of multiples that are numbered in each decade of a logarithmic axis, the coarsest first.
#: _LEAST_NUMBERS: the first set that gives at least this many numbers on the axis is used.
_IN_A_DECADE, _LEAST_NUMBERS = ((1,), (1, 3), (1, 2, 5)), 3


def percent_ticks(axis: Axis) -> None:
    """Number an axis of shares in percent, in steps without decimals where there is room."""
    axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.4g} %"))


def share_axis(axes: Axes, label: str) -> None:
    """Make the vertical axis one of shares, from 0 to just over 100 %."""
    axes.set_ylim(0, 1.02)
    percent_ticks(axes.yaxis)
    axes.set_ylabel(label)


def log_ticks(axis: Axis, ends: tuple[float, float]) -> None:
    """Number a logarithmic axis between its ends, within the decades too if the axis is short."""
    decades = range(floor(log10(ends[0])), ceil(log10(ends[1])) + 1)
    for steps in _IN_A_DECADE:
        places = [step * 10.0**decade for decade in decades for step in steps]
        places = [place for place in places if ends[0] <= place <= ends[1]]
        if len(places) >= _LEAST_NUMBERS:
            break
    if len(places) < _LEAST_NUMBERS - 1:  # the axis spans only a part of a decade
        places = [place for place in MaxNLocator(4).tick_values(*ends) if ends[0] <= place <= ends[1]]
    axis.set_major_locator(FixedLocator(places))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())
