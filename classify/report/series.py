"""How each model looks throughout the page: its colour, its marker and its place in the legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bladewing.models import DEFAULT_MODEL, TEACHER
from bladewing.models import LADDER as _KNOWN

from ..ladder import CASCADE
from .svg import MARKERS, SERIES

# From cheap to dear, as the tables list them. A known model keeps its look whatever else is on the page.
LADDER = (*(name for name in _KNOWN if name != TEACHER), CASCADE)

#: What the default model is called with its products in eight bits: it is tried on the front alone.
EIGHT_BITS = f"{DEFAULT_MODEL}-int8-trial"

_MODELS = {name: number for number, name in enumerate((*LADDER, EIGHT_BITS))}
# Of what is trained in a report, by family (all STFTs are one): where the palette ends, the colour of a model that is
# not shipped and reads the like.
_FAMILIES = {
    "spectrum": _MODELS["features-linear"],
    "features": _MODELS["features-boosted"],
    "stft": _MODELS["image-cnn"],
    "cadence": _MODELS["joint-boosted"],
    "herm": len(_MODELS),
    "cepstrogram": len(_MODELS) + 1,
}
_LAST = len(SERIES) - 1


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
    strangers = [name for name in models if name not in _MODELS]
    number = {name: _MODELS[name] for name in models if name in _MODELS}
    free = [one for one in range(len(SERIES)) if one not in number.values()] or list(range(len(SERIES)))
    number |= {name: free[place % len(free)] for place, name in enumerate(strangers)}
    marker = {name: len(MARKERS) - 1 - place // len(free) for place, name in enumerate(strangers)}
    return {name: Look(number[name], marker.get(name, number[name]) % len(MARKERS)) for name in models}


def choice_looks(choices: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], Look]:
    """Give each choice of the front its look, by name and kind.

    Models keep theirs, and a family of what was trained here has a colour of its own on every page: no other's, and no
    shipped model's. Settings of a family, and what shares a colour for all that, differ by their marker.

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
    found = {(name, "model"): look for name, look in given.items()}
    known = list(_FAMILIES)
    for row in choices:
        if row["kind"] != "model":
            family = row["name"].split("-")[0]
            alone = sum(name.split("-")[0] == family for name in others) == 1
            # each its own marker too, from the last backwards: colours are not all that tells them apart
            first, step = (-1 - (known.index(family) if family in known else 0), -1) if alone else (0, 1)
            outlines = ((first + step * place) % len(MARKERS) for place in range(len(MARKERS)))
            possible = (Look(_FAMILIES.get(family, _LAST), outline) for outline in outlines)
            found[row["name"], row["kind"]] = next(look for look in possible if look not in found.values())
    return found
