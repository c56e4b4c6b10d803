"""A trained model at work: IQ in, labels with calibrated probabilities out.

Imports numpy, scipy.fft (through the features) and onnxruntime, nothing else heavy.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NoReturn

import numpy as np
from bladewing.features.allocator import keep_freed
from bladewing.features.clicks import clicks_filled
from bladewing.features.dropouts import BEYOND_FILLING_IN, mended
from bladewing.features.inputs import dwells_of
from bladewing.features.samples import LEAST_PART, largest_part
from bladewing.models import KIND_SCORES
from bladewing.models.calibration import softmax
from bladewing.models.operating import OperatingPoint
from bladewing.models.seal import read_metadata, verify
from numpy.typing import ArrayLike, NDArray

from .envelope import Envelope
from .errors import BadInput
from .labels import CLASSES, UNKNOWN, decide, decide_by_sets
from .ladder import CASCADE
from .model_file import (
    checked_inputs,
    checked_kinds,
    checked_metadata,
    chosen_name,
    open_session,
    place_of_noise,
    point_of_curve,
    prediction_sets,
    read_model,
    rules_by_pulses,
)
from .rules import Limits, Rule, Rules, counted_pulses
from .samples import complex_samples, positive

# One step of the work: bounded in records and in samples, so that memory stays flat however large the batch is.
_STEP_RECORDS = 256
_STEP_SAMPLES = 1 << 21
_STEP_INPUTS = 4096

_COVERAGE_DIGITS = 6

_TOLD = len(CLASSES) + 1  # columns of the answer row of a record: the classes' probabilities and that of noise alone


@dataclass(frozen=True, eq=False)
class Prediction:
    """The answers for a batch of records.

    Attributes
    ----------
    labels
        Shape (...): "uav", "bird", "clutter" or "unknown".
    probabilities
        Shape (..., 3), float32, order ("uav", "bird", "clutter"); 1/3 each where a record could not be judged.
    reasons
        Shape (...): why a label is "unknown" (rule and cure), "" for the others. Read-only outside the envelope, where
        all records share one text.
    noise
        Shape (...), float32: probability that a record holds noise alone, not even a background. It is a part of the
        probability of "clutter"; NaN where a record could not be judged, and from models without kinds. To detect UAVs
        against noise alone, `probabilities[..., 0] / (probabilities[..., 0] + noise)` finds more UAVs than the
        probability of "uav", which every other thing that might be there lowers.
    """

    labels: NDArray[np.str_]
    probabilities: NDArray[np.float32]
    reasons: NDArray[np.str_]
    noise: NDArray[np.float32]


class Classifier:
    """A model ready to answer. Use `Classifier.load`.

    It holds no state between calls: threads may share one.

    Parameters
    ----------
    onnx_bytes
        A sealed bladewing model.
    source
        What error messages call it.
    threads
        CPU threads that one call may use.
    max_false_alarm
        Largest share of birds and clutter that may be named UAV; sets the threshold on "uav", above or below the
        model's own.
    coverage
        Name a record only where its prediction set holds one class alone. For each class, at least this share of its
        records have a set that holds it (on records like those of the calibration). One of the coverages that the model
        stores, 0.9 say. It promises nothing about false alarms: with `max_false_alarm` as well, "uav" is named only
        where that rate allows it too.

    Attributes
    ----------
    classes
        ("uav", "bird", "clutter"), the order of the probabilities.
    metadata
        Metadata of the file: text, JSON where structured (see `bladewing.models.export`).
    envelope
        The radars it answers for.
    accept
        Least probability at which each class is named where there is no number of pulses, as of a track. Without effect
        under a `coverage`, except that of "uav" where `max_false_alarm` set it.
    rules
        The same thresholds for a record, by its number of pulses.
    inputs
        Names of the inputs it reads, keys of `bladewing.features.schema.INPUT_SHAPES`.
    operating_point
        The threshold that `max_false_alarm` chose and the detection probability that remains on the calibration records
        (under a `coverage` at most that); None without `max_false_alarm`.
    coverage
        As it was asked for, or None.

    Raises
    ------
    BadInput
        Not a bladewing model, altered after it was written, or made for other inputs or another version; or its
        calibration records do not support the false-alarm rate, or it stores no prediction sets of that coverage. Or
        `threads` is no whole number of 1 or more, or `max_false_alarm` or `coverage` no number above 0.
    """

    classes: tuple[str, str, str] = CLASSES
    metadata: Mapping[str, str]
    envelope: Envelope
    accept: Limits
    rules: Rules
    inputs: tuple[str, ...]
    operating_point: OperatingPoint | None
    coverage: float | None

    def __init__(
        self,
        onnx_bytes: bytes,
        *,
        source: str = "model",
        threads: int = 1,
        max_false_alarm: float | None = None,
        coverage: float | None = None,
    ) -> None:
        if isinstance(threads, bool) or not isinstance(threads, int | np.integer) or threads < 1:
            raise BadInput(f"threads is {threads!r}: it must be a whole number of 1 or more")
        threads = int(threads)
        max_false_alarm, coverage = _rule(max_false_alarm, coverage)
        try:
            verify(onnx_bytes)  # the file is verified, and its metadata are read, before any runtime opens it
            self.metadata = MappingProxyType(read_metadata(onnx_bytes))
        except ValueError as error:
            raise BadInput(f"{source}: {error}") from None
        self.envelope, self.accept = checked_metadata(self.metadata, source)
        self._session = open_session(onnx_bytes, source, threads)
        keep_freed()
        if dict(self._session.get_modelmeta().custom_metadata_map) != dict(self.metadata):
            raise BadInput(f"{source}: damaged metadata: onnxruntime reads others: train it again")
        self.inputs = self._reads = checked_inputs(self._session, source)
        kinds = checked_kinds(self.metadata, self._session, source)
        self._outputs = ["probabilities", *([KIND_SCORES] if kinds else [])]
        self._noise = place_of_noise(kinds)
        self.operating_point = None
        self.coverage = coverage
        sets = {} if coverage is None else {coverage: prediction_sets(self.metadata, coverage, source)}
        self._of_all = Rule(1, self.accept, sets)
        self.rules = rules_by_pulses(self.metadata, self._of_all, source)
        if max_false_alarm is not None:
            self._keep_to(max_false_alarm, source)

    @classmethod
    def load(
        cls,
        name_or_path: str | os.PathLike[str] | None = None,
        threads: int = 1,
        *,
        budget_us: float | None = None,
        max_false_alarm: float | None = None,
        coverage: float | None = None,
    ) -> "Classifier":
        """Load a shipped model by its name, or any bladewing model by its path.

        Parameters
        ----------
        name_or_path
            One of `model_names()`; "cascade" (see `Cascade`); "fast", "balanced" or "best" (see `ladder`); or a
            file. By default the shipped default model.
        threads
            CPU threads that one call may use.
        budget_us
            Instead of a name: the most accurate shipped model that takes at most this for a record of 2048 pulses in
            batches of 64 on one thread of this machine [us].
        max_false_alarm, coverage
            See `Classifier`.

        Raises
        ------
        BadInput
            There is no such model, or it is not one that can be used (see `Classifier`).
        """
        from .cascade import Cascade  # here, because it is made of classifiers

        max_false_alarm, coverage = _rule(max_false_alarm, coverage)
        name = chosen_name(name_or_path, budget_us)
        if name == CASCADE:
            try:
                return Cascade.of_shipped(threads, max_false_alarm=max_false_alarm, coverage=coverage)
            except BadInput:
                if budget_us is None:
                    raise
            # a budget alone never leads to a refusal as long as another model within the budget can answer
            name = chosen_name(budget_us=budget_us, single=True)
        content, source = read_model(name)
        return cls(content, source=source, threads=threads, max_false_alarm=max_false_alarm, coverage=coverage)

    def __reduce__(self) -> NoReturn:
        raise TypeError("a classifier is neither pickled nor copied deeply: load it in each process, Classifier.load()")

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name or 'without a name'}>"

    @property
    def name(self) -> str:
        """Name of the model on the ladder; empty where its file does not say."""
        return self.metadata.get("name", "")

    def _keep_to(self, max_false_alarm: float, source: str, models: int = 1) -> OperatingPoint:
        """Choose the threshold on "uav" for a false-alarm rate that `models` models share."""
        self.operating_point = point = point_of_curve(self.metadata, max_false_alarm, source, models)
        self._of_all = self._of_all.naming_uav_from(point.threshold)
        self.accept = self._of_all.accept
        self.rules = self.rules.naming_uav_from(point.threshold)
        return point

    def decide(
        self, probabilities: NDArray[np.floating], pulses: float | NDArray[np.number] | None = None
    ) -> tuple[NDArray[np.str_], list[str]]:
        """Name a class or say "unknown", and why, by the rule that this classifier was loaded with.

        Parameters
        ----------
        probabilities
            Shape (records, 3), as `predict` gives them.
        pulses
            Number of pulses of all records, or of each, shape (records,), that count (`rules.counted_pulses`); None
            where there is none, as of a track.
        """
        limits: Limits | NDArray[np.float64]
        if pulses is None or np.ndim(pulses) == 0:
            rule = self._of_all if pulses is None else self.rules.of(pulses)
            limits = rule.accept if self.coverage is None else rule.sets[self.coverage]
        else:
            limits = self.rules.accept(pulses) if self.coverage is None else self.rules.sets(pulses, self.coverage)
        if self.coverage is not None:
            least_uav = self.operating_point.threshold if self.operating_point else None
            return decide_by_sets(probabilities, limits, self.coverage, least_uav)
        return decide(probabilities, limits)

    def predict(self, iq: ArrayLike, *, carrier_hz: float, prf_hz: float) -> Prediction:
        """Tell UAV, bird and clutter apart.

        Parameters
        ----------
        iq
            Shape (..., pulses), complex: one range cell, one sample a pulse. Leading axes are a batch, and every record
            is answered as if it were alone. The gain does not matter. Pulses that were lost, which are exactly 0, are
            filled in from those beside them, and so are single pulses that interference raised far above all others.
            Where too many pulses in a row are lost for that, the longest unbroken stretch is judged. Lost pulses that a
            receiver marks by another value, or by repeating the pulse before, are found by a `Recording` alone. One
            channel, I without Q, is made analytic.
        carrier_hz
            Carrier [Hz].
        prf_hz
            Pulse repetition frequency [Hz].

        Returns
        -------
        Prediction
            With the leading axes of `iq`. Records outside the envelope and records without signal are "unknown",
            with the reason.

        Raises
        ------
        BadInput
            The samples are not complex or not finite, there is no sample, or a frequency is not above 0.

        Examples
        --------
        >>> import numpy as np
        >>> from bladewing.classify import Classifier
        >>> answer = Classifier.load().predict(np.ones(100, dtype=complex), carrier_hz=10e9, prf_hz=500.0)
        >>> print(answer.labels, answer.reasons)
        unknown PRF 500 Hz is below 1000 Hz: raise the PRF to 1335 Hz or more
        """
        samples = complex_samples(iq, "iq")
        carrier_hz, prf_hz = positive(carrier_hz, "carrier_hz"), positive(prf_hz, "prf_hz")
        if samples.ndim == 0 or samples.shape[-1] == 0:
            raise BadInput(f"iq has shape {samples.shape}: it must be (..., pulses) with one pulse or more")
        *leading, pulses = samples.shape
        records = samples.reshape(-1, pulses)
        if outside := self.envelope.reason(carrier_hz, prf_hz, pulses):  # before any work on the records
            told, labels = _untold(len(records))
            reasons = np.broadcast_to(np.array(outside), len(records))
        else:
            records, stretches = mended(records)
            if stretches:
                told, labels, reasons = self._of_stretches(records, stretches, carrier_hz, prf_hz)
            else:
                told, labels, reasons = self._answers(records, carrier_hz, prf_hz)
        return Prediction(
            labels.reshape(leading),
            np.ascontiguousarray(told[:, :-1]).reshape(*leading, len(CLASSES)),
            reasons.reshape(leading),
            told[:, -1].reshape(leading),
        )

    def _answers(
        self, records: NDArray[np.complex64], carrier_hz: float, prf_hz: float
    ) -> tuple[NDArray[np.float32], NDArray[np.str_], NDArray[np.str_]]:
        """Answer rows (see `_TOLD`), labels and reasons of (records, pulses) inside the envelope."""
        largest = largest_part(records)
        records = clicks_filled(records, largest)
        live = largest >= LEAST_PART
        pulses = counted_pulses(records.shape[-1], carrier_hz, prf_hz)
        if np.count_nonzero(live) == live.size:
            told = self._told(records, None, carrier_hz, prf_hz)
            labels, why = self.decide(told[:, :-1], pulses)
            return told, labels, np.array(why, dtype=np.str_)
        told, labels = _untold(len(records))
        reasons = np.full(len(records), "no signal: every sample is 0", dtype=object)
        reasons[largest > 0] = "no signal: samples this small have no digits left in float32: raise the gain"
        rows = np.flatnonzero(live)
        told[rows] = self._told(records, rows, carrier_hz, prf_hz)
        labels[rows], reasons[rows] = self.decide(told[rows, :-1], pulses)
        return told, labels, reasons.astype(np.str_)

    def _of_stretches(
        self,
        records: NDArray[np.complex64],
        stretches: Mapping[tuple[int, ...], slice],
        carrier_hz: float,
        prf_hz: float,
    ) -> tuple[NDArray[np.float32], NDArray[np.str_], NDArray[np.str_]]:
        """As `_answers`, for records of which silences break some: of each its longest unbroken stretch is judged."""
        told, labels = _untold(len(records))
        reasons = np.empty(len(records), dtype=object)
        ends = np.full((len(records), 2), (0, records.shape[-1]))
        for (row,), stretch in stretches.items():
            ends[row] = stretch.start, stretch.stop
        for begin, end in np.unique(ends, axis=0):  # records with the same padding go together
            rows, pulses = np.flatnonzero((ends == (begin, end)).all(axis=1)), end - begin
            if not pulses:
                reasons[rows] = BEYOND_FILLING_IN
            elif outside := self.envelope.reason(carrier_hz, prf_hz, pulses):
                reasons[rows] = f"silence: no more than {pulses} pulses in a row are not 0: {outside}"
            else:
                told[rows], labels[rows], reasons[rows] = self._answers(records[rows, begin:end], carrier_hz, prf_hz)
        return told, labels, reasons.astype(np.str_)

    def _told(
        self, records: NDArray[np.complex64], rows: NDArray[np.intp] | None, carrier_hz: float, prf_hz: float
    ) -> NDArray[np.float32]:
        """Run the chosen rows of (records, pulses), or all, through the model, a bounded number at a time."""
        count = len(records) if rows is None else len(rows)
        step = max(1, min(_STEP_RECORDS, _STEP_SAMPLES // records.shape[-1]))
        out = [np.empty((0, _TOLD), np.float32)]
        for start in range(0, count, step):
            part = slice(start, start + step)
            chunk = records[part if rows is None else rows[part]]
            out += self._judged(chunk, carrier_hz, prf_hz)
        return out[-1] if len(out) <= 2 else np.concatenate(out)

    def _judged(self, records: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> list[NDArray[np.float32]]:
        """Answer rows of a bounded number of records, in one or more pieces."""
        each = dwells_of(records, carrier_hz=carrier_hz, prf_hz=prf_hz, names=self.inputs)
        return [self._answer(dwells.inputs(self.inputs)) for dwells in each]

    def from_inputs(self, inputs: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float32]:
        """Probabilities of records whose inputs are computed already; inputs that the model does not read are ignored.

        Parameters
        ----------
        inputs
            Name to array (records, *shape), as `bladewing.features.model_inputs` gives them, of any precision and any
            number of records: a bounded number is cast and run at a time.

        Returns
        -------
        ndarray
            Shape (records, 3), order `classes`.
        """
        return np.ascontiguousarray(self._answer(inputs)[:, :-1])

    def kind_shares(self, inputs: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float32]:
        """Probabilities of the kinds that a network tells apart inside, uncalibrated, shape (records, kinds).

        The argument is that of `from_inputs`; the kinds are those of the metadata.
        """
        return np.concatenate([softmax(scores).astype(np.float32) for _, scores in self._run(inputs)])

    def _answer(self, inputs: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float32]:
        """Answer rows (see `_TOLD`) of records whose inputs are computed already."""
        parts = []
        for probabilities, *others in self._run(inputs):
            told = np.full((len(probabilities), _TOLD), np.nan, np.float32)
            told[:, :-1] = probabilities
            if self._noise:
                label, kin, own = self._noise
                scores = others[0][:, kin]
                told[:, -1] = probabilities[:, label] * np.exp(scores[:, own] - np.logaddexp.reduce(scores, axis=-1))
            parts.append(told)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _run(self, inputs: Mapping[str, NDArray[np.floating]]) -> Iterator[list[NDArray[np.float32]]]:
        """Run the model, a bounded number of records at a time."""
        count = len(inputs[self._reads[0]])
        for at in range(0, max(count, 1), _STEP_INPUTS):
            part = {name: inputs[name][at : at + _STEP_INPUTS].astype(np.float32, copy=False) for name in self._reads}
            yield self._session.run(self._outputs, part)


def _untold(records: int) -> tuple[NDArray[np.float32], NDArray[np.str_]]:
    """Answer rows (see `_TOLD`) and labels of records that cannot be judged: 1/3 each, NaN for noise, "unknown"."""
    told = np.full((records, _TOLD), 1 / len(CLASSES), dtype=np.float32)
    told[:, -1] = np.nan
    return told, np.full(records, UNKNOWN, dtype="<U7")


def _rule(max_false_alarm: object, coverage: object) -> tuple[float | None, float | None]:
    """Check the two numbers that may set when "unknown" is said."""
    rate = None if max_false_alarm is None else positive(max_false_alarm, "max_false_alarm")
    # rounded as models store it: a 0.9 given as float32 means 0.9
    return rate, None if coverage is None else round(positive(coverage, "coverage"), _COVERAGE_DIGITS)
