"""Small models, recordings and stand-ins that the tests of classify share."""

import json
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from bladewing.classify import workers
from bladewing.classify.envelope import Envelope
from bladewing.classify.files import only_writer
from bladewing.features.schema import INPUT_SHAPES, schema_hash
from bladewing.models.seal import PLACEHOLDER, SEAL_KEY, seal

CARRIER_HZ, PRF_HZ = 10e9, 20e3

#: The least a report can measure.
TINY_REPORT = """
records = 120
reference_records = 64
chain_s = 1e-3
stft_s = 1e-3
least_rounds = 2
repeats = 2
front_train = 210
front_test = 6
front_epochs = 1
front_s = 1e-3
family_train = 600
"""


def noise(pulses: int, records: tuple[int, ...] = (), seed: int = 0) -> np.ndarray:
    """Complex noise, shape (*records, pulses)."""
    parts = np.random.default_rng(seed).normal(size=(*records, pulses, 2)).astype(np.float32)
    return parts.view(np.complex64)[..., 0]


def interrupt(*_: object, **__: object) -> NoReturn:
    """Stand in for any function, to stop a run there as Ctrl-C does."""
    raise KeyboardInterrupt


def no_constant(name: str) -> NoReturn:
    """Read no NaN or infinity, which JSON does not know: what `json.loads` asks for as `parse_constant`."""
    raise AssertionError(f"{name} is not JSON")


def content(folder: Path) -> dict[str, bytes]:
    """Names and contents of a folder's files."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def model_bytes(
    *,
    bias: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
    slope: float = 0.0,
    sealed: bool = True,
    input_name: str = "features",
    width: int | None = None,
    **metadata: str | None,
) -> bytes:
    """Softmax(features @ weights + bias): with slope 0 it always answers softmax(bias)."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    width = INPUT_SHAPES["features"][0] if width is None else width
    weights = (slope * np.random.default_rng(0).normal(size=(width, 3))).astype(np.float32)
    graph = helper.make_graph(
        [
            helper.make_node("MatMul", [input_name, "weights"], ["product"]),
            helper.make_node("Add", ["product", "bias"], ["scores"]),
            helper.make_node("Softmax", ["scores"], ["probabilities"], axis=-1),
        ],
        "tiny",
        [helper.make_tensor_value_info(input_name, TensorProto.FLOAT, ["batch", width])],
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, ["batch", 3]) for n in ("scores", "probabilities")],
        [
            numpy_helper.from_array(weights, "weights"),
            numpy_helper.from_array(np.asarray(bias, dtype=np.float32), "bias"),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    onnx.checker.check_model(model)
    said = {
        "product": "bladewing",
        "format": "1",
        "name": "tiny",
        "classes": json.dumps(["uav", "bird", "clutter"]),
        "schema_sha256": schema_hash(),
        "envelope": Envelope().to_json(),
        "accept": json.dumps([0.6, 0.6, 0.6]),
        SEAL_KEY: PLACEHOLDER,
    } | metadata
    helper.set_model_props(model, {key: value for key, value in said.items() if value is not None})
    content = model.SerializeToString()
    return seal(content) if sealed else content


@pytest.fixture(autouse=True)
def _wide_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no terminal's width that the tests are started with wrap a sentence."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture(scope="session")
def make_model() -> Callable[..., bytes]:
    return model_bytes


@pytest.fixture(scope="session")
def uav_model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model that always answers uav 0.8."""
    path = tmp_path_factory.mktemp("models") / "always-uav.onnx"
    path.write_bytes(model_bytes(bias=np.log([0.8, 0.15, 0.05])))
    return path


@pytest.fixture(scope="session")
def mixed_model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model whose answer depends on the record."""
    path = tmp_path_factory.mktemp("models") / "mixed.onnx"
    path.write_bytes(model_bytes(slope=0.05))
    return path


@pytest.fixture(scope="session")
def tiny_models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two models that cost nothing, under a known name and a strange one."""
    folder = tmp_path_factory.mktemp("models")
    (folder / "spectrum-cnn-wide.onnx").write_bytes(model_bytes(slope=0.05))
    (folder / "always-uav.onnx").write_bytes(model_bytes(bias=np.log([0.8, 0.15, 0.05])))
    return folder


def linear_bytes(net: Any) -> bytes:
    """A model with a network's inputs that takes no time to make: a report only times it."""
    from onnx import TensorProto, helper, numpy_helper

    signal, evidence = net.input_shapes
    weights = numpy_helper.from_array(np.eye(4, 3, dtype=np.float32), "weights")
    nodes = [
        helper.make_node("Shape", [signal], ["unused"]),
        helper.make_node("MatMul", [evidence, "weights"], ["scores"]),
        helper.make_node("Softmax", ["scores"], ["probabilities"], axis=-1),
    ]
    inputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", *shape])
        for name, shape in net.input_shapes.items()
    ]
    out = helper.make_tensor_value_info("probabilities", TensorProto.FLOAT, ["batch", 3])
    graph = helper.make_graph(nodes, "linear", inputs, [out], [weights])
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    content: bytes = made.SerializeToString()
    return content


