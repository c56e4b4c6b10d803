"""Faults while results are written: killed, disk full, read-only, two processes at once, a clock that goes back.

    python -m tests.fuzz.faults [--kills 50] [--seed 0] [--only train] [--out faults.json]

Half of the kills fall at a random moment of the run, half within milliseconds of the first file that it writes.
Training and report run on a folder with an older result: afterwards the old or the new result must be complete. A data
set is resumed until it is done.
"""

import argparse
import contextlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TextIO
from unittest import mock

import numpy as np
from bladewing.classify.files import settle
from bladewing.classify.report.page import draw_page
from matplotlib.figure import Figure

#: The commands at their smallest size. Each is a script of its own, because a process pool needs one to start from.
TRAIN = """
import sys
from pathlib import Path
from bladewing.classify.train import run_training
from bladewing.classify.training_config import TrainingConfig
TrainingConfig.sets = property(lambda self: {"train": 96, "validate": 24, "calibrate": 96, "test": 96})
if __name__ == "__main__":
    config = Path(sys.argv[1] + ".toml")
    config.write_text('models = ["features-linear", "features-boosted"]\\niterations = 2\\n')
    run_training(Path(sys.argv[1]), seed=int(sys.argv[2]), config=config, progress=False)
"""
DATASET = """
import sys
from pathlib import Path
from bladewing.classify import dataset
from bladewing.classify.progress import Progress
dataset.SHARD_RECORDS = 48
plan = dataset.DataSetPlan(3, {"train": 960, "validate": 240, "calibrate": 240, "test": 240})
if __name__ == "__main__":
    dataset.write_dataset(Path(sys.argv[1]), plan, Progress(visible=False), workers=2)
"""
REPORT = f"""
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace
import bladewing.classify.tables
import numpy as np
from bladewing.classify import workers
from bladewing.classify.report import choices, examples, families, front, pictures, run
from bladewing.models import tabular
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from matplotlib.figure import Figure
from tests.classify.conftest import linear_bytes
from tests.fuzz.faults import no_drawing
for module in (choices, front):
    module.PICTURES = {{"spectrum": pictures.PICTURES["spectrum"]}}
    module.DWELLS_S, module.STORED_BINS = (0.005, 0.08), (64,)
families.FAMILIES = {{"sea": families.FAMILIES["sea"]}}
front.peak_bytes = lambda *_: 1_000_000  # the real one starts a process for each choice
# What is killed is the writing, so little is measured: networks answer without a training, trees are two a class.
even, config_of = np.full((12, 3), 1 / 3), run.TrainingConfig
choices.train_picture = lambda *_, **__: (lambda bits: even, 0.0)
choices.network_for = lambda picture, **_: SimpleNamespace(input_shapes={{"picture": picture.shape, "radar": (4,)}})
choices.network_bytes = linear_bytes
tabular.train_boosted = partial(tabular.train_boosted, iterations=2)
config_of.sets = property(lambda self: {{"train": 192, "validate": 24, "calibrate": 96, "test": 96}})
run.TrainingConfig = lambda **given: config_of(**given, iterations=2).model_copy(update={{"records": 192}})
bladewing.classify.tables.make_tables = lambda seed: {{}}  # which the page does not show
examples.EXAMPLE_KINDS, examples.EXAMPLES_DRAWN = ("vehicle",), 10
Figure.savefig = no_drawing
workers.workers_at_hand = lambda: 1  # several are started for the data set
models = Path(sys.argv[1] + "-models")
if __name__ == "__main__":
    config = Path(sys.argv[1] + ".toml")
    config.write_text(
        "records = 48\\nreference_records = 64\\nchain_s = 0.05\\nstft_s = 0.01\\nleast_rounds = 1\\nrepeats = 1\\n"
        "front_train = 210\\nfront_test = 6\\nfront_epochs = 1\\nfront_s = 0.01\\nfamily_train = 600\\n"
    )
    run.run_report(Path(sys.argv[1]), models=models, quick=True, seed=int(sys.argv[2]), config=config, progress=False)
"""


def no_drawing(_: Figure, file: TextIO, **options: object) -> None:
    """Stand in for `Figure.savefig`: a page takes as long to draw as all else of a report this small."""
    file.write("<svg></svg>")


