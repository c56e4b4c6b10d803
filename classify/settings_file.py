"""Settings of a command: read from a TOML file, checked against their table, each error one clear line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .bounds import MOST_TEXT_BYTES
from .errors import BadInput
from .files import read_bounded

Settings = TypeVar("Settings", bound=BaseModel)


def given_settings(file: Path | None, **options: Any) -> dict[str, Any]:
    """What a user gave: the fields of a TOML file, if one is named, then the options that are not None.

    Raises
    ------
    BadInput
        If the file cannot be read or is not TOML.
    """
    fields = {} if file is None else _read(file)
    return fields | {name: value for name, value in options.items() if value is not None}


def build_settings(table: type[Settings], values: Mapping[str, Any], *, where: str) -> Settings:
    """Check values against their table.

    Parameters
    ----------
    table : type of pydantic model
        The fields, unknown ones forbidden.
    values : mapping
        Field to value.
    where : str
        Where they come from, for error messages.

    Returns
    -------
    The table's instance.

    Raises
    ------
    BadInput
        If a field is unknown or out of its range.
    """
    try:
        return table(**values)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            known = ", ".join(table.model_fields)
            raise BadInput(f"{where}: unknown field {field!r}: the fields are {known}") from None
        rule = first["msg"].replace("Input ", "it ", 1).replace("Tuple ", "it ", 1)
        raise BadInput(f"{where}: {field} is {first['input']!r}: {rule}") from None


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_bounded(file, MOST_TEXT_BYTES).decode())
    except OSError as error:
        raise BadInput(f"{file}: cannot be read: {error.strerror}: give the path of a TOML file") from None
    except (ValueError, RecursionError) as error:  # too large, not UTF-8, not TOML, or nested beyond reason
        raise BadInput(f"{file}: not TOML: {error}") from None
