"""What must hold between the numbers of every table, whatever they are."""

import numpy as np
import pytest
from bladewing.simulate import KINDS, Radar
from bladewing.simulate.bird import MAX_WINGBEAT_HZ, wing_size, wingbeat_hz
from bladewing.simulate.bounds_receiver import CHAIN
from bladewing.simulate.catalogue import AIRFRAMES, BIRDS
from bladewing.simulate.clutter import billingsley, process_velocities, slow_velocities
from bladewing.simulate.dataset import PURPOSES, TRUTH_UNITS
from bladewing.simulate.discretes import DISCRETES, LIMBS
from bladewing.simulate.fidelity import BIRD_EFFECTS, UAV_EFFECTS
from bladewing.simulate.laws import LAWS
from bladewing.simulate.plan import WORDS
from bladewing.simulate.receiver import FAULT_CHANCE
from bladewing.simulate.scene import Scene
from bladewing.simulate.uav import ROTORS

RADAR = {"carrier_hz": 9.85e9, "prf_hz": 35e3, "pulses": 3000}
WAVELENGTH_M = 299_792_458 / 9.85e9

#: A law's name ends in its unit, where it has one.
SUFFIXES = {
    "_hz": "Hz", "_db": "dB", "_m": "m", "_s": "s", "_mps": "m/s", "_mps2": "m/s^2", "_rad": "rad", "_kg": "kg",
    "_mph": "mph", "_per_s": "1/s", "_bits": "bit",
}  # fmt: skip

#: The paper's tables II and III: band and chopping frequency [Hz] by eqs. 26 and 25.
PAPER = {
    "type1": (7220.4, 116.67), "type2": (14441.0, 116.67), "type3": (14441.0, 233.33),
    "type4": (7220.4, 116.67), "type5": (7220.4, 116.67), "type6": (3610.2, 116.67),
}  # fmt: skip


def uav(name: str):
    return Scene.build({"radar": RADAR, "uav": [{"name": "x", "airframe": name}]}).uav[0]


@pytest.mark.parametrize("name", list(AIRFRAMES))
def test_airframes_are_small_subsonic_and_symmetric(name):
    built = uav(name)
    assert built.reach_m < 1.5
    for rotor in built.rotors:
        assert 0.05 < rotor.blade_length_m < 0.5
        assert 20 < 2 * np.pi * abs(rotor.rotation_hz) * rotor.blade_length_m < 0.6 * 340
        assert rotor.offset_m == 0 or rotor.offset_m > rotor.blade_length_m * 0.9  # neighbours do not touch
    if len(built.rotors) > 2:
        senses = [np.sign(r.rotation_hz) for r in built.rotors]
        assert sum(senses) == 0  # no net torque
        bearings = np.sort([r.bearing_deg for r in built.rotors])
        np.testing.assert_allclose(np.diff(bearings), 360 / len(bearings))


@pytest.mark.parametrize("name", list(PAPER))
def test_the_papers_types_have_the_band_and_the_chopping_frequency_of_its_tables(name):
    band_hz, chopping_hz = PAPER[name]
    built = uav(name)
    fastest = max(built.rotors, key=lambda r: abs(r.rotation_hz))
    tip = 2 * np.pi * abs(fastest.rotation_hz) * fastest.blade_length_m * np.cos(np.deg2rad(built.beta_deg))
    assert 4 * tip / WAVELENGTH_M == pytest.approx(band_hz, rel=1e-3)
    assert fastest.blades * abs(fastest.rotation_hz) == pytest.approx(chopping_hz, rel=1e-3)


def test_the_helicopters_tail_is_geared():
    main, tail = uav("helicopter_41cm").rotors
    assert abs(tail.rotation_hz / main.rotation_hz) == pytest.approx(4.73)
    assert LAWS["gear_ratio"].low < 4.73 < LAWS["gear_ratio"].high
    assert 0 < tail.blade_length_m < LAWS["tail_ratio"].high * main.blade_length_m


def test_heavier_birds_are_larger_and_beat_more_slowly():
    named = [entry.fields for name, entry in BIRDS.items() if name != "paper_bird"]
    for bird in named:
        beat = wingbeat_hz(bird["mass_kg"], bird["span_m"], bird["area_m2"])
        assert 1 < beat < MAX_WINGBEAT_HZ == 18
        aspect = bird["span_m"] ** 2 / bird["area_m2"]
        assert 3.5 < aspect < 12  # of any bird
        # the general law of size that training draws by, within what species differ
        assert wing_size(bird["mass_kg"])[0] == pytest.approx(bird["span_m"], rel=0.5)
        assert wing_size(bird["mass_kg"])[1] == pytest.approx(bird["area_m2"], rel=0.7)
    mass = np.geomspace(LAWS["bird_mass_kg"].low, LAWS["bird_mass_kg"].high, 50)
    span, area = wing_size(mass)
    assert (np.diff(span) > 0).all()
    assert (np.diff(area) > 0).all()
    assert (np.diff(wingbeat_hz(mass, span, area)) < 0).all()
    lightest, heaviest = (f(b["mass_kg"] for b in named) for f in (min, max))
    assert lightest > 0.005
    assert heaviest <= LAWS["bird_mass_kg"].high


def test_the_papers_bird_sweeps_what_the_paper_measured():
    bird = BIRDS["paper_bird"].fields
    speeds = bird["velocity_mps"], bird["velocity_mps"] + 2.5 * bird["acceleration_mps2"]
    np.testing.assert_allclose(-2 * np.array(speeds) / WAVELENGTH_M, [-340, 316], rtol=1e-6)
    assert abs(bird["acceleration_mps2"]) < LAWS["bird_acceleration_mps2"].high


