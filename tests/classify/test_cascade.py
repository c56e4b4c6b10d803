"""A cascade answers as its models do: the first where it is sure, the second elsewhere."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier, model_file
from bladewing.classify.cascade import SURE, Cascade
from bladewing.classify.ladder import CASCADE, PLACES, STAGES_KEY, shipped_account
from bladewing.classify.model_file import CURVE_KEY, model_names
from bladewing.classify.rules import Rules
from bladewing.features import model_inputs
from bladewing.models.operating import OperatingCurve
from bladewing.simulate import Radar, draw_records

RADAR = {"carrier_hz": 10e9, "prf_hz": 20e3}


@pytest.fixture(scope="module")
def records():
    """Records of every class of which some are clear and some are not."""
    return draw_records(Radar(10e9, 20e3, 700), 240, 5, purpose="bench").iq


@pytest.fixture(scope="module")
def cascade():
    return Classifier.load(CASCADE)


def test_the_first_answers_where_it_is_sure_and_the_second_elsewhere(cascade, records):
    first, second = (Classifier.load(name) for name in shipped_account()[CASCADE][STAGES_KEY])
    one, other, both = (model.predict(records, **RADAR) for model in (first, second, cascade))
    sure = (one.probabilities >= SURE).any(axis=1)
    assert 0.1 < sure.mean() < 0.9  # else nothing is tested
    np.testing.assert_array_equal(both.probabilities, np.where(sure[:, None], one.probabilities, other.probabilities))
    np.testing.assert_array_equal(both.labels[sure], one.labels[sure])
    np.testing.assert_array_equal(both.labels[~sure], other.labels[~sure])
    assert "unknown" not in both.labels[sure]


def test_the_second_is_asked_about_no_record_that_the_first_is_sure_of(cascade, records, monkeypatch):
    asked = []
    answered = Classifier._answer

    def answer(self, inputs):
        given = answered(self, inputs)
        asked.append((self is cascade, len(given), int(cascade.sure(given[:, :3]).sum())))
        return given

    monkeypatch.setattr(Classifier, "_answer", answer)
    cascade.predict(records, **RADAR)
    by_first = [row for row in asked if not row[0]]
    assert sum(count for _, count, _ in by_first) == len(records)
    assert sum(count for second, count, _ in asked if second) == len(records) - sum(sure for *_, sure in by_first)


def test_the_first_is_sure_of_nothing_that_either_would_not_name(cascade, monkeypatch):
    """With a rate of false alarms each has a threshold of its own, which may lie above `SURE`."""
    p = np.float32([[0.97, 0.02, 0.01]])
    assert SURE[0] < 0.97
    assert cascade.sure(p).all()
    for model in (cascade, cascade.first):
        with monkeypatch.context() as patch:
            patch.setattr(model, "accept", (0.98, *model.accept[1:]))
            assert not cascade.sure(p).any()
        with monkeypatch.context() as patch:  # nor where that depends on the number of pulses
            stricter = replace(model.rules.of(100), accept=(0.98, *model.accept[1:]))
            patch.setattr(model, "rules", Rules((stricter, *(rule for rule in model.rules.each if rule.pulses > 100))))
            assert not cascade.sure(p, 100).any()
            assert cascade.sure(p, 5000).all()
            assert cascade.sure(np.repeat(p, 2, axis=0), np.array([100, 5000])).tolist() == [False, True]


def test_inputs_that_are_made_are_answered_as_samples_are(cascade, records):
    inputs = model_inputs(records, **RADAR, names=cascade.inputs)
    np.testing.assert_array_equal(cascade.from_inputs(inputs), cascade.predict(records, **RADAR).probabilities)


def test_batch_equals_loop_bit_for_bit(cascade, records):
    batch = cascade.predict(records, **RADAR)
    for row in range(0, len(records), 7):
        np.testing.assert_array_equal(cascade.predict(records[row], **RADAR).probabilities, batch.probabilities[row])


def test_each_model_gets_half_of_the_false_alarms(records):
    given = Classifier.load(CASCADE, max_false_alarm=0.02)
    first, second = (Classifier.load(name, max_false_alarm=0.01) for name in shipped_account()[CASCADE][STAGES_KEY])
    assert given.accept == second.accept
    assert given.first.accept == first.accept
    assert given.operating_point.false_alarm == pytest.approx(0.02)
    said = given.predict(records, **RADAR)
    uav = said.labels == "uav"
    allowed = (first.predict(records, **RADAR).labels == "uav") | (second.predict(records, **RADAR).labels == "uav")
    assert uav.any()
    assert allowed[uav].all()


def test_a_rate_that_a_cascade_cannot_keep_is_told_as_it_was_asked_for():
    with pytest.raises(BadInput, match=r"cascade: false-alarm rate 1\.5: it must be above 0 and below 1"):
        Classifier.load(CASCADE, max_false_alarm=1.5)
    with pytest.raises(BadInput, match=r"cascade: false-alarm rate 1e-05 cannot") as caught:
        Classifier.load(CASCADE, max_false_alarm=1e-5)
    Classifier.load(CASCADE, max_false_alarm=float(re.search(r"ask for (\S+) or more", str(caught.value))[1]))


def test_a_budget_leads_to_one_model_where_a_coverage_is_asked_for(monkeypatch):
    monkeypatch.setattr(model_file, "measured_fft_us", lambda: 1.0)
    enough = shipped_account()[CASCADE]["cost_ffts"] + 0.01
    assert isinstance(Classifier.load(budget_us=enough), Cascade)
    assert Classifier.load(budget_us=enough, coverage=0.9).coverage == 0.9


def test_a_budget_leads_to_one_model_where_two_cannot_share_the_rate(monkeypatch):
    monkeypatch.setattr(model_file, "measured_fft_us", lambda: 1.0)
    enough = 1000.0
    rate = 1.5 * OperatingCurve.from_json(Classifier.load().metadata[CURVE_KEY]).points[-1].false_alarm
    with pytest.raises(BadInput, match=r"cascade: false-alarm rate .* cannot be supported"):
        Classifier.load(CASCADE, max_false_alarm=rate)
    found = Classifier.load(budget_us=enough, max_false_alarm=rate)
    assert not isinstance(found, Cascade)
    assert found.operating_point.false_alarm <= rate
    with pytest.raises(BadInput, match="cannot be supported"):
        Classifier.load(budget_us=enough, max_false_alarm=rate / 10)


def test_a_record_without_signal_and_one_outside_the_envelope_get_their_reasons(cascade):
    assert cascade.predict(np.zeros(300, complex), **RADAR).reasons.item().startswith("no signal")
    assert "PRF" in cascade.predict(np.ones(300, complex), carrier_hz=10e9, prf_hz=500.0).reasons.item()


def test_what_a_cascade_cannot_do_is_told_in_one_line(tmp_path, monkeypatch):
    from bladewing.classify.export import export_raw_iq

    with pytest.raises(BadInput, match=r"coverage of 0\.9.*prediction sets are those of one model: name one"):
        Classifier.load(CASCADE, coverage=0.9)
    with pytest.raises(BadInput, match=r"cascade: two models.*give one of them as --model"):
        export_raw_iq(tmp_path / "x.onnx", **RADAR, pulses=500, model=CASCADE)
    monkeypatch.setattr("bladewing.classify.cascade.shipped_account", dict)
    with pytest.raises(BadInput, match="tells of no 'cascade'"):
        Classifier.load(CASCADE)


def test_budgets_lead_to_the_cascade_but_not_to_export_it_and_places_to_models_of_one_file(monkeypatch):
    test = {"cheap": (5, 0.5), "dear": (9, 0.6), CASCADE: (7, 0.7)}
    accounts = {name: {"cost_ffts": cost, "test": {"balanced_accuracy": value}} for name, (cost, value) in test.items()}
    monkeypatch.setattr(model_file, "shipped_account", lambda: dict(accounts))
    monkeypatch.setattr(model_file, "measured_fft_us", lambda: 1.0)
    assert model_file.chosen_name(budget_us=10) == CASCADE
    assert model_file.chosen_name(budget_us=10, single=True) == "dear"
    assert model_file.chosen_name("best") == model_file.chosen_name("best", single=True) == "dear"


def test_a_place_is_the_same_model_with_prediction_sets():
    for place in PLACES:
        assert Classifier.load(place, coverage=0.9).name == Classifier.load(place).name != CASCADE


def test_the_shipped_account_tells_of_the_cascade_what_holds():
    account = shipped_account()[CASCADE]
    assert set(account[STAGES_KEY]) <= set(model_names())
    cascade = Classifier.load(CASCADE)
    assert isinstance(cascade, Cascade)
    assert list(cascade.accept) == account["accept"]
    assert json.loads(cascade.metadata["classes"]) == ["uav", "bird", "clutter"]
    single = {name: one for name, one in shipped_account().items() if name != CASCADE}
    assert (
        account["test"]["balanced_accuracy"] >= max(one["test"]["balanced_accuracy"] for one in single.values()) - 0.002
    )
    assert account["cost_ffts"] < single[account[STAGES_KEY][1]]["cost_ffts"]
