"""The least probabilities at which classes are named, by the number of pulses of a record that count.

One rule for all records keeps its promises for all radars together but for no single one: of short records, of which a
model is seldom sure, one named bird in five was wrong where one in ten is promised, of long ones one in twenty
(docs/ablation.md). So each range of pulses has thresholds of its own. Of records whose span of velocities is wide only
as many pulses count as a narrower one would take (`counted_pulses`). A track of several dwells goes by the thresholds
of all records or, if few pulses of its dwells together count or one alone carries evidence, by those of that number of
pulses (`predict.answer`).
"""

import json
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS
from bladewing.models.calibration import NEVER, acceptance_thresholds, conformal_thresholds
from bladewing.models.operating import least_named
from numpy.typing import ArrayLike, NDArray

from .labels import CLASSES

#: PULSES_FROM: fewest pulses of each range, which ends below the next; the first also holds all shorter records.
#: LEAST_RECORDS: a range of fewer calibration records goes by the rule of all records.
PULSES_FROM, LEAST_RECORDS = (64, 256, 1024, 4096), 1000

#: Unambiguous velocity beyond which more pulses show nothing more of birds and clutter, which move more slowly [m/s].
#: A short dwell is no surer for the many pulses of a high PRF: when all counted, 73 in 100 birds named in dwells under
#: 12 ms of 256 to 1023 pulses and 0.5 to 1.5 m/s a bin were right, where 90 are promised; now 85.
COUNTED_MPS = 50.0

#: Least threshold of a class: it must be likelier than all others together. Long calibration records would allow lower
#: thresholds, but they do not show all that there is.
LIKELIER = 0.5

Limits = tuple[float, float, float]
"""One probability for each class, order `CLASSES`."""


def counted_pulses(pulses: ArrayLike, carrier_hz: ArrayLike, prf_hz: ArrayLike) -> NDArray[np.float64]:
    """Pulses that count for the rules: as many as a dwell has bins of Doppler within `COUNTED_MPS` to either side.

    Parameters
    ----------
    pulses
        Number of pulses of each record.
    carrier_hz, prf_hz
        Their carrier and PRF [Hz], of shapes that broadcast with it.

    Returns
    -------
    ndarray of float64
        All of them up to that unambiguous velocity, and a share above it.
    """
    carrier, prf = (np.asarray(rate, np.float64) for rate in (carrier_hz, prf_hz))
    unambiguous_mps = SPEED_OF_LIGHT_MPS / carrier * prf / 4
    return np.asarray(pulses, np.float64) * np.minimum(1.0, COUNTED_MPS / unambiguous_mps)


@dataclass(frozen=True)
class Rule:
    """Thresholds of one range of pulses.

    Parameters
    ----------
    pulses
        The fewest of the range, as `counted_pulses` counts them.
    accept
        Least probability at which each class is named.
    sets
        Coverage to the least probability at which a prediction set holds each class.
    """

    pulses: int
    accept: Limits
    sets: Mapping[float, Limits]

    @classmethod
    def fitted(
        cls,
        probabilities: NDArray[np.floating],
        labels: NDArray[np.integer],
        *,
        precision: float,
        false_alarm: float,
        coverages: Sequence[float],
    ) -> Self:
        """Fit the thresholds that keep their promises on these records, whatever their pulses.

        Parameters
        ----------
        probabilities, labels, precision
            As `acceptance_thresholds` takes them.
        false_alarm
            Largest share of birds and clutter named UAV: the threshold on "uav" keeps to this and to `precision`,
            however many UAVs that costs.
        coverages
            Of the prediction sets.
        """
        least = acceptance_thresholds(probabilities, labels, precision)
        uav, bird, clutter = np.maximum(least, LIKELIER).tolist()
        others = probabilities[labels != 0, 0]
        if len(others):
            uav = max(uav, least_named(others, false_alarm))
        held = {coverage: conformal_thresholds(probabilities, labels, coverage).tolist() for coverage in coverages}
        return cls(1, (uav, bird, clutter), {coverage: (a, b, c) for coverage, (a, b, c) in held.items()})

    def naming_uav_from(self, threshold: float) -> Self:
        """The same rule with another threshold on "uav"."""
        return replace(self, accept=(threshold, *self.accept[1:]))


