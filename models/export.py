"""ONNX models that need nothing beside them: raw inputs in, raw scores and calibrated probabilities out.

Every graph reads float32 inputs whose first axis is the batch, the only one that may vary, and gives "scores" and
"probabilities", both (batch, 3); the graph of a network that tells kinds apart also gives their raw "kind_scores",
(batch, kinds).
The calibration is three nodes at the end: Mul, Add, Softmax.
"""

import logging
import math
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from . import KIND_SCORES, WEIGHT_STEPS
from ._checks import CLASS_COUNT
from .calibration import Calibration
from .seal import PLACEHOLDER, SEAL_KEY
from .session import quiet_session

if TYPE_CHECKING:
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.pipeline import Pipeline

    from .cnn import EvidenceNet

# Old enough for runtimes of 2024 (onnxruntime 1.18), new enough for every operator here.
_OPSET = 18
_ML_OPSET = 3
_IR_VERSION = 10

NETWORK_TOLERANCE = 1e-4
"""Largest difference of a probability that an exported network may show."""
TABULAR_TOLERANCE = 1e-5
"""Largest difference of a probability that an exported tabular model may show."""

_CHECK_BATCH = 1024
_LEAST_ROUNDED = 512  # values; a smaller tensor saves less than its extra nodes cost


def export_network(net: "EvidenceNet", input_shapes: Mapping[str, tuple[int, ...]], calibration: Calibration) -> bytes:
    """Export a network.

    Parameters
    ----------
    net
        Trained, on the CPU; is left in the state for inference.
    input_shapes
        Input name to shape of one record; must be those that the network was made for.
    calibration
        How its scores become probabilities.

    Returns
    -------
    bytes
        The serialised ONNX model.

    Raises
    ------
    ValueError
        Where the shapes are not those of the network.
    """
    import torch

    from .cnn import CLASSES_ALONE

    if dict(input_shapes) != net.input_shapes:
        raise ValueError(f"input_shapes is {dict(input_shapes)}; the network was made for {net.input_shapes}")
    told = net.kinds != CLASSES_ALONE

    class _Answers(torch.nn.Module):
        """A network that gives all its scores at once."""

        def __init__(self, net: "EvidenceNet") -> None:
            super().__init__()
            self.net = net

        def forward(self, signal: torch.Tensor, *evidence: torch.Tensor) -> tuple[torch.Tensor, ...]:
            kind_scores = self.net.kind_scores(signal, *evidence)
            return (self.net.class_scores(kind_scores), kind_scores)[: 1 + told]

    batch = torch.export.Dim("batch")
    example = tuple(torch.zeros(2, *shape) for shape in net.input_shapes.values())
    with _quiet_converters():
        program = torch.onnx.export(
            _Answers(net).eval(),
            example,
            dynamo=True,
            external_data=False,
            verbose=False,
            opset_version=_OPSET,
            input_names=list(net.input_shapes),
            output_names=["scores", KIND_SCORES][: 1 + told],
            dynamic_shapes=({0: batch}, tuple({0: batch} for _ in example[1:])),
        )
    assert program is not None
    model = program.model_proto  # built anew at each access
    _store_rounded(model.graph)
    return _finish(model, net.input_shapes, calibration, len(net.kinds) if told else 0)


def export_tabular(
    model: "Pipeline | HistGradientBoostingClassifier", n_features: int, input_name: str, calibration: Calibration
) -> bytes:
    """Export logistic regression or boosted trees.

    Parameters
    ----------
    model
        From `tabular.train_linear` or `tabular.train_boosted`.
    n_features
        Number of measurements F.
    input_name
        Name of the graph's input, "features" or "joint_features".
    calibration
        How its scores become probabilities.

    Returns
    -------
    bytes
        The serialised ONNX model.

    Raises
    ------
    ValueError
        Where the model was fitted on another number of measurements.
    """
    from skl2onnx import convert_sklearn
    from skl2onnx.common.data_types import FloatTensorType

    if model.n_features_in_ != n_features:
        raise ValueError(f"n_features is {n_features}; the model was fitted on {model.n_features_in_}")
    last = model.steps[-1][1] if hasattr(model, "steps") else model
    with _quiet_converters():
        proto = convert_sklearn(
            model,
            initial_types=[(input_name, FloatTensorType([None, n_features]))],
            options={id(last): {"zipmap": False, "raw_scores": True}},
            target_opset={"": _OPSET, "ai.onnx.ml": _ML_OPSET},
        )
    _rename(proto.graph, proto.graph.output[1].name, "scores")
    for node in proto.graph.node:
        _drop_unused_tree_attributes(node)
    return _finish(proto, {input_name: (n_features,)}, calibration)


