import json
import os
import re
import stat
import xml.etree.ElementTree as ET
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bladewing.classify import measure_plot
from bladewing.classify.cli import main
from bladewing.classify.measure import Settings, measure_recording
from bladewing.classify.measure_words import _blades, _unlike, _wheel, with_error
from bladewing.classify.measured import OF_COMBS, Measured, disagreement
from bladewing.classify.recording import Recording, load_recording
from bladewing.features.rotor.comb import OVER_BODY
from bladewing.simulate import RotorMotion, Scene, rotor_echo
from scipy.signal import hilbert

from ..features.signals import CARRIER_HZ, PRF_HZ, PULSES, WAVELENGTH_M, moving_at, white

RADAR = ["--carrier-hz", "9.85e9", "--prf-hz", "35e3"]
RATE_HZ, LENGTH_M, VELOCITY_MPS = 57.7, 0.15, -20.0


def spinning(rate_hz, pulses):
    """Echo of a rotor's blades, of unit power a sample."""
    angle_rad = RotorMotion(rate_hz).angle_rad(np.arange(pulses) / PRF_HZ)
    blades = rotor_echo(angle_rad, wavelength_m=WAVELENGTH_M, blade_length_m=LENGTH_M).astype(complex)
    return blades / np.sqrt(np.mean(np.abs(blades) ** 2))


def moving(pulses):
    """A line at `VELOCITY_MPS`, of unit power a sample."""
    return moving_at(VELOCITY_MPS, np.arange(pulses) / PRF_HZ)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("measure")
    noise = white(np.random.default_rng(1), 2 * PULSES)
    moved = (spinning(RATE_HZ, 2 * PULSES) + 10) * moving(2 * PULSES)
    np.save(path / "drone.npy", (moved + noise).astype(np.complex64))
    np.save(path / "noise.npy", noise.astype(np.complex64))
    return path


def test_json_gives_a_line_a_dwell_and_one_a_recording(folder, capsys):
    given = ["--json", "--dwell", "0.0857", "--blades", "2", "--beta-deg", "0"]
    assert main(["measure", str(folder / "drone.npy"), *RADAR, *given]) == 0
    *dwells, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(dwells) == closing["recording"]["dwells"] == closing["recording"]["with_comb"] == 2
    for dwell in dwells:
        assert dwell["chopping_hz"] == pytest.approx(2 * RATE_HZ, abs=5 * dwell["chopping_hz_std"])
        assert dwell["body_velocity_mps"] == pytest.approx(VELOCITY_MPS, abs=0.1)
        assert dwell["blade_length_m"] == pytest.approx(LENGTH_M, rel=0.02)
        assert not dwell["length_is_lower_bound"]
        assert [a["blades"] for a in dwell["alternatives"]] == [2]
        assert len(dwell["rotor_rates_hz_std"]) == len(dwell["rotor_rates_hz"]) == 1
        assert 0 < dwell["rotor_rates_hz_std"][0] < 0.1
        assert dwell["reason"] is None
        for whole in (dwell["rotor_count"], dwell["comb_order"], dwell["alternatives"][0]["blades"]):
            assert isinstance(whole, int)
    assert abs(closing["recording"]["body_velocity_mps"] - VELOCITY_MPS) < 0.1
    assert 0 < closing["recording"]["body_velocity_mps_std"] < 0.1


