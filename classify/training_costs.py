"""What the models of a training cost, and the account of the cascade of two of them."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from bladewing.models import TEACHER
from bladewing.models.calibration import expected_calibration_error
from bladewing.simulate import Radar, draw_records
from scipy import fft

from .cascade import Cascade
from .gather import Gathered
from .inference import Classifier
from .ladder import CASCADE, COST_KEY, PULSES, RECORDS, STAGES_KEY, by_place
from .timing import quote, time_in_turns
from .training_account import figures

_RADAR = Radar(10e9, 25e3, PULSES)


def add_costs(
    files: Mapping[str, bytes],
    models: dict[str, dict[str, Any]],
    calibrate: Gathered,
    test: Gathered,
    false_alarm: float,
) -> dict[str, Any] | None:
    """Write into each model's account what it costs, and give the account of the cascade from the fast to the best.

    Parameters
    ----------
    files
        File name, `<name>.onnx`, to the sealed model.
    models
        Name to account; `COST_KEY` is added.
    calibrate : Gathered
        The records on which the two are chosen.
    test : Gathered
        The test records.
    false_alarm
        As in `training_account.figures`.

    Returns
    -------
    dict or None
        The names of its two models, how many test records the second is asked about, its figures on them, its cost and
        its thresholds; None where one model is both the cheapest and the best. The teacher is never one of the two.
    """
    classifiers = {name: Classifier(files[f"{name}.onnx"], source=name) for name in models}
    for name, cost in costs_ffts(classifiers).items():
        models[name][COST_KEY] = round(cost, 1)
    if set(models) == {TEACHER}:
        return None
    chosen_by = {}
    for name, classifier in classifiers.items():
        said, accept = classifier.from_inputs(calibrate.inputs), classifier.rules.accept(calibrate.pulses_counted)
        chosen_by[name] = models[name] | {"test": figures(said, calibrate.labels, accept, false_alarm)}
    stages = [by_place(place, chosen_by) for place in ("fast", "best")]
    if stages[0] == stages[1]:
        return None
    first, second = ((files[f"{name}.onnx"], name) for name in stages)
    cascade = Cascade(first, second)
    cheap, dear = (classifiers[name].from_inputs(test.inputs) for name in stages)
    sure = cascade.sure(cheap, test.pulses_counted)
    probabilities = np.where(sure[:, None], cheap, dear)
    return {
        STAGES_KEY: stages,
        "asked": round(float(np.mean(~sure)), 4),
        "test": figures(probabilities, test.labels, cascade.rules.accept(test.pulses_counted), false_alarm)
        | {"expected_calibration_error": round(expected_calibration_error(probabilities, test.labels), 4)},
        COST_KEY: round(costs_ffts({CASCADE: cascade})[CASCADE], 1),
        "accept": list(cascade.accept),
        "accept_by_pulses": cascade.rules.rows(),
    }


def costs_ffts(classifiers: Mapping[str, Classifier]) -> dict[str, float]:
    """What a record costs from samples to answer, over its bare FFT [1]; one thread, all in turns.

    The records are those of all classes at one radar: how many a cascade asks its second model about depends on them.

    Parameters
    ----------
    classifiers
        By name.
    """
    iq = draw_records(_RADAR, RECORDS, 0, purpose="bench").iq
    works: dict[str, Callable[[], object]] = {"FFT": lambda: fft.fft(iq)}
    works |= {
        name: partial(classifier.predict, iq, carrier_hz=_RADAR.carrier_hz, prf_hz=_RADAR.prf_hz)
        for name, classifier in classifiers.items()
    }
    laps = time_in_turns(works, seconds=2.0, least_rounds=5, most_rounds=100)
    medians = {name: quote(lap)["median_us"] for name, lap in laps.items()}
    bare = medians.pop("FFT")
    return {name: median / bare for name, median in medians.items()}
