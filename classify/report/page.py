"""Drawing the page from the content of ``report.json``, and from nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from ..errors import BadInput
from . import draw_cost, draw_examples, draw_front, draw_scores, scores, summary, words
from .examples import EXAMPLE_WINDOW
from .series import EIGHT_BITS, Look, choice_looks, looks

SCHEMA_VERSION = "4"

# Marker outlines on a 14 x 14 field, in the order of `svg.MARKERS`.
_OUTLINES = (
    '<circle cx="7" cy="7" r="4.5"/>',
    '<rect x="2.8" y="2.8" width="8.4" height="8.4"/>',
    '<path d="M7 1.4 12.6 7 7 12.6 1.4 7z"/>',
    '<path d="M7 2 12.3 11.6H1.7z"/>',
    '<path d="M7 12 1.7 2.4h10.6z"/>',
    '<path d="M5 1.5h4V5h3.5v4H9v3.5H5V9H1.5V5H5z"/>',
    '<path d="M4.2 1.5 7 4.3l2.8-2.8 2.7 2.7L9.7 7l2.8 2.8-2.7 2.7L7 9.7l-2.8 2.8-2.7-2.7L4.3 7 1.5 4.2z"/>',
    '<path d="M7 1l1.7 4h4.2L9.5 7.6 10.8 12 7 9.4 3.2 12l1.3-4.4L1.1 5h4.2z"/>',
    '<path d="M2 7 11.6 1.7v10.6z"/>',
    '<path d="M12 7 2.4 1.7v10.6z"/>',
)


def draw_page(report: Mapping[str, Any]) -> str:
    """Draw the page.

    Parameters
    ----------
    report : mapping
        The content of ``report.json``, as read.

    Returns
    -------
    str
        One self-contained HTML document; equal content gives equal bytes.

    Raises
    ------
    BadInput
        If the report has another schema version.
    """
    version = report.get("schema_version")
    if version != SCHEMA_VERSION:
        raise BadInput(f"report.json: schema_version is {version!r}, must be {SCHEMA_VERSION!r}: make the report again")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {
        "percent": words.percent,
        "limits": words.limits,
        "number": words.number,
        "count": words.count,
        "micros": words.micros,
        "size": words.size,
        "spoken": words.spoken,
        "batch_words": words.batch_words,
        "millis": words.millis,
        "large": words.large,
    }
    rows = report["front"]["choices"]
    drawn = choice_looks(rows)
    names = [model["name"] for model in report["models"]]
    template = environment.from_string(_read("page.html.j2"))
    return template.render(
        report=report,
        snr_range_db=scores.SNR_RANGE_DB,
        css=Markup(_read("page.css")),
        js=Markup(_read("page.js")),
        legend=_legend(looks(names)),
        least_records=draw_scores.LEAST_SHOWN,
        choice_legend=_legend(
            {row["name"] if row["kind"] == "model" else row["words"]: drawn[row["name"], row["kind"]] for row in rows}
        ),
        best_points=[draw_front.best_points(report, place) for place in range(len(report["cost"]["batches"]))],
        front_budgets=summary.front_budgets(report),
        headline=summary.headline_model(report),
        sentences=summary.sentences(report),
        budget_sentence=summary.budget_sentence,
        tried=EIGHT_BITS if (EIGHT_BITS, "model") in drawn else "",
        stage_name=draw_cost.stage_name,
        example_window=EXAMPLE_WINDOW,
        clipped_db=draw_examples.CLIPPED_DB,
        figures={
            "snr": draw_scores.accuracy_by_snr(report),
            "dwell": draw_scores.accuracy_by_dwell(report),
            "reliability": draw_scores.reliability(report),
            "kinds": draw_scores.called_uav(report),
            "families": draw_scores.families(report),
            "choices": draw_front.time_front(report),
            "dwells": draw_front.by_dwell(report),
            "bound": draw_front.by_snr(report),
            "stored": draw_front.stored(report),
            "beta": draw_scores.accuracy_by_beta(report),
            "law": draw_cost.time_law(report),
            "stfts": draw_examples.stft_pictures(report),
            "front": draw_cost.front(report),
            "stages": draw_cost.stages(report),
            "stft": draw_cost.fft_against_stft(report),
            "storage": draw_cost.storage(report),
            "examples": draw_examples.examples(report),
        },
    )


def _legend(named: Mapping[str, Look]) -> list[tuple[str, int, Markup]]:
    """Give name, colour number and marker outline of each entry."""
    return [(name, look.number, Markup(_OUTLINES[look.outline])) for name, look in named.items()]


def _read(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
