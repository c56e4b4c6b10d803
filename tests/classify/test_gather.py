import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from bladewing.classify import gather as gather_module
from bladewing.classify.gather import gather
from bladewing.features import INPUT_SHAPES


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
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            os.killpg(parent.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.2)
    os.killpg(parent.pid, signal.SIGKILL)
    pytest.fail("workers outlived their parent")


INTERRUPTED = """
import os, signal, threading

from bladewing.classify import gather
if __name__ == "__main__":
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
