"""Thresholds by how many pulses a record has: what they promise holds of short records and of long ones."""

import json

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier
from bladewing.classify.export import export_raw_iq
from bladewing.classify.labels import CLASSES
from bladewing.classify.model_file import COVERAGES, model_names
from bladewing.classify.rules import COUNTED_MPS, LEAST_RECORDS, LIKELIER, PULSES_FROM, Rule, Rules, counted_pulses
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS
from hypothesis import given
from hypothesis import strategies as st
from onnxruntime import InferenceSession

from .conftest import noise

PRECISION, FALSE_ALARM = 0.9, 0.01
NARROW = {"carrier_hz": 24e9, "prf_hz": 15e3}  # unambiguous to 47 m/s: all pulses count
WIDE = {"carrier_hz": 10e9, "prf_hz": 60e3}  # to 450 m/s
BY_PULSES = json.dumps(
    [
        {"pulses": 64, "accept": [0.9, 0.9, 0.9], "sets": [[0.8, 0.1, 0.1, 0.1]]},
        {"pulses": 256, "accept": [0.6, 0.6, 0.6], "sets": [[0.8, 0.5, 0.4, 0.4]]},
    ]
)
ONE = {"prediction_sets": json.dumps([[0.8, 0.5, 0.4, 0.4]]), "rules_by_pulses": BY_PULSES}


