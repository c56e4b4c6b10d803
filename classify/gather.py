"""Synthetic records to model inputs: streamed, several processes at a time, nothing kept of the samples themselves."""

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context, parent_process

import numpy as np
from bladewing.features import INPUT_SHAPES, model_inputs
from bladewing.simulate import stream
from bladewing.simulate.dataset import RADAR_GROUP
from numpy.typing import NDArray

#: Records of one task: whole radar groups, so that no record is drawn twice.
TASK_RECORDS = 10 * RADAR_GROUP

#: Inputs kept as float16 until a batch needs them: dB values of at most 120 keep 0.06 dB.
_COMPACT = ("spectrum", "image")


@dataclass(frozen=True)
class Gathered:
    """Model inputs of many records, with their labels and the truth.

    Parameters
    ----------
    inputs : dict of str to ndarray
        Name to array (records, *shape); float16 for spectra and images, float32 for vectors of measurements.
    labels : ndarray of int, shape (records,)
        Index in ("uav", "bird", "clutter").
    truth : dict of str to ndarray, each of shape (records,)
        The simulator's truth, and the radar: "carrier_hz", "prf_hz", "pulses".
    """

    inputs: dict[str, NDArray]
    labels: NDArray[np.int64]
    truth: dict[str, NDArray]

    def __len__(self) -> int:
        return len(self.labels)


def workers_at_hand() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def gather(
    seed: int,
    purpose: str,
    count: int,
    *,
    names: Sequence[str] = tuple(INPUT_SHAPES),
    workers: int | None = None,
    on_records: Callable[[int], None] | None = None,
) -> Gathered:
    """Draw `count` records of a purpose and turn them into model inputs.

    Parameters
    ----------
    seed, purpose, count
        As in `bladewing.simulate.stream`.
    names : sequence of str
        Inputs to compute, see `bladewing.features.INPUT_SHAPES`.
    workers : int, optional
        Processes; by default one a processor. 1 works in this process. The result does not depend on it.
    on_records : callable, optional
        Called with the number of records of each finished task.

    Returns
    -------
    Gathered
    """
    workers = workers_at_hand() if workers is None else workers
    tasks = [(seed, purpose, at, min(TASK_RECORDS, count - at), tuple(names)) for at in range(0, count, TASK_RECORDS)]
    parts = []
    for part in _finished(tasks, workers):
        parts.append(part)
        if on_records:
            on_records(len(part))
    return Gathered(
        {name: np.concatenate([p.inputs[name] for p in parts]) for name in names},
        np.concatenate([p.labels for p in parts]),
        {name: np.concatenate([p.truth[name] for p in parts]) for name in parts[0].truth},
    )


Task = tuple[int, str, int, int, tuple[str, ...]]


def _finished(tasks: list[Task], workers: int) -> Iterator[Gathered]:
    """Results in the order of the tasks, with at most a few tasks a worker under way."""
    if workers < 2 or len(tasks) < 2:
        yield from map(_gather_task, tasks)
        return
    # spawn, not fork: a fork of a process with threads (torch, onnxruntime) may hang
    pool_of = partial(ProcessPoolExecutor, mp_context=get_context("spawn"), initializer=_end_with_parent)
    with pool_of(min(workers, len(tasks))) as pool:
        waiting: list[Future[Gathered]] = []
        try:
            for task in tasks:
                waiting.append(pool.submit(_gather_task, task))
                if len(waiting) >= 3 * workers:
                    yield waiting.pop(0).result()
            while waiting:
                yield waiting.pop(0).result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _end_with_parent() -> None:
    """Watch the parent: a worker whose parent was killed would wait for work for ever."""
    parent = parent_process()
    if parent is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()


def _gather_task(task: Task) -> Gathered:
    """Inputs of one run of consecutive records."""
    seed, purpose, start, count, names = task
    inputs: dict[str, list[NDArray]] = {name: [] for name in names}
    labels, truths = [], []
    for records in stream(seed, purpose, count, start=start):
        radar = records.radar
        computed = model_inputs(records.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=names)
        for name in names:
            inputs[name].append(computed[name].astype(np.float16 if name in _COMPACT else np.float32))
        labels.append(records.label_indices)
        given = {"carrier_hz": radar.carrier_hz, "prf_hz": radar.prf_hz, "pulses": radar.pulses}
        truths.append(records.truth | {name: np.full(len(records), value) for name, value in given.items()})
    return Gathered(
        {name: np.concatenate(values) for name, values in inputs.items()},
        np.concatenate(labels),
        {name: np.concatenate([truth[name] for truth in truths]) for name in truths[0]},
    )
