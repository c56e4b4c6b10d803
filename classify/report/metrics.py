"""The report's arithmetic: rates with their intervals, detection at a false-alarm rate, calibration.

Every function takes arrays and returns numbers; none depends on radars, models or files. A rate is the dictionary
``{"value", "low", "high", "right", "count"}``: a share of ``count`` records with its 95 % Wilson interval, all three
``None`` where there are no records (strict JSON has no NaN).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from bladewing.models.operating import first_out
from numpy.typing import NDArray

# Two-sided 95 % of the normal distribution.
Z_95 = 1.959963984540054

Rate = dict[str, Any]


def wilson(right: int, count: int) -> tuple[float, float]:
    """Give the 95 % Wilson score interval of a binomial share.

    Parameters
    ----------
    right, count : int
        Successes and trials, 0 <= right <= count, count >= 1.

    Returns
    -------
    low, high : float
        0 <= low <= right / count <= high <= 1.

    Raises
    ------
    ValueError
        If the counts are not 0 <= right <= count with count >= 1.
    """
    if not (count >= 1 and 0 <= right <= count):
        raise ValueError(f"right={right}, count={count}: 0 <= right <= count and count >= 1 are required")
    share, z = right / count, Z_95
    shrink = 1.0 + z * z / count
    centre = (share + z * z / (2 * count)) / shrink
    half = z * math.sqrt(share * (1.0 - share) / count + z * z / (4.0 * count * count)) / shrink
    # The ends are set exactly: rounding would leave about 1e-17 where the closed form gives zero.
    low = 0.0 if right == 0 else max(0.0, centre - half)
    high = 1.0 if right == count else min(1.0, centre + half)
    return low, high


def rate(hits: NDArray[np.bool_]) -> Rate:
    """Give the share of true entries with its 95 % Wilson interval; all three are ``None`` for an empty array.

    Parameters
    ----------
    hits : (n,) bool

    Returns
    -------
    dict
        ``value``, ``low``, ``high`` (0 to 1 or None), ``right`` and ``count``.
    """
    count, right = int(hits.size), int(np.count_nonzero(hits))
    if count == 0:
        return {"value": None, "low": None, "high": None, "right": 0, "count": 0}
    low, high = wilson(right, count)
    return {"value": right / count, "low": low, "high": high, "right": right, "count": count}


def recalls(hits: NDArray[np.bool_], labels: NDArray[np.integer], classes: int) -> list[Rate]:
    """Give the rate of each class's records, in class order; their `mean_of_rates` is the balanced accuracy.

    Parameters
    ----------
    hits : (n,) bool
    labels : (n,) int
        Class number of each record.
    classes : int
    """
    return [rate(hits[labels == number]) for number in range(classes)]


def mean_of_rates(rates: Sequence[Rate]) -> Rate:
    """Average independent rates and derive the mean's interval from theirs (MOVER, Zou and Donner 2008).

    Balanced accuracy is such a mean, of the classes' recalls. The lower end of the interval lies below the mean by the
    root of the summed squares of the rates' own distances to their lower ends, divided by the number of rates; the
    upper end likewise. Rates over no records are left out.

    Parameters
    ----------
    rates : sequence of dict
        As made by `rate`.

    Returns
    -------
    dict
        As made by `rate`; ``right`` and ``count`` are the sums.
    """
    known = [part for part in rates if part["count"] > 0]
    right, count = sum(part["right"] for part in known), sum(part["count"] for part in known)
    if not known:
        return {"value": None, "low": None, "high": None, "right": 0, "count": 0}
    value = sum(part["value"] for part in known) / len(known)
    below = math.sqrt(sum((part["value"] - part["low"]) ** 2 for part in known)) / len(known)
    above = math.sqrt(sum((part["high"] - part["value"]) ** 2 for part in known)) / len(known)
    return {"value": value, "low": value - below, "high": value + above, "right": right, "count": count}


def design_effect(hits: NDArray[np.bool_], groups: NDArray[np.intp]) -> float | None:
    """Give the variance of a share over the variance that independent records would have.

    The records of one group were made for one radar; if that radar is hard, they fail together. The result is the
    between-group (ratio-estimator) variance of the share over the binomial one.

    Parameters
    ----------
    hits : (n,) bool
    groups : (n,) int
        The group of each record, any labels.

    Returns
    -------
    float or None
        None where fewer than two groups exist or every record has the same outcome.
    """
    count = hits.size
    share = float(hits.mean()) if count else 0.0
    names, index = np.unique(groups, return_inverse=True)
    if names.size < 2 or share in (0.0, 1.0):
        return None
    residues = np.bincount(index, weights=hits - share, minlength=names.size)
    variance = names.size / (names.size - 1) * float(np.sum(residues**2)) / count**2
    return variance / (share * (1.0 - share) / count)


def detection_at(
    scores: NDArray[np.floating], targets: NDArray[np.bool_], *, false_alarm_rate: float
) -> dict[str, Any]:
    """Give the detection rate at a threshold that at most a given share of the non-targets exceeds.

    The threshold is the lowest non-target score that keeps to this share (see `first_out`). A record is declared when
    its score is strictly above the threshold.

    Parameters
    ----------
    scores : (n,) float
        Larger means more like a target.
    targets : (n,) bool
    false_alarm_rate : float
        Largest allowed share of the non-targets declared, 0 <= rate < 1.

    Returns
    -------
    dict
        ``detection`` and ``false_alarm`` (rates), ``threshold`` (None where there are no non-targets) and
        ``allowed`` (the false-alarm rate asked for).

    Raises
    ------
    ValueError
        If the rate is outside [0, 1).
    """
    if not 0.0 <= false_alarm_rate < 1.0:
        raise ValueError(f"false_alarm_rate={false_alarm_rate}: must lie in [0, 1)")
    if targets.all():
        none = np.zeros(0, bool)
        return {"detection": rate(none), "false_alarm": rate(none), "threshold": None, "allowed": false_alarm_rate}
    threshold = first_out(scores[~targets], false_alarm_rate)
    declared = scores > threshold
    return {
        "detection": rate(declared[targets]),
        "false_alarm": rate(declared[~targets]),
        "threshold": threshold,
        "allowed": false_alarm_rate,
    }


def reliability(confidence: NDArray[np.floating], hits: NDArray[np.bool_], *, bins: int = 15) -> dict[str, Any]:
    """Give the reliability diagram and the expected calibration error over equal bins of the confidence.

    Parameters
    ----------
    confidence : (n,) float
        Probability of the winning class, 0 to 1.
    hits : (n,) bool
        Whether the winning class was right.
    bins : int
        Number of equal bins of [0, 1]; a bin includes its upper edge, and the first bin also includes 0.

    Returns
    -------
    dict
        ``ece`` (None for no records) and ``bins``: a list of ``{"from", "to", "confidence", "accuracy"}`` for the
        bins that hold records, ``confidence`` being the mean and ``accuracy`` a rate.
    """
    index = np.clip(np.ceil(confidence * bins).astype(int) - 1, 0, bins - 1)
    filled: list[dict[str, Any]] = []
    gap = 0.0
    for number in np.unique(index):
        chosen = index == number
        accuracy, mean = rate(hits[chosen]), float(np.mean(confidence[chosen], dtype=np.float64))
        gap += accuracy["count"] / hits.size * abs(accuracy["value"] - mean)
        edge = {"from": int(number) / bins, "to": (int(number) + 1) / bins}
        filled.append({**edge, "confidence": mean, "accuracy": accuracy})
    return {"ece": gap if filled else None, "bins": filled}
