"""The plan: every bound holds on random scenes and is not idle, and what is left out stays within the tolerance."""

import re
from itertools import product

import numpy as np
import pytest
from bladewing.simulate.bounds import UavBounds, bird_bound, gauss_error, moment_envelope
from bladewing.simulate.bounds_receiver import CHAIN
from bladewing.simulate.exact import blade_points
from bladewing.simulate.fidelity import BIRD_EFFECTS, UAV_EFFECTS, Fidelity
from bladewing.simulate.parts import BirdPart, RotorPart, UavPart
from bladewing.simulate.plan import make_plan
from bladewing.simulate.radar import Radar
from bladewing.simulate.render import render
from bladewing.simulate.render_bird import bird_echo
from bladewing.simulate.render_uav import full_fidelity, uav_echo
from bladewing.simulate.scene import Scene, shipped

SCENES = 40


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def random_uav(rng: np.random.Generator) -> tuple[UavPart, Radar]:
    radar = Radar(log_uniform(rng, 2e9, 40e9), log_uniform(rng, 5e3, 40e3), 250)
    rotors = []
    for _ in range(rng.integers(1, 7)):
        length, blades = log_uniform(rng, 0.05, 0.4), int(rng.integers(1, 5))
        rate = float(rng.uniform(30, 180) / (2 * np.pi * length) * rng.choice([-1, 1]))
        rotors.append(
            {
                "blade_length_m": length,
                "root_m": length if rng.random() < 0.2 else float(length * rng.uniform(0, 0.6)),
                "points": None if rng.random() < 0.6 else int(rng.integers(1, 16)),
                "rotation_hz": rate,
                "blades": blades,
                "blade_amplitudes": [float(a) for a in rng.uniform(0.5, 1.5, blades)],
                "edge_asymmetry": float(rng.uniform(-0.9, 0.9)),
                "flash_db": float(rng.uniform(-10, 30)),
                "phase_deg": float(rng.uniform(0, 360)),
                "hub_phase_deg": float(rng.uniform(0, 360)),
                "offset_m": float(rng.uniform(0, 0.5)),
                "bearing_deg": float(rng.uniform(0, 360)),
                "drift_hz_per_s": abs(rate) * log_uniform(rng, 1e-3, 0.3),
                "wander_hz": abs(rate) * log_uniform(rng, 1e-4, 2e-2),
                "wander_rate_hz": log_uniform(rng, 0.5, 20),
                "wander_phase_deg": float(rng.uniform(0, 360)),
            }
        )
    part = UavPart.model_validate(
        {
            "name": "x",
            "range_m": log_uniform(rng, 20, 3000),
            "velocity_mps": float(rng.uniform(-20, 20)),
            "acceleration_mps2": float(rng.uniform(-4, 4)),
            "beta_deg": float(rng.uniform(0, 80)),
            "vibration_rad": log_uniform(rng, 1e-3, 0.6),
            "vibration_hz": float(rng.uniform(20, 200)),
            "body": [
                {"level_db": float(rng.uniform(0, 30)), "offset_m": float(rng.uniform(0, 0.4)), "bearing_deg": 70.0}
                for _ in range(rng.integers(0, 3))
            ],
            "rotors": rotors,
        }
    )
    return part, radar


def energy(samples: np.ndarray) -> float:
    return float(np.sum(abs(samples) ** 2))


@pytest.mark.parametrize("effect", UAV_EFFECTS)
def test_every_bound_of_a_uav_holds_and_is_not_idle(effect):
    ratios = []
    for seed in range(SCENES):
        part, radar = random_uav(np.random.default_rng(seed))
        points = full_fidelity(part, radar).points
        kept = set(UAV_EFFECTS) - ({"blade_curvature"} if effect == "hub_curvature" else set())
        full, less = (
            uav_echo(part, radar, radar.times_s, Fidelity(frozenset(effects), points))
            for effects in (kept, kept - {effect})
        )
        true, bound = energy(full - less), energy(UavBounds(part, radar).of(effect))
        digits = 1e-18 * energy(full) * part.range_m**2  # float64 phases of so many turns
        assert true <= bound * (1 + 1e-9) + digits, (seed, true, bound)
        if true > 100 * digits:
            ratios.append(bound / true)
    assert len(ratios) > SCENES / 3
    assert np.median(ratios) <= 10


