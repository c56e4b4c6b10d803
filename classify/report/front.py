"""The front: how accurate every choice of picture, model and dwell is, and its cost in time, memory and storage."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.fft
from bladewing.features.schema import INPUT_SHAPES
from bladewing.simulate import Radar, draw_records
from numpy.typing import NDArray

from ..labels import CLASSES
from ..ladder import non_dominated
from ..limits import DWELL_S
from ..parts import Parts
from ..timing import Work, quote, ratio, time_in_turns
from . import choices, metrics
from .choices import DWELLS_S, FEATURES, STORED_BINS, STORED_BITS, FrontSet, OnDone
from .cost import BATCHES, in_turn
from .detection_bound import detection_bounds
from .memory import peak_bytes
from .operations import counted_transforms, network_operations
from .pictures import PICTURES
from .scores import FALSE_ALARM_RATE, snr_edges
from .settings import ReportConfig
from .storage import RECORDS_QUOTED

#: Time budgets for one record [us].
BUDGETS_US = (50.0, 200.0, 1000.0)
#: "Time to declare": the shortest dwell at which at least this share of the UAVs above this SNR [dB] is found.
DECLARED_SHARES, DECLARED_SNR_DB = (0.5, 0.8), 0.0

Phase = Callable[[str, float], AbstractContextManager[OnDone]]


@dataclass(frozen=True)
class Given:
    """A model that was trained elsewhere and is given to the report.

    Attributes
    ----------
    files : tuple of bytes
        Sealed ONNX model, or the two of a cascade.
    inputs : tuple of str
        Names of what it reads.
    train_s : float or None
        Duration of the training [s]; None where it is not known.
    """

    files: tuple[bytes, ...]
    inputs: tuple[str, ...]
    train_s: float | None


def measure_front(
    models: Mapping[str, Given], config: ReportConfig, reference: Radar, *, parts: Parts, phase: Phase
) -> dict[str, Any]:
    """Train the choices that need training, then score and time every choice at every dwell.

    Parameters
    ----------
    models : mapping of str to Given
    config : ReportConfig
    reference : Radar
        The radar of all records; its dwell is replaced by each of `DWELLS_S`.
    parts : Parts
        Results measured earlier, which are not measured again.
    phase : callable
        Makes a phase of the progress, see `Progress.phase`.

    Returns
    -------
    dict
        ``dwells_s``, ``train_records``, ``test_records`` (of each dwell), ``epochs``; ``declared`` (``shares`` and
        ``snr_db``), ``quoted_dwell_s``; ``bounds``: see `detection_bound.detection_bounds`; ``choices``: one a picture,
        one for the measurements and one a model, see `_row`; ``budgets``: for each batch size and budget the choice
        most accurate on half of the test records with its scores on the other half, or None; ``stored``: for each
        number of bins and bits ``bytes``, ``bytes_per_million``, the accuracy and whether no other row beats it in
        size and accuracy (``front``).
    """
    _score(models, config, reference, parts=parts, phase=phase)
    entries = [("picture", name) for name in PICTURES] + [("features", FEATURES)]
    entries += [("model", name) for name in models]
    scored = {name: parts.take(f"front {kind} {name}", dict) for kind, name in entries}

    def costs() -> dict[str, Any]:
        trees = base64.b64decode(scored[FEATURES]["onnx"])
        files = {name: given.files for name, given in models.items()} | {FEATURES: (trees,)} | _networks(config)
        with phase("Timing the front", 1.0) as done:
            return _costs(entries, files, config, reference, done)

    cost = parts.take("front costs", costs)
    rows = [_row(kind, name, scored[name], cost[name], models.get(name)) for kind, name in entries]
    _mark(rows)
    stored = [row for bins in STORED_BINS for row in parts.take(f"front picture {choices.stored_name(bins)}", dict)]
    kept = non_dominated([row["bytes"] for row in stored], [_accuracy(row) for row in stored])
    return {
        "dwells_s": list(DWELLS_S),
        "train_records": config.front_train,
        "test_records": config.front_test,
        "epochs": config.front_epochs,
        "declared": {"shares": list(DECLARED_SHARES), "snr_db": DECLARED_SNR_DB},
        "quoted_dwell_s": DWELL_S,
        "bounds": detection_bounds(choices.radar_of(DWELL_S, reference).pulses),
        "choices": rows,
        "budgets": [_budget(rows, place, budget_us) for place in range(len(BATCHES)) for budget_us in BUDGETS_US],
        "stored": [{**row, "front": keep} for row, keep in zip(stored, kept, strict=True)],
    }


def _score(models: Mapping[str, Given], config: ReportConfig, reference: Radar, *, parts: Parts, phase: Phase) -> None:
    """Score every choice that has no stored part yet; each result becomes a part."""
    stored = [choices.stored_name(bins) for bins in STORED_BINS]
    missing = [name for name in (*PICTURES, *stored) if not parts.have(f"front picture {name}")]
    features = [] if parts.have(f"front features {FEATURES}") else [FEATURES]
    unasked = {name: given for name, given in models.items() if not parts.have(f"front model {name}")}
    if not (missing or features or unasked):
        return
    answers = {name: choices.open_choice("model", name, given.files) for name, given in unasked.items()}
    said: dict[str, list[NDArray[np.floating]]] = {name: [] for name in unasked}

    def ask(purpose: str, iq: NDArray[np.complex64], radar: Radar) -> None:
        if purpose == "test":
            for name, answer in answers.items():
                said[name].append(answer(iq, radar))

    each = -(-config.front_train // len(DWELLS_S))
    purposes = {"test": config.front_test}
    if missing or features:
        purposes |= {"train": each, "validate": max(6, each // 5)}
    with phase("Drawing every dwell", 1.0) as done:
        sets = choices.draw_sets(purposes, [*missing, *features], reference, seed=config.seed, on_done=done, ask=ask)
    test = sets["test"]
    for name in unasked:
        parts.take(f"front model {name}", partial(_by_dwell, test, np.concatenate(said[name])))
    for _ in features:
        parts.take(f"front features {FEATURES}", partial(_features, sets, config))
    with phase("Training on every picture", max(1.0, len(missing))) as done:
        for place, name in enumerate(missing):

            def share(part: float, place: int = place) -> None:
                done(place + part)

            measure: Callable[..., Any] = _stored if name in stored else _picture
            parts.take(f"front picture {name}", partial(measure, name, sets, config, share))


def _picture(name: str, sets: Mapping[str, FrontSet], config: ReportConfig, done: OnDone) -> dict[str, Any]:
    answer, seconds = choices.train_picture(name, sets, config, on_done=done)
    return {"train_s": seconds, **_by_dwell(sets["test"], answer(32))}


def _features(sets: Mapping[str, FrontSet], config: ReportConfig) -> dict[str, Any]:
    probabilities, content, seconds = choices.train_features(sets, config)
    onnx = base64.b64encode(content).decode()
    return {"train_s": seconds, "onnx": onnx, **_by_dwell(sets["test"], probabilities)}


def _stored(name: str, sets: Mapping[str, FrontSet], config: ReportConfig, done: OnDone) -> list[dict[str, Any]]:
    """Make the rows of one number of bins: trained on unquantised levels, tested on levels of fewer and fewer bits."""
    answer, _ = choices.train_picture(name, sets, config, on_done=done)
    channels, bins = sets["test"].inputs[name].shape[1:]
    rows = []
    for bits in STORED_BITS:
        weight = channels * bins * bits // 8
        about = {"bins": bins, "bits": bits, "bytes": weight, "bytes_per_million": weight * RECORDS_QUOTED}
        rows.append({**about, **_scores(sets["test"].labels, answer(bits))})
    return rows


def _scores(labels: NDArray[np.int64], probabilities: NDArray[np.floating]) -> dict[str, Any]:
    """Give the balanced accuracy and the share of UAVs found at the false-alarm rate."""
    recalls = metrics.recalls(probabilities.argmax(axis=1) == labels, labels, len(CLASSES))
    found = metrics.detection_at(probabilities[:, 0], labels == 0, false_alarm_rate=FALSE_ALARM_RATE)
    return {"balanced_accuracy": metrics.mean_of_rates(recalls), "uav_found": found["detection"]}


def _by_dwell(test: FrontSet, probabilities: NDArray[np.floating]) -> dict[str, Any]:
    """Give the scores of each dwell, and the shortest dwells that find `DECLARED_SHARES` of the stronger UAVs."""
    dwells, declared = [], []
    for place in range(len(DWELLS_S)):
        here = test.dwell == place
        labels, mine = test.labels[here], probabilities[here]
        # The best of many choices looks too good on the records that chose it: one half chooses, the other is quoted.
        chosen, quoted = (_scores(labels[half::2], mine[half::2]) for half in (0, 1))
        dwells.append({**_scores(labels, mine), "chosen_by": chosen["balanced_accuracy"], "quoted": quoted})
        # All non-UAVs stay, so the false alarms are the same; of the UAVs only those above the SNR stay.
        strong = (labels != 0) | (test.snr_db[here] > DECLARED_SNR_DB)
        declared.append(_scores(labels[strong], mine[strong])["uav_found"]["value"])
    here = test.dwell == DWELLS_S.index(DWELL_S)
    by_snr = _found_by_snr(test.labels[here], probabilities[here, 0], test.snr_db[here])
    times = [
        next((dwell for dwell, share in zip(DWELLS_S, declared, strict=True) if (share or 0.0) >= wanted), None)
        for wanted in DECLARED_SHARES
    ]
    return {"dwells": dwells, "declare_s": times, "uav_by_snr": by_snr}


def _found_by_snr(
    labels: NDArray[np.int64], score: NDArray[np.floating], snr_db: NDArray[np.float64]
) -> list[dict[str, Any]]:
    """Give the share of UAVs found in slices of the SNR; the false-alarm rate is that over all birds and clutter."""
    threshold = metrics.detection_at(score, labels == 0, false_alarm_rate=FALSE_ALARM_RATE)["threshold"]
    found, uav_db = score[labels == 0] > threshold, snr_db[labels == 0]
    return [
        {"from": float(low), "to": float(high), "found": metrics.rate(found[(uav_db >= low) & (uav_db < high)])}
        for low, high in pairwise(snr_edges(uav_db))
    ]


def _networks(config: ReportConfig) -> dict[str, tuple[bytes]]:
    """Give ONNX files of untrained networks for the pictures: time and size do not depend on the training."""
    of_shape = {
        picture.shape: (choices.network_bytes(choices.network_for(picture, seed=config.seed)),)
        for picture in PICTURES.values()
    }
    return {name: of_shape[picture.shape] for name, picture in PICTURES.items()}


def _costs(
    entries: Sequence[tuple[str, str]],
    files: Mapping[str, tuple[bytes, ...]],
    config: ReportConfig,
    reference: Radar,
    done: OnDone,
) -> dict[str, Any]:
    """Measure what every choice costs; name to its costs."""
    quoted = choices.radar_of(DWELL_S, reference)
    batch = draw_records(quoted, BATCHES[-1], config.seed, purpose="bench").iq
    found: dict[str, Any] = {}
    for place, (kind, name) in enumerate(entries):
        found[name] = {
            "model_bytes": sum(map(len, files[name])),
            "weights": " and ".join(sorted(set(map(_weights, files[name])))),
            "model_operations": sum(map(network_operations, files[name])),  # for a cascade the upper limit: both models
            "peak_bytes": peak_bytes(choices.prepared, kind, name, files[name], batch, quoted),
            "dwells": [],
        }
        done(0.3 * (place + 1) / len(entries))
    answers = {name: choices.open_choice(kind, name, files[name]) for kind, name in entries}
    for place, dwell_s in enumerate(DWELLS_S):
        radar = choices.radar_of(dwell_s, reference)
        iq = draw_records(radar, BATCHES[-1], config.seed, purpose="bench").iq
        operations = {}
        for name, answer in answers.items():
            with counted_transforms() as counter:
                answer(iq, radar)
            operations[name] = round(counter.total / len(iq))  # for a cascade the mean over the records
        timed = [_timed(answers, iq, radar, size, config.front_s) for size in BATCHES]
        for name in answers:
            cost = [part[name] for part in timed]
            found[name]["dwells"].append({"input_operations": operations[name], "cost": cost})
        done(0.3 + 0.7 * (place + 1) / len(DWELLS_S))
    return found


def _timed(
    answers: Mapping[str, choices.Answer], iq: NDArray[np.complex64], radar: Radar, batch: int, seconds: float
) -> dict[str, dict[str, Any]]:
    """Time every choice at one dwell and batch size, in turns with the bare FFT."""
    some = [iq[at : at + batch] for at in range(0, len(iq), batch)]
    works: dict[str | None, Work] = {None: in_turn([partial(scipy.fft.fft, one) for one in some])}
    for name, answer in answers.items():
        works[name] = in_turn([partial(answer, one, radar) for one in some])
    taken = time_in_turns(works, seconds=seconds, least_rounds=3, most_rounds=1000)
    return {
        name: {
            "batch": batch,
            **quote(laps, per=batch, turns=len(some)),
            **ratio(laps, taken[None], turns=len(some)),
        }
        for name, laps in taken.items()
        if name is not None
    }


def _weights(onnx_bytes: bytes) -> str:
    """Name the smallest data type of a graph's weights."""
    import onnx

    kept = {one.data_type for one in onnx.load_model_from_string(onnx_bytes).graph.initializer}
    if kept & {onnx.TensorProto.INT8, onnx.TensorProto.UINT8}:
        return "int8"
    return "float16" if onnx.TensorProto.FLOAT16 in kept else "float32"