@pytest.mark.parametrize("name", list(LAWS))
def test_a_laws_unit_is_that_of_its_name(name):
    law = LAWS[name]
    ends = [unit for suffix, unit in SUFFIXES.items() if name.endswith(suffix)]
    assert not ends or law.unit in ends
    assert law.low < law.high
    assert law.kind in ("uniform", "log", "rising")
    assert law.kind != "log" or law.low > 0
    assert law.unit
    assert law.source
    if law.unit == "m/s":
        assert max(abs(law.low), abs(law.high)) < 340  # nothing here is faster than sound, and no radar needs more
    if law.unit == "rad" and "beta" in name:
        assert 0 <= law.low < law.high < np.pi / 2


def test_no_law_passes_another():
    assert LAWS["dwell_s"].low == pytest.approx(5e-3)
    assert LAWS["dwell_s"].high == LAWS["long_dwell_s"].low  # every dwell from 5 ms to 5 s, none twice
    assert LAWS["long_dwell_s"].high == pytest.approx(5.0)
    assert LAWS["hover_spread"].high <= LAWS["manoeuvre_spread"].low
    assert LAWS["tip_mps"].high * (1 + LAWS["manoeuvre_spread"].high / 2) < 0.65 * 340
    assert LAWS["main_length_m"].high > LAWS["blade_length_m"].high
    assert LAWS["turbine_length_m"].low > 10 * LAWS["main_length_m"].high
    assert LAWS["cell_m"].low < LAWS["turbine_length_m"].low
    assert LAWS["rain_width_mps"].high < LAWS["rain_velocity_mps"].high
    assert LAWS["sea_width_mps"].high < LAWS["sea_velocity_mps"].high
    assert LAWS["texture_hz"].high < 1 / 0.1  # slower than speckle
    assert LAWS["full_scale_db"].low < 0 < LAWS["full_scale_db"].high  # some clip
    assert LAWS["unambiguous_mps"].high > LAWS["tip_mps"].high + LAWS["uav_mps"].high
    assert LAWS["insect_wingbeat_hz"].low > MAX_WINGBEAT_HZ  # no bird beats as fast as an insect
    assert LAWS["insect_depth"].high < 1
    for law in ("phase_rad", "edge_asymmetry", "climb_mps", "mover_mps", "person_mps", "insect_velocity_mps"):
        assert LAWS[law].low == -LAWS[law].high, law  # no direction is special


def test_billingsleys_ground_rests_more_in_less_wind_and_at_lower_carriers():
    wind = np.geomspace(LAWS["wind_mph"].low, LAWS["wind_mph"].high, 30)
    for carrier in (2e9, 9.85e9, 100e9):
        a, b = billingsley(wind, carrier)
        assert (np.diff(a) < 0).all()
        assert (np.diff(b) < 0).all()
        assert ((b > 4) & (b < 20)).all()  # skirts of a few 0.1 m/s at any carrier
        assert (billingsley(wind, 2 * carrier)[0] < a).all()
        np.testing.assert_array_equal(billingsley(wind, 2 * carrier)[1], b)


@pytest.mark.parametrize("prf_hz", [100.0, 1e3, 25e3, 1e5])
def test_the_ground_keeps_all_lines_that_hold_its_power(prf_hz):
    radar = Radar(9.85e9, prf_hz, 700)
    whole, slow = process_velocities(radar), slow_velocities(radar, 35.0)
    assert set(slow) <= set(whole)
    left = np.setdiff1d(whole, slow)
    shape = billingsley(35.0, 9.85e9)[1]
    assert np.exp(-shape * abs(left)).sum() <= 1e-11 * np.exp(-shape * abs(whole)).sum()


def test_limbs_come_in_pairs_that_swing_against_each_other_about_the_torso():
    torso, *limbs = LIMBS
    assert torso[0] == max(amplitude for amplitude, *_ in LIMBS)
    assert torso[1] < min(swing for _, swing, *_ in limbs)
    for one, other in zip(limbs[::2], limbs[1::2], strict=True):
        assert one[:3] == other[:3]
        assert abs(one[3] - other[3]) == pytest.approx(0.5)
    # the feet: 1 + 2 = three times the torso's speed, the fastest that a walker shows but for the stride
    assert 1 + max(swing for _, swing, *_ in LIMBS) == pytest.approx(3)


def test_kinds_chances_and_words_are_complete():
    assert set(KINDS) == {"uav", "bird", "clutter"}
    for kinds in KINDS.values():
        assert sum(kinds.values()) == pytest.approx(1)
        assert min(kinds.values()) > 0.05  # rare kinds are not learnt
    assert set(KINDS["uav"]) == set(ROTORS)
    assert set(DISCRETES) < set(KINDS["clutter"])
    assert len(set(PURPOSES.values())) == len(PURPOSES)
    assert all(0 < chance <= 0.5 for chance in FAULT_CHANCE.values())
    assert set(CHAIN) == {*FAULT_CHANCE, "dc"}
    assert set(WORDS) == {*UAV_EFFECTS, *BIRD_EFFECTS, *CHAIN, "jitter"}
    for name, unit in TRUTH_UNITS.items():
        assert [u for suffix, u in SUFFIXES.items() if name.endswith(suffix)][:1] in ([], [unit]), name
