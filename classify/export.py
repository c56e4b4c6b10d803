"""The work behind `bladewing export`: one ONNX graph from raw IQ to probabilities, for one radar and one dwell.

The graph does what `Classifier.predict` does with a record inside the envelope: the inputs
(`bladewing.features.graph`), the model with its calibration, and the answer. It does not mend records with lost pulses
or with one channel alone. It holds only operators of the ONNX standard, so any runtime can serve it.
"""

import hashlib
import json
import operator
import os
from pathlib import Path

import numpy as np
import onnx
from bladewing.features.graph.inputs import IN_GRAPH, IQ, input_graph
from bladewing.features.graph.operators import Graph, Value, needed
from bladewing.models.export import attach_metadata
from bladewing.models.operating import OperatingPoint
from bladewing.models.runtime import onnxruntime
from bladewing.models.seal import SEAL_KEY, seal
from onnx import TensorProto, helper
from scipy import fft

from .errors import BadInput, unwritable
from .files import read_bounded, write_whole
from .inference import Classifier
from .labels import CLASSES, UNKNOWN
from .ladder import CASCADE
from .limits import MOST_MODEL_BYTES
from .model_file import EXPORTED, chosen_name, read_model
from .rules import Limits, counted_pulses
from .samples import positive

TOLERANCE = 2e-3
"""Largest difference of a probability from `Classifier.predict` that an exported graph may show on records with noise;
without noise all beside a line is rounding, which differs between the two."""

_CHECKED = 16


def export_raw_iq(
    out: str | os.PathLike[str],
    *,
    carrier_hz: float,
    prf_hz: float,
    pulses: int,
    model: str | os.PathLike[str] | None = None,
    max_false_alarm: float | None = None,
) -> tuple[float, OperatingPoint | None]:
    """Write a model as a graph that reads raw IQ.

    Parameters
    ----------
    out
        The file to write, its name ending in ".onnx". Its graph reads "iq", float32 of shape (batch, pulses, 2), batch
        1 or more, I and Q at any gain, and gives "probabilities", float32 (batch, 3) in the order uav, bird, clutter,
        and "label", int64 (batch,): the place in (uav, bird, clutter, unknown). A record without signal, or with a
        sample that is not finite, three and more lost pulses (exactly 0, which `Classifier.predict` fills in) or one
        channel alone (which `Classifier.predict` makes analytic), is unknown with probabilities of 1/3. Pulses that
        interference hit, and ends of the span that a filter took out, are taken as they are; `Classifier.predict` fills
        in both.
    carrier_hz, prf_hz
        Carrier and pulse repetition frequency [Hz] that the graph is made for.
    pulses
        Pulses of a record.
    model
        As for `Classifier.load`; a model whose inputs are all in `IN_GRAPH`.
    max_false_alarm
        As for `Classifier`: largest share of birds and clutter whose label may be UAV.

    Returns
    -------
    worst : float
        Largest difference of a probability from `Classifier.predict` over a few records, at most `TOLERANCE`.
    point : OperatingPoint or None
        Threshold and detection probability at the false-alarm rate; None where none is asked for.

    Raises
    ------
    BadInput
        The name ends in something else or is that of another file, the radar or the dwell lies outside the model's
        envelope, the model reads an image, or the file cannot be written.
    """
    if Path(out).suffix.lower() != ".onnx":
        raise BadInput(f"{os.fspath(out)}: a graph's name ends in .onnx: give it such a name")
    if not _replaceable(Path(out)):
        raise BadInput(f"{os.fspath(out)} is there and is no exported graph: it is not written over: give another file")
    name = chosen_name(model)
    if name == CASCADE:
        raise BadInput(
            f"{CASCADE}: two models, of which each is asked about other records: give one of them as --model"
        )
    content, source = read_model(name)
    classifier = Classifier(content, source=source, max_false_alarm=max_false_alarm)
    carrier_hz, prf_hz = positive(carrier_hz, "carrier_hz"), positive(prf_hz, "prf_hz")
    try:
        pulses = operator.index(pulses)
    except TypeError:
        raise BadInput(f"pulses is {pulses!r}: it must be a whole number") from None
    outside = classifier.envelope.reason(carrier_hz, prf_hz, pulses)
    if outside is not None:
        raise BadInput(f"cannot be exported: {outside}")
    beyond = set(classifier.inputs) - set(IN_GRAPH)
    if beyond:
        raise BadInput(
            f"{source} reads {sorted(beyond)[0]!r}, of an STFT: only models without one can be exported: "
            "give one of these as --model"
        )
    whole = _whole_graph(content, classifier, carrier_hz, prf_hz, pulses)
    written = _sealed(whole, content, classifier, carrier_hz, prf_hz, pulses)
    worst = _difference(written, classifier, carrier_hz, prf_hz, pulses)
    if not worst <= TOLERANCE:
        raise RuntimeError(f"the exported graph differs by {worst:.2g} in probability; allowed {TOLERANCE:.2g}")
    try:
        write_whole(Path(out), written)
    except OSError as error:
        raise unwritable(os.fspath(out), error, "give another file") from None
    return worst, classifier.operating_point