@dataclass(frozen=True)
class Rules:
    """The rules of a model, in rising number of pulses; one at least.

    Parameters
    ----------
    each
        The first holds for fewer pulses as well.
    """

    each: tuple[Rule, ...]

    @classmethod
    def fitted(
        cls,
        probabilities: NDArray[np.floating],
        labels: NDArray[np.integer],
        pulses: NDArray[np.number],
        of_all: Rule,
        *,
        precision: float,
        false_alarm: float,
    ) -> Self:
        """Fit a rule for each range of `PULSES_FROM`; a range of fewer than `LEAST_RECORDS` takes that of all records.

        No range has a lower threshold on "uav" than the rule of all records: a false drone is the worst of answers.

        Parameters
        ----------
        probabilities, labels, precision, false_alarm
            As `Rule.fitted` takes them.
        pulses
            Of each record, as `counted_pulses` counts them, shape (n,).
        of_all
            The rule of all records; the coverages are taken from it.
        """
        ranges = np.searchsorted(PULSES_FROM[1:], pulses, side="right")
        each = []
        for number, fewest in enumerate(PULSES_FROM):
            own, rule = ranges == number, of_all
            if np.count_nonzero(own) >= LEAST_RECORDS:
                known = probabilities[own], labels[own]
                rule = Rule.fitted(*known, precision=precision, false_alarm=false_alarm, coverages=tuple(of_all.sets))
                rule = rule.naming_uav_from(max(rule.accept[0], of_all.accept[0]))
            each.append(replace(rule, pulses=fewest))
        return cls(tuple(each))

    def of(self, pulses: float | NDArray[np.number]) -> Rule:
        """The rule of a record of which this number of pulses count."""
        return self.each[bisect_right(self.each, float(pulses), lo=1, key=lambda rule: rule.pulses) - 1]

    def _places(self, pulses: ArrayLike) -> NDArray[np.intp]:
        return np.searchsorted([rule.pulses for rule in self.each[1:]], pulses, side="right")

    def accept(self, pulses: ArrayLike) -> NDArray[np.float64]:
        """Least probability at which each class is named, by the numbers of pulses that count, shape (..., 3)."""
        return np.array([rule.accept for rule in self.each])[self._places(pulses)]

    def sets(self, pulses: ArrayLike, coverage: float) -> NDArray[np.float64]:
        """Least probability at which a set of this coverage holds each class, likewise."""
        return np.array([rule.sets[coverage] for rule in self.each])[self._places(pulses)]

    def rows(self) -> list[list[float]]:
        """Fewest pulses and the thresholds of each range, as accounts hold them."""
        return [[rule.pulses, *rule.accept] for rule in self.each]

    def naming_uav_from(self, threshold: float) -> Self:
        """The same rules with another threshold on "uav"."""
        return type(self)(tuple(rule.naming_uav_from(threshold) for rule in self.each))

    def to_json(self) -> str:
        """The rules as they stand in a model's metadata."""
        sets = [[[coverage, *limits] for coverage, limits in rule.sets.items()] for rule in self.each]
        each = zip(self.each, sets, strict=True)
        return json.dumps([{"pulses": rule.pulses, "accept": rule.accept, "sets": held} for rule, held in each])

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read what `to_json` gave.

        Raises
        ------
        ValueError
            It is something else.
        """
        try:
            each = tuple(
                Rule(int(row["pulses"]), _limits(row["accept"]), {float(one): _limits(of) for one, *of in row["sets"]})
                for row in json.loads(text)
            )
            if not each or any(one.pulses >= other.pulses for one, other in pairwise(each)):
                raise ValueError("there must be one rule at least, the pulses rising")
            if any(rule.sets.keys() != each[0].sets.keys() for rule in each):
                raise ValueError("each must hold sets of the same coverages")
            return cls(each)
        except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
            raise ValueError(f"the rules by pulses are damaged: {error}") from None


def _limits(values: Sequence[float]) -> Limits:
    """Check three thresholds, each a probability or up to `NEVER`."""
    uav, bird, clutter = map(float, values)
    if not all(0 <= limit <= NEVER for limit in (uav, bird, clutter)):
        raise ValueError(f"{list(values)} must be {len(CLASSES)} numbers of 0 to 1")
    return uav, bird, clutter