class Bench:
    """A folder with the scripts and their results, and the trials that run in it."""

    def __init__(self, place: Path, kills: int, rng: np.random.Generator) -> None:
        self.place, self.kills, self.rng = place, kills, rng
        for name, code in (("train", TRAIN), ("dataset", DATASET), ("report", REPORT)):
            (place / f"{name}.py").write_text(code)

    def start(self, name: str, out: Path, seed: int = 0, **options: object) -> subprocess.Popen:
        """Start one of the scripts on a folder."""
        command = [sys.executable, str(self.place / f"{name}.py"), str(out), str(seed)]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True, **options)  # type: ignore[call-overload]

    def whole(self, name: str, out: Path, seed: int = 0) -> float:
        """Run a script to its end; give the seconds it took."""
        started = time.monotonic()
        process = self.start(name, out, seed)
        _, said = process.communicate()
        if process.returncode:
            raise RuntimeError(f"{name}: {said}")
        return time.monotonic() - started

    def kill(self, name: str, out: Path, takes_s: float, seed: int = 0, *, writing: bool) -> bool:
        """Start a script and kill it at a random moment or as it writes; False if it had finished before."""
        before = {path.name for path in out.iterdir()}
        process = self.start(name, out, seed)
        if writing:
            while process.poll() is None and {path.name for path in out.iterdir()} <= before:
                time.sleep(0.0003)
            time.sleep(float(self.rng.exponential(0.004)))
        else:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(float(self.rng.uniform(0, takes_s)))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        return process.returncode == -signal.SIGKILL

    def train(self) -> dict[str, int]:
        """Kill trainings: models and ``train.json`` must stem from the same training."""
        out = self.place / "trained"
        takes = self.whole("train", out, 0)
        models = {0: content(out, "*.onnx")}
        self.whole("train", self.place / "other", 1)
        models[1] = content(self.place / "other", "*.onnx")

        def lost() -> bool:
            settle(out)
            seed = json.loads((out / "train.json").read_text())["settings"]["seed"]
            return content(out, "*.onnx") != models[seed]

        return self.killed("train", out, takes, lost)

    def report(self) -> dict[str, int]:
        """Kill reports: the page must be the one that is drawn from the ``report.json`` beside it."""
        out = self.place / "reported"
        shipped = Path(__file__).parents[2] / "models" / "pretrained" / "spectrum-cnn-fast.onnx"
        (self.place / "reported-models").mkdir()
        shutil.copy(shipped, self.place / "reported-models")
        takes = self.whole("report", out)

        def lost() -> bool:
            settle(out)
            with mock.patch.object(Figure, "savefig", no_drawing):
                drawn = draw_page(json.loads((out / "report.json").read_text()))
            return drawn != (out / "report.html").read_text()

        return self.killed("report", out, takes, lost)

    def killed(self, name: str, out: Path, takes_s: float, lost: Callable[[], bool]) -> dict[str, int]:
        """Kill again and again: no result may be lost, and no temporary file may stay in the end."""
        killed = losses = runs = 0
        while killed < self.kills:
            killed += self.kill(name, out, takes_s, runs % 2, writing=runs % 2 == 1)
            losses += lost()
            runs += 1
        self.whole(name, out)
        litter = len(list(out.glob(".bladewing-*.new")))
        return {"kills": killed, "runs": runs, "lost": losses + lost(), "litter": litter}

    def dataset(self) -> dict[str, int]:
        """Kill and resume a data set until it is done: it must equal an uninterrupted one byte for byte."""
        takes = self.whole("dataset", self.place / "reference")
        reference = content(self.place / "reference", "*")
        killed = losses = sets = runs = 0
        while killed < self.kills:
            out = self.place / f"data-{sets}"
            out.mkdir()
            for turn in range(12):
                killed += self.kill("dataset", out, takes, writing=turn % 2 == 1)
                runs += 1
            self.whole("dataset", out)
            losses += content(out, "*") != reference
            sets += 1
            shutil.rmtree(out)
        return {"kills": killed, "runs": runs, "data_sets": sets, "lost": losses}

    def disk(self) -> dict[str, int]:
        """Write without room (a limit on file sizes, a small disk) and to a read-only disk."""
        faults = losses = wrong = 0
        for name, pattern in (("train", "*.onnx"), ("dataset", "*")):
            out = _made(self.place / f"full-{name}")
            if name == "train":
                self.whole(name, out, 0)
            old = content(out, pattern)
            self.whole(name, self.place / f"full-{name}-reference", 1)
            new = content(self.place / f"full-{name}-reference", pattern)
            for limit in (0, 100, 1000, 4000, 20_000, 100_000):
                process = self.start(name, out, 1, preexec_fn=lambda limit=limit: _limit_files(limit))
                _, said = process.communicate()
                faults += 1
                wrong += process.returncode != 0 and not ("BadInput" in said or "OSError" in said)
                settle(out)
                if name == "train":
                    losses += content(out, pattern) != (old if process.returncode else new)
            self.whole(name, out, 1)
            losses += content(out, pattern) != new
        for options in ("size=400k", "size=400k,ro"):
            place = self.place / f"mounted-{options[-2:]}"
            place.mkdir()
            if subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", place], capture_output=True).returncode:
                continue
            try:
                for name in ("dataset", "train"):
                    out = place / name
                    process = self.start(name, out)
                    _, said = process.communicate()
                    faults += 1
                    fits = name == "train" and "ro" not in options
                    wrong += (process.returncode == 0) != fits
            finally:
                subprocess.run(["umount", place], check=True)
        return {"faults": faults, "lost": losses, "wrong": wrong}

    def pairs(self) -> dict[str, int]:
        """Run two at once in one folder: they follow one another or one is refused; the results are never mixed."""
        models = {}
        for seed in (0, 1):
            self.whole("train", self.place / f"pair-{seed}", seed)
            models[seed] = content(self.place / f"pair-{seed}", "*.onnx")
        out = self.place / "pair"
        losses = 0
        for _ in range(6):
            both = [self.start("train", out, seed) for seed in (0, 1)]
            for process in both:
                process.communicate()
                losses += process.returncode != 0
            seed = json.loads((out / "train.json").read_text())["settings"]["seed"]
            losses += content(out, "*.onnx") != models[seed]
        self.whole("dataset", self.place / "pair-reference")
        both = [self.start("dataset", self.place / "pair-data") for _ in range(2)]
        said = [process.communicate()[1] for process in both]
        refused = sum("another process is writing there" in text for text in said)
        losses += content(self.place / "pair-data", "*") != content(self.place / "pair-reference", "*")
        return {"pairs": 7, "refused": refused, "lost": losses}

    def clock(self) -> dict[str, int]:
        """Turn the clock back: older results carry dates in the future, and the clock runs backwards during the run."""
        out = self.place / "clock"
        self.whole("dataset", self.place / "clock-reference")
        self.whole("train", self.place / "clock-train-reference", 1)
        for name in ("train", "dataset"):
            script = self.place / f"{name}.py"
            script.write_text(
                "import itertools, time\nback = itertools.count(2e9, -3600.0)\ntime.time = lambda: next(back)\n"
                + script.read_text()
            )
        with contextlib.suppress(FileNotFoundError):
            self.whole("train", out)
        self.kill("dataset", _made(self.place / "clock-data"), 3.0, writing=True)
        for path in (*out.iterdir(), *(self.place / "clock-data").iterdir()):
            os.utime(path, (4e9, 4e9))
        self.whole("train", out, 1)
        self.whole("dataset", self.place / "clock-data")
        lost = content(out, "*.onnx") != content(self.place / "clock-train-reference", "*.onnx")
        lost += content(self.place / "clock-data", "*") != content(self.place / "clock-reference", "*")
        return {"faults": 3, "lost": int(lost)}


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _limit_files(size: int) -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def content(folder: Path, pattern: str) -> dict[str, bytes]:
    """Give names and contents of a folder's files."""
    return {path.name: path.read_bytes() for path in sorted(folder.glob(pattern)) if path.is_file()}


def main() -> int:
    """Run the trials, print a line for each, write the counts; 1 if anything was lost, wrong or left lying."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--kills", type=int, default=50)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--only")
    arguments.add_argument("--out", type=Path)
    given = arguments.parse_args()
    counts = {}
    for name in [given.only] if given.only else ["train", "dataset", "report", "disk", "pairs", "clock"]:
        with tempfile.TemporaryDirectory() as place:
            bench = Bench(Path(place), given.kills, np.random.default_rng(given.seed))
            counts[name] = getattr(bench, name)()
        print(name, json.dumps(counts[name]), flush=True)
    if given.out:
        given.out.write_text(json.dumps(counts, indent=1) + "\n")
    return int(any(one.get(fault) for one in counts.values() for fault in ("lost", "wrong", "litter")))


if __name__ == "__main__":
    sys.exit(main())
