"""Measuring everything a report says, and writing it."""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from bladewing.features.inputs import model_inputs
from bladewing.features.schema import INPUT_SHAPES, schema_hash
from bladewing.models import DEFAULT_MODEL
from bladewing.models.seal import seal
from bladewing.simulate import Radar, Records, draw_records
from numpy.typing import NDArray

from ..dataset import simulator_digest
from ..errors import BadInput, unreadable
from ..files import read_bounded, result_folder, settle, write_together
from ..gather import inputs_digest
from ..inference import Classifier
from ..labels import CLASSES
from ..ladder import ACCOUNT, CASCADE, SHIPPED, STAGES_KEY
from ..limits import MOST_TEXT_BYTES
from ..model_file import model_names, read_model
from ..parts import REPORT_PARTS, Parts
from ..progress import Progress
from ..stability.run import worst_of_each
from ..training_config import TrainingConfig
from . import cost, evaluate, scores, storage, trade
from .card import model_card
from .choices import FEATURES, classifier_of
from .examples import OVERLAP, WINDOW, draw_examples, show_stfts
from .families import left_out
from .fft_against_stft import stft, time_fft_against_stft, time_law
from .front import Given, measure_front
from .machine import describe_machine
from .page import SCHEMA_VERSION, draw_page
from .pictures import PICTURES
from .series import EIGHT_BITS, LADDER
from .settings import ReportConfig, report_config

# The paper's measured radar: X band, PRF 20 to 30 kHz, 80 ms.
REFERENCE = Radar(carrier_hz=9.85e9, prf_hz=25e3, pulses=2000)
# Purpose of the records that are timed, weighed and shown; those that are scored have another purpose.
REFERENCE_PURPOSE = "bench"


