"""`bladewing simulate`: a scene in, a SigMF recording with its truth out, or one line a problem and nothing."""

import json
import os
import re
from dataclasses import replace

import numpy as np
import pytest
import sigmf
from bladewing.classify.cli import main
from bladewing.classify.recording import load_recording
from bladewing.simulate.scene import Scene

from .conftest import content

SCENE = """
title = "test"
[radar]
carrier_hz = 9.85e9
prf_hz = 20e3
pulses = 500
[[uav]]
name = "drone"
airframe = "quadcopter_12cm"
velocity_mps = -8.0
[[bird]]
name = "gull"
species = "herring_gull"
[[clutter]]
name = "ground"
kind = "ground"
level_db = 10.0
"""


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_a_scene_becomes_a_recording_that_sigmf_validates_and_predict_can_read(scene_file, tmp_path, capsys):
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec"), "--seed", "7"]) == 0
    assert capsys.readouterr().err == ""
    recording = load_recording(tmp_path / "rec")
    assert recording.carrier_hz == 9.85e9
    assert recording.prf_hz == 20e3
    np.testing.assert_array_equal(recording.iq, Scene.load(scene_file).render(7).iq)
    found = sigmf.fromfile(str(tmp_path / "rec.sigmf-meta"))
    found.validate()
    assert found.get_global_info()["core:extensions"] == [{"name": "bladewing", "version": "1.0.0", "optional": True}]
    truth = {entry["core:label"]: entry for entry in found.get_annotations()}
    assert set(truth) == {"drone", "gull", "ground"}
    assert truth["drone"]["bladewing:label"] == "uav"
    assert truth["drone"]["bladewing:velocity_mps"] == -8.0
    assert truth["drone"]["bladewing:chopping_hz"] == pytest.approx([138.0, 139.4, 140.6, 142.0])
    assert truth["gull"]["bladewing:wingbeat_hz"] == pytest.approx(3.69, abs=0.01)
    assert truth["ground"]["bladewing:wind_mph"] > 0
    assert all(entry["core:sample_count"] == 500 for entry in truth.values())


@pytest.mark.parametrize("suffix", [".sigmf", ".sigmf-meta", ".sigmf-data", ".sigmf.gz", ".sigmf.zip"])
def test_the_name_of_a_recording_may_carry_a_suffix_of_sigmf(scene_file, tmp_path, suffix, capsys):
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / f"rec.v1{suffix}")]) == 0
    written = {str(tmp_path / f"rec.v1.sigmf-{kind}") for kind in ("data", "meta")}
    assert set(capsys.readouterr().out.split()) == written == {str(path) for path in tmp_path.glob("rec*")}


@pytest.mark.parametrize("held", ["rec.sigmf-data", "rec.sigmf-meta", "both", "another"])
def test_a_recording_that_was_not_simulated_is_not_written_over(scene_file, tmp_path, capsys, held):
    if held in ("both", "another"):
        recorder = {"core:recorder": "an oscilloscope"} if held == "another" else {}
        (tmp_path / "rec.sigmf-meta").write_text(json.dumps({"global": recorder}))
        (tmp_path / "rec.sigmf-data").write_bytes(b"measured")
    else:
        (tmp_path / held).write_bytes(b"measured")
    before = content(tmp_path)
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 2
    assert "was not simulated: it is not written over: give another --out NAME" in capsys.readouterr().err
    assert content(tmp_path) == before
    # what was simulated is replaced
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "own")]) == 0
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "own"), "--seed", "2"]) == 0
    assert json.loads((tmp_path / "own.sigmf-meta").read_text())["global"]["bladewing:seed"] == 2


def test_the_same_command_goes_on_after_it_was_killed_between_two_files(scene_file, tmp_path, monkeypatch):
    replace, done = os.replace, []

    def once(source, target):
        if not str(target).endswith(".json"):
            if done:
                raise KeyboardInterrupt
            done.append(target)
        replace(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", once)
        assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) != 0
    assert not (tmp_path / "rec.sigmf-meta").exists()
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec"), "--seed", "2"]) == 0
    assert json.loads((tmp_path / "rec.sigmf-meta").read_text())["global"]["bladewing:seed"] == 2
    assert sorted(path.suffix for path in tmp_path.glob("rec*")) == [".sigmf-data", ".sigmf-meta"]


def test_the_recording_holds_the_scene_it_was_made_from(scene_file, tmp_path):
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec.sigmf-meta"), "--seed", "3", "--full"]) == 0
    info = json.loads((tmp_path / "rec.sigmf-meta").read_text())["global"]
    again = Scene.build(info["bladewing:scene"]).render(info["bladewing:seed"], full=True)
    np.testing.assert_array_equal(again.iq, load_recording(tmp_path / "rec").iq)


def test_explain_says_what_is_left_out_and_writes_nothing(scene_file, tmp_path, capsys):
    assert main(["simulate", str(scene_file), "--explain", "--tolerance-db", "20"]) == 0
    said = capsys.readouterr().out
    assert "tolerance +20.0 dB" in said
    assert "drone: range curvature along the blades: left out (far field, eq. 4: blades in closed form)" in said
    assert "drone: closed form" in said
    assert main(["simulate", str(scene_file), "--explain", "--full"]) == 0
    assert "nothing is left out" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == [scene_file]