@pytest.mark.parametrize("points", [None, 6])
def test_the_bound_of_a_wandering_rate_holds_where_the_sphere_moves_the_flash(points):
    """Blades as long as a tenth of the range and more, in dwells that a straight blade would not flash in."""
    for carrier_hz, length_m, range_m, phase_deg in product(
        (24e9, 94e9), (0.12, 0.4), (1.0, 2.0, 4.0), (60, 70, 76, 80)
    ):
        rotor = RotorPart(
            blade_length_m=length_m, rotation_hz=3.0, phase_deg=phase_deg, flash_db=0.0, points=points,
            wander_hz=0.01, wander_rate_hz=2.0,
        )  # fmt: skip
        part, radar = UavPart(name="near", range_m=range_m, rotors=(rotor,)), Radar(carrier_hz, 20e3, 100)
        full = full_fidelity(part, radar)
        steady = Fidelity(full.effects - {"wander"}, full.points)
        error = energy(uav_echo(part, radar, radar.times_s, full) - uav_echo(part, radar, radar.times_s, steady))
        assert error <= energy(UavBounds(part, radar).wander()) * (1 + 1e-3) + 1e-9


def test_the_bound_of_the_scatterers_spacing_holds_and_is_not_idle():
    ratios = []
    for seed in range(0, SCENES, 2):
        rng = np.random.default_rng(seed)
        part, radar = random_uav(rng)
        best = full_fidelity(part, radar).points
        bounds = UavBounds(part, radar)
        full = uav_echo(part, radar, radar.times_s, Fidelity(frozenset(UAV_EFFECTS), best))
        points = next(n for n in range(1, best) if bounds.spacing(n) <= 10 ** rng.uniform(-3, 1))
        less = uav_echo(part, radar, radar.times_s, Fidelity(frozenset(UAV_EFFECTS), points))
        true, bound = energy(full - less), bounds.spacing(points)
        assert true <= bound + 1e-12, (seed, points, true, bound)
        if true > 1e-12:
            ratios.append(bound / true)
    assert np.median(ratios) <= 10


@pytest.mark.parametrize("effect", BIRD_EFFECTS)
def test_every_bound_of_a_bird_holds_and_is_not_idle(effect):
    ratios = []
    for seed in range(SCENES):
        rng = np.random.default_rng(seed)
        radar = Radar(log_uniform(rng, 2e9, 40e9), 2e3, 400)
        values = {
            "name": "b",
            "mass_kg": log_uniform(rng, 0.01, 10),
            "wing_db": float(rng.uniform(0, 20)),
            "body_db": float(rng.uniform(0, 20)),
            "acceleration_mps2": float(rng.uniform(-5, 5)),
            "heave_m": log_uniform(rng, 1e-4, 0.05),
            "members": int(rng.integers(1, 4)),
            "elevation_deg": float(rng.uniform(-10, 60)),
            "heading_deg": float(rng.uniform(0, 360)),
        }
        part = BirdPart.model_validate(values)
        full, less = (
            bird_echo(part, radar, radar.times_s, Fidelity(frozenset(effects), None))
            for effects in (set(BIRD_EFFECTS), set(BIRD_EFFECTS) - {effect})
        )
        true, bound = energy(full - less), energy(bird_bound(part, radar, effect))
        assert true <= bound * (1 + 1e-6), (seed, true, bound)  # float64 phases of so many turns
        ratios.append(bound / true)
    assert np.median(ratios) <= 10


