"""Export: the ONNX model says what the original says, at every batch size, and needs nothing beside itself."""

from pathlib import Path

import bladewing.models.export as export_module
import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from bladewing.models.calibration import Calibration
from bladewing.models.cnn import ImageNet, SpectrumNet, rounded
from bladewing.models.export import (
    NETWORK_TOLERANCE,
    TABULAR_TOLERANCE,
    attach_metadata,
    check_export,
    export_network,
    export_tabular,
    in_eight_bits,
)
from bladewing.models.seal import seal, verify
from bladewing.models.tabular import tabular_scores, train_boosted, train_linear
from bladewing.models.training import TrainingData, TrainingOptions, network_scores, train_network
from onnx import helper

CALIBRATION = Calibration(0.7, (0.3, -0.5, 0.2))
FEATURES = 6
SHAPES = {"spectrum": (3, 64), "features": (FEATURES,)}
KINDS = ("features-linear", "features-boosted", "spectrum-cnn-fast", "spectrum-cnn", "image-cnn")


def _tabular(train, name):
    rng = np.random.default_rng(0)
    y = rng.integers(0, 3, 800)
    x = (rng.normal(size=(800, FEATURES)) + np.eye(FEATURES)[y]).astype(np.float32)
    model = train(x, y, seed=0)
    onnx_bytes = export_tabular(model, FEATURES, name, CALIBRATION)
    return onnx_bytes, {name: x}, tabular_scores(model, x), TABULAR_TOLERANCE


def _network(net):
    rng = np.random.default_rng(0)
    y = np.arange(130) % 3
    # far from standard, so that a forgotten buffer shows
    inputs = {name: (5 + 20 * rng.random((130, *shape))).astype(np.float32) for name, shape in net.input_shapes.items()}
    train_network(net, TrainingData(inputs, y), (inputs, y), TrainingOptions(1, batch=64), seed=0)
    onnx_bytes = export_network(net, dict(net.input_shapes), CALIBRATION)
    return onnx_bytes, inputs, network_scores(net, inputs), NETWORK_TOLERANCE


@pytest.fixture(scope="module")
def exported():
    return {
        "features-linear": _tabular(train_linear, "features"),
        "features-boosted": _tabular(train_boosted, "joint_features"),
        "spectrum-cnn-fast": _network(
            SpectrumNet({"levels": (2, 64), "cadence": (2, 32)}, seed=0, kinds=(0, 0, 1, 2, 2))
        ),
        "spectrum-cnn": _network(
            SpectrumNet({"spectrum": (3, 64), "cadence": (2, 24), "features": (FEATURES,)}, seed=0)
        ),
        "image-cnn": _network(ImageNet({"image": (1, 32, 16), "joint_features": (FEATURES,)}, seed=0)),
    }


def _session(onnx_bytes):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(onnx_bytes, options)


@pytest.mark.parametrize("kind", KINDS)
def test_scores_and_probabilities_are_those_of_the_original_at_every_batch_size(exported, kind):
    onnx_bytes, inputs, scores, tolerance = exported[kind]
    session = _session(onnx_bytes)
    expected = CALIBRATION.probabilities(scores)
    assert expected.std() > 0.001  # the model tells records apart, so agreement says something
    for batch in (1, 2, 7, 64):
        found = session.run(["scores", "probabilities"], {name: values[:batch] for name, values in inputs.items()})
        assert found[0] == pytest.approx(scores[:batch], abs=1e-3, rel=1e-4)
        assert np.abs(found[1] - expected[:batch]).max() <= tolerance
        assert found[1].dtype == np.float32


