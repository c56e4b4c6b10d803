"""What every kind of recording must satisfy, and the carrier and the PRF. SigMF and arrays have files of their own."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from bladewing.classify.errors import BadInput, unreadable
from bladewing.classify.recording import Recording, find_recording, load_recording, of_each

from .conftest import CARRIER_HZ, PRF_HZ, noise

RADAR = {"carrier_hz": CARRIER_HZ, "prf_hz": PRF_HZ}


def refused(path, **options) -> str:
    """The message of a recording that is refused: one line, which names the file."""
    with pytest.raises(BadInput) as caught:
        load_recording(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert Path(path).stem.split(".")[0] in message
    return message


@pytest.fixture
def npy(tmp_path):
    def write(array, name="rec.npy"):
        np.save(tmp_path / name, array, allow_pickle=True)
        return tmp_path / name

    return write


def test_samples_come_back_as_they_were(npy):
    recording = load_recording(npy(noise(100)), **RADAR)
    np.testing.assert_array_equal(recording.iq, noise(100))
    assert recording.iq.dtype == np.complex64
    assert (recording.carrier_hz, recording.prf_hz, recording.start_s) == (CARRIER_HZ, PRF_HZ, 0)


@pytest.mark.parametrize("shape", [(100,), (100, 1), (1, 100), (1, 100, 1)])
def test_axes_of_length_one_are_let_go(npy, shape):
    assert load_recording(npy(noise(100).reshape(shape)), **RADAR).iq.shape == (100,)


@pytest.mark.parametrize("dtype", ["complex128", ">c8", ">c16", "clongdouble"])
def test_every_complex_type_becomes_complex64(npy, dtype):
    recording = load_recording(npy(noise(100).astype(dtype)), **RADAR)
    assert recording.iq.dtype == np.dtype(np.complex64)
    np.testing.assert_array_equal(recording.iq, noise(100))


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.zeros(0, dtype=np.complex64), r"no samples \(shape \(0,\)\): a recording needs at least one pulse"),
        (np.zeros((0, 5), dtype=np.complex64), r"no samples \(shape \(0, 5\)\)"),
        (np.zeros((50, 2), np.float32), r"real samples of shape \(50, 2\): I and Q must be one complex number"),
        (np.complex64(1), r"samples of shape \(\): a recording is one range cell"),
        (noise(50, records=(2,)), r"samples of shape \(2, 50\): a recording is one range cell, shape \(pulses,\)"),
        (np.ones(100, dtype=np.float32), r"real samples \(float32\): IQ must be complex"),
        (np.ones(100, dtype=np.int16), r"real samples \(int16\): IQ must be complex"),
        (np.ones(100, dtype=bool), r"real samples \(bool\)"),
        (np.array(["a"] * 70), r"samples of type <U1: IQ must be complex"),
        (np.zeros(100, dtype=[("i", "f4"), ("q", "f4")]), r"structured array with fields \['i', 'q'\]"),
        (np.array([1 + 1j] * 70, dtype=object), "Python objects, which is never unpickled"),
        (np.r_[noise(70), np.nan], r"sample 70 is \(?nan.*must be finite.*1 of 71"),
        (np.r_[1j * np.inf, noise(70)], r"sample 0 is .*inf.*must be finite"),
        (np.r_[noise(70).astype(complex), 1e300], r"sample 70 is .*1e\+300.*finite in complex64"),
    ],
)
def test_samples_that_are_refused(npy, array, said):
    assert re.search(said, refused(npy(array), **RADAR))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "of arrays the samples alone are read: give carrier_hz= and prf_hz="),
        ({"prf_hz": PRF_HZ}, "of arrays the samples alone are read: give carrier_hz= .Hz.$"),
        ({"carrier_hz": CARRIER_HZ}, "of arrays the samples alone are read: give prf_hz= .Hz.$"),
        (RADAR | {"prf_hz": 0.0}, r"PRF given \(prf_hz=\) is 0: it must be a finite number above 0"),
        (RADAR | {"prf_hz": -5.0}, r"PRF given \(prf_hz=\) is -5"),
        (RADAR | {"carrier_hz": float("nan")}, r"carrier given \(carrier_hz=\) is nan"),
        (RADAR | {"carrier_hz": float("inf")}, r"carrier given \(carrier_hz=\) is inf"),
    ],
)
def test_carrier_and_prf_must_be_known(npy, options, said):
    with pytest.raises(BadInput, match=said):
        load_recording(npy(noise(100)), **options)


@pytest.mark.parametrize(
    ("shape", "cure"),
    [
        ((100, 2), r"x\[..., 0\] \+ 1j \* x\[..., 1\]"),
        ((100, 9, 2), r"x\[..., 0\] \+ 1j \* x\[..., 1\]"),
        ((2, 100), r"x\[0\] \+ 1j \* x\[1\]"),
    ],
)
def test_parts_along_an_axis_of_two_are_told_how_to_join(npy, shape, cure):
    with pytest.raises(BadInput, match=f"I and Q must be one complex number: store {cure}"):
        load_recording(npy(np.ones(shape, np.float32)), **RADAR)


def test_bytes_in_the_other_order_are_told_from_samples_that_are_missing(npy):
    whole = noise(3000)
    assert "bytes seem to be in the other order" in refused(npy(whole.byteswap()), **RADAR)
    for few in (np.nan, np.inf):
        assert "interpolate" in refused(npy(np.where(np.arange(3000) % 100 == 7, few, whole)), **RADAR)
    assert "interpolate" in refused(npy(np.full(3000, np.nan + 0j)), **RADAR)
    assert "lower the gain" in refused(npy(whole.astype(complex) * 1e200), **RADAR)


@pytest.mark.parametrize("name", ["", "-"])
def test_standard_input_is_no_recording(name):
    with pytest.raises(BadInput, match="names no file: recordings are not read from standard input"):
        load_recording(name, **RADAR)


def test_a_directory_is_refused_with_the_cure(tmp_path, npy, sigmf_pair):
    assert "is a directory that holds no recording: name a SigMF, .npy, .npz or .mat file" in refused(tmp_path)
    npy(noise(100))
    assert refused(tmp_path).endswith(f"is a directory: name the recordings in it, such as {tmp_path}/*.npy")
    sigmf_pair()
    with pytest.raises(BadInput, match=r"is a directory: name the recordings in it, such as .*/\*\.sigmf-meta"):
        load_recording(tmp_path)


def test_a_pipe_is_no_recording(tmp_path):
    os.mkfifo(tmp_path / "pipe.npy")
    assert "a pipe or a device, no file" in refused(tmp_path / "pipe.npy")
    os.mkfifo(tmp_path / "63")  # as a shell hands on what a command gives
    assert "a pipe or a device, no file" in refused(tmp_path / "63")


def test_an_interval_given_as_the_prf_is_told_as_such():
    recording = Recording("walk", np.ones(100, np.complex64), 24e9, 40e-6)
    with pytest.raises(BadInput, match="give the PRF in hertz, 25000 if that is the interval from pulse to pulse"):
        recording.dwells(0.08)


@pytest.mark.parametrize("name", ["gone.npy", "gone.mat", "gone.sigmf-meta", "gone.sigmf-data", "gone.sigmf", "gone"])
def test_a_missing_file_is_named(tmp_path, name):
    assert "no such file" in refused(tmp_path / name)


@pytest.mark.parametrize("name", ["rec.npy.gz", "rec.tgz", "rec.tar", "rec.ZIP"])
def test_packed_files_are_to_be_unpacked(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x1f\x8b" * 100)
    assert f"{name}: it is packed: unpack it first" in refused(tmp_path / name)


@pytest.mark.parametrize("name", ["rec.wav", "rec", "rec.bin", "rec.txt"])
def test_other_kinds_are_refused_with_those_that_are_known(tmp_path, name):
    (tmp_path / name).write_bytes(b"x" * 100)
    assert "give SigMF, .npy, .npz, .mat" in refused(tmp_path / name)


def test_a_name_with_a_line_end_stays_on_one_line(tmp_path):
    with pytest.raises(BadInput) as caught:
        load_recording(tmp_path / "re\nc.npy")
    assert r"re\nc.npy: no such file" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_with_spaces_and_upper_case_endings(npy):
    assert load_recording(npy(noise(64), "my rec 1.npy"), **RADAR).iq.size == 64
    path = npy(noise(64), "plain.npy")
    upper = path.rename(path.with_name("LOUD.NPY"))
    assert load_recording(upper, **RADAR).iq.size == 64


def test_all_names_of_a_sigmf_recording_stand_for_one(sigmf_pair):
    meta = sigmf_pair("drone-3.30GHz")
    names = [meta, meta.with_suffix(".sigmf-data"), meta.with_suffix("")]
    assert {find_recording(name) for name in names} == {meta}
    iq = [load_recording(name).iq for name in names]
    np.testing.assert_array_equal(iq[0], iq[1])
    np.testing.assert_array_equal(iq[0], iq[2])


@pytest.mark.parametrize(
    ("iq", "frequencies", "said"),
    [
        (noise(50, (1,)), {}, r"walk: samples of shape \(1, 50\): give those of one range cell"),
        (noise(0), {}, r"walk: samples of shape \(0,\)"),
        (noise(50).real, {}, "walk: real samples"),
        (noise(50), {"prf_hz": -1.0}, "walk: prf_hz is -1"),
        (noise(50), {"carrier_hz": "x"}, "walk: carrier_hz is 'x'"),
        (noise(50), {"start_s": float("nan")}, "walk: start_s is nan: it must be a finite time"),
    ],
)
def test_a_recording_of_ones_own_is_looked_at_as_a_files_is(iq, frequencies, said):
    with pytest.raises(BadInput, match=said):
        Recording("walk", iq, **(RADAR | frequencies))


def test_samples_of_a_recording_of_ones_own_may_be_a_list():
    recording = Recording("walk", noise(50).tolist(), np.float32(10e9), 20_000)
    assert (recording.iq.dtype, type(recording.carrier_hz)) == (np.complex64, float)


def test_a_file_that_the_system_does_not_give_is_named_itself():
    """Of a SigMF recording one of two may be locked."""
    locked = PermissionError(13, "Permission denied", "walk.sigmf-data")
    said = "walk.sigmf-data: cannot be read: Permission denied: name a file that can be read"
    assert str(unreadable("walk.sigmf-meta", locked)) == said
    assert str(unreadable("walk", OSError("gone"), "look again")) == "walk: cannot be read: gone: look again"


def test_a_name_that_is_no_text_can_be_written_as_text(tmp_path):
    path = os.fsencode(tmp_path) + b"/drone\xff.npy"
    with open(path, "wb") as file:
        np.save(file, noise(100))
    name = load_recording(os.fsdecode(path), **RADAR).name
    assert name.encode().endswith(rb"/drone\udcff.npy")


def test_carrier_and_prf_that_stand_in_each_others_place_are_told_where_they_are_given(npy):
    said = "carrier 25000 Hz and PRF 9.85e+09 Hz stand in each other's place: exchange them"
    with pytest.raises(BadInput, match=re.escape(f"walk: {said}")):
        Recording("walk", noise(50), 25e3, 9.85e9)
    assert said in refused(npy(noise(50)), carrier_hz=25e3, prf_hz=9.85e9)


def test_the_command_line_names_its_options_where_python_names_arguments(npy):
    (error,) = of_each(lambda recording: recording, [npy(noise(100))])
    assert str(error).endswith("of arrays the samples alone are read: give --carrier-hz and --prf-hz [Hz]")
