"""Run benchmarks on one thread and print their tables at the end."""

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits

from .ratios import FOLDER, PRINTED


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> Iterator[None]:
    with threadpool_limits(1):
        yield


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if PRINTED:
        terminalreporter.section(f"ratios within this run, also in {FOLDER}")
        for line in PRINTED:
            terminalreporter.write_line(line)
