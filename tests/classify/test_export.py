"""`bladewing export`: the graph answers from raw IQ what `Classifier.predict` answers."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
from bladewing.classify import BadInput, Classifier
from bladewing.classify.cli import main
from bladewing.classify.export import EXPORTED, TOLERANCE, export_raw_iq
from bladewing.classify.model_file import read_model
from bladewing.classify.predict import terms
from bladewing.classify.rules import counted_pulses
from bladewing.features.dropouts import longest_silence
from bladewing.features.graph.inputs import IN_GRAPH, IQ, input_graph
from bladewing.features.graph.operators import Graph
from bladewing.features.inputs import model_inputs
from bladewing.features.one_channel import made_analytic
from bladewing.features.schema import FEATURES, INPUT_SHAPES
from bladewing.features.spectrum import doppler_spectrum
from bladewing.models.seal import verify
from onnx import TensorProto, helper

RADARS = [
    {"carrier_hz": 9.85e9, "prf_hz": 25e3, "pulses": 2000},
    {"carrier_hz": 24e9, "prf_hz": 9.7e3, "pulses": 539},  # transforms of odd length
    {"carrier_hz": 3e9, "prf_hz": 2e3, "pulses": 77},  # one that must be padded, no side of the axis in full
    {"carrier_hz": 77e9, "prf_hz": 100e3, "pulses": 1021},
]
LABELS = np.array(["uav", "bird", "clutter", "unknown"])


def records(count: int, *, prf_hz: float, pulses: int, seed: int = 0, **_: float) -> np.ndarray:
    """Noise with lines, combs and nothing, at every strength."""
    rng = np.random.default_rng(seed)
    iq = rng.normal(size=(count, pulses, 2)).astype(np.float32).view(np.complex64)[..., 0]
    time = np.arange(pulses) / prf_hz
    body = 10 ** rng.uniform(-2, 2, (count, 1)) * np.exp(
        2j * np.pi * rng.uniform(-0.1, 0.1, (count, 1)) * prf_hz * time
    )
    chopping_hz = rng.uniform(30, 300, (count, 1))
    phases = rng.uniform(0, 2 * np.pi, (15, count, 1))
    orders = enumerate(range(-7, 8))
    comb = sum(np.exp(1j * (2 * np.pi * order * chopping_hz * time + phases[i])) for i, order in orders)
    return (iq + body + 10 ** rng.uniform(-3, 0.5, (count, 1)) * comb).astype(np.complex64)


def extremes(pulses: int, *, prf_hz: float, **_: float) -> np.ndarray:
    """One record each of what leaves ordinary ranges."""
    ordinary = records(1, prf_hz=prf_hz, pulses=pulses, seed=9)[0]
    spike = np.zeros(pulses, np.complex64)
    spike[pulses // 3] = 1 + 2j
    late = ordinary.copy()
    late[: pulses // 2] = 0
    gains = [1e-20, 1e-10, 1e10, 1e20, 2.0**40]
    return np.stack(
        [
            np.zeros(pulses), np.full(pulses, 1 + 2j), spike, np.tile([1 + 2j, -1 - 2j], pulses)[:pulses], late,
            *(ordinary * np.float32(gain) for gain in gains),
        ]
    ).astype(np.complex64)  # fmt: skip


def opened(path: Path) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def run(session: onnxruntime.InferenceSession, iq: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return session.run(["probabilities", "label"], {IQ: iq.view(np.float32).reshape(*iq.shape, 2)})


@pytest.mark.parametrize("radar", RADARS, ids=lambda radar: f"{radar['pulses']}")
def test_the_graph_makes_the_inputs_that_python_makes(radar):
    graph = Graph()
    inputs, live = input_graph(graph, **radar, names=IN_GRAPH)
    outputs = [graph.name(value, name) for name, value in {**inputs, "live": live}.items()]
    shapes = {**INPUT_SHAPES, "live": (1,)}
    kinds = {np.dtype(bool): TensorProto.BOOL, np.dtype(np.float32): TensorProto.FLOAT}
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "inputs",
            [helper.make_tensor_value_info(IQ, TensorProto.FLOAT, ["batch", radar["pulses"], 2])],
            [helper.make_tensor_value_info(v.name, kinds[v.dtype], ["batch", *shapes[v.name]]) for v in outputs],
            graph.initializers,
        ),
        opset_imports=[helper.make_opsetid("", 18)],
        ir_version=10,
    )
    iq = records(60, **radar)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    feed = {IQ: iq.view(np.float32).reshape(*iq.shape, 2)}
    found = dict(zip((*IN_GRAPH, "live"), session.run([*IN_GRAPH, "live"], feed), strict=True))
    expected = model_inputs(iq, carrier_hz=radar["carrier_hz"], prf_hz=radar["prf_hz"], names=IN_GRAPH)
    assert found["live"].all()
    # a bin some dB under the noise holds the rounding of lines up to 60 dB over it
    spectrum = doppler_spectrum(iq, carrier_hz=radar["carrier_hz"], prf_hz=radar["prf_hz"])
    strongest_db = 10 * np.log10(spectrum.relative_power.max(axis=1))
    for own, other in ((found[name][:, :2], expected[name][:, :2]) for name in ("spectrum", "levels")):
        rounding_db = 20 / np.log(10) * 1e-7 * 10 ** ((strongest_db[:, None, None] - other) / 20)
        np.testing.assert_array_less(np.abs(own - other), 2e-3 + rounding_db)
    # what does not change over the dwell is the small difference of large squares
    np.testing.assert_allclose(found["spectrum"][:, 2], expected["spectrum"][:, 2], atol=0.05)
    np.testing.assert_allclose(found["spectrum"][:, 3:], expected["spectrum"][:, 3:], atol=5e-3)
    # a weak line of the power over time stands beside strong ones in the same sums
    np.testing.assert_allclose(found["cadence"], expected["cadence"], atol=0.05)
    np.testing.assert_allclose(found["combs"], expected["combs"], atol=0.01)
    # a threshold or a choice of peaks that rounding decides may fall the other way in a rare record
    scale = FEATURES.high - FEATURES.low
    off = np.abs(found["features"] - expected["features"]) / scale > 1e-4
    assert off.any(axis=1).sum() <= 1, [FEATURES[i].name for i in np.flatnonzero(off.any(axis=0))]


@pytest.mark.parametrize("radar", RADARS, ids=lambda radar: f"{radar['pulses']}")
def test_the_shipped_model_answers_the_same_from_raw_iq(radar, tmp_path):
    out = tmp_path / "raw.onnx"
    export_raw_iq(out, **radar)
    classifier = Classifier.load()
    iq = np.concatenate([records(100, **radar, seed=3), extremes(**radar)])
    expected = classifier.predict(iq, carrier_hz=radar["carrier_hz"], prf_hz=radar["prf_hz"])
    probabilities, label = run(opened(out), iq)
    # half of this one is silent: it is answered by the other half, which a graph of so many pulses cannot
    silent = np.flatnonzero([longest_silence(record)[1] > 0 for record in iq])
    np.testing.assert_array_equal(label[silent], 3)
    np.testing.assert_allclose(probabilities[silent], 1 / 3, rtol=1e-6)
    assert len(silent) == 1
    expected.probabilities[silent], expected.labels[silent] = probabilities[silent], "unknown"
    np.testing.assert_allclose(probabilities, expected.probabilities, atol=TOLERANCE)
    limits = np.asarray(classifier.rules.of(counted_pulses(**radar)).accept)[expected.probabilities.argmax(axis=-1)]
    clear = np.abs(expected.probabilities.max(axis=-1) - limits) > TOLERANCE
    np.testing.assert_array_equal(LABELS[label][clear], expected.labels[clear])
    assert clear.sum() > 90


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A small exported graph and the records it answers for."""
    radar = {"carrier_hz": 10e9, "prf_hz": 20e3, "pulses": 200}
    out = tmp_path_factory.mktemp("raw") / "small.onnx"
    export_raw_iq(out, **radar, model="spectrum-cnn-fast")
    return out, radar, opened(out)


