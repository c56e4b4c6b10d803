"""Calibration: known distortions are found, probabilities mean what they say, thresholds keep their promise."""

import numpy as np
import pytest
from bladewing.models.calibration import (
    NEVER,
    Calibration,
    acceptance_thresholds,
    conformal_thresholds,
    expected_calibration_error,
    fit_vector_scaling,
    softmax,
)
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sklearn.metrics import log_loss


def _draw(count, seed, spread=2.0):
    """Scores whose softmax is the true probability, and labels drawn from it."""
    rng = np.random.default_rng(seed)
    scores = rng.normal(size=(count, 3)) * spread
    labels = (softmax(scores).cumsum(axis=1) < rng.random((count, 1))).sum(axis=1)
    return scores, np.minimum(labels, 2)


def _scale_error(scores):
    """Standard deviation of the fitted log scale: 1 / sqrt(n x Fisher information), information = E var_p(score)."""
    p = softmax(scores)
    information = ((p * scores**2).sum(1) - (p * scores).sum(1) ** 2).sum()
    return information**-0.5


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), temperature=st.floats(0.2, 8))
def test_a_known_temperature_is_found(seed, temperature):
    scores, labels = _draw(2000, seed)
    fitted = fit_vector_scaling(scores * temperature, labels)
    # five standard deviations of the estimate, and the prior's pull of less than a tenth of one
    assert abs(np.log(fitted.scale * temperature)) < 5.1 * _scale_error(scores)
    # a class holds a share of about 1/3 with a variance of at least 0.05 left by the scores: sigma < 1 / sqrt(0.05 n)
    assert np.abs(fitted.bias).max() < 5 / np.sqrt(0.05 * 2000)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), bias=st.tuples(*[st.floats(-1, 1)] * 3))
def test_known_biases_are_found(seed, bias):
    scores, labels = _draw(4000, seed)
    fitted = fit_vector_scaling(3 * (scores - np.array(bias)), labels)
    # a class holds a share of about 1/3 with a variance of at least 0.05 left by the scores: sigma < 1 / sqrt(0.05 n)
    assert np.abs(fitted.bias - (bias - np.mean(bias))).max() < 5 / np.sqrt(0.05 * 4000)
    assert abs(np.log(3 * fitted.scale)) < 6 * _scale_error(scores)
    assert abs(sum(fitted.bias)) < 1e-9


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_over_confident_scores_gain_likelihood_on_other_records(seed):
    scores, labels = _draw(2000, seed)
    wild = 4 * scores + [1.0, 0, -1]
    fitted = fit_vector_scaling(wild[:1000], labels[:1000])
    before, after, true = (
        log_loss(labels[1000:], p)
        for p in (softmax(wild[1000:]), fitted.probabilities(wild[1000:]), softmax(scores[1000:]))
    )
    # four parameters from 1000 records cost 4 / 2000 nats on the mean
    assert true - 0.02 < after < true + 0.02 < before - 0.1


def test_the_fit_is_a_minimum_of_the_likelihood():
    scores, labels = _draw(5000, 3)
    fitted = fit_vector_scaling(scores * 2, labels)
    least = log_loss(labels, fitted.probabilities(scores * 2))
    for factor in (0.9, 1.1):
        other = Calibration(fitted.scale * factor, fitted.bias)
        assert log_loss(labels, other.probabilities(scores * 2)) > least


@settings(deadline=None)
@given(factor=st.floats(0.1, 100), seed=st.integers(0, 1000))
def test_separable_scores_give_no_certainty_whatever_their_unit(factor, seed):
    labels = np.random.default_rng(seed).integers(0, 3, 30)
    scores = np.eye(3)[labels]
    fitted, scaled = fit_vector_scaling(scores, labels), fit_vector_scaling(factor * scores, labels)
    assert (scaled.probabilities(factor * scores).argmax(axis=1) == labels).all()
    assert scaled.scale * factor == pytest.approx(fitted.scale, rel=0.01)
    assert fitted.probabilities(scores).max() < 1 - 1e-4  # thirty right answers cannot tell 1 from 0.9999


