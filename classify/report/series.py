"""How each model looks throughout the page: its colour, its marker and its place in the legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bladewing.models import DEFAULT_MODEL, TEACHER
from bladewing.models import LADDER as _KNOWN

from ..ladder import CASCADE
from .svg import MARKERS, SERIES

# Known models from cheap to dear, in the tables' order. A known model keeps its look whatever else is on the page.
LADDER = (*(name for name in _KNOWN if name != TEACHER), CASCADE)

#: Name of the default model with its multiplications in eight bits; only the front includes it.
EIGHT_BITS = f"{DEFAULT_MODEL}-int8-trial"

_MODELS = {name: number for number, name in enumerate((*LADDER, EIGHT_BITS))}
# Colour number of each family that the report trains (all STFTs are one family). The palette is too short to give each
# its own: the first four share the colour of a model that is not shipped and reads similar inputs.
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
        """Stand-in colour, see `svg`."""
        return SERIES[self.number]

    @property
    def marker(self) -> str:
        """Name of the marker in matplotlib."""
        return MARKERS[self.outline]


def looks(models: Sequence[str]) -> dict[str, Look]:
    """Give each model its look.

    Unknown models take in turn the colours that no known model on the page has, all with the last marker; when the
    colours are used up, they start again with the marker before it.

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

    Models keep their look. Each family trained here has one colour on every page, which no other family and no shipped
    model has. Choices of one family, and any others that share a colour, differ by their marker.

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
            # A family with a single choice gets a marker of its own too, counted from the last: colour alone is not
            # enough to tell choices apart.
            first, step = (-1 - (known.index(family) if family in known else 0), -1) if alone else (0, 1)
            outlines = ((first + step * place) % len(MARKERS) for place in range(len(MARKERS)))
            possible = (Look(_FAMILIES.get(family, _LAST), outline) for outline in outlines)
            found[row["name"], row["kind"]] = next(look for look in possible if look not in found.values())
    return found
