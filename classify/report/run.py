"""Measuring everything a report says, and writing it."""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from bladewing.features.inputs import model_inputs
from bladewing.features.schema import INPUT_SHAPES
from bladewing.simulate import Radar, draw_records

from ..bounds import MOST_MODEL_BYTES
from ..errors import BadInput
from ..files import read_bounded, result_folder, settle, write_together
from ..inference import Classifier
from ..labels import CLASSES
from ..progress import Progress
from ..stability.run import worst_of_each
from . import cost, evaluate, scores, stft, storage, trade
from .examples import OVERLAP, WINDOW, show_examples
from .machine import describe_machine
from .page import SCHEMA_VERSION, draw_page
from .series import LADDER

# The paper's measured radar: X band, PRF 20 to 30 kHz, 80 ms.
REFERENCE = Radar(carrier_hz=9.85e9, prf_hz=25e3, pulses=2000)
# Purpose of the records that are timed, weighed and shown: apart from those that are scored.
REFERENCE_PURPOSE = "bench"


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes
    ----------
    records : int
        Test records.
    reference_records : int
        Records that are timed and weighed, >= 64.
    chain_s : float
        Time to spend on the timings, for each batch size [s], > 0.
    stft_s : float
        Time to spend on FFT against STFT, for each record length [s], > 0.
    least_rounds : int
        Rounds of every timing, however long they take.
    """

    records: int
    reference_records: int
    chain_s: float
    stft_s: float
    least_rounds: int


QUICK = Effort(records=3000, reference_records=128, chain_s=8.0, stft_s=2.0, least_rounds=100)
FULL = Effort(records=30_000, reference_records=512, chain_s=60.0, stft_s=15.0, least_rounds=400)


def measure(models: Mapping[str, bytes], effort: Effort, *, seed: int, progress: Progress) -> dict[str, Any]:
    """Score, time and weigh models.

    Parameters
    ----------
    models : mapping of str to bytes
        Name to sealed ONNX model, at least one.
    effort : Effort
    seed : int
        Root seed of the records.
    progress : Progress

    Returns
    -------
    dict
        The report without ``schema_version`` and ``made``: plain numbers, strings, lists and dictionaries.

    Raises
    ------
    BadInput
        If a model cannot be used.
    """
    machine = describe_machine()
    classifiers = {name: Classifier(content, source=name) for name, content in models.items()}
    with progress.phase("Scoring records", effort.records) as done:
        truth, answers = evaluate.ask(classifiers, records=effort.records, seed=seed, on_records=done)
    scored = {name: scores.score(truth, given) for name, given in answers.items()}
    reference = draw_records(REFERENCE, effort.reference_records, seed, purpose=REFERENCE_PURPOSE)
    carrier_hz, prf_hz = REFERENCE.carrier_hz, REFERENCE.prf_hz
    with progress.phase("Timing every step", 1.0) as done:
        chain = cost.time_chain(
            models,
            reference.iq,
            carrier_hz=carrier_hz,
            prf_hz=prf_hz,
            seconds=effort.chain_s,
            least_rounds=effort.least_rounds,
            on_share=done,
        )
    with progress.phase("Timing FFT against STFT", 1.0) as done:
        against = stft.time_fft_against_stft(
            seed=seed, seconds=effort.stft_s, least_rounds=effort.least_rounds, on_share=done
        )
    forms = {"raw IQ": reference.iq} | model_inputs(
        reference.iq, carrier_hz=carrier_hz, prf_hz=prf_hz, names=tuple(INPUT_SHAPES)
    )
    forms["STFT, complex"] = np.stack([stft.stft(one, window=WINDOW, overlap=OVERLAP) for one in reference.iq[:16]])
    return {
        "machine": machine,
        "classes": list(CLASSES),
        "records": scores.describe_records(truth),
        "models": [_describe(name, content, classifiers[name]) for name, content in models.items()],
        "scores": scored,
        "reference": {"carrier_hz": carrier_hz, "prf_hz": prf_hz, "pulses": REFERENCE.pulses},
        "cost": {"threads": 1, "batches": chain},
        "trade": trade.weigh_up(scored, chain),
        "fft_against_stft": against,
        "storage": storage.weigh(forms),
        "examples": show_examples(reference, CLASSES),
    }


def _describe(name: str, content: bytes, classifier: Classifier) -> dict[str, Any]:
    """Tell what a model file is."""
    return {
        "name": name,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        "version": classifier.metadata.get("version"),
        "inputs": list(classifier.inputs),
        "input_bytes": sum(4 * int(np.prod(INPUT_SHAPES[one])) for one in classifier.inputs),
        "accept": list(classifier.accept),
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
        File stem to content: the known ones from cheap to dear, then others by name.

    Raises
    ------
    BadInput
        If the folder does not exist or holds no model.
    """
    if folder is None:
        shipped = resources.files("bladewing.models.pretrained").iterdir()
        found = {entry.name[:-5]: entry.read_bytes() for entry in shipped if entry.name.endswith(".onnx")}
    elif not folder.is_dir():
        raise BadInput(f"{folder}: not a folder: give the one that `bladewing train --out` wrote")
    else:
        settle(folder)
        found = {path.stem: _content(path) for path in folder.glob("*.onnx")}
    if not found:
        where = folder if folder is not None else "the installed package"
        raise BadInput(f"{where}: holds no .onnx file: run `bladewing train --out {folder or 'DIR'}` first")
    order = {name: place for place, name in enumerate(LADDER)}
    return {name: found[name] for name in sorted(found, key=lambda name: (order.get(name, len(order)), name))}