def attach_metadata(onnx_bytes: bytes, metadata: Mapping[str, str]) -> bytes:
    """Write a model's metadata, with a placeholder for the seal; earlier metadata are replaced.

    Parameters
    ----------
    onnx_bytes
        A serialised ONNX model.
    metadata
        Keys and values, all strings.

    Returns
    -------
    bytes
        The model with its metadata, to be sealed by `seal.seal`.

    Raises
    ------
    ValueError
        Where a value is not a string.
    """
    for key, value in metadata.items():
        if not isinstance(value, str):
            raise ValueError(
                f"metadata {key!r} is {type(value).__name__}; every value must be a string: use json.dumps"
            )
    model = onnx.load_model_from_string(onnx_bytes)
    helper.set_model_props(model, {**metadata, SEAL_KEY: PLACEHOLDER})
    return model.SerializeToString(deterministic=True)


def in_eight_bits(onnx_bytes: bytes) -> bytes:
    """Quantise a network's weights and products to eight bits, to compare it with the original.

    Parameters
    ----------
    onnx_bytes
        A serialised network, as `export_network` or `attach_metadata` gave it.

    Returns
    -------
    bytes
        The network with the same inputs, outputs and metadata, except the seal, which must be set again. The weights
        have one scale a tensor; activations are scaled batch by batch at run time (onnxruntime's dynamic quantisation).
    """
    from onnxruntime.quantization import QuantType, quantize_dynamic

    model = onnx.load_model_from_string(onnx_bytes)
    graph = model.graph
    _widen(graph)
    metadata = {entry.key: entry.value for entry in model.metadata_props}
    level = logging.root.level
    logging.root.setLevel(logging.ERROR)  # hides its advice to optimise the model first
    try:
        with tempfile.TemporaryDirectory() as folder:
            small = Path(folder) / "small.onnx"
            quantize_dynamic(
                model, small, weight_type=QuantType.QUInt8, op_types_to_quantize=["Conv", "MatMul", "Gemm"]
            )
            return attach_metadata(small.read_bytes(), {key: metadata[key] for key in metadata if key != SEAL_KEY})
    finally:
        logging.root.setLevel(level)


def check_export(
    onnx_bytes: bytes,
    reference_probabilities: NDArray[np.floating],
    inputs: Mapping[str, NDArray[np.floating]],
    tolerance: float,
) -> float:
    """Run an exported model and compare it with the one it came from.

    Parameters
    ----------
    onnx_bytes
        A serialised ONNX model.
    reference_probabilities
        Calibrated probabilities of the original model, shape (n, 3), n at least 1.
    inputs
        Input name to array (n, *shape).
    tolerance
        Largest difference that is accepted; `NETWORK_TOLERANCE` or `TABULAR_TOLERANCE`.

    Returns
    -------
    float
        Largest absolute difference of a probability, over the records in large batches and the first record alone.

    Raises
    ------
    ValueError
        Where the difference exceeds the tolerance, or is not a number.
    """
    session = quiet_session(onnx_bytes)
    names = [node.name for node in session.get_inputs()]
    count = len(reference_probabilities)
    worst = 0.0
    for start, stop in [(0, 1), *((start, start + _CHECK_BATCH) for start in range(0, count, _CHECK_BATCH))]:
        feed = {name: np.asarray(inputs[name][start:stop], dtype=np.float32) for name in names}
        found = session.run(["probabilities"], feed)[0]
        worst = float(np.maximum(worst, np.abs(found - reference_probabilities[start:stop]).max()))  # keeps NaN
    if not worst <= tolerance:
        raise ValueError(
            f"the exported model differs from the original by {worst:.2g} in probability; allowed {tolerance:.2g}"
        )
    return worst