def measured_report(
    models: Mapping[str, bytes],
    config: ReportConfig,
    *,
    parts: Parts,
    progress: Progress,
    account: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Score, time and weigh models, and the other inputs that a model could read instead.

    Parameters
    ----------
    models : mapping of str to bytes
        Name to sealed ONNX model, at least one.
    config : ReportConfig
    parts : Parts
        Results measured before an interruption.
    progress : Progress
    account : mapping, optional
        Content of the `train.json` beside the models.

    Returns
    -------
    dict
        The report without ``schema_version`` and ``made``: plain numbers, strings, lists and dictionaries.

    Raises
    ------
    BadInput
        If a model cannot be used.
    """
    classifiers = {name: Classifier(content, source=name) for name, content in models.items()}
    trained = (account or {}).get("models", {})
    given = {
        name: Given((content,), classifiers[name].inputs, trained.get(name, {}).get("seconds"))
        for name, content in models.items()
    }
    cascades = _cascade(given, account)
    answering = classifiers | {name: classifier_of(name, both.files) for name, both in cascades.items()}

    def scored() -> dict[str, Any]:
        with progress.phase("Scoring records", config.records) as done:
            truth, answers = evaluate.ask(answering, records=config.records, seed=config.seed, on_records=done)
        found = {name: scores.score(truth, said) for name, said in answers.items()}
        return {"records": scores.describe_records(truth), "scores": found}

    def timed() -> list[dict[str, Any]]:
        with progress.phase("Timing every step", 1.0) as done:
            return cost.time_chain(
                models,
                answering,
                reference.iq,
                carrier_hz=REFERENCE.carrier_hz,
                prf_hz=REFERENCE.prf_hz,
                seconds=config.chain_s,
                least_rounds=config.least_rounds,
                on_share=done,
            )

    def transforms() -> dict[str, Any]:
        effort: dict[str, Any] = {"seed": config.seed, "seconds": config.stft_s, "least_rounds": config.repeats}
        with progress.phase("Timing FFT against STFT", 1.0) as done:
            against = time_fft_against_stft(**effort, on_share=lambda share: done(0.8 * share))
            law = time_law(against, **effort, on_share=lambda share: done(0.8 + 0.2 * share))
        return {"against": against, "law": law}

    def tables() -> dict[str, Any]:
        from ..tables import make_tables

        with progress.phase("Making the paper's tables", 1.0):
            return make_tables(config.seed)

    def families() -> dict[str, Any]:
        with progress.phase("Leaving families out", 1.0) as done:
            return left_out(TrainingConfig(records=config.family_train, seed=config.seed), on_share=done)

    machine = parts.take("machine", describe_machine)
    seen = parts.take("scores", scored)
    reference = draw_records(REFERENCE, config.reference_records, config.seed, purpose=REFERENCE_PURPOSE)
    chain = parts.take("cost", timed)
    against = parts.take("transforms", transforms)
    compared = measure_front(
        given | _in_eight_bits(given) | cascades, config, REFERENCE, parts=parts, phase=progress.phase
    )
    return {
        "config": config.model_dump(mode="json"),
        "machine": machine,
        "classes": list(CLASSES),
        "records": seen["records"],
        "models": [_describe(name, (given | cascades)[name].files, one) for name, one in answering.items()],
        "scores": seen["scores"],
        "reference": {"carrier_hz": REFERENCE.carrier_hz, "prf_hz": REFERENCE.prf_hz, "pulses": REFERENCE.pulses},
        "cost": {"threads": 1, "batches": chain},
        "families": parts.take("families", families),
        "trade": trade.weigh_up(seen["scores"], chain),
        "front": compared,
        "fft_against_stft": against["against"],
        "time_law": against["law"],
        "storage": storage.weigh(_forms(reference)),
        "examples": draw_examples(config.seed, CLASSES),
        "stft_pictures": show_stfts(config.seed),
        "tables": parts.take("tables", tables),
        "training": _training(account),
    }


def _in_eight_bits(given: Mapping[str, Given]) -> dict[str, Given]:
    """Give the default model with its multiplications in eight bits, if it is among those given; for the front only."""
    from bladewing.models.export import in_eight_bits

    if DEFAULT_MODEL not in given:
        return {}
    whole = given[DEFAULT_MODEL]
    return {EIGHT_BITS: replace(whole, files=(seal(in_eight_bits(*whole.files)),))}


def _cascade(given: Mapping[str, Given], account: Mapping[str, Any] | None) -> dict[str, Given]:
    """Give the cascade that the training account describes, if both of its models are among those given."""
    stages = ((account or {}).get(CASCADE) or {}).get(STAGES_KEY, ())
    if not stages or not given.keys() >= set(stages):
        return {}
    first, second = (given[name] for name in stages)
    inputs = tuple(dict.fromkeys((*first.inputs, *second.inputs)))
    return {CASCADE: replace(second, files=(*first.files, *second.files), inputs=inputs, train_s=None)}


def _forms(reference: Records) -> dict[str, NDArray[np.generic]]:
    """Give the reference records in each form that they can be stored in."""
    carrier_hz, prf_hz = REFERENCE.carrier_hz, REFERENCE.prf_hz
    forms: dict[str, NDArray[np.generic]] = {"raw IQ": reference.iq}
    forms |= model_inputs(reference.iq, carrier_hz=carrier_hz, prf_hz=prf_hz, names=tuple(INPUT_SHAPES))
    forms["STFT, complex"] = np.stack([stft(one, window=WINDOW, overlap=OVERLAP) for one in reference.iq[:16]])
    return forms


def _training(account: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Give what page and model card say about the training; None if there is no account of it."""
    if account is None:
        return None
    return {
        "settings": account["settings"],
        "records": account["records"],
        "seconds": account["seconds"]["all"],
        "resumed": bool(account.get("resumed")),
        "versions": account["versions"],
    }


def _describe(name: str, files: tuple[bytes, ...], classifier: Classifier) -> dict[str, Any]:
    """Describe a model of one file, or a cascade of two files that are described as models too."""
    return {
        "name": name,
        "bytes": sum(map(len, files)),
        "sha256": hashlib.sha256(files[0]).hexdigest() if len(files) == 1 else None,
        "version": classifier.metadata.get("version"),
        "inputs": list(classifier.inputs),
        "input_bytes": sum(4 * int(np.prod(INPUT_SHAPES[one])) for one in classifier.inputs),
        "accept": list(classifier.accept),
        "accept_by_pulses": classifier.rules.rows(),
        "envelope": json.loads(classifier.envelope.to_json()),
    }


def load_models(folder: Path | None) -> dict[str, bytes]:
    """Read every .onnx file of a folder, by default the shipped ones.

    Parameters
    ----------
    folder : Path or None

    Returns
    -------
    dict of str to bytes
        File stem to content: known models from cheap to dear, then others by name.

    Raises
    ------
    BadInput
        If the folder does not exist, holds no model, a model that cannot be used, or one with a name that the report
        uses itself.
    """
    if folder is None:
        found = {name: read_model(name)[0] for name in model_names()}
    elif not folder.is_dir():
        raise BadInput(f"{folder}: not a folder: give the one that `bladewing train --out` wrote")
    else:
        try:
            settle(folder)
        except PermissionError as error:
            raise unreadable(folder, error, "give a folder that can be read") from None
        found = {path.stem: read_model(str(path))[0] for path in folder.glob("*.onnx")}
    for name, content in found.items():  # a model that cannot be used is reported by its file before any measuring
        Classifier(content, source=name if folder is None else str(folder / f"{name}.onnx"))
    own = {*PICTURES, FEATURES, CASCADE, EIGHT_BITS}
    if taken := sorted(found.keys() & own):
        raise BadInput(f"{folder}: {taken[0]}.onnx has the name of what the report makes itself: rename the file")
    if not found:
        where = folder if folder is not None else "the installed package"
        raise BadInput(f"{where}: holds no .onnx file: run `bladewing train --out {folder or 'DIR'}` first")
    order = {name: place for place, name in enumerate(LADDER)}
    return {name: found[name] for name in sorted(found, key=lambda name: (order.get(name, len(order)), name))}


def training_account(folder: Path | None) -> dict[str, Any] | None:
    """Read the account of the training from `train.json` beside the models; None if there is no such file.

    Raises
    ------
    BadInput
        If the file cannot be read, is not JSON, or is not the account of a training.
    """
    file = (SHIPPED if folder is None else folder).joinpath(ACCOUNT)
    try:
        content = file.read_bytes() if folder is None else read_bounded(folder / ACCOUNT, MOST_TEXT_BYTES)
        found: dict[str, Any] = json.loads(content)
    except FileNotFoundError:
        return None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{file}: not JSON: {error}: remove it or train again") from None
    except OSError as error:
        raise unreadable(file, error, "remove it or train again") from None
    try:
        _training(found)
        _cascade({}, found)
        found.get("models", {}).get("", {})
    except (KeyError, TypeError, AttributeError) as error:
        raise BadInput(f"{file}: not the account of a training ({error}): remove it or train again") from None
    return found


def run_report(
    out: Path,
    *,
    models: Path | None,
    quick: bool,
    seed: int | None = None,
    config: Path | None = None,
    progress: bool = True,
) -> dict[str, Any]:
    """Measure the models on fresh synthetic records and write ``report.json``, ``report.html`` and ``model-card.md``.

    The files are replaced together after everything is measured and drawn. If the run is interrupted at any moment, the
    folder holds either all old or all new files, and the next run of the same report continues where this one stopped.

    Parameters
    ----------
    out : Path
        Folder for the three files; made if it is missing.
    models : Path or None
        Folder of .onnx files; None: the shipped ones.
    quick : bool
        Fewer records and shorter timings, see `settings.QUICK`.
    seed : int, optional
        Root seed of the test records, >= 0.
    config : Path, optional
        TOML file with fields of `settings.ReportConfig`.
    progress : bool
        Show progress, with the time to go, on stderr.

    Returns
    -------
    dict
        The content of ``report.json``.

    Raises
    ------
    BadInput
        If there are no models, one of them cannot be used, or a setting is wrong.
    """
    settings = report_config(config, seed=seed, quick=quick)
    found, account = load_models(models), training_account(models)
    out = result_folder(out)
    stability = worst_of_each(out)
    parts = Parts(out / REPORT_PARTS, _of(settings, found, account))
    started, clock, resumed = datetime.now(UTC), time.perf_counter(), parts.begun
    with parts.alone(), Progress(visible=progress) as bars:
        body = measured_report(found, settings, parts=parts, progress=bars, account=account)
        made = {
            "date": started.isoformat(timespec="seconds"),
            "command": _command(out, models, quick=quick, seed=seed, config=config),
            "quick": quick,
            "seed": settings.seed,
            "seconds": round(time.perf_counter() - clock, 1),
            "resumed": resumed,
        }
        extremes = {} if stability is None else {"stability": stability}
        text = _json({"schema_version": SCHEMA_VERSION, "made": made, **body, **extremes})
        # The page is drawn from exactly the text that is stored, so that anyone with the file can draw it again.
        report: dict[str, Any] = json.loads(text)
        write_together(
            out, {"report.json": text, "report.html": draw_page(report), "model-card.md": model_card(report)}
        )
        parts.forget()
        others = parts.others()
    bars.say(f"Wrote {out / 'report.html'}, {out / 'report.json'} and {out / 'model-card.md'}")
    if others:
        bars.say(others)
    return report


def _of(settings: ReportConfig, models: Mapping[str, bytes], account: Mapping[str, Any] | None) -> dict[str, Any]:
    """Collect everything that the results depend on."""
    return {
        "machine": {name: value for name, value in describe_machine().items() if name != "load"},
        "cascade": (account or {}).get(CASCADE),
        "schema": SCHEMA_VERSION,
        "version": metadata.version("bladewing"),
        "features": schema_hash(),
        "simulator_sha256": simulator_digest(),
        "inputs_sha256": inputs_digest(),
        "settings": settings.model_dump(mode="json"),
        "models": {name: hashlib.sha256(content).hexdigest() for name, content in models.items()},
    }


def _json(report: Mapping[str, Any]) -> str:
    """Write strict JSON that people can read too: indented, but a list of numbers stays on one line."""
    text = json.dumps(report, indent=1, allow_nan=False, ensure_ascii=False)
    return re.sub(r"\[\s+([-+.\deE,\s]+?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"


def _command(out: Path, models: Path | None, *, quick: bool, seed: int | None, config: Path | None) -> str:
    """Give the command line that repeats this run."""
    import shlex

    words = ["bladewing", "report", "--out", str(out)]
    words += ["--models", str(models)] if models is not None else []
    words += ["--quick"] if quick else []
    words += ["--config", str(config)] if config is not None else []
    words += ["--seed", str(seed)] if seed is not None else []
    return shlex.join(words)
