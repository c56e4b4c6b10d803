import json

import numpy as np
import pytest
from bladewing.classify.report.scores import DECLINED, SNR_RANGE_DB, Answers, Truth, describe_records, score
from bladewing.classify.report.trade import weigh_up

CLASSES = ("uav", "bird", "clutter")
KINDS = np.array(["quadcopter", "flock", "rain"])


def drawn(count: int = 300, seed: int = 0) -> tuple[Truth, Answers]:
    """Records with answers that are right two times in three, some refused, some declined."""
    rng = np.random.default_rng(seed)
    label = rng.integers(0, 3, count)
    truth = Truth(
        classes=CLASSES,
        label=label,
        kind=KINDS[label],
        snr_db=np.where(rng.random(count) < 0.1, np.nan, rng.uniform(-20, 30, count)),
        dwell_s=10 ** rng.uniform(-2.3, -0.5, count),
        radar=np.arange(count) // 24,
        beta_rad=np.where(label == 0, rng.uniform(0, np.pi / 2, count), np.nan),
    )
    logits = rng.standard_normal((count, 3))
    logits[np.arange(count), label] += 1.2
    probabilities = np.exp(logits) / np.exp(logits).sum(axis=1, keepdims=True)
    best, answered = probabilities.argmax(axis=1), rng.random(count) < 0.9
    named = answered & (probabilities.max(axis=1) > 0.6)
    return truth, Answers(probabilities, np.where(named, best, DECLINED), answered)


def test_scores_count_the_records_seen_and_tell_the_refused() -> None:
    truth, answers = drawn()
    found, seen = score(truth, answers), answers.answered
    best = answers.probabilities.argmax(axis=1)
    assert found["refused"] == np.sum(~seen)
    assert found["accuracy"]["value"] == pytest.approx(np.mean(best[seen] == truth.label[seen]))
    recalls = [np.mean(best[seen & (truth.label == i)] == i) for i in range(3)]
    assert found["balanced_accuracy"]["value"] == pytest.approx(np.mean(recalls))
    assert np.sum(found["confusion"]["best"]) == np.sum(found["confusion"]["accepted"]) == np.sum(seen)
    others = seen & (truth.label != 0)
    assert found["false_uav"]["best"]["value"] == pytest.approx(np.mean(best[others] == 0))
    assert found["false_uav"]["accepted"]["value"] == pytest.approx(np.mean(answers.label[others] == 0))


def test_slices_share_out_every_record_that_has_the_quantity() -> None:
    truth, answers = drawn()
    found, seen = score(truth, answers), answers.answered
    by_snr, by_dwell = found["by_snr"], found["by_dwell"]
    assert sum(one["all"]["count"] for one in by_snr) == np.sum(seen & np.isfinite(truth.snr_db))
    far = Truth(**{**vars(truth), "snr_db": truth.snr_db * np.where(np.arange(len(truth.snr_db)) % 7, 1, 9)})
    held = seen & (far.snr_db >= SNR_RANGE_DB[0]) & (far.snr_db < SNR_RANGE_DB[1])
    assert sum(one["all"]["count"] for one in score(far, answers)["by_snr"]) == np.sum(held) < np.sum(seen)
    assert sum(one["all"]["count"] for one in by_dwell) == np.sum(seen)
    for one in by_snr + by_dwell:
        assert one["from"] < one["to"]
        assert one["all"]["count"] == sum(one[name]["count"] for name in CLASSES)
        assert one["all"]["right"] == sum(one[name]["right"] for name in CLASSES)


def test_records_on_the_edges_between_slices_are_counted_once_and_above() -> None:
    truth, answers = drawn(90)
    edges_s, snr_db = np.tile([0.01, 0.02, 0.05], 30), np.tile([-5.0, 0.0, 5.0], 30)
    found = score(Truth(**{**vars(truth), "dwell_s": edges_s, "snr_db": snr_db}), answers)
    for by, values in (("by_dwell", edges_s), ("by_snr", snr_db)):
        counts = {one["from"]: one["all"]["count"] for one in found[by]}
        assert counts == {value: np.sum(answers.answered & (values == value)) for value in np.unique(values)}


