"""Settings of the whole test run."""

import os

from hypothesis import HealthCheck, settings

# One thread each: the tests' models are tiny, and threads that wait for a core cost more than they bring.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# What commands print is wrapped to the terminal, and workers of a test run have none.
os.environ["COLUMNS"] = "120"

# Machines are shared: how long an example takes says nothing. Where CI is set every run draws the same examples, so
# that a change is judged by what it changed; elsewhere each run looks for new ones.
settings.register_profile(
    "shared",
    deadline=None,
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("shared")


def pytest_make_parametrize_id(config, val):
    """Name bytes by their number: some hold the time (MATLAB's headers), and workers must collect the same names."""
    return f"{len(val)} bytes" if isinstance(val, bytes) else None
