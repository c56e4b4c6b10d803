import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack

import numpy as np
import pytest
from bladewing.classify import dataset as module
from bladewing.classify import train
from bladewing.classify.cli import main
from bladewing.classify.dataset import MANIFEST, DataSet, DataSetPlan, write_dataset
from bladewing.classify.errors import BadInput
from bladewing.classify.files import only_writer
from bladewing.classify.progress import Progress
from bladewing.classify.training_config import TrainingConfig
from bladewing.simulate import stream

from .conftest import content

COUNTS = {"train": 100, "validate": 24, "calibrate": 30, "test": 24}
PLAN = DataSetPlan(3, COUNTS)


def write(folder, plan=PLAN):
    return write_dataset(folder, plan, Progress(visible=False), workers=1)


@pytest.fixture(autouse=True)
def small_shards(monkeypatch):
    monkeypatch.setattr(module, "SHARD_RECORDS", 48)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "data"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "SHARD_RECORDS", 48)
        assert write(folder) == 6  # three for training, one for each other set
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "copy")


def test_records_come_back_as_the_simulator_gave_them(whole):
    data = DataSet(whole)
    for purpose, count in COUNTS.items():
        stored = [group for source in data.sources(purpose) for group in source()]
        drawn = list(stream(3, purpose, count))
        assert len(stored) == len(drawn)
        for one, other in zip(stored, drawn, strict=True):
            assert one.radar == other.radar
            np.testing.assert_array_equal(one.iq, other.iq)
            np.testing.assert_array_equal(one.labels, other.labels)
            assert list(one.truth) == list(other.truth)
            for name in other.truth:
                np.testing.assert_array_equal(one.truth[name], other.truth[name])


def test_training_takes_the_same_bits_from_the_disk_as_from_the_simulator(whole, monkeypatch):
    monkeypatch.setattr(TrainingConfig, "sets", property(lambda self: COUNTS))
    settings = TrainingConfig(seed=3, models=("features-linear", "spectrum-cnn"))
    bars = Progress(visible=False)
    stored, drawn = train._gather(settings, DataSet(whole), bars), train._gather(settings, None, bars)
    for purpose, count in COUNTS.items():
        one, other = getattr(stored, purpose), getattr(drawn, purpose)
        assert len(one) == count
        assert list(one.inputs) == list(other.inputs) == ["features", "spectrum", "cadence", "combs"]
        for name, values in other.inputs.items():
            np.testing.assert_array_equal(one.inputs[name], values)
        np.testing.assert_array_equal(one.labels, other.labels)
        assert list(one.truth) == list(other.truth)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"records": 700}, "records is 700, but the data set has 100: leave it out"),
        ({"seed": 4}, "seed is 4, but the data set has 3: leave it out"),
        ({}, "records is 100: it should be greater than or equal to 600"),
    ],
)
def test_a_training_takes_records_and_seed_from_the_data_set(whole, tmp_path, options, said):
    with pytest.raises(BadInput, match=said):
        train.run_training(tmp_path / "m", data=whole, progress=False, **options)
    assert not (tmp_path / "m").exists()


def test_numpy_alone_reads_the_files(whole):
    iq, table = (np.load(whole / f"train-00001.{part}.npy", mmap_mode="r") for part in ("iq", "table"))
    assert iq.dtype == np.complex64
    assert table["pulses"].sum() == len(iq)
    assert set(table["label"]) == {b"uav", b"bird", b"clutter"}


def test_a_second_run_writes_nothing(whole):
    before = {path: path.stat().st_mtime_ns for path in whole.glob("*.npy")}
    assert write(whole) == 0
    assert {path: path.stat().st_mtime_ns for path in whole.glob("*.npy")} == before


def test_what_a_killed_writer_left_half_written_goes_and_nothing_else(copy):
    litter = {".bladewing-0.tmp", ".bladewing-1.new"}
    for name in (*litter, ".bladewing-note.txt", "mine.tmp"):
        (copy / name).write_bytes(b"x")
    before = set(content(copy))
    assert write(copy) == 0
    assert before - set(content(copy)) == litter


@pytest.mark.parametrize("damage", ["missing", "cut", "flipped", "longer"])
def test_what_is_damaged_is_drawn_again_and_nothing_else(whole, copy, damage):
    path = copy / "train-00001.iq.npy"
    good = path.read_bytes()
    path.unlink()
    if damage != "missing":
        flipped = good[:5000] + bytes([good[5000] ^ 1]) + good[5001:]
        path.write_bytes({"cut": good[:-8], "flipped": flipped, "longer": good + b"\0"}[damage])
    with pytest.raises(BadInput, match=r"train-00001\.iq\.npy: (missing|altered)"):
        [list(source()) for source in DataSet(copy).sources("train")]
    assert write(copy) == 1
    assert content(copy) == content(whole)


