import operator
import os
import subprocess
import sys
import threading
import time
from functools import partial
from multiprocessing import get_context, parent_process
from pathlib import Path

import pytest
from bladewing.classify import workers as module
from bladewing.classify.workers import in_order, workers_at_hand
from threadpoolctl import threadpool_info


@pytest.mark.skipif(workers_at_hand() == 1, reason="on one processor nothing has more threads")
def test_a_worker_computes_on_one_thread():
    for libraries in in_order(operator.call, [threadpool_info] * 2, workers=2):
        threads = [library["num_threads"] for library in libraries if library["user_api"] == "blas"]
        assert threads
        assert set(threads) == {1}


def test_a_worker_of_the_caller_s_own_outlives_tasks_that_are_given_up():
    own = get_context("spawn").Process(target=time.sleep, args=(30,))
    own.start()
    try:
        tasks = in_order(abs, [-1, -2, -3, -4], workers=2)
        assert next(tasks) == 1
        tasks.close()
        assert own.is_alive()
    finally:
        own.terminate()
        own.join()


class Large:
    """An answer that takes some tenths of a second to be written; tells when it begins."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def __reduce__(self) -> tuple:
        content = bytes(1 << 28)
        self.place.touch()
        return bytes, (content,)


def _large(place: Path | None) -> Large | None:
    return Large(place) if place else None


def _read_bytes() -> int:
    """How much this process has read so far."""
    return int(Path("/proc/self/io").read_text().split()[1])  # "rchar: N"


@pytest.mark.skipif(not Path("/proc/self/io").exists(), reason="no system that tells what a process has read")
def test_workers_that_are_ended_as_they_answer_leave_nothing_that_waits(tmp_path):
    before, place = set(threading.enumerate()), tmp_path / "worker"
    answers = in_order(_large, [None, place, None], workers=2)
    next(answers)
    while not place.exists():
        time.sleep(0.001)
    begun, ends = _read_bytes(), time.monotonic() + 60
    while _read_bytes() < begun + (1 << 22) and time.monotonic() < ends:
        time.sleep(0.0005)
    answers.close()
    assert _read_bytes() < begun + (1 << 28), "the answer was there already"
    for thread in set(threading.enumerate()) - before:
        thread.join(timeout=30)
        assert not thread.is_alive(), thread.name


UNGUARDED = """
from bladewing.classify.workers import in_order

print(list(in_order(abs, [-1, -2, -3], workers=2)), __file__[-9:], __spec__)
"""


def test_workers_do_not_run_a_script_again_that_has_no_guard(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.stderr, done.returncode) == ("[1, 2, 3] script.py None\n", "", 0)


def _killed_once(place: Path, number: int) -> tuple[int, bool]:
    """Give the number and whether a worker did it; the worker that meets 3 first dies of it."""
    if number == 3 and not place.exists():
        place.touch()
        os._exit(9)
    return number, parent_process() is not None


def test_what_a_killed_worker_leaves_undone_is_done_without_workers(tmp_path):
    found = list(in_order(partial(_killed_once, tmp_path / "met"), range(12), workers=2))
    assert [number for number, _ in found] == list(range(12))
    assert (tmp_path / "met").exists()
    assert not found[-1][1]


@pytest.mark.parametrize(
    "error", [OSError("no semaphores"), RuntimeError("no new threads"), NotImplementedError("no semaphores")]
)
def test_where_no_pool_can_be_had_the_tasks_are_done_without(monkeypatch, error):
    def refused(*_, **__):
        raise error

    monkeypatch.setattr(module, "ProcessPoolExecutor", refused)
    assert list(in_order(abs, [-1, -2, -3], workers=2)) == [1, 2, 3]


def test_where_no_worker_starts_the_tasks_are_done_without(monkeypatch):
    def refused(*_):
        raise OSError("no more processes")

    monkeypatch.setattr(module.ProcessPoolExecutor, "submit", refused)
    assert list(in_order(abs, [-1, -2, -3], workers=2)) == [1, 2, 3]


def _as_told(tasks: list[int]) -> list[int]:
    return list(in_order(abs, tasks, workers=2))


def test_a_worker_of_another_pool_does_the_tasks_itself():
    with get_context("spawn").Pool(1) as pool:  # its workers are daemonic, and may have no children
        assert pool.apply(_as_told, ([-1, -2, -3],)) == [1, 2, 3]


def _fails(error: Exception) -> None:
    raise error


@pytest.mark.parametrize("error", [OSError("of the work"), RuntimeError("of the work"), AssertionError("of the work")])
def test_what_the_work_raises_is_raised_once(error):
    with pytest.raises(type(error), match="of the work"):
        list(in_order(_fails, [error, error, error], workers=2))
