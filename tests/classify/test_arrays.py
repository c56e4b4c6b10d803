import io
import os
import pickle
import re
import zipfile

import numpy as np
import pytest
import scipy.io
from bladewing.classify.arrays import read_array
from bladewing.classify.errors import BadInput
from bladewing.classify.recording import load_recording
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from .conftest import noise

IQ = noise(200)
REAL = np.arange(5.0)


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=True)
    return buffer.getvalue()


def npz(**arrays):
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def with_a_note(packed):
    """An .npz beside whose arrays lies what is none."""
    buffer = io.BytesIO(packed)
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.writestr("readme.txt", "measured on a Monday")
    return buffer.getvalue()


def mat(compress=False, **arrays):
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, arrays, do_compression=compress)
    return buffer.getvalue()


@pytest.fixture
def put(tmp_path):
    def write(suffix, content):
        path = tmp_path / f"rec{suffix}"
        path.write_bytes(content)
        return path

    return write


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        (".npy", npy(IQ)),
        (".npz", npz(iq=IQ)),
        (".npz", npz(iq=IQ, time_s=REAL, note=np.array("x"))),
        (".npz", with_a_note(npz(iq=IQ))),
        (".npz", npz(iq=IQ, notes=np.array([{"by": "me"}], dtype=object))),
        (".mat", mat(iq=IQ)),
        (".mat", mat(iq=IQ, compress=True)),
        (".mat", mat(iq=IQ, t=REAL, name="x", info={"a": 1}, cells=np.array([1, "b"], dtype=object))),
    ],
)
def test_the_only_complex_array_is_meant(put, suffix, content):
    recording = load_recording(put(suffix, content), carrier_hz=10e9, prf_hz=20e3)
    np.testing.assert_array_equal(recording.iq, IQ)


def test_version_4_mat_files_are_read(tmp_path):
    scipy.io.savemat(tmp_path / "old.mat", {"iq": IQ.astype(complex)}, format="4")
    np.testing.assert_array_equal(read_array(tmp_path / "old.mat").reshape(-1), IQ)


@pytest.mark.parametrize(("suffix", "write"), [(".npz", npz), (".mat", mat)])
def test_one_of_several_is_named(put, suffix, write):
    path = put(suffix, write(a=IQ, b=2 * IQ, t=REAL))
    with pytest.raises(BadInput, match=r"2 complex arrays, a complex64 .*, b complex64 .*: say which with --variable"):
        read_array(path)
    np.testing.assert_array_equal(read_array(path, "b").reshape(-1), 2 * IQ)
    with pytest.raises(BadInput, match=r"no variable 'c': it holds a complex64 .*, t float64"):
        read_array(path, "c")


