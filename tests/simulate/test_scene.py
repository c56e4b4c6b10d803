"""Scenes: what they refuse and in which words, what they warn of, and what rendering keeps to."""

import subprocess
import sys
from pathlib import Path

import bladewing.simulate
import numpy as np
import pytest
from bladewing.simulate import reception
from bladewing.simulate.bird import wingbeat_hz
from bladewing.simulate.catalogue import AIRFRAMES, BIRDS
from bladewing.simulate.clutter import _texture
from bladewing.simulate.laws import LAWS, WIDTH
from bladewing.simulate.parts import BOUNDS, MOST, bounds_of
from bladewing.simulate.radar import Radar
from bladewing.simulate.receiver import EFFECT_OF, FAULT_CHANCE, Receiver
from bladewing.simulate.reception import Chosen, Reception
from bladewing.simulate.render import Rendering, render
from bladewing.simulate.render_bird import _cycle_rad, heave_range_m, members
from bladewing.simulate.scene import Scene, SceneError, shipped
from bladewing.simulate.target import Target
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special

RADAR = {"carrier_hz": 9.85e9, "prf_hz": 25e3, "pulses": 1000}
ROTOR = {"blade_length_m": 0.15, "rotation_hz": 50.0, "flash_db": 20.0}
NOT_NUMBERS = [float("nan"), float("inf"), "5", True]


def uav(**changes) -> dict:
    return {"name": "drone", "body": [{"level_db": 10.0}], "rotors": [ROTOR], **changes}


def scene(**changes) -> dict:
    return {"radar": RADAR, "uav": [uav()], **changes}


def power_spectrum(iq: np.ndarray) -> np.ndarray:
    return abs(np.fft.fft(iq * np.kaiser(len(iq), 12.5))) ** 2


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"radar": {**RADAR, "pulses": 0}}, r"radar\.pulses is 0: it should be greater than or equal to 1"),
        ({"radar": {**RADAR, "pulses": 2.5}}, r"radar\.pulses is 2\.5: it must be a whole number, without point"),
        ({"radar": {**RADAR, "prf_hz": -1.0}}, r"radar\.prf_hz is -1\.0: it should be greater than 0"),
        ({"radar": {**RADAR, "carrier_hz": 9.85}}, r"radar\.carrier_hz: 9\.85 Hz is no radar's: .*: 10 GHz is 10e9"),
        ({"radar": {"carrier_hz": 1e9, "prf_hz": 1e3}}, r"radar\.pulses is missing"),
        (scene(uav=[uav(rotors=[{**ROTOR, "blade_length_m": -0.1}])]), r"\[0\]\.blade_length_m is -0\.1: .*than 0"),
        (scene(uav=[uav(rotors=[{**ROTOR, "root_m": 0.2}])]), r"root_m is 0\.2: it must not exceed blade_length_m"),
        (scene(uav=[uav(rotors=[{**ROTOR, "blade_amplitudes": [1.0]}])]), r"one a blade, blades = 2"),
        (scene(uav=[uav(beta_deg=91.0)]), r"uav\[0\]\.beta_deg is 91\.0: it should be less than or equal to 90"),
        (scene(uav=uav()), r"uav is one table: there may be several: write \[\[uav\]\] above each"),
        (
            scene(uav=[{"name": "own", "body": {"level_db": 20.0}}]),
            r"uav\[0\]\.body is one table: there may be several: write \[\[uav\.body\]\] above each",
        ),
        ({**scene(), "radar": 3}, r"radar is 3: it must be a table: write \[radar\] above its fields"),
        (scene(uav=[uav(velocity=3.0)]), r"unknown field uav\[0\]\.velocity: the fields are .*velocity_mps"),
        (scene(uav=[uav(rotors=[{**ROTOR, "rpm": 3.0}])]), r"unknown field .*rpm: the fields are blade_length_m"),
        (scene(uav=[uav(range_m=0.1)]), r"range_m is 0\.1: .* must exceed its own reach of 0\.15 m"),
        (scene(uav=[uav(range_m=7.9, body=[{"level_db": 10.0, "offset_m": 8.0}])]), r"its own reach of 8 m"),
        (scene(uav=[uav(range_m=7.9, rotors=[{**ROTOR, "offset_m": 7.85}])]), r"its own reach of 8 m"),
        (scene(uav=[uav(range_m=1.0, velocity_mps=-30.0)]), r"dwell of 0\.04 s \(pulses / PRF\) it comes to -0\.2 m"),
        (scene(uav=[uav(range_m=1.0, velocity_mps=-90.0, acceleration_mps2=4500.0)]), r"it comes to 0\.1 m"),
        (scene(uav=[uav(name="mains")]), r"a part is named 'mains': that is the receiver's"),
        (scene(uav=[{"name": "x", "airframe": "jumbo"}]), r"airframe is 'jumbo': it must be one of type1"),
        (scene(uav=[{"name": "x", "airframe": ["type1"]}]), r"airframe is \['type1'\]: it should be a valid string"),
        (scene(uav=[{"name": "empty"}]), r"neither body nor rotors"),
        (scene(uav=[uav(), uav()]), r"two parts are named 'drone'"),
        (scene(off=["swan"]), r"off holds 'swan': it may hold drone, noise"),
        (scene(bird=[{"name": "b", "species": "dodo"}]), r"species is 'dodo': it must be one of mute_swan"),
        (scene(clutter=[{"name": "c", "kind": "lava", "level_db": 0.0}]), r"clutter\[0\]\.kind is 'lava'"),
        (scene(clutter=[{"name": "c", "kind": "sea", "level_db": 0.0, "values": {"salt": 1.0}}]), r"'salt' is unknown"),
        (scene(clutter=[{"name": "c", "kind": "ground", "level_db": 0.0, "values": {"wind_mph": -1.0}}]), r"above 0"),
        (scene(receiver={"effects": ["rust"]}), r"'rust' is unknown: the effects are fading"),
        (scene(receiver={"values": {"adc_bits": -3.0}}), r"adc_bits is -3\.0: it must be 1 to 24"),
    ],
)  # fmt: skip
def test_a_bad_scene_gets_one_line_with_field_value_and_rule(values, said):
    with pytest.raises(SceneError, match=said) as caught:
        Scene.build(values, "my.toml")
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith("my.toml: ")
    assert "\n" not in caught.value.problems[0]