def _replaceable(out: Path) -> bool:
    """Whether there is no file yet, or an exported graph, which may be replaced."""
    try:
        return not out.exists() or EXPORTED.encode() in read_bounded(out, MOST_MODEL_BYTES)
    except (OSError, ValueError):
        return False


def _limits(classifier: Classifier, carrier_hz: float, prf_hz: float, pulses: int) -> Limits:
    """Least probability at which the graph names each class."""
    return classifier.rules.of(counted_pulses(pulses, carrier_hz, prf_hz)).accept


def _whole_graph(
    content: bytes, classifier: Classifier, carrier_hz: float, prf_hz: float, pulses: int
) -> onnx.ModelProto:
    """Inputs before the model, the answer behind it."""
    model = onnx.load_model_from_string(content)
    before = Graph()
    inputs, live = input_graph(before, carrier_hz=carrier_hz, prf_hz=prf_hz, pulses=pulses, names=classifier.inputs)
    for name, value in inputs.items():
        before.name(value, name)
    for node in model.graph.node:  # frees the names of the answer for the nodes behind the model
        for names in (node.input, node.output):
            names[:] = [f"{IQ}_model_{name}" if name in ("probabilities", "label") else name for name in names]

    after = Graph(prefix=f"{IQ}_answer")
    judged = after.where(live.on(after), Value(after, f"{IQ}_model_probabilities", np.float32), 1 / len(CLASSES))
    after.name(judged, "probabilities")
    best = judged.argmax()
    limits = _limits(classifier, carrier_hz, prf_hz, pulses)
    least = after.constant(limits, np.float64).take_rows(best)
    accepted = (judged.max().to(np.float64) >= least) & live.on(after)
    label = after.where(accepted, best, np.array(len(CLASSES)))
    after.name(label.squeeze(), "label")

    nodes = needed([*before.nodes, *model.graph.node, *after.nodes], ["probabilities", "label"])
    read = {name for node in nodes for name in node.input}
    graph = helper.make_graph(
        nodes,
        "bladewing",
        [helper.make_tensor_value_info(IQ, TensorProto.FLOAT, ["batch", pulses, 2])],
        [
            helper.make_tensor_value_info("probabilities", TensorProto.FLOAT, ["batch", len(CLASSES)]),
            helper.make_tensor_value_info("label", TensorProto.INT64, ["batch"]),
        ],
        [
            one
            for part in (before.initializers, model.graph.initializer, after.initializers)
            for one in part
            if one.name in read
        ],
    )
    whole = helper.make_model(
        graph, opset_imports=model.opset_import, ir_version=model.ir_version, producer_name="bladewing"
    )
    onnx.checker.check_model(whole, full_check=True)
    return whole


def _sealed(
    whole: onnx.ModelProto, content: bytes, classifier: Classifier, carrier_hz: float, prf_hz: float, pulses: int
) -> bytes:
    """The sealed graph, with the model's metadata, the radar and dwell it was made for, and the digest of the model."""
    metadata = {key: value for key, value in classifier.metadata.items() if key not in (SEAL_KEY, "inputs")}
    metadata |= {
        "product": EXPORTED,
        "accept": json.dumps(_limits(classifier, carrier_hz, prf_hz, pulses)),
        "labels": json.dumps([*CLASSES, UNKNOWN]),
        "carrier_hz": repr(carrier_hz),
        "prf_hz": repr(prf_hz),
        "pulses": str(pulses),
        "model_sha256": hashlib.sha256(content).hexdigest(),
    }
    return seal(attach_metadata(whole.SerializeToString(deterministic=True), metadata))


def _difference(written: bytes, classifier: Classifier, carrier_hz: float, prf_hz: float, pulses: int) -> float:
    """Largest difference of a probability from the classifier's, over noise with lines of every strength.

    Half of them have a one-sided spectrum, as analytic recordings have: their empty side is filled with noise.
    """
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(_CHECKED, pulses, 2)).astype(np.float32)
    strength = np.geomspace(1e-2, 1e2, _CHECKED, dtype=np.float32)[:, None]
    lines = np.exp(2j * np.pi * rng.uniform(-0.5, 0.5, (_CHECKED, 1)) * np.arange(pulses)).astype(np.complex64)
    iq = (noise.view(np.complex64)[..., 0] + strength * lines).astype(np.complex64)
    iq[::2] = fft.ifft(fft.fft(iq[::2]) * (fft.fftfreq(pulses) >= 0))
    session = onnxruntime.InferenceSession(written, providers=["CPUExecutionProvider"])
    (found,) = session.run(["probabilities"], {IQ: iq.view(np.float32).reshape(*iq.shape, 2)})
    expected = classifier.predict(iq, carrier_hz=carrier_hz, prf_hz=prf_hz).probabilities
    return float(np.abs(found - expected).max())
