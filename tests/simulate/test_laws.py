"""What records are drawn from follows the table of laws, for any seed."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from bladewing.simulate import Radar, dataset, draw_records, uav
from bladewing.simulate.bird import wing_size, wingbeat_hz
from bladewing.simulate.clutter import draw_clutter
from bladewing.simulate.dataset import QUIET, WEATHER
from bladewing.simulate.laws import LAWS, WIDTH, Draws
from bladewing.simulate.receiver import FAULT_CHANCE, FAULTLESS_CHANCE, NormalsOf, Receiver
from bladewing.simulate.uav import LEAST_ROTATION_HZ, _motion, _tail_rotor
from hypothesis import given, settings
from hypothesis import strategies as st


def distribution(law, values):
    """Cumulative distribution of a law at sorted values."""
    if law.kind == "log":
        return np.log(values / law.low) / np.log(law.high / law.low)
    share = (values - law.low) / (law.high - law.low)
    return share ** (1 / 0.7) if law.kind == "rising" else share


def distance(values, cumulative) -> float:
    """Kolmogorov and Smirnov's distance, times the root of the number of values: above 3 once in 30 million."""
    count = len(values)
    steps = np.arange(count + 1) / count
    return max(abs(cumulative - steps[:-1]).max(), abs(cumulative - steps[1:]).max()) * np.sqrt(count)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32))
def test_every_law_is_drawn_as_it_stands(seed):
    uniforms = np.random.default_rng(seed).random((3000, 1))
    for name, law in LAWS.items():
        values = np.sort(Draws(uniforms).value(name))
        assert distance(values, distribution(law, values)) < 3, name


@given(seed=st.integers(0, 2**32), least=st.floats(0.0, 1.0))
def test_a_raised_low_end_leaves_the_law_from_there_on(seed, least):
    law = LAWS["tip_mps"]
    lows = law.low * (law.high / law.low) ** (1.9 * least - 0.95)  # below the law's own and above it
    values = Draws(np.random.default_rng(seed).random((3000, 1))).value("tip_mps", least=np.full(3000, lows))
    assert distance(np.sort(values), distribution(replace(law, low=max(law.low, lows)), np.sort(values))) < 3


def test_no_rotor_turns_as_slowly_as_a_wheel():
    radar = Radar(9.85e9, 5e3, 16)
    for kind in ("fixed_wing", "helicopter"):
        truth = draw_records(radar, 2000, 3, kind=kind).truth
        turns_hz = truth["rotation_hz"]
        assert turns_hz.min() >= LEAST_ROTATION_HZ * (1 - 1e-12)
        longest = truth["blade_length_m"] > np.quantile(truth["blade_length_m"], 0.9)
        assert turns_hz[longest].min() < 1.1 * LEAST_ROTATION_HZ  # the law begins there, not beyond


@given(seed=st.integers(0, 2**32), beta_deg=st.floats(0.0, 90.0))
def test_a_propeller_flies_along_its_axis_and_a_lifting_rotor_square_to_it(seed, beta_deg):
    beta, climb = np.full(300, np.deg2rad(beta_deg)), LAWS["climb_mps"].high
    for kind in ("fixed_wing", "quadcopter"):
        flown, seen = uav._flight(Draws(np.random.default_rng(seed).random((300, WIDTH))), kind, beta)
        assert 0.18 < np.mean(flown == 0) < 0.42  # of three in ten: 4.5 standard deviations
        assert (seen[flown == 0] == 0).all()
        if kind == "fixed_wing":
            assert (np.abs(seen - flown * np.sin(beta)) <= climb).all()
        else:
            least, most = np.abs(flown) * np.cos(
                np.clip(beta[0] + LAWS["tilt_rad"].high * np.array([[1], [-1]]), 0, np.pi / 2)
            )
            assert (np.abs(seen) <= most + climb).all()
            assert (np.abs(seen) >= least - climb).all()


def test_hardly_any_lifting_rotor_is_seen_with_tips_slower_than_its_body():
    truth = draw_records(Radar(9.85e9, 25e3, 16), 3000, 3, kind="quadcopter").truth
    tips = truth["tip_mps"] * np.cos(truth["beta_rad"])
    assert np.mean(tips < np.abs(truth["velocity_mps"])) < 0.01  # with speeds of any aspect it is 0.023


