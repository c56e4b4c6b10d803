"""Progress where stderr is no terminal: a line every half minute, with the time to go."""

import pytest
from bladewing.classify import progress as module
from bladewing.classify.progress import Progress


@pytest.fixture
def lines(monkeypatch):
    """Tell of 100 steps at given times [s] after the start; give the lines that were said."""

    def said(*steps: tuple[float, float]) -> list[str]:
        now, found = [0.0], []
        monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
        monkeypatch.setattr(Progress, "say", lambda _, text: found.append(text))
        with Progress(visible=True) as bars, bars.phase("work", 100) as on_done:
            for at_s, done in steps:
                now[0] = at_s
                on_done(done)
        return found

    return said


def test_the_time_to_go_is_that_of_the_pace_so_far(lines):
    assert lines((40, 10), (80, 20)) == ["work: 10%, 360 s to go", "work: 20%, 320 s to go", "work: done in 80 s"]


def test_what_an_interrupted_run_left_is_no_pace(lines):
    """Sixty percent are found done in a moment; after that ten take forty seconds."""
    assert lines((31, 60), (71, 70), (111, 80))[1:] == [
        "work: 70%, 120 s to go",
        "work: 80%, 80 s to go",
        "work: done in 111 s",
    ]


def test_nothing_new_is_no_line(lines):
    assert lines((40, 10), (80, 10), (120, 20)) == [
        "work: 10%, 360 s to go",
        "work: 20%, 640 s to go",
        "work: done in 120 s",
    ]
