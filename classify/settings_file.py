"""Settings of a command: read from a TOML file, checked against their table, each error one clear line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .errors import BadInput, unreadable
from .files import read_bounded
from .limits import MOST_TEXT_BYTES

Settings = TypeVar("Settings", bound=BaseModel)


def build_settings(
    table: type[Settings],
    file: Path | None,
    defaults: Mapping[str, Any],
    *,
    stored: Mapping[str, Any] | None = None,
    **options: Any,
) -> Settings:
    """Check settings against their table: defaults, then the fields of a file, then the options that are not None.

    Parameters
    ----------
    table : type of pydantic model
        The fields, unknown ones forbidden.
    file : Path, optional
        TOML file with fields of the table at its top level.
    defaults : mapping
        Field to value, in place of the table's own.
    stored : mapping, optional
        Field to value of a data set, which the file and the options may only repeat.
    options
        Field to value, which overrides the file; None overrides nothing.

    Returns
    -------
    The table's instance.

    Raises
    ------
    BadInput
        If the file cannot be read or is not TOML, or a field is unknown, out of its range or not as stored.
    """
    given = {name: value for name, value in options.items() if value is not None}
    values = {**defaults, **(stored or {}), **({} if file is None else _read(file)), **given}
    for field, value in (stored or {}).items():
        if values[field] != value:
            place = named(field, file, given)
            raise BadInput(f"{place} is {values[field]!r}, but the data set has {value}: leave it out")
    try:
        return table(**values)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        place = named(field, file, given)
        if first["type"] == "extra_forbidden":
            known = ", ".join(table.model_fields)
            raise BadInput(f"{file}: unknown field {field!r}: the fields are {known}") from None
        rule = first["msg"].replace("Input ", "it ", 1).replace("Tuple ", "it ", 1)
        if first["type"] == "tuple_type":
            rule = "it must be a list: write [...] about it"
        raise BadInput(f"{place} is {first['input']!r}: {rule}") from None


def named(field: str, file: Path | None, options: Mapping[str, Any]) -> str:
    """Name a field by where its value comes from: the file, unless an option gave it."""
    return field if file is None or options.get(field) is not None else f"{file}: {field}"


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_bounded(file, MOST_TEXT_BYTES).decode("utf-8-sig"))  # editors may begin with a BOM
    except OSError as error:
        raise unreadable(file, error, "give the path of a TOML file") from None
    except (ValueError, RecursionError) as error:  # too large, not UTF-8, not TOML, or nested beyond reason
        raise BadInput(f"{file}: not TOML: {error}") from None