def test_times_go_on_where_the_recording_begins(folder):
    read = load_recording(folder / "drone.npy", carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    found = measure_recording(Recording("x", read.iq, CARRIER_HZ, PRF_HZ, start_s=100.0), Settings(0.08, 2, None))
    *dwells, _ = found.json_objects()
    assert [(dwell["start_s"], dwell["stop_s"]) for dwell in dwells] == [(100.0, 100.08), (100.08, 100.16)]


def test_noise_has_nulls_and_a_reason(folder, capsys):
    assert main(["measure", str(folder / "noise.npy"), *RADAR, "--json"]) == 0
    dwell, *_, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert dwell["chopping_hz"] is None
    assert dwell["rotor_rates_hz"] == dwell["alternatives"] == []
    assert dwell["gear_ratio"] is None
    assert dwell["gear_reason"] == "no comb"
    assert dwell["reason"].startswith("no comb")
    assert closing["recording"]["with_comb"] == 0
    assert closing["recording"]["reason"] == "no comb in any dwell"


def test_where_no_dwell_could_show_a_rotor_none_is_denied(tmp_path, capsys):
    path, rng = tmp_path / "slow.npy", np.random.default_rng(5)
    np.save(path, white(rng, 320).astype(np.complex64))
    slow = [str(path), "--carrier-hz", "24e9", "--prf-hz", "1e3"]
    assert main(["measure", *slow]) == 0
    said = capsys.readouterr().out
    assert "whether there is a rotor cannot be told" in said
    assert "no rotor" not in said
    assert main(["measure", *slow, "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]["reason"].startswith("PRF too low: ")


def test_of_one_channel_a_body_has_a_speed_and_no_direction(tmp_path, capsys):
    """Its sign was told beside the remark that it is anyone's guess."""
    for velocity_mps in (8.0, -8.0):
        moved = 30 * moving_at(velocity_mps, np.arange(2 * PULSES) / PRF_HZ) + white(
            np.random.default_rng(4), 2 * PULSES
        )
        for name, iq, is_known in (("both", moved, True), ("one", moved.real + 0j, False)):
            np.save(tmp_path / f"{name}.npy", iq.astype(np.complex64))
            assert main(["measure", str(tmp_path / f"{name}.npy"), *RADAR]) == 0
            sign = "[+-]" if is_known else ""
            assert re.search(rf"; body {sign}8\.00 \+- 0\.01 m/s", capsys.readouterr().out)
            assert main(["measure", str(tmp_path / f"{name}.npy"), *RADAR, "--json"]) == 0
            told = json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]
            assert told["direction_known"] == is_known
            assert told["body_velocity_mps"] == pytest.approx(velocity_mps if is_known else 8.0, abs=0.01)


def test_of_one_channel_nothing_tells_whether_an_unknown_speed_grows():
    velocity_mps = np.array([np.nan, -3.0, 0.0, 2.0])
    for known, factors in ((False, [np.nan, -1, 1, 1]), (True, [1, 1, 1, 1])):
        np.testing.assert_array_equal(Measured._turn(SimpleNamespace(direction_known=known), velocity_mps), factors)


@pytest.mark.parametrize("sign", [1, -1])
def test_of_one_channel_a_body_that_grows_faster_does_so_whichever_way_it_goes(tmp_path, capsys, sign):
    prf_hz = 4e3
    times_s = np.arange(int(2 * prf_hz)) / prf_hz
    range_m = sign * (6 * times_s + times_s**2 / 2)  # 6 to 8 m/s
    iq = 30 * np.cos(4 * np.pi * range_m / WAVELENGTH_M) + white(np.random.default_rng(4), len(times_s)).real + 0j
    np.save(tmp_path / "one.npy", iq.astype(np.complex64))
    radar = ["--carrier-hz", str(CARRIER_HZ), "--prf-hz", str(prf_hz)]
    assert main(["measure", str(tmp_path / "one.npy"), *radar, "--json"]) == 0
    *dwells, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    for told in (*dwells, closing["recording"]):
        assert 5.9 < told["body_velocity_mps"] < 8.1
    assert closing["recording"]["acceleration_mps2"] == pytest.approx(1.0, abs=0.01)
    assert np.median([told["acceleration_mps2"] for told in dwells]) == pytest.approx(1.0, abs=0.1)


def test_combs_that_are_not_one_rotors_have_no_median_but_a_reason(tmp_path, capsys):
    rng, path = np.random.default_rng(6), tmp_path / "unlike.npy"
    unlike = [spinning(rate_hz, PULSES) + 10 for rate_hz in (40.3, 47.1, 61.7, 83.3)]  # none of the mains
    for parts, steady in ((unlike, False), (unlike[:1] * 4, True)):
        np.save(path, (np.concatenate(parts) + white(rng, 4 * PULSES)).astype(np.complex64))
        assert main(["measure", str(path), *RADAR, "--json", "--dwell", str(PULSES / PRF_HZ), "--blades", "2"]) == 0
        told = json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]
        assert told["with_comb"] == 4
        assert [told[name] is not None for name in OF_COMBS[:4]] == [steady] * 4
        assert (told["reason"] is None) if steady else told["reason"].startswith("no steady rotor: half")


def test_a_body_without_a_rotor_has_its_velocity(tmp_path, capsys):
    line = moving(2 * PULSES) + white(np.random.default_rng(4), 2 * PULSES)
    np.save(tmp_path / "line.npy", line.astype(np.complex64))
    assert main(["measure", str(tmp_path / "line.npy"), *RADAR]) == 0
    assert re.search(
        r"no rotor that chops at 38 Hz or more in 2 dwells; body -(19\.99|20\.0[01]) \+- 0\.01 m/s",
        capsys.readouterr().out,
    )


def test_a_body_that_grows_faster_has_no_single_velocity(tmp_path, capsys):
    """Of dwells an instant apart the median was told, with the error of a mean."""
    parts = [line * 10 for line in np.split(moving(6 * PULSES), 6)]
    times_s = np.arange(PULSES) / PRF_HZ
    iq = [part * moving_at(n, times_s) for n, part in enumerate(parts)]  # 1 m/s from each to each
    np.save(
        tmp_path / "off.npy", (np.concatenate(iq) + white(np.random.default_rng(4), 6 * PULSES)).astype(np.complex64)
    )
    dwell = ["--dwell", str(PULSES / PRF_HZ)]
    assert main(["measure", str(tmp_path / "off.npy"), *RADAR, *dwell]) == 0
    assert "no rotor that chops at 35 Hz or more in 6 dwells; body -19.75 to -15.25 m/s" in capsys.readouterr().out
    assert main(["measure", str(tmp_path / "off.npy"), *RADAR, *dwell, "--json"]) == 0
    *_, closing = capsys.readouterr().out.splitlines()
    edges = json.loads(closing)["recording"]["body_velocity_range_mps"]
    assert edges == pytest.approx([VELOCITY_MPS + 0.25, VELOCITY_MPS + 4.75], abs=0.01)


def test_of_one_side_alone_it_is_told_that_a_velocity_has_no_sign(folder, tmp_path, capsys):
    noise = np.load(folder / "noise.npy")
    half = hilbert((10 * moving(2 * PULSES) + noise).real).astype(np.complex64)
    for name, iq, one in (("half", half, True), ("both", noise, False)):
        np.save(tmp_path / f"{name}.npy", iq)
        assert main(["measure", str(tmp_path / f"{name}.npy"), *RADAR]) == 0
        assert ("half of the spectrum is empty in 2 of 2 dwells" in capsys.readouterr().out) == one


def test_dwells_that_tell_the_number_of_blades_are_heard_though_the_clearest_does_not():
    values = SimpleNamespace(chopping_hz=np.array([320.0, 321.0, 319.0, np.nan]), rotation_hz=np.full(4, np.nan))
    found = SimpleNamespace(values=values)
    assert _blades(found) == ""
    values.rotation_hz[:2] = 160.0, 160.5
    assert _blades(found) == "; 2 blades in 2 of 4 dwells"


def test_a_comb_in_a_few_of_many_dwells_is_said_to_be_perhaps_chance(folder, tmp_path, capsys):
    iq = white(np.random.default_rng(2), 20 * PULSES)
    drone = np.load(folder / "drone.npy")
    for held, caution in ((2, True), (4, False)):
        for first in range(0, held, 2):
            iq[first * PULSES : (first + 2) * PULSES] = drone
        np.save(tmp_path / "few.npy", iq.astype(np.complex64))
        assert main(["measure", str(tmp_path / "few.npy"), *RADAR, "--dwell", str(PULSES / PRF_HZ)]) == 0
        said = capsys.readouterr().out
        assert f"comb in {held} of 20 dwells{', perhaps by chance' if caution else ''}; blades" in said


@pytest.mark.parametrize(
    ("chopping_hz", "said"),
    [
        ((140.0, 280.0), ""),
        ((140.0, 140.0, 210.0), ""),
        ((140.0, 141.0, 139.0, 280.0), ""),  # one octave slip
        ((60.0, 100.0, 140.0, 210.0, 280.0, np.nan), "100 to 210"),
        ((58.0, 70.0, 102.0, 144.0, 162.0, 51.0, 99.0), "58 to 144"),
    ],
)
def test_no_rotor_is_named_where_the_middle_half_of_the_combs_disagrees(chopping_hz, said):
    chopping_hz = np.array(chopping_hz)
    values = SimpleNamespace(
        chopping_hz=chopping_hz, chopping_hz_std=0.01 * chopping_hz, gear_ratio=np.full(len(chopping_hz), np.nan)
    )
    told = disagreement(values)
    assert (said in told) if said else not told
    values.gear_ratio[:] = 4.7  # of a helicopter's two combs now this is the stronger one, now that
    assert disagreement(values) == ""
    values.gear_ratio[:] = np.nan
    values.chopping_hz_std = 2 * chopping_hz  # lower bounds say nothing of the sort
    assert disagreement(values) == ""


def test_a_count_of_rotors_that_most_dwells_do_not_share_is_not_given_without_a_word():
    values = SimpleNamespace(
        chopping_hz=np.array([183.0, 368.0, 182.0, 184.0, 184.0, 189.0, np.nan]),
        rotor_count=np.array([2.0, 1.0, 1.0, 1.0, 1.0, 2.0, np.nan]),
        rotors_resolved=np.array([True, False, True, True, True, True, False]),
    )
    found = SimpleNamespace(values=values, clearest=lambda: 5)
    assert _unlike(found) == "; the dwells do not agree on the number of rotors: 1 in 3, 2 in 2, not told apart in 1"
    found.clearest = lambda: 2  # half of them say so
    assert _unlike(found) == ""
    found.clearest = lambda: 1  # "and perhaps more" is said of it
    assert _unlike(found) == ""


def test_a_dwell_that_hardly_tells_the_body_does_not_speak_for_the_recording(folder):
    recording = load_recording(folder / "drone.npy", carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    spoken = measure_recording(recording, Settings(0.0857, 2, None))
    for values, stds, expected in (
        ([3.0, -90.0, -95.0], [0.1, 110.0, 110.0], (3.0, 0.1)),  # a plain median would be -90
        ([1.0, 3.0], [0.5, 0.5], (2.0, 1.0)),  # each is two deviations off: Birge's ratio is the root of 8
        ([2.0, np.nan, 2.0], [0.2, np.nan, 0.2], (2.0, 0.2 / np.sqrt(2))),
        ([np.nan, np.nan], [np.nan, np.nan], (None, None)),
    ):
        told = replace(spoken.values, body_velocity_mps=np.array(values), body_velocity_mps_std=np.array(stds))
        found = replace(spoken, values=told).body(np.ones(len(values), bool))
        assert found == pytest.approx(dict(zip(("body_velocity_mps", "body_velocity_mps_std"), expected, strict=True)))


def test_a_body_that_passes_the_end_of_the_unambiguous_velocities_has_one_velocity(tmp_path, capsys):
    """At 2 kHz that end is 15.22 m/s; the dwells on either side of it once made a deviation of 4 m/s."""
    body = {"name": "b", "velocity_mps": -14.9, "acceleration_mps2": -0.3, "body": [{"level_db": 20.0}]}
    scene = Scene.build({"radar": {"carrier_hz": 9.85e9, "prf_hz": 2e3, "pulses": 4000}, "uav": [body]})
    np.save(tmp_path / "passes.npy", scene.render(4).iq)
    assert main(["measure", str(tmp_path / "passes.npy"), "--carrier-hz", "9.85e9", "--prf-hz", "2000", "--json"]) == 0
    together = json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]
    span = 299_792_458.0 / 9.85e9 * 2e3 / 2
    assert abs(together["body_velocity_mps"]) <= span / 2
    off = together["body_velocity_mps"] - -15.2
    assert abs(off - span * round(off / span)) < 0.1
    assert together["body_velocity_mps_std"] < 0.1
    low, high = together["body_velocity_range_mps"]
    assert high - low == pytest.approx(0.9 * 0.6, abs=0.1)


def test_what_is_shorter_than_a_dwell_is_said_to_be_left_out(folder, capsys):
    given = ["measure", str(folder / "drone.npy"), *RADAR, "--dwell", "0.08"]
    left_out_s = 2 * PULSES / PRF_HZ - 2 * 0.08
    assert main([*given, "--json"]) == 0
    closing = json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]
    assert closing["left_out_s"] == pytest.approx(left_out_s)
    assert main(given) == 0
    assert f"the last {left_out_s:.2g} s, shorter than a dwell, are left out" in capsys.readouterr().out
    assert main([*given[:-1], "5"]) == 0
    assert f"its {2 * PULSES / PRF_HZ:.6g} s, shorter than a dwell of 5 s, are taken whole" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["measure", "predict"])