def test_what_is_explained_is_the_plan_of_the_seed_that_is_rendered(scene_file, capsys):
    """What a receiver does is drawn by the seed."""
    scene_file.write_text(f'{SCENE}[receiver]\neffects = ["fading", "image", "mains"]\n')
    plans = {seed: Scene.load(scene_file).plan(seed).explain() for seed in (0, 3)}
    assert plans[0] != plans[3]
    for seed, plan in plans.items():
        assert main(["simulate", str(scene_file), "--explain", "--seed", str(seed)]) == 0
        assert capsys.readouterr().out.strip() == plan


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("pulses = 500", "pulses = 0"), "radar.pulses is 0: it should be greater than or equal to 1"),
        (("velocity_mps = -8.0", "velocity_mps = nan"), "uav[0].velocity_mps is nan: it should be a finite number"),
        (("velocity_mps = -8.0", "velocity_mps = 1e300"), "velocity_mps is 1e+300: it should be less than or equal to"),
        (("[radar]", "[radar"), "not TOML"),
        (("level_db = 10.0", "level_db = 10.0\nlevel = 3"), "unknown field clutter[0].level: the fields are"),
    ],
)
def test_a_bad_scene_is_one_line_and_nothing_written(scene_file, tmp_path, capsys, change, said):
    scene_file.write_text(SCENE.replace(*change))
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert err.count("\n") == 1
    assert err.startswith("bladewing: error: ")
    assert list(tmp_path.iterdir()) == [scene_file]


def test_samples_beyond_their_type_are_refused_and_nothing_written(scene_file, tmp_path, capsys, monkeypatch):
    from bladewing.simulate import render as module

    real, spoilt = module.render, np.full(500, np.inf, np.complex64)
    monkeypatch.setattr(module, "render", lambda *given, **options: replace(real(*given, **options), iq=spoilt))
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 2
    assert "the scene's samples exceed what complex64 holds" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [scene_file]


def test_several_problems_have_a_line_each(scene_file, tmp_path, capsys):
    scene_file.write_text(SCENE.replace("pulses = 500", "pulses = 0").replace("-8.0", "inf"))
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith("bladewing: error: ") for line in lines)


def test_what_aliases_is_rendered_and_warned_of(scene_file, tmp_path, capsys):
    scene_file.write_text(SCENE.replace("prf_hz = 20e3", "prf_hz = 4e3"))
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 0
    warnings = capsys.readouterr().err.splitlines()
    assert len(warnings) == 1  # of all four rotors
    assert all("warning" in line and "alias" in line for line in warnings)
    assert (tmp_path / "rec.sigmf-data").is_file()


@pytest.mark.parametrize(
    "arguments",
    [["type1"], ["nowhere.toml", "--explain"], ["type1", "--out", "missing/folder/rec"], ["type1", "--out", "."],
     ["type1", "--explain", "--tolerance-db", "nan"]],
)  # fmt: skip
def test_wrong_arguments_are_one_line(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_values_that_nothing_uses_are_warned_of_on_the_terminal(scene_file, tmp_path, capsys):
    unused = "\n[receiver]\nvalues = { fading_db = 6.0, rain_width_mps = 1.0 }\n"
    scene_file.write_text(SCENE + unused)
    assert main(["simulate", str(scene_file), "--out", str(tmp_path / "rec")]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert 'fading_db changes nothing without "fading" among the effects' in lines[0]
    assert "rain_width_mps changes nothing of a receiver" in lines[1]


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ('[[bird]]\nname = "Möwe"\nspecies = "herring_gull"', r"bird\[1\].name is 'Möwe': it must begin with a letter"),
        ('[receiver]\neffects = "fading"', r"receiver.effects is 'fading': it must be a list: write \[...\] about it"),
        ("[receiver]\nvalues = [1]", r"receiver.values is \[1\]: it must be a table: write { name = number }"),
    ],
)
def test_a_field_of_another_kind_gets_its_cure(scene_file, capsys, added, said):
    scene_file.write_text(f"{SCENE}{added}\n")
    assert main(["simulate", str(scene_file), "--explain"]) == 2
    assert re.search(said, capsys.readouterr().err)


def test_a_scene_may_begin_with_the_mark_of_its_encoding(scene_file, capsys):
    scene_file.write_text(SCENE, encoding="utf-8-sig")
    assert main(["simulate", str(scene_file), "--explain"]) == 0
    assert capsys.readouterr().err == ""


def test_a_folder_is_no_name_for_a_recording(scene_file, tmp_path, capsys):
    assert main(["simulate", str(scene_file), "--out", f"{tmp_path}/"]) == 2
    assert (
        f"{tmp_path} is a folder: name the recording in it: give --out {tmp_path / 'NAME'}" in capsys.readouterr().err
    )
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no folder of the system's own files")
def test_a_folder_that_is_none_or_takes_no_files_is_told_as_such(scene_file, capsys):
    for out, said in (
        (scene_file / "x", f"{scene_file / 'x'}: cannot be written: {scene_file} is a file: give another folder"),
        (scene_file / "y" / "x", f"{scene_file} is a file: give another folder"),
        ("/proc/q", "/proc/q: cannot be written: /proc takes no files: give another folder"),
        (scene_file.parent / "gone" / "x", "make its folder first"),
    ):
        assert main(["simulate", str(scene_file), "--out", str(out)]) == 2
        assert said in capsys.readouterr().err
