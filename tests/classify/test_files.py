import os
import signal
import stat
import subprocess
import sys
import time

import pytest
from bladewing.classify import files
from bladewing.classify.files import write_whole


def test_writes_bytes_and_text_as_given(tmp_path):
    write_whole(tmp_path / "b", b"\x00\r\n\xff")
    write_whole(tmp_path / "t", "Λ\n")
    assert (tmp_path / "b").read_bytes() == b"\x00\r\n\xff"
    assert (tmp_path / "t").read_bytes() == "Λ\n".encode()


def test_replaces_what_was_there_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "model.onnx"
    write_whole(path, "old, and longer than the new one")
    write_whole(path, "new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("step", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()], ids=["error", "interrupt"])
def test_interrupted_write_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch, step, error):
    path = tmp_path / "model.onnx"
    write_whole(path, "old")

    def fail(*_):
        raise error

    monkeypatch.setattr(files.os, step, fail)
    with pytest.raises(type(error)):
        write_whole(path, "new" * 100_000)
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_killed_in_the_middle_of_a_write_leaves_the_old_file_whole(tmp_path):
    path = tmp_path / "model.onnx"
    write_whole(path, "old")
    # The child stops for ever at the moment where everything is written but not yet brought to the disk.
    code = (
        "import os, sys, time\n"
        "from bladewing.classify.files import write_whole\n"
        "os.fsync = lambda fd: (print('written', flush=True), time.sleep(60))\n"
        "write_whole(sys.argv[1], 'new' * 100_000)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"written\n"
        child.send_signal(signal.SIGKILL)
    assert path.read_text() == "old"


def test_a_reader_never_sees_a_part(tmp_path):
    path = tmp_path / "report.json"
    contents = [letter * 200_000 for letter in "ab"]
    write_whole(path, contents[0])
    code = (
        "import sys\n"
        "from bladewing.classify.files import write_whole\n"
        "for turn in range(100): write_whole(sys.argv[1], 'ab'[turn % 2] * 200_000)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(path)]) as child:
        seen = set()
        while child.poll() is None:
            seen.add(path.read_text())
            time.sleep(0.0005)
    assert child.returncode == 0
    assert seen <= set(contents)


def test_follows_the_umask_not_the_private_mode_of_a_temporary_file(tmp_path):
    old = os.umask(0o022)
    try:
        write_whole(tmp_path / "report.html", "x")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "report.html").stat().st_mode) == 0o644


def test_a_link_goes_on_pointing_at_the_file(tmp_path):
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_text("old")
    link.symlink_to(real)
    write_whole(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_a_pipe_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileExistsError, match="a pipe or a device stands there"):
        write_whole(tmp_path / "pipe", "x")
    assert [path.is_fifo() for path in tmp_path.iterdir()] == [True]


def test_a_missing_folder_and_a_directory_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "no" / "file", "x")
    with pytest.raises(IsADirectoryError, match="is a directory"):
        write_whole(tmp_path, "x")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("fails_at", [1, 2])
def test_a_rename_that_fails_does_not_close_the_folder_to_later_writers(tmp_path, monkeypatch, fails_at):
    names = {"a": "new a", "b": "new b"}
    for name in names:
        (tmp_path / name).write_text("old")
    real, calls = os.replace, []

    def refuse(source, target):
        if not str(target).endswith(".json"):
            calls.append(target)
            if len(calls) == fails_at:
                raise PermissionError(1, "Operation not permitted")
        real(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(PermissionError):
        files.write_together(tmp_path, names)
    monkeypatch.setattr(os, "replace", real)
    if fails_at == 1:  # nothing was changed, and nothing is left
        assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "old", "b": "old"}
    files.write_together(tmp_path, {"c": "new c"})
    assert (tmp_path / "c").read_text() == "new c"
    if fails_at == 2:  # decided, and finished by the next writer
        assert [(tmp_path / name).read_text() for name in names] == ["new a", "new b"]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".bladewing")]


def test_what_an_earlier_writer_left_and_nobody_can_finish_is_given_up(tmp_path):
    (tmp_path / "a").mkdir()  # a file cannot take its place
    (tmp_path / ".bladewing-0.new").write_text("new a")
    (tmp_path / ".bladewing-pending.json").write_text('{".bladewing-0.new": "a"}')
    files.write_together(tmp_path, {"b": "new b"})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
