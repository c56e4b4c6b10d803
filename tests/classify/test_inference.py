import copy
import json
import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier, Recording, inference, model_file
from bladewing.classify.model_file import chosen_name, model_names
from bladewing.features import model_inputs
from bladewing.models import DEFAULT_MODEL
from bladewing.models.calibration import NEVER
from bladewing.simulate import Radar, draw_records
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from .conftest import noise

RADAR = {"carrier_hz": 10e9, "prf_hz": 20e3}


@pytest.fixture(scope="module")
def always_uav(uav_model):
    return Classifier.load(uav_model)


@pytest.fixture(scope="module")
def mixed(mixed_model):
    return Classifier.load(mixed_model)


def test_answers_have_the_leading_axes_of_the_samples(mixed):
    for leading in [(), (1,), (3,), (2, 3), (0,), (2, 0)]:
        answer = mixed.predict(noise(200, leading), **RADAR)
        assert answer.labels.shape == leading
        assert answer.reasons.shape == leading
        assert answer.probabilities.shape == (*leading, 3)
        assert answer.probabilities.dtype == np.float32


@settings(max_examples=15, deadline=None)
@given(pulses=st.integers(100, 400), records=st.integers(1, 5), seed=st.integers(0, 99))
def test_a_batch_gives_what_a_loop_gives(mixed, pulses, records, seed):
    iq = noise(pulses, (records,), seed)
    batch, loop = mixed.predict(iq, **RADAR), [mixed.predict(one, **RADAR) for one in iq]
    np.testing.assert_allclose(batch.probabilities, [one.probabilities for one in loop], atol=1e-5)


def test_inputs_of_any_number_and_precision_are_run_a_bounded_number_at_a_time(mixed, monkeypatch):
    made = model_inputs(noise(200, (7,)), **RADAR, names=mixed.inputs)
    half = {name: values.astype(np.float16) for name, values in made.items()}
    whole = mixed.from_inputs(half)
    monkeypatch.setattr(inference, "_STEP_INPUTS", 3)
    np.testing.assert_allclose(mixed.from_inputs(half), whole, atol=1e-6)
    none = {name: values[:0] for name, values in half.items()}
    assert mixed.from_inputs(none).shape == (0, 3)


@pytest.mark.parametrize("limit", ["_STEP_RECORDS", "_STEP_SAMPLES"])
def test_the_size_of_the_steps_changes_nothing(mixed, monkeypatch, limit):
    iq = noise(200, (10,))
    iq[4] = 0
    whole = mixed.predict(iq, **RADAR)
    monkeypatch.setattr(inference, limit, {"_STEP_RECORDS": 3, "_STEP_SAMPLES": 500}[limit])
    parts = mixed.predict(iq, **RADAR)
    np.testing.assert_allclose(parts.probabilities, whole.probabilities, atol=1e-5)
    np.testing.assert_array_equal(parts.labels, whole.labels)
    assert len(set(map(tuple, whole.probabilities))) == 10  # the records do differ


def test_a_step_is_bounded_in_records_and_samples(mixed, monkeypatch):
    sizes = []
    real = inference.dwells_of

    def spy(iq, **options):
        sizes.append(iq.shape)
        return real(iq, **options)

    monkeypatch.setattr(inference, "dwells_of", spy)
    mixed.predict(noise(100, (600,)), **RADAR)
    assert [records for records, _ in sizes] == [256, 256, 88]
    sizes.clear()
    monkeypatch.setattr(inference, "_STEP_SAMPLES", 250)
    mixed.predict(noise(100, (3,)), **RADAR)
    assert [records for records, _ in sizes] == [2, 1]


@pytest.mark.parametrize("gain", [1e-30, 1e-6, 1e6, 1e30])
def test_the_gain_does_not_matter(mixed, gain):
    iq = noise(300, (4,))
    one, other = mixed.predict(iq, **RADAR), mixed.predict(iq * np.float32(gain), **RADAR)
    np.testing.assert_allclose(one.probabilities, other.probabilities, atol=1e-3)


