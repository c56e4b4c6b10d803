"""Progress on stderr, with the time to go."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars


class Progress:
    """Bars for the phases of a run, one below the other; use in a ``with``.

    Parameters
    ----------
    visible : bool
        False: nothing is written.
    """

    def __init__(self, *, visible: bool) -> None:
        columns = (TextColumn("{task.description:<24}"), BarColumn(), TaskProgressColumn())
        self._bars = Bars(
            *columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True), disable=not visible
        )

    def __enter__(self) -> Progress:
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bars.stop()

    def say(self, text: str) -> None:
        """Write a line below the bars."""
        if not self._bars.disable:
            self._bars.console.print(text, markup=False, highlight=False, soft_wrap=True)

    @contextmanager
    def phase(self, title: str, total: float) -> Iterator[Callable[[float], None]]:
        """Show a bar, and give the function to call with how much of the total is done."""
        task = self._bars.add_task(title, total=total)
        yield lambda done: self._bars.update(task, completed=done)
        self._bars.update(task, completed=total)
