"""Physics of whole records: what the radar sees of a target is where the target's truth says."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from bladewing.simulate import Radar, discretes, rotors_echo, uav
from bladewing.simulate.airframe import Rotor
from bladewing.simulate.bird import draw_bird
from bladewing.simulate.discretes import (
    CRANK_M,
    LIMBS,
    MAX_BLADE_POINTS,
    MAX_BODY_POINTS,
    _even_row,
    _passing,
    _vehicle_body,
    _wheels,
    draw_discrete,
)
from bladewing.simulate.laws import LAWS, STEADY, WIDTH, Draws
from bladewing.simulate.rotor import RotorMotion
from bladewing.simulate.uav import POINTS, ROTORS, ROUGH_POINTS, TIP_OVER_BODY, _rough, draw_uav

RADAR = Radar(9.85e9, 40e3, 4000)


def draws(records: int, seed: int) -> Draws:
    return Draws(np.random.default_rng(seed).random((records, WIDTH)))


def spectrum(iq, radar=RADAR):
    power = abs(np.fft.fft(iq * np.kaiser(iq.shape[-1], 12.5), axis=-1)) ** 2
    return power, -np.fft.fftfreq(iq.shape[-1], 1 / radar.prf_hz) * radar.wavelength_m / 2


def mean_and_width(power, velocity):
    mean = (power * velocity).sum(axis=1) / power.sum(axis=1)
    return mean, np.sqrt((power * (velocity - mean[:, None]) ** 2).sum(axis=1) / power.sum(axis=1))


def fix(monkeypatch, **values):
    """Let laws draw one value each."""
    for name, value in values.items():
        monkeypatch.setitem(LAWS, name, replace(LAWS[name], low=value, high=value))


@pytest.mark.parametrize("kind", list(ROTORS))
def test_the_body_line_is_at_the_body_velocity(kind):
    target = draw_uav(draws(20, 1), RADAR, kind)
    power, velocity = spectrum(target.body)
    drift = target.truth["velocity_mps"] + target.truth["acceleration_mps2"] * RADAR.dwell_s / 2
    np.testing.assert_allclose(velocity[power.argmax(axis=1)], drift, atol=0.6)


@pytest.mark.parametrize("kind", ["fixed_wing", "quadcopter", "hexacopter"])
def test_no_blade_is_faster_than_its_tip(kind):
    target = draw_uav(draws(30, 2), RADAR, kind)
    power, velocity = spectrum(target.micro)
    # wander and drift move a rate by at most some per cent; acceleration smears the body; the lines of a point on a
    # circle, Bessel functions, end within some cube roots of their highest order
    tip = target.truth["tip_mps"] * np.cos(target.truth["beta_rad"])
    line = target.truth["rotation_hz"] * RADAR.wavelength_m / 2
    limit = 1.12 * tip + 3 + 2 * line * np.cbrt(tip / line)
    away = abs(velocity[None, :] - target.truth["velocity_mps"][:, None])
    folded = np.minimum(away, 2 * RADAR.unambiguous_mps - away)
    outside = np.where(folded > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3


@pytest.mark.parametrize("kind", list(ROTORS))
def test_no_aircraft_flies_at_half_the_speed_of_its_tips(kind):
    truth = draw_uav(draws(2000, 9), Radar(9.85e9, 40e3, 8), kind).truth
    flown = abs(truth["velocity_mps"]) - LAWS["climb_mps"].high  # at least
    ratio = truth["tip_mps"] / np.maximum(flown, 1e-9)
    assert ratio.min() > 0.9 * TIP_OVER_BODY  # rotors' rates differ by up to 18 %
    assert ratio.min() < 1.6 * TIP_OVER_BODY


def test_the_limbs_on_foot_stay_below_five_times_the_torso(monkeypatch):
    fix(monkeypatch, pedalling=0.0)
    target = draw_discrete(draws(40, 3), RADAR, "person")
    power, velocity = spectrum(target.micro)
    limit = 4.8 * abs(target.truth["velocity_mps"]) + 0.8  # 1 + 2.4 (1 + 1.3 x 0.45); resolution at 0.1 s
    outside = np.where(abs(velocity)[None, :] > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3


def speed_of_a_foot(monkeypatch, count, prf_hz, **values):
    """Of so many persons over a turn of 2001 pulses, shape (count, pulses - 1) [m/s]."""
    monkeypatch.setattr(discretes, "LIMBS", (LIMBS[0], LIMBS[-1]))
    fix(monkeypatch, **values)
    radar = Radar(9.85e9, prf_hz, 2001)
    foot = draw_discrete(draws(count, 4), radar, "person").micro.astype(complex)
    return -np.angle(foot[:, 1:] * foot[:, :-1].conj()) * radar.prf_hz * radar.wavelength_m / (4 * np.pi)


def test_a_foot_goes_as_far_as_the_torso_in_strides(monkeypatch):
    speed = speed_of_a_foot(monkeypatch, 240, 2e3, person_mps=1.3, pace=1.0, pedalling=0.0, gait_hz=1.0)
    np.testing.assert_allclose(speed.mean(axis=1), 1.3, rtol=1e-3)
    forward, back = speed.max(axis=1) - 1.3, 1.3 - speed.min(axis=1)
    assert forward.max() / 1.3 < 2.4 * (1 + 1.3 * 0.45) + 0.01
    assert np.all(forward > 0.999 * back), "strides are quicker than what lies between them"
    assert np.mean(forward > 1.6 * back) > 0.3
    assert np.mean(forward < 1.2 * back) > 0.1, "some walkers swing their feet evenly"


def test_a_cyclists_feet_go_round_with_the_pedals_however_fast_the_wheels(monkeypatch):
    speed = speed_of_a_foot(monkeypatch, 60, 3e3, person_mps=3.0, pace=2.0, pedalling=1.0, gait_hz=1.5)
    np.testing.assert_allclose(speed.mean(axis=1), 6.0, rtol=1e-3)
    forward, back = speed.max(axis=1) - 6.0, 6.0 - speed.min(axis=1)
    np.testing.assert_allclose(forward, back, rtol=0.01)
    pedal_mps = 2 * np.pi * 1.5 * CRANK_M
    assert 0.6 * pedal_mps < forward.min() < forward.max() < 1.2 * pedal_mps


def test_some_persons_run_and_some_ride():
    radar = Radar(9.85e9, 2e3, 2001)
    target = draw_discrete(draws(200, 5), radar, "person")
    speed = np.abs(target.truth["velocity_mps"])
    assert 0.2 < np.mean(speed > 3.5) < 0.5
    assert 6.5 < speed.max() < 8.75
    # the limbs of who runs fast swing as fast; of who rides no faster than pedals turn
    power, velocity = spectrum(target.micro, radar)
    away = np.abs(velocity[None, :] - target.truth["velocity_mps"][:, None]) > 3.2
    fast = (speed > 3.5) & (speed < 6)
    swings = np.where(away, power, 0).sum(axis=1)[fast] / power.sum(axis=1)[fast]
    assert 0.1 < np.mean(swings < 0.01) < 0.5


def test_rough_blades_repeat_once_a_turn_and_lie_between_root_and_tip():
    count, length, root = 40, 0.3, 0.05
    rest = {"blade_length_m": np.full(count, length), "root_m": np.full(count, root)}
    rotor = Rotor(RotorMotion(rotation_hz=np.full(count, 50.0)), **rest, blade_amplitudes=np.ones((count, 2)))
    parts = _rough(draws(count, 7), rotor)
    assert len(parts) == ROUGH_POINTS
    reach = np.array([part.blade_length_m for part in parts])
    assert root <= reach.min() < 0.1
    assert 0.25 < reach.max() <= length
    radar = Radar(9.85e9, 20e3, 801)  # 400 pulses a turn
    echo = rotors_echo(radar, [replace(part, points=1) for part in parts], count)
    scale = abs(echo).mean(axis=1)
    assert (abs(echo[:, 400:800] - echo[:, :400]).mean(axis=1) / scale).max() < 1e-3
    assert (abs(echo[:, 200:600] - echo[:, :400]).mean(axis=1) / scale).min() > 0.3, "two equal blades: half a turn"


def test_wheels_run_from_rest_to_twice_the_vehicle():
    target = draw_discrete(draws(40, 4), RADAR, "vehicle")
    power, velocity = spectrum(target.micro)
    speed, acceleration = target.truth["velocity_mps"], target.truth["acceleration_mps2"]
    line_mps = target.truth["rotation_hz"] * RADAR.wavelength_m / 2
    # lines of order n beyond the rim's phase deviation fall off over its cube root
    margin = abs(acceleration) * RADAR.dwell_s + 0.8 + 2 * line_mps * np.cbrt(abs(speed) / line_mps)
    along = velocity[None, :] * np.sign(speed)[:, None]
    inside = (along > -margin[:, None]) & (along < (2 * abs(speed) + margin)[:, None])
    assert (np.where(inside, power, 0).sum(axis=1) / power.sum(axis=1)).min() > 0.999


def test_a_point_passes_at_the_distance_that_pythagoras_gives():
    times_s = RADAR.times_s - RADAR.dwell_s / 2
    for ahead, aside, speed in ((-30.0, 3.0, 25.0), (0.0, 1.5, -40.0), (900.0, 400.0, 10.0)):
        gone = speed * times_s[None, :]
        turned = np.unwrap(np.angle(_passing(RADAR, np.array([ahead]), np.array([aside]), gone)[0].astype(complex)))
        exact = np.array([np.hypot(np.longdouble(ahead) + g, np.longdouble(aside)) for g in gone[0]])
        measured = -turned * RADAR.wavelength_m / (4 * np.pi)
        np.testing.assert_allclose(measured - measured[0], (exact - exact[0]).astype(float), atol=1e-8)


def test_far_vehicles_are_a_line_and_near_ones_fill_the_speeds_up_to_their_own():
    target = draw_discrete(draws(400, 8), RADAR, "vehicle")
    truth = target.truth
    power, velocity = spectrum(target.body)
    mean, width = mean_and_width(power, velocity)
    steady = abs(truth["acceleration_mps2"]) < 0.5
    assert 0.12 < steady.mean() < 0.7  # a bend is no sign of a vehicle
    strongest = velocity[power.argmax(axis=1)]
    assert np.mean(abs(strongest - truth["velocity_mps"])[steady] < 1) > 0.95
    assert np.median(width[steady]) < 0.4
    bent = abs(truth["acceleration_mps2"]) > 8
    assert bent.sum() > 30
    assert np.median(width[bent]) > 0.8
    assert max(abs(mean)) < 44


def test_two_thirds_of_the_roads_pass_within_twelve_metres():
    count = 3000
    _, (_, _, _, aside, _, _) = _vehicle_body(draws(count, 3), Radar(9.85e9, 40e3, 64), 2)
    near = 0.5 + 0.5 * np.log(12 / 1.5) / np.log(3000 / 1.5)  # on the verge, and of those anywhere
    assert np.mean(aside < 12) == pytest.approx(near, abs=4 * np.sqrt(near * (1 - near) / count))


def _beside_the_road(monkeypatch, points, beam_rad):
    """Power over speed of cars that pass 6 m off at 20 m/s, seen 0.2 rad off the square of the road at 24 GHz."""
    fix(monkeypatch, body_points=points, beam_rad=beam_rad, vehicle_mps=20.0, vehicle_length_m=4.5)
    fix(monkeypatch, road_m=6.0, verge_m=6.0, sight_rad=0.2, road_acceleration_mps2=0.0)
    radar = Radar(24e9, 16e3, 800)
    body, _ = _vehicle_body(draws(200, 5), radar, MAX_BODY_POINTS)
    return spectrum(body, radar)


def test_many_scatterers_fill_the_speeds_between_which_few_leave_gaps(monkeypatch):
    within = []
    for points in (4.0, 48.0):
        power, velocity = _beside_the_road(monkeypatch, points, 4.0)
        band = (velocity > 0) & (velocity < 8)  # the car's ends are seen at -3.5 and 11 m/s
        share = power[:, band]
        within.append(np.mean(share > 0.1 * share.mean(axis=1, keepdims=True)))
    assert within[1] > 0.7 > 1.3 * within[0]


def test_a_narrow_beam_sees_a_part_of_a_car_at_once(monkeypatch):
    wide, narrow = (_beside_the_road(monkeypatch, 48.0, beam) for beam in (4.0, 0.2))
    widths = [np.median(mean_and_width(*seen)[1]) for seen in (wide, narrow)]
    assert widths[1] < 0.7 * widths[0]


def test_an_engine_shakes_the_whole_vehicle_by_its_displacement(monkeypatch):
    radar, shaken_m, engine_hz = Radar(24e9, 4e3, 4000), 2e-4, 40.0

    def bodies(**fixed):
        fix(monkeypatch, company_db=-300.0, engine_hz=engine_hz, **fixed)
        return draw_discrete(draws(20, 12), radar, "vehicle").body

    turned = np.angle(bodies(engine_m=shaken_m) / bodies(engine_m=1e-15))  # a law of logarithms has no 0
    lines = np.fft.fft(turned, axis=-1) * 2 / radar.pulses  # 1 Hz a bin
    swing_rad = 4 * np.pi / radar.wavelength_m * shaken_m
    np.testing.assert_allclose(abs(lines[:, round(engine_hz)]), swing_rad, rtol=1e-3)
    np.testing.assert_allclose(np.mean(turned**2, axis=-1), swing_rad**2 / 2, rtol=1e-2)


def test_wheels_abreast_of_the_radar_do_not_move_and_roll_as_far_as_the_vehicle():
    gone = 20.0 * (RADAR.times_s - RADAR.dwell_s / 2)[None, :] * np.ones((30, 1))
    abreast, _ = _wheels(draws(30, 9), RADAR, gone, np.zeros_like(gone))
    np.testing.assert_allclose(abreast, abreast[:, :1] * np.ones(RADAR.pulses), atol=1e-6)
    ahead, radius = _wheels(draws(30, 9), RADAR, gone, np.ones_like(gone))
    # a whole turn further on the wheels stand as they stood
    pulses_a_turn = 2 * np.pi * radius / 20.0 * RADAR.prf_hz
    for row, step in zip(ahead, pulses_a_turn, strict=True):
        whole = round(step)
        if whole < RADAR.pulses:
            slip_rad = abs(whole - step) / RADAR.prf_hz * 20.0 * 4 * np.pi / RADAR.wavelength_m
            assert abs(row[whole:] - row[:-whole]).max() <= slip_rad * abs(row).max() * 3 + 1e-3


def test_a_vehicles_snr_is_its_bodys_or_its_wheels_at_even_chances():
    count = 2000
    target = draw_discrete(draws(count, 5), Radar(9.85e9, 40e3, 64), "vehicle")
    of_body = target.snr_of_body
    assert np.mean(of_body) == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / count))
    u = np.random.default_rng(1).random(count)
    wheels_db = target.snr_db(u)
    np.testing.assert_allclose((wheels_db + target.body_db)[of_body], LAWS["clutter_snr_db"](u)[of_body])
    np.testing.assert_allclose(wheels_db[~of_body], LAWS["snr_db"](u)[~of_body])
    assert 0.35 < np.mean(wheels_db[of_body] < 0) < 0.8  # of many vehicles met so no wheel is seen


def test_steady_and_manoeuvring_bodies_are_as_frequent_in_every_class():
    for kind, draw in (("quadcopter", draw_uav), ("flapping_bird", draw_bird), ("mover", draw_discrete)):
        acceleration = abs(draw(draws(600, 6), RADAR, kind).truth["acceleration_mps2"])
        most = acceleration.max()
        # a steady one has at most a twentieth, and so has one in twenty of the others
        assert np.mean(acceleration <= STEADY * most) == pytest.approx(0.525, abs=4 * np.sqrt(0.25 / 600))


def test_even_spokes_show_only_lines_of_their_own_rate():
    radar = Radar(3e9, 4e3, 4000)
    uniforms = np.random.default_rng(7).random((2000, WIDTH))
    truth = draw_discrete(Draws(uniforms), replace(radar, pulses=64), "vehicle").truth
    turn, speed = truth["rotation_hz"], abs(truth["velocity_mps"])
    unfolded = 2 * speed < 0.9 * radar.unambiguous_mps
    steady = abs(truth["acceleration_mps2"]) < 0.2
    chosen = np.flatnonzero((turn > 12) & steady & unfolded & (speed > 8))
    target = draw_discrete(Draws(uniforms[chosen]), radar, "vehicle")
    np.testing.assert_array_equal(target.truth["rotation_hz"], turn[chosen])
    power = abs(np.fft.fft(target.micro * np.kaiser(radar.pulses, 12.5), axis=-1)) ** 2
    frequency_hz = np.fft.fftfreq(radar.pulses, 1 / radar.prf_hz)
    shares = []
    for own, velocity_mps, turn_hz in zip(power, target.truth["velocity_mps"], turn[chosen], strict=True):
        turns = (frequency_hz + 2 * velocity_mps / radar.wavelength_m) / turn_hz
        combs = [abs(turns - n * np.rint(turns / n)) * turn_hz < 7 for n in range(2, 11)]
        shares.append(max(own[comb].sum() for comb in combs) / own.sum())
    assert len(chosen) > 20, "too few to tell"
    # a third of those that have two spokes or more, of which half echo alike
    assert 0.05 < np.mean(np.array(shares) > 0.98) < 0.4


def test_a_point_of_a_wheel_goes_round_to_the_digits_of_float32(monkeypatch):
    radar = Radar(94e9, 100e3, 4000)
    gone = 40.0 * (radar.times_s - radar.dwell_s / 2)[None, :] * np.ones((40, 1))
    fix(monkeypatch, spokes=1.0, tyre_points=1.0, wheels=1.0, wheel_radius_m=0.3)
    wheels, radius = _wheels(draws(40, 6), radar, gone, np.ones_like(gone))
    alone = np.ptp(abs(wheels), axis=1) < 1e-5 * abs(wheels).max()  # spokes and tyre together are two points
    assert 15 < alone.sum() < 35
    turn = gone[0] / radius[0]
    basis = np.stack([np.sin(turn), np.cos(turn), np.ones_like(turn)], axis=1)
    for row in wheels[alone]:
        phase = np.unwrap(np.angle(row.astype(complex)))
        fitted, *_ = np.linalg.lstsq(basis, phase, rcond=None)
        assert np.hypot(*fitted[:2]) <= 4 * np.pi / radar.wavelength_m * 0.3
        assert abs(phase - basis @ fitted).max() < 1e-3  # of up to 1200 rad


def test_the_many_blocks_of_a_tyre_fill_its_speeds_at_every_moment(monkeypatch):
    """As measured beside a road; of few points each shows one speed at a time."""
    radar = Radar(24e9, 16e3, 320)  # 20 ms: an eighth of a turn
    gone = 12.0 * (radar.times_s - radar.dwell_s / 2)[None, :] * np.ones((200, 1))
    filled = []
    for points in (1.0, 60.0):
        fix(monkeypatch, spokes=1.0, tyre_points=points, wheels=4.0, wheel_radius_m=0.3)
        wheels, _ = _wheels(draws(200, 5), radar, gone, np.ones_like(gone))
        power, velocity = spectrum(wheels, radar)
        band = power[:, abs(velocity) < 10]  # about the vehicle, which moves at 12 m/s
        filled.append(np.mean(band > 0.1 * band.mean(axis=1, keepdims=True), axis=1) > 0.75)
    assert np.mean(filled[1]) == pytest.approx(2 / 3, abs=4 * np.sqrt(0.25 / 200)), "all but those of spokes alone"
    assert np.mean(filled[0]) < 0.1


def test_turbine_blades_stay_below_their_tip_and_the_tower_rests():
    target = draw_discrete(draws(40, 5), RADAR, "wind_turbine")
    power, velocity = spectrum(target.micro)
    limit = target.truth["tip_mps"] * np.cos(target.truth["beta_rad"]) + 0.8
    outside = np.where(abs(velocity)[None, :] > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3
    np.testing.assert_array_equal(target.body, target.body[:, :1] * np.ones(RADAR.pulses, np.complex64))


def test_two_fifths_of_turbines_are_rows_of_equal_points_at_equal_distances():
    # an even row takes none of what is drawn for the points of a blade: place, place on the chord, strength, phase
    even, first = 10, 12
    uniforms = np.random.default_rng(4).random((10, WIDTH))
    uniforms[:, even] = np.linspace(0, 0.99, 10)
    others = uniforms.copy()
    points = slice(first, first + 3 * 4 * MAX_BLADE_POINTS)
    others[:, points] = np.random.default_rng(5).random(others[:, points].shape)
    echoes = [draw_discrete(Draws(u.copy()), RADAR, "wind_turbine").micro for u in (uniforms, others)]
    same = [np.array_equal(one, other) for one, other in zip(*echoes, strict=True)]
    assert same == (uniforms[:, even] < 0.4).tolist()


@pytest.mark.parametrize("points", [3, 4, 31, 3000])
def test_a_row_of_points_is_the_mean_of_their_echoes(points):
    # 60 m, seen from end to end at 3 mm: the phase between the ends is 2.5e5 rad
    wavelength_m, towards = 0.003, np.cos(np.linspace(0.2, np.pi, 200))
    along = np.linspace(5.0, 60.0, points)
    phase_rad = 4 * np.pi / wavelength_m * along[:, None] * towards  # nearer by so much
    row = _even_row(5.0 * towards, 60.0 * towards, np.array(float(points)), wavelength_m)
    np.testing.assert_allclose(row, np.exp(1j * phase_rad).mean(axis=0), rtol=0, atol=3e-6)


def test_blades_reflect_as_lines_tips_or_rows_as_often_as_the_table_says(monkeypatch):
    found: Counter[int | None] = Counter()

    def counting(radar, rotors, records, **path):
        (points,) = {rotor.points for rotor in rotors}
        found[points] += records
        return rotors_echo(radar, rotors, records, **path)

    monkeypatch.setattr(uav, "rotors_echo", counting)
    count = 3000
    draw_uav(draws(count, 6), Radar(9.85e9, 25e3, 8), "helicopter")
    for points, share in POINTS.items():
        assert abs(found[points] / count - share) < 4 * np.sqrt(share * (1 - share) / count), points
    assert found.total() == count