@pytest.mark.parametrize("dwell_s", [1e-3, 2e-3, 5e-3, 0.1, 1.0])
def test_a_dwell_on_an_edge_falls_into_one_slice(dwell_s: float) -> None:
    truth, answers = drawn(30)
    same = Truth(**{**vars(truth), "dwell_s": np.full(30, dwell_s)})
    slices = score(same, answers)["by_dwell"]
    assert [one["all"]["count"] for one in slices] == [np.sum(answers.answered)]
    assert slices[0]["from"] == dwell_s


@pytest.mark.parametrize("beta_deg", [0.0, 30.0, 80.0, 75.0])
def test_an_angle_on_the_last_edge_falls_into_a_slice_too(beta_deg: float) -> None:
    truth, answers = drawn(90)
    beta_rad = np.where(truth.label == 0, np.deg2rad(beta_deg), np.nan)
    slices = score(Truth(**{**vars(truth), "beta_rad": beta_rad}), answers)["by_beta"]
    assert sum(one["answered"]["count"] for one in slices) == np.sum(answers.answered & (truth.label == 0))


def test_every_kind_is_called_something_and_declined_answers_are_counted() -> None:
    truth, answers = drawn()
    found, seen = score(truth, answers), answers.answered
    assert [row["kind"] for row in found["by_kind"]] == list(KINDS)
    for row in found["by_kind"]:
        mine = seen & (truth.kind == row["kind"])
        assert sum(row["called"][name]["right"] for name in CLASSES) == np.sum(mine)
        assert row["unknown"]["right"] == np.sum(answers.label[mine] == DECLINED)
    accepted = seen & (answers.label != DECLINED)
    assert found["acceptance"]["coverage"]["value"] == pytest.approx(np.sum(accepted) / np.sum(seen))
    right = answers.label[accepted] == truth.label[accepted]
    assert found["acceptance"]["accuracy"]["value"] == pytest.approx(np.mean(right))


@pytest.mark.parametrize("case", ["nothing seen", "no SNR", "one class", "nothing named"])
def test_scores_of_lean_records_are_still_strict_json(case: str) -> None:
    truth, answers = drawn(48)
    if case == "nothing seen":
        answers = Answers(answers.probabilities, np.full(48, DECLINED), np.zeros(48, bool))
    elif case == "no SNR":
        truth = Truth(**{**vars(truth), "snr_db": np.full(48, np.nan)})
    elif case == "one class":
        truth = Truth(**{**vars(truth), "label": np.zeros(48, int), "kind": np.full(48, "quadcopter")})
    else:
        answers = Answers(answers.probabilities, np.full(48, DECLINED), answers.answered)
    json.dumps(score(truth, answers), allow_nan=False)
    json.dumps(describe_records(truth), allow_nan=False)


def test_records_are_counted_by_class_and_kind() -> None:
    truth, _ = drawn()
    found = describe_records(truth)
    assert found["total"] == 300 == sum(found["by_class"].values()) == sum(found["by_kind"].values())
    assert found["without_snr"] == np.sum(np.isnan(truth.snr_db))
    assert found["radars"] == 13


def test_a_budget_buys_the_most_accurate_model_that_keeps_to_it() -> None:
    truth, answers = drawn()
    worse = Answers(answers.probabilities[:, [1, 2, 0]], answers.label, answers.answered)
    scored = {"good": score(truth, answers), "bad": score(truth, worse), "dear": score(truth, answers)}
    costs = {"good": 250.0, "bad": 90.0, "dear": 900.0}
    stages = [{"stage": "chain", "name": name, "median_us": cost} for name, cost in costs.items()]
    (found,) = weigh_up(scored, [{"batch": 1, "stages": stages}])
    assert {point["model"]: point["front"] for point in found["points"]} == {"bad": True, "good": True, "dear": False}
    assert [(one["budget_us"], one["model"]) for one in found["budgets"]] == [
        (100.0, "bad"),
        (300.0, "good"),
        (1000.0, "good"),
        (3000.0, "good"),
    ]
    (nothing,) = weigh_up(scored, [{"batch": 1, "stages": stages[2:]}])
    assert nothing["budgets"][0] == {
        "budget_us": 100.0,
        "model": None,
        "cost_us": None,
        "balanced_accuracy": None,
        "cheapest": "dear",
    }
