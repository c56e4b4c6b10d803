"""Writing a file, or several as one, whole or not at all."""

import contextlib
import errno
import json
import os
import secrets
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from .errors import BadInput

try:
    import fcntl
except ImportError:  # Windows: writers are not kept apart there
    fcntl = None  # type: ignore[assignment]


def write_whole(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Replace a file in one step: a reader sees the old file or the new one, never a part.

    The content is written beside the file under another name, flushed to the disk and then renamed over it. A link
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
        The folder is missing or not writable, the disk is full, or `path` is there and is no regular file. The old
        file, if any, is untouched.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(f"{path} is a directory")
    if target.exists() and not target.is_file():
        raise FileExistsError(errno.EEXIST, "a pipe or a device stands there, which is not replaced", os.fspath(path))
    beside = target.with_name(f".bladewing-{secrets.token_hex(8)}.tmp")
    try:
        _write_new(beside, content)
        os.replace(beside, target)
    except BaseException:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise
    _sync_folder(target.parent)


def _write_new(path: Path, content: bytes | str) -> None:
    """Write a file that is not there yet and flush it to the disk."""
    # Not tempfile: its files are private (0600), a result should follow the user's umask.
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "wb") as file:
        file.write(content.encode() if isinstance(content, str) else content)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def only_writer(folder: str | os.PathLike[str], *, wait: bool = True) -> Iterator[None]:
    """Context that keeps other writers out of a folder; the lock ends with the process, however that ends.

    Parameters
    ----------
    folder
        An existing folder. Within the ``with``, `write_together` and `settle` must not be called for it.
    wait
        Whether to wait while another process holds it.

    Raises
    ------
    BlockingIOError
        Another process holds the folder, and `wait` is False.
    OSError
        The folder is missing.
    """
    if fcntl is None:
        yield
        return
    while True:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise
            except OSError:  # a file system without locks: writers are not kept apart there
                pass
            if os.path.samestat(os.fstat(descriptor), os.stat(folder)):  # else its holder removed it: try again
                yield
                return
        finally:
            os.close(descriptor)


def clear_litter(folder: str | os.PathLike[str], pattern: str = ".bladewing-*.*") -> None:
    """Remove what killed writers left half written; call it only while no other process writes (`only_writer`)."""
    for path in Path(folder).glob(pattern):
        if path.suffix in (".tmp", ".new"):
            with contextlib.suppress(OSError):
                path.unlink()


def read_bounded(path: str | os.PathLike[str], most_bytes: int) -> bytes:
    """Read a regular file of a bounded size; a device or a pipe, which may never end, is refused.

    Raises
    ------
    ValueError
        It is no regular file, or larger.
    OSError
        It cannot be read.
    """
    found = os.stat(path)
    if not stat.S_ISREG(found.st_mode):
        raise ValueError("it is no regular file")
    if found.st_size > most_bytes:
        raise ValueError(f"it has {found.st_size} bytes, more than the {most_bytes} that it may have")
    with open(path, "rb") as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise ValueError(f"it has more than the {most_bytes} bytes that it may have")
    return content


def _sync_folder(folder: Path) -> None:
    """Flush the rename itself to the disk, where the system can (Windows cannot open a folder)."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def result_folder(path: str | os.PathLike[str]) -> Path:
    """Make the folder that results will go to, and see that it can be written to before any work is done.

    A change of several files that an earlier writer left half done is finished (see `settle`).

    Raises
    ------
    BadInput
        It cannot be made, or not be written to.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"{path}: cannot be made a folder: {error.strerror}: give another place") from None
    probe = folder / f".bladewing-{secrets.token_hex(8)}.tmp"
    try:
        _write_new(probe, b"")
    except OSError as error:
        raise BadInput(f"{path}: cannot be written to: {error.strerror}: give another place") from None
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()
    settle(folder)
    return folder


