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

#: Growth of the process that may come of the allocator, once it has warmed up [MB].
FLAT_MB = 20


def resident_mb() -> float:
    """Memory that this process holds now [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def main() -> int:
    """Run and print what memory did; 1 where it grew."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--predictions", type=int, default=1_000_000)
    arguments.add_argument("--batch", type=int, default=64)
    given = arguments.parse_args()
    rng = np.random.default_rng(0)
    classifier = Classifier.load()
    # lengths and radars change, so that what is kept of each (windows, axes) is tried too
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
