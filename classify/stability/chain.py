"""The whole chain at the extremes: answers of the shipped model at gains and ranges beyond those of any radar."""

from collections.abc import Iterator
from functools import cache

import numpy as np
from bladewing.simulate import stream
from bladewing.simulate.scene import Scene
from numpy.typing import NDArray

from ..inference import Classifier, Prediction
from ..labels import CLASSES
from .cell import Cell, Outcome, sweep
from .spectra import ODD

_GAINS = (1e-30, 1e-20, 1e-10, 1e10, 1e20, 1e30)
_NEAR_M = 300.0
_RANGES_M = (1e3, 1e4, 1e5, 1e6, 1e7)
_SCENES = ("quadcopter", "hexacopter", "helicopter", "fixed_wing", "type1", "gulls_and_drone")
_POINTS = "change of accuracy [points]"
_REASON = "no guess: 'unknown' with the reason"


def cells(quick: bool) -> Iterator[Cell]:
    """Measure every cell of the chain; `quick` takes a tenth of the records."""
    classifier = Classifier.load()
    count = 600 if quick else 6000
    reference = _accuracy(classifier, 1.0, count)
    yield from sweep(
        "whole chain",
        f"gain, {count} test records",
        _GAINS,
        _POINTS,
        0.2,
        "every record is put on its own noise floor first",
        lambda gain: 100 * abs(_accuracy(classifier, gain, count) - reference),
        "{:g}".format,
    )
    seeds = range(2 if quick else 20)
    near = _scene_answers(classifier, _NEAR_M, seeds)
    yield from sweep(
        "whole chain",
        f"range, {len(near)} dwells of UAV scenes against {_NEAR_M:g} m",
        _RANGES_M,
        _POINTS,
        0.2,
        "range history in float64, reduced to one turn; far blades in closed form",
        lambda range_m: 100 * abs(float(np.mean(_scene_answers(classifier, range_m, seeds)) - np.mean(near))),
        "{:g} m".format,
    )
    yield from sweep(
        "whole chain",
        "record",
        list(ODD),
        "error of the sum of probabilities [1]",
        1e-5,
        _REASON,
        lambda name: _sum_error(classifier, name),
        str,
        silent=ODD,
    )
    yield from sweep(
        "whole chain",
        "pulses",
        [1, 2, 63, 64, 65, 127, 1021, 8191, 65536, 65537],
        "error of the sum of probabilities [1]",
        1e-5,
        _REASON,
        lambda pulses: _unless_unknown(classifier.predict(ODD["constant"](pulses), carrier_hz=10e9, prf_hz=20e3)),
        "{:d}".format,
        silent=(1, 2, 63, 64, 65, 127, 65537),
    )


@cache
def _records(count: int) -> tuple[tuple[float, float, NDArray[np.complex64], NDArray[np.int64]], ...]:
    return tuple((r.radar.carrier_hz, r.radar.prf_hz, r.iq, r.label_indices) for r in stream(0, "test", count))


def _accuracy(classifier: Classifier, gain: float, count: int) -> float:
    """Give the balanced accuracy of the most probable class, 0 to 1."""
    right: list[list[float]] = [[] for _ in CLASSES]
    for carrier_hz, prf_hz, iq, labels in _records(count):
        scaled = (iq * np.float64(gain)).astype(np.complex64)
        best = classifier.predict(scaled, carrier_hz=carrier_hz, prf_hz=prf_hz).probabilities.argmax(axis=-1)
        for truth, answer in zip(labels, best, strict=True):
            right[truth].append(float(truth == answer))
    return float(np.mean([np.mean(one) for one in right]))


def _scene_answers(classifier: Classifier, range_m: float, seeds: range) -> NDArray[np.bool_]:
    """Tell for each rendering whether its most probable class is "uav", the targets being at about this range.

    The distance to `_NEAR_M` is a whole number of half wavelengths. The phases between target and surroundings are
    then the same at every range, so that answers change only by the loss of numerical precision.
    """
    answers = []
    for name in _SCENES:
        scene = Scene.load(name)
        plain = scene.model_dump(mode="python", exclude_unset=True)
        half_m = scene.sight.wavelength_m / 2
        away_m = _NEAR_M + round((range_m - _NEAR_M) / half_m) * half_m
        moved = Scene.build({**plain, "uav": [{**one, "range_m": away_m} for one in plain["uav"]]})
        for seed in seeds:
            radar = moved.sight
            answer = classifier.predict(moved.render(seed).iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
            answers.append(answer.probabilities.argmax(axis=-1) == 0)
    return np.array(answers)


def _sum_error(classifier: Classifier, name: str) -> Outcome:
    iq = ODD[name](1000)
    return _unless_unknown(classifier.predict(iq, carrier_hz=10e9, prf_hz=20e3))


def _unless_unknown(answer: Prediction) -> Outcome:
    if str(answer.reasons):
        return np.nan, str(answer.reasons)
    return float(abs(answer.probabilities.sum(dtype=np.float64) - 1))
