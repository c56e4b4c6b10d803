"""The answers, and how probabilities become one."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CLASSES = ("uav", "bird", "clutter")
UNKNOWN = "unknown"

_ANSWERS = np.array([*CLASSES, UNKNOWN])


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
    best = probabilities.argmax(axis=-1)
    top = np.maximum.reduce(probabilities, axis=-1)
    needed = np.array(accept, np.float64)[best]
    named = top >= needed
    labels = _ANSWERS[np.where(named, best, len(CLASSES))]
    reasons = [""] * len(best)
    for row in (~named).nonzero()[0].tolist():
        reasons[row] = f"not sure: best {CLASSES[best[row]]} {_below(float(top[row]), needed[row])}"
    return labels, reasons


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
