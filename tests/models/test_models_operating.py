"""The threshold on "uav" by false-alarm rate."""

import re

import numpy as np
import pytest
from bladewing.models.operating import SUPPORT, OperatingCurve, operating_curve


def table(uav: np.ndarray) -> np.ndarray:
    """Probabilities of which the first is given; the rest goes to the second class."""
    return np.stack([uav, 1 - uav, np.zeros_like(uav)], axis=1)


def drawn(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 3, count)
    return table(rng.beta(np.where(labels == 0, 6, 1), np.where(labels == 0, 1, 4))), labels


def test_the_curve_of_a_known_law_is_its_closed_form():
    # false ones uniform over (0, 1), true ones with the density 2 p: a threshold t has rates 1 - t and 1 - t^2
    others, uavs = (np.arange(20_000) + 0.5) / 20_000, np.sqrt((np.arange(10_000) + 0.5) / 10_000)
    labels = np.repeat([1, 0], [20_000, 10_000])
    curve = operating_curve(table(np.concatenate([others, uavs])), labels)
    assert (curve.uavs, curve.others) == (10_000, 20_000)
    for point in curve.points:
        assert point.threshold == pytest.approx(1 - point.false_alarm, abs=2e-4)
        assert point.detection == pytest.approx(1 - point.threshold**2, abs=2e-4)
    for rate in (0.1, 0.01, 0.001):
        assert curve.at(rate).false_alarm == rate  # as asked, not the next lower step
        assert curve.at(rate, models=2).false_alarm == rate / 2  # what a cascade gives each of its models


def test_new_records_keep_to_the_rate_and_to_the_detection_told():
    curve = operating_curve(*drawn(30_000, 0))
    probabilities, labels = drawn(300_000, 1)
    named = np.where(probabilities.argmax(axis=1) == 0, probabilities[:, 0], 0)
    for rate in (0.03, 0.01, 0.001):  # at 0.1 every win is allowed: 6 % of the others win
        point = curve.at(rate)
        # the calibration records' own scatter of the rate, k false alarms of n, four standard deviations
        scatter = rate * 4 / np.sqrt(rate * curve.others)
        assert abs(np.mean(named[labels != 0] >= point.threshold) - point.false_alarm) < scatter
        assert np.mean(named[labels == 0] >= point.threshold) == pytest.approx(point.detection, abs=0.1 * rate**0.25)


def test_lower_rates_have_higher_thresholds_and_find_fewer():
    points = operating_curve(*drawn(5_000, 2)).points
    for name, sign in (("false_alarm", -1), ("threshold", 1), ("detection", -1)):
        values = np.array([getattr(point, name) for point in points])
        assert np.all(sign * np.diff(values) >= 0), name


def test_a_rate_between_two_points_takes_the_lower_one():
    curve = operating_curve(*drawn(5_000, 3))
    assert curve.at(0.0123).false_alarm == 0.01
    assert curve.at(0.99) == curve.points[0]


def test_a_rate_that_rests_on_too_few_records_is_refused_by_the_rule():
    probabilities, labels = drawn(3_000, 4)
    curve = operating_curve(probabilities, labels)
    others = np.count_nonzero(labels)
    assert curve.points[-1].false_alarm * (others + 1) >= SUPPORT
    with pytest.raises(
        ValueError, match=rf"0\.001 cannot be supported by {others} calibration records .* ask for 0\.00"
    ):
        curve.at(0.001)
    for models in (1, 2):
        with pytest.raises(ValueError, match="ask for ") as caught:
            curve.at(1e-4, models)
        asked = float(re.search(r"ask for (\S+) or more", str(caught.value))[1])
        assert models * curve.at(asked, models).false_alarm <= asked < 1.01 * models * curve.points[-1].false_alarm
    for wrong in (0, 1, -0.1, float("nan")):
        with pytest.raises(ValueError, match="above 0 and below 1"):
            curve.at(wrong)


def test_ties_do_not_exceed_the_rate():
    labels = np.repeat([0, 1], [100, 1000])
    probabilities = table(np.repeat([0.9, 0.8, 0.5001], [100, 200, 800]))
    assert operating_curve(probabilities, labels).at(0.1).threshold > 0.8


def test_what_is_not_the_most_probable_class_is_neither_a_false_alarm_nor_found():
    """However probable: a record is named UAV only where nothing else is likelier."""
    uavs = np.repeat([[0.9, 0.1, 0.0], [0.45, 0.0, 0.55]], 100, axis=0)
    others = np.repeat([[0.4, 0.3, 0.3], [0.48, 0.52, 0.0], [0.01, 0.0, 0.99]], [20, 500, 480], axis=0)
    curve = operating_curve(np.concatenate([uavs, others]), np.repeat([0, 1], [200, 1000]))
    every_win = curve.at(0.1)  # 2 % of the others win
    assert every_win.threshold == pytest.approx(1 / 3, abs=1e-6)
    assert every_win.detection == 0.5
    assert 0.4 < curve.at(0.0125).threshold < 0.401


def test_the_curve_survives_its_text():
    curve = operating_curve(*drawn(5_000, 5))
    again = OperatingCurve.from_json(curve.to_json())
    assert [(p.false_alarm, p.threshold) for p in again.points] == [(p.false_alarm, p.threshold) for p in curve.points]
    assert len(curve.to_json()) < 2000
    with pytest.raises(ValueError, match="damaged"):
        OperatingCurve.from_json("{}")
    sure = operating_curve(np.tile([1.0, 0.0, 0.0], (200, 1)), np.repeat([0, 1], 100))  # false ones of probability 1
    assert OperatingCurve.from_json(sure.to_json()) == sure
    assert sure.at(0.5).detection == 0
