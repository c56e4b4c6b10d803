"""A model's file: which one is meant, and checks of its metadata and graph before the model is used."""

import json
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from bladewing.features.schema import INPUT_SHAPES, schema_hash
from bladewing.models import DEFAULT_MODEL, KIND_SCORES
from bladewing.models.operating import OperatingCurve, OperatingPoint
from bladewing.models.runtime import onnxruntime
from bladewing.models.session import quiet_session

from .envelope import Envelope
from .errors import BadInput
from .files import read_bounded
from .labels import CLASSES
from .ladder import CASCADE, PLACES, SHIPPED, by_budget, by_place, measured_fft_us, shipped_account
from .limits import MOST_MODEL_BYTES
from .rules import Limits, Rule, Rules
from .samples import positive

CURVE_KEY = "operating_curve"
"""Metadata of the thresholds for every false-alarm rate; models of earlier versions hold none."""

SETS_KEY = "prediction_sets"
"""Metadata of prediction sets: rows of a coverage and the threshold of each class; earlier models hold none."""

RULES_KEY = "rules_by_pulses"
"""Metadata of acceptance thresholds and prediction sets by the pulses of a record (see `rules`); earlier models hold
none."""

COVERAGES = (0.8, 0.9, 0.95, 0.98, 0.99)
"""Coverages that a training stores."""

FORMAT = "1"
"""Version of the metadata that this code reads."""

#: The product that the metadata of an exported graph name.
EXPORTED = "bladewing raw-IQ graph"

KINDS_KEY = "kinds"
"""Metadata of the kinds that a network tells apart inside, name to class in their order; some models know none."""

NOISE = "noise"
"""The kind of a record that holds noise alone."""


def model_names() -> tuple[str, ...]:
    """Names of the shipped models, the default first."""
    names = {entry.name.removesuffix(".onnx") for entry in SHIPPED.iterdir() if entry.name.endswith(".onnx")}
    return tuple(sorted(names, key=lambda name: (name != DEFAULT_MODEL, name)))


def chosen_name(
    name_or_path: str | os.PathLike[str] | None = None, budget_us: float | None = None, *, single: bool = False
) -> str:
    """Name or path of the model that is meant: as given, the default's, or that of a place on the ladder or a budget.

    Parameters
    ----------
    name_or_path, budget_us
        As `Classifier.load` takes them.
    single
        Whether only models of one file are meant, not the cascade of two.

    Raises
    ------
    BadInput
        Both are given, it is no name and no path, or no model keeps to the budget.
    """
    if not isinstance(name_or_path, str | os.PathLike | None):
        raise BadInput(f"the model is {name_or_path!r}: give a name or the path of an .onnx file")
    given = DEFAULT_MODEL if name_or_path is None else os.fspath(name_or_path)
    if budget_us is None and given not in PLACES:
        return given
    account = shipped_account()
    if budget_us is None:
        return by_place(given, account)
    if name_or_path is not None:
        raise BadInput(f"model {given!r} and a budget of {budget_us:g} us: give one of them")
    if single:
        account.pop(CASCADE, None)
    return by_budget(positive(budget_us, "budget_us"), account, measured_fft_us())


def read_model(given: str) -> tuple[bytes, str]:
    """Read a shipped model by its name, or a file: the content, and what messages call it.

    Raises
    ------
    BadInput
        There is no such model, or it cannot be read.
    """
    if given in model_names():
        return SHIPPED.joinpath(f"{given}.onnx").read_bytes(), given
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
        said = getattr(error, "strerror", None) or error
        raise BadInput(f"{given}: the model cannot be read: {said}: name another, or make it readable") from None


def open_session(onnx_bytes: bytes, source: str, threads: int) -> onnxruntime.InferenceSession:
    """A session of a model that may be trusted.

    Raises
    ------
    BadInput
        It cannot be opened.
    """
    try:
        return quiet_session(onnx_bytes, threads)
    except Exception as error:  # its exceptions share no base class
        raise BadInput(f"{source}: onnxruntime {onnxruntime.__version__} cannot open the model: {error}") from None


