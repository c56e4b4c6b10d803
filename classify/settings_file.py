"""Settings of a command from defaults, a TOML file and the command line, each error one clear line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from .errors import BadInput

Settings = TypeVar("Settings", bound=BaseModel)


def build_settings(
    table: type[Settings], file: Path | None, *, start: Mapping[str, Any], options: Mapping[str, Any], what: str
) -> Settings:
    """Put settings together: the table's defaults, then `start`, then the file, then the options.

    Parameters
    ----------
    table : type of pydantic model
        The fields, unknown ones forbidden.
    file : Path or None
        TOML file with fields of the table at its top level.
    start, options : mapping
        Field to value; an option of None was not given.
    what : str
        Whose settings they are, for error messages without a file.

    Returns
    -------
    The table's instance.

    Raises
    ------
    BadInput
        If the file cannot be read, is not TOML, or a field is unknown or out of its range.
    """
    given = {name: value for name, value in options.items() if value is not None}
    values = {**start, **(_read(file) if file is not None else {}), **given}
    where = str(file) if file is not None else f"{what} settings"
    try:
        return table(**values)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        if first["type"] == "extra_forbidden":
            known = ", ".join(table.model_fields)
            raise BadInput(f"{where}: unknown field {field!r}: the fields are {known}") from None
        rule = first["msg"].removeprefix("Input ")
        raise BadInput(f"{where}: {field} is {first['input']!r}: it {rule}") from None


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadInput(f"{file}: cannot be read: {error.strerror}: give the path of a TOML file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{file}: not TOML: {error}") from None
