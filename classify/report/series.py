"""How each model looks throughout the page: its colour, its marker and its place in the legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bladewing.models import LADDER as _KNOWN

from .svg import MARKERS, SERIES

# From cheap to dear, as the tables list them. A known model keeps its look whatever else is on the page.
LADDER = tuple(_KNOWN)


@dataclass(frozen=True)
class Look:
    """Colour (a stand-in of `svg`), its number among the page's series, and marker of one model."""

    number: int
    colour: str
    marker: str


def looks(models: Sequence[str]) -> dict[str, Look]:
    """Give each model its look; strangers take the looks after the known ones, in order, over and over.

    Parameters
    ----------
    models : sequence of str

    Returns
    -------
    dict of str to Look
    """
    strangers = [name for name in models if name not in LADDER]
    spare = len(SERIES) - len(LADDER)
    number = {
        name: LADDER.index(name) if name in LADDER else len(LADDER) + strangers.index(name) % spare for name in models
    }
    return {name: Look(number[name], SERIES[number[name]], MARKERS[number[name]]) for name in models}