def _row(
    kind: str, name: str, scored: Mapping[str, Any], cost: Mapping[str, Any], given: Given | None
) -> dict[str, Any]:
    """Describe one choice: what it is, its size, and its scores and costs at each dwell."""
    if kind == "picture":
        words, model, size = PICTURES[name].words, "small network", int(np.prod(PICTURES[name].shape))
    elif kind == "features":
        words, model, size = "measurements", "boosted trees", INPUT_SHAPES[FEATURES][0]
    else:
        assert given is not None
        words = " and ".join(", ".join(given.inputs).replace("_", " ").rsplit(", ", 1))
        model = name
        size = sum(int(np.prod(INPUT_SHAPES[one])) for one in given.inputs)
    dwells = [
        {"dwell_s": dwell_s, **gives, **takes, "operations": takes["input_operations"] + cost["model_operations"]}
        for dwell_s, gives, takes in zip(DWELLS_S, scored["dwells"], cost["dwells"], strict=True)
    ]
    return {
        "kind": kind,
        "name": name,
        "words": words,
        "model": model,
        **{key: cost[key] for key in ("weights", "model_bytes", "model_operations", "peak_bytes")},
        "train_s": given.train_s if given is not None else scored["train_s"],
        "stored_bytes": 4 * size,
        "stored_bytes_per_million": 4 * size * RECORDS_QUOTED,
        "declare_s": scored["declare_s"],
        "uav_by_snr": scored["uav_by_snr"],
        "dwells": dwells,
    }