@pytest.mark.parametrize("dwell_s", ["80", "5.1", "1e305"])
def test_a_dwell_of_seconds_where_milliseconds_were_meant_is_refused(command, dwell_s, folder, capsys):
    assert main([command, str(folder / "drone.npy"), *RADAR, "--dwell", dwell_s]) == 2
    said = f"--dwell [s] is {float(dwell_s):g}: it must be at most 5 [s]: 80 ms are 0.08"
    assert said in " ".join(capsys.readouterr().err.split())


def test_a_dwell_of_more_pulses_than_can_be_measured_is_refused(tmp_path, capsys):
    np.save(tmp_path / "long.npy", np.ones(70_000, np.complex64))
    assert main(["measure", str(tmp_path / "long.npy"), *RADAR, "--dwell", "4"]) == 2
    said = f"a dwell of 4 s takes 70000 pulses, more than 65536: give --dwell in seconds, {64880 / PRF_HZ:.2g} at most"
    assert said in capsys.readouterr().err


def test_the_reason_for_no_rotor_is_given_whole(folder, capsys):
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--dwell", "0.018"]) == 0
    # two flashes a dwell
    said = r"\d dwells: dwell too short.* lines \d+ Hz apart with others between them, to tell them apart takes \d+ ms"
    assert re.search(said, capsys.readouterr().out)


