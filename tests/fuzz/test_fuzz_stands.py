"""Quick checks that `make fuzz` still works: it takes an hour and runs too seldom for its own faults to be noticed."""

from pathlib import Path

import numpy as np
import pytest

from .faults import Bench
from .mutations import MUTATIONS, ROOT


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.guard)
def test_a_guard_to_be_broken_stands_once(mutation):
    assert (ROOT / mutation.file).read_text().count(mutation.old) == 1
    assert (ROOT / mutation.tests.split()[0]).is_file()


def test_the_commands_that_are_killed_run_to_their_end(tmp_path: Path):
    bench = Bench(tmp_path, 1, np.random.default_rng(0))
    found = bench.report()
    assert (found["kills"], found["lost"], found["litter"]) == (1, 0, 0)