def test_the_winner_is_named_with_its_probability(always_uav):
    answer = always_uav.predict(noise(200), **RADAR)
    assert (answer.labels, answer.reasons) == ("uav", "")
    np.testing.assert_allclose(answer.probabilities, [0.8, 0.15, 0.05], rtol=1e-5)


@pytest.mark.parametrize(
    ("probabilities", "label", "reason"),
    [
        ((0.48, 0.32, 0.20), "unknown", "not sure: best uav 0.48 < 0.62"),
        ((0.63, 0.20, 0.17), "uav", ""),
        ((0.30, 0.50, 0.20), "bird", ""),
        ((0.30, 0.20, 0.50), "unknown", "not sure: best clutter 0.50 < 0.90"),
    ],
)
def test_each_class_has_its_own_limit(make_model, probabilities, label, reason):
    model = Classifier(make_model(bias=np.log(probabilities), accept=json.dumps([0.62, 0.45, 0.9])))
    answer = model.predict(noise(200), **RADAR)
    assert (answer.labels, answer.reasons) == (label, reason)
    np.testing.assert_allclose(answer.probabilities, probabilities, rtol=1e-4)


def test_a_class_that_the_model_never_names_is_told_as_such(make_model):
    model = Classifier(make_model(bias=np.log((0.2, 0.2, 0.6)), accept=json.dumps([0.62, 0.45, NEVER])))
    answer = model.predict(noise(200), **RADAR)
    said = "best clutter 0.60, but no threshold of this model is precise enough to name it: train with more records"
    assert (answer.labels, answer.reasons) == ("unknown", f"not sure: {said}")


def test_answers_compare_as_objects_do(always_uav):
    one, other = (always_uav.predict(noise(200), **RADAR) for _ in range(2))
    assert one == one
    assert one != other
    assert one in [other, one]


@pytest.mark.parametrize("copied", [pickle.dumps, copy.deepcopy])
def test_a_classifier_says_why_it_is_not_handed_to_another_process(always_uav, copied):
    with pytest.raises(TypeError, match=r"load it in each process, Classifier\.load"):
        copied(always_uav)


def test_a_model_without_kinds_tells_of_no_noise(mixed):
    answer = mixed.predict(noise(200, (2, 3)), **RADAR)
    assert answer.noise.shape == (2, 3)
    assert np.isnan(answer.noise).all()


