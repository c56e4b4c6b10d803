"""The whole report on few records with tiny models, and what is drawn from it."""

import copy
import json
import math
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier
from bladewing.classify.report import cost, run, scores
from bladewing.classify.report.page import draw_page
from bladewing.classify.stability.cell import Cell
from bladewing.classify.timing import Laps
from bladewing.features.schema import INPUT_SHAPES

from .conftest import interrupt


def test_report_holds_the_data_of_every_figure(report: dict[str, Any]) -> None:
    assert set(report) == {
        *("schema_version", "made", "machine", "classes", "records", "models", "scores", "reference", "cost"),
        *("trade", "front", "fft_against_stft", "time_law", "storage", "examples", "stft_pictures", "tables"),
        *("training", "config", "families"),
    }
    assert [model["name"] for model in report["models"]] == ["spectrum-cnn-wide", "always-uav", "cascade"]
    first, second, both = report["models"]
    assert both["bytes"] == first["bytes"] + second["bytes"]
    assert (both["sha256"], both["inputs"]) == (None, first["inputs"])
    for found in report["scores"].values():
        assert set(found) == {
            *("refused", "accuracy", "design_effect", "balanced_accuracy", "recall", "confusion", "uav_at_pfa"),
            *("false_uav", "false_per_hour", "reliability", "by_snr", "by_dwell", "by_beta", "by_kind", "acceptance"),
        }
    for part in report["cost"]["batches"]:
        assert {(row["stage"], row["name"]) for row in part["stages"]} == {
            *(("fft", "fft"), ("input", "features")),
            *((stage, name) for stage in ("model", "chain") for name in ("spectrum-cnn-wide", "always-uav")),
            ("chain", "cascade"),
        }
        assert all(row["ratio_to_fft"] > 0 for row in part["stages"])
        assert part["stages"][0]["ratio_to_fft"] == 1.0
    for row in report["families"]["families"]:
        assert 0 < row["records"] < report["families"]["test_records"] == 600
        for said in (row["kept"], row["left_out"]):
            assert said["unknown"]["count"] == said["wrong"]["count"] == row["records"]
            assert 0 <= said["unknown"]["value"] + said["wrong"]["value"] <= 1
    assert [part["pulses"] for part in report["fft_against_stft"]] == [2000, 10_000]
    assert [one["class"] for one in report["examples"]] == report["classes"]
    assert {"cpu", "cores", "python", "packages"} <= set(report["machine"])
    assert {"date", "command", "seed", "quick"} <= set(report["made"])


def test_weights_are_those_of_the_schema(report: dict[str, Any]) -> None:
    weights = {row["form"]: row for row in report["storage"]}
    assert weights["raw IQ"]["bytes"] == 8 * report["reference"]["pulses"]
    for name, shape in INPUT_SHAPES.items():
        assert weights[name]["bytes"] == 4 * math.prod(shape)
        assert weights[name]["bytes_per_million"] == 4_000_000 * math.prod(shape)


def test_a_model_that_always_says_uav_is_scored_as_such(report: dict[str, Any]) -> None:
    found = report["scores"]["always-uav"]
    assert found["accuracy"]["right"] == report["records"]["by_class"]["uav"] == 40
    assert found["false_uav"]["best"]["value"] == 1.0
    assert found["balanced_accuracy"]["value"] == pytest.approx(1 / 3)
    assert found["uav_at_pfa"]["detection"]["value"] == 0.0  # all scores are equal: no threshold parts them
    assert found["reliability"]["ece"] == pytest.approx(0.8 - 1 / 3, abs=1e-6)
    assert found["acceptance"]["coverage"]["value"] == 1.0


def test_page_is_drawn_from_the_stored_json_alone_to_the_same_bytes(report_folder: Path) -> None:
    redraw = (
        "import json, sys; from bladewing.classify.report.page import draw_page; "
        "sys.stdout.buffer.write(draw_page(json.load(open(sys.argv[1], encoding='utf-8'))).encode())"
    )
    # the stored page was drawn by a process of another hash seed: a random one, or that of the test run
    hash_seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    drawn = subprocess.run(
        [sys.executable, "-c", redraw, str(report_folder / "report.json")],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        capture_output=True,
        check=True,
    )
    assert drawn.stdout == (report_folder / "report.html").read_bytes()