@pytest.mark.parametrize("kind", KINDS)
def test_the_check_accepts_the_original_and_refuses_another(exported, kind):
    onnx_bytes, inputs, scores, tolerance = exported[kind]
    expected = CALIBRATION.probabilities(scores)
    assert check_export(onnx_bytes, expected, inputs, tolerance) <= tolerance
    for place in (0, -1):
        wrong = expected.copy()
        wrong[place, 0] += 2 * tolerance
        with pytest.raises(ValueError, match="differs from the original by"):
            check_export(onnx_bytes, wrong, inputs, tolerance)
    with pytest.raises(ValueError, match="differs from the original by nan"):
        check_export(onnx_bytes, expected * np.nan, inputs, tolerance)


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_batch_is_free(exported, kind):
    onnx_bytes, inputs, _, _ = exported[kind]
    session = _session(onnx_bytes)
    found = {node.name: (node.type, node.shape) for node in session.get_inputs()}
    assert found == {name: ("tensor(float)", ["batch", *values.shape[1:]]) for name, values in inputs.items()}
    outputs = {node.name: node.shape for node in session.get_outputs()}
    kinds = {"kind_scores": ["batch", 5]} if kind == "spectrum-cnn-fast" else {}
    assert outputs == {"scores": ["batch", 3], "probabilities": ["batch", 3], **kinds}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_of_the_machine_stays_in_the_model(exported, kind):
    onnx_bytes = exported[kind][0]
    for trace in (str(Path(onnx.__file__).parents[1]), str(Path(__file__).parents[2]), ".py", "pkg.torch"):
        assert trace.encode() not in onnx_bytes
    model = onnx.load_model_from_string(onnx_bytes)
    assert not any(tensor.external_data for tensor in model.graph.initializer)
    assert model.ir_version <= 10


@pytest.mark.parametrize("kind", KINDS)
def test_a_sealed_model_still_answers(exported, kind):
    onnx_bytes, inputs, scores, tolerance = exported[kind]
    sealed = seal(attach_metadata(onnx_bytes, {"name": kind}))
    verify(sealed)
    check_export(sealed, CALIBRATION.probabilities(scores), inputs, tolerance)


def test_trees_agree_on_neighbouring_float32_values():
    """Thresholds lie between neighbours, where rounding one of them up would send a record the other way."""
    rng = np.random.default_rng(0)
    steps = rng.integers(0, 60, (2000, 2))
    x = (np.float32(1) + steps * np.finfo(np.float32).eps).astype(np.float32)
    y = np.digitize(steps[:, 0] + 0.1 * steps[:, 1], [20, 40])
    model = train_boosted(x, y, seed=0, iterations=10)
    onnx_bytes = export_tabular(model, 2, "features", CALIBRATION)
    check_export(onnx_bytes, CALIBRATION.probabilities(tabular_scores(model, x)), {"features": x}, TABULAR_TOLERANCE)


def test_a_full_ensemble_stays_under_300_kb_and_a_network_under_200():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(4000, 8)).astype(np.float32)
    y = np.digitize(np.sin(3 * x[:, 0]) + x[:, 1] * x[:, 2], [-0.4, 0.4])
    model = train_boosted(x, y, seed=0)
    assert model.n_iter_ > 60
    assert len(export_tabular(model, 8, "features", CALIBRATION)) < 300_000
    nets = (
        SpectrumNet({"spectrum": (3, 256), "cadence": (2, 96), "features": (60,)}, seed=0),
        ImageNet({"image": (1, 64, 32), "joint_features": (60,)}, seed=0),
    )
    for net in nets:
        net.compact()
        assert len(export_network(net, net.input_shapes, CALIBRATION)) < 200_000


def test_rounded_weights_are_stored_in_a_byte_each_and_mean_the_same():
    shapes = SHAPES | {"spectrum": (3, 256)}
    net = SpectrumNet(shapes, seed=0)
    inputs = {
        name: np.random.default_rng(1).normal(size=(40, *shape)).astype(np.float32) for name, shape in shapes.items()
    }
    with torch.no_grad():
        net.head[0].weight[3] = 0  # an output without any weight
        net.head[0].weight[4] *= 1e-4  # one that training has let go
        net.place.normal_()
    net.standardise_by(inputs)
    before = network_scores(net, inputs)
    net.compact()
    scores = network_scores(net, inputs)
    assert 0 < np.abs(scores - before).max() < 0.02 * np.ptp(before)
    onnx_bytes = export_network(net, shapes, CALIBRATION)
    check_export(onnx_bytes, CALIBRATION.probabilities(scores), inputs, 1e-6)
    kept = onnx.load_model_from_string(onnx_bytes).graph.initializer
    large = {one.data_type: np.prod(one.dims) for one in kept if np.prod(one.dims) >= 512}
    assert set(large) == {onnx.TensorProto.INT8, onnx.TensorProto.FLOAT16}  # weights, and the offsets of places
    weights = sum(values.numel() for values in net.parameters() if values.ndim > 1)
    assert sum(np.prod(one.dims) for one in kept if one.data_type == onnx.TensorProto.INT8) > 0.95 * weights
    net.compact()  # what is rounded stays as it is, and is written again to the same bytes
    assert export_network(net, shapes, CALIBRATION) == onnx_bytes


