"""Tasks done on several processes, their results in order; Ctrl-C or the death of the parent ends all processes.

Where processes cannot be started, or are lost, the tasks are done in this process.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from typing import Any, TypeVar

from bladewing.features.one_thread import one_thread

Task = TypeVar("Task")
Done = TypeVar("Done")


def workers_at_hand() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_order(work: Callable[[Task], Done], tasks: Sequence[Task], workers: int | None = None) -> Iterator[Done]:
    """Do tasks on several processes; yield the results in the order of the tasks, a few of them under way a worker.

    Parameters
    ----------
    work, tasks
        What to do with each; both must be picklable.
    workers : int, optional
        Processes; by default one a processor. With 1 the tasks are done in this process, as are those that workers
        cannot do: where processes, memory or semaphores are short, in a worker of another pool, or once one is killed.
    """
    workers = workers_at_hand() if workers is None else workers
    done = 0
    if workers > 1 and len(tasks) > 1:
        with suppress(_NoWorkersError):
            for result in _by_workers(work, tasks, workers):
                yield result
                done += 1
    yield from map(work, tasks[done:])


class _NoWorkersError(Exception):
    """Workers cannot be had, or were lost."""


def _by_workers(work: Callable[[Task], Done], tasks: Sequence[Task], workers: int) -> Iterator[Done]:
    """Do tasks on several processes; what the work itself raises is raised here."""
    # spawn, not fork: a fork of a process with threads (torch, onnxruntime) may hang
    others = set(active_children())
    with _told_apart():
        pool_of = partial(ProcessPoolExecutor, mp_context=get_context("spawn"), initializer=_begin)
        pool = pool_of(min(workers, len(tasks)))
    with pool:
        waiting: list[Future[Done]] = []
        try:
            for task in tasks:
                with _told_apart(), _deaf_children(), _without_main():
                    waiting.append(pool.submit(work, task))
                if len(waiting) >= 3 * workers:
                    yield _result(waiting.pop(0))
            while waiting:
                yield _result(waiting.pop(0))
        except BaseException:
            answers = getattr(pool, "_result_queue", None)
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in set(active_children()) - others:  # else the tasks that they have begun are waited for
                worker.terminate()
            _written_no_more(answers)
            raise


@contextmanager
def _told_apart() -> Iterator[None]:
    """Turn errors of starting a worker into `_NoWorkersError`; no work runs within, so that its errors stay apart."""
    try:
        yield
    except (OSError, RuntimeError, AssertionError) as error:  # AssertionError: from a daemonic process
        raise _NoWorkersError from error


def _written_no_more(answers: Any) -> None:
    """Close this process's end for writing of the queue by which workers answer.

    One that was ended as it wrote leaves half an answer. The pool's own thread waits for the rest, and this process for
    that thread, as long as anybody could write it.
    """
    with suppress(AttributeError, OSError):  # a pool that is built in another way has no such queue
        answers._writer.close()


def _result(asked: Future[Done]) -> Done:
    """What the work gives or raises."""
    try:
        return asked.result()
    except BrokenExecutor as error:
        raise _NoWorkersError from error


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes started within never get Ctrl-C, which a terminal sends to all: they end with their parent.

    In the parent it is held back, not ignored: it arrives right after the context.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started before: its start would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _without_main() -> Iterator[None]:
    """Processes started within do not run the caller's script again: their work needs nothing of it.

    Otherwise they would run it to find objects pickled by a name in it, with all of it that no guard excludes.
    """
    names = vars(sys.modules["__main__"])
    kept: dict[str, Any] = {name: names[name] for name in ("__spec__", "__file__") if name in names}
    names["__spec__"], names["__file__"] = None, None
    try:
        yield
    finally:
        for name in ("__spec__", "__file__"):
            names.pop(name)
        names.update(kept)


def _begin() -> None:
    """Begin as a worker: on one thread, and watching the parent.

    There are as many workers as processors; with several threads each they draw two thirds as many records. Unwatched,
    a worker whose parent was killed would wait for work for ever.
    """
    one_thread.__enter__()
    parent = parent_process()
    if parent is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()
