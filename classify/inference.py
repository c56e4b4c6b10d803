"""A trained model at work: IQ in, labels with calibrated probabilities out.

Imports numpy, scipy.fft (through the features) and onnxruntime, nothing else heavy.
"""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import MappingProxyType

import numpy as np
import onnxruntime
from bladewing.features.allocator import keep_freed
from bladewing.features.inputs import model_inputs
from bladewing.features.schema import INPUT_SHAPES, schema_hash
from bladewing.features.spectrum import LEAST_PART, largest_part
from bladewing.models import DEFAULT_MODEL, KIND_SCORES
from bladewing.models.calibration import softmax
from bladewing.models.operating import OperatingCurve, OperatingPoint
from bladewing.models.seal import read_metadata, verify
from numpy.typing import ArrayLike, NDArray

from .bounds import MOST_MODEL_BYTES
from .envelope import Envelope
from .errors import BadInput
from .files import read_bounded
from .labels import CLASSES, UNKNOWN, decide, decide_by_sets
from .ladder import CASCADE, PLACES, by_budget, by_place, measured_fft_us, shipped_account
from .samples import complex_samples, positive

__all__ = ["Classifier", "Envelope", "Prediction", "model_names"]

CURVE_KEY = "operating_curve"
"""Metadata of the thresholds for every false-alarm rate; models of earlier versions hold none."""

SETS_KEY = "prediction_sets"
"""Metadata of the thresholds of prediction sets, rows of coverage and one a class; earlier models hold none."""

COVERAGES = (0.8, 0.9, 0.95, 0.98, 0.99)
"""Coverages that a training stores."""

FORMAT = "1"
"""Version of the metadata that this code reads."""

# One step of the work: bounded in records and in samples, so that memory stays flat however large the batch is.
_STEP_RECORDS = 256
_STEP_SAMPLES = 1 << 21
_STEP_INPUTS = 4096

#: What the metadata of an exported graph call it.
EXPORTED = "bladewing raw-IQ graph"

KINDS_KEY = "kinds"
"""Metadata of the kinds that a network tells apart inside, name to class in their order; some models know none."""

NOISE = "noise"
"""The kind of a record that holds nothing else."""

_TOLD = len(CLASSES) + 1  # columns of what is told of a record: the classes' probabilities and that of mere noise


@dataclass(frozen=True)
class Prediction:
    """The answers for a batch of records.

    Attributes
    ----------
    labels
        Shape (...): "uav", "bird", "clutter" or "unknown".
    probabilities
        Shape (..., 3), float32, order ("uav", "bird", "clutter"); 1/3 each where a record could not be judged.
    reasons
        Shape (...): why a label is "unknown" (rule and cure), "" for the others.
    noise
        Shape (...), float32: probability that there is nothing but noise, a part of that of "clutter"; NaN where a
        record could not be judged, and from models without kinds. Against noise alone the share of "uav" in "uav" and
        this, `probabilities[..., 0] / (probabilities[..., 0] + noise)`, finds more UAVs than the probability of "uav",
        which every other thing that might be there lowers.
    """

    labels: NDArray[np.str_]
    probabilities: NDArray[np.float32]
    reasons: NDArray[np.str_]
    noise: NDArray[np.float32]


def model_names() -> tuple[str, ...]:
    """Names of the shipped models, the default first."""
    folder = resources.files("bladewing.models.pretrained")
    names = {entry.name.removesuffix(".onnx") for entry in folder.iterdir() if entry.name.endswith(".onnx")}
    return tuple(sorted(names, key=lambda name: (name != DEFAULT_MODEL, name)))


def chosen_name(
    name_or_path: str | os.PathLike[str] | None = None, budget_us: float | None = None, *, single: bool = False
) -> str:
    """Name or path of the model that is meant: the default's, or what a place on the ladder or a budget leads to.

    Parameters
    ----------
    name_or_path, budget_us
        As `Classifier.load` takes them.
    single
        Whether only models of one file are meant, not the cascade of two.

    Raises
    ------
    BadInput
        Both are given, or no model keeps to the budget.
    """
    given = DEFAULT_MODEL if name_or_path is None else os.fspath(name_or_path)
    if budget_us is None and given not in PLACES:
        return given
    account = shipped_account()
    if single:
        account.pop(CASCADE, None)
    if budget_us is None:
        return by_place(given, account)
    if name_or_path is not None:
        raise BadInput(f"model {given!r} and a budget of {budget_us:g} us: give one of them")
    return by_budget(positive(budget_us, "budget_us"), account, measured_fft_us())


