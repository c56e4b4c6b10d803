"""How each model looks throughout the page: its colour, its marker and its place in the legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bladewing.models import LADDER as _KNOWN
from bladewing.models import TEACHER

from ..ladder import CASCADE
from .svg import MARKERS, SERIES

# From cheap to dear, as the tables list them. A known model keeps its look whatever else is on the page.
LADDER = (*(name for name in _KNOWN if name != TEACHER), CASCADE)


@dataclass(frozen=True)
class Look:
    """Number of the colour among the page's series and number of the marker among `svg.MARKERS`."""

    number: int
    outline: int

    @property
    def colour(self) -> str:
        """The stand-in of `svg`."""
        return SERIES[self.number]

    @property
    def marker(self) -> str:
        """Matplotlib's name of the marker."""
        return MARKERS[self.outline]


def looks(models: Sequence[str]) -> dict[str, Look]:
    """Give each model its look; strangers take the colours that no known model on the page has, in turn, with the last
    marker, then the one before it.

    Parameters
    ----------
    models : sequence of str

    Returns
    -------
    dict of str to Look
    """
    strangers = [name for name in models if name not in LADDER]
    number = {name: LADDER.index(name) for name in models if name in LADDER}
    free = [one for one in range(len(SERIES)) if one not in number.values()] or list(range(len(SERIES)))
    number |= {name: free[place % len(free)] for place, name in enumerate(strangers)}
    marker = {name: len(MARKERS) - 1 - place // len(free) for place, name in enumerate(strangers)}
    return {name: Look(number[name], marker.get(name, number[name]) % len(MARKERS)) for name in models}


def choice_looks(choices: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], Look]:
    """Give each choice of the front its look, by name and kind.

    Models keep theirs. What was trained here has a colour a family (all STFTs share one), first those that no model
    has, from the last backwards; settings of a family, and what shares a colour, differ by their marker.

    Parameters
    ----------
    choices : sequence of dict
        As in ``front`` of the report.

    Returns
    -------
    dict of (str, str) to Look
    """
    given = looks([row["name"] for row in choices if row["kind"] == "model"])
    others = [row["name"] for row in choices if row["kind"] != "model"]
    families = list(dict.fromkeys(name.split("-")[0] for name in others))
    found = {(name, "model"): look for name, look in given.items()}
    taken = {look.number for look in given.values()}
    turn = sorted(range(len(SERIES)), key=lambda number: (number in taken, -number))
    outlines = range(len(MARKERS))
    for row in choices:
        if row["kind"] != "model":
            family = row["name"].split("-")[0]
            number = turn[families.index(family) % len(turn)]
            alone = sum(name.split("-")[0] == family for name in others) == 1
            possible = (Look(number, outline) for outline in (outlines[::-1] if alone else outlines))
            found[row["name"], row["kind"]] = next(look for look in possible if look not in found.values())
    return found