@settings(deadline=None)
@given(st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3), st.floats(-1e4, 1e4))
def test_softmax_sums_to_one_and_ignores_a_common_shift(scores, shift):
    p = softmax(scores)
    assert p.sum() == pytest.approx(1)
    assert softmax(np.array(scores) + shift) == pytest.approx(p, abs=1e-9)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_perfect_calibration_has_a_small_error(seed):
    scores, labels = _draw(20_000, seed)
    # mean of |normal| in each bin, at most 0.4 sqrt(bins / n); its own spread is below half of that
    assert expected_calibration_error(softmax(scores), labels) < 2 * 0.4 * np.sqrt(15 / 20_000)


@settings(deadline=None)
@given(right=st.integers(0, 100), confidence=st.floats(0.5, 0.99))
def test_a_known_gap_is_the_error(right, confidence):
    table = np.tile([confidence, 1 - confidence, 0.0], (100, 1))
    labels = np.where(np.arange(100) < right, 0, 2)
    assert expected_calibration_error(table, labels) == pytest.approx(abs(confidence - right / 100))


def test_a_weight_of_two_counts_as_two_records():
    scores, labels = _draw(300, 1)
    p, weights = softmax(scores), 1 + np.arange(300) % 2
    twice = np.repeat(np.arange(300), weights)
    assert expected_calibration_error(p, labels, weights=weights) == pytest.approx(
        expected_calibration_error(p[twice], labels[twice])
    )


def test_gaps_of_two_bins_do_not_cancel():
    table = np.array([[0.9, 0.1, 0.0]] * 50 + [[0.6, 0.4, 0.0]] * 50)
    labels = np.array([0] * 25 + [1] * 25 + [0] * 50)  # 0.9 said and 0.5 right; 0.6 said and 1.0 right
    assert expected_calibration_error(table, labels) == pytest.approx(0.4)
    assert expected_calibration_error(table, labels, bins=1) == pytest.approx(0)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), precision=st.floats(0.5, 0.99))
@example(seed=53939, precision=0.68)  # 17 of 25 are 0.68, and a product's rounding says they are less
def test_thresholds_keep_the_promise_and_are_the_least_that_do(seed, precision):
    scores, labels = _draw(500, seed, spread=1.5)
    table = softmax(scores)
    thresholds = acceptance_thresholds(table, labels, precision, support=10)
    for index, threshold in enumerate(thresholds):
        won = table.argmax(axis=1) == index

        def kept(least, won=won, index=index):
            accepted = won & (table[:, index] >= least)
            return accepted.sum() >= 10 and (labels[accepted] == index).mean() >= precision - 1e-12

        lower = [p for p in table[won, index] if p < threshold]
        assert threshold == NEVER or kept(threshold)
        assert not any(kept(p) for p in lower)


def test_thresholds_hold_on_other_records():
    table, labels = (softmax(_draw(40_000, 5)[0]), _draw(40_000, 5)[1])
    thresholds = acceptance_thresholds(table[:20_000], labels[:20_000], 0.9)
    fresh, truth = table[20_000:], labels[20_000:]
    for index, threshold in enumerate(thresholds):
        accepted = (fresh.argmax(axis=1) == index) & (fresh[:, index] >= threshold)
        spread = np.sqrt(0.9 * 0.1 / accepted.sum())
        assert (truth[accepted] == index).mean() > 0.9 - 5 * spread


def test_a_reliable_class_is_always_accepted_and_a_hopeless_one_never():
    table = np.array([[0.5, 0.3, 0.2]] * 50 + [[0.1, 0.6, 0.3]] * 50)
    labels = np.array([0] * 50 + [2] * 50)
    assert acceptance_thresholds(table, labels) == pytest.approx([1 / 3, NEVER, NEVER])


