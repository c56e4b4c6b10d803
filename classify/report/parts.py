"""What a report has measured so far, kept on the disk: an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..files import write_whole

#: Folder of the parts, beside the report's own files while it is being made.
PARTS = "report-parts"


class Parts:
    """Finished parts of one report, by name.

    Parameters
    ----------
    out : Path
        Folder of the report.
    of : mapping
        All that the results depend on; parts of anything else are not taken.
    """

    def __init__(self, out: Path, of: Mapping[str, Any]) -> None:
        key = hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest()[:16]
        self._all, self._folder = out / PARTS, out / PARTS / key

    def have(self, name: str) -> bool:
        """Whether a part was finished before."""
        return (self._folder / f"{name}.json").exists()

    def take(self, name: str, measure: Callable[[], Any]) -> Any:
        """Give a part as it was finished before, or measure and keep it.

        Parameters
        ----------
        name : str
            Of the part; a file name.
        measure : callable
            Gives plain numbers, strings, lists and dictionaries.
        """
        file = self._folder / f"{name}.json"
        if not file.exists():
            self._folder.mkdir(parents=True, exist_ok=True)
            write_whole(file, json.dumps(measure(), allow_nan=False))
        return json.loads(file.read_text(encoding="utf-8"))

    def forget(self) -> None:
        """Remove all parts: the report stands."""
        shutil.rmtree(self._all, ignore_errors=True)
