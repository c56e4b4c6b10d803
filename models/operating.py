"""The threshold on "uav" for a false-alarm rate that a user chooses, and the detection probability that remains."""

import itertools
import json
import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import CLASS_COUNT, require_finite, require_labels
from .calibration import NEVER

#: Fewest false alarms that a threshold may rest on: with n the relative standard deviation of its rate is 1 / sqrt(n),
#: with 10 about a third.
SUPPORT = 10

# Renard's series R10 (ISO 3), falling. It also holds half of most of its rates, the share that a cascade gives each of
# its two models.
_RATES = (5.0, 4.0, 3.15, 2.5, 2.0, 1.6, 1.25, 1.0, 0.8, 0.63)
_EVERY_WIN = 0.3333333  # the most probable of three classes always reaches it
_ABOVE = 1e-6  # from a probability to a threshold over it: larger than the rounding to float32 and to 7 decimals


def first_out(scores: NDArray[np.floating], false_alarm: float) -> float:
    """Return the highest score of a non-target that must not pass: letting only higher ones pass keeps to the rate.

    This is the threshold for scores at hand, of any scale: compare them with it by ``>``.

    Parameters
    ----------
    scores
        Of the non-targets, shape (n,), at least one; larger is more like a target.
    false_alarm
        Largest share of them that may pass, at least 0 and below 1. At most that share lies strictly above the score
        given, ties included, and no lower score keeps to it.
    """
    # The margin keeps 0.01 * 300 = 3.0000000000000004 and 2.9999999999999996 alike.
    passing = min(math.floor(false_alarm * len(scores) + 1e-9), len(scores) - 1)
    return float(np.sort(np.asarray(scores, np.float64))[::-1][passing])


def least_named(probabilities: NDArray[np.floating], false_alarm: float) -> float:
    """Return a probability that at most a given share of the non-targets reaches.

    This is the threshold that a model stores: later probabilities are compared with it by ``>=``, in float32 too. It is
    `first_out` plus a small margin; the few records at hand between the two do not reach it.

    Parameters
    ----------
    probabilities, false_alarm
        As for `first_out`.
    """
    return first_out(probabilities, false_alarm) + _ABOVE


@dataclass(frozen=True)
class OperatingPoint:
    """One choice between false alarms and misses.

    Parameters
    ----------
    false_alarm
        Share of birds and clutter that are named UAV, at most.
    threshold
        Least probability at which a record is named UAV.
    detection
        Share of UAVs that are named so.
    """

    false_alarm: float
    threshold: float
    detection: float


@dataclass(frozen=True)
class OperatingCurve:
    """Operating points measured on calibration records, their false-alarm rates in steps of a tenth of a decade.

    Parameters
    ----------
    uavs, others
        Calibration records that are UAVs, and that are birds or clutter.
    points
        In falling false-alarm rate; rates that rest on fewer than `SUPPORT` false alarms are left out.
    """

    uavs: int
    others: int
    points: tuple[OperatingPoint, ...]

    def at(self, false_alarm: float, models: int = 1) -> OperatingPoint:
        """Give the point that finds most UAVs without exceeding a false-alarm rate.

        Parameters
        ----------
        false_alarm
            Above 0 and below 1.
        models
            Number of models that share the rate evenly, this one included.

        Raises
        ------
        ValueError
            The rate is not between 0 and 1, or the calibration records cannot support one so low.
        """
        if not 0 < false_alarm < 1:
            raise ValueError(f"false-alarm rate {false_alarm:g}: it must be above 0 and below 1")
        kept = [point for point in self.points if models * point.false_alarm <= false_alarm * (1 + 1e-9)]
        if not kept:
            # rounded up: rounded down it would be refused itself
            least = math.ceil(self.points[-1].false_alarm * models * 1e5) / 1e5 if self.points else None
            raise ValueError(
                f"false-alarm rate {false_alarm:g} cannot be supported by {self.others} calibration records of birds "
                f"and clutter: a rate must rest on {SUPPORT} false alarms or more: "
                f"{'' if least is None else f'ask for {least:g} or more, or '}train with more records"
            )
        return kept[0]

    def to_json(self) -> str:
        """Give the curve as it stands in a model's metadata."""
        rows = [[round(value, 7) for value in asdict(point).values()] for point in self.points]
        return json.dumps({"uavs": self.uavs, "others": self.others, "points": rows})

    @classmethod
    def from_json(cls, text: str) -> "OperatingCurve":
        """Read what `to_json` gave.

        Raises
        ------
        ValueError
            It is something else.
        """
        try:
            table = json.loads(text)
            rows = np.array([[float(value) for value in row] for row in table["points"]]).reshape(-1, 3)
            # a threshold just above the probability 1 is one that nothing reaches
            if not np.all((rows >= 0) & (rows <= [1, NEVER, 1])) or np.any(np.diff(rows[:, 0]) >= 0):
                raise ValueError("rates, thresholds and detections must lie in 0 to 1, the rates falling")
            points = tuple(OperatingPoint(*row) for row in rows.tolist())
            return cls(int(table["uavs"]), int(table["others"]), points)
        except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
            raise ValueError(f"the operating curve is damaged: {error}") from None


def operating_curve(probabilities: ArrayLike, labels: NDArray[np.integer]) -> OperatingCurve:
    """Find the threshold of each false-alarm rate that the records support.

    A record is named UAV where that is the most probable class and its probability reaches the threshold. With the
    threshold just above the k-th highest of n false ones, a new bird or clutter record exceeds it with probability at
    most k / (n + 1) (the argument of conformal prediction: its rank among them is uniform).

    Parameters
    ----------
    probabilities
        Calibrated, of records that the model did not train on, shape (n, 3), UAV first.
    labels
        Shape (n,), whole numbers 0 to 2.

    Returns
    -------
    OperatingCurve

    Raises
    ------
    ValueError
        Where shapes disagree, a value is not finite, or there is no UAV or nothing else.
    """
    table = np.asarray(probabilities, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] != CLASS_COUNT:
        raise ValueError(f"probabilities has shape {table.shape}; it must be (n, {CLASS_COUNT})")
    require_finite(table, "probabilities")
    require_labels(labels, len(table), "labels")
    named = np.where(table.argmax(axis=1) == 0, table[:, 0], 0.0)
    true, false = named[labels == 0], np.sort(named[labels != 0])[::-1]
    if not len(true) or not len(false):
        raise ValueError(f"{len(true)} UAVs and {len(false)} others; an operating curve needs both")
    points = []
    for step in itertools.count():
        rate = round(_RATES[step % len(_RATES)] * 10.0 ** (-1 - step // len(_RATES)), 7)
        rank = math.floor(rate * (len(false) + 1) * (1 + 1e-9))  # from 1: the threshold is just above it
        if rank < SUPPORT:
            break
        threshold = max(round(float(false[rank - 1]) + _ABOVE, 7), _EVERY_WIN)
        points.append(OperatingPoint(rate, threshold, float(np.mean(true >= threshold))))
    return OperatingCurve(len(true), len(false), tuple(points))