@pytest.mark.parametrize("name", [None, "fast", "best", "cascade"])
def test_shipped_models_tell_of_noise_where_there_is_nothing_else(name):
    model = Classifier.load(name)
    radar = Radar(9.85e9, 25e3, 2048)
    drawn, uav = (draw_records(radar, 200, 0, purpose="bench", kind=kind) for kind in ("noise", "quadcopter"))
    nothing = np.isnan(drawn.truth["background_db"])
    iq = np.concatenate(
        [drawn.iq[nothing][:60], drawn.iq[~nothing][:60], uav.iq[:60], np.zeros((1, 2048), np.complex64)]
    )
    answer = model.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    assert np.isnan(answer.noise[-1])
    told, rest = answer.noise[:-1], answer.probabilities[:-1]
    assert np.all((told >= 0) & (told <= rest[:, 2] + 1e-6))
    empty, ground, uav_told = told.reshape(3, 60)
    assert np.median(empty) > 0.3 > 30 * np.median(uav_told)
    assert np.median(empty) > 3 * np.median(ground)
    alone = model.predict(iq[7], carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    assert alone.noise.shape == ()
    np.testing.assert_array_equal(alone.noise, told[7])


@pytest.mark.parametrize(
    "kinds", ["[]", '{"drone": "plane"}', '{"noise": "clutter", "drone": "uav"}', '{"drone": "uav"}', "7", "{"]
)
def test_kinds_that_do_not_fit_are_refused(make_model, kinds):
    with pytest.raises(BadInput, match=r"kinds.*train it again"):
        Classifier(make_model(kinds=kinds))


def test_outside_the_envelope_every_record_is_unknown_with_the_cure(always_uav):
    answer = always_uav.predict(noise(200, (2, 3)), carrier_hz=9.39e9, prf_hz=1000.0)
    assert set(answer.labels.flat) == {"unknown"}
    np.testing.assert_allclose(answer.probabilities, 1 / 3)
    assert set(answer.reasons.flat) == {
        "unambiguous velocity 8.0 m/s is below 10 m/s (wavelength x PRF / 4): raise the PRF to 1253 Hz or more"
    }


@pytest.mark.parametrize("pulses", [1, 2, 15, 63])
def test_too_few_pulses_are_unknown_not_an_error(always_uav, pulses):
    answer = always_uav.predict(noise(pulses), **RADAR)
    assert answer.labels == "unknown"
    few = "1 pulse is" if pulses == 1 else f"{pulses} pulses are"
    assert str(answer.reasons).startswith(f"{few} fewer than 64: take 100 pulses")


def test_the_envelope_is_the_models_own(make_model):
    limits = json.loads(inference.Envelope().to_json()) | {"prf_min_hz": 30e3}
    answer = Classifier(make_model(envelope=json.dumps(limits))).predict(noise(200), **RADAR)
    assert answer.reasons == "PRF 20000 Hz is below 30000 Hz: raise the PRF to 30000 Hz or more"


def test_a_record_of_zeros_is_unknown_and_leaves_the_others_alone(always_uav):
    iq = noise(200, (3,))
    iq[1] = 0
    answer = always_uav.predict(iq, **RADAR)
    assert list(answer.labels) == ["uav", "unknown", "uav"]
    assert list(answer.reasons) == ["", "no signal: every sample is 0", ""]
    np.testing.assert_allclose(answer.probabilities[1], 1 / 3)


@pytest.mark.parametrize(
    ("iq", "said"),
    [
        (np.ones(200), r"iq: real samples \(float64\): IQ must be complex, .*, neither magnitude nor dB: of I"),
        ([1, 2, 3], r"iq: real samples \(int64\)"),
        (np.ones((200, 2), np.int16), r"real samples of shape \(200, 2\).*: store x\[..., 0\] \+ 1j \* x\[..., 1\]"),
        ([[1j], [1j, 2j]], "iq: rows of unequal length: every record must have as many pulses"),
        (np.r_[noise(99), np.nan], r"iq: sample 99 is .*nan.*must be finite"),
        (np.stack([noise(70), np.r_[noise(69), np.inf]]), r"iq: sample \(1, 69\) is .*inf"),
        (np.complex64(1), r"iq has shape \(\): it must be \(..., pulses\)"),
        (noise(0), r"iq has shape \(0,\)"),
        (noise(0, (3,)), r"iq has shape \(3, 0\)"),
        (np.array([1j] * 100, dtype=object), "iq: an array of Python objects"),
        ("drone.npy", "iq: samples of type <U9"),
        (np.ma.masked_less(noise(200).real, 0) + 0j, r"iq: \d+ samples are masked: .*interpolate them"),
    ],
)
def test_bad_samples_are_refused(always_uav, iq, said):
    with pytest.raises(BadInput, match=said):
        always_uav.predict(iq, **RADAR)


@pytest.mark.parametrize("value", [0, -1.0, float("nan"), float("inf"), "9.85e9", None, True])
@pytest.mark.parametrize("name", ["carrier_hz", "prf_hz"])
def test_bad_frequencies_are_refused(always_uav, name, value):
    with pytest.raises(BadInput, match=f"{name} is .*above 0"):
        always_uav.predict(noise(200), **(RADAR | {name: value}))


def test_samples_may_be_lists_and_complex128(always_uav):
    iq = noise(200)
    for given_iq in (iq.tolist(), np.ma.array(iq), iq.astype(complex), np.asfortranarray(noise(200, (2,))), iq[::-1]):
        assert np.all(always_uav.predict(given_iq, **RADAR).labels == "uav")


def test_predict_leaves_the_samples_as_they_were(mixed):
    iq = noise(200, (2,))
    iq.flags.writeable = False
    mixed.predict(iq, **RADAR)
    np.testing.assert_array_equal(iq, noise(200, (2,)))


def test_a_loaded_model_says_what_it_is(always_uav):
    assert always_uav.classes == ("uav", "bird", "clutter")
    assert always_uav.metadata["name"] == "tiny"
    assert always_uav.inputs == ("features",)
    assert always_uav.accept == (0.6, 0.6, 0.6)
    assert always_uav.envelope == inference.Envelope()


def _flip(content: bytes, at: int) -> bytes:
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


@pytest.mark.parametrize("where", [0.1, 0.5, 0.9])
def test_an_altered_model_is_refused_before_a_session_is_made(make_model, monkeypatch, where):
    def no_session(*_, **__):
        raise AssertionError("a session was made of an unverified file")

    monkeypatch.setattr(model_file.onnxruntime, "InferenceSession", no_session)
    content = make_model()
    with pytest.raises(BadInput, match=r"x\.onnx: the model was altered after it was written"):
        Classifier(_flip(content, int(where * len(content) * 0.5)), source="x.onnx")
    for foreign in (b"", b"not onnx", make_model(sealed=False)[:200], make_model(sealed=False, bladewing_sha256=None)):
        with pytest.raises(BadInput, match=r"x\.onnx: not a bladewing model"):
            Classifier(foreign, source="x.onnx")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"product": "other"}, "not a bladewing model: its product is 'other'"),
        ({"product": None}, "not a bladewing model: its product is None"),
        ({"format": "2"}, "model format '2', this version reads '1': train it again"),
        ({"schema_sha256": "ab" * 32}, r"trained on other measurements .* \(schema abababababab, here"),
        ({"schema_sha256": None}, "trained on other measurements"),
        ({"classes": '["bird", "uav", "clutter"]'}, "damaged metadata: classes are"),
        ({"classes": None}, "damaged metadata: 'classes'"),
        ({"accept": "[0.5, 0.5]"}, "damaged metadata"),
        ({"accept": "[0.5, 0.5, NaN]"}, "damaged metadata: accept is"),
        ({"accept": "soon"}, "damaged metadata"),
        ({"envelope": "{}"}, "damaged metadata: the envelope must hold"),
        ({"input_name": "raw"}, r"input 'raw' of shape \('batch', \d+\): this version gives"),
        ({"width": 3}, r"input 'features' of shape \('batch', 3\): this version gives"),
    ],
)
def test_a_model_for_another_version_is_refused(make_model, change, said):
    with pytest.raises(BadInput, match=f"x.onnx: {said}") as caught:
        Classifier(make_model(**change), source="x.onnx")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("threads", [0, -1, 1.5, "2", True])