@pytest.mark.parametrize("order", [0, 1, 2, 4])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_moments_stay_below_their_envelope(order, share):
    z = np.linspace(-60, 60, 241)
    x = np.linspace(0, 1, 20_001)
    radius = share + (1 - share) * x
    moments = np.array([np.trapezoid(radius**order * np.exp(1j * phase * x), x) for phase in z])
    assert (abs(moments) <= moment_envelope(order, z, share) + 1e-6).all()
    for points in (1, 2, 3, 12):
        row = np.linspace(1, share, points)
        moments = np.mean(row**order * np.exp(1j * z[:, None] * np.linspace(1, 0, points)), axis=1)
        assert (abs(moments) <= moment_envelope(order, z, share, points) + 1e-6).all(), points


@pytest.mark.parametrize("points", [1, 2, 5, 20, 60])
def test_gauss_points_miss_no_more_than_said(points):
    half = np.linspace(0.1, 3.0 * points + 1, 50)
    nodes = blade_points(0.0, 1.0, points, "gauss")
    sums = np.exp(2j * half[:, None] * nodes.radius_m) @ nodes.weight
    true = abs(sums - np.exp(1j * half) * np.sinc(half / np.pi))
    assert (true <= gauss_error(points, half) + 1e-13).all()


@pytest.mark.parametrize("tolerance_db", [-30.0, -10.0, 20.0])
def test_what_a_plan_leaves_out_stays_below_its_own_bound_and_the_tolerance(tolerance_db):
    left_out = 0
    for seed in range(12):
        part, radar = random_uav(np.random.default_rng(seed))
        part = part.model_copy(update={"vibration_rad": part.vibration_rad * (seed % 2)})
        radar_part = {"carrier_hz": radar.carrier_hz, "prf_hz": radar.prf_hz, "pulses": radar.pulses}
        scene = Scene.build({"radar": radar_part, "uav": [part]})
        plan = scene.plan(tolerance_db=tolerance_db)
        assert plan.error_db <= tolerance_db + 1e-9
        left_out += sum(not decision.kept for decision in plan.decisions)
        quiet = scene.without("noise")
        error = energy(render(quiet, plan=plan).iq.astype(complex) - render(quiet).iq)
        # the closed form's float32 phases, of Gamma radians, and complex64 itself
        gamma = max(4 * np.pi / radar.wavelength_m * r.blade_length_m for r in part.rotors)
        digits = energy(render(quiet).iq) * (5e-7 * (gamma + 1)) ** 2
        assert error <= 10 ** (plan.error_db / 10) + digits, seed
    assert left_out > 0


def test_a_far_slow_scene_is_rendered_in_closed_form_and_a_near_one_point_by_point():
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3, "pulses": 2000}
    far, near = (
        Scene.build({"radar": radar, "uav": [{"name": "x", "airframe": "quadcopter_12cm", "range_m": r}]})
        for r in (30e3, 15.0)
    )
    assert far.plan().fidelity["x"].points is None
    assert "closed form" in far.plan().explain()
    points = near.plan().fidelity["x"].points
    assert points is not None
    assert points < full_fidelity(near.uav[0], near.sight).points
    assert f"{points} a blade" in near.plan().explain()
    # noise decides: without it nothing that is there may be missing
    assert far.without("noise").plan().fidelity["x"].points is not None


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scene_explains_itself(name):
    scene = Scene.load(name)
    short = Scene.build({**dict(scene), "radar": {**dict(scene.radar), "pulses": 300}})
    lines = short.plan().explain().splitlines()
    assert len(lines) >= 1 + len(UAV_EFFECTS) * len(short.uavs) + len(BIRD_EFFECTS) * len(short.birds)
    assert "tolerance -10.0 dB" in lines[0]


