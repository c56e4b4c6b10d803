"""Writing a file whole or not at all."""

import contextlib
import os
import secrets
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