def test_labels_keep_to_a_false_alarm_rate(small, tmp_path, capsys):
    _, radar, session = small
    out, rule = tmp_path / "strict.onnx", {"model": "spectrum-cnn-fast", "max_false_alarm": 0.001}
    export_raw_iq(out, **radar, **rule)
    strict = Classifier.load("spectrum-cnn-fast", max_false_alarm=0.001)
    iq = records(300, **radar)
    expected = strict.predict(iq, carrier_hz=radar["carrier_hz"], prf_hz=radar["prf_hz"])
    _, label = run(opened(out), iq)
    clear = np.abs(expected.probabilities[:, 0] - strict.accept[0]) > TOLERANCE
    np.testing.assert_array_equal(label[clear] == 0, expected.labels[clear] == "uav")
    assert 0 < (label == 0).sum() < (run(session, iq)[1] == 0).sum()
    said = {entry.key: entry.value for entry in onnx.load_model_from_string(out.read_bytes()).metadata_props}
    assert json.loads(said["accept"]) == list(strict.rules.of(counted_pulses(**radar)).accept)
    assert (
        main(["export", str(out), *(f"--{name.replace('_', '-')}={value}" for name, value in (radar | rule).items())])
        == 0
    )
    assert strict.operating_point is not None
    assert terms(strict.operating_point) in capsys.readouterr().err  # what detection remains


