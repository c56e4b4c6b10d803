"""Tables on the terminal, none of whose numbers is ever cut and no line of which ends in spaces."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


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