@pytest.mark.parametrize("value", NOT_NUMBERS, ids=str)
@pytest.mark.parametrize("field", ["range_m", "velocity_mps", "beta_deg", "vibration_rad"])
def test_what_is_not_a_finite_number_is_refused(field, value):
    with pytest.raises(SceneError, match=rf"uav\[0\]\.{field} is "):
        Scene.build(scene(uav=[uav(**{field: value})]))


def test_a_folder_hides_no_shipped_scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quadcopter").mkdir()
    assert Scene.load("quadcopter") == Scene.load(Path("quadcopter"))
    with pytest.raises(SceneError, match="'': is a directory: give a TOML file, or a shipped scene"):
        Scene.load("")


def test_every_problem_has_its_line():
    with pytest.raises(SceneError) as caught:
        Scene.build({"radar": {**RADAR, "pulses": 0}, "uav": [uav(beta_deg=-1.0)], "colour": 1})
    assert len(caught.value.problems) == 3


@pytest.mark.parametrize("content", [b"radar = [", b"\xff\xfe", None])
def test_a_file_that_is_no_scene_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SceneError, match=r"not TOML|cannot be read: No such file") as caught:
        Scene.load(path)
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("name", "cure"),
    [
        ("quadcoptr", "give quadcopter"),
        ("{folder}/night", "give {folder}/night.toml"),
        ("car", "or a shipped scene: fixed_wing,"),
    ],
)
def test_what_was_meant_by_a_name_is_told(tmp_path, name, cure):
    (tmp_path / "night.toml").write_text("")
    with pytest.raises(SceneError, match="cannot be read: No such file") as caught:
        Scene.load(name.format(folder=tmp_path))
    (problem,) = caught.value.problems
    assert cure.format(folder=tmp_path) in problem
    assert ("shipped" in problem) == ("shipped" in cure)


def test_a_name_that_no_file_system_holds_is_refused_in_one_line():
    with pytest.raises(SceneError, match=r"cannot be read: File name too long: give a TOML file"):
        Scene.load("a" * 300)


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scene_renders(name):
    found = Scene.load(name)
    short = Scene.build({**dict(found), "radar": {**dict(found.radar), "pulses": 200}})
    rendering = short.render(1)
    assert rendering.iq.dtype == np.complex64
    assert rendering.iq.shape == (200,)
    assert np.isfinite(rendering.iq).all()
    assert [part["name"] for part in rendering.truth]
    assert found.title
    assert found.source


@pytest.mark.parametrize("name", list(AIRFRAMES))
def test_every_airframe_has_a_source_and_flies(name):
    assert AIRFRAMES[name].source
    built = Scene.build({"radar": RADAR, "uav": [{"name": "x", "airframe": name}]})
    for rotor in built.uav[0].rotors:
        assert 20 < 2 * np.pi * abs(rotor.rotation_hz) * rotor.blade_length_m < 250  # tips, m/s


@pytest.mark.parametrize("name", ["quadcopter_12cm", "helicopter_41cm", "type4"])
def test_a_gain_raises_all_levels_of_an_airframe(name):
    fields = AIRFRAMES[name].fields
    by_hand = {
        "body": [point | {"level_db": point["level_db"] - 12.0} for point in fields["body"]],
        "rotors": [rotor | {"flash_db": rotor["flash_db"] - 12.0} for rotor in fields["rotors"]],
    }
    drone = {"name": "x", "airframe": name, "range_m": 60.0, "vibration_rad": 0.1, "acceleration_mps2": 1.0}
    built = [Scene.build({"radar": RADAR, "uav": [drone | more]}) for more in ({"gain_db": -12.0}, by_hand, {})]
    noise = built[0].without("x").render(1).iq
    echo, by_hand_echo, louder = (one.render(1, full=True).iq - noise for one in built)
    np.testing.assert_allclose(echo, by_hand_echo, atol=1e-4)
    np.testing.assert_allclose(echo, 10**-0.6 * louder, atol=1e-4)
    weaker, written, plain = built
    for rendered in (weaker.render(1), written.render(1)):
        assert rendered.truth[0]["flash_db"] == pytest.approx([r["flash_db"] - 12 for r in fields["rotors"]])
        assert rendered.truth[0]["body_db"] == pytest.approx([p["level_db"] - 12 for p in fields["body"]])
    assert weaker.plan().explain() == written.plan().explain() != plain.plan().explain()


def test_the_wingbeats_of_the_catalogue_are_those_computed_from_pennycuick():
    computed_hz = {
        "mute_swan": 3.3, "herring_gull": 4.0, "greylag_goose": 4.4, "cormorant": 5.1, "jackdaw": 6.3, "teal": 7.9,
        "swallow": 8.3, "starling": 9.7, "siskin": 12.0, "goldcrest": 14.0,
    }  # fmt: skip
    assert set(computed_hz) < set(BIRDS)
    for name, expected in computed_hz.items():
        size = BIRDS[name].fields
        assert wingbeat_hz(size["mass_kg"], size["span_m"], size["area_m2"]) == pytest.approx(expected, rel=0.15)


def test_tips_beyond_the_unambiguous_velocity_alias_and_are_warned_of():
    slow = Scene.build(scene(radar={**RADAR, "prf_hz": 4e3}))
    (warning,) = slow.warnings()
    assert "unambiguous" in warning
    assert "a PRF of" in warning
    # the samples are those that the fast radar takes now and then
    fast = Scene.build(scene(radar={**RADAR, "prf_hz": 24e3, "pulses": 6000}))
    assert fast.warnings() == []
    ours, theirs = slow.without("noise").render().iq, fast.without("noise").render().iq[::6]
    np.testing.assert_allclose(ours, theirs, atol=1e-4)


