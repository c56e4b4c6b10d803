"""`--max-false-alarm`: the threshold on "uav" comes from the model's operating curve."""

import json

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier
from bladewing.classify.cli import main
from bladewing.models.operating import OperatingCurve, OperatingPoint

from .conftest import noise

CURVE = OperatingCurve(500, 2000, (OperatingPoint(0.1, 0.5, 0.9), OperatingPoint(0.01, 0.85, 0.4)))


@pytest.fixture(scope="module")
def model(make_model, tmp_path_factory):
    """Always answers uav 0.8, and names it from 0.6 on."""
    path = tmp_path_factory.mktemp("models") / "curve.onnx"
    path.write_bytes(make_model(bias=np.log([0.8, 0.15, 0.05]), operating_curve=CURVE.to_json()))
    return path


def label(classifier: Classifier) -> str:
    return str(classifier.predict(noise(200), carrier_hz=10e9, prf_hz=20e3).labels)


def test_the_rate_sets_the_threshold_on_uav_and_no_other(model):
    given, strict, loose = (Classifier.load(model, max_false_alarm=rate) for rate in (None, 0.01, 0.1))
    assert [label(one) for one in (given, strict, loose)] == ["uav", "unknown", "uav"]
    assert [one.accept for one in (given, strict, loose)] == [(x, 0.6, 0.6) for x in (0.6, 0.85, 0.5)]
    assert given.operating_point is None
    assert strict.operating_point == CURVE.points[1]


def test_rates_that_cannot_be_kept_are_refused(model, uav_model):
    with pytest.raises(BadInput, match=r"0\.001 cannot be supported by 2000 calibration records"):
        Classifier.load(model, max_false_alarm=0.001)
    with pytest.raises(BadInput, match="above 0 and below 1"):
        Classifier.load(model, max_false_alarm=2)
    with pytest.raises(BadInput, match=r"holds no operating curve, .*: train it again"):
        Classifier.load(uav_model, max_false_alarm=0.1)


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "[" * 200_000,
        '{"uavs": 1e999, "others": 2000, "points": [[0.1, 0.5, 0.9]]}',
        '{"uavs": 500, "others": 2000, "points": [[0.1, NaN, 0.9]]}',
        '{"uavs": 500, "others": 2000, "points": [[-0.1, 0.5, 0.9]]}',
        '{"uavs": 500, "others": 2000, "points": [[0.1, 0.5, 0.9], [0.2, 0.4, 0.95]]}',
        '{"uavs": 500, "others": 2000, "points": [[0.1, 0.5]]}',
    ],
    ids=lambda text: text[:60],
)
def test_a_damaged_curve_is_refused(make_model, text):
    with pytest.raises(BadInput, match="the operating curve is damaged"):
        Classifier(make_model(operating_curve=text), max_false_alarm=0.1)


def test_predict_states_what_remains(model, sigmf_pair, capsys):
    recording = str(sigmf_pair())
    assert main(["predict", recording, "--model", str(model), "--max-false-alarm", "0.02", "--json"]) == 0
    said = capsys.readouterr()
    assert "uav from 0.8500 on: at most 0.01 of birds and clutter are named uav, and 0.400 of UAVs" in said.err
    assert {json.loads(line).get("label", "unknown") for line in said.out.splitlines()} == {"unknown"}
    assert main(["predict", recording, "--model", str(model), "--max-false-alarm", "1e-9"]) == 2
    assert "cannot be supported" in capsys.readouterr().err
