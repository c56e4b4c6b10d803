"""Printing of answers and tables: no number in them is ever cut, no line ends in spaces."""

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text


_LONGEST_LINE = 10_000

#: Least width of a column of words, such as a reason [characters]: where less is left for it, lines are printed
#: unwrapped and the terminal breaks them.
_LEAST_WORDS = 20


def console() -> "Console":
    """The console on which answers are printed: as wide as the terminal, in a pipe or a file unbounded."""
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    unbounded = columns.strip("0") == "" if columns else not sys.stdout.isatty()  # COLUMNS=0 is no width
    return Console(highlight=False, width=_LONGEST_LINE if unbounded else None)


def counted(dwells: int) -> str:
    """A number of dwells in words."""
    return f"{dwells} dwell{'s' * (dwells != 1)}"


def print_words(console: "Console", words: "Text") -> None:
    """Print a sentence, wrapped between its words where the terminal is narrow."""
    for line in words.wrap(console, console.width):
        line.rstrip()
        console.print(line, soft_wrap=True)


def print_table(console: "Console", table: "Table") -> None:
    """Print a table; for a terminal too narrow the gaps are made narrow, then the lines unwrapped (it breaks them).

    Too narrow is one that cannot hold the columns that must not be wrapped and `_LEAST_WORDS` of each other column.
    """
    from rich.cells import cell_len
    from rich.text import Text

    def least() -> int:
        return table.__rich_measure__(console, console.options.update(max_width=_LONGEST_LINE)).minimum

    longest = [max(cell_len(str(cell)) for cell in (column.header, *column.cells)) for column in table.columns]
    for column, cells in zip(table.columns, longest, strict=True):
        column.min_width = cells if column.no_wrap else min(cells, _LEAST_WORDS)
    table.collapse_padding = least() > console.width
    if least() > console.width:
        for column, cells in zip(table.columns, longest, strict=True):
            column.no_wrap, column.min_width = True, cells
    width = max(console.width, least())
    for line in console.render_lines(table, console.options.update(width=width), pad=False):
        words = Text.assemble(*((part.text, part.style or "") for part in line))
        words.rstrip()
        console.print(words, soft_wrap=True)
