"""The front's parts: pictures, bounds, operations, and what is marked as not beaten."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.fft
from bladewing.classify.report import fft_against_stft as against_stft
from bladewing.classify.report import front, pictures
from bladewing.classify.report.detection_bound import detection_bound
from bladewing.classify.report.memory import peak_bytes
from bladewing.classify.report.operations import counted_transforms, network_operations
from bladewing.classify.report.words import limits, micros, millis, number, size
from bladewing.classify.timing import Laps, quote, ratio
from bladewing.simulate import Radar

RADAR = Radar(carrier_hz=9.85e9, prf_hz=25e3, pulses=2000)


def noise(count: int, pulses: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((count, 2 * pulses), dtype=np.float32).view(np.complex64)


@pytest.mark.parametrize("pulses", [125, 2000, 8000])
@pytest.mark.parametrize("name", list(pictures.PICTURES))
def test_a_picture_has_its_shape_and_a_batch_is_a_loop(name: str, pulses: int) -> None:
    picture, radar = pictures.PICTURES[name], Radar(9.85e9, 25e3, pulses)
    iq = noise(3, pulses)
    batch = pictures.in_blocks(picture.make, iq, radar)
    assert batch.shape == (3, *picture.shape)
    assert batch.dtype == np.float32
    assert np.isfinite(batch).all()
    np.testing.assert_allclose(batch, np.concatenate([picture.make(one[None], radar) for one in iq]), atol=1e-3)


@pytest.mark.parametrize("name", [name for name in pictures.PICTURES if name not in ("cadence", "cepstrogram")])
@pytest.mark.parametrize("velocity_mps", [-70.0, 45.0])
def test_a_line_stands_at_its_velocity_in_every_picture(name: str, velocity_mps: float) -> None:
    from bladewing.features.axis import axis_edges_mps

    tone = 10 * np.exp(-4j * np.pi * velocity_mps / RADAR.wavelength_m * RADAR.times_s)
    made = pictures.PICTURES[name].make((tone + noise(1, RADAR.pulses)).astype(np.complex64), RADAR)[0, 0]
    level = made if made.ndim == 1 else made.mean(axis=-1)
    edges = axis_edges_mps(len(level))
    # a window of 20 samples is 19 m/s wide: what counts is that the peak is where it should be, to half a main lobe
    best = (edges[np.argmax(level)] + edges[np.argmax(level) + 1]) / 2
    assert best == pytest.approx(velocity_mps, abs=10.0)


@pytest.mark.parametrize("name", list(pictures.PICTURES))
def test_what_recedes_is_the_mirror_of_what_approaches_in_a_picture_of_velocities_alone(name: str) -> None:
    picture, radar = pictures.PICTURES[name], Radar(9.85e9, 25e3, 2000)
    tone = 10 * np.exp(-4j * np.pi * 45.0 / radar.wavelength_m * radar.times_s)
    iq = (tone + noise(1, radar.pulses)).astype(np.complex64)
    one, other = picture.make(iq, radar), picture.make(iq.conj(), radar)
    away = np.abs(other - one).mean(), np.abs(other - np.flip(one, 2)).mean()
    assert picture.has_velocity == (away[1] < away[0])
    assert min(away) < 0.3 * max(away)


def test_a_swinging_line_stands_at_its_velocity_and_cadence() -> None:
    from bladewing.features.axis import axis_edges_mps

    swing = 1 + np.cos(2 * np.pi * 300.0 * RADAR.times_s)
    tone = 10 * swing * np.exp(-4j * np.pi * 45.0 / RADAR.wavelength_m * RADAR.times_s)
    made = pictures.cadence_picture((tone + noise(1, RADAR.pulses)).astype(np.complex64), RADAR)[0, 0]
    row, column = np.unravel_index(np.argmax(made), made.shape)
    edges = axis_edges_mps(pictures.IMAGE_BINS)
    assert edges[row] - 5 <= 45.0 <= edges[row + 1] + 5
    # frames of 4 ms every 0.4 ms: cadences reach half of 2500 Hz, in 32 groups
    assert column == pytest.approx(300.0 / (1250.0 / pictures.IMAGE_FRAMES), abs=1.5)


def test_a_comb_is_one_peak_of_the_cepstrogram_at_its_period() -> None:
    comb = sum(np.exp(2j * np.pi * 200.0 * order * RADAR.times_s) for order in range(-20, 21))
    made = pictures.cepstral_picture((3 * comb + noise(1, RADAR.pulses)).astype(np.complex64), RADAR)[0, 0]
    bins = round(pictures.joint.HERM_WINDOW_S * RADAR.prf_hz) // 2 + 1
    edges = np.geomspace(1, bins, pictures.IMAGE_BINS + 1)
    late = edges[:-1] > 40  # shorter periods hold the comb's own outline
    best = np.flatnonzero(late)[np.argmax(made.mean(axis=-1)[late])]
    assert edges[best] - 2 <= RADAR.prf_hz / 200.0 <= edges[best + 1] + 2


@pytest.mark.parametrize(("window", "overlap"), pictures.STFT_SETTINGS)
def test_a_pooled_stft_keeps_the_power_of_the_whole_one(window: int, overlap: float) -> None:
    iq = noise(1, 2000)[0]
    whole = np.abs(against_stft.stft(iq, window=window, overlap=overlap)) ** 2
    pooled = pictures._pooled_power(against_stft.frames(iq, window=window, overlap=overlap))
    assert pooled.shape == (pictures.IMAGE_FRAMES, against_stft.STFT_BINS)
    starts = np.arange(pictures.IMAGE_FRAMES) * len(whole) // pictures.IMAGE_FRAMES
    expected = [part.mean(axis=0) for part in np.split(whole, starts[1:])]
    np.testing.assert_allclose(pooled, expected, rtol=2e-4, atol=1e-4 * whole.max())


@pytest.mark.parametrize("bits", [32, 16, 8, 4])
def test_fewer_bits_err_by_half_a_step_at_most(bits: int) -> None:
    levels = np.random.default_rng(0).uniform(-20, 80, 1000).astype(np.float32)
    worst = {32: 0.0, 16: 0.5 * 2**-4, 8: 50 / 255, 4: 50 / 15}[bits]
    assert np.abs(pictures.quantised(levels, bits) - levels).max() <= worst + 1e-4
    assert len(np.unique(pictures.quantised(levels, bits))) <= 2 ** min(bits, 20)


@pytest.mark.parametrize(("lines", "snr_db"), [(0, -23.0), (30, -19.0), (60, -17.0), (120, -16.0)])
def test_the_bound_reaches_nine_in_ten_where_the_theory_says(lines: int, snr_db: float) -> None:
    # 2048 pulses, one false alarm in 100: worked out apart, to half a decibel
    below, above = detection_bound([snr_db - 1, snr_db + 0.5], pulses=2048, lines=lines, false_alarm_rate=0.01)
    assert below < 0.9 < above


def test_without_an_echo_the_bound_is_the_false_alarm_rate_and_it_rises() -> None:
    found = detection_bound(np.arange(-60.0, 0.0), pulses=500, lines=20, false_alarm_rate=0.01)
    assert found[0] == pytest.approx(0.01, rel=0.01)
    assert np.all(np.diff(found) >= -1e-12)
    assert found[-1] == pytest.approx(1.0)


def test_transforms_are_counted_as_they_run_and_left_as_they_were() -> None:
    before = scipy.fft.fft
    x = noise(3, 256)
    with counted_transforms() as counter:
        scipy.fft.fft(x, n=512, axis=-1)
        assert counter.total == 3 * 5 * 512 * 9
        np.fft.rfft(x.real)
        assert counter.total == 3 * 5 * 512 * 9 + 3 * 2.5 * 256 * 8
        np.fft.irfft(np.ones(129))
        assert counter.total == 3 * 5 * 512 * 9 + 4 * 2.5 * 256 * 8
    assert scipy.fft.fft is before


def test_operations_of_a_matrix_are_two_an_entry(make_model: Callable[..., bytes]) -> None:
    from bladewing.features.schema import INPUT_SHAPES

    assert network_operations(make_model()) == 2 * 3 * INPUT_SHAPES["features"][0]


def test_operations_of_a_convolution_and_of_trees() -> None:
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    def model(*nodes: Any, weights: Any = (), shape: tuple[int, ...], out: tuple[int, ...]) -> bytes:
        values = (("x", shape), ("y", out))
        x, y = (helper.make_tensor_value_info(n, TensorProto.FLOAT, ["batch", *s]) for n, s in values)
        opsets = [helper.make_opsetid("", 18), helper.make_opsetid("ai.onnx.ml", 3)]
        graph = helper.make_graph(list(nodes), "one", [x], [y], list(weights))
        made: bytes = onnx.helper.make_model(graph, opset_imports=opsets).SerializeToString()
        return made

    kernel = numpy_helper.from_array(np.zeros((5, 2, 3, 3), np.float32), "w")
    node = helper.make_node("Conv", ["x", "w"], ["y"], strides=[2, 2], pads=[1, 1, 1, 1])
    # 5 maps of 4 x 3 places, each 2 x 3 x 3 multiplications and as many additions
    assert network_operations(model(node, weights=[kernel], shape=(2, 8, 6), out=(5, 4, 3))) == 2 * 5 * 4 * 3 * 2 * 9
    # weights stored in half, or in bytes and steps, count no less
    half = numpy_helper.from_array(np.zeros((5, 2, 3, 3), np.float16), "half")
    cast = helper.make_node("Cast", ["half"], ["w"], to=TensorProto.FLOAT)
    stored = model(cast, node, weights=[half], shape=(2, 8, 6), out=(5, 4, 3))
    assert network_operations(stored) == 2 * 5 * 4 * 3 * 2 * 9
    parts = [("bytes", np.zeros((5, 2, 3, 3), np.int8)), ("steps", np.zeros((5, 1, 1, 1), np.float32))]
    widened = [
        helper.make_node("Cast", ["bytes"], ["whole"], to=TensorProto.FLOAT),
        helper.make_node("Mul", ["whole", "steps"], ["w"]),
    ]
    kept = [numpy_helper.from_array(values, name) for name, values in parts]
    assert (
        network_operations(model(*widened, node, weights=kept, shape=(2, 8, 6), out=(5, 4, 3))) == 2 * 5 * 4 * 3 * 2 * 9
    )
    # one tree, left leaf after one comparison, two right ones after two: 5 / 3 in the mean, and one addition
    tree = helper.make_node(
        "TreeEnsembleRegressor",
        ["x"],
        ["y"],
        domain="ai.onnx.ml",
        nodes_treeids=[0] * 5,
        nodes_nodeids=[0, 1, 2, 3, 4],
        nodes_truenodeids=[1, 0, 3, 0, 0],
        nodes_falsenodeids=[2, 0, 4, 0, 0],
        nodes_modes=["BRANCH_LEQ", "LEAF", "BRANCH_LEQ", "LEAF", "LEAF"],
    )
    assert network_operations(model(tree, shape=(1,), out=(1,))) == pytest.approx(5 / 3 + 1)


@pytest.mark.parametrize(("dtype", "said"), [("int8", "int8"), ("float16", "float16"), ("float32", "float32")])
def test_weights_are_named_by_their_smallest_type(dtype: str, said: str) -> None:
    from onnx import TensorProto, helper, numpy_helper

    weights = [numpy_helper.from_array(np.zeros(3, kind), kind) for kind in {"float32", dtype}]
    out = helper.make_tensor_value_info("float32", TensorProto.FLOAT, [3])
    graph = helper.make_graph([], "one", [], [out], weights)
    assert front._weights(helper.make_model(graph).SerializeToString()) == said


def hold(count: int) -> Callable[[], object]:
    return lambda: np.ones(count)


def test_peak_memory_is_that_of_the_work() -> None:
    found = peak_bytes(hold, 8_000_000)
    if found is None:
        pytest.skip("the system does not tell")
    assert 60e6 <= found < 80e6


def test_a_ratio_lies_within_its_spread() -> None:
    base = Laps([1.0, 2.0, 1.0, 2.0, 1.0], [])
    found = ratio(Laps([3.0, 6.0, 3.0, 8.0, 3.0], []), base)
    assert found == {"ratio_to_fft": 3.0, "ratio_low": 3.0, "ratio_high": pytest.approx(3.6)}


def test_of_pieces_of_different_cost_that_take_turns_the_mean_is_typical() -> None:
    # a cascade: of four records one costs ten times the others; the median of all laps hid it
    laps = Laps([1.0, 1.0, 1.0, 10.0] * 5 + [1.0], [1.0, 1.0, 1.0, 10.0] * 5 + [1.0])
    found = quote(laps, turns=4)
    assert found["median_us"] == found["passed_us"] == pytest.approx(3.25e6)
    base = Laps([1.0] * 21, [])
    assert ratio(laps, base, turns=4)["ratio_to_fft"] == pytest.approx(3.25)
    assert quote(Laps([2.0, 4.0], [2.0, 4.0]), turns=64)["median_us"] == pytest.approx(3e6)  # fewer rounds than pieces


@pytest.mark.parametrize(
    ("said", "text"),
    [
        (number(999.5), "1000"), (number(-0.001234), "\u22120.00123"), (micros(999.7), "1\u00a0ms"),
        (micros(999.4), "999\u00a0\u00b5s"), (size(999_700), "1\u00a0MB"), (size(12), "12\u00a0B"),
        (millis(0.9996), "1000\u00a0ms"), (number(123_456), "123000"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits_and_the_unit_of_what_is_shown(said: str, text: str) -> None:
    assert said == text


def test_the_front_holds_every_choice_at_every_dwell(report: dict[str, Any]) -> None:
    rows = report["front"]["choices"]
    models = ["spectrum-cnn-wide", "always-uav", "spectrum-cnn-wide-int8-trial", "cascade"]
    assert [row["name"] for row in rows] == ["spectrum", "stft-80-90", "features", *models]
    for row in rows:
        assert [point["dwell_s"] for point in row["dwells"]] == report["front"]["dwells_s"]
        assert row["stored_bytes_per_million"] == 1_000_000 * row["stored_bytes"]
        for point in row["dwells"]:
            assert [cost["batch"] for cost in point["cost"]] == [1, 64]
            assert all(cost["ratio_low"] <= cost["ratio_to_fft"] <= cost["ratio_high"] for cost in point["cost"])
            assert point["operations"] > 0
    weights = {(row["bins"], row["bits"]): row["bytes"] for row in report["front"]["stored"]}
    assert weights[64, 4] == 64
    assert weights[1024, 32] == 8192
    assert len(weights) == 8


def test_a_cascade_weighs_what_its_models_weigh(report: dict[str, Any]) -> None:
    rows = {row["name"]: row for row in report["front"]["choices"]}
    first, second, both = (rows[name] for name in ("spectrum-cnn-wide", "always-uav", "cascade"))
    assert both["model_bytes"] == first["model_bytes"] + second["model_bytes"]
    assert both["model_operations"] == first["model_operations"] + second["model_operations"]


def test_a_cascade_stands_on_the_front_only_where_both_its_models_are_given() -> None:
    from bladewing.classify.report import run

    of_account = run._cascade
    reads = {"a": ("levels", "cadence"), "b": ("cadence", "features")}
    models = {name: front.Given((name.encode(),), inputs, 1.0) for name, inputs in reads.items()}
    told = {"cascade": {"stages": ["a", "b"]}}
    both = of_account(models, told)["cascade"]
    assert (both.files, both.inputs) == ((b"a", b"b"), ("levels", "cadence", "features"))
    for account in (None, {}, {"cascade": None}, {"cascade": {"stages": ["a", "c"]}}):
        assert of_account(models, account) == {}


def test_no_two_choices_look_alike() -> None:
    from bladewing.classify.report.series import choice_looks
    from bladewing.models import LADDER

    rows = [{"name": name, "kind": "picture"} for name in pictures.PICTURES]
    names = (*LADDER, "spectrum-cnn-wide-int8-trial", "cascade")
    rows += [{"name": "features", "kind": "features"}, *({"name": name, "kind": "model"} for name in names)]
    assert len(set(choice_looks(rows).values())) == len(rows)


def test_choices_of_a_page_of_the_shipped_models_have_colours_of_their_own_whatever_else_is_on_it() -> None:
    from bladewing.classify.ladder import CASCADE
    from bladewing.classify.report.series import EIGHT_BITS, choice_looks

    shipped = ("spectrum-cnn-fast", "spectrum-cnn", "spectrum-cnn-wide", EIGHT_BITS, CASCADE)
    models = [{"name": name, "kind": "model"} for name in shipped]
    pages = [{"name": name, "kind": "picture"} for name in pictures.PICTURES] + [
        {"name": "features", "kind": "features"}
    ]
    drawn = choice_looks([*pages, *models])
    families = {name: look.number for (name, kind), look in drawn.items() if not name.startswith("stft")}
    assert len({*families.values(), drawn["stft-80-90", "picture"].number}) == len(families) + 1
    for rows in (pages[:1] + models[1:], pages[3:] + models[:1]):
        assert all(look.number == drawn[key].number for key, look in choice_looks(rows).items())


def test_the_page_says_what_the_model_in_eight_bits_is(report_folder: Path) -> None:
    page = (report_folder / "report.html").read_text(encoding="utf-8")
    assert "“spectrum-cnn-wide-int8-trial” is the default model with its products in eight bits" in page


def test_what_is_marked_is_not_beaten_and_a_budget_buys_the_best_within(report: dict[str, Any]) -> None:
    points = [(row, point) for row in report["front"]["choices"] for point in row["dwells"]]
    for place, batch in enumerate((1, 64)):
        spots = [(p["cost"][place]["median_us"], p["balanced_accuracy"]["value"]) for _, p in points]
        for (cost, value), (_, point) in zip(spots, points, strict=True):
            beaten = any(c <= cost and v >= value and (c, v) != (cost, value) for c, v in spots)
            assert point["cost"][place]["front"] is not beaten
        for budget_us in (1e-9, 1e9, float(np.median([cost for cost, _ in spots]))):
            found = front._budget(report["front"]["choices"], place, budget_us)
            within = [point for (cost, _), (_, point) in zip(spots, points, strict=True) if cost <= budget_us]
            assert found["batch"] == batch
            assert (found["choice"] is None) is (not within)
            if within:
                best = max(point["chosen_by"]["value"] for point in within)
                quoted = [point["quoted"] for point in within if point["chosen_by"]["value"] == best]
                assert {key: found[key] for key in ("balanced_accuracy", "uav_found")} in quoted


def test_a_choice_is_made_on_other_records_than_it_is_quoted_on() -> None:
    places = len(front.DWELLS_S)
    labels, dwell = np.tile(np.repeat(np.arange(3), 40), places), np.repeat(np.arange(places), 120)
    lucky = np.arange(len(labels)) % 2 == 0  # right on one half, always "uav" on the other
    probabilities = np.where(lucky[:, None], np.eye(3)[labels], np.eye(3)[0]).astype(np.float32)
    point = front._by_dwell(front.FrontSet({}, labels, np.full(len(labels), 5.0), dwell), probabilities)["dwells"][0]
    assert point["chosen_by"]["value"] == 1.0
    assert point["quoted"]["balanced_accuracy"]["value"] == pytest.approx(1 / 3)
    assert point["balanced_accuracy"]["value"] == pytest.approx(2 / 3)


def test_time_to_declare_is_the_first_dwell_that_finds_enough() -> None:
    places = len(front.DWELLS_S)
    labels = np.tile(np.arange(3), 40 * places)
    dwell = np.repeat(np.arange(places), 120)
    snr_db = np.where(labels == 0, 10.0, np.nan)
    # the score parts the classes from the third dwell on
    score = np.where((labels == 0) & (dwell >= 2), 0.9, 0.1)
    probabilities = np.stack([score, (1 - score) / 2, (1 - score) / 2], axis=1)
    found = front._by_dwell(front.FrontSet({}, labels, snr_db, dwell), probabilities)
    assert found["declare_s"] == [front.DWELLS_S[2]] * 2
    never = front._by_dwell(front.FrontSet({}, labels, np.where(labels == 0, -10.0, np.nan), dwell), probabilities)
    assert never["declare_s"] == [None, None]


def test_law_is_found_again_from_times_that_follow_it() -> None:
    points = [{"operations": n, "time_us": 4.0 + 2e-4 * n} for n in (1e3, 1e4, 1e5, 1e6)]
    found = against_stft._fitted(copy.deepcopy(points))
    assert (found["call_us"], found["ns_each"]) == pytest.approx((4.0, 0.2))
    assert found["worst_factor"] == pytest.approx(1.0)


def test_curves_that_are_not_drawn_are_not_described_and_the_cure_is_named(report_folder: Path) -> None:
    page = (report_folder / "report.html").read_text(encoding="utf-8")
    assert "Not drawn: " in page
    assert "(dashed)" not in page
    assert "leave <code>--quick</code> out, or set <code>front_test</code>" in page


def test_stored_bytes_are_numbered_in_whole_bytes(report: dict[str, Any]) -> None:
    from bladewing.classify.report.draw_front import stored

    svg = stored(report)[0].svg
    assert ">1024</text>" in svg
    assert ">bytes a record</text>" in svg


def test_thresholds_are_written_as_the_range_that_they_span():
    assert [limits(of) for of in ([0.5], [0.874, 0.5, 0.718], [0.9, 1.01], [1.01, 1.01])] == [
        *("50", "50\u201387", "90\u2013never", "never")
    ]
