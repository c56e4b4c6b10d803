import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bladewing.classify import files
from bladewing.classify.dataset import run_dataset
from bladewing.classify.errors import BadInput
from bladewing.classify.files import only_writer, result_folder, settle, write_together

OLD, NEW = {"a": b"old a", "b": b"old b"}, {"a": b"new a", "b": b"new b", "c": b"new c"}


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir() if not p.name.startswith(".bladewing")}


def test_all_files_change_and_nothing_else_stays(tmp_path):
    (tmp_path / "other").write_bytes(b"mine")
    write_together(tmp_path, OLD)
    write_together(tmp_path, NEW)
    assert content(tmp_path) == NEW | {"other": b"mine"}
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize("call", range(1, 12))
def test_a_fault_at_any_rename_leaves_all_old_or_all_new(tmp_path, monkeypatch, call):
    write_together(tmp_path, OLD)
    count = 0
    replace = os.replace

    def failing(source, target):
        nonlocal count
        count += 1
        if count == call:
            raise OSError("pulled the plug")
        replace(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(files.os, "replace", failing)
        try:
            write_together(tmp_path, NEW)
        except OSError:
            assert count == call
    settle(tmp_path)
    assert content(tmp_path) in (OLD, NEW)
    assert len(list(tmp_path.iterdir())) == len(content(tmp_path))


@pytest.mark.parametrize("call", range(1, 5))
def test_killed_as_a_decision_is_taken_back_it_leaves_all_old_or_all_new(tmp_path, monkeypatch, call):
    write_together(tmp_path, OLD)
    count = 0
    unlink = Path.unlink

    def interrupted(folder):
        if (folder / files._JOURNAL).exists():
            raise KeyboardInterrupt  # decided, not done

    def killed(self, **options):
        nonlocal count
        count += self.exists()
        if count == call:
            raise SystemExit
        unlink(self, **options)

    with monkeypatch.context() as patch:
        patch.setattr(files, "_sync_folder", interrupted)
        patch.setattr(Path, "unlink", killed)
        with pytest.raises(SystemExit):
            write_together(tmp_path, NEW)
    settle(tmp_path)
    assert content(tmp_path) in (OLD, NEW)


def decided(folder):
    """A change that was decided, and whose writer was killed before any rename."""
    for name in NEW:
        (folder / f".bladewing-{name}.new").write_bytes(NEW[name])
    (folder / ".bladewing-pending.json").write_text(json.dumps({f".bladewing-{name}.new": name for name in NEW}))


def test_what_was_decided_is_done_before_results_are_read_or_litter_is_cleared(tmp_path):
    decided(tmp_path)
    assert result_folder(tmp_path) == tmp_path
    assert content(tmp_path) == NEW
    (tmp_path / "data").mkdir()
    decided(tmp_path / "data")
    with pytest.raises(BadInput, match="not empty"):
        run_dataset(tmp_path / "data", records=600, progress=False)
    assert content(tmp_path / "data") == NEW


def test_a_journal_moves_nothing_out_of_its_folder(tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / ".bladewing-0.new").write_bytes(b"x")
    (folder / ".bladewing-pending.json").write_text(json.dumps({".bladewing-0.new": "../escaped"}))
    settle(folder)
    assert not (tmp_path / "escaped").exists()


@pytest.mark.parametrize("journal", ['{"mine": "yours"}', "[1]", "[" * 100_000, "\xff", " " * (1 << 21)])
def test_a_foreign_journal_changes_nothing_and_does_not_stay(tmp_path, journal):
    (tmp_path / "mine").write_bytes(b"mine")
    (tmp_path / ".bladewing-pending.json").write_text(journal, encoding="latin-1")
    settle(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def wait_for(path):
    """Wait until a file lies there, 20 s at most."""
    deadline = time.monotonic() + 20
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.01)


def test_two_writers_never_mix_their_files(tmp_path):
    writers = [subprocess.Popen([sys.executable, "-c", KILL, str(tmp_path)]) for _ in range(2)]
    try:
        wait_for(tmp_path / "f")
        for _ in range(20):
            time.sleep(0.01)
            with only_writer(tmp_path):
                assert not (tmp_path / ".bladewing-pending.json").exists()
                assert len({(tmp_path / name).read_bytes() for name in "abcdef"}) == 1
    finally:
        for writer in writers:
            writer.kill()
            writer.wait()
    write_together(tmp_path, {"a": "last"})
    assert sorted(path.name for path in tmp_path.iterdir() if path.suffix == ".new") == []


KILL = """
import sys
from pathlib import Path
from bladewing.classify.files import write_together
place = Path(sys.argv[1])
number = 0
while True:
    number += 1
    write_together(place, {name: str(number).encode() * 50_000 for name in "abcdef"})
"""


def test_killed_at_any_moment_the_files_agree(tmp_path):
    for delay_s in (0.02, 0.05, 0.09, 0.14):
        process = subprocess.Popen([sys.executable, "-c", KILL, str(tmp_path)])
        wait_for(tmp_path / "f")
        time.sleep(delay_s)
        process.send_signal(signal.SIGKILL)
        process.wait()
        settle(tmp_path)
        assert len({(tmp_path / name).read_bytes() for name in "abcdef"}) == 1