def _finish(
    model: onnx.ModelProto, input_shapes: Mapping[str, tuple[int, ...]], calibration: Calibration, kinds: int = 0
) -> bytes:
    """Append the calibration, remove what inference does not need, check, serialise; `kinds` > 0 adds their scores."""
    graph = model.graph
    _require_free_batch(graph, input_shapes)
    graph.name = "bladewing"
    graph.initializer.extend(
        [
            numpy_helper.from_array(np.float32(calibration.scale).reshape(1), "calibration_scale"),
            numpy_helper.from_array(np.asarray(calibration.bias, dtype=np.float32), "calibration_bias"),
        ]
    )
    graph.node.extend(
        [
            helper.make_node("Mul", ["scores", "calibration_scale"], ["scaled_scores"]),
            helper.make_node("Add", ["scaled_scores", "calibration_bias"], ["calibrated_scores"]),
            helper.make_node("Softmax", ["calibrated_scores"], ["probabilities"], axis=-1),
        ]
    )
    del graph.input[:], graph.output[:], graph.value_info[:]
    graph.input.extend(
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", *shape])
        for name, shape in input_shapes.items()
    )
    graph.output.extend(
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])
        for name, width in (("scores", CLASS_COUNT), ("probabilities", CLASS_COUNT), (KIND_SCORES, kinds))
        if width
    )
    # Converters leave call stacks with the paths of the machine they ran on.
    for part in [model, graph, *graph.node, *graph.initializer]:
        part.ClearField("doc_string")
        part.ClearField("metadata_props")
    model.producer_name, model.producer_version, model.domain = "bladewing", "", ""
    model.ir_version = _IR_VERSION
    onnx.checker.check_model(model, full_check=True)
    return model.SerializeToString(deterministic=True)


def _require_free_batch(graph: onnx.GraphProto, input_shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Refuse a graph unless the batch is the only free axis of each input: converters err there without a message."""
    found = {}
    for node in graph.input:
        dims = node.type.tensor_type.shape.dim
        found[node.name] = tuple(dim.dim_value if dim.HasField("dim_value") else None for dim in dims)
    expected = {name: (None, *shape) for name, shape in input_shapes.items()}
    if found != expected:
        raise ValueError(f"the converter gave the inputs {found}; they must be {expected}, only the batch free")


@contextmanager
def _quiet_converters() -> Iterator[None]:
    """Hold back messages of the converters: that torchvision is missing, that they call deprecated functions."""
    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)


def _store_rounded(graph: onnx.GraphProto) -> None:
    """Store weights from `cnn.rounded` in a byte each, offsets in two, where exact; runtimes widen them on loading."""
    for weights in list(graph.initializer):
        values = numpy_helper.to_array(weights)
        if weights.data_type != TensorProto.FLOAT or values.size < _LEAST_ROUNDED:
            continue
        name, half = weights.name, values.astype(np.float16)
        in_bytes, in_half, steps_of, whole = (f"{name}_{part}" for part in ("bytes", "half", "steps", "whole"))
        largest = np.abs(values).max(axis=tuple(range(1, values.ndim)), keepdims=True)
        steps = np.where(largest > 0, largest / np.float32(WEIGHT_STEPS), np.float32(1))
        codes = np.rint(values / steps)
        if values.ndim > 1 and np.array_equal(codes * steps, values):  # in a vector each value is its own step
            graph.initializer.extend(
                [
                    numpy_helper.from_array(codes.astype(np.int8), in_bytes),
                    numpy_helper.from_array(steps, steps_of),
                ]
            )
            nodes = [
                helper.make_node("Cast", [in_bytes], [whole], to=TensorProto.FLOAT),
                helper.make_node("Mul", [whole, steps_of], [name]),
            ]
        elif np.array_equal(half, values):
            graph.initializer.append(numpy_helper.from_array(half, in_half))
            nodes = [helper.make_node("Cast", [in_half], [name], to=TensorProto.FLOAT)]
        else:
            continue
        graph.initializer.remove(weights)
        for node in reversed(nodes):
            graph.node.insert(0, node)


def _widen(graph: onnx.GraphProto) -> None:
    """Undo `_store_rounded`: weights of four bytes each."""
    stored = {one.name: one for one in graph.initializer}
    for node in list(graph.node):
        if node.op_type in ("Cast", "Mul") and all(name in stored for name in node.input):
            parts = [numpy_helper.to_array(stored[name]).astype(np.float32) for name in node.input]
            whole = numpy_helper.from_array(math.prod(parts[1:], start=parts[0]), node.output[0])
            for name in node.input:
                graph.initializer.remove(stored.pop(name))
            graph.initializer.append(whole)
            stored[node.output[0]] = graph.initializer[-1]
            graph.node.remove(node)


def _rename(graph: onnx.GraphProto, old: str, new: str) -> None:
    """Rename one value wherever it is written or read."""
    for node in graph.node:
        for names in (node.input, node.output):
            names[:] = [new if name == old else name for name in names]


def _drop_unused_tree_attributes(node: onnx.NodeProto) -> None:
    """Remove the "nodes_hitrates" of a tree ensemble: an eighth of its size, which runtimes ignore."""
    kept = [attribute for attribute in node.attribute if attribute.name != "nodes_hitrates"]
    del node.attribute[:]
    node.attribute.extend(kept)
