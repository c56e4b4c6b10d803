import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor import helicopter as module
from bladewing.simulate import RotorMotion, Scene, rotor_echo
from bladewing.simulate.catalogue import AIRFRAMES

from ..signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, rotors, white

MAIN_HZ, GEAR = 41.3, 4.73
NAMES = ("main_chopping_hz", "tail_chopping_hz", "gear_ratio")


def helicopter(
    main_hz=MAIN_HZ,
    gear=GEAR,
    *,
    snr_db=5.0,
    tail_db=-8.0,
    velocity_mps=6.0,
    seed=0,
    body=10.0,
    tail_blades=(1.0, 1.0),
):
    main = rotors([main_hz], length_m=0.4, velocity_mps=velocity_mps, body=body)
    tail = rotors([main_hz * gear], length_m=0.08, velocity_mps=velocity_mps, body=0.0, amplitudes=tail_blades)
    noise = white(np.random.default_rng(seed), PULSES)
    return (main + 10 ** (tail_db / 20) * tail) * 10 ** (snr_db / 20) + noise


def values(found) -> list[float]:
    return [float(getattr(found, name)) for name in NAMES]


@pytest.mark.parametrize("tail_db", [-8.0, 3.0])
def test_both_combs_and_the_gear_are_within_their_error_bars(tail_db):
    found = measure(helicopter(tail_db=tail_db), **RADAR)
    truth = (2 * MAIN_HZ, 2 * GEAR * MAIN_HZ, GEAR)
    for name, value, true in zip(NAMES, values(found), truth, strict=True):
        std = float(getattr(found, f"{name}_std"))
        assert abs(value - true) < 4.5 * std, name
        assert 0 < std < 1e-3 * true
    assert found.gear_reason == ""


@pytest.mark.parametrize("gear", [2.87, 3.1, 3.87, 5.14])
def test_a_tail_is_no_further_rotor_at_a_fraction_of_its_rate(gear):
    """At a third or a fifth, which lies among the rates of one airframe's rotors, every so many-th line is there."""
    for seed in range(3):
        iq = helicopter(33.0, gear, snr_db=20.0, seed=seed, body=30.0)
        found = measure(iq, **RADAR)
        np.testing.assert_allclose(values(found), (66, 66 * gear, gear), rtol=1e-3)
        assert found.chopping_hz == found.main_chopping_hz


@pytest.mark.parametrize("seed", [7, 29, 36, 38])
def test_two_drones_in_one_cell_are_no_helicopter(seed):
    """Of the lines of either some repeat at a gear ratio about the other's body; about its own all do."""
    rng = np.random.default_rng(seed)
    one = rotors((rng.uniform(40, 60),), velocity_mps=rng.uniform(-15, 15), body=5.0)
    other = rotors((rng.uniform(80, 150),), velocity_mps=rng.uniform(-15, 15), body=5.0, length_m=0.1)
    found = measure((one + other) * 10 ** (15 / 20) + white(rng, PULSES), **RADAR)
    assert np.isnan(found.gear_ratio)
    assert "another body" in str(found.gear_reason)


@pytest.mark.parametrize(("left_db", "gear"), [(-3.0, GEAR), (4.0, np.nan)])
def test_two_combs_that_leave_more_than_their_lines_are_no_helicopter(left_db, gear):
    """Six rotors of unlike rates were one: of what one comb leaves of them some lines repeat at any gear ratio."""
    rng = np.random.default_rng(2)
    inside = np.abs(np.fft.fftfreq(PULSES, 1 / PRF_HZ)) < 6000
    left = np.fft.ifft(np.fft.fft(white(rng, PULSES)) * inside)
    left *= 10 ** ((10 + left_db) / 20) / np.sqrt(np.mean(np.abs(left) ** 2))
    found = measure(helicopter(snr_db=10.0, tail_db=-3.0) + left, **RADAR)
    np.testing.assert_allclose(found.gear_ratio, gear, rtol=2e-3)
    assert found.rotors_resolved == np.isfinite(gear)


def test_the_body_is_in_the_middle_of_its_rotors_lines_though_one_of_them_is_stronger():
    """Blades seen at a long wavelength: the outermost lines are the strongest."""
    fields = AIRFRAMES["helicopter_41cm"].fields
    radar = {"carrier_hz": 3.3e9, "prf_hz": 9000.0}
    rotors = [rotor | {"beta_deg": 15.0} for rotor in fields["rotors"]]
    for seed, velocity_mps in enumerate((-10.5, -3.0, 14.4)):
        uav = fields | {"name": "uav", "velocity_mps": velocity_mps, "rotors": rotors}
        scene = Scene.build({"radar": radar | {"pulses": 720}, "uav": [uav]})
        found = measure(scene.render(seed).iq, **radar)
        assert abs(found.body_velocity_mps - velocity_mps) < 4.5 * found.body_velocity_mps_std < 0.1
        assert found.gear_ratio == pytest.approx(4.73, rel=1e-3)


