"""What a long run has finished so far, kept on the disk: an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import io
import json
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import BadInput
from .files import only_writer, read_bounded, write_whole

#: Folders of what is finished so far, beside the results while a training or a report is not done.
TRAIN_PARTS, REPORT_PARTS = "train-parts", "report-parts"

_MOST_BYTES = 1 << 30


class Parts:
    """Finished parts of one run, by name: plain JSON and plain arrays, never a pickle.

    Parameters
    ----------
    folder : Path
        Where they lie while the run is not done, beside its results.
    of : mapping
        All that the results depend on; parts of a run with other values are not taken.
    """

    def __init__(self, folder: Path, of: Mapping[str, Any]) -> None:
        key = hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest()[:16]
        self._all, self._folder = folder, folder / key

    @property
    def begun(self) -> bool:
        """Whether an earlier run of the same left anything."""
        return self._folder.is_dir()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Context that keeps out other runs with results in the same place.

        Raises
        ------
        BadInput
            One is at work there.
        """
        self._all.mkdir(parents=True, exist_ok=True)
        with ExitStack() as held:
            try:
                held.enter_context(only_writer(self._all, wait=False))
            except (BlockingIOError, FileNotFoundError):  # or one that ends at this very moment
                busy = f"{self._all.parent}: another run is at work there"
                raise BadInput(f"{busy}: let it finish, or give another folder") from None
            held.callback(self._clear)  # by the holder of the lock alone, which is the folder itself
            yield

    def have(self, name: str) -> bool:
        """Whether a part was finished before."""
        return (self._folder / f"{name}.json").exists()

    def take(self, name: str, make: Callable[[], Any]) -> Any:
        """Give a part as it was finished before, or make and keep it.

        Parameters
        ----------
        name : str
            Of the part; a file name.
        make : callable
            Gives plain numbers, strings, lists and dictionaries.

        Raises
        ------
        BadInput
            What was kept is damaged.
        """
        file = self._folder / f"{name}.json"
        if not file.exists():
            self._write(file, json.dumps(make(), allow_nan=False).encode())
        try:
            return json.loads(read_bounded(file, _MOST_BYTES))
        except (OSError, ValueError, RecursionError) as error:
            raise self.refusal(name, str(error), suffix="json") from None

    def keep_arrays(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep arrays as a part; it takes the place of an earlier one of that name in one step."""
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, **arrays)
        self._write(self._folder / f"{name}.npz", content.getvalue())

    def arrays(self, name: str) -> dict[str, NDArray[Any]] | None:
        """Give the arrays of a part, None where none is kept.

        Raises
        ------
        BadInput
            What was kept is damaged, or holds objects.
        """
        file = self._folder / f"{name}.npz"
        if not file.exists():
            return None
        try:
            found = np.load(io.BytesIO(read_bounded(file, _MOST_BYTES)), allow_pickle=False)
            return {key: found[key] for key in found.files}
        except _DAMAGE as error:
            raise self.refusal(name, str(error)) from None

    def refusal(self, name: str, why: str, *, suffix: str = "npz") -> BadInput:
        """The error for a part that cannot be used."""
        return BadInput(f"{self._folder / name}.{suffix}: not what this run kept: {why}: remove it and start again")

    def forget(self) -> None:
        """Remove all parts of this run, whose result is written.

        Parts of other runs stay, and so does the folder of all runs until `alone` ends.
        """
        shutil.rmtree(self._folder, ignore_errors=True)

    def others(self) -> str:
        """Say in one line what other runs have left unfinished beside this one; empty where none has."""
        left = [folder for folder in self._all.glob("*") if folder.is_dir() and folder != self._folder]
        if not left:
            return ""
        held = sum(file.stat().st_size for folder in left for file in folder.rglob("*") if file.is_file())
        what, it = ("an unfinished run", "it") if len(left) == 1 else (f"{len(left)} unfinished runs", "them")
        return (
            f"{self._all} holds {what} of other settings or of another version, {held / 1e6:.3g} MB: "
            f"what began {it} goes on with {it}, or remove the folder to be rid of {it}"
        )

    def _clear(self) -> None:
        """Remove the folder of all runs, if nothing is in it."""
        with suppress(OSError):
            self._all.rmdir()

    def _write(self, file: Path, content: bytes) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        write_whole(file, content)


# What reading a damaged archive may raise; AttributeError: a single array (.npy) has no list of files.
_DAMAGE = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    AttributeError,
    NotImplementedError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)