def test_equal_probabilities_are_accepted_together():
    table = np.array([[0.9, 0.1, 0.0]] * 20 + [[0.6, 0.4, 0.0]] * 20)
    labels = np.array([0] * 20 + [0, 1] * 10)
    assert acceptance_thresholds(table, labels, 0.95)[0] == 0.9  # not in the midst of those with 0.6


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), coverage=st.floats(0.5, 0.99))
def test_sets_hold_the_truth_as_often_as_they_promise(seed, coverage):
    scores, labels = _draw(8000, seed)
    table = softmax(scores * [3.0, 0.5, 1.0])  # badly calibrated: the promise does not rest on calibration
    limits = conformal_thresholds(table[:4000], labels[:4000], coverage)
    for index, limit in enumerate(limits):
        known, fresh = np.sum(labels[:4000] == index), labels[4000:] == index
        covered = (table[4000:][fresh, index] >= limit).mean()
        # both samples scatter: the quantile of the first and the share of the second
        spread = np.sqrt(coverage * (1 - coverage) * (1 / known + 1 / fresh.sum()))
        assert abs(covered - coverage) < 5.5 * spread + 1 / known


def test_the_promise_is_exact_for_few_records():
    # Of n + 1 records that could each be the new one, at most k = floor((1 - coverage)(n + 1)) fall out of their set.
    rng = np.random.default_rng(4)
    for count, coverage in ((9, 0.9), (10, 0.9), (19, 0.9), (30, 0.8), (30, 0.95)):
        p = rng.random(count + 1)
        table, labels = np.column_stack([p, 1 - p, 0 * p]), np.zeros(count + 1, int)
        missed = 0
        for new in range(count + 1):
            others = np.arange(count + 1) != new
            missed += p[new] < conformal_thresholds(table[others], labels[others], coverage)[0]
        assert missed == int((1 - coverage) * (count + 1) + 1e-9)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), coverages=st.tuples(*[st.floats(0.01, 0.99)] * 2), count=st.integers(1, 200))
def test_a_higher_coverage_gives_larger_sets(seed, coverages, count):
    scores, labels = _draw(count, seed)
    table = softmax(scores)
    lower, higher = (conformal_thresholds(table, labels, coverage) for coverage in sorted(coverages))
    assert (higher <= lower).all()


def test_a_class_without_enough_records_is_in_every_set():
    table = np.array([[0.6, 0.3, 0.1]] * 20 + [[0.2, 0.7, 0.1]] * 8)
    labels = np.array([0] * 20 + [1] * 8)  # 8 bird records cannot promise 90 %: floor(0.1 x 9) = 0
    assert conformal_thresholds(table, labels, 0.9).tolist() == [0.6, 0.0, 0.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Calibration(scale=0.0), "scale is 0.0; it must be positive"),
        (lambda: Calibration(bias=(0.0, 1.0)), "must be 3 finite numbers"),
        (lambda: fit_vector_scaling(np.zeros((4, 2)), np.zeros(4, int)), r"scores has shape \(4, 2\)"),
        (lambda: fit_vector_scaling(np.full((1, 3), np.nan), np.zeros(1, int)), r"scores\[0, 0\] is nan"),
        (lambda: fit_vector_scaling(np.zeros((4, 3)), np.zeros(3, int)), r"labels has shape \(3,\)"),
        (lambda: fit_vector_scaling(np.zeros((4, 3)), np.array([0, 1, 2, 3])), "holds the label 3"),
        (lambda: fit_vector_scaling(np.zeros((1, 3)), np.zeros(1)), "labels must be integers"),
        (lambda: expected_calibration_error(np.eye(3), np.arange(3), bins=0), "bins is 0"),
        (lambda: acceptance_thresholds(np.eye(3), np.arange(3), precision=1.1), "precision is 1.1"),
        (lambda: acceptance_thresholds(np.eye(3), np.arange(3), support=0), "support is 0"),
        (lambda: conformal_thresholds(np.eye(3), np.arange(3), 1.0), "coverage is 1.0"),
        (lambda: conformal_thresholds(np.eye(3), np.zeros(3), 0.9), "labels must be integers"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
