"""`bladewing predict`, through `main` in this process and a few times as a user runs it."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier, Recording, answer, load_recording
from bladewing.classify import recording as recordings
from bladewing.classify.cli import main

from .conftest import PRF_HZ, interrupt, no_constant, noise

NAMES = ["uav", "bird", "clutter"]

STILL = {"comb_hz": None, "wingbeat_hz": None, "heave_hz": None, "steps": False}  # without rotors, wings and limbs


@pytest.fixture
def run(uav_model, capsys, monkeypatch):
    """Run predict with a model that always answers uav 0.8; gives the exit code, stdout and stderr."""
    monkeypatch.setenv("COLUMNS", "80")

    def predict(*arguments: object, model: object = uav_model) -> tuple[int, str, str]:
        code = main(["predict", "--model", str(model), *map(str, arguments)])
        return code, *capsys.readouterr()

    return predict


@pytest.fixture
def run_json(run):
    def predict(*arguments: object, **options: object) -> list[dict]:
        code, out, err = run("--json", *arguments, **options)
        assert (code, err) == (0, "")
        return [json.loads(line, parse_constant=no_constant) for line in out.splitlines()]

    return predict


def refused(result, said: str) -> None:
    """Exit code 2, one line on stderr, nothing on stdout."""
    code, out, err = result
    assert said in err
    assert err.startswith("bladewing: error: ")
    assert err.count("\n") == 1
    assert err.endswith("\n")
    assert (code, out) == (2, "")


def test_one_line_a_dwell_and_a_closing_line(run_json, sigmf_pair):
    meta = sigmf_pair()  # 4000 pulses at 20 kHz: 0.2 s, two dwells of 0.08 s and a rest that is left out
    first, second, closing = run_json(meta)
    said = {"file": str(meta), "label": "uav", "probabilities": {"uav": 0.8, "bird": 0.15, "clutter": 0.05}}
    assert first == said | {"start_s": 0.0, "stop_s": 0.08, "reason": None}
    assert second == said | {"start_s": 0.08, "stop_s": 0.16, "reason": None}
    assert list(first) == ["file", "start_s", "stop_s", "label", "probabilities", "reason"]
    assert list(closing) == ["file", "track"]
    told = [
        "label",
        "probabilities",
        "reason",
        "dwells",
        "used",
        "declared",
        "declared_s",
        *STILL,
        "left_out_s",
        "remarks",
    ]
    assert list(closing["track"]) == told
    assert closing["track"]["left_out_s"] == 0.04
    assert closing["track"]["remarks"] == ["the last 0.04 s, shorter than a dwell, are left out"]
    assert (closing["track"]["label"], closing["track"]["dwells"]) == ("uav", 2)
    assert (closing["track"]["declared"], closing["track"]["declared_s"]) == ("uav", 0.08)
    assert list(closing["track"]["probabilities"]) == NAMES
    assert closing["track"]["probabilities"]["uav"] > 0.8  # two dwells that agree


@pytest.mark.parametrize(
    ("dwell_s", "ends"),
    [
        (0.05, [0.05, 0.1, 0.15, 0.2]),
        (0.2, [0.2]),
        (0.11, [0.11]),
        (5.0, [0.2]),  # shorter than one dwell: taken whole
        (0.066674, [0.06665, 0.1333, 0.19995]),  # whole pulses: round(dwell x PRF) = 1333
    ],
)
def test_dwells_follow_one_another(run_json, sigmf_pair, dwell_s, ends):
    *dwells, closing = run_json(sigmf_pair(), "--dwell", dwell_s)
    assert [line["stop_s"] for line in dwells] == ends
    assert [line["start_s"] for line in dwells] == [0.0, *ends[:-1]]
    assert closing["track"]["dwells"] == len(ends)


def test_times_go_on_where_the_recording_begins(run_json, sigmf_pair):
    captures = [{"core:sample_start": 20_000, "core:frequency": 10e9}]
    first, *_ = run_json(sigmf_pair(captures=captures, offset=20_000))
    assert (first["start_s"], first["stop_s"]) == (1.0, 1.08)


def test_outside_the_envelope_is_answered_unknown_with_the_cure(run_json, sigmf_pair):
    *dwells, closing = run_json(sigmf_pair(sample_rate=1000.0), "--dwell", 1)
    assert {line["label"] for line in dwells} == {"unknown"}
    assert {line["reason"] for line in dwells} == {
        "unambiguous velocity 7.5 m/s is below 10 m/s (wavelength x PRF / 4): raise the PRF to 1335 Hz or more"
    }
    assert dwells[0]["probabilities"] == dict.fromkeys(NAMES, 0.333333)
    nothing = {"label": "unknown", "probabilities": dict.fromkeys(NAMES, 0.333333), "declared": None}
    nothing |= {"reason": "no dwell could be judged", "dwells": 4, "used": 0}
    assert closing["track"] == nothing | {"declared_s": None, "left_out_s": 0.0, "remarks": []} | STILL


def test_a_dwell_too_short_is_unknown(run_json, sigmf_pair):
    first, *_ = run_json(sigmf_pair(), "--dwell", 0.001)
    assert first["reason"].startswith("20 pulses are fewer than 64: take 100 pulses, 0.005 s, or more")


@pytest.mark.parametrize("pulses", [1, 2, 63])
def test_a_recording_with_fewer_pulses_than_the_model_needs_is_unknown(run_json, tmp_path, pulses):
    np.save(tmp_path / "short.npy", noise(pulses))
    dwell, closing = run_json(tmp_path / "short.npy", "--carrier-hz", 10e9, "--prf-hz", 10e3)
    assert dwell["label"] == closing["track"]["label"] == "unknown"
    few = "1 pulse is" if pulses == 1 else f"{pulses} pulses are"
    assert dwell["reason"].startswith(f"{few} fewer than 64: take 64 pulses, 0.0064 s, or more")


@pytest.mark.parametrize("largest", [1e-39, 3.3e38])
def test_a_recording_at_the_ends_of_float32_is_answered_as_any_other(run_json, tmp_path, largest):
    iq = noise(50_000)
    answers = {}
    for name, gain in (("usual", 1.0), ("extreme", largest / max(abs(iq.real).max(), abs(iq.imag).max()))):
        np.save(tmp_path / f"{name}.npy", (iq * gain).astype(np.complex64))
        *_, closing = run_json(tmp_path / f"{name}.npy", "--carrier-hz", 10e9, "--prf-hz", 25e3)
        answers[name] = closing["track"]["label"]
    assert answers["extreme"] == answers["usual"]


def test_a_silent_dwell_is_unknown_and_left_out_of_the_track(run_json, sigmf_pair):
    iq = noise(3200)
    iq[:1600] = 0
    silent, heard, closing = run_json(sigmf_pair(iq=iq))
    (remark,) = closing["track"].pop("remarks")
    assert remark.startswith("silence: 1600 pulses in a row are exactly 0 from 0 s on")
    assert (silent["label"], silent["reason"]) == ("unknown", "no signal: every sample is 0")
    said = {"label": "uav", "probabilities": heard["probabilities"], "reason": None, "dwells": 2, "used": 1}
    assert closing["track"] == said | {
        "declared": "uav",
        "declared_s": 0.16,
        "left_out_s": 0.0,
        **STILL,
    }  # the silent dwell took its time


def test_a_clipped_recording_is_answered_with_a_remark(run_json, sigmf_pair):
    iq = noise(3200)
    clipped = (iq.real.clip(-1, 1) + 1j * iq.imag.clip(-1, 1)).astype(np.complex64)
    *_, closing = run_json(sigmf_pair(iq=clipped))
    (remark,) = closing["track"]["remarks"]
    many = sum(int((abs(part) == 1).sum()) for part in (clipped.real, clipped.imag))
    assert remark.startswith(f"clipped: {many} values of I and Q stand at the converter's largest")
    assert remark.endswith("lower the gain")


def test_both_files_of_a_recording_are_answered_once(run_json, sigmf_pair, tmp_path):
    meta = sigmf_pair("my rec 3.30GHz")
    data, stem = meta.with_suffix(".sigmf-data"), meta.with_suffix("")
    (tmp_path / "sub").mkdir()
    (tmp_path / "link").symlink_to(tmp_path)
    ways = [os.path.relpath(meta), *(tmp_path / way / meta.name for way in ("sub/..", "link"))]
    lines = run_json(data, meta, stem, meta.parent / "." / meta.name, *ways)
    assert [line["file"] for line in lines] == [str(data)] * 3


def test_links_to_the_same_metadata_are_recordings_of_their_own(run_json, sigmf_pair):
    first, second = sigmf_pair("a"), sigmf_pair("b", iq=noise(1600))
    for meta in (first, second):
        meta.unlink(missing_ok=True)
        meta.symlink_to("common.json")
    (first.parent / "common.json").write_bytes(sigmf_pair("other").read_bytes())
    closing = [line for line in run_json(first, second) if "track" in line]
    assert [(line["file"], line["track"]["dwells"]) for line in closing] == [(str(first), 2), (str(second), 1)]


def test_arrays_take_the_radar_from_the_options(run_json, tmp_path):
    np.save(tmp_path / "iq.npy", noise(1600).reshape(-1, 1))
    np.savez(tmp_path / "two.npz", a=noise(1600), b=noise(3200))
    radar = ("--carrier-hz", 10e9, "--prf-hz", PRF_HZ)
    assert len(run_json(tmp_path / "iq.npy", *radar)) == 2
    assert len(run_json(tmp_path / "two.npz", *radar, "--variable", "b")) == 3


def test_good_recordings_are_answered_beside_a_bad_one(run, sigmf_pair, tmp_path):
    good, bad = sigmf_pair("good"), sigmf_pair("bad", datatype="rf32_le")
    code, out, err = run("--json", tmp_path / "gone.npy", bad, good)
    assert code == 2
    assert {json.loads(line)["file"] for line in out.splitlines()} == {str(good)}
    first, second = err.splitlines()
    assert first.startswith(f"bladewing: error: {tmp_path / 'gone.npy'}: no such file")
    assert second.startswith(f"bladewing: error: {bad}: real samples")


def test_people_get_a_table_that_fits_80_columns(run, sigmf_pair):
    code, out, err = run(sigmf_pair("one"), sigmf_pair("two", sample_rate=1000.0), "--dwell", 1)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert not [line for line in lines if line.endswith(" ")]
    table = [line for line in lines if ".sigmf-" not in line]  # a path is as long as it is
    assert max(map(len, table)) <= 80
    assert lines[0].endswith("one.sigmf-meta")
    assert lines[1].split() == ["start", "s", "stop", "s", "label", *NAMES, "reason"]
    assert lines[2].split() == ["0.000", "0.200", "uav", "0.80", "0.15", "0.05"]
    assert lines[3] == "track: uav  uav 0.80  bird 0.15  clutter 0.05  from 1 dwell: 1 named"
    assert lines[4] == "its 0.2 s, shorter than a dwell of 1 s, are taken whole"
    assert lines[5] == "declared uav after 0.2 s"
    text = " ".join(out.split())
    assert "unambiguous velocity 7.5 m/s is below 10 m/s" in text
    assert "0.000 4.000 unknown 0.33 0.33 0.33 4 dwells: unambiguous" in text  # one reason for all
    assert text.count("unknown 0.33") == 1
    assert "from 4 dwells: 4 not judged (no dwell could be judged)" in text
    assert lines[-1] == "2 recordings: 1 uav, 1 unknown"


@pytest.mark.parametrize("columns", ["0", "20", "40"])
def test_no_number_and_no_reason_is_lost_on_a_narrow_terminal(run, sigmf_pair, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    code, out, err = run(sigmf_pair("one"), sigmf_pair("two", sample_rate=1000.0))
    assert (code, err) == (0, "")
    assert "…" not in out
    text = " ".join(out.split())
    assert "0.000 0.080 uav 0.80 0.15 0.05" in text
    assert all(word in text for word in ("unambiguous", "velocity", "7.5", "below", "raise", "PRF"))


def test_words_are_wrapped_at_the_width_of_the_terminal_and_a_reason_is_no_thin_column(run, sigmf_pair, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    code, out, err = run(sigmf_pair("two", sample_rate=1000.0))
    assert (code, err) == (0, "")
    _, _, row, *words = out.splitlines()
    assert "0.33 50 dwells: unambiguous velocity 7.5 m/s is below 10 m/s (wavelength x PRF / 4): raise" in row
    assert max(map(len, words)) <= 40
    assert not [line for line in words if line.endswith(" ")]
    assert " ".join(" ".join(words).split()).endswith("from 50 dwells: 50 not judged (no dwell could be judged)")


def test_the_summary_counts_the_unreadable(run, sigmf_pair, tmp_path):
    code, out, _ = run(sigmf_pair(), tmp_path / "gone")
    assert code == 2
    assert out.splitlines()[-1] == "2 recordings: 1 uav, 1 unreadable"


def test_a_recording_that_may_not_be_read_does_not_stop_the_others(run, tmp_path, monkeypatch):
    locked = tmp_path / "locked.npy"
    for file in (locked, locked.with_name("other.npy")):
        np.save(file, np.exp(0.3j * np.arange(2000)))
    real = open

    def refusing(path, *given, **more):
        if path == locked:
            raise PermissionError(13, "Permission denied", str(path))
        return real(path, *given, **more)

    monkeypatch.setattr("builtins.open", refusing)
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != locked)
    code, out, err = run(locked, locked.with_name("other.npy"), "--carrier-hz", 10e9, "--prf-hz", 20e3)
    assert (code, out.splitlines()[-1].split(":")[0]) == (2, "2 recordings")
    assert err.count("\n") == 1
    assert "locked.npy: cannot be read: Permission denied" in err


def test_names_are_never_taken_for_markup_or_escape_codes(run, sigmf_pair):
    code, out, err = run(sigmf_pair("[bold]x\x1b[31m"))
    assert (code, err) == (0, "")
    assert r"[bold]x\x1b[31m.sigmf-meta" in out.splitlines()[0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("{rec}", "--dwell", "0"), "--dwell [s] is 0: it must be a finite number above 0"),
        (("{rec}", "--dwell", "-0.1"), "--dwell [s] is -0.1"),
        (("{rec}", "--dwell", "nan"), "--dwell [s] is nan"),
        (("{rec}", "--dwell", "long"), "--dwell is 'long': it must be a number"),
        (("{rec}", "--carrier-hz", "9e9"), "carrier 9000000000 Hz given, but the file says 10000000000 Hz"),
        (("{rec}", "--carrier-hz", "0"), "carrier given (--carrier-hz) is 0"),
        (("{rec}", "--prf-hz", "x"), "--prf-hz is 'x': it must be a number"),
        (("{npy}", "--carrier-hz", "9e9", "--prf-hz", "25"), "x.npy: PRF 25 Hz is below 1000 Hz: give 25 kHz as 25e3"),
        (("{rec}", "--variable", "x"), "variable 'x' given"),
        (("{rec}", "--max-false-alarm", "0"), "--max-false-alarm is 0: it must be a finite number above 0"),
        (("{rec}", "--coverage", "-1"), "--coverage is -1"),
        (("{rec}", "--budget-us", "nan"), "--budget-us is nan"),
        (("{rec}", "--no-such-option"), "No such option: --no-such-option (see bladewing predict --help)"),
        (("-cell.npy",), "No such option: -c: a name that begins with - is given after --, as in -- -name.npy"),
        ((), "Missing argument 'RECORDING'"),
        (("{folder}",), "is a directory: name the recordings in it"),
        (("{folder}/gone.npy",), "no such file"),
    ],
)
@pytest.mark.parametrize("as_json", [(), ("--json",)])
def test_bad_arguments(run, sigmf_pair, tmp_path, arguments, said, as_json):
    meta = sigmf_pair()
    npy = tmp_path / "x.npy"
    np.save(npy, noise(1000))
    refused(run(*as_json, *(text.format(rec=meta, folder=tmp_path, npy=npy) for text in arguments)), said)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"data": bytes(803)}, "cut short: 803 bytes"),
        ({"data": b""}, "its data are empty"),
        ({"sha512": "0" * 128}, "the SHA-512 of its samples is not the one in core:sha512"),
        ({"sample_rate": None}, "give --prf-hz"),
        ({"captures": []}, "give --carrier-hz"),
        ({"captures": [{"core:sample_start": 0, "core:frequency": f} for f in (9e9, 10e9)]}, "2 carriers"),
        ({"sample_rate": 25.0}, "PRF 25 Hz is below 1000 Hz: give 25 kHz as 25e3"),
        ({"num_channels": 2}, "2 channels"),
        ({"datatype": "ri16_le"}, "real samples"),
        ({"iq": np.full(100, np.nan, dtype=np.complex64)}, "sample 0 is"),
        ({"annotations": [{"core:sample_start": 0, "core:sample_count": 4001}]}, "cut short: annotations[0]"),
    ],
)
def test_bad_recordings(run, sigmf_pair, change, said):
    refused(run("--json", sigmf_pair(**change)), said)


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.array([{}], dtype=object), "never unpickled"),
        (np.zeros(100, dtype=[("i", "f4"), ("q", "f4")]), "structured array"),
        (np.ones(100), "real samples"),
        (np.ones((2, 100), dtype=complex), "shape (2, 100): a recording is one range cell, shape (pulses,)"),
        (np.ones(0, dtype=complex), "no samples"),
    ],
)
def test_bad_arrays(run, tmp_path, array, said):
    np.save(tmp_path / "x.npy", array, allow_pickle=True)
    refused(run("--json", tmp_path / "x.npy", "--carrier-hz", 10e9, "--prf-hz", PRF_HZ), said)


def test_bad_models(run, sigmf_pair, tmp_path, uav_model):
    meta = sigmf_pair()
    refused(
        run(meta, model="no-such-model"),
        "no model 'no-such-model': give the path of an .onnx file or one of the shipped: ",
    )
    (tmp_path / "foreign.onnx").write_bytes(b"x" * 100)
    refused(run(meta, model=tmp_path / "foreign.onnx"), "foreign.onnx: not a bladewing model")
    content = bytearray(uav_model.read_bytes())
    content[len(content) // 3] ^= 1
    (tmp_path / "altered.onnx").write_bytes(content)
    refused(run(meta, model=tmp_path / "altered.onnx"), "altered.onnx: the model was altered after it was written")


def test_interrupted_by_the_user(run, sigmf_pair, monkeypatch):
    monkeypatch.setattr(recordings, "load_recording", interrupt)
    assert run("--json", sigmf_pair()) == (130, "", "bladewing: stopped: interrupted\n")


def test_an_interrupt_that_a_library_makes_another_error_of_is_one(run, sigmf_pair, monkeypatch):
    def fail(*_, **__):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as stop:
            raise ImportError("initialization failed") from stop

    monkeypatch.setattr(recordings, "load_recording", fail)
    assert run("--json", sigmf_pair()) == (130, "", "bladewing: stopped: interrupted\n")


def test_nothing_is_kept_in_the_home_nor_sent(sigmf_pair, uav_model, tmp_path):
    """As onnxruntime's telemetry does."""
    home = tmp_path / "home"
    home.mkdir()
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("ORT_", "XDG_"))}
    command = [sys.executable, "-m", "bladewing.classify", "predict", "--model", str(uav_model), str(sigmf_pair())]
    told = subprocess.run(command, env={**kept, "HOME": str(home)}, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stderr) == (0, "")
    assert not list(home.rglob("*"))


