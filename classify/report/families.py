"""Left-out families: how a model answers on kinds, bands and PRFs that it was not trained on.

Each family in turn is removed from the training and calibration records, and a model is trained on the rest. This model
and the model trained on all records are tested on the family and on all records of the other classes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from bladewing.models.calibration import expected_calibration_error
from numpy.typing import NDArray

from ..gather import Gathered, gather
from ..inference import Classifier
from ..labels import UNKNOWN
from ..training_config import TrainingConfig
from .metrics import mean_of_rates, rate, recalls

#: Family to a function of the records' truth that tells which records belong to it.
FAMILIES: dict[str, Callable[[Mapping[str, NDArray]], NDArray[np.bool_]]] = {
    "hexacopters": lambda truth: truth["kind"] == "hexacopter",
    "helicopters": lambda truth: truth["kind"] == "helicopter",
    "flocks": lambda truth: truth["kind"] == "flock",
    "sea": lambda truth: truth["kind"] == "sea",
    "wind turbines": lambda truth: truth["kind"] == "wind_turbine",
    "band 18-40 GHz": lambda truth: (truth["carrier_hz"] >= 18e9) & (truth["carrier_hz"] < 40e9),
    "PRF 8-20 kHz": lambda truth: (truth["prf_hz"] >= 8e3) & (truth["prf_hz"] < 20e3),
}

#: The model that is trained eight times, once on all records and once without each family: the cheapest worth having.
MODEL = "features-boosted"

Answer = Callable[[Gathered], tuple[NDArray[np.floating], NDArray[np.str_]]]


def left_out(
    settings: TrainingConfig, model: str = MODEL, *, on_share: Callable[[float], None] | None = None
) -> dict[str, Any]:
    """Leave out every family in turn, and compare with a model trained on all records.

    Parameters
    ----------
    settings : TrainingConfig
        How the model is trained; as many test records are drawn as training ones.
    model : str
        Name in the ladder of models.
    on_share : callable, optional
        Called with the share done.

    Returns
    -------
    dict
        ``model``, ``train_records``, ``test_records`` and ``families``: for each its ``name``, the number of its test
        ``records`` and, with the family in the training (``kept``) and without (``left_out``): the balanced
        ``accuracy`` (the family stands for its class; the other classes count with all their records), the shares of
        the family's records that are ``unknown`` and ``wrong`` (named, but as another class), and the
        ``calibration_error`` over the same records as the accuracy, each class counting a third.
    """
    from bladewing.models import LADDER

    names = LADDER[model].inputs
    share = on_share or (lambda _: None)
    purposes = {purpose: count for purpose, count in settings.sets.items() if purpose != "test"}
    purposes["bench"] = settings.records
    sets: dict[str, Gathered] = {}
    done = 0
    for purpose, count in purposes.items():

        def on_records(number: int) -> None:
            nonlocal done
            done += number
            share(0.6 * done / sum(purposes.values()))

        sets[purpose] = gather(settings.seed, purpose, count, names=names, on_records=on_records)
    test = sets.pop("bench")
    with_all = _trained(model, settings, sets)(test)
    rows = []
    for place, (family, is_in) in enumerate(FAMILIES.items()):
        rest = {purpose: _part(records, ~is_in(records.truth)) for purpose, records in sets.items()}
        without = _trained(model, settings, rest)(test)
        of = is_in(test.truth)
        kept, gone = (_described(*answers, test, of) for answers in (with_all, without))
        rows.append({"name": family, "records": int(of.sum()), "kept": kept, "left_out": gone})
        share(0.6 + 0.4 * (place + 1) / len(FAMILIES))
    return {"model": model, "train_records": settings.records, "test_records": len(test), "families": rows}


def _part(records: Gathered, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Gathered:
    """Select some of the records."""
    return Gathered(
        {name: values[rows] for name, values in records.inputs.items()},
        records.labels[rows],
        {name: values[rows] for name, values in records.truth.items()},
    )


def _trained(model: str, settings: TrainingConfig, sets: Mapping[str, Gathered]) -> Answer:
    """Train a model and return a function that gives records' probabilities and labels."""
    from ..gather import TrainingSets
    from ..train import train_one

    # The training's own test figures are not used here, so a few validation records serve as its test set.
    few = _part(sets["validate"], np.arange(min(600, len(sets["validate"]))))
    sealed, _ = train_one(model, settings, TrainingSets(**sets, test=few), lambda _: None)
    classifier = Classifier(sealed, source=model)

    def answer(test: Gathered) -> tuple[NDArray[np.floating], NDArray[np.str_]]:
        probabilities = classifier.from_inputs(test.inputs)
        return probabilities, classifier.decide(probabilities, test.pulses_counted)[0]

    return answer


def _described(
    probabilities: NDArray[np.floating], answers: NDArray[np.str_], test: Gathered, of: NDArray[np.bool_]
) -> dict[str, Any]:
    """Summarise the answers on a family's records."""
    named, right, classes = answers != UNKNOWN, probabilities.argmax(axis=1) == test.labels, probabilities.shape[1]
    among = of | ~np.isin(test.labels, test.labels[of])
    weights = among / np.maximum(1, np.bincount(test.labels[among], minlength=classes))[test.labels]
    # Each class weighs the same, and the family stands for its class. On records of one class alone even probabilities
    # that are calibrated over all classes would show an error.
    error = expected_calibration_error(probabilities, test.labels, weights=weights) if of.any() else None
    return {
        "accuracy": mean_of_rates(recalls(right[among], test.labels[among], classes)),
        "unknown": rate(~named[of]),
        "wrong": rate((named & ~right)[of]),
        "calibration_error": error,
    }