def told(seed: int, records: int, pulses: int) -> tuple[np.ndarray, np.ndarray]:
    """Calibrated probabilities of records whose classes show the better the more pulses they have; labels."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 3, records)
    evidence = np.log2(pulses) / 2 - 1.7  # of means +- that and unit deviation: its logits are exact
    seen = rng.standard_normal((records, 3)) + evidence * np.eye(3)[labels]
    logits = evidence * seen
    odds = np.exp(logits - logits.max(axis=1, keepdims=True))
    return odds / odds.sum(axis=1, keepdims=True), labels


@pytest.fixture(scope="module")
def known() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    each = [told(seed, 6000, pulses) for seed, pulses in enumerate(PULSES_FROM)]
    return *map(np.concatenate, zip(*each, strict=True)), np.repeat(PULSES_FROM, 6000)


def fitted(known) -> tuple[Rule, Rules]:
    p, labels, pulses = known
    promised = {"precision": PRECISION, "false_alarm": FALSE_ALARM}
    of_all = Rule.fitted(p, labels, coverages=COVERAGES, **promised)
    return of_all, Rules.fitted(p, labels, pulses, of_all, **promised)


def test_what_is_promised_holds_of_each_range_of_pulses_where_one_rule_misses_it(known):
    of_all, rules = fitted(known)
    missed = 0
    for number, pulses in enumerate(PULSES_FROM):
        p, labels = told(10 + number, 20_000, pulses)
        winner = p.argmax(axis=1)
        for rule in (of_all, rules.of(pulses)):
            named = p.max(axis=1) >= np.array(rule.accept)[winner]
            right = [np.mean((labels == winner)[named & (winner == one)]) for one in range(3)]
            false = np.mean((named & (winner == 0))[labels != 0])
            held = [np.mean(p[labels == one, one] >= rule.sets[0.9][one]) for one in range(3)]
            if rule is of_all:
                missed += min(right) < PRECISION - 0.1
                missed += abs(min(held) - 0.9) > 0.05
            else:  # thresholds rest on 2000 records of a class, some 100 of them named at least
                assert min(right) > PRECISION - 0.05
                assert false < FALSE_ALARM + 4 * np.sqrt(FALSE_ALARM / 4000)
                assert np.abs(np.array(held) - 0.9).max() < 4 * np.sqrt(0.09 / 2000 + 0.09 / 6666)
            assert min(rule.accept) >= LIKELIER
            assert rule.accept[0] >= of_all.accept[0]
    assert missed >= 2


def test_few_records_of_a_range_go_by_the_rule_of_all(known):
    p, labels, pulses = known
    few = np.flatnonzero((pulses != 256) | (np.cumsum(pulses == 256) < LEAST_RECORDS))
    of_all, rules = fitted((p[few], labels[few], pulses[few]))
    assert rules.of(256).accept == of_all.accept
    assert rules.of(64).accept != of_all.accept
    assert [rule.pulses for rule in rules.each] == list(PULSES_FROM)


def test_rules_are_read_as_they_were_written(known):
    _, rules = fitted(known)
    assert Rules.from_json(rules.to_json()) == rules


@given(st.integers(1, 100_000))
def test_a_number_of_pulses_has_the_rule_of_its_range_alone_and_in_an_array(pulses):
    rules = Rules(tuple(Rule(fewest, (fewest / 1e4, 0.5, 0.5), {}) for fewest in PULSES_FROM))
    fewest = max((one for one in PULSES_FROM if one <= pulses), default=PULSES_FROM[0])
    assert rules.of(pulses).pulses == fewest
    np.testing.assert_array_equal(rules.accept(np.array([[pulses]])), [[rules.of(pulses).accept]])


@given(st.integers(64, 65_536), st.floats(2e9, 100e9), st.floats(1e3, 100e3))
def test_pulses_count_that_make_the_bins_of_what_birds_and_clutter_do(pulses, carrier_hz, prf_hz):
    radar = {"carrier_hz": carrier_hz, "prf_hz": prf_hz}
    velocity_mps = np.fft.fftfreq(pulses, 1 / prf_hz) * SPEED_OF_LIGHT_MPS / carrier_hz / 2
    number = counted_pulses(pulses, **radar)
    assert abs(number - np.count_nonzero(abs(velocity_mps) <= COUNTED_MPS)) <= 1.001
    assert number <= pulses
    if velocity_mps.max() >= COUNTED_MPS:  # as many of a dwell, however fast they follow one another
        faster = counted_pulses(2 * pulses, carrier_hz, 2 * prf_hz)
        assert faster == pytest.approx(number, rel=1e-9)


def test_records_go_by_their_pulses_and_tracks_by_all(make_model):
    clf = Classifier(make_model(bias=np.log([0.8, 0.15, 0.05]), **ONE))  # whose own threshold is 0.6
    short, long = (clf.predict(noise(pulses), **NARROW) for pulses in (255, 256))
    assert str(clf.predict(noise(1024), **WIDE).labels) == "unknown"  # of which 114 count
    assert [str(one.labels) for one in (short, long)] == ["unknown", "uav"]
    assert str(short.reasons) == "not sure: best uav 0.80 < 0.90"
    p = np.stack([short.probabilities, long.probabilities])
    assert clf.decide(p)[0].tolist() == ["uav", "uav"]
    assert clf.decide(p, np.array([255, 256]))[0].tolist() == ["unknown", "uav"]
    assert clf.decide(p, np.int64(256))[0].tolist() == ["uav", "uav"]
    sets = Classifier(make_model(bias=np.log([0.8, 0.15, 0.05]), **ONE), coverage=0.8)
    labels = [str(sets.predict(noise(n), **NARROW).labels) for n in (255, 256)]
    assert labels == ["unknown", "uav"]
    assert sets.decide(p)[0].tolist() == ["uav", "uav"]
    assert sets.decide(p, np.array([255, 256]))[0].tolist() == ["unknown", "uav"]


def test_damaged_rules_are_refused(make_model):
    rows = json.loads(BY_PULSES)
    wrong = ("3", "[]", "{", "[{}]", json.dumps(rows[::-1]), json.dumps([rows[0] | {"accept": [0.9, 0.9, 2.0]}]))
    for damaged in (*wrong, json.dumps([rows[0] | {"sets": []}, rows[1]]), BY_PULSES.replace("0.9", "NaN")):
        with pytest.raises(BadInput, match="the rules by pulses are damaged"):
            Classifier(make_model(**ONE | {"rules_by_pulses": damaged}))
    with pytest.raises(BadInput, match=r"hold no sets of the coverage 0\.9"):
        Classifier(make_model(**ONE | {"prediction_sets": "[[0.9, 0.5, 0.4, 0.4]]"}), coverage=0.9)


def test_each_shipped_model_has_rules_that_grow_looser_with_the_pulses():
    for name in model_names():
        limits = np.array([rule.accept for rule in Classifier.load(name).rules.each])
        assert limits.shape == (len(PULSES_FROM), len(CLASSES))
        assert (limits[0] > limits[-1]).all()


def test_an_exported_graph_goes_by_the_rule_of_its_pulses(make_model, tmp_path):
    model = tmp_path / "model.onnx"
    model.write_bytes(make_model(bias=np.log([0.8, 0.15, 0.05]), **ONE))
    for pulses, radar, wanted in ((255, NARROW, 3), (256, NARROW, 0), (1024, WIDE, 3)):
        out = tmp_path / f"{pulses}.onnx"
        export_raw_iq(out, **radar, pulses=pulses, model=model)
        iq = noise(pulses, (2,)).astype(np.complex64).view(np.float32).reshape(2, pulses, 2)
        (label,) = InferenceSession(out).run(["label"], {"iq": iq})
        assert label.tolist() == [wanted, wanted]