def test_threads_must_be_a_whole_number(uav_model, threads):
    with pytest.raises(BadInput, match=r"threads is .*whole number"):
        Classifier.load(uav_model, threads=threads)


def test_two_threads_answer_as_one(mixed, mixed_model):
    iq = noise(200, (20,))
    two = Classifier.load(mixed_model, threads=2).predict(iq, **RADAR)
    np.testing.assert_allclose(two.probabilities, mixed.predict(iq, **RADAR).probabilities, atol=1e-5)


def test_names_and_paths_that_lead_nowhere(tmp_path):
    for wrong in ("spectrum-cmm", "no/such.onnx", tmp_path / "gone.onnx"):
        with pytest.raises(
            BadInput, match=f"no model '{os.fspath(wrong)}'.*shipped: {', '.join(model_names())}; or cascade, fast"
        ):
            Classifier.load(wrong)
    with pytest.raises(BadInput, match=r"is a directory: name the \.onnx file in it"):
        Classifier.load(tmp_path)
    (tmp_path / "x.onnx").write_bytes(b"x")
    with pytest.raises(BadInput, match="not a bladewing model"):
        Classifier.load(tmp_path / "x.onnx")


def test_every_shipped_model_loads_and_answers():
    if not model_names():
        pytest.skip("no model is shipped in this checkout: `make train` writes them")
    assert model_names()[0] == Classifier.load().name == DEFAULT_MODEL == chosen_name("best")
    for name in model_names():
        model = Classifier.load(name)
        assert model.metadata["name"] == name
        answer = model.predict(noise(1600, (2,)), **RADAR)
        np.testing.assert_allclose(answer.probabilities.sum(axis=-1), 1, atol=1e-5)