def test_the_table_says_rate_and_blade(folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--blades", "2"]) == 0
    wrapped = capsys.readouterr().out
    said = " ".join(wrapped.split())
    assert "chopping Hz" in said
    assert f"2-blade rotors at {60 * RATE_HZ:.0f} rpm, blade at least" in said
    assert f"body {VELOCITY_MPS:+.2f} +- 0.01 m/s" in said
    assert max(map(len, wrapped.splitlines()[1:])) <= 80


def test_a_carrier_below_the_prf_is_told_as_exchanged(folder, capsys):
    assert main(["measure", str(folder / "drone.npy"), "--carrier-hz", "35e3", "--prf-hz", "9.85e9"]) == 2
    told = "drone.npy: carrier 35000 Hz and PRF 9.85e+09 Hz stand in each other's place: exchange them\n"
    assert capsys.readouterr().err.endswith(told)


@pytest.mark.parametrize("command", ["measure", "predict"])
def test_a_carrier_in_gigahertz_is_refused(folder, capsys, command):
    assert main([command, str(folder / "drone.npy"), "--carrier-hz", "9.85", "--prf-hz", "35e3"]) == 2
    captured = capsys.readouterr()
    assert not captured.out
    assert captured.err.endswith("must be 1e+08 to 1e+12 Hz: give 9.85 GHz as 9.85e9 and 20 kHz as 20e3\n")


def test_dwells_of_next_to_no_pulses_are_refused_and_kilohertz_thought_of(folder, capsys):
    given = ["measure", str(folder / "drone.npy"), "--carrier-hz", "9.85e9"]
    assert main([*given, "--prf-hz", "35e3", "--dwell", "0.0002"]) == 2
    told = "7 pulses at a PRF of 35000 Hz, fewer than 16: give --dwell 0.0005 or more\n"
    assert capsys.readouterr().err.endswith(told)
    assert main([*given, "--prf-hz", "35e3", "--dwell", "0.0005"]) == 0
    capsys.readouterr()
    assert main([*given, "--prf-hz", "35"]) == 2
    assert "fewer than 16: give 35 kHz as 35e3, or give --dwell 0.4572 or more" in capsys.readouterr().err
    assert main([*given, "--prf-hz", "35", "--dwell", "0.5"]) == 0
    assert "PRF 35 Hz: give 35 kHz as 35e3, if that is what it is" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(("combs", "of_combs"), [(1, False), (3, True)])
def test_combs_that_may_be_chance_do_not_tell_the_body(folder, combs, of_combs):
    """Of twenty dwells at 5 m/s one or three hold a comb about a body at rest."""
    recording = load_recording(folder / "drone.npy", carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    spoken = measure_recording(recording, Settings(0.0857, 2, None))
    held, arrays = np.arange(20) < combs, {}
    for name, value in vars(spoken.values).items():
        if isinstance(value, np.ndarray):
            arrays[name] = np.resize(value, (20, *value.shape[1:]))
    values = replace(
        replace(spoken.values, **arrays),
        chopping_hz=np.where(held, 100.0, np.nan),
        chopping_hz_std=np.where(held, 0.1, np.nan),
        gear_ratio=np.full(20, np.nan),
        body_velocity_mps=np.where(held, 0.0, 5.0),
        body_velocity_mps_std=np.full(20, 0.01),
    )
    together = replace(spoken, iq=np.zeros((20, 4), np.complex64), values=values).together()
    assert together["body_velocity_mps"] == pytest.approx(0.0 if of_combs else 5.0)


def test_the_plot_is_svg_with_the_comb_on_it(folder, tmp_path, capsys):
    target = tmp_path / "drone.svg"
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(target), "--json"]) == 0
    assert all(line.startswith("{") for line in capsys.readouterr().out.splitlines())
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(target)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"Wrote {target}"
    root = ET.fromstring(target.read_text())
    assert root.tag.endswith("svg")
    titles = [e.text for e in root.iter() if e.tag.endswith("title")]
    assert "notch" in titles
    assert any(t.startswith("band ") for t in titles)
    words = [e.text or "" for e in root.iter() if e.tag.endswith("text")]
    assert any(re.fullmatch(r"drone\.npy at 0\.0[08]0 s", text) for text in words)
    assert any(re.match(r"comb every [0-9.]+ Hz, band ", text) for text in words)
    assert {"band", "notch", "comb"} <= set(words)
    assert sum(e.get("stroke") == "#c0392b" for e in root.iter()) > 20


