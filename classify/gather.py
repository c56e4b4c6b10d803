"""Synthetic records to model inputs: streamed, several processes at a time, nothing kept of the samples themselves."""

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from typing import TypeVar

import numpy as np
from bladewing.features import INPUT_SHAPES, model_inputs
from bladewing.simulate import stream
from bladewing.simulate.dataset import RADAR_GROUP, Records
from numpy.typing import NDArray

#: Records of one task: whole radar groups, so that no record is drawn twice.
TASK_RECORDS = 10 * RADAR_GROUP

#: Inputs kept as float16 until a batch needs them: dB values of at most 120 keep 0.06 dB.
_COMPACT = ("levels", "spectrum", "cadence", "image")


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
    sources = [
        partial(stream, seed, purpose, min(TASK_RECORDS, count - at), start=at) for at in range(0, count, TASK_RECORDS)
    ]
    return gather_from(sources, names=names, workers=workers, on_records=on_records)


def gather_from(
    sources: Sequence[Callable[[], Iterable[Records]]],
    *,
    names: Sequence[str],
    workers: int | None = None,
    on_records: Callable[[int], None] | None = None,
) -> Gathered:
    """Turn records into model inputs, wherever they come from.

    Parameters
    ----------
    sources : sequence of callable
        Each gives a run of consecutive records when it is called, in any process; at least one.
    names, workers, on_records
        As in `gather`.

    Returns
    -------
    Gathered
    """
    parts = []
    for part in in_order(partial(_inputs_of, tuple(names)), sources, workers):
        parts.append(part)
        if on_records:
            on_records(len(part))
    return Gathered(
        {name: np.concatenate([p.inputs[name] for p in parts]) for name in names},
        np.concatenate([p.labels for p in parts]),
        {name: np.concatenate([p.truth[name] for p in parts]) for name in parts[0].truth},
    )


Task = TypeVar("Task")
Done = TypeVar("Done")


def in_order(work: Callable[[Task], Done], tasks: Sequence[Task], workers: int | None = None) -> Iterator[Done]:
    """Do tasks on several processes; give the results in the order of the tasks, a few a worker under way.

    Parameters
    ----------
    work, tasks
        What to do with each; both must travel to another process.
    workers : int, optional
        Processes; by default one a processor. 1 works in this process.
    """
    workers = workers_at_hand() if workers is None else workers
    if workers < 2 or len(tasks) < 2:
        yield from map(work, tasks)
        return
    # spawn, not fork: a fork of a process with threads (torch, onnxruntime) may hang
    pool_of = partial(ProcessPoolExecutor, mp_context=get_context("spawn"), initializer=_end_with_parent)
    with pool_of(min(workers, len(tasks))) as pool:
        waiting: list[Future[Done]] = []
        try:
            for task in tasks:
                with _deaf_children():
                    waiting.append(pool.submit(work, task))
                if len(waiting) >= 3 * workers:
                    yield waiting.pop(0).result()
            while waiting:
                yield waiting.pop(0).result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in active_children():  # else what they have begun is waited for
                worker.terminate()
            raise


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes started within never hear of Ctrl-C, which a terminal sends to all: they end with their parent.

    It is held back, not ignored: the parent hears of it right after.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # whose own start would let it through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """Watch the parent: a worker whose parent was killed would wait for work for ever."""
    parent = parent_process()
    if parent is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()


def _inputs_of(names: tuple[str, ...], source: Callable[[], Iterable[Records]]) -> Gathered:
    """Inputs of one run of consecutive records."""
    inputs: dict[str, list[NDArray]] = {name: [] for name in names}
    labels, truths = [], []
    for records in source():
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
