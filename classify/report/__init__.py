"""The report: what the models get right, what an answer costs, what a record weighs, drawn as one page.

Everything heavy is imported when a report is made.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

__all__ = ["run_report"]


def run_report(out: Path, *, models: Path | None, quick: bool, seed: int = 0, progress: bool = True) -> dict[str, Any]:
    """Measure models and write ``report.json`` and ``report.html``; see `bladewing.classify.report.run.run_report`."""
    from .run import run_report as run

    return run(out, models=models, quick=quick, seed=seed, progress=progress)