def test_a_batch_answers_like_its_records_alone(small):
    _, radar, session = small
    iq = records(8, **radar)
    together, apart = run(session, iq), [run(session, one[None]) for one in iq]
    np.testing.assert_allclose(together[0], np.concatenate([one[0] for one in apart]), atol=1e-5)
    np.testing.assert_array_equal(together[1], np.concatenate([one[1] for one in apart]))


@pytest.mark.parametrize("exponent", [-149, -143, -141, -140, -138])
def test_what_is_too_faint_to_judge_is_so_in_the_graph_as_in_python(small, exponent):
    _, radar, session = small
    iq = records(40, **radar)
    iq = np.ldexp(iq.view(np.float32) / np.abs(iq.view(np.float32)).max(axis=1, keepdims=True), exponent)
    probabilities, label = run(session, iq.view(np.complex64))
    given = {"carrier_hz": radar["carrier_hz"], "prf_hz": radar["prf_hz"]}
    expected = Classifier.load("spectrum-cnn-fast").predict(iq.view(np.complex64), **given)
    assert (expected.labels == "unknown").all() == (exponent < -140)
    np.testing.assert_array_equal(LABELS[label], expected.labels)
    np.testing.assert_allclose(probabilities, expected.probabilities, atol=0.002)


def test_records_that_cannot_be_judged_are_unknown_and_spoil_no_other(small):
    _, radar, session = small
    iq = records(5, **radar)
    alone = run(session, iq)
    iq[1], iq[2, 7], iq[3, 9] = 0, np.nan, np.inf
    probabilities, label = run(session, iq)
    np.testing.assert_array_equal(label[1:4], 3)
    np.testing.assert_allclose(probabilities[1:4], 1 / 3, rtol=1e-6)
    np.testing.assert_allclose(probabilities[[0, 4]], alone[0][[0, 4]], atol=1e-6)


def test_one_channel_alone_is_unknown_until_it_is_made_analytic(small):
    _, radar, session = small
    iq = records(8, **radar)
    given = {name: radar[name] for name in ("carrier_hz", "prf_hz")}
    for part in (iq.real, 1j * iq.imag, (1 + 1j) * iq.real, (1 - 1j) * iq.imag, iq.real + 3j, 1j * iq.imag - 3):
        probabilities, label = run(session, part.astype(np.complex64))
        np.testing.assert_array_equal(label, 3)
        np.testing.assert_allclose(probabilities, 1 / 3, rtol=1e-6)
    made = made_analytic(iq.real.astype(np.complex64))
    probabilities, _ = run(session, made)
    expected = Classifier.load("spectrum-cnn-fast").predict(iq.real.astype(np.complex64), **given)
    np.testing.assert_allclose(probabilities, expected.probabilities, atol=TOLERANCE)


