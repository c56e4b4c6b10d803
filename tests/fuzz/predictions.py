"""A million predictions in one process: memory must stay flat.

python -m tests.fuzz.predictions [--predictions 1000000] [--batch 64]
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from bladewing.classify import Classifier

#: Allowed growth of the process's memory after the first tenth, which the allocator may cause [MB].
FLAT_MB = 20


def resident_mb() -> float:
    """Give the resident memory of this process now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def main() -> int:
    """Run and print the memory held; 1 if it grew by more than `FLAT_MB`."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--predictions", type=int, default=1_000_000)
    arguments.add_argument("--batch", type=int, default=64)
    given = arguments.parse_args()
    rng = np.random.default_rng(0)
    classifier = Classifier.load()
    # Lengths and radars change, so that the caches for each (windows, axes) are tried too.
    shapes = [(pulses, prf_hz) for pulses in (256, 300, 509, 512) for prf_hz in (20e3, 25e3, 30e3)]
    pools = {n: rng.normal(size=(given.batch, n, 2)).astype(np.float32).view(np.complex64)[..., 0] for n, _ in shapes}
    done, started, first, seen = 0, time.perf_counter(), 0.0, []
    while done < given.predictions:
        pulses, prf_hz = shapes[done // given.batch % len(shapes)]
        carrier_hz = 9e9 + (done // given.batch) % 997 * 1e6  # a new radar nearly every time
        answer = classifier.predict(
            pools[pulses] * np.float32(rng.uniform(0.5, 2)), carrier_hz=carrier_hz, prf_hz=prf_hz
        )
        done += len(answer.labels)
        if done % (given.batch * 200) < given.batch:
            seen.append(round(resident_mb(), 1))
        if not first and done > given.predictions // 10:
            first = resident_mb()
    last = resident_mb()
    seconds = round(time.perf_counter() - started, 1)
    print(
        json.dumps(
            {"predictions": done, "seconds": seconds, "mb_at_tenth": round(first, 1), "mb_at_end": round(last, 1)}
        )
    )
    return int(last - first > FLAT_MB)


if __name__ == "__main__":
    sys.exit(main())