@pytest.mark.parametrize(
    ("motion", "rotor", "shown_mps"),
    [
        ({"velocity_mps": 3.0, "acceleration_mps2": 15.0}, {}, 33.0),
        ({"velocity_mps": 3.0, "acceleration_mps2": -15.0}, {}, 27.0),
        ({}, {"drift_hz_per_s": 20.0}, 0.0),
        ({}, {"wander_hz": 40.0}, 0.0),
    ],
)
def test_tips_that_alias_later_in_the_dwell_are_warned_of(motion, rotor, shown_mps):
    rotor = {"blade_length_m": 0.15, "rotation_hz": 60.0, "flash_db": 0.0} | rotor
    rate_hz = 60.0 + 2 * rotor.get("drift_hz_per_s", 0.0) + rotor.get("wander_hz", 0.0)
    fastest = 2 * np.pi * rate_hz * 0.15 + shown_mps
    for margin, warned in ((1.01, False), (0.99, True)):  # a dwell of 2 s
        prf_hz = 4 * fastest * margin / (299_792_458.0 / 9.85e9)
        radar = {"carrier_hz": 9.85e9, "prf_hz": prf_hz, "pulses": round(2 * prf_hz)}
        built = Scene.build({"radar": radar, "uav": [{"name": "x", "rotors": [rotor], "range_m": 1e4, **motion}]})
        assert any("they alias" in line for line in built.warnings()) == warned


def test_tips_of_several_rotors_that_alias_are_one_warning_whose_prf_is_enough():
    def warnings(prf_hz):
        radar = {"carrier_hz": 24.125e9, "prf_hz": prf_hz, "pulses": 1000}
        return Scene.build({"radar": radar, "uav": [{"name": "x", "airframe": "hexacopter_30cm"}]}).warnings()

    (warned,) = warnings(20e3)
    rotors = ", ".join(f"rotors[{number}]" for number in range(6))
    assert warned.startswith(f"x: {rotors}: their tips show up to 66.7 m/s, beyond the unambiguous 62.1 m/s")
    enough_hz = float(warned.split("a PRF of ")[1].split()[0])
    assert warnings(enough_hz) == []
    (lone,) = warnings(0.999 * enough_hz)
    assert lone.startswith("x: rotors[5]: its tips show 66.7 m/s, beyond")


@pytest.mark.parametrize("bird", [{"members": 20, "flock_velocity_mps": 10.0}, {"heave_m": 8.0}])
def test_no_bird_of_a_flock_comes_to_the_radar(bird):
    radar, starling = {**RADAR, "pulses": round(2 * RADAR["prf_hz"])}, {"name": "x", "species": "starling"}
    with pytest.raises(SceneError, match=r"within the dwell of 2 s \(pulses / PRF\) it comes to"):
        Scene.build({"radar": radar, "bird": [{**starling, "range_m": 5.0, **bird}]})
    Scene.build({"radar": radar, "bird": [{**starling, "range_m": 5.0}]})
    Scene.build({"radar": radar, "bird": [{**starling, "range_m": 500.0, **bird}]})


def test_a_prf_in_khz_is_warned_of():
    said = Scene.build({"radar": {**RADAR, "prf_hz": 25.0}}).warnings()
    assert said == ["radar.prf_hz is 25: in Hz, so that 25 kHz is 25e3"]


def test_a_rotor_s_own_angle_stands_in_the_truth():
    rotor = {"blade_length_m": 0.15, "rotation_hz": 58.0, "flash_db": 15.0}
    uav = {"name": "x", "beta_deg": 20.0, "rotors": [rotor, rotor | {"beta_deg": 60.0}]}
    truth = Scene.build({"radar": RADAR, "uav": [uav]}).render().truth[0]
    assert (truth["beta_deg"], truth["rotor_beta_deg"]) == (20.0, [20.0, 60.0])


def test_rpm_and_grams_are_warned_of():
    rotor = {"blade_length_m": 0.15, "rotation_hz": 3500.0, "flash_db": 15.0, "beta_deg": 90.0}
    bird = {"name": "b", "mass_kg": 350.0, "wing_db": 10.0, "body_db": 20.0}
    said = Scene.build({"radar": RADAR, "uav": [{"name": "x", "rotors": [rotor] * 2}], "bird": [bird]}).warnings()
    assert [line.split("faster than sound: ")[1] for line in said[:2]] == [
        "blade_length_m is in metres, rotation_hz in turns a second, so that 3500 rpm are 58.3"
    ] * 2
    assert said[2:] == [
        "x: rotors[0], rotors[1]: seen along its axis (90 degrees) each shows no micro-Doppler",
        "b: mass_kg is 350, heavier than any bird that flies: 350 g are 0.35",
    ]


def test_a_jitter_that_pulses_change_places_by_is_warned_of():
    for jitter_s, warned in ((0.1e-4, False), (0.24e-4, False), (0.26e-4, True), (1.0, True)):
        said = Scene.build({"radar": {**RADAR, "prf_hz": 1e4}, "receiver": {"jitter_s": jitter_s}}).warnings()
        assert any("change places" in line for line in said) == warned


def test_ninety_degrees_is_right_and_warned_of():
    flat = Scene.build(scene(uav=[uav(beta_deg=90.0, range_m=1e5)])).without("noise")
    assert any("90 degrees" in line for line in flat.warnings())
    np.testing.assert_allclose(abs(flat.render().iq - flat.render().iq[0]), 0, atol=1e-3)


def test_switching_a_part_off_changes_no_other():
    both = Scene.load("gulls_and_drone")
    short = Scene.build({**dict(both), "radar": {**dict(both.radar), "pulses": 300}})
    quiet = short.without("noise", "phase_noise", "converter")
    dc = Scene.build({**dict(quiet), "uav": (), "bird": (), "clutter": ()}).render(3).iq
    parts = [
        quiet.without(*(name for name in ("drone", "gulls", "sea") if name != kept)).render(3).iq - dc
        for kept in ("drone", "gulls", "sea")
    ]
    np.testing.assert_allclose(sum(parts) + dc, quiet.render(3).iq, atol=2e-4)


def test_a_part_is_off_by_its_switch_as_by_its_name():
    by_switch = Scene.build(scene(uav=[uav(on=False)])).render(5).iq
    np.testing.assert_array_equal(by_switch, Scene.build(scene()).without("drone").render(5).iq)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**63))
def test_noise_has_unit_power_for_any_seed(seed):
    iq = Scene.build({"radar": {**RADAR, "pulses": 20_000}}).render(seed).iq
    # the mean of n exponentials scatters by 1 / sqrt(n); 6 sigma
    assert np.mean(abs(iq) ** 2) == pytest.approx(1, abs=6 / np.sqrt(20_000))


