"""Linear algebra on one thread: products of some hundred lines take longer on several, which wait for one another."""

from contextlib import AbstractContextManager
from functools import lru_cache
from typing import Any


@lru_cache(maxsize=1)
def _libraries() -> Any:
    """The libraries for linear algebra of this process; to look for them takes milliseconds."""
    import scipy.linalg  # noqa: F401  its library is another than NumPy's, and must be there to be found
    from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """Hold NumPy's and scipy's linear algebra to one thread within a `with`, for the whole process.

    With as many threads as processors, which is what both take by themselves, fitting combs takes three to sixteen
    times as long on two processors, the longer the busier they are.
    """
    return _libraries().limit(limits=1, user_api="blas")
