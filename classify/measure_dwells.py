"""Measures the dwells of one recording: in this process, and on all processors where that would take long."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from bladewing.features.measure import measure
from bladewing.features.measurements import Measurements
from numpy.typing import NDArray

from .workers import in_order

#: ALONE_S: for this long dwells are measured in this process [s]. If the rest would take it longer than that again,
#: which is what workers need to begin, workers share the rest. TASK_S: about the length of a worker's task [s].
ALONE_S, TASK_S = 1.0, 0.5


def measure_dwells(iq: NDArray[np.complex64], *, on_record: Callable[[float], None], **given: Any) -> Measurements:
    """Measure each dwell of a recording.

    A dwell's measurements are the same, to the bit, whatever process makes them and whatever others stand beside it.

    Parameters
    ----------
    iq : ndarray, shape (dwells, pulses)
        At least one.
    on_record : callable
        Called with the number of dwells that are done, as they are.
    **given
        Arguments of `measure`: the radar, the blades and beta.

    Returns
    -------
    Measurements
        Of all dwells, in their order.

    Raises
    ------
    ValueError
        As for `measure`.
    """
    work: Callable[[NDArray[np.complex64]], Measurements] = partial(measure, **given)
    started, runs, done = time.perf_counter(), [], 0
    while done < len(iq) and time.perf_counter() - started < ALONE_S:
        runs.append(work(iq[done : done + 1]))
        done += 1
        on_record(done)
    each_s = (time.perf_counter() - started) / done
    some = max(1, round(TASK_S / max(each_s, 1e-6)))
    shared = (len(iq) - done) * each_s > ALONE_S
    tasks = [iq[first : first + some] for first in range(done, len(iq), some)]
    for run in in_order(work, tasks, None if shared else 1):
        runs.append(run)
        done += len(run.reason)
        on_record(done)
    return Measurements.joined(runs)