def read_model(given: str) -> tuple[bytes, str]:
    """Read a shipped model by its name, or a file: the content, and what messages call it.

    Raises
    ------
    BadInput
        There is no such model, or it cannot be read.
    """
    if given in model_names():
        return resources.files("bladewing.models.pretrained").joinpath(f"{given}.onnx").read_bytes(), given
    if not given:
        raise BadInput(f"the model's name is empty: give one of the shipped, {', '.join(model_names())}, or a file")
    path = Path(given)
    if path.is_dir():
        raise BadInput(f"{given} is a directory: name the .onnx file in it")
    try:
        return read_bounded(path, MOST_MODEL_BYTES), given
    except (FileNotFoundError, NotADirectoryError):
        shipped = ", ".join(model_names()) or "none"
        raise BadInput(
            f"no model {given!r}: give the path of an .onnx file or one of the shipped: {shipped}; "
            f"or {', '.join((CASCADE, *PLACES))}"
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name, no file, too large
        raise BadInput(f"{given}: the model cannot be read: {getattr(error, 'strerror', None) or error}") from None


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
        Instead of that: name a record only where its prediction set holds one class alone. For each class, at least
        this share of its records have a set that holds it (on records like those of the calibration). One of the
        coverages that the model stores, 0.9 say.

    Attributes
    ----------
    classes
        ("uav", "bird", "clutter"), the order of the probabilities.
    metadata
        What the file says of itself: text, JSON where structured (see `bladewing.models.export`).
    envelope
        The radars it answers for.
    accept
        Least probability at which each class is named; without effect under a `coverage`.
    inputs
        Names of the inputs it reads, keys of `bladewing.features.schema.INPUT_SHAPES`.
    operating_point
        The threshold that `max_false_alarm` chose and the detection probability that remains, of its calibration
        records; None without one.
    coverage
        As it was asked for, or None.

    Raises
    ------
    BadInput
        Not a bladewing model, altered after it was written, or made for other inputs or another version; or its
        calibration records do not support the false-alarm rate, or it stores no prediction sets of that coverage.
    """

    classes: tuple[str, str, str] = CLASSES
    metadata: Mapping[str, str]
    envelope: Envelope
    accept: tuple[float, float, float]
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
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
            raise BadInput(f"threads is {threads!r}: it must be a whole number of 1 or more")
        max_false_alarm, coverage = _rule(max_false_alarm, coverage)
        try:
            verify(onnx_bytes)  # before anything of the file is opened, and so is what it says of itself
            self.metadata = MappingProxyType(read_metadata(onnx_bytes))
        except ValueError as error:
            raise BadInput(f"{source}: {error}") from None
        self.envelope, self.accept = _read_metadata(self.metadata, source)
        self._session = _open_session(onnx_bytes, source, threads)
        keep_freed()
        if dict(self._session.get_modelmeta().custom_metadata_map) != dict(self.metadata):
            raise BadInput(f"{source}: damaged metadata: onnxruntime reads others: train it again")
        self.inputs = self._reads = _read_inputs(self._session, source)
        kinds = _read_kinds(self.metadata, self._session, source)
        self._outputs = ["probabilities", *([KIND_SCORES] if kinds else [])]
        self._noise = _place_of_noise(kinds)
        self.operating_point = None
        if max_false_alarm is not None:
            self._keep_to(max_false_alarm, source)
        self.coverage = coverage
        if coverage is not None:
            self._sets_hold = _prediction_sets(self.metadata, coverage, source)

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
            One of `model_names()`; "cascade" (see `cascade`); "fast", "balanced" or "best" (see `ladder`); or a
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
        max_false_alarm, coverage = _rule(max_false_alarm, coverage)
        name = chosen_name(name_or_path, budget_us)
        if name == CASCADE:
            from .cascade import Cascade

            try:
                return Cascade.of_shipped(threads, max_false_alarm=max_false_alarm, coverage=coverage)
            except BadInput:
                if budget_us is None:
                    raise
            # a budget alone never leads to a refusal that another model within it would not give
            name = chosen_name(budget_us=budget_us, single=True)
        content, source = read_model(name)
        return cls(content, source=source, threads=threads, max_false_alarm=max_false_alarm, coverage=coverage)

    @property
    def name(self) -> str:
        """Of the model, as it stands on the ladder; empty where its file does not say."""
        return self.metadata.get("name", "")

    def _keep_to(self, max_false_alarm: float, source: str, models: int = 1) -> OperatingPoint:
        """Choose the threshold on "uav" for a false-alarm rate that so many models share."""
        self.operating_point = point = _operating_point(self.metadata, max_false_alarm, source, models)
        self.accept = (point.threshold, *self.accept[1:])
        return point

    def decide(self, probabilities: NDArray[np.floating]) -> tuple[NDArray[np.str_], list[str]]:
        """Name a class or say "unknown", and why, by the rule that this classifier was loaded with.

        Parameters
        ----------
        probabilities
            Shape (records, 3), as `predict` gives them.
        """
        if self.coverage is not None:
            return decide_by_sets(probabilities, self._sets_hold, self.coverage)
        return decide(probabilities, self.accept)

    def predict(self, iq: ArrayLike, *, carrier_hz: float, prf_hz: float) -> Prediction:
        """Tell UAV, bird and clutter apart.

        Parameters
        ----------
        iq
            Shape (..., pulses), complex: one range cell, one sample a pulse. Leading axes are a batch, and every
            record is answered as if it were alone. The gain does not matter.
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
        told, labels, reasons = self._answers(samples.reshape(-1, pulses), carrier_hz, prf_hz)
        return Prediction(
            labels.reshape(leading),
            np.ascontiguousarray(told[:, :-1]).reshape(*leading, len(CLASSES)),
            reasons.reshape(leading),
            told[:, -1].reshape(leading),
        )

    def _answers(
        self, records: NDArray[np.complex64], carrier_hz: float, prf_hz: float
    ) -> tuple[NDArray[np.float32], NDArray[np.str_], NDArray[np.str_]]:
        """What is told (see `_TOLD`), labels and reasons of (records, pulses)."""
        outside = self.envelope.reason(carrier_hz, prf_hz, records.shape[-1])
        largest = largest_part(records)
        live = largest >= LEAST_PART
        if outside is None and live.all():
            told = self._told(records, None, carrier_hz, prf_hz)
            labels, why = self.decide(told[:, :-1])
            return told, labels, np.array(why, dtype=np.str_)
        told = np.full((len(records), _TOLD), 1 / len(CLASSES), dtype=np.float32)
        told[:, -1] = np.nan
        labels = np.full(len(records), UNKNOWN, dtype="<U7")
        if outside is not None:
            return told, labels, np.full(len(records), outside)
        reasons = np.full(len(records), "no signal: every sample is 0", dtype=object)
        reasons[largest > 0] = "no signal: samples this small have no digits left in float32: raise the gain"
        rows = np.flatnonzero(live)
        told[rows] = self._told(records, rows, carrier_hz, prf_hz)
        labels[rows], reasons[rows] = self.decide(told[rows, :-1])
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
        """What is told of a bounded number of records, in one or more pieces."""
        return [self._answer(model_inputs(records, carrier_hz=carrier_hz, prf_hz=prf_hz, names=self.inputs))]

    def from_inputs(self, inputs: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float32]:
        """Probabilities of records whose inputs are made; others than the model's are passed over.

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
        """What is told of records whose inputs are made."""
        parts = []
        for probabilities, *others in self._run(inputs):
            told = np.full((len(probabilities), _TOLD), np.nan, np.float32)
            told[:, :-1] = probabilities
            if self._noise:
                label, kin, own = self._noise
                told[:, -1] = probabilities[:, label] * softmax(others[0][:, kin])[:, own]
            parts.append(told)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _run(self, inputs: Mapping[str, NDArray[np.floating]]) -> Iterator[list[NDArray[np.float32]]]:
        """Run the model, a bounded number of records at a time."""
        count = len(inputs[self._reads[0]])
        for at in range(0, max(count, 1), _STEP_INPUTS):
            part = {name: inputs[name][at : at + _STEP_INPUTS].astype(np.float32, copy=False) for name in self._reads}
            yield self._session.run(self._outputs, part)


def _rule(max_false_alarm: object, coverage: object) -> tuple[float | None, float | None]:
    """Check the two numbers by which "unknown" may be ruled, of which one at most is given."""
    rate = None if max_false_alarm is None else positive(max_false_alarm, "max_false_alarm")
    share = None if coverage is None else positive(coverage, "coverage")
    if rate is not None and share is not None:
        raise BadInput(f"a false-alarm rate of {rate:g} and a coverage of {share:g}: give one of them")
    return rate, share


def _open_session(onnx_bytes: bytes, source: str, threads: int) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # its messages come as exceptions; nothing else may reach the user's terminal
    try:
        return onnxruntime.InferenceSession(
            onnx_bytes,
            options,
            providers=["CPUExecutionProvider"],
            enable_fallback=0,  # which would print, and try the same again
        )
    except Exception as error:  # its exceptions share no base class
        raise BadInput(f"{source}: onnxruntime {onnxruntime.__version__} cannot open the model: {error}") from None


def _read_metadata(metadata: Mapping[str, str], source: str) -> tuple[Envelope, tuple[float, float, float]]:
    """Check what a model says of itself against what this version can serve."""
    product = metadata.get("product")
    if product != "bladewing":
        exported = "an exported graph, for onnxruntime alone: give the model that it was made of"
        what = exported if product == EXPORTED else f"its product is {product!r}"
        raise BadInput(f"{source}: not a bladewing model: {what}")
    if metadata.get("format") != FORMAT:
        raise BadInput(
            f"{source}: model format {metadata.get('format')!r}, this version reads {FORMAT!r}: train it again"
        )
    if metadata.get("schema_sha256") != schema_hash():
        raise BadInput(
            f"{source}: trained on other measurements than this version makes (schema "
            f"{metadata.get('schema_sha256', 'missing')[:12]}, here {schema_hash()[:12]}): train it again"
        )
    try:
        classes, accept = json.loads(metadata["classes"]), json.loads(metadata["accept"])
        envelope = Envelope.from_json(metadata["envelope"])
        if tuple(classes) != CLASSES:
            raise ValueError(f"classes are {classes}, they must be {list(CLASSES)}")
        uav, bird, clutter = (float(limit) for limit in accept)
        if not all(np.isfinite((uav, bird, clutter))):
            raise ValueError(f"accept is {accept}, it must be three finite numbers")
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise BadInput(f"{source}: damaged metadata: {error}: train it again") from None
    return envelope, (uav, bird, clutter)


def _operating_point(metadata: Mapping[str, str], max_false_alarm: float, source: str, models: int) -> OperatingPoint:
    """The point of the model's curve that keeps to its part of a false-alarm rate."""
    if CURVE_KEY not in metadata:
        raise BadInput(f"{source}: holds no operating curve, so no false-alarm rate can be chosen: train it again")
    try:
        return OperatingCurve.from_json(metadata[CURVE_KEY]).at(max_false_alarm, models)
    except ValueError as error:
        raise BadInput(f"{source}: {error}") from None


def _prediction_sets(metadata: Mapping[str, str], coverage: float, source: str) -> tuple[float, ...]:
    """The thresholds of the model's prediction sets of one coverage."""
    if SETS_KEY not in metadata:
        raise BadInput(f"{source}: holds no prediction sets, so no coverage can be chosen: train it again")
    try:
        rows = {float(row[0]): tuple(map(float, row[1:])) for row in json.loads(metadata[SETS_KEY])}
        if any(len(limits) != len(CLASSES) or not np.isfinite(limits).all() for limits in rows.values()):
            raise ValueError(f"there must be {len(CLASSES)} finite thresholds a coverage")
    except (TypeError, KeyError, IndexError, ValueError, OverflowError, RecursionError) as error:
        raise BadInput(f"{source}: damaged prediction sets: {error}: train it again") from None
    if coverage not in rows:
        held = ", ".join(f"{value:g}" for value in rows) or "none"
        raise BadInput(f"{source}: a coverage of {coverage:g} is not among those that it holds: {held}: ask for one")
    return rows[coverage]


def _read_inputs(session: onnxruntime.InferenceSession, source: str) -> tuple[str, ...]:
    """Names of the graph's inputs, checked against what the features give."""
    for node in session.get_inputs():
        if INPUT_SHAPES.get(node.name) != tuple(node.shape[1:]):
            raise BadInput(
                f"{source}: input {node.name!r} of shape {tuple(node.shape)}: this version gives "
                f"{ {name: ('records', *shape) for name, shape in INPUT_SHAPES.items()} }: train it again"
            )
    if not session.get_inputs():
        raise BadInput(f"{source}: no input: not a complete bladewing model, train it again")
    if "probabilities" not in [node.name for node in session.get_outputs()]:
        raise BadInput(f"{source}: no output 'probabilities': not a complete bladewing model, train it again")
    return tuple(node.name for node in session.get_inputs())


def _read_kinds(metadata: Mapping[str, str], session: onnxruntime.InferenceSession, source: str) -> Mapping[str, str]:
    """The kinds that a model tells apart inside, name to class; none where it knows none."""
    try:
        kinds = json.loads(metadata.get(KINDS_KEY, "{}"))
        if not isinstance(kinds, dict) or list(kinds.values()) != sorted(kinds.values(), key=CLASSES.index):
            raise ValueError(f"each kind must be of a class, in the order {', '.join(CLASSES)}")
    except (TypeError, ValueError, RecursionError) as error:
        raise BadInput(f"{source}: damaged kinds: {error}: train it again") from None
    widths = {node.name: node.shape[1:] for node in session.get_outputs()}
    if kinds and widths.get(KIND_SCORES) != [len(kinds)]:
        raise BadInput(f"{source}: no output {KIND_SCORES!r} of its {len(kinds)} kinds: train it again")
    return kinds


def _place_of_noise(kinds: Mapping[str, str]) -> tuple[int, slice, int] | None:
    """The class that noise is of, the columns of that class's kinds, which stand together, and its place among them."""
    if NOISE not in kinds:
        return None
    names, classes = list(kinds), list(kinds.values())
    first = classes.index(kinds[NOISE])
    kin = slice(first, first + classes.count(kinds[NOISE]))
    return CLASSES.index(kinds[NOISE]), kin, names.index(NOISE) - first
