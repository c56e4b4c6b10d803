"""Linear algebra on one thread: products of some hundred lines take longer on several, which wait for one another."""

from functools import lru_cache
from threading import Lock
from types import TracebackType
from typing import Any


@lru_cache(maxsize=1)
def _libraries() -> Any:
    """The libraries for linear algebra of this process, kept, because finding them takes milliseconds."""
    import scipy.linalg  # noqa: F401  it has a library of its own, which is found only once loaded
    from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

    return ThreadpoolController()


def _give_up() -> None:
    """Let any thread set the limit: otherwise threadpoolctl obeys only the thread that set the first."""
    from threadpoolctl import OpenBLASController

    OpenBLASController.clear_controlling_thread(force=True)


class _OneThread:
    """Limit to one thread while anyone is inside: the first to enter sets it, the last to leave removes it."""

    def __init__(self) -> None:
        self._lock, self._inside, self._limit = Lock(), 0, None

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                libraries = _libraries()
                _give_up()
                self._limit = libraries.limit(limits=1, user_api="blas")
            self._inside += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                _give_up()
                self._limit.restore_original_limits()  # type: ignore[attr-defined]
                _give_up()


#: Hold NumPy's and scipy's linear algebra to one thread within a `with`, for the whole process. With as many threads as
#: processors, which is what both take by themselves, fitting combs takes three to sixteen times as long on two
#: processors, the longer the busier they are.
one_thread = _OneThread()
