"""Peak memory of an answer, measured in a process of its own."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def peak_bytes(work: Callable[..., Callable[[], object]], *arguments: Any) -> int | None:
    """Measure how far a fresh process's memory rises above what its libraries take.

    Parameters
    ----------
    work : callable
        Importable. It is called with the arguments in the fresh process, prepares (opens the model) and returns the
        function that answers, which is then called once.
    *arguments
        Passed on.

    Returns
    -------
    int or None
        Rise of the resident memory at its peak [byte]; None where the system does not report it (not Linux).
    """
    if not (sys.platform == "linux" and _CLEAR.exists()):
        return None
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_measure, work, arguments).result()


def _measure(work: Callable[..., Callable[[], object]], arguments: tuple[Any, ...]) -> int | None:
    """Measure the rise in this process."""
    import bladewing.models.runtime  # noqa: F401
    import scipy.fft  # noqa: F401

    before = _resident("VmRSS")
    try:
        _CLEAR.write_text("5")  # resets the kernel's peak (VmHWM)
    except OSError:
        return None
    work(*arguments)()
    return max(0, _resident("VmHWM") - before)


def _resident(field: str) -> int:
    for line in _STATUS.read_text().splitlines():
        if line.startswith(field + ":"):
            return 1024 * int(line.split()[1])
    raise OSError(f"{_STATUS} has no {field}")