def test_lost_pulses_are_unknown_and_what_a_converter_rounds_to_zero_is_none(small):
    _, radar, session = small
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((40, radar["pulses"], 2)).astype(np.float32).view(np.complex64)[..., 0]
    noise[20:] += 100 * np.exp(0.3j * np.arange(radar["pulses"]))  # nothing of a strong body is near 0
    lost = noise.copy()
    lost[:, [20, 90, 150]] = 0
    probabilities, label = run(session, lost)
    np.testing.assert_array_equal(label, 3)
    np.testing.assert_allclose(probabilities, 1 / 3, rtol=1e-6)
    for strength in (1e3, 1e4, 1e5):  # of a line at rest: all samples are nearly of one size
        probabilities, label = run(session, np.where(lost == 0, 0, noise + np.float32(strength)))
        np.testing.assert_array_equal(label, 3)
        np.testing.assert_allclose(probabilities, 1 / 3, rtol=1e-6)
    for first, pulses, is_whole in ((0, 2, True), (100, 2, True), (0, 33, False), (-33, 33, False), (100, 33, False)):
        silent = noise.copy()
        silent[:, first : first + pulses or None] = 0
        unjudged = np.abs(run(session, silent)[0] - 1 / 3).max(axis=1) < 1e-6
        assert unjudged.all() if not is_whole else not unjudged.any(), (first, pulses)
    for step in (0.02, 0.3, 1.0):  # of sigma
        rounded = np.round(noise[:20].view(np.float32) / step).view(np.complex64)
        judged = rounded.any(axis=1)
        set_right = (rounded.real + 1.03j * rounded.imag).astype(np.complex64)
        for given, least in ((rounded, 0.95), (set_right, 0.7)):  # of 200 pulses, fewer of which are of one size
            probabilities, _ = run(session, given)
            assert (np.abs(probabilities - 1 / 3).max(axis=1) > 0.01)[judged].mean() > least


def test_a_silence_among_a_converters_zeros_is_unknown(tmp_path):
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3, "pulses": 2000}
    rng = np.random.default_rng(4)
    rounded = np.round(5 * rng.standard_normal((20, 2000, 2))).astype(np.float32).view(np.complex64)[..., 0]
    export_raw_iq(tmp_path / "coarse.onnx", **radar, model="spectrum-cnn-fast")
    session = opened(tmp_path / "coarse.onnx")
    assert (np.abs(run(session, rounded)[0] - 1 / 3).max(axis=1) > 0.01).all()
    rounded[:, 70:103] = 0
    assert all(longest_silence(record)[1] for record in rounded)
    probabilities, label = run(session, rounded)
    np.testing.assert_array_equal(label, 3)
    np.testing.assert_allclose(probabilities, 1 / 3, rtol=1e-6)


def test_two_channels_of_one_bit_and_what_stands_still_are_judged_as_in_python(tmp_path):
    radar = {"carrier_hz": 6e9, "prf_hz": 3.5e3}
    iq = records(8, **radar, pulses=142)
    given = np.concatenate([np.sign(iq.real) + 1j * np.sign(iq.imag), np.full((1, 142), 5545 + 13862j)])
    given = given.astype(np.complex64)
    export_raw_iq(tmp_path / "few.onnx", **radar, pulses=142, model="spectrum-cnn-fast")
    probabilities, _ = run(opened(tmp_path / "few.onnx"), given)
    expected = Classifier.load("spectrum-cnn-fast").predict(given, **radar).probabilities
    assert (np.abs(expected - 1 / 3).max(axis=1) > 0.01).all()
    np.testing.assert_allclose(probabilities[:8], expected[:8], atol=TOLERANCE)
    np.testing.assert_allclose(probabilities[8], expected[8], atol=0.1)  # beside the line all is rounding


def test_the_file_says_what_it_is_for_and_shows_any_change(small):
    out, radar, _ = small
    content = out.read_bytes()
    verify(content)
    said = {entry.key: entry.value for entry in onnx.load_model_from_string(content).metadata_props}
    assert said["product"] == EXPORTED
    assert json.loads(said["labels"]) == LABELS.tolist()
    assert (float(said["carrier_hz"]), float(said["prf_hz"]), int(said["pulses"])) == tuple(radar.values())
    assert {"classes", "envelope", "accept", "schema_sha256", "model_sha256", "calibration"} <= set(said)
    with pytest.raises(BadInput, match="not a bladewing model"):
        Classifier.load(out)


