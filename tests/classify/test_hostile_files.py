"""Files made to do harm, and mutated real ones: read or refused in one line, in bounded room and time."""

import gzip
import io
import json
import lzma
import os
import pickle
import tarfile
import tracemalloc
import zipfile
import zlib

import numpy as np
import pytest
from bladewing.classify import Classifier
from bladewing.classify.cli import main
from bladewing.classify.errors import BadInput
from bladewing.classify.recording import load_recording
from bladewing.models.pretrained import __path__ as pretrained
from hypothesis import given, settings
from hypothesis import strategies as st

from ..fuzz.readers import (
    _SEAM,
    mutate,
    npy_claiming,
    readers,
    resealed,
    tar_with,
    verdict,
)

NAMES = ("npy", "npz", "mat", "sigmf", "sigmf archive", "toml", "model", "data set")

#: What refusing may cost on top of the file itself [bytes].
ROOM = 150 << 20


class Quietly(dict):
    """A failing example shows its seed, not a megabyte of real files."""

    def __repr__(self):
        return "readers"


@pytest.fixture(scope="module")
def all_readers(tmp_path_factory):
    return Quietly(readers(tmp_path_factory.mktemp("seeds")))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("mutated")


def refused(path, match, **options):
    tracemalloc.start()
    try:
        with pytest.raises(BadInput, match=match) as caught:
            load_recording(path, carrier_hz=9.85e9, prf_hz=25e3, **options)
        assert tracemalloc.get_traced_memory()[1] < ROOM
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", NAMES)
def test_seeds_are_read(all_readers, place, name):
    verdicts = [verdict(all_readers[name], seed, place) for seed in all_readers[name].seeds]
    assert "read" in verdicts
    assert set(verdicts) <= {"read", "refused"}


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=60)
@given(seed=st.integers(0, 2**63))
def test_mutated_files_are_read_or_refused_in_one_line(all_readers, place, name, seed):
    content = mutate(all_readers[name].seeds, np.random.default_rng(seed))
    assert verdict(all_readers[name], content, place) in ("read", "refused")


@settings(max_examples=60)
@given(content=st.binary(max_size=400), name=st.sampled_from(NAMES))
def test_noise_is_refused(all_readers, place, content, name):
    assert verdict(all_readers[name], content, place) in ("read", "refused")


CLAIMS = ["(1342177280,)", "(10**18,)", "(-1,)", "(2, -5)", "(4611686018427387904, 4)", "(1.5,)", "('a',)", "None"]


@pytest.mark.parametrize("shape", CLAIMS)
def test_an_npy_that_claims_what_it_does_not_hold(tmp_path, shape):
    (tmp_path / "x.npy").write_bytes(npy_claiming(shape, body=bytes(64)))
    refused(tmp_path / "x.npy", "damaged or cut short")
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("iq.npy", npy_claiming(shape, body=bytes(64)))
    refused(tmp_path / "x.npz", "damaged or cut short")


@pytest.mark.parametrize(
    "header", [b"\x93NUMPY\x02\x00\xff\xff\xff\xff", b"\x93NUMPY\x09\x00", b"\x93NUMPY\x01\x00\xff\xff"]
)
def test_an_npy_with_an_oversized_header(tmp_path, header):
    (tmp_path / "x.npy").write_bytes(header + b"(" * 100_000)
    refused(tmp_path / "x.npy", "damaged or cut short")


def test_objects_are_never_unpickled(tmp_path, monkeypatch):
    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "exploded"),)

    monkeypatch.setattr(pickle, "load", lambda *_, **__: pytest.fail("unpickled"))
    np.save(tmp_path / "x.npy", np.array([Bomb()], object), allow_pickle=True)
    refused(tmp_path / "x.npy", "an array of Python objects, which is never unpickled")
    np.savez(tmp_path / "x.npz", iq=np.array([Bomb()], object))
    refused(tmp_path / "x.npz", "an array of Python objects, which is never unpickled")
    assert not (tmp_path / "exploded").exists()


