"""Put the figures of docs/report.json into README.md and docs/model-card.md: python docs/figures.py.

README.md holds them between ``<!-- report: NAME -->`` and ``<!-- end -->``. docs/report.json is that of the last full
``bladewing report``, copied here.
"""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bladewing.classify.report.card import budgets, costs, expectations, model_card

DOCS = Path(__file__).parent
README, CARD, REPORT = DOCS.parent / "README.md", DOCS / "model-card.md", DOCS / "report.json"
BLOCKS: dict[str, Callable[[Mapping[str, Any]], str]] = {"expect": expectations, "budgets": budgets, "costs": costs}


def filled(text: str, report: Mapping[str, Any]) -> str:
    """Fill every block of a text with what the report says now."""

    def block(found: re.Match[str]) -> str:
        return f"<!-- report: {found[1]} -->\n{BLOCKS[found[1]](report)}\n<!-- end -->"

    return re.sub(r"<!-- report: (\w+) -->\n.*?<!-- end -->", block, text, flags=re.DOTALL)


def main() -> None:
    """Rewrite both files."""
    report = json.loads(REPORT.read_text(encoding="utf-8"))
    README.write_text(filled(README.read_text(encoding="utf-8"), report), encoding="utf-8")
    CARD.write_text(model_card(report), encoding="utf-8")


if __name__ == "__main__":
    main()