@pytest.mark.parametrize(
    ("suffix", "content", "variable", "said"),
    [
        (".npy", b"", None, r"the file is empty \(0 bytes\)"),
        (".npz", b"", None, r"the file is empty \(0 bytes\)"),
        (".mat", b"", None, r"the file is empty \(0 bytes\)"),
        (".npy", npy(IQ)[:-5], None, "damaged or cut short"),
        (".npz", npz(iq=IQ)[:-50], None, "damaged or cut short"),
        (".mat", b"time, i, q\n" * 40, None, "not a MATLAB file, whatever its name says: save the samples with"),
        (".mat", b"0 1\n", None, "not a MATLAB file"),
        (".mat", mat(iq=IQ)[:-50], None, "damaged or cut short"),
        (".mat", mat(iq=IQ)[:100], None, "damaged or cut short"),
        (".npy", b"not numpy at all", None, "not an .npy file, whatever its name says"),
        (".npz", npy(IQ), None, "damaged or cut short"),
        (".npy", npz(iq=IQ), None, "not an .npy file, whatever its name says"),
        (".npy", npy(IQ).replace(b"NUMPY\x01", b"NUMPY\x03"), None, "version 3.0 of the .npy format: save the samples"),
        (".npy", pickle.dumps(IQ), None, "not an .npy file, whatever its name says"),
        (".mat", b"\x89HDF\r\n\x1a\n" + bytes(600), None, r"a MATLAB 7.3 file \(HDF5\): save it with version 7"),
        (".npy", npy(IQ), "iq", "variable 'iq' given, but a .npy file holds one array"),
        (".npy", npy(np.array([1j], dtype=object)), None, "Python objects, which is never unpickled here"),
        (".npz", npz(iq=np.array([1j], dtype=object)), None, "iq.npy: an array of Python objects, which is never"),
        (".npz", npz(iq=IQ, o=np.array([1j], dtype=object)), "o", "o.npy: an array of Python objects"),
        (".npz", npz(), None, "no complex array, it holds no array of numbers"),
        (".npz", npz(x=REAL, y=REAL), None, r"no complex array, it holds x float64 \(5,\), y float64 \(5,\): IQ"),
        (".mat", mat(x=REAL, y=REAL), None, r"no complex array, it holds x float64 \(1, 5\)"),
        (".mat", mat(I=REAL, Q=REAL, prf=2e4), None, r"I \+ jQ \(complex64\): store I \+ 1j \* Q"),
        (".npz", npz(imag=REAL, real=REAL), None, r"store real \+ 1j \* imag$"),
        (".npz", npz(time=REAL, voltage=REAL), None, r"I \+ jQ \(complex64\)$"),
        (".mat", mat(data={"iq": IQ}), None, "it holds data, a struct: store the complex samples as an array of their"),
        (".mat", mat(info={"a": 1}), "info", "variable 'info' is a struct: store complex numbers"),
        (".mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + bytes(400), None,
         r"a MATLAB 7.3 file \(HDF5\): save it with version 7"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_one_line(put, suffix, content, variable, said):
    with pytest.raises(BadInput) as caught:
        read_array(put(suffix, content), variable)
    message = str(caught.value)
    assert re.search(said, message), message
    assert f"rec{suffix}" in message
    assert "\n" not in message


@pytest.mark.parametrize(("suffix", "write"), [(".npz", npz), (".mat", mat)])
def test_an_only_array_of_i_and_q_in_pairs_is_told_how_to_join_them(put, suffix, write):
    path = put(suffix, write(iq=np.ones((100, 2), np.int16)))
    with pytest.raises(BadInput, match=r"shape \(100, 2\): I and Q must be one complex number: store x\[..., 0\]"):
        load_recording(path, carrier_hz=10e9, prf_hz=20e3)


class Trap:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = str(folder)

    def __reduce__(self):
        return os.mkdir, (self.folder,)


@pytest.mark.parametrize(("suffix", "write"), [(".npy", npy), (".npz", lambda array: npz(iq=array))])
def test_nothing_is_unpickled(put, tmp_path, suffix, write):
    folder = tmp_path / "sprung"
    with pytest.raises(BadInput, match="never unpickled"):
        read_array(put(suffix, write(np.array([Trap(folder)]))))
    assert not folder.exists()


def test_a_header_that_claims_more_than_memory_is_damage(put):
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<c8", "fortran_order": False, "shape": (10**14,)})
    with pytest.raises(BadInput, match="damaged or cut short"):
        read_array(put(".npy", buffer.getvalue() + IQ.tobytes()))


@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(data=st.data(), kind=st.sampled_from([".npy", ".npz", ".mat"]))
def test_a_damaged_file_is_read_or_refused_and_never_crashes(put, data, kind):
    content = bytearray({".npy": npy(IQ), ".npz": npz(iq=IQ, t=REAL), ".mat": mat(iq=IQ, t=REAL)}[kind])
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(len(content), 400) - 1))] = data.draw(st.integers(0, 255))
    del content[data.draw(st.integers(1, len(content))) :]
    try:
        array = read_array(put(kind, bytes(content)))
    except BadInput:
        return
    assert isinstance(array, np.ndarray)
