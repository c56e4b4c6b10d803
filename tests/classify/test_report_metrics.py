import math

import numpy as np
import pytest
from bladewing.classify.ladder import non_dominated
from bladewing.classify.report import metrics
from bladewing.models.calibration import expected_calibration_error
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

# Few distinct values, so that ties occur.
SCORES = st.sampled_from([0.0, 0.1, 0.25, 0.25000001, 0.5, 0.9, 1.0])


@pytest.mark.parametrize(
    ("right", "count", "low", "high"),
    [
        (0, 10, 0.0, 0.27753),  # Newcombe 1998 and every textbook: z^2 / (n + z^2)
        (10, 10, 0.72247, 1.0),
        (5, 10, 0.23659, 0.76341),
        (81, 263, 0.25525, 0.36623),  # Newcombe 1998, table I
        (15, 148, 0.06236, 0.16054),  # the same
        (1, 29, 0.00611, 0.17178),  # the same
    ],
)
def test_wilson_gives_published_intervals(right: int, count: int, low: float, high: float) -> None:
    assert metrics.wilson(right, count) == pytest.approx((low, high), abs=6e-5)


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_ends_are_where_the_score_test_just_rejects(pair: tuple[int, int]) -> None:
    right, count = pair
    low, high = metrics.wilson(right, count)
    assert 0.0 <= low <= right / count <= high <= 1.0
    for end in (low, high):
        # (share - p)^2 = z^2 p (1 - p) / n: the interval's definition
        residue = (right / count - end) ** 2 - metrics.Z_95**2 * end * (1 - end) / count
        assert abs(residue) < 1e-12


@pytest.mark.parametrize(("right", "count"), [(1, 0), (-1, 5), (6, 5)])
def test_wilson_refuses_impossible_counts(right: int, count: int) -> None:
    with pytest.raises(ValueError, match="0 <= right <= count"):
        metrics.wilson(right, count)


def test_a_rate_over_nothing_is_none_not_nan() -> None:
    empty = metrics.rate(np.zeros(0, bool))
    assert (empty["value"], empty["low"], empty["high"], empty["count"]) == (None, None, None, 0)


def test_mean_of_one_rate_keeps_its_interval_and_empty_ones_do_not_count() -> None:
    one, nothing = metrics.rate(np.arange(10) < 7), metrics.rate(np.zeros(0, bool))
    mean = metrics.mean_of_rates([one, nothing])
    assert [mean[key] for key in ("value", "low", "high")] == pytest.approx([one[k] for k in ("value", "low", "high")])


def test_mean_of_rates_covers_the_true_mean_as_often_as_promised() -> None:
    rng = np.random.default_rng(0)
    shares, count, trials = np.array([0.95, 0.7, 0.4]), 60, 2000
    draws = rng.random((trials, 3, count)) < shares[:, None]
    covered = 0
    for trial in draws:
        mean = metrics.mean_of_rates([metrics.rate(hits) for hits in trial])
        covered += mean["low"] <= shares.mean() <= mean["high"]
    # three standard deviations of a binomial share of 0.95 over the trials, and a little for the approximation
    assert covered / trials == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / trials) + 0.01)


@given(st.lists(st.tuples(SCORES, st.booleans()), min_size=1, max_size=60), st.sampled_from([0.0, 0.01, 0.1, 0.3]))
def test_detection_is_the_best_that_any_threshold_gives(pairs: list[tuple[float, bool]], allowed: float) -> None:
    scores = np.array([score for score, _ in pairs])
    targets = np.array([target for _, target in pairs])
    found = metrics.detection_at(scores, targets, false_alarm_rate=allowed)
    if targets.all():
        assert found["threshold"] is None
        return
    assert found["false_alarm"]["value"] <= allowed + 1e-12
    if targets.any():
        candidates = [-1.0, *scores]
        possible = [np.mean(scores[targets] > t) for t in candidates if np.mean(scores[~targets] > t) <= allowed]
        assert found["detection"]["value"] == max(possible)


def test_detection_refuses_a_rate_outside_its_range() -> None:
    with pytest.raises(ValueError, match=r"false_alarm_rate=1\.0"):
        metrics.detection_at(np.zeros(3), np.zeros(3, bool), false_alarm_rate=1.0)


@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 80), st.just(3)), elements=st.floats(-4, 4)),
    st.integers(0, 2**32 - 1),
)
def test_calibration_error_is_that_of_the_models_folder(logits: np.ndarray, seed: int) -> None:
    probabilities = np.exp(logits) / np.exp(logits).sum(axis=1, keepdims=True)
    labels = np.random.default_rng(seed).integers(0, 3, len(logits))
    hits = probabilities.argmax(axis=1) == labels
    found = metrics.reliability(probabilities.max(axis=1), hits, bins=15)
    assert found["ece"] == pytest.approx(expected_calibration_error(probabilities, labels, bins=15), abs=1e-12)
    assert sum(one["accuracy"]["count"] for one in found["bins"]) == len(labels)
    assert all(one["from"] - 1e-12 <= one["confidence"] <= one["to"] + 1e-12 for one in found["bins"])


POINTS = st.lists(st.tuples(st.integers(1, 6), st.integers(0, 6)), min_size=1, max_size=12)


@given(POINTS)
def test_front_keeps_no_beaten_point_and_drops_only_beaten_ones(points: list[tuple[int, int]]) -> None:
    def beaten(point: tuple[int, int], by: tuple[int, int]) -> bool:
        return by != point and by[0] <= point[0] and by[1] >= point[1]

    kept = non_dominated([cost for cost, _ in points], [value for _, value in points])
    front = [point for point, keep in zip(points, kept, strict=True) if keep]
    assert front
    for point, keep in zip(points, kept, strict=True):
        # whoever is beaten at all is beaten by a point of the front
        assert keep != any(beaten(point, other) for other in front)


def test_design_effect_of_lone_records_is_one_and_of_copies_their_number() -> None:
    hits = np.random.default_rng(0).random(400) < 0.7
    lone = metrics.design_effect(hits, np.arange(400))
    copied = metrics.design_effect(np.repeat(hits, 5), np.repeat(np.arange(400), 5))
    assert lone == pytest.approx(400 / 399)
    assert copied == pytest.approx(5 * 400 / 399)
    assert metrics.design_effect(np.ones(10, bool), np.arange(10)) is None
