"""Progress on stderr, with the time to go."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

_LINE_EVERY_S = 30.0


class Progress:
    """Bars for the phases of a run, one below the other; use in a ``with``.

    Where stderr is no terminal (a log, a pipe), a line every half minute takes the place of the bars.

    Parameters
    ----------
    visible : bool
        False: nothing is written.
    passing : bool
        The bars are removed when done, without a closing line: the result is printed in their place.
    """

    def __init__(self, *, visible: bool, passing: bool = False) -> None:
        columns = (TextColumn("{task.description:<24}"), BarColumn(), TaskProgressColumn())
        console = Console(stderr=True)
        self._visible, self._drawn, self._passing = visible, visible and console.is_terminal, passing
        self._console = console
        times = TimeElapsedColumn(), TimeRemainingColumn()
        self._bars = Bars(*columns, *times, console=console, disable=not self._drawn, transient=passing)

    def __enter__(self) -> Progress:
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bars.stop()

    def say(self, text: str) -> None:
        """Write a line below the bars."""
        if self._visible:
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    @contextmanager
    def phase(self, title: str, total: float) -> Iterator[Callable[[float], None]]:
        """Show a bar; yield the function to call with how much of the total is done."""
        task = self._bars.add_task(title, total=total)
        started = said = time.monotonic()
        told = 0.0

        def on_done(done: float) -> None:
            nonlocal said, told
            self._bars.update(task, completed=done)
            now = time.monotonic()
            if not self._drawn and now - said >= _LINE_EVERY_S and done > told:
                # by what was done since the last line: a run that goes on finds the first part of its work done
                to_go_s = (now - said) * (total - done) / (done - told)
                said, told = now, done
                self.say(f"{title}: {done / total:.0%}, {to_go_s:.0f} s to go")

        yield on_done
        self._bars.update(task, completed=total)
        if not self._drawn and not self._passing:
            self.say(f"{title}: done in {time.monotonic() - started:.0f} s")
