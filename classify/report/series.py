"""How each model looks throughout the page: its colour, its marker and its place in the legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bladewing.models import LADDER as _KNOWN

from .svg import MARKERS, SERIES

# From cheap to dear, as the tables list them. A known model keeps its look whatever else is on the page.
LADDER = tuple(_KNOWN)


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
    """Give each model its look; strangers take the colours after the known ones in turn, with the last marker, then the
    one before it.

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
    marker = {name: len(MARKERS) - 1 - place // spare for place, name in enumerate(strangers)}
    return {name: Look(number[name], marker.get(name, number[name]) % len(MARKERS)) for name in models}


def choice_looks(choices: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], Look]:
    """Give each choice of the front its look, by name and kind.

    Models keep theirs. What was trained here has a colour a family (all STFTs share one), from the last colour
    backwards, so that neighbours on the page differ from the models; settings of a family differ by their marker.

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
    for row in choices:
        if row["kind"] != "model":
            family = row["name"].split("-")[0]
            among = [name for name in others if name.split("-")[0] == family]
            place = families.index(family)
            number = (len(SERIES) - 1 - place) % len(SERIES)
            # a lone one takes a marker that no model has: its colour may be a model's
            spare = len(LADDER) + place % (len(MARKERS) - 1 - len(LADDER))
            outline = spare if len(among) == 1 else among.index(row["name"]) % len(MARKERS)
            found[row["name"], row["kind"]] = Look(number, outline)
    return found