@settings(max_examples=4)
@given(seed=st.integers(0, 2**32))
def test_rates_levels_and_lengths_of_records_follow_their_laws(seed):
    radar = Radar(9.85e9, 5e3, 16)
    truth = draw_records(radar, 1200, seed, kind="hexacopter").truth
    tip = np.sort(2 * np.pi * truth["rotation_hz"] * truth["blade_length_m"])
    # the mean of six rates spread by at most 18 % about the drawn one moves the law's edge by a few per cent
    inside = (tip > LAWS["tip_mps"].low * 0.9) & (tip < LAWS["tip_mps"].high * 1.1)
    assert inside.all()
    for column, law in (("snr_db", "snr_db"), ("blade_length_m", "blade_length_m"), ("beta_rad", "uav_beta_rad")):
        drawn = truth[column] - (truth["quiet_db"] if column == "snr_db" else 0)
        values = np.sort(drawn)
        assert distance(values, distribution(LAWS[law], values)) < 3, column
    quiet = truth["quiet_db"][truth["quiet_db"] > 0]
    assert abs(len(quiet) / 1200 - QUIET) < 4 * np.sqrt(QUIET / 1200)
    assert distance(np.sort(quiet), distribution(LAWS["quiet_db"], np.sort(quiet))) < 3
    bird = draw_records(radar, 1200, seed, kind="flapping_bird").truth
    mass = np.sort(bird["mass_kg"])
    assert distance(mass, distribution(LAWS["bird_mass_kg"], mass)) < 3
    expected_hz = wingbeat_hz(bird["mass_kg"], *wing_size(bird["mass_kg"]))
    slow = expected_hz * LAWS["wingbeat_scatter"].high < 18  # no bird's mean rate is higher
    ratio = np.sort((bird["wingbeat_hz"] / expected_hz)[slow])
    # the rate that is rendered is off the mean that the law draws, by as much as a twentieth, evenly
    off = 1 + 0.1 * ((np.arange(200) + 0.5) / 200 - 0.5)
    of_each = distribution(LAWS["wingbeat_scatter"], ratio[:, None] / off).clip(0, 1)
    assert distance(ratio, of_each.mean(axis=1)) < 3


def test_box_and_muller_give_normal_numbers():
    values = np.sort(Draws(np.random.default_rng(1).random((20_000, 2))).normal())
    assert values.mean() == pytest.approx(0, abs=4.5 / np.sqrt(20_000))
    assert values.var() == pytest.approx(1, abs=4.5 * np.sqrt(2 / 20_000))


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32))
def test_what_ticks_keeps_the_time_of_its_mains_and_a_quarter_of_all_bursts_come_at_any_other_rate(seed):
    drawn = Receiver(Draws(np.random.default_rng(seed).random((4000, 200))))
    periods = drawn.burst_hz / drawn.mains_hz
    steady = np.isin(periods.round(12), [1.0, 2.0])
    assert steady[drawn.burst_alike].all()
    assert abs(drawn.burst_alike.sum() - 2000) < 5 * np.sqrt(1000)
    assert abs((~steady).sum() - 1000) < 5 * np.sqrt(750)
    once = periods.round(12)[steady] == 1.0
    assert abs(once.mean() - 0.3) < 5 * np.sqrt(0.21 / len(once))
    values = np.sort(drawn.burst_hz[~steady])
    assert distance(values, distribution(LAWS["burst_hz"], values)) < 3


def test_a_fifth_of_all_receivers_have_no_fault_and_each_fault_its_share_of_the_others():
    records = 20_000
    drawn = Receiver(Draws(np.random.default_rng(2).random((records, 200))))
    on = np.stack(list(drawn.on.values()))
    none = FAULTLESS_CHANCE + (1 - FAULTLESS_CHANCE) * np.prod([1 - chance for chance in FAULT_CHANCE.values()])
    assert (~on.any(axis=0)).mean() == pytest.approx(none, abs=4.5 * np.sqrt(none * (1 - none) / records))
    for name, chance in FAULT_CHANCE.items():
        share = (1 - FAULTLESS_CHANCE) * chance
        assert drawn.on[name].mean() == pytest.approx(share, abs=4.5 * np.sqrt(share * (1 - share) / records))