def bomb_zip(path, member, unpacked=200 << 20):
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(member, "w") as file,
    ):
        for _ in range(unpacked >> 20):
            file.write(bytes(1 << 20))


def test_a_zip_bomb_is_not_unpacked(tmp_path):
    bomb_zip(tmp_path / "x.npz", "iq.npy")
    refused(tmp_path / "x.npz", "it unpacks to 209715200 bytes or more")
    bomb_zip(tmp_path / "y.sigmf.zip", "x.sigmf-data")
    refused(tmp_path / "y.sigmf.zip", "it unpacks to 209715200 bytes or more")


@pytest.mark.parametrize(("suffix", "pack"), [(".gz", gzip.compress), (".xz", lzma.compress), ("", gzip.compress)])
def test_a_packed_bomb_is_unpacked_no_further_than_it_may(tmp_path, suffix, pack):
    path = tmp_path / f"x.sigmf{suffix}"
    path.write_bytes(pack(tar_with(b"x.sigmf-meta", 200 << 20) + bytes(200 << 20)))
    refused(path, "it unpacks to")


def test_a_bomb_within_a_bomb_is_no_archive(tmp_path):
    (tmp_path / "x.sigmf.gz").write_bytes(gzip.compress(gzip.compress(bytes(200 << 20), mtime=0), mtime=0))
    refused(tmp_path / "x.sigmf.gz", "not a readable SigMF recording")


