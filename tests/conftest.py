"""Settings of the whole test run."""

import os

# One thread each: the tests' models are tiny, and threads that wait for a core cost more than they bring.
os.environ.setdefault("OMP_NUM_THREADS", "1")