def test_a_tail_rotor_drifts_and_wanders_as_its_gear_makes_it():
    draws, radar = Draws(np.random.default_rng(3).random((50, 200))), Radar(9.85e9, 25e3, 512)
    main = _motion(draws, np.full(50, 30.0), radar)
    rotor, rate_hz = _tail_rotor(draws, np.full(50, 0.5), main)
    ratio = rate_hz / 30.0
    assert (ratio > 3).all()
    for name in ("drift_hz_per_s", "wander_hz"):
        np.testing.assert_allclose(abs(getattr(rotor.motion, name)), ratio * abs(getattr(main, name)))
    np.testing.assert_array_equal(rotor.motion.wander_phase_rad, main.wander_phase_rad)
    np.testing.assert_allclose(np.abs(rotor.motion.rotation_hz), rate_hz)
    # whichever way either turns, both have turned by as much at any time
    times_s = np.linspace(0, 2, 7)
    turned = [np.abs(m.angle_rad(times_s) - m.angle_rad(np.zeros(1))) for m in (rotor.motion, main)]
    np.testing.assert_allclose(turned[0], ratio[:, None] * turned[1], rtol=1e-9, atol=1e-9)


def alone(effect: str, records: int) -> Receiver:
    """Receivers with one effect and no gain of their own."""
    drawn = Receiver(Draws(np.random.default_rng(0).random((records, 400))))
    drawn.on = {name: np.full(records, name == effect) for name in drawn.on}
    drawn.gain_db[:] = 0.0
    return drawn


@pytest.mark.parametrize("pulses", [2.0, 3.0])
def test_a_canceller_is_a_difference_of_pulses_once_or_twice_but_for_its_delay(pulses):
    radar, turns = Radar(9.85e9, 1e4, 400), np.array([0.0, 0.05, 0.25, -0.4, 0.5])
    drawn = alone("canceller", len(turns))
    drawn.canceller_pulses[:] = pulses
    tones = np.exp(2j * np.pi * turns[:, None] * np.arange(radar.pulses)).astype(np.complex64)
    power = np.mean(np.abs(drawn.receive(tones, np.zeros_like(tones), radar, lambda _: None)) ** 2, axis=1)
    differences = np.diff(tones, n=int(pulses) - 1, axis=1)
    np.testing.assert_allclose(power, np.mean(np.abs(differences) ** 2, axis=1), rtol=1e-4, atol=1e-6)


def test_a_receiver_steps_as_often_and_as_far_as_its_laws_say_and_is_steady_between():
    records, radar = 300, Radar(9.85e9, 1e4, 3000)
    drawn = alone("steps", records)
    still = np.ones((records, radar.pulses), np.complex64)
    iq = drawn.receive(still.copy(), np.zeros_like(still), radar, lambda _: None)
    assert ((np.diff(iq, axis=1) != 0).sum(axis=1) <= drawn.step_count).all()
    assert np.mean((np.diff(iq, axis=1) != 0).sum(axis=1) == drawn.step_count) > 0.9  # two may fall on one pulse
    level_db, angle = 20 * np.log10(np.abs(iq)), np.angle(iq)
    assert (level_db <= 1e-5).all()
    assert (level_db >= -drawn.step_db[:, None] - 1e-5).all()
    assert (np.abs(angle) <= drawn.step_rad[:, None] + 1e-6).all()
    # of so many steps the widest reaches most of the range: the ends of n + 1 even numbers are 2 / (n + 2) off it
    n = drawn.step_count
    reached = np.ptp(level_db, axis=1) / drawn.step_db
    spread = np.sqrt(2 * n / ((n + 2) ** 2 * (n + 3)))
    assert np.mean((reached - n / (n + 2)) / spread) == pytest.approx(0, abs=4.5 / np.sqrt(records))