def test_the_plot_shows_the_stretch_that_was_measured(tmp_path, monkeypatch):
    """With the zeros of a silence it had a skirt of 20 dB about the body."""
    line = (30 * moving(PULSES) + white(np.random.default_rng(4), PULSES)).astype(np.complex64)
    line[500:700] = 0
    np.save(tmp_path / "gap.npy", line)
    drawn = []
    monkeypatch.setattr(measure_plot, "spectrum_svg", lambda iq, *_: (drawn.append(iq), "<svg/>")[1])
    assert main(["measure", str(tmp_path / "gap.npy"), *RADAR, "--plot", str(tmp_path / "gap.svg")]) == 0
    np.testing.assert_array_equal(drawn[0], line[700 : round(0.08 * PRF_HZ)])


def test_the_dwell_that_speaks_for_a_recording_is_clear_and_no_outlier():
    values = SimpleNamespace(
        comb_snr_db=np.array([20.0, np.nan, 40.0, 30.0, 25.0, 10.0]),
        bandwidth_hz=np.array([3010.0, np.nan, 4000.0, 2990.0, 3300.0, 3005.0]),
    )
    assert Measured.clearest(SimpleNamespace(values=values)) == 3
    values.bandwidth_hz[:] = np.nan
    assert Measured.clearest(SimpleNamespace(values=values)) == 2
    values.comb_snr_db[:] = np.nan
    assert Measured.clearest(SimpleNamespace(values=values)) == 0


def test_of_several_recordings_the_one_with_the_clearest_comb_is_drawn():
    silent, another, weak, strong = (
        SimpleNamespace(values=SimpleNamespace(comb_snr_db=np.array([snr_db])), clearest=lambda: 0)
        for snr_db in (np.nan, np.nan, 10.0, 20.0)
    )
    assert Measured.clearer(silent, None) is silent
    assert Measured.clearer(silent, another) is another
    for one, clearer in ((silent, weak), (silent, strong), (weak, strong)):
        assert Measured.clearer(one, clearer) is Measured.clearer(clearer, one) is clearer


