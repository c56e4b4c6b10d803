"""Asking the models about fresh synthetic records."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from bladewing.simulate import stream

from ..inference import Classifier
from ..labels import CLASSES
from .scores import DECLINED, Answers, Truth

PURPOSE = "report"


def ask(
    classifiers: Mapping[str, Classifier],
    *,
    records: int,
    seed: int,
    on_records: Callable[[int], None] | None = None,
) -> tuple[Truth, dict[str, Answers]]:
    """Draw test records and let every model answer all of them, the way a user would.

    Parameters
    ----------
    classifiers : mapping of str to Classifier
        At least one.
    records : int
        How many, >= 1.
    seed : int
        Root seed; the records are those of the purpose "report", which no training draws from.
    on_records : callable, optional
        Called with the number of records done until now.

    Returns
    -------
    truth : Truth
    answers : dict of str to Answers
    """
    index = {name: number for number, name in enumerate(CLASSES)}
    drawn: dict[str, list[np.ndarray]] = {
        name: [] for name in ("label", "kind", "snr_db", "dwell_s", "radar", "beta_rad")
    }
    said: dict[str, tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]] = {
        name: ([], [], []) for name in classifiers
    }
    done = 0
    for number, some in enumerate(stream(seed, PURPOSE, records)):
        radar, count = some.radar, len(some)
        drawn["label"].append(np.array([index[str(label)] for label in some.labels]))
        drawn["kind"].append(np.asarray(some.truth["kind"]).astype(str))
        drawn["snr_db"].append(np.asarray(some.truth["snr_db"], np.float64))
        drawn["beta_rad"].append(np.asarray(some.truth["beta_rad"], np.float64))
        drawn["dwell_s"].append(np.full(count, radar.dwell_s))
        drawn["radar"].append(np.full(count, number))
        for name, classifier in classifiers.items():
            given = classifier.predict(some.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
            labels = np.array([index.get(str(label), DECLINED) for label in given.labels])
            probabilities, label, answered = said[name]
            probabilities.append(given.probabilities)
            label.append(labels)
            inside = classifier.envelope.reason(radar.carrier_hz, radar.prf_hz, radar.pulses) is None
            answered.append(np.any(some.iq, axis=-1) & inside)
        done += count
        if on_records is not None:
            on_records(done)
    truth = Truth(classes=CLASSES, **{name: np.concatenate(parts) for name, parts in drawn.items()})
    return truth, {name: Answers(*(np.concatenate(parts) for parts in lists)) for name, lists in said.items()}