def test_a_step_acts_on_noise_and_echo_alike():
    radar, drawn = Radar(9.85e9, 1e4, 500), alone("steps", 4)
    rng = np.random.default_rng(1)
    signal, noise = rng.standard_normal((2, 4, radar.pulses, 2)).astype(np.float32).view(np.complex64)[..., 0]
    both = drawn.receive(signal.copy(), noise, radar, lambda _: None)
    factor = drawn.receive(np.ones_like(signal), np.zeros_like(noise), radar, lambda _: None)
    np.testing.assert_allclose(both, factor * (signal + noise), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("limit_db", [-10.0, 3.0, 30.0])
def test_a_limiter_keeps_the_phase_and_what_is_below_its_level(limit_db):
    radar, drawn = Radar(9.85e9, 1e4, 2000), alone("limiter", 3)
    drawn.limit_db[:] = limit_db
    rng = np.random.default_rng(2)
    signal = rng.standard_normal((3, radar.pulses, 2)).astype(np.float32).view(np.complex64)[..., 0] * 3
    iq = drawn.receive(signal.copy(), np.zeros_like(signal), radar, lambda _: None)
    limit = 10 ** (limit_db / 20)
    np.testing.assert_allclose(np.abs(iq), np.minimum(np.abs(signal), limit), rtol=1e-5)
    np.testing.assert_allclose(np.angle(iq), np.angle(signal), atol=1e-5)
    assert (np.abs(signal) > limit).any() == (limit_db < 20)


RADAR = Radar(9.85e9, 1e4, 4000)


def received(drawn: Receiver, signal: np.ndarray) -> np.ndarray:
    """What receivers make of signals without noise."""
    generators = [np.random.default_rng([1, row]) for row in range(len(signal))]
    iq = signal.astype(np.complex64)
    return drawn.receive(iq, np.zeros_like(iq), RADAR, lambda _: NormalsOf(generators)).astype(complex)


def tones(*frequencies_hz: float) -> np.ndarray:
    return np.exp(2j * np.pi * np.array(frequencies_hz)[:, None] * RADAR.times_s)


@pytest.mark.parametrize("image_db", [-50.0, -20.0])
def test_an_image_is_the_line_at_the_other_side_and_as_far_under_it_as_asked_for(image_db):
    drawn = alone("image", 2)
    drawn.image_db[:] = image_db
    lines = np.abs(np.fft.fft(received(drawn, tones(1000.0, -700.0)))) / RADAR.pulses
    np.testing.assert_allclose(lines[[0, 1], [400, -280]], 1, rtol=1e-5)
    np.testing.assert_allclose(20 * np.log10(lines[[0, 1], [-400, 280]]), image_db, atol=0.01)


def test_a_high_pass_halves_a_line_at_its_corner_and_leaves_those_far_above():
    drawn = alone("high_pass", 4)
    drawn.high_pass_hz[:] = 50.0
    passed = np.abs(received(drawn, tones(0.0, 50.0, -50.0, 2000.0)))
    np.testing.assert_allclose(passed.mean(axis=1), [0, 0.5, 0.5, 1], atol=1e-3)


def test_a_band_falls_to_its_edges_with_the_square_of_the_frequency():
    drawn = alone("colour", 3)
    drawn.hump_db[:], drawn.tilt_db[:] = 0.0, -20.0
    passed = np.abs(received(drawn, tones(-5000.0, 2500.0, 0.0)))
    np.testing.assert_allclose(20 * np.log10(passed.mean(axis=1)), [-20, -5, 0], atol=0.01)


def test_a_band_is_humped_by_what_is_asked_for_at_most():
    drawn = alone("colour", 300)
    drawn.tilt_db[:] = 0.0
    impulse = np.zeros((300, RADAR.pulses))
    impulse[:, 0] = 1
    reached_db = np.abs(20 * np.log10(np.abs(np.fft.fft(received(drawn, impulse))))).max(axis=1)
    most_db = drawn.hump_db.sum(axis=1)
    assert (reached_db <= most_db + 0.01).all()
    assert (reached_db > 0.9 * most_db).mean() > 0.3


def test_what_is_made_analytic_keeps_a_lines_level_and_one_side_by_chance():
    drawn = alone("analytic", 60)
    lines = np.abs(np.fft.fft(received(drawn, tones(*[1000.0] * 60)))) / RADAR.pulses
    upper, lower = lines[:, 400], lines[:, -400]
    np.testing.assert_allclose(np.maximum(upper, lower), 1, rtol=1e-4)
    assert (np.minimum(upper, lower) < 1e-4).all()
    assert 10 < (upper > lower).sum() < 50


def test_a_real_receiver_gives_the_real_part():
    (heard,) = received(alone("real_only", 1), tones(1000.0))
    np.testing.assert_allclose(heard, np.cos(2 * np.pi * 1000.0 * RADAR.times_s), atol=1e-5)


@pytest.mark.parametrize(("full_scale_db", "bits"), [(-3.0, 8.0), (0.0, 6.0), (12.0, 10.0)])
def test_a_converter_has_its_full_scale_over_the_largest_sample_and_so_many_steps(full_scale_db, bits):
    drawn = alone("converter", 1)
    drawn.full_scale_db[:], drawn.bits[:] = full_scale_db, bits
    signal = np.random.default_rng(2).normal(size=(1, RADAR.pulses, 2)).view(complex)[..., 0]
    full_scale = max(abs(signal.real).max(), abs(signal.imag).max()) * 10 ** (full_scale_db / 20)
    step = full_scale / 2 ** (bits - 1)
    given, wanted = received(drawn, signal).real, signal.real.clip(-full_scale, full_scale)
    assert 0.49 * step < np.abs(given - wanted).max() < 0.51 * step
    np.testing.assert_allclose(given, np.rint(given / step) * step, atol=1e-3 * step)


def test_phase_noise_has_the_rms_asked_for():
    drawn = alone("phase_noise", 200)
    drawn.phase_noise_rad[:] = 0.01
    turned = np.angle(received(drawn, np.ones((200, RADAR.pulses))))
    assert np.sqrt(np.mean(turned**2)) == pytest.approx(0.01, rel=0.25)


def test_fading_swings_about_the_level_by_as_much_as_asked_for():
    drawn = alone("fading", 300)
    drawn.fading_db[:] = 8.0
    drawn.fading_hz[:] = 25.0, 17.0
    level_db = 20 * np.log10(np.abs(received(drawn, np.ones((300, RADAR.pulses)))))
    assert np.abs(level_db).max() == pytest.approx(8.0, abs=0.3)  # where both sines are highest
    assert np.sqrt(np.mean(level_db**2)) == pytest.approx(4.0, rel=0.05)


def test_rain_and_the_sea_stand_behind_targets_as_often_as_they_are_to(monkeypatch):
    radar, count = Radar(9.85e9, 5e3, 32), 3000
    drawn = Counter()

    def counted(draws, radar, kind, normals):
        drawn[kind] += len(draws)
        return draw_clutter(draws, radar, kind, normals)

    monkeypatch.setattr(dataset, "draw_clutter", counted)
    behind = draw_records(radar, count, 4, kind="quadcopter").truth["background_db"]
    share = 0.6 * WEATHER / 2
    for kind in ("rain", "sea"):
        assert abs(drawn[kind] - count * share) < 4.5 * np.sqrt(count * share * (1 - share))
    assert drawn.keys() == {"rain", "sea"}
    assert abs(np.isfinite(behind).sum() - 0.6 * count) < 4.5 * np.sqrt(0.24 * count)


@pytest.mark.parametrize("carrier_hz", [2e9, 94e9])
def test_no_airframe_is_shaken_harder_than_it_could_fly(monkeypatch, carrier_hz):
    shaken = {}
    monkeypatch.setattr(uav, "body_echo", lambda *_, **path: shaken.update(path) or np.zeros((400, 8), np.complex64))
    uav.draw_uav(Draws(np.random.default_rng(1).random((400, WIDTH))), Radar(carrier_hz, 5e3, 8), "quadcopter")
    metres = shaken["vibration_rad"] * 299_792_458.0 / carrier_hz / (4 * np.pi)
    pull_mps2 = metres * (2 * np.pi * shaken["vibration_hz"]) ** 2
    assert pull_mps2.max() <= uav.SHAKEN_MPS2 * 1.0001
    assert (pull_mps2 > 0.99 * uav.SHAKEN_MPS2).mean() > 0.05  # the bound is met
    assert metres.min() >= LAWS["vibration_m"].low * 0.9999