def test_the_plot_of_silence_is_a_line_at_the_foot(tmp_path):
    np.save(tmp_path / "silence.npy", np.zeros(2000, np.complex64))
    target = tmp_path / "silence.svg"
    assert main(["measure", str(tmp_path / "silence.npy"), *RADAR, "--plot", str(target)]) == 0
    assert "nan" not in target.read_text()
    words = {e.text for e in ET.fromstring(target.read_text()).iter() if e.tag.endswith("text")}
    assert "notch" in words
    assert not {"band", "comb", "2nd comb"} & words


def test_what_stands_at_the_axes_of_a_plot_is_centred_on_them_and_has_a_minus_sign(folder, tmp_path):
    target = tmp_path / "drone.svg"
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(target)]) == 0
    root = ET.fromstring(target.read_text(encoding="utf-8"))
    texts = [e for e in root.iter() if e.tag.endswith("text")]
    (axis,) = {e.get("x") for e in texts if e.text in ("Doppler frequency [Hz]", "radial velocity [m/s]")}
    (line,) = {e.get("d").split("H")[1] for e in root.iter() if "H" in (e.get("d") or "")}  # of the levels
    left = next(e.get("d") for e in root.iter() if "H" in (e.get("d") or "")).removeprefix("M").split()[0]
    assert float(axis) == (float(left) + float(line)) / 2
    ticks = [e.text for e in texts if e.get("text-anchor") == "middle"]
    assert any(text.startswith("\u2212") for text in ticks)
    assert not any(text.startswith("-") for text in ticks)


def test_a_plot_of_nothing_says_why_where_the_spectrum_would_be(tmp_path):
    np.save(tmp_path / "silence.npy", np.zeros(2000, np.complex64))
    target = tmp_path / "silence.svg"
    assert main(["measure", str(tmp_path / "silence.npy"), *RADAR, "--plot", str(target)]) == 0
    texts = [e for e in ET.fromstring(target.read_text()).iter() if e.tag.endswith("text") and e.text == "no signal"]
    assert [e.get("text-anchor") for e in texts] == [None, "middle"]  # above the picture, and in its middle


def test_a_long_name_is_shortened_in_its_middle_so_that_the_words_fit(tmp_path):
    name = "2026-11-24T193412Z_" + 10 * "cell_" + 20 * "gate_" + "hover.npy"
    np.save(tmp_path / name, np.zeros(2000, np.complex64))
    target = tmp_path / "long.svg"
    assert main(["measure", str(tmp_path / name), *RADAR, "--plot", str(target)]) == 0
    words = [e.text or "" for e in ET.fromstring(target.read_text()).iter() if e.tag.endswith("text")]
    assert [len(text) for text in words if text.endswith("gate_hover.npy at 0.000 s")] == [103 + len(" at 0.000 s")]


def test_a_helicopter_shows_both_combs_in_words_json_and_plot(tmp_path, capsys):
    assert main(["simulate", "helicopter", "--out", str(tmp_path / "heli"), "--seed", "1"]) == 0
    recording, plot = str(tmp_path / "heli.sigmf-meta"), tmp_path / "heli.svg"
    capsys.readouterr()
    assert main(["measure", recording, "--plot", str(plot)]) == 0
    assert "helicopter in 1 of 1 dwell: chopping main 82.000" in capsys.readouterr().out
    assert main(["measure", recording, "--json"]) == 0
    dwell, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert dwell["gear_ratio"] == pytest.approx(4.73, abs=6 * dwell["gear_ratio_std"])
    assert dwell["tail_chopping_hz"] == pytest.approx(4.73 * 82, abs=6 * dwell["tail_chopping_hz_std"])
    assert dwell["gear_reason"] is None
    assert closing["recording"]["with_second_comb"] == 1
    assert closing["recording"]["gear_ratio"] == dwell["gear_ratio"]
    words = [e.text for e in ET.fromstring(plot.read_text()).iter() if e.tag.endswith("text")]
    assert "2nd comb" in words
    assert any("ratio 4.7" in word for word in words)


def test_a_long_recording_of_a_bird_has_a_wingbeat(tmp_path, capsys):
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 4e3, "pulses": 10000}
    part = {"name": "bird", "species": "paper_bird", "wing_db": 18.0, "heading_deg": 60.0}
    np.save(tmp_path / "bird.npy", Scene.build({"radar": radar, "bird": [part]}).render(1).iq)
    given = ["measure", str(tmp_path / "bird.npy"), "--carrier-hz", "9.85e9", "--prf-hz", "4e3", "--dwell", "0.5"]
    assert main([*given, "--json"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])["recording"]
    assert found["wingbeat_hz"] == pytest.approx(1 / 0.302, abs=0.1)
    assert found["acceleration_mps2"] == pytest.approx(-(340 + 316) * 0.0304357825 / 2 / 2.5, abs=0.2)
    assert found["wingbeat_reason"] is None
    assert main(given) == 0
    assert "wingbeat 3.3" in capsys.readouterr().out


