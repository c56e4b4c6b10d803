"""The README's figures and the model card are those of the committed report."""

import copy
import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from bladewing.classify.report.card import model_card
from bladewing.classify.report.draw_scores import GROUPS, LEAST_SHOWN, accuracy_by_snr
from bladewing.classify.report.words import spoken
from bladewing.simulate.dataset import KIND_CLASS

ROOT = Path(__file__).parents[2]
CURE = "run: python docs/figures.py"


@pytest.fixture(scope="module")
def figures() -> ModuleType:
    spec = importlib.util.spec_from_file_location("figures", ROOT / "docs" / "figures.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def report(figures: ModuleType) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(figures.REPORT.read_text(encoding="utf-8"))
    return found


def test_readme_says_what_the_committed_report_says(figures: ModuleType, report: dict[str, Any]) -> None:
    text = figures.README.read_text(encoding="utf-8")
    for name in figures.BLOCKS:
        assert text.count(f"<!-- report: {name} -->") == 1
    assert figures.filled(text, report) == text, CURE


def test_model_card_is_that_of_the_committed_report(figures: ModuleType, report: dict[str, Any]) -> None:
    assert figures.CARD.read_text(encoding="utf-8") == model_card(report), CURE


def test_the_card_names_every_kind_that_is_trained_on(report: dict[str, Any]) -> None:
    """Not those that happen to be among the records of a small report."""
    few = copy.deepcopy(report)
    for scores in few["scores"].values():
        scores["by_kind"] = scores["by_kind"][:3]
    (line,) = (line for line in model_card(few).splitlines() if " Kinds: " in line)
    assert all(spoken(kind) in line for kind in KIND_CLASS)


def test_the_envelope_stands_on_the_card_in_words_and_units(report: dict[str, Any]) -> None:
    lines = model_card(report).split("## Envelope")[1].split("##")[0].splitlines()
    assert [line for line in lines if line.startswith("- ")] == [
        "- carrier: 2 to 100 GHz",
        "- PRF: 1 to 100 kHz",
        "- pulses of a dwell: 64 to 65\u202f536",
        "- dwell: 5 ms to 5 s",
        "- unambiguous velocity, wavelength × PRF / 4: 10 m/s or more",
    ]


def test_a_changed_figure_is_a_changed_text(figures: ModuleType, report: dict[str, Any]) -> None:
    text = figures.README.read_text(encoding="utf-8")
    other = json.loads(json.dumps(report))
    other["scores"]["spectrum-cnn-wide"]["balanced_accuracy"]["value"] += 0.01
    assert figures.filled(text, other) != text
    assert model_card(other) != model_card(report)
    slower = copy.deepcopy(report)
    next(row for row in slower["cost"]["batches"][-1]["stages"] if row["stage"] == "chain")["ratio_to_fft"] *= 2
    assert figures.filled(text, slower) != text


def test_committed_report_is_of_the_shipped_models(report: dict[str, Any]) -> None:
    import hashlib

    shipped = {path.stem: path.read_bytes() for path in (ROOT / "models" / "pretrained").glob("*.onnx")}
    said = {model["name"]: model["sha256"] for model in report["models"] if model["sha256"] is not None}
    assert said == {name: hashlib.sha256(content).hexdigest() for name, content in shipped.items()}


def test_a_step_of_few_records_breaks_the_lines_of_its_class_alone(report: dict[str, Any]) -> None:
    changed = copy.deepcopy(report)
    for scores in changed["scores"].values():
        scores["by_snr"][5]["uav"]["count"] = LEAST_SHOWN - 1

    def drawn(told: dict[str, Any]) -> list[str]:
        return [panel.svg for panel in accuracy_by_snr(told)]

    whole, broken = drawn(report), drawn(changed)
    assert [one == other for one, other in zip(whole, broken, strict=True)] == [group != "uav" for group in GROUPS]
    begun = [len(re.findall(r"\bM -?\d", svgs[GROUPS.index("uav")])) for svgs in (whole, broken)]
    assert begun[1] >= begun[0] + len(report["models"])  # each line begins once more


def test_the_card_sends_who_asks_for_measured_recordings_to_where_they_stand(report: dict[str, Any]) -> None:
    assert "No measured record is scored in this report" in model_card(report)
    assert "**On measured recordings**" in (ROOT / "docs" / "expect.md").read_text(encoding="utf-8")
    assert "docs/expect.md" in model_card(report)
