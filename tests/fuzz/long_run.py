"""Ten thousand mutated real files for every reader: counts of crashes, hangs and wrong refusals.

    python -m tests.fuzz.long_run [--inputs 10000] [--seed 0] [--reader NAME] [--out fuzz.json]

Each thousand runs in a process of its own with limited memory. A crash in C code is thus noticed, and the input that
caused it is kept.
"""

import argparse
import json
import multiprocessing
import resource
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from .readers import mutate, readers, verdict

_MEMORY_BYTES = 6 << 30
_BATCH = 1000


def work(name: str, seed: int, first: int, count: int, place: str, answer: Any) -> None:
    """Try `count` inputs from number `first` on; counts go through a pipe, the current input is kept in a file."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    warnings.simplefilter("error")  # a warning from inside a library counts as a fault too
    folder = Path(place) / f"{name}-{first}"
    folder.mkdir(parents=True)
    reader = readers(folder / "seeds")[name]
    said: Counter[str] = Counter()
    slowest = 0.0
    wrong = []
    for number in range(first, first + count):
        content = mutate(reader.seeds, np.random.default_rng((seed, number)))
        (folder / "under way").write_bytes(content)
        started = time.perf_counter()
        result = verdict(reader, content, folder)
        slowest = max(slowest, time.perf_counter() - started)
        kind = result if result in ("read", "refused", "hang") else "wrong"
        said[kind] += 1
        if kind in ("hang", "wrong"):
            wrong.append((number, result))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    answer.send((dict(said), wrong, slowest, peak))


def main() -> int:
    """Run, print a line per reader, write the counts; 1 if anything went wrong."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--inputs", type=int, default=10_000)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--reader")
    arguments.add_argument("--out", type=Path)
    given = arguments.parse_args()
    context = multiprocessing.get_context("spawn")
    counts = {}
    with tempfile.TemporaryDirectory() as place:
        for name in [given.reader] if given.reader else list(readers(Path(place) / "seeds")):
            total: Counter[str] = Counter(inputs=given.inputs, crash=0, hang=0, wrong=0)
            slowest, peak, found = 0.0, 0, []
            for first in range(0, given.inputs, _BATCH):
                ours, theirs = context.Pipe(duplex=False)
                count = min(_BATCH, given.inputs - first)
                process = context.Process(target=work, args=(name, given.seed, first, count, place, theirs))
                process.start()
                theirs.close()
                try:
                    said, wrong, longest, memory = ours.recv()
                    total.update(said)
                    found += wrong
                    slowest, peak = max(slowest, longest), max(peak, memory)
                except EOFError:
                    process.join()
                    total["crash"] += 1
                    kept = Path(f"crash-{name.replace(' ', '-')}-{first}")
                    under_way = Path(place) / f"{name}-{first}" / "under way"
                    held = under_way.is_file()  # else it died before its first input
                    if held:
                        kept.write_bytes(under_way.read_bytes())
                    where = f", its input is in {kept}" if held else " before its first input"
                    found.append((first, f"died with {process.exitcode}{where}"))
                process.join()
            counts[name] = {**total, "slowest_s": round(slowest, 2), "peak_mb": peak // 1024, "found": found[:20]}
            print(name, json.dumps({k: v for k, v in counts[name].items() if k != "found"}), flush=True)
            for number, text in found[:5]:
                print("   ", number, text, flush=True)
    if given.out:
        given.out.write_text(json.dumps(counts, indent=1) + "\n")
    return int(any(one["crash"] or one["hang"] or one["wrong"] for one in counts.values()))


if __name__ == "__main__":
    sys.exit(main())
