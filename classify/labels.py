"""The answers, and how probabilities become one."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CLASSES = ("uav", "bird", "clutter")
UNKNOWN = "unknown"

_LABEL = np.array([*CLASSES, UNKNOWN]).dtype


def decide(probabilities: NDArray[np.floating], accept: Sequence[float]) -> tuple[NDArray[np.str_], list[str]]:
    """Name the most probable class, or say "unknown" where it is not probable enough.

    Parameters
    ----------
    probabilities
        Shape (records, 3), order `CLASSES`.
    accept
        Least probability at which each class is named, order `CLASSES`.

    Returns
    -------
    labels
        Shape (records,): a class or "unknown".
    reasons
        Why a record is "unknown"; "" where it is named.
    """
    labels, reasons = [], []
    for row, best in zip(probabilities.tolist(), probabilities.argmax(axis=-1).tolist(), strict=True):
        named = row[best] >= accept[best]
        labels.append(CLASSES[best] if named else UNKNOWN)
        reasons.append("" if named else f"not sure: best {CLASSES[best]} {_below(row[best], accept[best])}")
    return np.array(labels, _LABEL), reasons


def decide_by_sets(
    probabilities: NDArray[np.floating], limits: Sequence[float], coverage: float
) -> tuple[NDArray[np.str_], list[str]]:
    """Name the class that a prediction set holds alone, or say "unknown" where it holds several or none.

    Parameters
    ----------
    probabilities
        Shape (records, 3), order `CLASSES`.
    limits
        Least probability at which the set holds each class, order `CLASSES`.
    coverage
        What the sets promise; the reasons quote it.

    Returns
    -------
    labels, reasons
        As `decide`; the reason names the set.
    """
    held = np.asarray(probabilities, dtype=np.float64) >= np.asarray(limits, dtype=np.float64)
    labels = np.where(held.sum(axis=-1) == 1, np.asarray(CLASSES)[np.argmax(held, axis=-1)], UNKNOWN)
    reasons = [
        "" if label != UNKNOWN else f"not sure: {_listed(row)} at coverage {coverage:g}"
        for label, row in zip(labels, held, strict=True)
    ]
    return labels, reasons


def _listed(held: NDArray[np.bool_]) -> str:
    names = [name for name, inside in zip(CLASSES, held, strict=True) if inside]
    return " or ".join(names) if names else "no class is likely"


def _below(value: float, limit: float) -> str:
    """`value < limit` with two decimals, or as many as it takes to tell them apart."""
    for decimals in range(2, 7):
        left, right = f"{value:.{decimals}f}", f"{limit:.{decimals}f}"
        if left != right:
            break
    return f"{left} < {right}"