def test_a_dwell_smeared_by_acceleration_is_measured(folder, tmp_path, capsys):
    iq = np.load(folder / "drone.npy")[:PULSES]
    times_s = (np.arange(PULSES) - (PULSES - 1) / 2) / PRF_HZ
    np.save(tmp_path / "pull.npy", iq * np.exp(-2j * np.pi * 30 * times_s**2 * CARRIER_HZ / 299_792_458.0))
    assert main(["measure", str(tmp_path / "pull.npy"), *RADAR, "--dwell", "0.0857", "--json"]) == 0
    dwell, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert dwell["chopping_hz"] == pytest.approx(2 * RATE_HZ, abs=0.1)
    assert dwell["acceleration_mps2"] == pytest.approx(30, abs=0.2)
    assert "wingbeat_hz" not in closing["recording"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--beta-deg", "90"], "--beta-deg is 90"),
        (["--blades", "0"], "--blades is 0: it must be a whole number of 1 to 64"),
        (["--blades", "65"], "--blades is 65: it must be a whole number of 1 to 64"),
        (["--blades", "2.5"], "--blades is '2.5': it must be a whole number"),
        (["--beta-deg", "x"], "--beta-deg is 'x': it must be a number"),
        (["--blades", "1000000000000"], "--blades is 1000000000000: it must be a whole number of 1 to 64"),
        (["--dwell", "0"], "--dwell"),
        (["--dwell", "1e-9"], "a dwell of 1e-09 s holds no pulse at a PRF of 35000 Hz: give more than 2.9e-05 s"),
        (["--plot", "/nowhere/at/all.svg"], "--plot"),
        (["--plot", "picture.png"], "--plot picture.png: the drawing is SVG"),
        (["--carrier-hz", "9.85"], "the carrier is 9.85 Hz: it must be 1e+08 to 1e+12 Hz"),
        (["--prf-hz", "1e-300"], "the PRF is 1e-300 Hz: it must be 1 to 1e+08 Hz"),
    ],
)
def test_bad_options_are_one_line_and_code_2(folder, capsys, options, said):
    assert main(["measure", str(folder / "drone.npy"), *RADAR, *options]) == 2
    out, error = capsys.readouterr()
    assert (out, error.count("\n")) == ("", 1)
    assert said in error


def test_as_many_blades_may_be_given_as_are_said_to_be():
    assert Settings.checked(dwell_s=0.08, blades=64, beta_deg=0.0).blades == 64


@pytest.mark.parametrize("columns", ["40", None])
def test_no_number_of_the_table_is_cut(folder, capsys, monkeypatch, columns):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--dwell", "0.0857"]) == 0
    lines = capsys.readouterr().out.splitlines()
    head = next(n for n, line in enumerate(lines) if line.startswith("start s"))
    for line in lines[head + 1 : head + 3]:
        assert line.count(" +- ") == 4
        assert "…" not in line


@pytest.mark.parametrize("other_hz", [RATE_HZ, 1.6 * RATE_HZ])
def test_dwells_whose_combs_are_not_one_rotors_are_told(other_hz, tmp_path, capsys):
    rng = np.random.default_rng(3)
    parts = [spinning(rate_hz, 2800) + 10 + white(rng, 2800) for rate_hz in (RATE_HZ, other_hz) * 2]
    np.save(tmp_path / "two.npy", np.concatenate(parts).astype(np.complex64))
    assert main(["measure", str(tmp_path / "two.npy"), *RADAR, "--dwell", "0.08"]) == 0
    said = capsys.readouterr().out
    assert "comb in 4 of 4 dwells" in said
    both = f"half of their chopping frequencies lie within {2 * RATE_HZ:.4g} to {2 * other_hz:.4g} Hz"
    assert ("no steady rotor" in said) == (both in said) == ("rpm" not in said) == (other_hz != RATE_HZ)


def test_a_comb_that_ends_where_the_body_s_speed_does_is_called_a_wheel_s(tmp_path, capsys):
    rng = np.random.default_rng(2)
    times_s, wavelength_m = np.arange(PULSES) / PRF_HZ, 299_792_458.0 / CARRIER_HZ
    orders, rate_hz = np.arange(-16, 17), 80.0
    iq = np.exp(2j * np.pi * (orders * rate_hz * times_s[:, None] + rng.random(33))).sum(axis=1) / np.sqrt(33) + 4.0
    edge_mps = 16 * rate_hz * wavelength_m / 2
    said = {}
    for speed_mps in (edge_mps, 2 * edge_mps, 5.0):
        moved = iq * moving_at(speed_mps, times_s, wavelength_m)
        noise = 0.1 * (rng.standard_normal(PULSES) + 1j * rng.standard_normal(PULSES))
        np.save(tmp_path / "comb.npy", (moved + noise).astype(np.complex64))
        assert main(["measure", str(tmp_path / "comb.npy"), *RADAR]) == 0
        said[speed_mps] = capsys.readouterr().out
    assert f"m/s from a body at {edge_mps:.1f} m/s" in said[edge_mps]
    assert f"no rotor that chops at 38 Hz or more in 1 dwell; body +{edge_mps:.2f}" in said[edge_mps]
    for speed_mps, within in ((2 * edge_mps, True), (5.0, False)):
        assert "comb in 1 of 1 dwell; " in said[speed_mps]
        assert ("the lines reach no further than the body moves" in said[speed_mps]) == within