def test_the_seed_decides_the_noise_and_a_negative_one_is_refused():
    built = Scene.build(scene())
    np.testing.assert_array_equal(built.render(4).iq, built.render(4).iq)
    assert abs(built.render(4).iq - built.render(5).iq).max() > 0.1
    with pytest.raises(ValueError, match="seed is -1"):
        built.render(-1)


def test_levels_are_those_of_the_scene():
    body = Scene.build(scene(uav=[{"name": "x", "body": [{"level_db": 23.0}]}])).without("noise").render().iq
    np.testing.assert_allclose(20 * np.log10(abs(body)), 23, atol=1e-3)
    ground = {"name": "g", "kind": "ground", "level_db": 17.0}
    clutter = Scene.build({"radar": RADAR, "clutter": [ground]}).without("noise").render(2).iq
    assert 10 * np.log10(np.mean(abs(clutter) ** 2)) == pytest.approx(17, abs=1e-3)
    turned = uav(rotors=[{**ROTOR, "blades": 1, "rotation_hz": 0.0, "phase_deg": 90.0}], body=[])
    flash = Scene.build(scene(uav=[turned])).without("noise").render().iq  # a blade at rest at a right angle
    np.testing.assert_allclose(20 * np.log10(abs(flash)), 20, atol=1e-3)


def test_a_bounding_bird_folds_its_wings_and_a_gliding_one_holds_them():
    bird = {"name": "b", "species": "siskin", "wing_db": 20.0, "body_db": 0.0, "flap_s": 0.5, "rest_s": 0.5}
    radar = {"carrier_hz": 9.85e9, "prf_hz": 2e3, "pulses": 2000}
    for flight, amplitude in (("bound", 1.0), ("flap_glide", None)):
        built = Scene.build({"radar": radar, "bird": [{**bird, "flight": flight}]}).without("noise")
        iq = abs(built.render().iq)
        assert np.ptp(iq[1100:]) < 1e-3 * iq.max()  # at rest in the second half
        assert np.ptp(iq[:900]) > 0.1 * iq.max()
        if amplitude:
            np.testing.assert_allclose(iq[1100:], amplitude, atol=1e-3)


def test_a_glide_has_no_wingbeat():
    still = {"name": "gull", "species": "herring_gull", "body_db": -200.0, "stroke_scale": 0.0, "heave_m": 0.0}
    power = np.abs(Scene.build({"radar": RADAR, "bird": [still], "receiver": {"noise": False}}).render().iq) ** 2
    assert power.max() / power.min() < 1.0001


def test_the_papers_bird_sweeps_its_line_and_flashes_as_measured():
    found = Scene.load("paper_bird").without("noise")
    iq = found.render().iq
    body = Scene.build({**dict(found), "bird": [{**dict(found.bird[0]), "wing_db": -100.0}]}).render().iq
    line_hz = np.diff(np.unwrap(np.angle(body.astype(complex)))) * found.radar.prf_hz / (2 * np.pi)
    assert line_hz[0] == pytest.approx(-340, abs=1)
    assert line_hz[-1] == pytest.approx(316, abs=1)
    # the wings' flashes repeat with the wingbeat: the envelope's autocorrelation peaks at 0.302 s
    envelope = abs(iq) - abs(iq).mean()
    lags = np.arange(int(0.2 * 4e3), int(0.4 * 4e3))
    correlation = [np.dot(envelope[:-lag], envelope[lag:]) / (len(envelope) - lag) for lag in lags]
    assert lags[int(np.argmax(correlation))] / 4e3 == pytest.approx(0.302, abs=0.002)


