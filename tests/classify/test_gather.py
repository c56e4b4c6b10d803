import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from bladewing.classify import gather as gather_module
from bladewing.classify.errors import BadInput
from bladewing.classify.gather import gather, inputs_digest
from bladewing.classify.parts import Parts
from bladewing.features import INPUT_SHAPES, model_inputs
from bladewing.simulate import stream


def test_inputs_do_not_depend_on_the_workers(monkeypatch):
    monkeypatch.setattr(gather_module, "TASK_RECORDS", gather_module.RADAR_GROUP)
    one = gather(5, "train", 60, workers=1)
    two = gather(5, "train", 60, workers=2)
    assert len(one) == len(two) == 60
    for name, shape in INPUT_SHAPES.items():
        assert one.inputs[name].shape == (60, *shape)
        np.testing.assert_array_equal(one.inputs[name], two.inputs[name])
    np.testing.assert_array_equal(one.labels, np.arange(60) % 3)
    np.testing.assert_array_equal(one.truth["kind"], two.truth["kind"])


def test_measurements_are_kept_to_the_bit_and_levels_to_hundredths_of_a_decibel():
    """Half precision would round a speed of 300 m/s to a quarter."""
    names = ("features", "levels")
    found = gather(3, "bench", 48, names=names, workers=1).inputs
    radars = [(r.iq, {"carrier_hz": r.radar.carrier_hz, "prf_hz": r.radar.prf_hz}) for r in stream(3, "bench", 48)]
    made = [model_inputs(iq, **radar, names=names) for iq, radar in radars]
    features, levels = (np.concatenate([inputs[name] for inputs in made]) for name in names)
    np.testing.assert_array_equal(found["features"], features)
    np.testing.assert_allclose(found["levels"], levels, rtol=0, atol=0.035)


def test_other_measurements_have_another_digest(monkeypatch):
    from bladewing.features import cadence

    inputs_digest.cache_clear()
    before = inputs_digest()
    inputs_digest.cache_clear()
    assert inputs_digest() == before
    monkeypatch.setattr(cadence, "CLIP", 0.9 * cadence.CLIP)
    inputs_digest.cache_clear()
    changed = inputs_digest()
    inputs_digest.cache_clear()
    assert changed != before


def test_a_longer_set_begins_with_the_shorter_one():
    short, long = (gather(1, "validate", count, names=("features",), workers=1) for count in (30, 70))
    np.testing.assert_array_equal(long.inputs["features"][:30], short.inputs["features"])


def test_sets_of_different_purposes_share_no_scene():
    # Records of one scene never stand on both sides of a split: no row, and no radar, appears twice.
    sets = [
        gather(0, purpose, 96, names=("features",), workers=1) for purpose in ("train", "validate", "calibrate", "test")
    ]
    rows = np.concatenate([s.inputs["features"] for s in sets])
    assert len(np.unique(rows, axis=0)) == len(rows)
    radars = [set(s.truth["carrier_hz"]) for s in sets]
    assert len(set.union(*radars)) == sum(map(len, radars))


def test_progress_counts_every_record():
    seen = []
    gather(0, "test", 50, names=("features",), workers=1, on_records=seen.append)
    assert sum(seen) == 50


class StoppedError(Exception):
    pass


# Nine tasks of 48, the last one shorter.
COUNT = 430


@pytest.fixture(scope="module")
def whole():
    """That run without an interruption, and in tasks of another size."""
    return gather(3, "train", COUNT, names=("features", "levels"), workers=1)


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """What a run of `COUNT` records left that was stopped after seven of its tasks of 48, kept three at a time."""
    monkeypatch.setattr(gather_module, "TASK_RECORDS", 48)
    monkeypatch.setattr(gather_module, "KEPT_TASKS", 3)
    parts = Parts(tmp_path / "parts", {"seed": 3})
    seen = []

    def stop(count):
        seen.append(count)
        if len(seen) == 7:
            raise StoppedError

    with pytest.raises(StoppedError):
        gather(3, "train", COUNT, names=("features", "levels"), workers=1, on_records=stop, parts=parts)
    return parts


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interrupted_drawing_goes_on_to_the_same_bits(interrupted, whole, monkeypatch, workers):
    drawn, seen = [], []
    if workers == 1:  # another process would not see the patch
        real = gather_module.stream
        monkeypatch.setattr(gather_module, "stream", lambda *a, start: drawn.append(start) or real(*a, start=start))
    resumed = gather(
        3, "train", COUNT, names=("features", "levels"), workers=workers, on_records=seen.append, parts=interrupted
    )
    if workers == 1:
        assert sorted(drawn) == [6 * 48, 7 * 48, 8 * 48]  # six tasks were kept, the seventh not
    assert sum(seen) == COUNT
    assert resumed.arrays().keys() == whole.arrays().keys()
    for name, array in whole.arrays().items():
        np.testing.assert_array_equal(resumed.arrays()[name], array)
        assert resumed.arrays()[name].dtype == array.dtype


def test_drawn_records_of_other_inputs_are_refused(interrupted):
    with pytest.raises(BadInput, match=r"drawn-train-00000\.npz: not what this run kept"):
        gather(3, "train", COUNT, names=("features", "cadence"), workers=1, parts=interrupted)


ORPHAN = """

from bladewing.classify import gather
if __name__ == "__main__":
    said = lambda count: print("under way", flush=True)
    gather.gather(0, "train", 24_000, names=("features",), workers=2, on_records=said)
"""


def test_workers_end_with_a_killed_parent(tmp_path):
    script = tmp_path / "orphan.py"
    script.write_text(ORPHAN)
    parent = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert parent.stdout is not None
    assert parent.stdout.readline() == "under way\n"
    parent.kill()
    parent.stdout.close()
    parent.wait()
    require_ended(parent.pid)


def require_ended(group: int) -> None:
    """Fail where processes of a group live on for a minute, and end them."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.2)
    os.killpg(group, signal.SIGKILL)
    pytest.fail("workers outlived their parent")


INTERRUPTED = """
import os, signal, threading

from bladewing.classify import gather
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where a shell runs it behind
    # to all of its group, as a terminal sends it: while the workers import, which takes them a second
    threading.Timer(0.3, os.killpg, (0, signal.SIGINT)).start()
    try:
        gather.gather(0, "train", 24_000, names=("features",), workers=2)
    except KeyboardInterrupt:
        print("stopped")
"""


def test_an_interrupt_is_the_parent_s_alone(tmp_path):
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, start_new_session=True, timeout=120)
    assert (done.stdout, done.stderr, done.returncode) == ("stopped\n", "", 0)


TOLD = """
import runpy
from bladewing.classify import progress
progress._LINE_EVERY_S = 0.0  # else its first line is waited for for half a minute, with two workers under way
runpy.run_module("bladewing.classify", run_name="__main__")
"""


def test_a_program_told_to_end_does_so_as_after_ctrl_c(tmp_path):
    """In one line, and without a word of those of its workers, where `timeout` or a service ends it."""
    command = [sys.executable, "-c", TOLD, "train", "--records", "3000", "--out", tmp_path / "out"]
    told = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert told.stderr is not None
    assert told.stderr.readline().startswith("draw 4800 records: ")  # the workers are under way
    told.terminate()
    *progress, said = told.communicate(timeout=60)[1].splitlines()
    assert said.startswith("bladewing: stopped: interrupted")  # and what is kept, if anything is by then
    assert told.returncode == 130
    assert all(line.startswith("draw ") for line in progress)
    require_ended(told.pid)