@contextlib.contextmanager
def no_empty_folder(path: str | os.PathLike[str]) -> Iterator[list[Path]]:
    """Context of a run that writes to a folder: at its end folders that were made for it and stayed empty are removed.

    A run that is stopped early, or that lacks a library, then leaves nothing. The folders are the one given and those
    above it that were missing, and the ``with`` gives their list; clear it if another process uses them.
    """
    made = [folder for folder in (Path(path), *Path(path).parents) if not os.path.exists(folder)]
    try:
        yield made
    finally:
        with contextlib.suppress(OSError):  # ends at the first that is not empty, as all above hold it
            for folder in made:
                folder.rmdir()


#: Journal of a change of several files that was decided but maybe not finished.
_JOURNAL = ".bladewing-pending.json"
_JOURNAL_BYTES = 1 << 20


def write_together(folder: str | os.PathLike[str], files: Mapping[str, bytes | str]) -> None:
    """Replace several files of a folder as one: after any interruption they are all old or, once settled, all new.

    First all contents are flushed to the disk beside the old files. Then a journal of the renames is written, which
    decides the change. Then the renames are done. A process that finds the journal later finishes them (see `settle`).

    Parameters
    ----------
    folder
        An existing folder.
    files
        File name to content; other files of the folder stay. A link of that name is replaced, not followed.

    Raises
    ------
    OSError
        The folder is not writable, or the disk is full. Nothing is changed then, unless the system refuses one rename
        after it did another: `settle` tries again.
    """
    place = Path(folder)
    with only_writer(place):
        _settle(place)
        clear_litter(place, ".bladewing-*.new")  # of writers that were killed before their journal was written
        waiting: dict[str, str] = {}
        try:
            for name, content in files.items():
                if (place / name).is_dir():
                    raise IsADirectoryError(f"{place / name} is a directory")
                beside = f".bladewing-{secrets.token_hex(8)}.new"
                waiting[beside] = name
                _write_new(place / beside, content)
            _sync_folder(place)
            write_whole(place / _JOURNAL, json.dumps(waiting))
        except BaseException:
            _remove(place, [_JOURNAL, *waiting])  # the journal first, else files that it names would be gone
            raise
        _settle(place, fresh=True)


def settle(folder: str | os.PathLike[str]) -> None:
    """Finish a change of several files that an interruption left half done; nothing to do is the usual case.

    Parameters
    ----------
    folder
        A folder that `write_together` may have written to.
    """
    if (Path(folder) / _JOURNAL).exists():
        with only_writer(folder):
            _settle(Path(folder))


def _settle(place: Path, *, fresh: bool = False) -> None:
    """Do the renames that a journal names; a `fresh` change is undone if a rename fails before any was done."""
    journal = place / _JOURNAL
    try:
        waiting = json.loads(read_bounded(journal, _JOURNAL_BYTES))
        renames = [(str(beside), str(name)) for beside, name in waiting.items()]
    except FileNotFoundError:
        return
    except (ValueError, AttributeError, RecursionError):
        # a journal of ours is written whole: this one is not ours, and must not block the folder for ever
        journal.unlink()
        return
    done = False
    for beside, name in renames:
        # only names within the folder are followed: a journal must not move files elsewhere
        if Path(beside).match(".bladewing-*.new") and all(Path(one).name == one for one in (beside, name)):
            try:
                os.replace(place / beside, place / name)
                done = True
            except FileNotFoundError:
                done = True  # by the writer that was interrupted
            except OSError:
                if fresh and not done:
                    _remove(place, [_JOURNAL, *waiting])
                if fresh:
                    raise
                # of an earlier writer: a rename that cannot be done must not block the folder for ever
                _remove(place, [beside])
    _sync_folder(place)
    _remove(place, [_JOURNAL])


def _remove(place: Path, names: Iterable[str]) -> None:
    """Remove files of a folder, in this order; those that cannot be removed stay."""
    for name in names:
        with contextlib.suppress(OSError):
            (place / name).unlink()
