"""One answer for a track: the dwells of one target fused, and after which dwell a class was safe to name."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .envelope import dwell_length
from .errors import BadInput
from .fusion import CORRELATION, LOOKS, ODDS
from .labels import CLASSES, UNKNOWN

FITTED_DWELL_S = 0.08
"""Dwell that `LOOKS` was fitted to [s]."""

# A declaration, which may come after any dwell, must be surer than a label at the end: the odds are divided by this.
# Of 3029 tracks of 2.5 s at 0 dB and above, answered by models before these with odds divided by 1.5, 2, 2.5, 3 and 4,
# 1.1, 0.7, 0.5, 0.4 and 0.4 % of the birds and clutter were declared UAV (0.3 % were named so at the end), 4.3, 3.2,
# 2.5, 2.1 and 1.6 % of all tracks were declared a wrong class, and 88, 86, 85, 83 and 81 % of the UAVs were declared
# after their first dwell.
DOUBT = 2.5

_OFF = 1e-3  # the sum of probabilities, which may be rounded, is this near to 1
_FLOOR = 1e-6  # least probability that counts: no single dwell rules a class out for ever

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
        The first class that was safe to name as dwell after dwell came in; "" where none ever was. It is never
        withdrawn: later dwells may change the label, and then the two differ.
    declared_after
        Number of dwells until then, those without evidence included; 0 where none was declared.
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
    rule: Decide,
    longer: Mapping[int, Looks] | None = None,
    shown: Collection[str] = (),
    correlation: float = CORRELATION,
    dwell_s: float = FITTED_DWELL_S,
) -> Track:
    """Fuse the answers of consecutive dwells of one target.

    Dwells of one target share its aspect, its background and the model's own error, so their evidence is correlated:
    the log-probabilities are averaged and weighted by the number of dwells that the correlated ones are worth,
    n / (1 + (n - 1) `correlation`). One dwell is left as it is, dwells that agree sharpen each other, and the order
    does not matter to the label. A slow target shows its motion only in longer looks, at several dwells in a row as one
    record: looks of the same length are averaged, and the mean of the averages, weighted by `weights`, counts. A look
    without evidence ("unknown" with 1/3 each: outside the envelope, or without signal) is left out, and so is a longer
    look that holds such a dwell; a look that was merely not sure counts with its probabilities.

    A class is declared after the first dwell at which it would be named even with its odds divided by `DOUBT`: a
    decision that may come after any dwell must be surer than one at the end. So a label may never have been declared.

    Parameters
    ----------
    probabilities
        Shape (dwells, 3), order ("uav", "bird", "clutter").
    labels
        Shape (dwells,), as `Prediction.labels`.
    rule
        Labels and reasons of probabilities (n, 3), as `Classifier.decide`.
    longer
        Length in dwells, a key of `LOOKS` above 1, to probabilities and labels of the looks at that many dwells in a
        row; look number k of length n is known after dwell k n.
    shown
        What the whole track shows, of the keys of `ODDS`: a comb that stays, a wingbeat, a body that heaves as wings
        lift it or sways as a walker's does. It counts after the last dwell only; that nothing is found is no evidence.
    correlation
        Between the evidence of two dwells, 0 (independent) to 1 (many are worth one).
    dwell_s
        Length of a dwell [s], above 0 and at most 5: the weight of a look depends on its duration.

    Raises
    ------
    ValueError
        The shapes do not match, a row holds no probabilities, looks are of a length without a weight, `shown` holds
        something else, `dwell_s` is not above 0 or above 5, or `correlation` is outside 0 to 1.
    """
    if not 0 <= correlation <= 1:
        raise ValueError(f"correlation is {correlation}: it must be in 0 to 1")
    dwell_length(dwell_s)
    for name in shown:
        if name not in ODDS:
            raise ValueError(f"shown holds {name!r}: it may hold {', '.join(ODDS)}")
    p, heard = _heard(probabilities, labels)
    uniform = np.full(len(CLASSES), 1 / len(CLASSES), dtype=np.float32)
    if not heard.any():
        return Track(UNKNOWN, uniform, "no dwell could be judged", 0)
    # row k: what is known after dwell k + 1
    dwell_mean, used = _running_mean(p, heard)
    counts = weights(dwell_s)
    total, weight = counts[1] * dwell_mean, np.full(len(p), counts[1])
    for length, looks in (longer or {}).items():
        if length not in LOOKS or length == 1:
            allowed = ", ".join(str(key) for key in LOOKS if key > 1)
            raise ValueError(f"looks at {length} dwells have no weight: their length must be one of {allowed}")
        look_p, whole = _heard(*looks)
        silent = np.flatnonzero(~heard) // length
        whole[silent[silent < len(whole)]] = False
        look_mean, looked = _running_mean(look_p, whole)
        known = np.minimum(np.arange(1, len(p) + 1) // length, len(looked))
        there = np.concatenate([[0], looked])[known] > 0
        total[there] += counts[length] * look_mean[known[there] - 1]
        weight[there] += counts[length]
    mean = total / weight[:, None]
    worth = used / (1 + np.maximum(used - 1, 0) * correlation)
    evidence = worth[:, None] * mean
    shares = np.exp(evidence - evidence.max(axis=1, keepdims=True))
    fused = shares / shares.sum(axis=1, keepdims=True)
    fused[used == 1] = p[np.argmax(heard)]  # to the last digit
    for name in shown:
        whose, odds = ODDS[name]
        fused[-1, CLASSES.index(whose)] *= odds
    fused[-1] /= fused[-1].sum() if shown else 1  # the only dwell of a track stays as it is, to the last digit
    named, reasons = rule(fused)
    doubted, _ = rule(_doubted(fused, named))
    # it must be the same class: with the odds divided another one may be named
    safe = np.where((used > 0) & (named == doubted), named, UNKNOWN)
    first = int(np.argmax(safe != UNKNOWN))
    declared = str(safe[first]) if safe[first] != UNKNOWN else ""
    after = first + 1 if declared else 0
    return Track(str(named[-1]), fused[-1].astype(np.float32), reasons[-1], int(used[-1]), declared, after)


def weights(dwell_s: float) -> dict[int, float]:
    """Weight of the mean of the looks of each length, by their length in dwells of `dwell_s`.

    `LOOKS` was fitted to dwells of `FITTED_DWELL_S`. Looks at dwells of another length weigh as those of the same
    duration: interpolated over the logarithm of the duration, and beyond the ends as the last.
    """
    known_s = FITTED_DWELL_S * np.array(list(LOOKS))
    counts = np.interp(np.log(dwell_s * np.array(list(LOOKS))), np.log(known_s), list(LOOKS.values()))
    return dict(zip(LOOKS, counts.tolist(), strict=True))


def _doubted(p: NDArray[np.float64], named: NDArray[np.str_]) -> NDArray[np.float64]:
    """Divide the odds of the class that each row is named by `DOUBT`; a rule may name one that is not the likeliest."""
    weights = np.where(np.asarray(named)[:, None] == np.array(CLASSES), p / DOUBT, p)
    return weights / weights.sum(axis=1, keepdims=True)


def _heard(
    probabilities: ArrayLike, labels: Sequence[str] | NDArray[np.str_]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The looks, checked, and which of them carry evidence."""
    rule = f"must be numbers of shape (dwells, {len(CLASSES)}): labels come second"
    try:
        p = np.asarray(probabilities, dtype=np.float64)
    except ValueError:
        raise BadInput(f"probabilities {rule}") from None
    if p.ndim != 2 or p.shape[1] != len(CLASSES):
        raise BadInput(f"probabilities {p.shape} {rule}")
    answers = np.asarray(labels, dtype=np.str_)
    if answers.shape != p.shape[:1]:
        raise BadInput(f"labels {answers.shape} must have shape {p.shape[:1]}, one for each dwell")
    if not np.isfinite(p).all():
        raise ValueError(f"probabilities of look {int(np.argmin(np.isfinite(p).all(axis=1)))} are not finite")
    if not (right := (p >= 0).all(axis=1) & (np.abs(p.sum(axis=1) - 1) < _OFF)).all():
        wrong = int(np.argmin(right))
        raise ValueError(f"probabilities of look {wrong} are {p[wrong]}: they must be 0 or more and sum to 1")
    return p, carry_evidence(p, answers)


def carry_evidence(probabilities: NDArray[np.floating], labels: NDArray[np.str_]) -> NDArray[np.bool_]:
    """Which looks carry evidence, shape (looks,): all but those that are "unknown" with 1/3 each."""
    away = np.abs(probabilities - probabilities.mean(axis=1, keepdims=True))
    return np.asarray((labels != UNKNOWN) | np.any(away >= 1e-6, axis=1), np.bool_)


def _running_mean(p: NDArray[np.float64], heard: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Mean log-probability of the looks heard so far, and their number; 0 where there is none."""
    used = np.cumsum(heard, dtype=np.intp)
    logs = np.where(heard[:, None], np.log(np.maximum(p, _FLOOR)), 0.0)
    return np.cumsum(logs, axis=0) / np.maximum(used, 1)[:, None], used