def test_a_matlab_bomb_is_unpacked_no_further_than_it_may(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "x.mat", {"iq": np.zeros(4)})
    packed = zlib.compress(bytes(200 << 20), 1)
    head = (tmp_path / "x.mat").read_bytes()[:128]
    (tmp_path / "x.mat").write_bytes(head + (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed)
    refused(tmp_path / "x.mat", "it unpacks to")


@pytest.mark.parametrize(("at", "value"), [(176, 0x8000), (176, 0x7FFFFFFF), (180, 1), (160, -5), (156, 0x7FFFFFFF)])
def test_a_matlab_file_with_types_and_sizes_that_scipy_would_follow(tmp_path, at, value):
    from scipy.io import savemat

    savemat(tmp_path / "x.mat", {"iq": np.ones(40, np.complex64)})
    content = bytearray((tmp_path / "x.mat").read_bytes())
    content[at : at + 4] = (value & 0xFFFFFFFF).to_bytes(4, "little")
    (tmp_path / "x.mat").write_bytes(content)
    refused(tmp_path / "x.mat", "damaged or cut short")


@pytest.mark.parametrize("name", [b"../../escaped.sigmf-data", b"/escaped.sigmf-data", b"x.sigmf-data"])
@pytest.mark.parametrize("kind", [b"0", b"1", b"2", b"3", b"6", b"S"])
def test_archive_members_with_path_tricks_links_and_devices_write_nothing(tmp_path, name, kind):
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    (folder / "x.sigmf").write_bytes(tar_with(b"x.sigmf-meta", 0)[:512] + tar_with(name, 10 << 30, kind))
    before = sorted(path for path in tmp_path.rglob("*"))
    refused(folder / "x.sigmf", "x.sigmf")
    assert sorted(path for path in tmp_path.rglob("*")) == before


def test_what_never_ends_is_no_recording(tmp_path):
    os.mkfifo(tmp_path / "x.npy")
    (tmp_path / "x.sigmf-meta").symlink_to("/dev/zero")
    for name in ("x.npy", "x.sigmf-meta"):
        with pytest.raises(BadInput):
            load_recording(tmp_path / name, carrier_hz=1e9, prf_hz=1e4)


@pytest.mark.parametrize("name", ["x.npy", "x.npz", "x.mat", "x.sigmf", "x.sigmf-meta"])
def test_a_file_of_ten_gigabytes_is_not_read(tmp_path, name):
    with open(tmp_path / name, "wb") as file:
        file.truncate(10 << 30)  # a hole: it takes no room on the disk
    (tmp_path / "x.sigmf-data").write_bytes(bytes(80))
    refused(tmp_path / name, "more than the")


def test_ten_gigabytes_of_samples_are_not_read(tmp_path, all_readers):
    (tmp_path / "x.sigmf-meta").write_bytes(all_readers["sigmf"].seeds[0].partition(_SEAM)[0])
    with open(tmp_path / "x.sigmf-data", "wb") as file:
        file.truncate(10 << 30)
    refused(tmp_path / "x.sigmf-meta", "cut it into parts")


@pytest.mark.parametrize("text", ["a = " + "[" * 50_000, "a = " + "1" * 10_000, "\x00", "a = 1\na = 2", "[" * 3000])
@pytest.mark.parametrize("command", [["train", "--config"], ["simulate", "--explain"]])
def test_hostile_toml_is_one_line(tmp_path, capsys, text, command):
    (tmp_path / "x.toml").write_text(text)
    assert main([*command, str(tmp_path / "x.toml")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "not TOML" in said
    assert len(said) < 1000


def test_a_toml_of_ten_gigabytes_is_not_read(tmp_path, capsys):
    with open(tmp_path / "x.toml", "wb") as file:
        file.truncate(10 << 30)
    for command in (["train", "--config"], ["simulate", "--explain"]):
        assert main([*command, str(tmp_path / "x.toml")]) == 2
        assert "may have" in (said := capsys.readouterr().err) or "at most" in said


def shipped(name="spectrum-cnn-fast"):
    with open(f"{pretrained[0]}/{name}.onnx", "rb") as file:
        return file.read()


@pytest.fixture
def unopened(tmp_path, monkeypatch):
    """Write a model with a seal that fits, which nothing may open."""
    import onnxruntime

    def write(model):
        path = tmp_path / "x.onnx"
        path.write_bytes(resealed(model.SerializeToString()))
        return path

    monkeypatch.setattr(onnxruntime, "InferenceSession", lambda *_, **__: pytest.fail("opened"))
    return write


def test_a_model_that_refers_to_another_file_is_refused_before_it_is_opened(unopened):
    import onnx

    model = onnx.load_model_from_string(shipped())
    tensor = next(iter(model.graph.initializer))
    tensor.ClearField("raw_data")
    tensor.ClearField("float_data")
    tensor.data_location = onnx.TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="../../../etc/passwd")
    path = unopened(model)
    with pytest.raises(BadInput, match="refers to data outside its file"):
        Classifier.load(path)


@pytest.mark.parametrize(
    "change", [("product", "other"), ("format", "9"), ("classes", "[1]"), ("envelope", "[" * 9999)]
)
def test_a_foreign_model_with_a_seal_that_fits_is_refused_before_it_is_opened(unopened, change):
    import onnx

    model = onnx.load_model_from_string(shipped())
    for entry in model.metadata_props:
        if entry.key == change[0]:
            entry.value = change[1]
    path = unopened(model)
    with pytest.raises(BadInput, match=r"x\.onnx") as caught:
        Classifier.load(path)
    assert "\n" not in str(caught.value)


def test_a_model_of_ten_gigabytes_is_not_read(tmp_path):
    with open(tmp_path / "x.onnx", "wb") as file:
        file.truncate(10 << 30)
    with pytest.raises(BadInput, match="more than the"):
        Classifier.load(tmp_path / "x.onnx")


def test_a_tar_with_holes_is_refused(tmp_path):
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w:") as tar:
        info = tarfile.TarInfo("x.sigmf-meta")
        info.size = 2
        tar.addfile(info, io.BytesIO(json.dumps({}).encode()))
    (tmp_path / "x.sigmf").write_bytes(file.getvalue()[:1024] + tar_with(b"x.sigmf-data", 0, b"S"))
    refused(tmp_path / "x.sigmf", "not a readable SigMF recording")