def checked_metadata(metadata: Mapping[str, str], source: str) -> tuple[Envelope, Limits]:
    """Check a model's metadata against what this version can serve; return its envelope and acceptance thresholds.

    Raises
    ------
    BadInput
        It is no bladewing model, of another format or schema, or its metadata are damaged.
    """
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


def point_of_curve(metadata: Mapping[str, str], max_false_alarm: float, source: str, models: int) -> OperatingPoint:
    """The point of the model's curve that keeps to its share of a false-alarm rate, which `models` models share evenly.

    Raises
    ------
    BadInput
        It holds no curve or a damaged one, or its calibration records do not support the rate.
    """
    if CURVE_KEY not in metadata:
        raise BadInput(f"{source}: holds no operating curve, so no false-alarm rate can be chosen: train it again")
    try:
        return OperatingCurve.from_json(metadata[CURVE_KEY]).at(max_false_alarm, models)
    except ValueError as error:
        raise BadInput(f"{source}: {error}") from None


def rules_by_pulses(metadata: Mapping[str, str], of_all: Rule, source: str) -> Rules:
    """The model's rules by a record's number of pulses; where it holds none, the rule of all records.

    Raises
    ------
    BadInput
        It holds damaged ones, or none of the coverages that are wanted.
    """
    if RULES_KEY not in metadata:
        return Rules((of_all,))
    try:
        rules = Rules.from_json(metadata[RULES_KEY])
        if missing := of_all.sets.keys() - rules.each[0].sets.keys():
            raise ValueError(f"the rules by pulses hold no sets of the coverage {min(missing):g}")
    except ValueError as error:
        raise BadInput(f"{source}: damaged metadata: {error}: train it again") from None
    return rules


def prediction_sets(metadata: Mapping[str, str], coverage: float, source: str) -> Limits:
    """The thresholds of the model's prediction sets of one coverage, of all records.

    Raises
    ------
    BadInput
        It holds no sets, damaged ones, or none of that coverage.
    """
    if SETS_KEY not in metadata:
        raise BadInput(f"{source}: holds no prediction sets, so no coverage can be chosen: train it again")
    try:
        held = json.loads(metadata[SETS_KEY])
        rows = {float(key): (float(uav), float(bird), float(clutter)) for key, uav, bird, clutter in held}
        if any(not np.isfinite(limits).all() for limits in rows.values()):
            raise ValueError(f"there must be {len(CLASSES)} finite thresholds a coverage")
    except (TypeError, KeyError, IndexError, ValueError, OverflowError, RecursionError) as error:
        raise BadInput(f"{source}: damaged prediction sets: {error}: train it again") from None
    if coverage not in rows:
        held = ", ".join(f"{value:g}" for value in rows) or "none"
        raise BadInput(f"{source}: a coverage of {coverage:g} is not among those that it holds: {held}: ask for one")
    return rows[coverage]


def checked_inputs(session: onnxruntime.InferenceSession, source: str) -> tuple[str, ...]:
    """Names of the graph's inputs, checked against what the features give.

    Raises
    ------
    BadInput
        An input is another, there is none, or the graph gives no probabilities.
    """
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


def checked_kinds(metadata: Mapping[str, str], session: onnxruntime.InferenceSession, source: str) -> Mapping[str, str]:
    """The kinds that a model tells apart inside, name to class; none where it knows none.

    Raises
    ------
    BadInput
        They are damaged, or the graph does not give the scores of as many.
    """
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


def place_of_noise(kinds: Mapping[str, str]) -> tuple[int, slice, int] | None:
    """Index of the class of `NOISE`, columns of that class's kinds, which are adjacent, and place of noise in them."""
    if NOISE not in kinds:
        return None
    names, classes = list(kinds), list(kinds.values())
    first = classes.index(kinds[NOISE])
    kin = slice(first, first + classes.count(kinds[NOISE]))
    return CLASSES.index(kinds[NOISE]), kin, names.index(NOISE) - first