def test_drawing_records_needs_no_pydantic_and_scenes_are_fetched_when_asked_for():
    code = (
        "import sys, bladewing.simulate as s; assert 'pydantic' not in sys.modules; "
        "s.Scene; assert 'pydantic' in sys.modules; assert not hasattr(s, 'Scenery')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_seed_that_is_no_whole_number_is_refused_and_scenes_are_offered_by_name():
    for wrong, said in ((1.5, "seed is 1.5: it must be a whole number"), ("1", "seed is '1'"), (-1, "at least 0")):
        for work in (empty().plan, empty().render, lambda seed: empty().render(seed, full=True)):
            with pytest.raises(ValueError, match=said):
                work(wrong)
    assert np.array_equal(empty().render(np.int64(3)).iq, empty().render(3).iq)
    assert {"Scene", "SceneError", "draw_records"} <= set(dir(bladewing.simulate))


def empty(**receiver) -> Scene:
    return Scene.build({"radar": {**RADAR, "pulses": 5000}, "receiver": {"noise": False, **receiver}})


def test_the_receivers_parts_do_what_their_values_say():
    dc = empty(dc_db=-3.0).render().iq
    np.testing.assert_allclose(dc, 10 ** (-3 / 20), rtol=1e-6)
    mains = empty(effects=["mains"], mains_hz=60.0, values={"mains_db": 6.0}).render(2).iq
    lines = abs(np.fft.fft(mains)) ** 2 / len(mains) ** 2  # 0.2 s: 60 Hz is bin 12
    assert lines.sum() == pytest.approx(10**0.6, rel=0.01)
    on_lines = np.zeros(len(lines), bool)
    on_lines[12 : 12 * 12 + 1 : 12] = on_lines[-12 : -12 * 12 - 1 : -12] = True
    assert lines[~on_lines].sum() < 1e-9
    values = {"burst_hz": 40.0, "burst_share": 0.05, "burst_db": 6.0}
    bursts = np.array([empty(effects=["bursts"], values=values).render(seed).iq for seed in range(20)])
    assert np.mean(abs(bursts) ** 2) == pytest.approx(10**0.6, rel=0.1)
    assert np.mean(bursts != 0) == pytest.approx(0.05, abs=0.002)
    for gate in bursts != 0:  # 5000 pulses hold 8 periods of 625
        np.testing.assert_array_equal(gate[625:], gate[:-625])
    ticks = np.array(
        [empty(effects=["bursts"], values={**values, "burst_share": 0.0003}).render(s).iq for s in range(40)]
    )
    assert np.all(np.sum(ticks != 0, axis=-1) == 8)  # however short, each spoils a pulse
    alike = np.all(np.isclose(ticks[:, 625:], ticks[:, :-625]), axis=-1)
    assert 8 <= alike.sum() <= 32  # half of 40, by four deviations
    np.testing.assert_allclose(np.mean(abs(ticks[alike]) ** 2, axis=-1), 10**0.6, rtol=1e-5)
    noise = {"noise": True, "effects": ["converter"], "values": {"adc_bits": 6.0, "full_scale_db": 0.0}}
    coarse = empty(**noise).render(1).iq
    assert len(np.unique(coarse.real)) <= 2**6 + 1
    assert len(np.unique(empty(**{**noise, "effects": []}).render(1).iq.real)) > 2**10


def test_every_effect_of_a_receiver_has_random_numbers_of_its_own(monkeypatch):
    """Else noise, phase noise and bursts of one seed would rise and fall together."""
    drawn = []

    def receive(self, signal, noise, radar, normals_of):
        drawn.extend(normals_of(name)(np.array([0]))(3).tobytes() for name in FAULT_CHANCE)
        return signal

    monkeypatch.setattr(Receiver, "receive", receive)
    for seed in (4, 5):
        empty().render(seed)
    assert len(set(drawn)) == 2 * len(FAULT_CHANCE)


def test_phase_noise_turns_a_line_and_leaves_its_power():
    part = uav(rotors=[])
    values = {"radar": RADAR, "uav": [part], "receiver": {"noise": False}}
    clean = Scene.build(values).render().iq
    receiver = {"noise": False, "effects": ["phase_noise"], "values": {"phase_noise_rad": 0.02}}
    turned = Scene.build({**values, "receiver": receiver}).render().iq
    np.testing.assert_allclose(abs(turned), abs(clean), rtol=1e-5)
    assert 0.002 < np.std(np.angle(turned / clean)) < 0.1


def test_jitter_of_the_prf_moves_the_phase_of_what_moves():
    part = uav(rotors=[], velocity_mps=20.0)
    still = Scene.build({"radar": RADAR, "uav": [part], "receiver": {"noise": False}}).render().iq
    receiver = {"noise": False, "jitter_s": 1e-6}
    shaken = Scene.build({"radar": RADAR, "uav": [part], "receiver": receiver}).render().iq
    expected_rad = 4 * np.pi / 0.0304357825 * 20 * 1e-6
    # the rms of a thousand normal numbers scatters by 2.2 %; 6 sigma
    assert np.std(np.angle(shaken / still)) == pytest.approx(expected_rad, rel=0.14)


def test_a_flock_is_the_sum_of_unlike_birds_and_its_own_seed_decides_them():
    bird = {"name": "b", "species": "starling", "members": 4, "heave_m": 0.01}
    one, other = (
        Scene.build({"radar": RADAR, "bird": [{**bird, "flock_seed": seed}], "receiver": {"noise": False}})
        for seed in (1, 2)
    )
    np.testing.assert_array_equal(one.render(1).iq, one.render(2).iq)
    assert abs(one.render().iq - other.render().iq).max() > 1
    assert one.render().truth[0]["members"] == 4


def test_phases_turn_what_they_belong_to():
    def rendered(body_deg: float, hub_deg: float) -> np.ndarray:
        part = uav(body=[{"level_db": 10.0, "phase_deg": body_deg}], rotors=[{**ROTOR, "hub_phase_deg": hub_deg}])
        return Scene.build({"radar": RADAR, "uav": [part], "receiver": {"noise": False}}).render().iq

    plain, both = rendered(0.0, 0.0), rendered(90.0, 90.0)
    np.testing.assert_allclose(both, 1j * plain, atol=1e-3)
    body = np.sqrt(10) * np.exp(-4j * np.pi / Scene.load("type1").sight.wavelength_m * 1000.0)
    np.testing.assert_allclose(rendered(90.0, 0.0) - plain, (1j - 1) * body, atol=1e-3)


def insects(seed: int, **values: float):
    radar = {"carrier_hz": 9.85e9, "prf_hz": 4e3, "pulses": 4000}
    part = {"name": "swarm", "kind": "insects", "level_db": 5.0, "values": values}
    return Scene.build({"radar": radar, "clutter": [part], "receiver": {"noise": False}}).render(seed)


@pytest.mark.parametrize("seed", range(5))
def test_insects_drift_with_the_wind_and_have_the_level_of_the_scene(seed):
    found = insects(seed, insect_velocity_mps=3.0, insect_spread_mps=0.3, insect_count=12.0)
    assert 10 * np.log10(np.mean(abs(found.iq) ** 2)) == pytest.approx(5, abs=1e-3)
    velocity = -np.fft.fftfreq(4000, 1 / 4e3) * found.radar.wavelength_m / 2
    power = power_spectrum(found.iq)
    # 4.5 sigma of own flight and the side line of a wingbeat of at most 275 Hz
    assert power[abs(velocity - 3) > 4.5 * 0.3 + 275 * found.radar.wavelength_m / 2].sum() < 1e-6 * power.sum()
    assert found.truth[0]["members"] == 12


def test_an_insects_echo_swells_at_its_wingbeat():
    found = insects(3, insect_count=1.0, insect_wingbeat_hz=100.0, insect_depth=0.4)
    swell = abs(found.iq) / abs(found.iq).mean()
    assert swell.max() == pytest.approx(1.4, abs=0.02)
    lines = abs(np.fft.rfft(swell - swell.mean()))
    assert 89 < lines.argmax() < 111  # a second: bins are Hz


def clutter_of(kind: str, seed: int = 0, **values: float):
    part = {"name": "c", "kind": kind, "level_db": 10.0, "values": values}
    return Scene.build({"radar": {**RADAR, "pulses": 300}, "clutter": [part]}).render(seed)


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("vehicle", "wheels"),
        ("vehicle", "spokes"),
        ("vehicle", "tyre_points"),
        ("vehicle", "body_points"),
        ("vehicle", "sight_rad"),
        ("wind_turbine", "turbine_points"),
        ("wind_turbine", "turbine_row_points"),
        ("insects", "insect_count"),
        ("ground", "wind_mph"),
        ("person", "gait_hz"),
    ],
)
def test_values_that_cannot_be_rendered_are_refused_and_those_at_the_bounds_are_finite(kind, name):
    low, high = BOUNDS[name]
    most = min(high, 3e4)
    for value in (low, most):
        assert all(np.isfinite(clutter_of(kind, seed, **{name: value}).iq).all() for seed in range(6))
    for value in (low - 0.1 * abs(low), high * 1.1):
        with pytest.raises(SceneError, match=rf"{name} is .*must be"):
            clutter_of(kind, **{name: value})


