"""From answered records to the report's tables: accuracy and its slices, false drones, calibration, acceptance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..limits import DWELL_S
from . import metrics

# Answers are class numbers; this one stands for "unknown".
DECLINED = -1
FALSE_ALARM_RATE = 1e-2
SNR_STEP_DB = 5.0
#: SNRs that are sliced. Above lie records with hardly any noise, below micro-motion that nobody could detect.
SNR_RANGE_DB = (-20.0, 50.0)
BETA_STEP_DEG = 10.0
#: Dwells per hour for which false UAVs are quoted: one range cell observed without a pause, dwell after dwell [1/h].
DWELLS_PER_HOUR = 3600 / DWELL_S


@dataclass(frozen=True)
class Truth:
    """Truth of the test records, one entry a record.

    Attributes
    ----------
    classes : tuple of str
        Class names; class numbers below index them.
    label : (n,) int
        Class number.
    kind : (n,) str
        Sub-kind, e.g. "quadcopter" or "flock".
    snr_db : (n,) float
        Micro-motion power over noise power in one sample [dB]; NaN where there is no micro-motion.
    dwell_s : (n,) float
        Length of the record [s].
    radar : (n,) int
        Number of the radar the record was made for.
    beta_rad : (n,) float
        Angle between the line of sight and the rotors' plane [rad]; NaN where there is no rotor.
    """

    classes: tuple[str, ...]
    label: NDArray[np.intp]
    kind: NDArray[np.str_]
    snr_db: NDArray[np.float64]
    dwell_s: NDArray[np.float64]
    radar: NDArray[np.intp]
    beta_rad: NDArray[np.float64]


@dataclass(frozen=True)
class Answers:
    """Answers of one model on the same records.

    Attributes
    ----------
    probabilities : (n, classes) float
    label : (n,) int
        Class number after the acceptance thresholds, `DECLINED` where the model declined.
    answered : (n,) bool
        False where the record was refused before the model saw it (outside the envelope, no signal).
    """

    probabilities: NDArray[np.floating]
    label: NDArray[np.intp]
    answered: NDArray[np.bool_]


def describe_records(truth: Truth) -> dict[str, Any]:
    """Count the records of the test set.

    Returns
    -------
    dict
        ``total``, ``radars``, ``by_class`` and ``by_kind`` counts, ``without_snr``, ``snr_db`` (the 5 % and 95 %
        quantiles [dB], or None) and ``dwell_s`` (the shortest and the longest [s]).
    """
    snr_db = truth.snr_db[np.isfinite(truth.snr_db)]
    kinds, counts = np.unique(truth.kind, return_counts=True)
    return {
        "total": int(truth.label.size),
        "radars": int(np.unique(truth.radar).size),
        "by_class": {name: int(np.sum(truth.label == i)) for i, name in enumerate(truth.classes)},
        "by_kind": {str(kind): int(count) for kind, count in zip(kinds, counts, strict=True)},
        "without_snr": int(truth.label.size - snr_db.size),
        "snr_db": np.quantile(snr_db, [0.05, 0.95]).tolist() if snr_db.size else None,
        "dwell_s": [float(truth.dwell_s.min()), float(truth.dwell_s.max())],
    }


def score(truth: Truth, answers: Answers) -> dict[str, Any]:
    """Compute every score of one model on the test records.

    Scores are over the records that the model saw; refused ones are only counted. Unless stated otherwise an answer is
    the class of highest probability, whether or not the acceptance thresholds would have withheld it.

    Parameters
    ----------
    truth : Truth
        Of n >= 1 records.
    answers : Answers
        Of the same records.

    Returns
    -------
    dict
        Plain numbers, lists and dictionaries, ready for JSON. ``refused`` (records), ``accuracy``, ``recall`` by class
        and ``balanced_accuracy`` (rates); ``design_effect``; ``confusion`` (counts, a row per true class; "accepted"
        has "unknown" as its last column); ``uav_at_pfa`` (see `metrics.detection_at`); ``false_uav`` (rates over the
        records that are no UAV: by the most probable class, and after acceptance); ``reliability``; ``by_snr`` [dB]
        and ``by_dwell`` [s] (slices [from, to) with the rate of "all" and of each class); ``by_beta`` [degree] (of
        UAVs: the rate of "answered" right and of "found" at the false-alarm rate); ``false_per_hour``; ``by_kind``;
        ``acceptance`` (coverage, accuracy of what is accepted, precision and share declined by class).
    """
    seen = answers.answered
    label, probabilities = truth.label[seen], np.asarray(answers.probabilities[seen], np.float64)
    best, accepted = np.argmax(probabilities, axis=-1), answers.label[seen]
    right, uav = best == label, truth.classes.index("uav")
    recalls = metrics.recalls(right, label, len(truth.classes))
    at_pfa = metrics.detection_at(probabilities[:, uav], label == uav, false_alarm_rate=FALSE_ALARM_RATE)
    false_uav = {
        "best": metrics.rate(best[label != uav] == uav),
        "accepted": metrics.rate(accepted[label != uav] == uav),
    }
    return {
        "refused": int(np.count_nonzero(~seen)),
        "accuracy": metrics.rate(right),
        "design_effect": metrics.design_effect(right, truth.radar[seen]),
        "balanced_accuracy": metrics.mean_of_rates(recalls),
        "recall": dict(zip(truth.classes, recalls, strict=True)),
        "confusion": _confusion(label, best, accepted, len(truth.classes)),
        "uav_at_pfa": at_pfa,
        "false_uav": false_uav,
        "false_per_hour": {name: _per_hour(one) for name, one in false_uav.items()},
        "reliability": metrics.reliability(probabilities.max(axis=-1, initial=0.0), right),
        "by_snr": _sliced(truth, seen, right, truth.snr_db[seen], snr_edges(truth.snr_db)),
        "by_dwell": _sliced(truth, seen, right, truth.dwell_s[seen], _one_two_five(truth.dwell_s)),
        "by_beta": _by_beta(
            truth.beta_rad[seen & (truth.label == uav)],
            right[label == uav],
            probabilities[label == uav, uav],
            at_pfa["threshold"],
        ),
        "by_kind": _by_kind(truth, seen, best, accepted),
        "acceptance": _acceptance(truth, seen, accepted),
    }


def snr_edges(snr_db: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give edges in steps of `SNR_STEP_DB` around all SNRs within `SNR_RANGE_DB`; if none, one edge: no slice."""
    low, high = SNR_RANGE_DB
    within = snr_db[(snr_db >= low) & (snr_db < high)]
    if within.size == 0:
        return np.zeros(1)
    first, last = math.floor(within.min() / SNR_STEP_DB), math.floor(within.max() / SNR_STEP_DB) + 1
    return np.arange(first, last + 1) * SNR_STEP_DB


