"""The labels, and how probabilities become one of them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CLASSES = ("uav", "bird", "clutter")
UNKNOWN = "unknown"

_LABEL = np.array([*CLASSES, UNKNOWN]).dtype


def decide(
    probabilities: NDArray[np.floating], accept: Sequence[float] | NDArray[np.floating]
) -> tuple[NDArray[np.str_], list[str]]:
    """Name the most probable class, or say "unknown" where it is not probable enough.

    Parameters
    ----------
    probabilities
        Shape (records, 3), order `CLASSES`.
    accept
        Least probability at which each class is named, order `CLASSES`: for all records, or an array of (records, 3).

    Returns
    -------
    labels
        Shape (records,): a class or "unknown".
    reasons
        Why a record is "unknown"; "" where it is named.
    """
    labels, reasons = [], []
    winners = probabilities.argmax(axis=-1).tolist()
    for row, best, least in zip(probabilities.tolist(), winners, _of_each(accept, len(winners)), strict=True):
        named = row[best] >= least[best]
        labels.append(CLASSES[best] if named else UNKNOWN)
        reasons.append("" if named else f"not sure: best {_below(CLASSES[best], row[best], least[best])}")
    return np.array(labels, _LABEL), reasons


def decide_by_sets(
    probabilities: NDArray[np.floating],
    limits: Sequence[float] | NDArray[np.floating],
    coverage: float,
    least_uav: float | None = None,
) -> tuple[NDArray[np.str_], list[str]]:
    """Name the class that a prediction set holds alone, or say "unknown" where it holds several or none.

    Parameters
    ----------
    probabilities
        Shape (records, 3), order `CLASSES`.
    limits
        Least probability at which the set holds each class, order `CLASSES`: of all, or an array of (records, 3).
    coverage
        What the sets promise; the reasons quote it.
    least_uav
        Where given, a UAV is named only if "uav" is also the most probable class and has at least this probability.

    Returns
    -------
    labels, reasons
        As `decide`; the reason names the set, or the probability that was not reached.
    """
    labels, reasons = [], []
    rows = np.asarray(probabilities, dtype=np.float64).tolist()
    for row, each in zip(rows, _of_each(limits, len(rows)), strict=True):
        held = [name for name, p, limit in zip(CLASSES, row, each, strict=True) if p >= limit]
        reason = ""
        if len(held) != 1:
            reason = f"not sure: {' or '.join(held) or 'no class is likely'} at coverage {coverage:g}"
        elif held == ["uav"] and least_uav is not None and row[0] < (least := max(least_uav, *row)):
            reason = f"not sure: {_below('uav', row[0], least)}"
        labels.append(UNKNOWN if reason else held[0])
        reasons.append(reason)
    return np.array(labels, _LABEL), reasons


def _of_each(limits: Sequence[float] | NDArray[np.floating], records: int) -> Sequence[Sequence[float]]:
    """Limits of each record, from limits of all records or of each."""
    if isinstance(limits, np.ndarray):
        return np.broadcast_to(limits, (records, len(CLASSES))).tolist()
    return [limits] * records


def _below(name: str, value: float, limit: float) -> str:
    """`name value < limit` with two decimals, or as many as it takes to tell them apart; or that no value is enough."""
    if limit > 1:  # `NEVER` of the calibration, or the threshold of an operating point
        why = "but no threshold of this model is precise enough to name it: train with more records"
        return f"{name} {value:.2f}, {why}"
    for decimals in range(2, 7):
        left, right = f"{value:.{decimals}f}", f"{limit:.{decimals}f}"
        if left != right:
            break
    return f"{name} {left} < {right}"