RUN = """
import sys
from pathlib import Path
from bladewing.classify import dataset
from bladewing.classify.progress import Progress
dataset.SHARD_RECORDS = 48
plan = dataset.DataSetPlan(3, {"train": 100, "validate": 24, "calibrate": 30, "test": 24})
dataset.write_dataset(Path(sys.argv[1]), plan, Progress(visible=False), workers=1)
"""


def test_killed_again_and_again_it_ends_with_the_bits_of_an_uninterrupted_run(whole, tmp_path):
    folder, kills = tmp_path / "data", 0
    for turn in range(5):
        process = subprocess.Popen([sys.executable, "-c", RUN, str(folder)])
        listed = -1
        while process.poll() is None:
            time.sleep(0.002)
            if (folder / MANIFEST).exists():
                manifest = json.loads((folder / MANIFEST).read_text())
                listed = len(manifest["shards"]) if listed < 0 else listed
                if turn < 3 and len(manifest["shards"]) > listed:
                    time.sleep(0.003 * turn)
                    process.send_signal(signal.SIGKILL)
                    kills += process.wait() == -signal.SIGKILL
        if process.returncode == 0:
            break
    assert kills >= 2
    assert content(folder) == content(whole)


def test_a_full_disk_is_one_line_and_the_same_command_goes_on(whole, tmp_path, monkeypatch):
    def full(descriptor):
        if len(list(tmp_path.glob("data/*.npy"))) == 3:
            raise OSError(28, "No space left on device")
        return sync(descriptor)

    sync = os.fsync
    with monkeypatch.context() as patch:
        patch.setattr("bladewing.classify.files.os.fsync", full)
        with pytest.raises(BadInput, match="No space left on device: what is whole stays; the same command goes on"):
            write(tmp_path / "data")
    assert not list((tmp_path / "data").glob(".bladewing*"))
    with pytest.raises(BadInput, match="not complete"):
        DataSet(tmp_path / "data")
    assert write(tmp_path / "data") == 5
    assert content(tmp_path / "data") == content(whole)


def test_a_disk_that_is_too_small_is_refused_before_anything_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(module.shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10, 10, 1_000_000))
    with pytest.raises(BadInput, match=r"GB are needed, 0\.001 GB are free"):
        write(tmp_path / "deep" / "data")
    assert not list(tmp_path.iterdir())


def test_a_disk_with_room_for_just_what_is_missing_is_large_enough(copy, monkeypatch):
    missing = [copy / f"test-00000.{part}.npy" for part in ("iq", "table")]
    needed = sum(path.stat().st_size for path in missing)
    for path in missing:
        path.unlink()
    monkeypatch.setattr(module.shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10, 10, free))
    free = needed - 1
    with pytest.raises(BadInput, match="make room or draw fewer"):
        write(copy)
    free = needed
    assert write(copy) == 1


def test_one_writer_at_a_time(whole):
    with only_writer(whole), pytest.raises(BadInput, match="another process is writing there"):
        write(whole)


def test_one_that_is_refused_leaves_the_folder_to_the_other_which_has_nothing_in_it_yet(tmp_path, monkeypatch):
    folder = tmp_path / "data"
    with ExitStack() as other:
        monkeypatch.setattr(module, "settle", lambda _: other.enter_context(only_writer(folder)))
        with pytest.raises(BadInput, match="another process is writing there"):
            write(folder)
        assert folder.is_dir()


def test_another_data_set_or_a_foreign_folder_is_not_written_over(whole, tmp_path):
    with pytest.raises(BadInput, match=r"holds another data set \(seed 3"):
        write(whole, DataSetPlan(4, COUNTS))
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match=r"not empty, and it holds no dataset\.json"):
        write(tmp_path)
    assert content(tmp_path) == {"mine.txt": b"mine"}


def test_another_simulator_does_not_go_on_with_a_data_set(copy, monkeypatch):
    (copy / "test-00000.iq.npy").unlink()
    write(copy)
    manifest = json.loads((copy / MANIFEST).read_text())
    del manifest["shards"]["test-00000"]
    (copy / MANIFEST).write_text(json.dumps(manifest))
    monkeypatch.setattr(module, "simulator_digest", lambda: "0" * 64)
    with pytest.raises(BadInput, match="another simulator"):
        write(copy)


def test_a_whole_data_set_of_another_simulator_stays_what_it_is(copy, monkeypatch):
    monkeypatch.setattr(module, "simulator_digest", lambda: "0" * 64)
    before = content(copy)
    assert write(copy) == 0
    assert content(copy) == before
    (copy / "test-00000.iq.npy").unlink()
    with pytest.raises(BadInput, match="another simulator"):
        write(copy)
    assert (copy / MANIFEST).read_bytes() == before[MANIFEST]


