"""What model inputs and whole answers cost, in units of one FFT of the dwell, the least that a spectrum costs."""

from collections.abc import Callable
from functools import partial

import numpy as np
import onnxruntime
import pytest
from bladewing.classify import Classifier
from bladewing.classify.export import export_raw_iq
from bladewing.classify.labels import CLASSES, UNKNOWN
from bladewing.classify.model_file import model_names
from bladewing.features import model_inputs
from bladewing.simulate import Radar, draw_records
from scipy import fft

from .ratios import cpu_seconds, repeated, table

RADAR = Radar(9.85e9, 25e3, 2048)
AXES = {"carrier_hz": RADAR.carrier_hz, "prf_hz": RADAR.prf_hz}
INPUTS = {
    "features and spectrum": ("features", "spectrum"),
    "features": ("features",),
    "spectrum": ("spectrum",),
    "joint features": ("joint_features",),
    "image": ("image",),
}
#: Batch size to the largest cost of an answer of the cheapest model [FFTs]; a goal in the table, not tested.
GOALS = {1: 20, 64: 15}


def costs(iq, candidates: dict[str, Callable[[], object]], title: str) -> None:
    """Write a table of the candidates' cost per record over that of one complex64 FFT of the record."""
    records = len(iq)
    repeats = 200 // records + 1
    timed = {name: repeated(call, repeats) for name, call in candidates.items()}
    spent = cpu_seconds({"one FFT": repeated(lambda: fft.fft(iq), 10 * repeats), **timed})
    each = {name: seconds / repeats / records for name, seconds in spent.items()}
    each["one FFT"] /= 10
    rows = [(name, f"{cost / each['one FFT']:.1f}", f"{cost * 1e6:.0f}") for name, cost in each.items()]
    table(title, ("", "x FFT", "us a record"), rows)


@pytest.mark.parametrize("records", [1, 64])
def test_model_inputs_against_one_fft(records):
    iq = draw_records(RADAR, records, 0, purpose="bench").iq
    candidates = {title: partial(model_inputs, iq, **AXES, names=names) for title, names in INPUTS.items()}
    together = model_inputs(iq, **AXES, names={name for names in INPUTS.values() for name in names})
    for made in candidates.values():  # inputs made alone must equal those made together
        for name, rows in made().items():
            np.testing.assert_array_equal(rows, together[name])
    costs(iq, candidates, f"Features of {records}: batches of {records} x 2048 pulses")


@pytest.mark.parametrize("records", [1, 64])
def test_answers_against_one_fft(records, tmp_path):
    iq = draw_records(RADAR, records, 0, purpose="bench").iq
    packed = {"iq": iq.view(np.float32).reshape(*iq.shape, 2)}
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    candidates = {}
    for name in model_names():
        candidates[name] = predict = partial(Classifier.load(name).predict, iq, **AXES)
        graph = tmp_path / f"{name}.onnx"
        export_raw_iq(graph, **AXES, pulses=RADAR.pulses, model=name)
        exported = onnxruntime.InferenceSession(graph, options)
        candidates[f"{name}, exported"] = run = partial(exported.run, ["probabilities", "label"], packed)
        answer, (probabilities, label) = predict(), run()
        np.testing.assert_allclose(probabilities, answer.probabilities, atol=0.002)
        assert np.array([*CLASSES, UNKNOWN])[label].tolist() == answer.labels.tolist()
    goal = f"IQ to probabilities, goal of the cheapest {GOALS[records]} x"
    costs(iq, candidates, f"Answers of {records}: batches of {records} x 2048 pulses, {goal}")
