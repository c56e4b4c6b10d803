"""Training: synthetic records in, calibrated ONNX models and the account of the run out."""

import json
import os
import platform
import time
from collections.abc import Callable
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from bladewing.features import INPUT_SHAPES, schema_hash
from bladewing.models import LADDER, TEACHER
from bladewing.simulate.dataset import KIND_CLASS
from numpy.typing import NDArray

from .dataset import SHARD_RECORDS, DataSet, DataSetPlan, simulator_digest
from .envelope import Envelope
from .errors import BadInput
from .files import result_folder, write_together
from .gather import TASK_RECORDS, Gathered, TrainingSets, gather, gather_from, inputs_digest
from .inference import Classifier
from .labels import CLASSES
from .ladder import ACCOUNT, CASCADE
from .model_file import COVERAGES, CURVE_KEY, FORMAT, KINDS_KEY, RULES_KEY, SETS_KEY
from .parts import TRAIN_PARTS, Parts
from .progress import Progress
from .rules import Rule, Rules
from .train_network import PUPIL_EPOCHS, OnFraction, ScoresOf, Taught, epochs_of, train_net
from .training_account import covered, figures, print_account
from .training_config import TrainingConfig, training_config
from .training_costs import add_costs


def run_training(
    out: Path,
    *,
    records: int | None = None,
    seed: int | None = None,
    quick: bool = False,
    config: Path | None = None,
    data: Path | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Train the models of the ladder on synthetic records and write them to a folder.

    Interrupted, the same call goes on: with what is drawn, with the models that are finished, and with a network from
    its last whole epoch. On the same machine the models have the bytes of a run that nothing interrupted.

    Parameters
    ----------
    out : Path
        Folder for `<name>.onnx` and `train.json`; made if it is missing. All files change together at the end.
    records, seed, quick, config
        See `training_config`.
    data : Path, optional
        A data set (see `dataset`) to read the records from instead of drawing them; the models are the same.
    progress : bool
        Show progress and a table on the terminal.

    Returns
    -------
    dict
        The account, as in `train.json`.

    Raises
    ------
    BadInput
        If a setting is wrong, the data set cannot be used, what an interrupted run left is damaged, or the folder
        cannot be written.
    """
    stored = None if data is None else DataSet(data)
    held = None if stored is None else {"records": stored.plan.records["train"], "seed": stored.plan.seed}
    settings = training_config(config, records=records, seed=seed, quick=quick, stored=held)
    if stored is not None and stored.plan != DataSetPlan.of(settings):
        raise BadInput(f"{data}: holds sets of {stored.plan.records}, a training takes {settings.sets}: write it again")
    result_folder(out)
    _refuse_others(out, settings)
    versions = _versions()
    simulator = simulator_digest() if stored is None else stored.simulator_sha256
    parts = Parts(
        out / TRAIN_PARTS,
        {
            "settings": settings.model_dump(mode="json"),
            "pupil_epochs": PUPIL_EPOCHS,
            "run_records": TASK_RECORDS if stored is None else SHARD_RECORDS,  # a kept part holds several runs
            "simulator_sha256": simulator,
            "inputs_sha256": inputs_digest(),
            "schema_sha256": schema_hash(),
            "versions": versions,
        },
    )
    with parts.alone():
        return _train_all(out, settings, stored, parts, {"simulator_sha256": simulator, "versions": versions}, progress)


def _train_all(
    out: Path,
    settings: TrainingConfig,
    stored: DataSet | None,
    parts: Parts,
    made_by: dict[str, Any],
    progress: bool,
) -> dict[str, Any]:
    """Draw or read the records, train every model on them, and write the models with their account."""
    # How long GNU's threads spin while they wait. Some microseconds: that is the time between the products of a wide
    # network, which takes 1.7 times as long where waiting threads sleep at once. No more: beside another busy process
    # boosted trees take several times as long where they spin on, as by default.
    os.environ.setdefault("GOMP_SPINCOUNT", "2000")
    started = time.perf_counter()
    resumed = parts.begun
    for name in settings.models:  # damaged parts are reported before any record is drawn
        for part in (name, epochs_of(name)):
            parts.arrays(part)
    with Progress(visible=progress) as bars:
        if resumed:
            bars.say(f"Going on with what an interrupted run left in {out / TRAIN_PARTS}")
        if stored is not None and made_by["simulator_sha256"] != simulator_digest():
            bars.say(f"{stored.folder}: written by another simulator or on another machine: a drawn set would differ")
        sets = _gather(settings, stored, bars, parts)
        gathered_s = time.perf_counter() - started
        files: dict[str, bytes] = {}
        models: dict[str, dict[str, Any]] = {}

        @cache
        def told() -> NDArray[np.float32]:
            """The teacher's probabilities of the kinds of the training records, computed once for all pupils."""
            return Classifier(files[f"{TEACHER}.onnx"], source=TEACHER).kind_shares(sets.train.inputs)

        for name in sorted(settings.models, key=lambda name: name != TEACHER):
            taught = told if TEACHER in models else None
            with bars.phase(f"train {name}", 1) as on_fraction:
                files[f"{name}.onnx"], models[name] = _take_or_train(name, settings, sets, on_fraction, parts, taught)
        models = {name: models[name] for name in settings.models}
    cascade = add_costs(files, models, sets.calibrate, sets.test, settings.false_alarm)
    account = {
        "format": 1,
        "settings": settings.model_dump(mode="json"),
        "records": settings.sets,
        "resumed": resumed,  # then these seconds leave out what was done before the interruption; the models' do not
        "seconds": {"gather": round(gathered_s, 1), "all": round(time.perf_counter() - started, 1)},
        "false_alarm": settings.false_alarm,
        "models": models,
        CASCADE: cascade,
        "schema_sha256": schema_hash(),
        **made_by,
    }
    files[ACCOUNT] = (json.dumps(account, indent=1, allow_nan=False) + "\n").encode()
    _refuse_others(out, settings)  # again: another run may have finished here meanwhile
    write_together(out, files)
    parts.forget()
    if progress:
        print_account(account, out)
    if others := parts.others():
        bars.say(others)
    return account


def _refuse_others(out: Path, settings: TrainingConfig) -> None:
    """Refuse a folder that holds models which this run would not replace: one account would stand beside two runs'."""
    others = [name for name in LADDER if name not in settings.models and (out / f"{name}.onnx").exists()]
    if others:
        raise BadInput(
            f"{out} holds {others[0]}.onnx of another training, which this one does not make: name another folder, or "
            "move that file away"
        )


def _gather(
    settings: TrainingConfig, stored: DataSet | None, bars: Progress, parts: Parts | None = None
) -> TrainingSets:
    """Draw or read the four sets, with only the inputs that the chosen models read."""
    names = tuple(name for name in INPUT_SHAPES if any(name in LADDER[model].inputs for model in settings.models))
    total, done = sum(settings.sets.values()), 0
    sets = {}
    with bars.phase(f"{'draw' if stored is None else 'read'} {total} records", total) as on_done:
        for purpose, count in settings.sets.items():

            def on_records(number: int) -> None:
                nonlocal done
                done += number
                on_done(done)

            make = partial(gather, settings.seed) if stored is None else partial(gather_from, stored.sources(purpose))
            sets[purpose] = make(purpose, count, names=names, on_records=on_records, parts=parts)
    return TrainingSets(**sets)


def _take_or_train(
    name: str,
    settings: TrainingConfig,
    sets: TrainingSets,
    on_fraction: OnFraction,
    parts: Parts,
    taught: Taught | None,
) -> tuple[bytes, dict[str, Any]]:
    """Give a model as it was finished before an interruption, or train and keep it."""
    kept = parts.arrays(name)
    if kept is not None:
        try:
            return kept["model"].tobytes(), json.loads(kept["account"].tobytes())
        except (KeyError, ValueError) as error:
            raise parts.refusal(name, str(error)) from None
    content, account = train_one(name, settings, sets, on_fraction, parts, taught)
    text = json.dumps(account, allow_nan=False).encode()
    parts.keep_arrays(name, {"model": np.frombuffer(content, np.uint8), "account": np.frombuffer(text, np.uint8)})
    return content, account


def train_one(
    name: str,
    settings: TrainingConfig,
    sets: TrainingSets,
    on_fraction: OnFraction,
    parts: Parts | None = None,
    taught: Taught | None = None,
) -> tuple[bytes, dict[str, Any]]:
    """Train, calibrate, export and compare one model; give its sealed file and its account.

    A network learns from the answers of its teacher too, where these are given.
    """
    from bladewing.models.calibration import expected_calibration_error, fit_vector_scaling
    from bladewing.models.export import NETWORK_TOLERANCE, TABULAR_TOLERANCE, attach_metadata, check_export
    from bladewing.models.operating import operating_curve
    from bladewing.models.seal import seal

    started = time.perf_counter()
    network = LADDER[name].learner == "network"
    scores_of, export, detail = (partial(train_net, parts=parts, taught=taught) if network else _tabular)(
        name, settings, sets, on_fraction
    )
    calibration = fit_vector_scaling(scores_of(sets.calibrate), sets.calibrate.labels)
    calibrated = calibration.probabilities(scores_of(sets.calibrate))
    known = calibrated, sets.calibrate.labels
    precision, false_alarm = settings.precision, settings.false_alarm
    of_all = Rule.fitted(*known, precision=precision, false_alarm=false_alarm, coverages=COVERAGES)
    rules = Rules.fitted(*known, sets.calibrate.pulses_counted, of_all, precision=precision, false_alarm=false_alarm)
    curve = operating_curve(*known)
    onnx_bytes = export(calibration)
    probabilities = calibration.probabilities(scores_of(sets.test))
    tolerance = NETWORK_TOLERANCE if network else TABULAR_TOLERANCE
    difference = check_export(onnx_bytes, probabilities, sets.test.inputs, tolerance)
    labels, pulses = sets.test.labels, sets.test.pulses_counted
    limits = np.array([rules.sets(pulses, coverage) for coverage in COVERAGES])
    account = {
        "inputs": list(LADDER[name].inputs),
        "test": figures(probabilities, labels, rules.accept(pulses), settings.false_alarm)
        | {"expected_calibration_error": round(expected_calibration_error(probabilities, labels), 4)}
        | {"coverage": [round(share, 4) for share in covered(probabilities, labels, limits)]},
        "calibration": {"scale": float(calibration.scale), "bias": [float(b) for b in calibration.bias]},
        "accept": list(of_all.accept),
        "accept_by_pulses": rules.rows(),
        "export_difference": difference,
        "seconds": round(time.perf_counter() - started, 1),
        **detail,  # a network's own seconds replace these: it may have begun before an interruption
    }
    metadata = {
        "product": "bladewing",
        "format": FORMAT,
        "name": name,
        "version": version("bladewing"),
        "classes": json.dumps(CLASSES),
        "inputs": json.dumps({key: INPUT_SHAPES[key] for key in LADDER[name].inputs}),
        "schema_sha256": schema_hash(),
        "envelope": Envelope().to_json(),
        "calibration": json.dumps(account["calibration"]),
        "accept": json.dumps(account["accept"]),
        CURVE_KEY: curve.to_json(),
        **({KINDS_KEY: json.dumps(KIND_CLASS)} if network else {}),
        SETS_KEY: json.dumps([[coverage, *row] for coverage, row in of_all.sets.items()]),
        RULES_KEY: rules.to_json(),
        "training": settings.model_dump_json(),
    }
    sealed = seal(attach_metadata(onnx_bytes, metadata))
    return sealed, account | {"bytes": len(sealed)}


def _tabular(
    name: str, settings: TrainingConfig, sets: TrainingSets, on_fraction: OnFraction
) -> tuple[ScoresOf, Callable[[Any], bytes], dict[str, Any]]:
    from bladewing.models.export import export_tabular
    from bladewing.models.tabular import tabular_scores, train_boosted, train_linear

    (column,) = LADDER[name].inputs

    def on_step(done: int, total: int) -> None:
        on_fraction(done / total)

    x, y = sets.train.inputs[column], sets.train.labels
    if LADDER[name].learner == "linear":
        model = train_linear(x, y, seed=settings.seed, progress=on_step)
    else:
        model = train_boosted(
            x, y, seed=settings.seed, iterations=settings.iterations, leaves=settings.leaves, progress=on_step
        )

    def scores_of(part: Gathered) -> NDArray[np.floating]:
        return tabular_scores(model, part.inputs[column])

    return scores_of, lambda calibration: export_tabular(model, x.shape[1], column, calibration), {}


def _versions() -> dict[str, str]:
    names = ("bladewing", "numpy", "scipy", "scikit-learn", "torch", "onnx", "onnxruntime", "skl2onnx")
    return {"python": platform.python_version(), **{name: version(name) for name in names}}
