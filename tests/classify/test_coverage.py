"""`--coverage`: a record is named where its prediction set holds one class alone."""

import json

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier
from bladewing.classify.cli import main
from bladewing.classify.labels import decide_by_sets
from bladewing.models.operating import OperatingCurve, OperatingPoint

from .conftest import noise

SETS = json.dumps([[0.8, 0.5, 0.4, 0.4], [0.9, 0.3, 0.1, 0.1], [0.99, 0.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def model(make_model, tmp_path_factory):
    """Always answers uav 0.8, bird 0.15, clutter 0.05."""
    path = tmp_path_factory.mktemp("models") / "sets.onnx"
    path.write_bytes(make_model(bias=np.log([0.8, 0.15, 0.05]), prediction_sets=SETS))
    return path


def answer(classifier: Classifier) -> tuple[str, str]:
    given = classifier.predict(noise(200), carrier_hz=10e9, prf_hz=20e3)
    return str(given.labels), str(given.reasons)


def test_one_class_alone_is_named_and_else_the_reason_names_the_set(model):
    p = np.array([[0.9, 0.05, 0.05], [0.5, 0.4, 0.1], [0.4, 0.3, 0.3], [0.3, 0.35, 0.35]])
    labels, reasons = decide_by_sets(p, (0.5, 0.4, 0.35), 0.8)
    assert labels.tolist() == ["uav", "unknown", "unknown", "clutter"]
    assert reasons == ["", "not sure: uav or bird at coverage 0.8", "not sure: no class is likely at coverage 0.8", ""]
    assert answer(Classifier.load(model, coverage=0.8)) == ("uav", "")
    assert answer(Classifier.load(model, coverage=0.9)) == ("unknown", "not sure: uav or bird at coverage 0.9")
    assert answer(Classifier.load(model, coverage=0.99))[1] == "not sure: uav or bird or clutter at coverage 0.99"
    assert answer(Classifier.load(model)) == ("uav", "")  # by the model's own thresholds


def test_with_a_false_alarm_rate_a_uav_must_keep_to_that_too(make_model, tmp_path, sigmf_pair, capsys):
    p = np.array([[0.9, 0.05, 0.05], [0.7, 0.2, 0.1], [0.36, 0.39, 0.25], [0.5, 0.45, 0.05], [0.2, 0.3, 0.5]])
    labels, reasons = decide_by_sets(p, (0.35, 0.4, 0.4), 0.8, 0.8)
    assert labels.tolist() == ["uav", "unknown", "unknown", "unknown", "clutter"]
    assert reasons[1] == "not sure: uav 0.70 < 0.80"
    assert reasons[3] == "not sure: uav or bird at coverage 0.8"
    # a rate counts what is most probable: a set that holds a less probable UAV alone is none of it
    labels, reasons = decide_by_sets(p, (0.35, 0.4, 0.4), 0.8, 1 / 3)
    assert labels.tolist() == ["uav", "uav", "unknown", "unknown", "clutter"]
    assert reasons[2] == "not sure: uav 0.36 < 0.39"
    curve = OperatingCurve(1000, 1000, (OperatingPoint(0.1, 0.7, 0.9), OperatingPoint(0.01, 0.85, 0.6))).to_json()
    path = tmp_path / "both.onnx"
    path.write_bytes(make_model(bias=np.log([0.8, 0.15, 0.05]), prediction_sets=SETS, operating_curve=curve))
    assert answer(Classifier.load(path, coverage=0.8, max_false_alarm=0.1)) == ("uav", "")
    assert answer(Classifier.load(path, coverage=0.8, max_false_alarm=0.01)) == ("unknown", "not sure: uav 0.80 < 0.85")
    wide = Classifier.load(path, coverage=0.9, max_false_alarm=0.1)
    assert answer(wide) == ("unknown", "not sure: uav or bird at coverage 0.9")
    rules = ["--coverage", "0.8", "--max-false-alarm", "0.01"]
    assert main(["predict", str(sigmf_pair()), "--model", str(path), *rules]) == 0
    said = capsys.readouterr()
    assert "not sure: uav 0.80 < 0.85" in said.out
    assert "at most 0.01 of birds and clutter are named uav, and at most 0.600 of UAVs" in said.err


def test_a_coverage_that_cannot_be_kept_is_refused(model, uav_model, make_model):
    with pytest.raises(BadInput, match=r"0\.7 is not among those that it holds: 0\.8, 0\.9, 0\.99: ask for one"):
        Classifier.load(model, coverage=0.7)
    with pytest.raises(BadInput, match=r"holds no prediction sets, .*: train it again"):
        Classifier.load(uav_model, coverage=0.9)
    for wrong in ("0.9", True, np.nan, -0.9):
        for rule in ("coverage", "max_false_alarm"):
            with pytest.raises(BadInput, match=rf"^{rule} is .*: it must be"):
                Classifier.load(model, **{rule: wrong})
    for damaged in ("3", "[[0.9]]", '[["x", 1, 1, 1]]', "[[0.9, 1, 1, NaN]]", "{", "[[]]"):
        with pytest.raises(BadInput, match="damaged prediction sets"):
            Classifier(make_model(prediction_sets=damaged), coverage=0.9)


def test_dwells_and_track_follow_the_rule(model, uav_model, sigmf_pair, capsys):
    recording = str(sigmf_pair())
    assert main(["predict", recording, "--model", str(model), "--coverage", "0.99", "--json"]) == 0
    *dwells, closing = map(json.loads, capsys.readouterr().out.splitlines())
    assert {dwell["reason"] for dwell in dwells} == {"not sure: uav or bird or clutter at coverage 0.99"}
    assert (closing["track"]["label"], closing["track"]["declared"]) == ("unknown", None)
    assert main(["predict", recording, "--model", str(uav_model), "--coverage", "0.9"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
