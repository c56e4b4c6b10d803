"""Timing several pieces of work against one another: in turns, so that a disturbance meets them all alike."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Work = Callable[[], object]
Name = TypeVar("Name", bound=Hashable)


@contextmanager
def undisturbed() -> Iterator[None]:
    """One thread for the numerical libraries and no garbage collection while timing."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        if collecting:
            gc.enable()


@dataclass(frozen=True)
class Laps:
    """Durations of one piece of work, one a round.

    Attributes
    ----------
    worked_s : list of float
        Time that the thread worked [s]: what waiting for a busy machine adds is not in it.
    passed_s : list of float
        Time that passed [s].
    """

    worked_s: list[float]
    passed_s: list[float]


def time_in_turns(
    works: Mapping[Name, Work],
    *,
    seconds: float,
    least_rounds: int,
    most_rounds: int,
    on_share: Callable[[float], None] | None = None,
) -> dict[Name, Laps]:
    """Time every piece of work once a round, round after round.

    Parameters
    ----------
    works : mapping to callable
        Called without arguments; each is called twice unmeasured first. It must work in the calling thread alone.
    seconds : float
        Time to spend [s], > 0; kept to unless ``least_rounds`` take longer.
    least_rounds, most_rounds : int
        Bounds on the number of rounds, 1 <= least <= most.
    on_share : callable, optional
        Called after every round with the share done, 0 to 1.

    Returns
    -------
    dict
        The laps of each piece, in the order of the rounds.
    """
    for work in works.values():
        work()
        work()
    taken = {name: Laps([], []) for name in works}
    clock = _thread_clock()
    with undisturbed():
        start = time.perf_counter()
        for number in range(1, most_rounds + 1):
            for name, work in works.items():
                passed, worked = time.perf_counter_ns(), clock()
                work()
                worked, passed = clock() - worked, time.perf_counter_ns() - passed
                taken[name].worked_s.append(worked * 1e-9)
                taken[name].passed_s.append(passed * 1e-9)
            spent = time.perf_counter() - start
            if on_share is not None:
                on_share(min(1.0, max(min(spent / seconds, number / least_rounds), number / most_rounds)))
            if spent >= seconds and number >= least_rounds:
                break
    return taken


def _thread_clock() -> Callable[[], int]:
    """The thread's own clock [ns]; where that is too coarse (Windows: 16 ms) the wall clock."""
    fine = time.get_clock_info("thread_time").resolution <= 1e-6
    return time.thread_time_ns if fine else time.perf_counter_ns


def typical(laps: Sequence[float] | NDArray[np.floating], turns: int) -> float:
    """Median of laps; if `turns` pieces took turns, the mean of their medians: some may cost twice what others do.

    Parameters
    ----------
    laps : sequence of float
        In the order of the rounds.
    turns : int
        Number of pieces that took turns.
    """
    return float(np.mean([np.median(laps[piece::turns]) for piece in range(min(turns, len(laps)))]))


def quote(laps: Laps, *, per: int = 1, turns: int = 1) -> dict[str, Any]:
    """Typical time and 99th percentile in microseconds a record.

    Parameters
    ----------
    laps : Laps
    per : int
        Records handled in one lap.
    turns : int
        As in `typical`.

    Returns
    -------
    dict
        ``median_us`` (see `typical`) and ``p99_us`` of the time worked, ``passed_us`` of the time that passed and
        ``rounds``. With fewer than 100 rounds the 99th percentile lies between the two slowest.
    """
    worked_us = np.asarray(laps.worked_s) / per * 1e6
    passed_us = np.asarray(laps.passed_s) / per * 1e6
    return {
        "median_us": typical(worked_us, turns),
        "p99_us": float(np.percentile(worked_us, 99)),
        "passed_us": typical(passed_us, turns),
        "rounds": len(laps.worked_s),
    }


def ratio(laps: Laps, base: Laps, *, turns: int = 1) -> dict[str, float]:
    """How many times longer one piece of work takes than another of the same rounds.

    Parameters
    ----------
    laps, base : Laps
        From one call of `time_in_turns`.
    turns : int
        As in `typical`.

    Returns
    -------
    dict
        ``ratio_to_fft`` (of the typical times), ``ratio_low`` and ``ratio_high``: the ratios of the single rounds from
        which a tenth lies below and a tenth above.
    """
    worked, bare = np.asarray(laps.worked_s), np.asarray(base.worked_s)
    low, high = np.quantile(worked / bare, (0.1, 0.9))
    middle = typical(worked, turns) / typical(bare, turns)
    # of one round, or a narrow spread, the ratio of typical times may lie outside the quantiles
    return {"ratio_to_fft": middle, "ratio_low": min(float(low), middle), "ratio_high": max(float(high), middle)}