def test_the_body_is_not_the_outermost_line_of_a_family_that_takes_up_most_of_the_span():
    """Counted from there the lines reach all around the circle of velocities, and no place was its middle."""
    fields = AIRFRAMES["helicopter_41cm"].fields
    radar = {"carrier_hz": 3.3e9, "prf_hz": 6310.0}
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rotors = [r | {"beta_deg": 8.0, "phase_deg": rng.uniform(0, 360)} for r in fields["rotors"]]
        uav = fields | {"name": "uav", "velocity_mps": 8.4, "rotors": rotors}
        body = [part | {"level_db": part["level_db"] - 20} for part in fields["body"]]
        scene = Scene.build({"radar": radar | {"pulses": 504}, "uav": [uav | {"body": body}]})
        found = measure(scene.render(seed).iq, **radar)
        assert abs(found.body_velocity_mps - 8.4) < max(0.1, 4.5 * found.body_velocity_mps_std)
        assert abs(found.body_velocity_mps - 8.4) < 20


def test_normalised_errors_have_unit_variance():
    rng = np.random.default_rng(3)
    errors = []
    for seed in range(8):
        gear, main_hz = rng.uniform(4.2, 4.8), rng.uniform(33, 45)
        found = measure(helicopter(main_hz, gear, snr_db=3.0, tail_db=-6.0, seed=seed), **RADAR)
        errors.append((float(found.gear_ratio) - gear) / float(found.gear_ratio_std))
    assert np.isfinite(errors).all()
    # chi-squared of 8 degrees of freedom over 8 lies within 0.12..3.0 in 99.7 %
    assert 0.12 < np.mean(np.square(errors)) < 3.0


def one_rotor(amplitudes=(1.0, 1.0), rates_hz=(46.7,), **options):
    iq = sum(rotors([rate_hz], body=0.0, amplitudes=amplitudes, length_m=0.3, **options) for rate_hz in rates_hz)
    return (iq + 10) * 3 + white(np.random.default_rng(1), PULSES)


@pytest.mark.parametrize(
    "iq",
    [
        one_rotor(),
        one_rotor((1.0, 0.6)),
        one_rotor((1.0, 0.9, 0.5)),
        one_rotor((1.0, 0.0)),
        one_rotor(rates_hz=(44.1, 47.9)),
        one_rotor(rates_hz=(44.1, 44.9, 46.0, 47.2)),
        one_rotor(rates_hz=(40.3, 42.7, 44.1, 46.9, 48.0, 51.2)),
        helicopter(gear=5.0),
        helicopter(tail_db=-60.0),
    ],
    ids=[
        "one rotor",
        "unequal blades",
        "three unequal blades",
        "one blade",
        "two rotors",
        "four rotors",
        "six rotors in a manoeuvre",
        "tail on the main's lines",
        "tail too weak",
    ],
)
def test_what_is_no_second_comb_has_a_reason_and_no_number(iq):
    found = measure(iq, **RADAR)
    assert np.isfinite(found.chopping_hz)
    assert str(found.gear_reason).startswith("no second comb")
    for name in NAMES:
        assert np.isnan(getattr(found, name))
        assert np.isnan(getattr(found, f"{name}_std"))


@pytest.mark.parametrize(("blades", "gear"), [(2, 5.7), (3, 5.43), (4, 5.39)])
def test_tail_blades_that_are_not_quite_alike_chop_by_their_number(blades, gear):
    """Their lines are at every multiple of the rotation rate, and what was told of the tail was a fraction, surely."""
    main_hz, told = 38.3, 0
    for seed in range(4):
        unlike = 1 + 0.15 * np.random.default_rng(seed).standard_normal(blades)
        found = measure(helicopter(main_hz, gear, snr_db=14.0, tail_db=-6.0, seed=seed, tail_blades=unlike), **RADAR)
        if np.isfinite(found.gear_ratio):
            told += 1
            truth = (2 * main_hz, blades * gear * main_hz, gear * blades / 2)
            np.testing.assert_allclose(values(found), truth, rtol=1e-3)
    assert told >= 2  # of four: else the weak lines are too few, and the fraction is no answer