def test_a_person_walks_at_its_speed_unless_it_is_said_to_run_or_to_ride():
    speeds = {clutter_of("person", seed, person_mps=1.3).truth[0]["velocity_mps"] for seed in range(6)}
    assert speeds == {1.3}
    assert clutter_of("person", person_mps=2.0, pace=2.5, pedalling=1.0).truth[0]["velocity_mps"] == 5.0


def extremes(name: str) -> tuple[float, float]:
    """Least and largest value of a parameter that a scene may give; of those that count points, few enough to draw."""
    (low, high), above = bounds_of(name), LAWS[name].kind == "log"
    return max(low, 1e-12 if above else -MOST), min(high, 1e4 if name.endswith("_points") else MOST)


@pytest.mark.parametrize("kind", ["ground", "rain", "sea", "person", "vehicle", "wind_turbine", "insects"])
def test_every_parameter_of_a_clutter_is_rendered_at_its_extremes(kind):
    unknown = clutter_of(kind, **{name: law.low for name, law in LAWS.items()}).warnings
    unused = {line.split(": ")[1].split()[0] for line in unknown}
    used = sorted(LAWS.keys() - unused)
    assert len(used) >= 2
    for name in used:
        for value in extremes(name):
            assert np.isfinite(clutter_of(kind, **{name: value}).iq).all(), (name, value)


def test_every_parameter_of_a_receiver_is_rendered_at_its_extremes():
    part = {"name": "c", "kind": "rain", "level_db": 10.0}
    for name in LAWS:
        for value in extremes(name):
            receiver = {"effects": list(FAULT_CHANCE), "values": {name: value}}
            scene = Scene.build({"radar": {**RADAR, "pulses": 100}, "clutter": [part], "receiver": receiver})
            assert np.isfinite(scene.render().iq).all(), (name, value)


def test_the_body_of_a_confuser_stands_over_its_limbs_by_what_was_drawn(monkeypatch):
    turns = np.arange(1000)[None] / 1000
    limbs, body = (np.exp(2j * np.pi * number * turns).astype(np.complex64) for number in (20, 3))
    monkeypatch.setattr(reception, "draw_discrete", lambda *_: Target(limbs, 5 * body, np.array([12.0])))
    walker = {"name": "walker", "kind": "person", "level_db": 17.0}
    iq = Scene.build({"radar": RADAR, "clutter": [walker], "receiver": {"noise": False}}).render().iq
    lines_db = 20 * np.log10(np.abs(np.fft.fft(iq)[[20, 3]]) / 1000)
    assert np.diff(lines_db) == pytest.approx(12, abs=1e-3)
    assert 10 * np.log10(np.sum(10 ** (lines_db / 10))) == pytest.approx(17, abs=1e-3)


def test_a_vehicle_that_a_narrow_beam_misses_is_silent():
    for seed in range(150):
        assert np.isfinite(clutter_of("vehicle", seed, beam_rad=0.01).iq).all()


@pytest.mark.parametrize("pulses", [1, 300])
def test_a_converter_leaves_silence_silent(pulses):
    receiver = {"noise": False, "effects": ["high_pass", "converter"]}
    scene = Scene.build({"radar": {**RADAR, "pulses": pulses}, "receiver": receiver})
    for full in (False, True):
        assert not scene.render(full=full).iq.any()


def test_a_value_that_a_kind_of_clutter_does_not_know_is_warned_of():
    said = clutter_of("rain", rain_width_mps=2.0, wind_mph=30.0).warnings
    assert [line.partition(": ")[2] for line in said] == ["wind_mph changes nothing of a clutter of kind rain"]


@pytest.mark.parametrize(
    ("values", "idle"),
    [
        ({"ground_width_mps": 0.5, "ground_still_db": 20.0}, ["ground_still_db", "ground_width_mps"]),
        ({"ground_law": 0.0, "wind_mph": 30.0, "ground_width_mps": 0.5}, ["wind_mph"]),
        ({"wind_mph": 30.0}, []),
    ],
)
def test_a_value_of_the_law_by_which_ground_does_not_move_is_warned_of(values, idle):
    said = clutter_of("ground", **values).warnings
    assert [line.partition(": ")[2] for line in said] == [
        f"{name} changes nothing of a clutter of kind ground" for name in idle
    ]


def test_what_of_a_receiver_does_not_reach_everything_is_warned_of():
    ground = {"name": "field", "kind": "ground", "level_db": 10.0}
    receiver = {"jitter_s": 1e-6, "mains_hz": 60.0}
    said = Scene.build({"radar": RADAR, "clutter": [ground], "receiver": receiver}).warnings()
    assert said == [
        "receiver.jitter_s moves UAVs and birds alone: clutter is rendered at even instants",
        'receiver.mains_hz changes nothing without "mains" or "bursts" among the effects',
    ]


def test_a_value_that_no_receiver_knows_is_warned_of():
    values = {"wind_mph": 30.0, "gain_db": 40.0, "image_db": -20.0}
    scene = Scene.build({"radar": RADAR, "receiver": {"effects": ["image"], "values": values}})
    assert scene.render().warnings == [
        f"receiver.values: {name} changes nothing of a receiver" for name in ("gain_db", "wind_mph")
    ]


def test_a_texture_swells_at_the_rate_that_is_asked_for():
    """Beyond the rates that training draws too: a few sinusoids of one rate are one, and its law is undone exactly."""
    radar, shape = Radar(1e9, 2e3, 4000), np.array([1.5])
    chosen = Chosen(np.random.default_rng(0).random((1, WIDTH)), {"texture_hz": 60.0})
    texture = _texture(chosen, radar, shape)[0].astype(float) ** 2
    gaussian = special.ndtri(special.gammainc(shape, texture * shape))
    lines = np.abs(np.fft.rfft(gaussian * np.hanning(len(gaussian))))
    assert lines.argmax() == 60 * radar.dwell_s
    assert np.sum(lines[118:123] ** 2) > 0.99 * np.sum(lines**2)