@pytest.mark.parametrize("size", [1e-20, 1e-9, 1e-3, 1.0, 1e4])
def test_a_weight_is_rounded_by_half_a_step_of_its_own_output_at_most(size):
    weights = (
        torch.randn(6, 4, 1, 5, generator=torch.Generator().manual_seed(2))
        * torch.logspace(-3, 0, 6)[:, None, None, None]
    )
    weights *= size
    found = rounded(weights)
    largest = weights.abs().amax((1, 2, 3))
    off = (found - weights).abs().amax((1, 2, 3))
    allowed = largest * (0.5 + 127 / 2048) / 127  # half a step, and what the step is off by
    assert (off <= allowed).all()
    assert (found.abs().amax((1, 2, 3)) / largest - 1).abs().max() < 0.001
    torch.testing.assert_close(rounded(found), found, rtol=0, atol=0)


def test_weights_that_no_step_can_hold_are_none():
    found = rounded(torch.tensor([[1e-40, -1e-41], [1e-35, 0.0], [1.0, 0.0]]))
    assert (found[:2] == 0).all()
    assert found[2].tolist() == pytest.approx([1.0, 0.0], rel=0.001)


def test_wrong_shapes_are_refused():
    net = SpectrumNet(SHAPES, seed=0)
    with pytest.raises(ValueError, match="the network was made for"):
        export_network(net, {"spectrum": (3, 128), "features": (FEATURES,)}, CALIBRATION)
    x = np.random.default_rng(0).normal(size=(60, 2)).astype(np.float32)
    model = train_linear(x, np.arange(60) % 3, seed=0)
    with pytest.raises(ValueError, match="n_features is 3; the model was fitted on 2"):
        export_tabular(model, 3, "features", CALIBRATION)


def test_an_export_with_a_fixed_batch_is_refused(monkeypatch):
    export = torch.onnx.export
    monkeypatch.setattr(torch.onnx, "export", lambda *a, **options: export(*a, **(options | {"dynamic_shapes": None})))
    with pytest.raises(ValueError, match="only the batch free"):
        export_network(SpectrumNet(SHAPES, seed=0), SHAPES, CALIBRATION)


@pytest.mark.parametrize("dims", [(2, 4), ("batch", "other"), ("batch", 5)])
def test_a_converter_that_frees_or_fixes_the_wrong_axis_is_caught(dims):
    value = helper.make_tensor_value_info("features", onnx.TensorProto.FLOAT, dims)
    graph = helper.make_graph([], "g", [value], [])
    with pytest.raises(ValueError, match="only the batch free"):
        export_module._require_free_batch(graph, {"features": (4,)})


@pytest.mark.parametrize("kind", ["spectrum-cnn-fast", "spectrum-cnn", "image-cnn"])
def test_a_network_in_eight_bits_is_smaller_and_says_much_the_same(exported, kind):
    onnx_bytes, inputs, scores, _ = exported[kind]
    told = attach_metadata(onnx_bytes, {"name": kind})
    small = in_eight_bits(told)
    assert len(small) < 0.75 * len(told)  # half-precision weights become single bytes, the graph itself stays
    assert {entry.key: entry.value for entry in onnx.load_model_from_string(small).metadata_props}["name"] == kind
    kinds = {one.data_type for one in onnx.load_model_from_string(small).graph.initializer}
    assert onnx.TensorProto.UINT8 in kinds
    found = _session(small).run(["probabilities"], inputs)[0]
    assert 0 < np.abs(found - CALIBRATION.probabilities(scores)).max() < 0.1
