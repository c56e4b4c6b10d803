"""One answer for a track: the dwells of one target put together, and when it was safe to say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .labels import CLASSES, UNKNOWN, decide

# Dwells of one target share its aspect, its background and the model's own error, so their evidence is correlated:
# with this coefficient n dwells count as n / (1 + (n - 1) c), at most 1 / c. Measured on 1200 simulated tracks:
# the calibration error of 31 dwells is 0.026 here, 0.117 at 0.25, 0.064 at 0.5, 0.029 at 0.9 (the table "fusion" of
# tests/benchmarks/classification_tables.py; 0.65 to 0.8 are as good as one another).
CORRELATION = 0.72

LONGER = 5
"""Dwells in a row that are looked at once more as one: a slow target shows its motion only to a long look."""

# Who may speak after every dwell errs more often than who speaks once: on tracks of 2.5 s, 1.9 % of birds and clutter
# were declared UAV at limits that 0.8 % of single dwells exceed. Odds halved before they are judged bring 0.9 % back.
DOUBT = 2.0

WING_ODDS = 10.0
"""What a wingbeat, found in the whole track, multiplies the odds of a bird by. On simulated tracks at 0 dB and above
one is found in 62 % of flapping birds and in 0 to 3 % of any other kind; far less is counted, because the dwells have
seen the same wings. That none is found says nothing: most gliding and weak birds show none."""

_FLOOR = 1e-6  # no single dwell rules a class out for ever

Decide = Callable[[NDArray[np.floating]], tuple[NDArray[np.str_], list[str]]]
Looks = tuple[ArrayLike, Sequence[str] | NDArray[np.str_]]


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
    declared
        The class that was safe to name first, as dwell after dwell came in; "" where none ever was. It stands: later
        dwells may carry the label elsewhere, and then the two differ.
    declared_after
        Dwells that it took, silent ones among them; 0 where none was declared.
    """

    label: str
    probabilities: NDArray[np.float32]
    reason: str
    used: int
    declared: str = ""
    declared_after: int = 0


def fuse(
    probabilities: ArrayLike,
    labels: Sequence[str] | NDArray[np.str_],
    *,
    longer: Looks | None = None,
    wings: bool = False,
    accept: Sequence[float] = (0.5, 0.5, 0.5),
    rule: Decide | None = None,
    correlation: float = CORRELATION,
) -> Track:
    """Fuse the answers of consecutive dwells of one target.

    The log-probabilities are averaged and weighted by the number of dwells that the correlated ones are worth,
    n / (1 + (n - 1) `correlation`). One dwell is left as it is, dwells that agree sharpen each other, and the order
    does not matter to the label. Longer looks at the same dwells are averaged among themselves, and the mean of the
    two averages counts. A look without evidence ("unknown" with 1/3 each: outside the envelope, or without signal) is
    left out; one that was merely not sure counts with what it said.

    A class is declared after the first dwell at which it would be named even with its odds divided by `DOUBT`: one who
    may speak after every dwell must be surer than one who speaks once. So a label may stand that never was declared.

    Parameters
    ----------
    probabilities
        Shape (dwells, 3), order ("uav", "bird", "clutter").
    labels
        Shape (dwells,), as `Prediction.labels`.
    longer
        Probabilities and labels of the looks at each `LONGER` dwells in a row; number k is known after dwell
        k `LONGER`. None without them.
    wings
        Whether a wingbeat is found in the whole track; it speaks for a bird at the end, not while dwells come in.
    accept
        Least probability at which each class is named, as `Classifier.accept`.
    rule
        Instead of `accept`: labels and reasons of probabilities (n, 3), as `Classifier.decide`.
    correlation
        Between the evidence of two dwells, 0 (independent) to 1 (many are worth one).

    Raises
    ------
    ValueError
        The shapes do not match, or `correlation` is outside 0 to 1.
    """
    if not 0 <= correlation <= 1:
        raise ValueError(f"correlation is {correlation}: it must be in 0 to 1")
    p, heard = _heard(probabilities, labels)
    uniform = np.full(len(CLASSES), 1 / len(CLASSES), dtype=np.float32)
    if not heard.any():
        return Track(UNKNOWN, uniform, "no dwell could be judged", 0)
    # row k: what is known after dwell k + 1
    mean, used = _running_mean(p, heard)
    looks = np.zeros(len(p), dtype=np.intp)
    if longer is not None:
        long_mean, long_used = _running_mean(*_heard(*longer))
        known = np.minimum(np.arange(1, len(p) + 1) // LONGER, len(long_used))
        looks = np.concatenate([[0], long_used])[known]
        both = looks > 0
        mean[both] = (mean[both] + long_mean[known[both] - 1]) / 2
    worth = used / (1 + np.maximum(used - 1, 0) * correlation)
    evidence = worth[:, None] * mean
    weights = np.exp(evidence - evidence.max(axis=1, keepdims=True))
    fused = weights / weights.sum(axis=1, keepdims=True)
    fused[(used == 1) & (looks == 0)] = p[np.argmax(heard)]  # to the last digit
    if wings:
        fused[-1, CLASSES.index("bird")] *= WING_ODDS
        fused[-1] /= fused[-1].sum()
    rule = rule or partial(decide, accept=accept)
    (named, reasons), (doubted, _) = rule(fused), rule(_doubted(fused))
    # the same class, or halved odds would let the second speak
    safe = np.where((used > 0) & (named == doubted), named, UNKNOWN)
    first = int(np.argmax(safe != UNKNOWN))
    declared = str(safe[first]) if safe[first] != UNKNOWN else ""
    after = first + 1 if declared else 0
    return Track(str(named[-1]), fused[-1].astype(np.float32), reasons[-1], int(used[-1]), declared, after)


def _doubted(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide the odds of the most probable class of each row by `DOUBT`."""
    best = p == p.max(axis=1, keepdims=True)
    weights = np.where(best, p / DOUBT, p)
    return weights / weights.sum(axis=1, keepdims=True)


def _heard(
    probabilities: ArrayLike, labels: Sequence[str] | NDArray[np.str_]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The looks, checked, and which of them carry evidence."""
    p = np.asarray(probabilities, dtype=np.float64)
    answers = np.asarray(labels, dtype=np.str_)
    if p.ndim != 2 or p.shape[1] != len(CLASSES) or answers.shape != p.shape[:1]:
        raise ValueError(
            f"probabilities {p.shape} and labels {answers.shape} must have shapes (dwells, 3) and (dwells,)"
        )
    return p, (answers != UNKNOWN) | np.any(np.abs(p - p.mean(axis=1, keepdims=True)) >= 1e-6, axis=1)


def _running_mean(p: NDArray[np.float64], heard: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Mean log-probability of the looks heard so far, and their number; 0 where there is none."""
    used = np.cumsum(heard, dtype=np.intp)
    logs = np.where(heard[:, None], np.log(np.maximum(p, _FLOOR)), 0.0)
    return np.cumsum(logs, axis=0) / np.maximum(used, 1)[:, None], used