def test_bursts_come_at_the_mains_that_is_asked_for():
    """What ticks with the mains of its receiver follows it; others keep their rate."""
    for seed in range(12):
        drawn = Reception(empty(effects=("bursts",)), seed).drawn
        asked = Reception(empty(effects=("bursts",), mains_hz=400.0), seed).drawn
        turns = drawn.burst_hz / drawn.mains_hz
        wanted = 400.0 * turns if drawn.bursts_of_mains[0] else drawn.burst_hz
        np.testing.assert_allclose(asked.burst_hz, wanted)


@pytest.mark.parametrize("seed", range(6))
def test_wheels_and_their_echoes_may_both_be_the_most(seed):
    assert np.isfinite(clutter_of("vehicle", seed, wheels=4, spokes=10, tyre_points=60).iq).all()


@pytest.mark.parametrize("seed", range(8))
def test_a_value_that_is_fixed_is_fixed_whatever_is_drawn_beside_it(seed):
    # on a straight road far away nothing but the pull itself accelerates the vehicle
    fixed = {"vehicle_mps": 1.5, "road_m": 1e6, "sight_rad": 1.4}
    pulled = clutter_of("vehicle", seed, road_acceleration_mps2=3.0, **fixed).truth[0]
    assert pulled["acceleration_mps2"] == pytest.approx(3.0 * np.sin(1.4), rel=1e-3)
    near = clutter_of("vehicle", seed, road_acceleration_mps2=0.0, vehicle_mps=1.0, verge_m=2.0, sight_rad=0.0).truth[0]
    assert near["acceleration_mps2"] == pytest.approx(1.0 / 2.0, rel=1e-3)


def test_a_bird_is_lowest_where_its_wings_are_highest():
    bird = {"name": "b", "species": "starling", "range_m": 100.0, "heave_m": 0.02, "elevation_deg": 90.0}
    (part,) = Scene.build({"radar": RADAR, "bird": [bird]}).bird
    (one,) = members(part)
    times = np.linspace(0, 1, 1000)
    cycle, _ = _cycle_rad(part, times, one)
    # straight above the radar, range is height; the wings are highest at phase 0
    np.testing.assert_allclose(heave_range_m(part, times, one), -0.02 * np.cos(cycle), atol=1e-12)


@pytest.mark.parametrize(("amplitudes", "flashes"), [([1.0, 0.0, 1.0, 0.0], 2), ([1.0, 0.0, 0.0], 1), ([0.5, 1.0], 2)])
def test_blades_that_do_not_reflect_do_not_flash(amplitudes, flashes):
    rotor = {**ROTOR, "blades": len(amplitudes), "blade_amplitudes": amplitudes}
    radar = {"carrier_hz": 9.85e9, "prf_hz": 20e3, "pulses": 2000}
    rendered = Scene.build({"radar": radar, "uav": [uav(rotors=[rotor])]}).render()
    assert rendered.truth[0]["chopping_hz"] == [pytest.approx(ROTOR["rotation_hz"] * flashes)]


@pytest.mark.parametrize(
    ("amplitudes", "repeats"),
    [([1.0] * 4, 4), ([1.0, 0.5, 1.0, 0.5], 2), ([1.0, 0.5, 0.5, 0.5], 1), ([1.0, 1.0, 0.5], 1), ([1.0], 1)],
)
def test_lines_stand_as_far_apart_as_a_turn_looks_the_same_often(amplitudes, repeats):
    rotor = {**ROTOR, "blades": len(amplitudes), "blade_amplitudes": amplitudes}
    radar = {"carrier_hz": 9.85e9, "prf_hz": 20e3, "pulses": 2000}
    part = uav(body=[], rotors=[rotor])
    rendered = Scene.build({"radar": radar, "uav": [part], "receiver": {"noise": False}}).render()
    assert rendered.truth[0]["line_spacing_hz"] == [pytest.approx(ROTOR["rotation_hz"] * repeats)]
    assert rendered.truth[0]["chopping_hz"] == [pytest.approx(ROTOR["rotation_hz"] * len(amplitudes))]
    # one bin in five is a multiple of the rotation rate: lines stand on some of those alone
    power = power_spectrum(rendered.iq)[:500:5]
    lines = power > 1e-6 * power.max()
    assert set(np.flatnonzero(lines) % repeats) == {0}
    assert lines[repeats]


def received(effects: list[str], **values: float) -> Rendering:
    rain = {"name": "shower", "kind": "rain", "level_db": 10.0}
    receiver = {"effects": effects, "values": values}
    return Scene.build({"radar": RADAR, "clutter": [rain], "receiver": receiver}).render(seed=3)


@pytest.mark.parametrize("name", EFFECT_OF)
def test_a_value_of_a_receiver_changes_its_effect_alone_and_is_warned_of_without_it(name):
    effect, low = EFFECT_OF[name], LAWS[name].low
    high = low + 0.9 * (LAWS[name].high - low)  # both ends of a turn are one
    several = {
        "impulse_turns": {"impulse_lasts": 20.0},  # one pulse has but a phase
        "impulse_sweep": {"impulse_lasts": 20.0},
    }.get(name, {})
    with_it, other = received([effect], **several, **{name: low}), received([effect], **several, **{name: high})
    assert not with_it.warnings
    assert not np.array_equal(with_it.iq, other.iq)
    others = [one for one in FAULT_CHANCE if one != effect]
    without, other = received(others, **{name: low}), received(others, **{name: high})
    assert without.warnings == [f'receiver.values: {name} changes nothing without "{effect}" among the effects']
    np.testing.assert_array_equal(without.iq, other.iq)


def test_an_effect_that_is_switched_off_is_meant_to_be():
    receiver = {"effects": ["fading"], "values": {"fading_db": 3.0}}
    scene = Scene.build({"radar": RADAR, "receiver": receiver})
    assert not scene.without("fading").render().warnings
    assert not scene.without("fading").warnings()