def _accuracy(point: Mapping[str, Any], by: str = "balanced_accuracy") -> float:
    return round(float(point[by]["value"] or 0.0), 9)  # equal means of three shares may differ in the last digit


def _mark(rows: Sequence[Mapping[str, Any]]) -> None:
    """Set ``front`` in each entry of ``cost``: whether no other point beats this one in time and accuracy."""
    points = [(row, point) for row in rows for point in row["dwells"]]
    accuracy = [_accuracy(point) for _, point in points]
    for place in range(len(BATCHES)):
        entries = [point["cost"][place] for _, point in points]
        kept = non_dominated([entry["median_us"] for entry in entries], accuracy)
        for entry, keep in zip(entries, kept, strict=True):
            entry["front"] = keep


def _budget(rows: Sequence[Mapping[str, Any]], place: int, budget_us: float) -> dict[str, Any]:
    """Find the choice within a time budget that is most accurate on one half of the test records.

    Of equally accurate ones the cheapest is taken. Its scores are quoted from the other half.
    """
    points = [(row, point, point["cost"][place]["median_us"]) for row in rows for point in row["dwells"]]
    within = [entry for entry in points if entry[2] <= budget_us]
    best = max(within, key=lambda entry: (_accuracy(entry[1], "chosen_by"), -entry[2]), default=None)
    asked = {"batch": BATCHES[place], "budget_us": budget_us}
    if best is None:
        return {**asked, "choice": None}
    row, point, cost_us = best
    about = {"choice": row["name"], "kind": row["kind"], "words": row["words"], "dwell_s": point["dwell_s"]}
    return {**asked, **about, "cost_us": cost_us, **point["quoted"]}