@pytest.mark.parametrize("times", [10, 100])
def test_one_pulse_that_interference_hit_costs_no_name(times):
    """Of 100 times the rms, in one pulse of 2048, three of four UAVs had lost theirs."""
    radar = Radar(9.85e9, 25e3, 2048)
    records = draw_records(radar, 96, 3, purpose="bench")
    uavs = records.iq[(records.labels == "uav") & (records.truth["snr_db"] > 5)]
    classifier, axes = Classifier.load(), {"carrier_hz": radar.carrier_hz, "prf_hz": radar.prf_hz}
    hit = uavs.copy()
    hit[:, 700] += times * np.sqrt(np.mean(np.abs(uavs) ** 2, axis=-1)).astype(np.float32)
    before, after = (classifier.predict(iq, **axes) for iq in (uavs, hit))
    named = before.labels == "uav"
    assert named.sum() >= 10
    assert np.mean(after.labels[named] == "uav") >= 0.9
    assert np.median(np.abs(after.probabilities - before.probabilities)) < 0.02
    every = [classifier.predict(one, **axes).probabilities for one in hit]
    np.testing.assert_allclose(after.probabilities, every, atol=1e-5)


@pytest.mark.parametrize("share", [0.8, 0.6, 0.4])
def test_noise_behind_a_filter_is_no_rotor(share):
    """Oversampled or resampled, it was a UAV in all of 100 records, most with a probability above 0.9."""
    taps = signal.firwin(201, share)
    records = np.stack([np.convolve(noise(2248, (), seed), taps, mode="valid") for seed in range(30)])
    answer = Classifier.load().predict(records.astype(np.complex64), carrier_hz=9.85e9, prf_hz=25e3)
    assert np.mean(answer.labels == "uav") <= 0.05
    assert answer.probabilities[:, 0].max() < 0.9


def test_eight_threads_share_a_classifier_and_get_the_same_answers():
    classifier = Classifier.load()
    # radars and lengths differ, so that what is kept of each is made while others use it
    jobs = [
        (noise(pulses, (3,), seed=pulses), carrier_hz)
        for pulses in (200, 211, 256, 300)
        for carrier_hz in (9e9, 9.5e9, 10e9, 11e9)
    ]

    def ask(job):
        return classifier.predict(job[0], carrier_hz=job[1], prf_hz=20e3).probabilities

    alone = [ask(job) for job in jobs]
    with ThreadPoolExecutor(8) as threads:
        together = list(threads.map(ask, jobs * 8))
    for number, answer in enumerate(together):
        np.testing.assert_array_equal(answer, alone[number % len(jobs)])


@pytest.mark.parametrize("gain", [1e-44, 1e-45])
def test_samples_without_digits_are_unknown_with_the_reason(uav_model, gain):
    answer = Classifier.load(uav_model).predict(noise(200, (2,)).astype(complex) * gain, **RADAR)
    assert set(answer.labels) == {"unknown"}
    assert all("no digits left in float32" in reason for reason in answer.reasons)


def test_frequencies_and_threads_may_be_numbers_of_any_kind(always_uav):
    """As `.npz` files and pandas give them."""
    for carrier_hz, prf_hz in ((np.array(9.85e9), np.array(20_000)), (Fraction(9_850_000_000), np.float32(20e3))):
        assert np.all(always_uav.predict(noise(200), carrier_hz=carrier_hz, prf_hz=prf_hz).labels == "uav")
    with pytest.raises(BadInput, match=r"carrier_hz is .*above 0"):
        always_uav.predict(noise(200), carrier_hz=np.array([9.85e9]), prf_hz=20e3)
    assert Classifier.load(threads=np.int64(1)).classes == always_uav.classes


def test_a_recording_is_not_its_samples(mixed_model):
    recording = Recording("x", noise(2000), 9.85e9, 25e3)
    said = r"^iq is a Recording: give recording\.dwells\(0\.08\), or call answer\(recording, classifier\)$"
    with pytest.raises(BadInput, match=said):
        Classifier.load(mixed_model).predict(recording, carrier_hz=9.85e9, prf_hz=25e3)