def few_choices(patch: pytest.MonkeyPatch) -> None:
    """Let a report compare little: two pictures, dwells, bins, families; one table of the paper; no own process."""
    from bladewing.classify import tables
    from bladewing.classify.report import choices, examples, families, front, pictures, run
    from bladewing.models import tabular

    few = {name: pictures.PICTURES[name] for name in ("spectrum", "stft-80-90")}
    dwells_s, bins = (0.005, 0.02, 0.08), (64, 1024)
    for module in (front, choices):
        patch.setattr(module, "PICTURES", few)
        patch.setattr(module, "DWELLS_S", dwells_s)
        patch.setattr(module, "STORED_BINS", bins)
    patch.setattr(families, "FAMILIES", {name: families.FAMILIES[name] for name in ("sea", "band 18-40 GHz")})
    patch.setattr(choices, "network_bytes", linear_bytes)
    patch.setattr(front, "peak_bytes", lambda *_: 1_000_000)
    # the trees of the front and of the families: none is asked how good it is
    patch.setattr(tabular, "train_boosted", partial(tabular.train_boosted, iterations=2))
    patch.setattr(run, "TrainingConfig", partial(run.TrainingConfig, iterations=2))
    patch.setattr(tables, "TABLES", {title: tables.TABLES[title] for title in ("The paper's bird",)})
    patch.setattr(examples, "EXAMPLES_DRAWN", 30)
    patch.setattr(workers, "workers_at_hand", lambda: 1)
    # there is no train.json that could tell of a cascade
    of_account, told = run._cascade, {"cascade": {"stages": ["spectrum-cnn-wide", "always-uav"]}}
    patch.setattr(run, "_cascade", lambda given, _: of_account(given, told))


@pytest.fixture(scope="session")
def tiny_settings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A settings file of the least report."""
    file = tmp_path_factory.mktemp("settings") / "tiny.toml"
    file.write_text(TINY_REPORT)
    return file


@pytest.fixture(scope="session")
def report_folder(tmp_path_factory: pytest.TempPathFactory, tiny_models: Path, tiny_settings: Path) -> Path:
    """A whole report on few records: report.json and report.html, made once for all workers of a run."""
    from bladewing.classify.report.run import run_report

    own = tmp_path_factory.getbasetemp()
    shared = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own
    folder = shared / "report"
    with only_writer(shared), pytest.MonkeyPatch.context() as patch:
        if not (folder / "report.json").exists():
            few_choices(patch)
            run_report(folder, models=tiny_models, quick=True, config=tiny_settings, progress=False)
    return folder


@pytest.fixture(scope="module")
def report(report_folder: Path) -> dict[str, Any]:
    """What that report's JSON holds."""
    text = (report_folder / "report.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text, parse_constant=no_constant)
    return found


@pytest.fixture
def sigmf_pair(tmp_path: Path) -> Callable[..., Path]:
    """Write a SigMF recording, by default 4000 pulses of noise; keywords change the metadata, None drops a field."""

    def write(
        name: str = "rec",
        iq: np.ndarray | None = None,
        *,
        data: bytes | None = None,
        captures: object = None,
        annotations: object = (),
        **fields: object,
    ) -> Path:
        samples = noise(4000) if iq is None else iq
        general = {"datatype": "cf32_le", "sample_rate": PRF_HZ, "version": "1.2.0"} | fields
        metadata = {
            "global": {f"core:{key}": value for key, value in general.items() if value is not None},
            "captures": [{"core:sample_start": 0, "core:frequency": CARRIER_HZ}] if captures is None else captures,
            "annotations": list(annotations) if isinstance(annotations, tuple) else annotations,
        }
        meta = tmp_path / f"{name}.sigmf-meta"
        meta.write_text(json.dumps(metadata))
        meta.with_suffix(".sigmf-data").write_bytes(samples.tobytes() if data is None else data)
        return meta

    return write
