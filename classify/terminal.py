"""Where answers are printed, and tables there: none of their numbers is ever cut, no line of theirs ends in spaces."""

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


_LONGEST_LINE = 10_000


def console() -> "Console":
    """Where answers are printed: as wide as the terminal, and in a pipe or a file as wide as a line is."""
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    unbounded = columns.strip("0") == "" if columns else not sys.stdout.isatty()  # no terminal has no columns
    return Console(highlight=False, width=_LONGEST_LINE if unbounded else None)


def counted(dwells: int) -> str:
    """A number of dwells in words."""
    return f"{dwells} dwell{'s' * (dwells != 1)}"


def print_table(console: "Console", table: "Table") -> None:
    """Print a table; a terminal too narrow for what must not be wrapped gets narrow gaps, then wraps the lines."""
    from rich.cells import cell_len
    from rich.text import Text

    for column in table.columns:
        if column.no_wrap:
            column.min_width = max(cell_len(str(cell)) for cell in (column.header, *column.cells))
    endless = console.options.update(max_width=1000)
    table.collapse_padding = table.__rich_measure__(console, endless).minimum > console.width
    console.width = max(console.width, table.__rich_measure__(console, endless).minimum)
    for line in console.render_lines(table, pad=False):
        words = Text.assemble(*((part.text, part.style or "") for part in line))
        words.rstrip()
        console.print(words, soft_wrap=True)