def _confusion(
    label: NDArray[np.intp], best: NDArray[np.intp], accepted: NDArray[np.intp], classes: int
) -> dict[str, list[list[int]]]:
    """Count answers: a row per true class, a column per answer; "unknown" is the last column of ``accepted``."""
    table = np.zeros((classes, classes), int)
    np.add.at(table, (label, best), 1)
    withheld = np.zeros((classes, classes + 1), int)
    np.add.at(withheld, (label, np.where(accepted == DECLINED, classes, accepted)), 1)
    return {"best": table.tolist(), "accepted": withheld.tolist()}


def _sliced(
    truth: Truth,
    seen: NDArray[np.bool_],
    right: NDArray[np.bool_],
    values: NDArray[np.float64],
    edges: NDArray[np.float64],
) -> list[dict[str, Any]]:
    """Give the accuracy in each slice [from, to) of a quantity, overall and by class; NaN values are in no slice."""
    label = truth.label[seen]
    slices = []
    for low, high in pairwise(edges):
        inside = (values >= low) & (values < high)
        rates = metrics.recalls(right[inside], label[inside], len(truth.classes))
        named = dict(zip(truth.classes, rates, strict=True))
        slices.append({"from": float(low), "to": float(high), "all": metrics.rate(right[inside]), **named})
    return slices


def _per_hour(share: metrics.Rate) -> dict[str, float | None]:
    """Turn a share of dwells into a number per hour at `DWELLS_PER_HOUR`, every dwell being decided by itself."""
    return {key: None if share[key] is None else share[key] * DWELLS_PER_HOUR for key in ("value", "low", "high")}


def _by_beta(
    beta_rad: NDArray[np.float64],
    right: NDArray[np.bool_],
    probability: NDArray[np.float64],
    threshold: float | None,
) -> list[dict[str, Any]]:
    """Give the rates of UAVs in slices of beta, the angle between line of sight and rotor plane."""
    if threshold is None or not np.isfinite(beta_rad).any():
        return []
    slices = []
    beta_deg = np.rad2deg(beta_rad)
    count = int(np.nanmax(beta_deg) // BETA_STEP_DEG) + 1  # the largest may lie on an edge
    for low, high in pairwise(BETA_STEP_DEG * np.arange(count + 1.0)):
        inside = (beta_deg >= low) & (beta_deg < high)
        rates = {"answered": metrics.rate(right[inside]), "found": metrics.rate(probability[inside] > threshold)}
        slices.append({"from": float(low), "to": float(high), **rates})
    return slices


def _one_two_five(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give edges from the series 1, 2, 5, 10, ... that enclose every value (positive, any scale)."""
    decades = range(math.floor(math.log10(values.min())), math.ceil(math.log10(values.max())) + 1)
    series = np.array([float(f"{step}e{decade}") for decade in decades for step in (1, 2, 5)])
    first = int(np.searchsorted(series, values.min(), side="right")) - 1
    last = int(np.searchsorted(series, values.max(), side="right"))
    return series[first : last + 1]


def _by_kind(
    truth: Truth, seen: NDArray[np.bool_], best: NDArray[np.intp], accepted: NDArray[np.intp]
) -> list[dict[str, Any]]:
    """Give the rates of each answer for every sub-kind, in the order of the classes."""
    label, kind = truth.label[seen], truth.kind[seen]
    rows = []
    for number, name in enumerate(truth.classes):
        for one in np.unique(kind[label == number]):
            chosen = (kind == one) & (label == number)
            called = {other: metrics.rate(best[chosen] == i) for i, other in enumerate(truth.classes)}
            held_back = metrics.rate(accepted[chosen] == DECLINED)
            declared = metrics.rate(accepted[chosen] == truth.classes.index("uav"))
            row = {"kind": str(one), "class": name, "called": called}
            rows.append({**row, "unknown": held_back, "declared_uav": declared})
    return rows


def _acceptance(truth: Truth, seen: NDArray[np.bool_], accepted: NDArray[np.intp]) -> dict[str, Any]:
    """Give the share accepted (coverage) and the accuracy of what was accepted, over the records seen."""
    label, given = truth.label[seen], accepted != DECLINED
    hits = accepted == label
    return {
        "coverage": metrics.rate(given),
        "accuracy": metrics.rate(hits[given]),
        "precision": {name: metrics.rate(hits[accepted == i]) for i, name in enumerate(truth.classes)},
        "unknown": {name: metrics.rate(~given[label == i]) for i, name in enumerate(truth.classes)},
    }
