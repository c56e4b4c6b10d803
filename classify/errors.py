"""The exceptions that are reported in one line: bad input, which a user can correct, and the stop of a long run."""

import os
from pathlib import Path


class BadInput(ValueError):  # noqa: N818 - it is the user's input that is bad
    """Something given is wrong: a file, a field or a value.

    Parameters
    ----------
    message
        What (file or field), the value, the rule and the cure. Kept to one line, whatever the file name holds.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def unreadable(path: object, error: OSError, cure: str = "name a file that can be read") -> BadInput:
    """Error for a file that the system could not read; if the system names another file than `path`, that is named."""
    return BadInput(f"{error.filename or path}: cannot be read: {error.strerror or error}: {cure}")


def unwritable(path: str | os.PathLike[str], error: OSError, cure: str) -> BadInput:
    """Error for a file or a folder that the system could not write; a fault of its folder is named first."""
    reason, folder = error.strerror or error, Path(path).parent
    if isinstance(error, FileNotFoundError):
        cure = "make its folder first"
        if folder.is_dir():  # as of /proc, whose files are the system's
            reason, cure = f"{folder} takes no files", "give another folder"
    elif isinstance(error, NotADirectoryError):
        above = next((one for one in (folder, *folder.parents) if one.is_file()), folder)
        reason, cure = f"{above} is a file", "give another folder"
    return BadInput(f"{path}: cannot be written: {reason}: {cure}")


class Interrupted(Exception):  # noqa: N818 - no error: the user stopped it
    """A long run was stopped by Ctrl-C, and goes on from what it has kept."""


def one_line(text: str) -> str:
    r"""Escape what would break a line or drive a terminal (line ends, escape codes, undecodable bytes).

    Examples
    --------
    >>> one_line("a\nb")
    'a\\nb'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
