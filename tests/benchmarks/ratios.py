"""Costs as ratios within one run: candidates take turns; a cost is the median process CPU time over the rounds."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median

#: Folder that the tables are written to.
FOLDER = Path("build") / "bench"

#: Lines of all tables, printed at the end of the run.
PRINTED: list[str] = []


def cpu_seconds(candidates: Mapping[str, Callable[[], object]], *, rounds: int = 9) -> dict[str, float]:
    """Measure the median CPU time of one call of each candidate [s]; the first round warms up and does not count."""
    spent: dict[str, list[float]] = {name: [] for name in candidates}
    for number in range(rounds + 1):
        for name, call in candidates.items():
            start = time.process_time()
            call()
            if number:
                spent[name].append(time.process_time() - start)
    return {name: median(values) for name, values in spent.items()}


def repeated(call: Callable[[], object], times: int) -> Callable[[], None]:
    """Make a function that calls `call` a number of times: one call alone may be too short for the clock."""

    def calls() -> None:
        for _ in range(times):
            call()

    return calls


def table(title: str, head: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Write a table to `FOLDER` as Markdown and keep it for the end of the run."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]

    def line(cells: tuple[str, ...]) -> str:
        return "| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)) + " |"

    lines = [f"# {title}", "", line(head), line(tuple("-" * width for width in widths)), *map(line, rows), ""]
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{title.split(':')[0].lower().replace(' ', '_')}.md").write_text("\n".join(lines))
    PRINTED.extend(lines)