def test_what_nobody_expected_is_one_line_and_exit_code_1(run, sigmf_pair, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr(recordings, "load_recording", fail)
    code, out, err = run("--json", sigmf_pair())
    assert (code, out) == (1, "")
    assert (
        err == "bladewing: error: unexpected ZeroDivisionError: two\\nlines (set BLADEWING_TRACEBACK=1 to see where)\n"
    )
    monkeypatch.setenv("BLADEWING_TRACEBACK", "1")
    assert 'raise ZeroDivisionError("two\\nlines")' in run("--json", sigmf_pair())[2]


def test_what_nobody_expected_is_a_line_that_can_be_read_however_much_it_says(run, sigmf_pair, monkeypatch):
    def fail(*_, **__):
        raise TypeError(f"nodes hold {'0.0, ' * 10_000}")

    monkeypatch.setattr(recordings, "load_recording", fail)
    code, _, err = run("--json", sigmf_pair())
    assert code == 1
    assert "TypeError: nodes hold 0.0, " in err
    assert err.endswith("... (set BLADEWING_TRACEBACK=1 to see where)\n")
    assert len(err) < 400


ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
BLADEWING = [sys.executable, "-c", "import sys; from bladewing.classify.cli import main; sys.exit(main())"]


def as_a_user(
    *arguments: object, cwd: Path, environment: Mapping[str, str] = MappingProxyType({})
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*BLADEWING, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        env=ENVIRONMENT | environment,
    )


def test_a_bad_recording_as_a_user_meets_it(tmp_path, sigmf_pair, uav_model):
    folder = tmp_path / "cwd"
    folder.mkdir()
    cut = sigmf_pair("cut", data=bytes(803))
    for arguments in ((cut, "--model", uav_model), (cut, "--model", "nope"), ("gone", "--model", uav_model)):
        done = as_a_user("predict", "--json", *arguments, cwd=folder)
        refused((done.returncode, done.stdout, done.stderr), "error")
    assert list(folder.iterdir()) == []


def test_warnings_of_libraries_do_not_reach_the_user(tmp_path, sigmf_pair, uav_model):
    # an undeclared namespace and an old version make the library warn
    meta = sigmf_pair(version="0.0.1", x=1)
    text = meta.read_text().replace('"core:x"', '"mine:x"')
    meta.write_text(text)
    done = as_a_user("predict", "--json", meta, "--model", uav_model, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) == 3


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_name_that_the_output_cannot_hold_is_shown_escaped(tmp_path, uav_model, options):
    np.save(tmp_path / "h\u00e9ron.npy", noise(2000))
    names = "h\u00e9ron.npy", "\u2603.npy"
    radar = "--carrier-hz", 10e9, "--prf-hz", 10e3
    ascii_only = {"PYTHONIOENCODING": "ascii"}
    done = as_a_user("predict", *names, "--model", uav_model, *radar, *options, cwd=tmp_path, environment=ascii_only)
    assert done.returncode == 2  # of the second, which is not there
    assert done.stderr.startswith("bladewing: error: \\u2603.npy: no such file")
    assert r"h\xe9ron.npy" in done.stdout or r"h\u00e9ron.npy" in done.stdout


def test_a_closed_pipe_ends_quietly(sigmf_pair, uav_model):
    meta = sigmf_pair()
    with subprocess.Popen(
        [*BLADEWING, "predict", "--json", str(meta), "--model", str(uav_model)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=ENVIRONMENT,
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.close()  # as `head` does
        assert child.stderr.read() == b""
    assert child.returncode == 1


def test_the_measured_recordings_are_answered(run_json):
    folder = Path(__file__).parents[2].parent / "shared" / "recordings"
    if not folder.is_dir():
        pytest.skip("the measured recordings are not part of the repository")
    names = sorted(folder.glob("*.sigmf-*"))
    lines = run_json(*names)
    closing = [line for line in lines if "track" in line]
    assert len(closing) == len(names) // 2
    assert sum(line["track"]["dwells"] for line in closing) == len(lines) - len(closing)


def test_python_gives_what_the_command_says(run_json, sigmf_pair, uav_model):
    path = sigmf_pair()
    *said, closing = run_json(str(path))
    given = answer(load_recording(path), Classifier.load(uav_model))
    assert [row["label"] for row in said] == given.dwells.labels.tolist()
    assert closing["track"]["label"] == given.track.label
    for wrong in (0, -1.0, np.nan, "0.08"):
        with pytest.raises(BadInput, match=r"^dwell_s is .*above 0"):
            answer(load_recording(path), Classifier.load(uav_model), dwell_s=wrong)


def test_samples_in_memory_are_answered_as_a_recording_and_not_without(sigmf_pair, uav_model):
    path, model = sigmf_pair(), Classifier.load(uav_model)
    read = load_recording(path)
    given = answer(Recording("cell 7", read.iq, read.carrier_hz, read.prf_hz), model)
    assert given.track.label == answer(read, model).track.label
    for wrong, kind in ((str(path), "str"), (read.iq, "ndarray")):
        with pytest.raises(
            BadInput, match=rf"^recording is of type {kind}: .* Recording\(name, iq, carrier_hz, prf_hz\)"
        ):
            answer(wrong, model)
