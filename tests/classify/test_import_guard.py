"""Inference stays light: what a fresh interpreter has loaded after the first answer."""

import json
import subprocess
import sys
from importlib.resources import files

import pytest
from bladewing import classify

HEAVY = [
    "torch", "sklearn", "onnx", "skl2onnx", "onnxscript", "scipy.signal", "scipy.stats", "scipy.io", "scipy.optimize",
    "scipy.ndimage", "matplotlib", "sigmf", "pydantic", "typer", "rich", "jinja2",
]  # fmt: skip

PREDICT = """
import json, sys
import numpy as np
from bladewing.classify import Classifier
iq = np.random.default_rng(0).normal(size=(2, 200, 2)).view(complex)[..., 0]
answer = Classifier.load(sys.argv[1]).predict(iq, carrier_hz=10e9, prf_hz=20e3)
assert answer.labels.shape == (2,)
print(json.dumps(sorted(sys.modules)))
"""


def modules_after(code: str, *arguments: str) -> set[str]:
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return set(json.loads(done.stdout))


@pytest.mark.parametrize("shipped", [False, True])
def test_predict_loads_nothing_heavy(uav_model, shipped):
    if shipped and not files("bladewing.models.pretrained").joinpath("spectrum-cnn.onnx").is_file():
        pytest.skip("no model is shipped in this checkout: `make train` writes them")
    loaded = modules_after(PREDICT, "spectrum-cnn" if shipped else str(uav_model))
    assert {"numpy", "onnxruntime", "scipy.fft"} <= loaded
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("module", ["bladewing.classify", "bladewing.classify.recording", "bladewing.classify.cli"])
def test_modules_load_what_they_need_when_they_need_it(module):
    loaded = modules_after(f"import json, sys, {module}; print(json.dumps(sorted(sys.modules)))")
    needed = {"typer", "rich", "pydantic"} if module.endswith("cli") else set()
    assert loaded.isdisjoint((set(HEAVY) | {"onnxruntime"}) - needed)


def test_the_package_gives_what_it_names_and_nothing_else():
    assert {getattr(classify, name).__module__.rpartition(".")[2] for name in classify.__all__} == {
        "errors", "inference", "predict", "recording", "track",
    }  # fmt: skip
    with pytest.raises(AttributeError, match="has no attribute 'guess'"):
        _ = classify.guess