@pytest.mark.parametrize(("reach", "wheel"), [(0.95, True), (1.05, False)])
def test_a_wheel_is_thought_of_up_to_where_its_lines_may_reach(reach, wheel):
    edge_hz = 2 * reach * OVER_BODY * 10.0 / WAVELENGTH_M  # to either side of a body at 10 m/s
    values = SimpleNamespace(
        chopping_hz=np.array([30.0, 30.0, np.nan]),
        bandwidth_hz=np.array([2 * edge_hz, 2 * edge_hz, np.nan]),
        body_velocity_mps=np.array([10.0, -10.0, 500.0]),
    )
    found = SimpleNamespace(values=values, recording=SimpleNamespace(carrier_hz=CARRIER_HZ))
    assert ("perhaps a wheel" in _wheel(found)) == wheel


def test_a_value_is_written_to_the_second_digit_of_its_error():
    assert with_error(0.123456, 0.0456) == "0.123 +- 0.046"
    assert with_error(12345.6, 789) == "12346 +- 789"
    assert with_error(1.0, float("nan")) == "-"


def test_a_drawing_is_not_written_over_a_pipe_or_behind_a_link_to_nowhere(folder, tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe.svg")
    os.symlink(tmp_path / "gone" / "drawing.svg", tmp_path / "link.svg")
    for name, said in {"pipe": "is no regular file", "link": "there is no folder", 300 * "x": "too long"}.items():
        assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(tmp_path / f"{name}.svg")]) == 2
        out, error = capsys.readouterr()
        assert (out, error.count("\n")) == ("", 1)
        assert said in error
    assert stat.S_ISFIFO((tmp_path / "pipe.svg").stat().st_mode)


def test_a_drawing_that_cannot_be_written_is_told_before_anything_is_measured(folder, tmp_path, capsys, monkeypatch):
    (tmp_path / "taken.svg").mkdir()
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(tmp_path / "taken.svg")]) == 2
    out, error = capsys.readouterr()
    assert (out, error.count("\n")) == ("", 1)
    assert "taken.svg: is a directory: name a file that can be written" in error
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert main(["measure", str(folder / "drone.npy"), *RADAR, "--plot", str(tmp_path / "new.svg")]) == 2
    out, error = capsys.readouterr()
    assert (out, "nothing can be written into" in error) == ("", True)


def test_silent_dwells_of_one_channel_hold_no_signal(tmp_path, capsys):
    """The other dwells' tails would be all there is in them: a body at the end of the span."""
    rng = np.random.default_rng(4)
    iq = np.array(spinning(RATE_HZ, 8400) + 10 + white(rng, 8400)).real + 0j
    iq[2800:5600] = 0
    np.save(tmp_path / "one.npy", iq.astype(np.complex64))
    assert main(["measure", str(tmp_path / "one.npy"), *RADAR, "--dwell", "0.08", "--json"]) == 0
    dwells = [json.loads(line) for line in capsys.readouterr().out.splitlines()][:-1]
    assert [dwell["reason"] for dwell in dwells] == [None, "no signal", None]
    assert dwells[1]["body_velocity_mps"] is None


@pytest.mark.parametrize("of", [np.asarray, np.real], ids=["I and Q", "I"])
def test_silences_within_the_dwells_are_no_comb_whatever_the_channels(tmp_path, capsys, of):
    """Made analytic as a whole, one channel held tails in them, and the holes were a rotor's flashes."""
    rng = np.random.default_rng(0)
    iq = of(10 * np.exp(0.3j * np.arange(14_000)) + white(rng, 14_000)) + 0j
    iq[np.arange(14_000) % 250 < 50] = 0
    np.save(tmp_path / "holes.npy", iq.astype(np.complex64))
    assert main(["measure", str(tmp_path / "holes.npy"), *RADAR, "--dwell", "0.08", "--json"]) == 0
    *dwells, closing = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [dwell["chopping_hz"] for dwell in dwells] == [None] * 5
    assert closing["recording"]["with_comb"] == 0


def test_in_silence_no_rotor_is_denied(tmp_path, capsys):
    np.save(tmp_path / "silence.npy", np.zeros(2000, np.complex64))
    assert main(["measure", str(tmp_path / "silence.npy"), *RADAR]) == 0
    said = capsys.readouterr().out
    assert "whether there is a rotor cannot be told" in said
    assert "no rotor" not in said