def test_a_plan_says_whether_the_samples_fold():
    def said(prf_hz: float) -> str:
        radar = {"carrier_hz": 9.85e9, "prf_hz": prf_hz, "pulses": 500}
        scene = Scene.build(
            {"radar": radar, "uav": [{"name": "x", "airframe": "quadcopter_12cm", "velocity_mps": 3.0}]}
        )
        return next(line for line in scene.plan().explain().splitlines() if "aliasing" in line)

    # tips of 2 pi 71 Hz 0.12 m = 53.5 m/s and 3 m/s of the body
    assert said(20e3) == "x: aliasing: none; it shows 56.5 m/s of 152.2 m/s unambiguous"
    assert "the samples fold it" in said(4e3)


@pytest.mark.parametrize("tolerance_db", [1999.0, 4000.0, 1e300, float("inf")])
def test_any_tolerance_above_all_powers_leaves_out_the_same(tolerance_db):
    scene = Scene.load("type1")
    assert scene.plan(tolerance_db=tolerance_db).decisions == scene.plan(tolerance_db=500.0).decisions


def test_a_tolerance_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="tolerance_db is nan"):
        Scene.load("type1").plan(tolerance_db=float("nan"))


def random_reception(rng: np.random.Generator, effects: list[str], **more) -> Scene:
    """A scene with a receiver: a UAV afar or near, a bird, ground, and effects of random strength."""
    part, radar = random_uav(rng)
    part = part.model_copy(update={"range_m": log_uniform(rng, 30, 1e6), "rotors": part.rotors[:1]})
    values = {
        "phase_noise_rad": log_uniform(rng, 1e-4, 0.1),
        "adc_bits": float(rng.integers(6, 17)),
        "full_scale_db": float(rng.uniform(-3, 20)),
    }
    return Scene.build(
        {
            "radar": {"carrier_hz": min(radar.carrier_hz, 12e9), "prf_hz": radar.prf_hz, "pulses": 200},
            "uav": [part],
            "bird": [{"name": "b", "species": "starling", "members": 2}],
            "clutter": [{"name": "g", "kind": "ground", "level_db": float(rng.uniform(0, 40))}],
            "receiver": {"effects": effects, "values": values, **more},
        }
    )


def without(scene: Scene, effect: str) -> Scene:
    """The scene without an effect of its receiver."""
    receiver = {**dict(scene.receiver)}
    if effect == "jitter":
        receiver["jitter_s"] = 0.0
    elif effect == "dc":
        receiver["dc_db"] = None
    else:
        receiver["effects"] = tuple(name for name in scene.receiver.effects if name != effect)
    return Scene.build({**dict(scene), "receiver": receiver})


@pytest.mark.parametrize("effect", ["jitter", *CHAIN])
@pytest.mark.parametrize("others", [[], ["fading", "colour", "image"]], ids=["alone", "among others"])
def test_every_bound_of_a_receiver_holds_and_is_not_idle(effect, others):
    ratios = []
    # what stands before the others is swelled by all their swings: ratios that scatter
    for seed in range(120 if others and effect in ("dc", "jitter") else 40):
        rng = np.random.default_rng(seed)
        more = {
            "jitter": {"jitter_s": log_uniform(rng, 1e-9, 1e-6)},
            "dc": {"dc_db": float(rng.uniform(-20, 20))},
        }.get(effect, {})
        named = sorted({*others, effect} - {"jitter", "dc"})
        scene = random_reception(rng, named, **more)
        found = {d.effect: d.bound_db for d in scene.plan(seed).decisions if d.part == "receiver"}
        iq, bound = render(scene, seed).iq, 10 ** (found[effect] / 10)  # all else at full fidelity
        true, whole = energy(iq.astype(complex) - render(without(scene, effect), seed).iq), energy(iq)
        assert true <= bound * (1 + 1e-4) + 1e-12 * whole, (seed, true, bound)
        if true > 1e-10 * whole:
            ratios.append(bound / true)
    assert len(ratios) >= 25
    assert np.median(ratios) <= 10


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("fading", {"fading_db": -20.0}),
        ("fading", {"fading_db": 30.0}),
        ("colour", {"hump_db": -5.0}),
        ("colour", {"tilt_db": 20.0}),
        ("colour", {"tilt_db": -20.0, "hump_db": 8.0}),
    ],
)
def test_a_plan_keeps_its_bound_where_a_receiver_swells_what_was_left_out(effect, values):
    for seed in range(6):
        base = random_reception(np.random.default_rng(seed), [effect])
        receiver = {**dict(base.receiver), "values": values}
        scene = Scene.build({**dict(base), "receiver": receiver})
        plan = scene.plan(seed, tolerance_db=30.0)
        error = energy(render(scene, seed, plan=plan).iq.astype(complex) - render(scene, seed).iq)
        digits = energy(render(scene, seed).iq) * 1e-9  # complex64, and float32 phases of long blades
        assert error <= 10 ** (plan.error_db / 10) + digits, seed