def test_a_second_comb_whose_strong_lines_are_as_far_apart_as_the_firsts_is_no_helicopters(monkeypatch):
    """Of what a drone's unlike blades leave, lines at a fraction of their rate, every fourth one was strong."""
    iq = helicopter(tail_db=12.0)  # the tail's comb is found first
    assert measure(iq, **RADAR).gear_ratio == pytest.approx(GEAR, rel=1e-3)
    monkeypatch.setattr(module, "_lines_per_turn", lambda *_: 4)
    found = measure(iq, **RADAR)
    assert np.isnan(found.gear_ratio)
    assert "its strong lines are 1.18" in str(found.gear_reason)


def test_the_reasons_of_no_comb_and_of_a_short_dwell():
    noise = white(np.random.default_rng(2), PULSES)
    assert measure(noise, **RADAR).gear_reason == "no comb"
    assert measure(np.zeros(PULSES, complex), **RADAR).gear_reason == "no comb"
    # 1300 pulses: the main's lines are 3.1 bins apart, no room for others
    assert "dwell too short" in str(measure(helicopter(snr_db=20.0)[:1300], **RADAR).gear_reason)


def test_a_batch_gives_what_a_loop_gives():
    batch = np.stack([helicopter(), one_rotor(), white(np.random.default_rng(4), PULSES)])
    together = measure(batch, **RADAR)
    for index, iq in enumerate(batch):
        alone = measure(iq, **RADAR)
        for name in (*NAMES, "gear_ratio_std", "gear_reason"):
            np.testing.assert_array_equal(getattr(together, name)[index], getattr(alone, name))


def test_gain_phase_time_reversal_and_scale():
    iq = helicopter()
    base = measure(iq, **RADAR)
    turned = measure(iq * 32 * np.exp(1j), **RADAR)
    np.testing.assert_allclose(values(turned), values(base), rtol=1e-6)
    back = measure(iq[::-1], **RADAR)
    assert back.gear_ratio == pytest.approx(float(base.gear_ratio), abs=2 * float(base.gear_ratio_std))
    scaled = measure(iq, carrier_hz=2 * CARRIER_HZ, prf_hz=2 * PRF_HZ)
    np.testing.assert_allclose(values(scaled), np.array(values(base)) * (2, 2, 1), rtol=1e-6)


def test_the_main_rotor_is_measured_without_the_tails_lines():
    found = measure(helicopter(tail_db=0.0), **RADAR, blades=2, beta_rad=0.0)
    assert found.rotor_count == 1
    assert found.rotors_resolved
    assert found.chopping_hz == found.main_chopping_hz


@pytest.mark.parametrize(("snr_db", "tail_db", "tail_m"), [(20.0, -6.0, 0.085), (8.0, -6.0, 0.085), (20.0, -4.0, 0.06)])
def test_the_tail_does_not_move_the_tip_of_the_main_rotor(snr_db, tail_db, tail_m):
    """Its lines, also those past its last that is fitted, passed for the main one's: 2 to 15 % off, 1 % stated."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        main_hz = MAIN_HZ + rng.uniform(-1, 1)
        main = rotors([main_hz], length_m=0.35, velocity_mps=-4.0)
        tail = rotors([main_hz * GEAR], length_m=tail_m, velocity_mps=-4.0, body=0.0)
        found = measure((main + 10 ** (tail_db / 20) * tail) * 10 ** (snr_db / 20) + white(rng, PULSES), **RADAR)
        assert found.gear_reason == ""
        off = found.tip_speed_mps - 2 * np.pi * main_hz * 0.35
        assert abs(off) < 4 * found.tip_speed_mps_std


@pytest.mark.parametrize(("rotation_hz", "pulses"), [(5.7, 8000), (6.6, 8000), (8.1, 8000), (6.2, 2400), (8.9, 2400)])
def test_a_helicopter_slower_than_rotors_chop_is_told_to_be(rotation_hz, pulses):
    """Two blades of 5 m: every second line was given, surely, in dwells that hardly part all of them as well."""
    rng = np.random.default_rng(int(10 * rotation_hz))
    radar = {"carrier_hz": 3.3e9, "prf_hz": 15e3}
    times_s = np.arange(pulses) / radar["prf_hz"]
    echo = rotor_echo(RotorMotion(rotation_hz, 1.0).angle_rad(times_s), wavelength_m=0.0908, blade_length_m=5.0)
    iq = 4 * echo / np.sqrt(np.mean(np.abs(echo) ** 2)) + 10 + white(rng, pulses)
    found = measure(iq.astype(np.complex64), **radar)
    assert np.isnan(found.chopping_hz)
    assert f"lines every {2 * rotation_hz:.1f} Hz, rotors chop at 18 Hz and more" in str(found.reason)