def test_every_parameter_that_a_receiver_draws_has_an_effect_of_its_own():
    warned = received(list(FAULT_CHANCE), **{name: law.low for name, law in LAWS.items()}).warnings
    unused = {line.split(": ")[1].split()[0] for line in warned}
    assert LAWS.keys() - unused == EFFECT_OF.keys() | {"phase_rad"}


def test_flicker_has_its_density_at_a_hundredth_of_the_prf_and_falls_with_the_frequency():
    values = {"flicker_db": 12.0}
    iq = np.array([empty(effects=["flicker"], values=values).render(seed).iq for seed in range(30)])
    density = np.mean(np.abs(np.fft.fft(iq * np.hanning(5000), axis=-1)) ** 2, axis=0) / np.sum(np.hanning(5000) ** 2)
    for share, level_db in ((0.01, 12.0), (0.1, 2.0)):
        for near in (np.arange(45, 56) * share / 0.01, -np.arange(45, 56) * share / 0.01):
            mean_db = 10 * np.log10(density[near.astype(int)].mean())
            assert mean_db == pytest.approx(level_db, abs=1.2)  # 0.4 dB, of 330 values half alike


def test_spoilt_pulses_have_the_level_asked_for_and_any_phase():
    values = {"impulse_db": 20.0, "impulse_lasts": 1.0}
    iq = np.array([empty(effects=["impulses"], values=values).render(seed).iq for seed in range(60)])
    spoilt = iq[iq != 0]
    assert len(spoilt) > 100
    assert np.mean(np.isclose(np.abs(spoilt), 10.0, rtol=1e-5)) > 0.98  # two may fall on one pulse
    turns = np.exp(1j * np.angle(spoilt))
    assert abs(turns.mean()) < 4 / np.sqrt(2 * len(spoilt))


def test_pulses_of_another_radar_are_evenly_spaced_of_one_level_and_any_phase():
    values = {"impulse_db": 20.0, "impulse_pulses": 37.4, "impulse_lasts": 1.0}
    iq = np.array([empty(effects=["impulses"], values=values).render(seed).iq for seed in range(20)])
    firsts = []
    for one in iq:
        places = np.flatnonzero(one)
        firsts.append(places[0])
        np.testing.assert_allclose(np.abs(one[places]), 10.0, rtol=1e-5)
        away = places - places[0] - 37.4 * np.arange(len(places))
        assert np.abs(away).max() < 1
        assert len(places) in (133, 134)
    assert min(firsts) < 10
    assert max(firsts) in range(27, 38)
    turns = np.exp(1j * np.angle(iq[iq != 0]))
    assert abs(turns.mean()) < 4 / np.sqrt(2 * len(turns))


def test_so_many_pulses_are_spoilt_as_asked_for_and_anywhere_in_the_record():
    values = {"impulse_lasts": 1.0, "impulse_count": 40.0}
    places = [np.flatnonzero(empty(effects=["impulses"], values=values).render(seed).iq) for seed in range(30)]
    assert max(map(len, places)) == 40
    assert min(map(len, places)) >= 38  # two may fall on one pulse
    share = np.sort(np.concatenate(places)) / 5000
    away = np.abs(share - (np.arange(len(share)) + 0.5) / len(share)).max()
    assert away < 1.95 / np.sqrt(len(share))  # Kolmogorov-Smirnov, 0.1 %


def test_a_spur_is_a_steady_line_of_the_level_asked_for():
    values = {"spur_db": 20.0, "spur_turns": 0.1, "spur_count": 1.0}
    for seed in range(5):
        iq = empty(effects=["spurs"], values=values).render(seed).iq
        np.testing.assert_allclose(np.abs(iq), 10.0, rtol=1e-5)
        np.testing.assert_allclose(np.angle(iq[1:] * iq[:-1].conj()), 0.2 * np.pi, atol=1e-5)
    values = {"spur_db": 20.0, "spur_count": 3.0}
    powers = [np.mean(np.abs(empty(effects=["spurs"], values=values).render(seed).iq) ** 2) for seed in range(40)]
    assert np.mean(powers) == pytest.approx(300.0, rel=0.03)


def test_a_spoilt_stretch_is_a_tone_of_one_level_that_sweeps_either_way_and_leaves_pauses():
    values = {"impulse_db": 20.0, "impulse_lasts": 12.0, "impulse_turns": 0.1, "impulse_sweep": 0.24}
    ways = []
    for seed in range(20):
        iq = empty(effects=["impulses"], values={**values, "impulse_pulses": 300.0}).render(seed).iq
        places = np.flatnonzero(iq)
        stretches = [run for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if len(run) == 12]
        assert len(stretches) in (16, 17)
        for run in stretches:
            np.testing.assert_allclose(np.abs(iq[run]), 10.0, rtol=1e-5)
            turns = np.angle(iq[run][1:] * iq[run][:-1].conj()) / (2 * np.pi)
            ways.append(np.sign(turns[-1] - turns[0]))
            np.testing.assert_allclose(turns, 0.1 + ways[-1] * 0.24 * (np.arange(11) + 0.5) / 12, atol=1e-4)
    assert set(ways) == {-1.0, 1.0}
    dense = empty(effects=["impulses"], values={**values, "impulse_pulses": 20.0}).render(1).iq
    assert np.mean(dense != 0) == pytest.approx(5 / 20, abs=0.01)


def test_a_shaken_airframe_turns_its_echo_at_the_rate_of_the_shaking():
    shaken = uav(rotors=[], vibration_rad=0.4, vibration_hz=75.0)
    iq = Scene.build({"radar": RADAR, "uav": [shaken], "receiver": {"noise": False}}).render(full=True).iq
    turned = np.unwrap(np.angle(iq * iq[0].conj()))
    expected = 0.4 * np.sin(2 * np.pi * 75.0 * np.arange(1000) / 25e3)
    np.testing.assert_allclose(turned - turned.mean(), expected - expected.mean(), atol=1e-4)


def test_every_part_that_is_rendered_is_told():
    told = []
    scene = Scene.load("gulls_and_drone")
    parts = len(scene.uavs) + len(scene.birds) + len(scene.clutters)
    assert len(render(scene, on_part=told.append).truth) == parts
    assert told == list(range(1, parts + 1))