def test_the_graph_needs_only_the_standard(small):
    out, *_ = small
    model = onnx.load_model_from_string(out.read_bytes())
    assert {entry.domain for entry in model.opset_import} <= {"", "ai.onnx.ml"}
    assert {node.domain for node in model.graph.node} <= {"", "ai.onnx.ml"}
    code = """
import sys, numpy, onnxruntime
session = onnxruntime.InferenceSession(sys.argv[1])
iq = numpy.ones((2, 200, 2), numpy.float32)
probabilities, label = session.run(["probabilities", "label"], {"iq": iq})
assert probabilities.shape == (2, 3) and label.shape == (2,)
assert not any(name.startswith("bladewing") for name in sys.modules)
"""
    subprocess.run([sys.executable, "-c", code, str(out)], check=True)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--prf-hz", "500"], "PRF 500 Hz is below 1000 Hz"),
        (["--pulses", "50"], "50 pulses are fewer than 64"),
        (["--carrier-hz", "1e9"], "carrier 1 GHz is outside"),
        (["--carrier-hz", "-1"], "carrier_hz is -1"),
        (["--model", "nothing"], "no model 'nothing'"),
    ],
)
def test_what_cannot_be_exported_is_refused_and_nothing_written(options, rule, tmp_path, capsys):
    out = tmp_path / "raw.onnx"
    given = ["--carrier-hz", "10e9", "--prf-hz", "20e3", "--pulses", "200", "--model", "spectrum-cnn-fast", *options]
    assert main(["export", str(out), *given]) == 2
    assert rule in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_model_of_an_stft_is_refused(make_model, tmp_path):
    of_stft = tmp_path / "joint.onnx"
    of_stft.write_bytes(make_model(input_name="joint_features", width=INPUT_SHAPES["joint_features"][0]))
    with pytest.raises(BadInput, match=r"joint\.onnx reads 'joint_features', of an STFT"):
        export_raw_iq(tmp_path / "raw.onnx", carrier_hz=10e9, prf_hz=20e3, pulses=200, model=of_stft)


@pytest.mark.parametrize("pulses", [200.0, "200", None])
def test_pulses_are_a_whole_number_of_any_type(tmp_path, pulses):
    radar = {"carrier_hz": 10e9, "prf_hz": 20e3, "model": "spectrum-cnn-fast"}
    with pytest.raises(BadInput, match=r"^pulses is ('?200(\.0)?'?|None): it must be a whole number$"):
        export_raw_iq(tmp_path / "none.onnx", **radar, pulses=pulses)
    export_raw_iq(tmp_path / "some.onnx", **radar, pulses=np.int32(200))
    assert [path.name for path in tmp_path.iterdir()] == ["some.onnx"]


def test_a_folder_that_is_missing_is_bad_input(tmp_path, capsys):
    given = ["--carrier-hz", "10e9", "--prf-hz", "20e3", "--pulses", "200", "--model", "spectrum-cnn-fast"]
    assert main(["export", str(tmp_path / "none" / "raw.onnx"), *given]) == 2
    assert "cannot be written: No such file or directory: make its folder first" in capsys.readouterr().err


def test_what_is_no_graph_is_not_written_over(tmp_path):
    recording = tmp_path / "cell.npy"
    recording.write_bytes(b"samples")
    with pytest.raises(BadInput, match=r"cell.npy: a graph's name ends in .onnx: give it such a name"):
        export_raw_iq(recording, carrier_hz=10e9, prf_hz=20e3, pulses=200, model="spectrum-cnn-fast")
    assert recording.read_bytes() == b"samples"


def test_a_trained_model_is_not_written_over_and_an_older_graph_is(small, tmp_path):
    radar = {"carrier_hz": 10e9, "prf_hz": 25e3, "pulses": 200, "model": "spectrum-cnn-fast"}
    content, _ = read_model("spectrum-cnn-fast")
    model = tmp_path / "model.onnx"
    model.write_bytes(content)
    with pytest.raises(BadInput, match=r"model\.onnx is there and is no exported graph: it is not written over"):
        export_raw_iq(model, **radar)
    assert model.read_bytes() == content
    graph = tmp_path / "graph.onnx"
    graph.write_bytes(small[0].read_bytes())
    export_raw_iq(graph, **radar)
    assert graph.read_bytes() != small[0].read_bytes()


def test_an_exported_graph_is_told_from_a_model(small):
    with pytest.raises(BadInput, match="an exported graph, for onnxruntime alone: give the model that it was made of"):
        Classifier.load(small[0])