@pytest.mark.parametrize("tolerance_db", [-10.0, 20.0])
def test_receivers_effects_that_a_plan_leaves_out_stay_below_its_bound(tolerance_db):
    left_out = set()
    for seed in range(6):
        rng = np.random.default_rng(seed)
        scene = random_reception(rng, ["phase_noise", "mains", "converter"], jitter_s=1e-10)
        plan = scene.plan(seed, tolerance_db=tolerance_db)
        # a converter that is kept rounds anew what changed before it: that is not counted
        seen = scene.without("converter") if "converter" in plan.receiver else scene
        error = energy(render(seen, seed, plan=plan).iq.astype(complex) - render(seen, seed).iq)
        digits = energy(render(scene, seed).iq) * 1e-9  # complex64, and float32 phases of long blades
        assert error <= 10 ** (plan.error_db / 10) + digits, seed
        assert plan.error_db <= tolerance_db + 1e-9
        left_out |= {d.effect for d in plan.decisions if d.part == "receiver" and not d.kept}
    assert "jitter" in left_out


def test_a_plan_says_in_words_and_numbers_what_a_receiver_needs():
    def said(bits: float, phase_rad: float) -> str:
        receiver = {
            "effects": ["phase_noise", "converter"],
            "values": {"adc_bits": bits, "full_scale_db": 0.0, "phase_noise_rad": phase_rad},
        }
        radar = {"carrier_hz": 9.85e9, "prf_hz": 20e3, "pulses": 500}
        uav = [{"name": "x", "body": [{"level_db": 10.0}]}]
        return Scene.build({"radar": radar, "uav": uav, "receiver": receiver}).plan().explain()

    coarse, fine = said(6.0, 0.1), said(16.0, 1e-4)
    assert "receiver: quantisation and clipping: kept; leaving it out changes at most +" in coarse
    assert "receiver: phase noise: kept; leaving it out changes at most +" in coarse
    assert "receiver: quantisation and clipping: left out (numbers as they are); leaving it out changes" in fine
    assert "receiver: phase noise: left out (a clean oscillator); leaving it out changes at most -" in fine


def test_both_renderers_draw_the_same_blades():
    for seed in range(SCENES):
        part, radar = random_uav(np.random.default_rng(seed))
        effects = frozenset(UAV_EFFECTS) - {"blade_curvature", "hub_curvature"}
        dense, closed = (
            uav_echo(part, radar, radar.times_s, Fidelity(effects, points))
            for points in (full_fidelity(part, radar).points, None)
        )
        assert energy(dense - closed) < 1e-7 * energy(dense)  # float32 against float64


def test_the_plan_counts_the_points_of_rows_and_those_that_stand_for_lines():
    rotor = {"blade_length_m": 0.15, "rotation_hz": 60.0, "flash_db": 30.0}
    near = {"name": "x", "range_m": 5.0}
    radar = {"carrier_hz": 10e9, "prf_hz": 20e3, "pulses": 500}
    for rotors, said in (
        ([{**rotor, "points": 7}], r"exact ranges, 28 sines a pulse \(full fidelity: 28\)"),
        ([{**rotor, "points": 7}, rotor], r"exact ranges, (\d+) a blade, (\d+) sines a pulse"),
    ):
        scene = Scene.model_validate({"radar": radar, "uav": [{**near, "rotors": rotors}]})
        found = re.search(said, make_plan(scene).explain())
        assert found is not None
        if found.groups():
            assert int(found[2]) == 28 + 4 * int(found[1])


