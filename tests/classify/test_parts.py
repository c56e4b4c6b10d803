"""Finished parts of a run: taken once, only by the same run, never from a damaged or a foreign file."""

import io
import pickle
from pathlib import Path

import numpy as np
import pytest
from bladewing.classify.errors import BadInput
from bladewing.classify.files import only_writer
from bladewing.classify.parts import Parts

from .conftest import interrupt


def test_parts_are_measured_once_and_only_for_the_same_run(tmp_path: Path) -> None:
    made: list[int] = []

    def measure() -> list[int]:
        made.append(len(made))
        return [len(made)]

    parts = Parts(tmp_path / "parts", {"seed": 0})
    assert not parts.have("one")
    assert parts.take("one", measure) == [1]
    assert Parts(tmp_path / "parts", {"seed": 0}).take("one", measure) == [1]
    other = Parts(tmp_path / "parts", {"seed": 1})
    assert other.take("one", measure) == [2]
    parts.forget()
    other.forget()
    assert not list((tmp_path / "parts").iterdir())


def test_an_interrupted_part_is_not_taken_for_a_finished_one(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "parts", {})
    with pytest.raises(KeyboardInterrupt):
        parts.take("one", interrupt)
    assert not parts.have("one")


ARRAYS = {"one": np.arange(300.0), "two": np.array([1, 2], np.uint8), "a/b": np.array(3)}


def _kept(tmp_path: Path) -> tuple[Parts, Path]:
    parts = Parts(tmp_path / "parts", {})
    parts.keep_arrays("some", ARRAYS)
    (file,) = (tmp_path / "parts").glob("*/some.npz")
    return parts, file


def test_arrays_come_back_to_the_bit_and_only_for_the_same_run(tmp_path: Path) -> None:
    parts, _ = _kept(tmp_path)
    found = Parts(tmp_path / "parts", {}).arrays("some")
    assert found is not None
    assert {name: (values.dtype, values.tobytes()) for name, values in found.items()} == {
        name: (values.dtype, values.tobytes()) for name, values in ARRAYS.items()
    }
    assert Parts(tmp_path / "parts", {"seed": 1}).arrays("some") is None
    assert parts.arrays("other") is None


def test_a_damaged_part_is_one_line_or_what_was_kept(tmp_path: Path) -> None:
    parts, file = _kept(tmp_path)
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    cut = [whole[:stop] for stop in (0, 1, 4, *rng.integers(5, len(whole), 40))]
    turned = []
    for place in rng.integers(0, len(whole), 400):
        one = bytearray(whole)
        one[place] ^= 1 << rng.integers(8)
        turned.append(bytes(one))
    said = []
    for content in cut + turned:
        file.write_bytes(content)
        try:
            found = parts.arrays("some")
        except BadInput as refusal:
            said.append(str(refusal))
        else:  # a bit that no reader looks at, a date say, or that stands in a name
            assert found is not None
            for name in ARRAYS.keys() & found.keys():
                assert found[name].tobytes() == ARRAYS[name].tobytes()
    assert len(said) > 0.8 * len(cut + turned)
    assert all("some.npz: not what" in line and line.endswith("remove it and start again") for line in said)


def test_a_run_that_is_done_leaves_the_parts_of_another(tmp_path: Path) -> None:
    one, other = (Parts(tmp_path / "parts", {"seed": seed}) for seed in (1, 2))
    for parts in (one, other):
        parts.keep_arrays("some", {"values": np.arange(3)})
    one.forget()
    assert not one.begun
    assert other.begun
    held = sum(file.stat().st_size for file in (tmp_path / "parts").rglob("*.npz"))
    assert one.others().startswith(f"{tmp_path / 'parts'} holds an unfinished run of other settings")
    assert f"{held / 1e6:.3g} MB" in one.others()
    assert other.others() == ""
    with other.alone():
        other.forget()
    assert not list(tmp_path.iterdir())


class _Bomb:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return pytest.fail, ("a pickle was loaded",)


def test_a_pickle_is_never_loaded(tmp_path: Path) -> None:
    parts, file = _kept(tmp_path)
    hidden = io.BytesIO()
    np.savez(hidden, one=np.array([_Bomb()], dtype=object))
    alone = io.BytesIO()
    np.save(alone, np.arange(3))
    for content in (hidden.getvalue(), alone.getvalue(), pickle.dumps(_Bomb())):
        file.write_bytes(content)
        with pytest.raises(BadInput, match=r"some\.npz: not what this run kept"):
            parts.arrays("some")


def test_a_damaged_measurement_is_one_line(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "parts", {})
    parts.take("one", lambda: [1])
    (file,) = (tmp_path / "parts").glob("*/one.json")
    file.write_text("[1")
    with pytest.raises(BadInput, match=r"one\.json: not what this run kept"):
        parts.take("one", lambda: [1])


@pytest.mark.parametrize("done", ["nothing", "a part", "all"])
def test_two_runs_do_not_work_for_the_same_place(tmp_path, done):
    one, other = (Parts(tmp_path / "parts", {"seed": seed}) for seed in (1, 2))
    with one.alone():
        if done != "nothing":
            one.take("a", lambda: 1)
        if done == "all":
            one.forget()
        for _ in range(2):  # one that is refused leaves the others shut out
            with pytest.raises(BadInput, match="another run is at work there: let it finish"), other.alone():
                raise AssertionError
        assert one.have("a") == (done == "a part")
    with other.alone():  # what was kept is there for the one that goes on
        assert one.have("a") == (done == "a part")
        one.forget()
    assert list(tmp_path.iterdir()) == []


def test_a_lock_of_a_folder_that_was_made_anew_is_no_lock(tmp_path, monkeypatch):
    """Between opening the folder and locking it, its holder removes it, and a third run makes it again."""
    fcntl = pytest.importorskip("fcntl")
    flock, folder = fcntl.flock, tmp_path / "parts"
    folder.mkdir()

    def late(descriptor, how):
        if not made:
            made.append(folder.rename(tmp_path / "removed"))
            folder.mkdir()
        flock(descriptor, how)

    made: list[Path] = []
    monkeypatch.setattr(fcntl, "flock", late)
    with only_writer(folder, wait=False), pytest.raises(BlockingIOError), only_writer(folder, wait=False):
        raise AssertionError
    assert made
