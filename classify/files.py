"""Writing a file, or several as one, whole or not at all."""

import contextlib
import json
import os
import secrets
from collections.abc import Mapping
from pathlib import Path


def write_whole(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Replace a file in one step: a reader sees the old file or the new one, never a part.

    The content is written beside the file under another name, brought to the disk and then renamed over it. A link
    is followed, so that it goes on pointing at the file.

    Parameters
    ----------
    path
        The file to write; its folder must exist.
    content
        Text is written as UTF-8.

    Raises
    ------
    OSError
        The folder is missing or not writable, or the disk is full. The old file, if any, is untouched.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a directory")
    data = content.encode() if isinstance(content, str) else content
    beside = target.with_name(f".bladewing-{secrets.token_hex(8)}.tmp")
    # Not tempfile: its files are private (0600), a result should follow the user's umask.
    descriptor = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with open(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, target)
    except BaseException:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    """Bring the rename itself to the disk, where the system can (Windows cannot open a folder)."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


#: Journal of a change of several files that was decided but maybe not finished.
_JOURNAL = ".bladewing-pending.json"


def write_together(folder: str | os.PathLike[str], files: Mapping[str, bytes | str]) -> None:
    """Replace several files of a folder as one: after any interruption they are all old or, once settled, all new.

    All contents are brought to the disk beside the old files first; then a journal names the renames, which decides
    the change; then they are done. Who finds the journal later (see `settle`) finishes them.

    Parameters
    ----------
    folder
        An existing folder.
    files
        File name to content; other files of the folder stay.

    Raises
    ------
    OSError
        The folder is not writable, or the disk is full. Nothing is changed then.
    """
    place = Path(folder)
    settle(place)
    waiting: dict[str, str] = {}
    try:
        for name, content in files.items():
            if (place / name).is_dir():
                raise IsADirectoryError(f"{place / name} is a directory")
            beside = f".bladewing-{secrets.token_hex(8)}.new"
            waiting[beside] = name
            write_whole(place / beside, content)
        write_whole(place / _JOURNAL, json.dumps(waiting))
    except BaseException:
        for beside in waiting:
            (place / beside).unlink(missing_ok=True)
        raise
    settle(place)


def settle(folder: str | os.PathLike[str]) -> None:
    """Finish a change of several files that an interruption left half done; nothing to do is the usual case.

    Parameters
    ----------
    folder
        A folder that `write_together` may have written to.
    """
    place = Path(folder)
    journal = place / _JOURNAL
    try:
        waiting = json.loads(journal.read_bytes())
    except FileNotFoundError:
        return
    for beside, name in waiting.items():
        # a name is taken for what it says only within the folder: a journal must not move files elsewhere
        if Path(beside).name == beside and Path(name).name == name:
            with contextlib.suppress(FileNotFoundError):
                os.replace(place / beside, place / name)
    _sync_folder(place)
    journal.unlink(missing_ok=True)