def _content(path: Path) -> bytes:
    try:
        return read_bounded(path, MOST_MODEL_BYTES)
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: the model cannot be read: {getattr(error, 'strerror', None) or error}") from None


def run_report(out: Path, *, models: Path | None, quick: bool, seed: int = 0, progress: bool = True) -> dict[str, Any]:
    """Measure the models on fresh synthetic records and write ``report.json`` and ``report.html``.

    Both files change together after everything is measured and drawn: interrupted at any moment, the old ones or the
    new ones stand whole.

    Parameters
    ----------
    out : Path
        Folder for the two files; made if it is missing.
    models : Path or None
        Folder of .onnx files; None: the shipped ones.
    quick : bool
        A tenth of the records and shorter timings.
    seed : int
        Root seed of the test records, >= 0.
    progress : bool
        Show progress, with the time to go, on stderr.

    Returns
    -------
    dict
        The content of ``report.json``.

    Raises
    ------
    BadInput
        If there are no models, one of them cannot be used, or the seed is negative.
    """
    if seed < 0:
        raise BadInput(f"seed={seed}: must be 0 or more")
    found = load_models(models)
    out = result_folder(out)
    stability = worst_of_each(out)
    started, clock = datetime.now(UTC), time.perf_counter()
    with Progress(visible=progress) as bars:
        body = measure(found, QUICK if quick else FULL, seed=seed, progress=bars)
        made = {
            "date": started.isoformat(timespec="seconds"),
            "command": _command(out, models, quick=quick, seed=seed),
            "quick": quick,
            "seed": seed,
            "seconds": round(time.perf_counter() - clock, 1),
        }
        extremes = {} if stability is None else {"stability": stability}
        text = _json({"schema_version": SCHEMA_VERSION, "made": made, **body, **extremes})
        # The page is drawn from the very text that is stored, so that whoever has the file can draw it again.
        report: dict[str, Any] = json.loads(text)
        page = draw_page(report)
        write_together(out, {"report.json": text, "report.html": page})
    bars.say(f"Wrote {out / 'report.html'} and {out / 'report.json'}")
    return report


def _json(report: Mapping[str, Any]) -> str:
    """Strict JSON for people too: indented, but a list of numbers stays on one line."""
    text = json.dumps(report, indent=1, allow_nan=False, ensure_ascii=False)
    return re.sub(r"\[\s+([-+.\deE,\s]+?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", text) + "\n"


def _command(out: Path, models: Path | None, *, quick: bool, seed: int) -> str:
    """The command line that does the same again."""
    import shlex

    words = ["bladewing", "report", "--out", str(out)]
    words += ["--models", str(models)] if models is not None else []
    words += ["--quick"] if quick else []
    words += ["--seed", str(seed)] if seed else []
    return shlex.join(words)
