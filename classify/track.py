"""One answer for a track: the dwells of one target, put together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .labels import CLASSES, UNKNOWN, decide

# Dwells of one target share its aspect, its background and the model's own error, so their evidence is correlated:
# with this coefficient n dwells count as n / (1 + (n - 1) c), at most 1 / c. An assumption, kept on the careful side.
CORRELATION = 0.25

_FLOOR = 1e-6  # no single dwell rules a class out for ever


@dataclass(frozen=True)
class Track:
    """The answer for several dwells of one target.

    Attributes
    ----------
    label
        "uav", "bird", "clutter" or "unknown".
    probabilities
        Shape (3,), order ("uav", "bird", "clutter"); 1/3 each where no dwell said anything.
    reason
        Why the label is "unknown", else "".
    used
        Number of dwells that carried evidence.
    """

    label: str
    probabilities: NDArray[np.float32]
    reason: str
    used: int


def fuse(
    probabilities: ArrayLike,
    labels: Sequence[str] | NDArray[np.str_],
    *,
    accept: Sequence[float] = (0.5, 0.5, 0.5),
    correlation: float = CORRELATION,
) -> Track:
    """Fuse the answers of consecutive dwells of one target.

    The log-probabilities are averaged and weighted by the number of dwells that the correlated ones are worth,
    n / (1 + (n - 1) `correlation`). One dwell is left as it is, dwells that agree sharpen each other, and the order
    does not matter. A dwell without evidence ("unknown" with 1/3 each: outside the envelope, or without signal) is
    left out; one that was merely not sure counts with what it said.

    Parameters
    ----------
    probabilities
        Shape (dwells, 3), order ("uav", "bird", "clutter").
    labels
        Shape (dwells,), as `Prediction.labels`.
    accept
        Least probability at which each class is named, as `Classifier.accept`.
    correlation
        Between the evidence of two dwells, 0 (independent) to 1 (many are worth one).

    Raises
    ------
    ValueError
        The shapes do not match, or `correlation` is outside 0 to 1.
    """
    p = np.asarray(probabilities, dtype=np.float64)
    answers = np.asarray(labels, dtype=np.str_)
    if p.ndim != 2 or p.shape[1] != len(CLASSES) or answers.shape != p.shape[:1]:
        raise ValueError(
            f"probabilities {p.shape} and labels {answers.shape} must have shapes (dwells, 3) and (dwells,)"
        )
    if not 0 <= correlation <= 1:
        raise ValueError(f"correlation is {correlation}: it must be in 0 to 1")
    silent = (answers == UNKNOWN) & np.all(np.abs(p - p.mean(axis=1, keepdims=True)) < 1e-6, axis=1)
    heard = p[~silent]
    if len(heard) == 0:
        uniform = np.full(len(CLASSES), 1 / len(CLASSES), dtype=np.float32)
        return Track(UNKNOWN, uniform, "no dwell could be judged", 0)
    if len(heard) == 1:
        fused = heard
    else:
        worth = len(heard) / (1 + (len(heard) - 1) * correlation)
        evidence = worth * np.log(np.maximum(heard, _FLOOR)).mean(axis=0)
        weights = np.exp(evidence - evidence.max())
        fused = (weights / weights.sum())[None, :]
    named, reasons = decide(fused, accept)
    return Track(str(named[0]), fused[0].astype(np.float32), reasons[0], len(heard))
