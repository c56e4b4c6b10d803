"""Left-out families: what a model says of kinds, bands and PRFs that it was not trained on.

Each family is taken out of the records that train and calibrate, a model is made of the rest, and both it and the model
of all records are asked about the family, beside all records of the other classes.
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

#: Which records belong to a family, by their truth.
FAMILIES: dict[str, Callable[[Mapping[str, NDArray]], NDArray[np.bool_]]] = {
    "hexacopters": lambda truth: truth["kind"] == "hexacopter",
    "helicopters": lambda truth: truth["kind"] == "helicopter",
    "flocks": lambda truth: truth["kind"] == "flock",
    "sea": lambda truth: truth["kind"] == "sea",
    "wind turbines": lambda truth: truth["kind"] == "wind_turbine",
    "band 18-40 GHz": lambda truth: (truth["carrier_hz"] >= 18e9) & (truth["carrier_hz"] < 40e9),
    "PRF 8-20 kHz": lambda truth: (truth["prf_hz"] >= 8e3) & (truth["prf_hz"] < 20e3),
}

#: The model that is made eight times: the cheapest to train that is worth having.
MODEL = "features-boosted"

Answer = Callable[[Gathered], tuple[NDArray[np.floating], NDArray[np.str_]]]


def left_out(
    settings: TrainingConfig, model: str = MODEL, *, on_share: Callable[[float], None] | None = None
) -> dict[str, Any]:
    """Leave every family out in turn.

    Parameters
    ----------
    settings : TrainingConfig
        How the model is trained; as many test records are drawn as training ones.
    model : str
        Of the ladder.
    on_share : callable, optional
        Called with the share done.

    Returns
    -------
    dict
        ``model``, ``train_records``, ``test_records`` and ``families``: for each its ``name``, its test ``records``
        and, with it in the training (``kept``) and without (``left_out``), the balanced ``accuracy`` (the classes that
        the family does not belong to stand with all their records), the shares ``unknown`` and ``wrong`` (named, and
        not what they are) of its records, and the ``calibration_error`` over the records that the accuracy is of, each
        class counting a third.
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
    """Some of the records."""
    return Gathered(
        {name: values[rows] for name, values in records.inputs.items()},
        records.labels[rows],
        {name: values[rows] for name, values in records.truth.items()},
    )


def _trained(model: str, settings: TrainingConfig, sets: Mapping[str, Gathered]) -> Answer:
    """Train, and give what answers records: their probabilities and labels."""
    from ..gather import TrainingSets
    from ..train import train_one

    # the account's own figures are not used here, so any records do
    few = _part(sets["validate"], np.arange(min(600, len(sets["validate"]))))
    sealed, _ = train_one(model, settings, TrainingSets(**sets, test=few), lambda _: None)
    classifier = Classifier(sealed, source=model)

    def answer(test: Gathered) -> tuple[NDArray[np.floating], NDArray[np.str_]]:
        probabilities = classifier.from_inputs(test.inputs)
        return probabilities, classifier.decide(probabilities, test.truth["pulses"])[0]

    return answer


def _described(
    probabilities: NDArray[np.floating], answers: NDArray[np.str_], test: Gathered, of: NDArray[np.bool_]
) -> dict[str, Any]:
    """What is said of a family's records."""
    named, right, classes = answers != UNKNOWN, probabilities.argmax(axis=1) == test.labels, probabilities.shape[1]
    among = of | ~np.isin(test.labels, test.labels[of])
    weights = among / np.maximum(1, np.bincount(test.labels[among], minlength=classes))[test.labels]
    # of a balanced world in which the family stands for its class: among records of one class alone even probabilities
    # that are right on the whole err
    error = expected_calibration_error(probabilities, test.labels, weights=weights) if of.any() else None
    return {
        "accuracy": mean_of_rates(recalls(right[among], test.labels[among], classes)),
        "unknown": rate(~named[of]),
        "wrong": rate((named & ~right)[of]),
        "calibration_error": error,
    }