class Reader(HTMLParser):
    """Collects what a page must not have: requests, repeated ids, tags left open."""

    VOID = frozenset({"meta", "link", "br", "img", "input", "hr"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.unlabelled = 0
        self.pictures = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self.note(tag, dict(attrs))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.note(tag, dict(attrs))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def note(self, tag: str, attrs: dict[str, str | None]) -> None:
        self.ids += [value for key, value in attrs.items() if key == "id" and value]
        self.links += [value for key, value in attrs.items() if key in ("src", "href", "xlink:href") and value]
        if tag == "svg":
            self.pictures += 1
            self.unlabelled += not (attrs.get("aria-label") or attrs.get("aria-hidden"))


def read(page: str) -> Reader:
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def test_page_is_whole_asks_for_nothing_and_names_its_pictures(report_folder: Path) -> None:
    page = (report_folder / "report.html").read_text(encoding="utf-8")
    reader = read(page)
    assert all(link.startswith(("#", "data:")) for link in reader.links)
    assert "@import" not in page
    assert re.search(r"url\((?!#)", page) is None
    assert len(reader.ids) == len(set(reader.ids))
    assert {link[1:] for link in reader.links if link.startswith("#")} <= set(reader.ids)
    assert reader.pictures > 15
    assert reader.unlabelled == 0
    assert not re.search(
        r"\bnan\b|\bNone\b", re.sub(r"<style>.*?</style>|<script>.*?</script>", "", page, flags=re.DOTALL)
    )


def test_page_copes_with_one_model_without_answers(report: dict[str, Any]) -> None:
    lean = copy.deepcopy(report)
    name = "features-linear"
    lean["models"] = [{**lean["models"][0], "name": name}]
    truth = scores.Truth(
        classes=("uav", "bird", "clutter"),
        label=np.arange(120) % 3,
        kind=np.array(["quadcopter", "flock", "rain"] * 40),
        snr_db=np.full(120, np.nan),
        dwell_s=np.full(120, 0.08),
        radar=np.zeros(120, int),
        beta_rad=np.full(120, np.nan),
    )
    refused = scores.Answers(np.full((120, 3), 1 / 3), np.full(120, scores.DECLINED), np.zeros(120, bool))
    lean["scores"] = {name: scores.score(truth, refused)}
    lean["records"] = scores.describe_records(truth)
    for part in lean["cost"]["batches"]:
        part["stages"] = [row for row in part["stages"] if row["stage"] in ("fft", "input")]
    for part in lean["trade"]:
        budgets = [
            {**b, "model": None, "cost_us": None, "balanced_accuracy": None, "cheapest": None} for b in part["budgets"]
        ]
        part.update(points=[], budgets=budgets)
    page = draw_page(lean)
    read(page)
    assert "120 records were refused" in page


def test_page_of_another_schema_is_refused(report: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match="schema_version is '0'"):
        draw_page({**report, "schema_version": "0"})


@pytest.mark.parametrize("where", ["scores.score", "draw_page", "write_together"])
def test_interrupted_run_leaves_the_old_files_whole(
    where: str,
    report_folder: Path,
    tiny_models: Path,
    tiny_settings: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    old = {name: (report_folder / name).read_bytes() for name in ("report.json", "report.html", "model-card.md")}
    for name, content in old.items():
        (tmp_path / name).write_bytes(content)
    body = json.loads(old["report.json"])
    if where != "scores.score":
        monkeypatch.setattr(run, "measured_report", lambda *_, **__: body)
    monkeypatch.setattr(f"bladewing.classify.report.run.{where}", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run.run_report(tmp_path, models=tiny_models, quick=True, seed=1, config=tiny_settings, progress=False)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == old


def test_an_interrupted_run_goes_on_where_it_stopped(
    report: dict[str, Any],
    tiny_models: Path,
    tiny_settings: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def again(*_: object, **__: object) -> None:
        raise AssertionError("what was measured is measured again")

    call = {"models": tiny_models, "quick": True, "config": tiny_settings, "progress": False}
    with monkeypatch.context() as patch:
        patch.setattr("bladewing.classify.report.run.cost.time_chain", interrupt)
        with pytest.raises(KeyboardInterrupt):
            run.run_report(tmp_path, **call)
    monkeypatch.setattr("bladewing.classify.report.run.evaluate.ask", again)
    # of what comes after, only that it is reached
    monkeypatch.setattr("bladewing.classify.report.run.cost.time_chain", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run.run_report(tmp_path, **call)
    (kept,) = (tmp_path / "report-parts").glob("*/scores.json")
    # here no train.json tells of a cascade
    assert json.loads(kept.read_text())["scores"] == {
        name: found for name, found in report["scores"].items() if name != "cascade"
    }


def test_no_models_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"holds no \.onnx file: run `bladewing train"):
        run.run_report(tmp_path, models=tmp_path, quick=True, progress=False)
    with pytest.raises(BadInput, match="not a folder"):
        run.run_report(tmp_path, models=tmp_path / "missing", quick=True, progress=False)
    with pytest.raises(BadInput, match="seed is -1"):
        run.run_report(tmp_path, models=None, quick=True, seed=-1, progress=False)


@pytest.mark.parametrize("name", ["features", "herm", "cascade"])
def test_a_model_of_a_name_that_the_report_needs_is_refused(tiny_models: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.onnx").write_bytes((tiny_models / "spectrum-cnn-wide.onnx").read_bytes())
    with pytest.raises(BadInput, match=rf"{name}\.onnx has the name of what the report makes itself: rename the file"):
        run.run_report(tmp_path / "out", models=tmp_path, quick=True, progress=False)


@pytest.mark.parametrize("text", ["[]", "3", "{}", '{"settings": {}}', '{"cascade": 3}', "{"])
def test_a_train_json_of_something_else_is_told_before_anything_is_measured(
    tiny_models: Path, tmp_path: Path, text: str
) -> None:
    (tmp_path / "spectrum-cnn-wide.onnx").write_bytes((tiny_models / "spectrum-cnn-wide.onnx").read_bytes())
    (tmp_path / "train.json").write_text(text)
    with pytest.raises(BadInput, match=r"train\.json: not .*: remove it or train again"):
        run.run_report(tmp_path / "out", models=tmp_path, quick=True, progress=False)


def test_a_train_json_that_never_ends_is_told_too(tiny_models: Path, tmp_path: Path) -> None:
    (tmp_path / "spectrum-cnn-wide.onnx").write_bytes((tiny_models / "spectrum-cnn-wide.onnx").read_bytes())
    os.mkfifo(tmp_path / "train.json")
    with pytest.raises(BadInput, match=r"train\.json: not JSON: it is no regular file: remove it or train again"):
        run.run_report(tmp_path / "out", models=tmp_path, quick=True, progress=False)


def test_what_was_measured_is_kept_for_the_same_run_on_the_same_machine_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = run.report_config(None, seed=1, quick=True)
    account = {"cascade": {"stages": ["a", "b"]}}
    one = run._of(settings, {"a": b"x"}, account)
    assert one == run._of(settings, {"a": b"x"}, account)
    assert one != run._of(settings, {"a": b"x"}, {"cascade": {"stages": ["b", "a"]}})
    assert one != run._of(settings, {"a": b"x"}, None)
    assert one != run._of(run.report_config(None, seed=2, quick=True), {"a": b"x"}, account)
    for models in ({"a": b"y"}, {"b": b"x"}):
        assert one != run._of(settings, models, account)
    for digest in ("simulator_digest", "inputs_digest", "schema_hash"):
        with monkeypatch.context() as patch:
            patch.setattr(run, digest, lambda: "0" * 64)
            assert one != run._of(settings, {"a": b"x"}, account), digest
    machine = run.describe_machine()
    for change, same in (({"load": 99.0}, True), ({"cpu": "another"}, False), ({"packages": {}}, False)):
        monkeypatch.setattr(run, "describe_machine", lambda change=change: machine | change)
        assert (one == run._of(settings, {"a": b"x"}, account)) == same, change


def test_a_chain_whose_records_do_not_all_cost_the_same_costs_their_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    def timed(works: dict[tuple[str, str], Any], **_: object) -> dict[tuple[str, str], Laps]:
        laps = [3e-4 if number % 4 == 3 else 1e-4 for number in range(64)]  # one in four asks the second model as well
        return {name: Laps(laps if name[0] == "chain" else [1e-5] * 64, [1e-3] * 64) for name in works}

    monkeypatch.setattr(cost, "time_in_turns", timed)
    classifier = Classifier.load("fast")
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3}
    noise = np.random.default_rng(0).standard_normal((64, 256), np.float32).view(np.complex64)
    found = cost.time_chain({}, {"fast": classifier}, noise, **radar, seconds=1.0, least_rounds=1)
    (chain,) = (row for row in found[0]["stages"] if row["stage"] == "chain")
    assert chain["median_us"] == pytest.approx(150)
    assert chain["ratio_to_fft"] == pytest.approx(15)


def test_a_foreign_model_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    (tmp_path / "foreign.onnx").write_bytes(b"not a model")
    with pytest.raises(BadInput, match="foreign"):
        run.run_report(tmp_path / "out", models=tmp_path, quick=True, progress=False)


def test_page_shows_a_stability_table_that_lies_beside_it(report: dict[str, Any], report_folder: Path) -> None:
    cell = Cell("comb", "SNR", "200 dB", 0.05, "error [Hz]", 0.1, "the <guard>")
    row = {**cell.as_dict(), "shown": "0.05", "cells": 3, "held": 3}
    page = draw_page({**report, "stability": [row]})
    assert "the &lt;guard&gt;" in page
    assert "3 of 3 cells hold" in page
    assert "At the extremes" in page
    assert "At the extremes" not in (report_folder / "report.html").read_text(encoding="utf-8")
