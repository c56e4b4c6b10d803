"""A cascade of two trained models: the better one is asked where the fast one is not sure."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from bladewing.features.inputs import dwells_of
from numpy.typing import NDArray

from .errors import BadInput
from .inference import Classifier
from .ladder import CASCADE, STAGES_KEY, shipped_account
from .model_file import read_model
from .rules import counted_pulses

SURE = (0.95, 0.85, 0.85)
"""Least probability of each class (uav, bird, clutter) at which the fast model's answer stands. On records of the whole
envelope the cascade is then as accurate as the better model, finds as many UAVs, names as few others UAV, and asks the
better model about three of five records. With 0.9 for all classes it names a tenth more birds and clutter UAV, since a
false drone of either model counts (the table "cascade" of tests/benchmarks/classification_tables.py)."""


class Cascade(Classifier):
    """A fast model and a better one behind it, asked where the first is not sure; it answers like any classifier.

    Inputs that both models read are computed once. A record of which the fast model is sure costs what the fast model
    costs, so clear returns, most of what a radar near its targets sees, cost a third of the better model's time.

    Where the first model gives a class a probability that reaches `SURE` and the acceptance thresholds of both models,
    its probabilities are the answer; elsewhere the second model's are. Labels go by the second model's thresholds.
    `metadata`, `accept` and the detection of the operating point are the second's; `inputs` are those of both.

    Parameters
    ----------
    first, second
        Sealed bladewing models and what messages call them: the fast one and the better one.
    threads
        CPU threads that one call may use.
    max_false_alarm
        Largest share of birds and clutter that may be named UAV. Each model gets half of it, so that both together keep
        to it, however their errors are correlated.

    Raises
    ------
    BadInput
        As for `Classifier`.
    """

    def __init__(
        self,
        first: tuple[bytes, str],
        second: tuple[bytes, str],
        *,
        threads: int = 1,
        max_false_alarm: float | None = None,
    ) -> None:
        super().__init__(second[0], source=second[1], threads=threads)
        self.first = Classifier(first[0], source=first[1], threads=threads)
        self.inputs = tuple(dict.fromkeys((*self.first.inputs, *self._reads)))
        if max_false_alarm is not None:
            given, own = (model._keep_to(max_false_alarm, CASCADE, models=2) for model in (self.first, self))
            self.operating_point = replace(own, false_alarm=own.false_alarm + given.false_alarm)

    @property
    def name(self) -> str:
        """What the two are called together."""
        return CASCADE

    @classmethod
    def of_shipped(cls, threads: int, *, max_false_alarm: float | None, coverage: float | None) -> "Cascade":
        """Load the two shipped models that `train.json` names.

        Raises
        ------
        BadInput
            They are not shipped, or a coverage is asked for: prediction sets are those of one model.
        """
        if coverage is not None:
            asked = f"a coverage of {coverage:g} and the model {CASCADE!r}"
            raise BadInput(f"{asked}: prediction sets are those of one model: name one")
        account = shipped_account()
        if CASCADE not in account:
            raise BadInput(f"the shipped train.json tells of no {CASCADE!r}: name a model, or train the models again")
        first, second = account[CASCADE][STAGES_KEY]
        return cls(read_model(first), read_model(second), threads=threads, max_false_alarm=max_false_alarm)

    def sure(
        self, probabilities: NDArray[np.float32], pulses: float | NDArray[np.number] | None = None
    ) -> NDArray[np.bool_]:
        """Where the first model's answer stands: a class reaches `SURE` and the acceptance thresholds of both models.

        Parameters
        ----------
        probabilities
            Of the first model, shape (records, 3).
        pulses
            As `decide` takes them.

        Returns
        -------
        ndarray
            Shape (records,).
        """
        limits = np.array(SURE)
        for model in (self.first, self):
            limits = np.maximum(limits, model.accept if pulses is None else model.rules.accept(pulses))
        return np.asarray((probabilities >= limits).any(axis=1))  # above 0.5 it is the likeliest class

    def _judged(self, records: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> list[NDArray[np.float32]]:
        """Answer rows of a bounded number of records, in one or more pieces."""
        out = []
        for dwells in dwells_of(records, carrier_hz=carrier_hz, prf_hz=prf_hz, names=self.inputs):
            told = self.first._answer(dwells.inputs(self.first.inputs))
            rows = np.flatnonzero(~self.sure(told[:, :-1], counted_pulses(records.shape[-1], carrier_hz, prf_hz)))
            if len(rows):
                asked = dwells if len(rows) == len(told) else dwells.rows(rows)
                told[rows] = super()._answer(asked.inputs(self._reads))
            out.append(told)
        return out

    def _answer(self, inputs: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float32]:
        """As `Classifier._answer`: `inputs` are those of both models."""
        told = self.first._answer(inputs)
        rows = np.flatnonzero(~self.sure(told[:, :-1]))
        if len(rows):
            told[rows] = super()._answer({name: inputs[name][rows] for name in self._reads})
        return told