@pytest.mark.parametrize("louder_db", [0.0, 25.0])
def test_without_noise_a_plan_holds_all_against_the_digits_of_the_strongest_part(louder_db):
    """Complex64 has 140 dB: what lies further under the body, 30 dB here, no rendering holds."""
    scene = Scene.load("type1")
    (part,) = scene.uav
    body, rotor = part.body[0], part.rotors[0]
    part = part.model_copy(
        update={
            "body": (body.model_copy(update={"level_db": body.level_db + louder_db}),),
            "rotors": (rotor.model_copy(update={"flash_db": rotor.flash_db + louder_db}),),
            "acceleration_mps2": 1.0,
        }
    )
    noisy = Scene.build({**dict(scene), "uav": [part]})
    silent = Scene.build({**dict(scene), "uav": [part], "off": ["noise"]})
    for one, other in zip(noisy.plan().decisions, silent.plan().decisions, strict=True):
        assert other.bound_db == pytest.approx(one.bound_db + 140 - 30 - louder_db, abs=1e-6)
    assert sum(np.isfinite(decision.bound_db) for decision in silent.plan().decisions) >= 2
    everything = silent.plan(tolerance_db=500.0)
    assert not any(decision.kept for decision in everything.decisions)
    assert "nothing is left out" not in everything.explain()
    assert "nothing is left out" in noisy.plan(tolerance_db=-500.0).explain()


def test_a_plan_says_that_what_a_converter_rounds_anew_is_not_counted():
    assert "rounds anew of a changed record is counted nowhere" in Scene.load("gulls_and_drone").plan().explain()
    assert "rounds anew" not in Scene.load("type1").plan().explain()


@pytest.mark.parametrize("beta_deg", [89.5, 90.0])
@pytest.mark.parametrize(
    ("airframe", "carrier_hz", "range_m"),
    [
        ("fixed_wing_15cm", 9.85e9, 300.0),
        ("quadcopter_12cm", 9.85e9, 300.0),
        ("hexacopter_30cm", 9.85e9, 30.0),
        ("helicopter_41cm", 24e9, 100.0),
    ],
)
def test_the_bound_holds_of_blades_seen_along_their_axis(airframe, carrier_hz, range_m, beta_deg):
    """All that is left of their phase is the sphere's sag, which bends: as a straight one it was told 36 dB too low."""
    uav = {"name": "d", "range_m": range_m, "beta_deg": beta_deg, "airframe": airframe}
    scene = Scene.build({"radar": {"carrier_hz": carrier_hz, "prf_hz": 25e3, "pulses": 2000}, "uav": [uav]})
    error = scene.render(1).iq.astype(complex) - scene.render(1, full=True).iq
    worst_db = 10 * np.log10(np.abs(np.fft.fft(error)).max() ** 2 / len(error))
    assert worst_db < scene.plan(1).error_db <= -10


@pytest.mark.parametrize("carrier_hz", [60e9, 94e9])
@pytest.mark.parametrize("airframe", ["helicopter_41cm", "hexacopter_30cm"])
def test_enough_scatterers_are_found_where_a_blade_is_hundreds_of_waves_long(carrier_hz, airframe):
    """The search ended before the bound falls, which it then told: an error of +80 dB, where there was none."""
    radar = {"carrier_hz": carrier_hz, "prf_hz": 100e3, "pulses": 64}
    for range_m in (5.0, 1000.0):
        scene = Scene.build({"radar": radar, "uav": [{"name": "u", "airframe": airframe, "range_m": range_m}]})
        assert scene.plan().error_db < -10.0