def altered(manifest, **changes):
    return json.dumps(manifest | changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"product": "other"},
        {"format": 2},
        {"shard_records": 10**12},
        {"seed": -1},
        {"seed": True},
        {"records": {"train": 1}},
        {"records": COUNTS | {"train": 10**15}},
        {"records": COUNTS | {"train": -5}},
        {"records": COUNTS | {"train": 1e3}},
        {"shards": {"../../etc/passwd": {}}},
        {"shards": []},
        {
            "shards": {
                "train-00000": {"records": 48, "samples": 10**18, "iq_sha256": "0" * 64, "table_sha256": "0" * 64}
            }
        },
        {"shards": {"train-00000": {"records": 48, "samples": 9, "iq_sha256": "..", "table_sha256": "0" * 64}}},
        {"shards": {"train-00000": {"records": 47, "samples": 9, "iq_sha256": "0" * 64, "table_sha256": "0" * 64}}},
        {"simulator_sha256": None},
    ],
    ids=str,
)
def test_an_odd_manifest_is_refused_in_one_line(copy, tmp_path, capsys, changes):
    manifest = json.loads((copy / MANIFEST).read_text())
    (copy / MANIFEST).write_text(altered(manifest, **changes))
    assert main(["train", "--data", str(copy), "--out", str(tmp_path / "m")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(copy) in said
    assert not (tmp_path / "m").exists()


@pytest.mark.parametrize("text", ["", "[" * 100_000, "{", '{"a": 1}', "\x00\xff"])
def test_what_is_no_manifest_is_refused(tmp_path, text):
    (tmp_path / MANIFEST).write_text(text, encoding="latin-1")
    with pytest.raises(BadInput, match=r"dataset\.json: not the manifest"):
        DataSet(tmp_path)


def rewrite(folder, name, part, change):
    """Alter a shard and its digest together, as a forger would."""
    path = folder / f"{name}.{part}.npy"
    content = change(path.read_bytes())
    assert content != path.read_bytes()
    path.write_bytes(content)
    manifest = json.loads((folder / MANIFEST).read_text())
    manifest["shards"][name][f"{part}_sha256"] = hashlib.sha256(content).hexdigest()
    (folder / MANIFEST).write_text(json.dumps(manifest))


FORGED = {
    "an object header": ("iq", lambda b: b.replace(b"'<c8'", b"'|O' ", 1), "not .* values as bladewing"),
    "another shape": ("iq", lambda b: b.replace(b"'shape': (", b"'shape':-(", 1), "not .* values as bladewing"),
    "a sample that is no number": ("iq", lambda b: b[:-8] + b"\xff" * 8, "a sample is not finite"),
    "a label of its own": ("table", lambda b: b.replace(b"bird\0\0\0", b"wing\0\0\0", 1), "a kind or a label"),
    "a kind of another class": (
        "table",
        lambda b: b.replace(b"gliding_bird", b"helicopter\0\0", 1),
        "a kind or a label",
    ),
    "pulses that do not add up": ("table", lambda b: b[:-185] + b"\x01" * 185, "pulses do not add up|kind or a label"),
}


@pytest.mark.parametrize("forgery", list(FORGED))
def test_a_forged_shard_is_refused_though_its_digest_fits(copy, forgery):
    part, change, said = FORGED[forgery]
    rewrite(copy, "train-00000", part, change)
    with pytest.raises(BadInput, match=said) as caught:
        [list(source()) for source in DataSet(copy).sources("train")]
    assert "\n" not in str(caught.value)


def test_a_link_to_what_never_ends_is_refused(copy):
    path = copy / "train-00000.iq.npy"
    path.unlink()
    path.symlink_to("/dev/zero")
    with pytest.raises(BadInput, match="it is no regular file"):
        list(DataSet(copy).sources("train")[0]())


def test_the_command_names_what_is_wrong(tmp_path, capsys):
    assert main(["dataset", str(tmp_path / "d"), "--records", "599"]) == 2
    assert "--records is '599': it must be greater than or equal to 600" in capsys.readouterr().err
    (tmp_path / "file").write_text("")
    assert main(["dataset", str(tmp_path / "file"), "--records", "600"]) == 2
    assert "cannot be written: File exists: give another folder" in capsys.readouterr().err
    assert main(["train", "--data", str(tmp_path), "--out", str(tmp_path / "m")]) == 2
    assert "give the folder that `bladewing dataset` wrote" in capsys.readouterr().err
