"""Tips faster than the unambiguous velocity: which comb it is, and how fast they are."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.changing import ChangingSeparation
from bladewing.features.rotor.comb import find_comb
from bladewing.features.rotor.comb_fit import fit_combs
from bladewing.features.rotor.folding import FASTEST_TIP_MPS, FOLDED_BINS, outermost_orders
from bladewing.features.rotor.periodogram import prepare
from bladewing.simulate import RotorMotion, rotor_echo

from ..signals import CARRIER_HZ, WAVELENGTH_M, folded, moving_at, rotors_by_chance, tone, white


@pytest.mark.parametrize(("times", "least"), [(1.2, 17), (1.6, 13), (1.9, 8)])
def test_the_chopping_frequency_and_the_tip_are_told_where_lines_come_back(times, least):
    right, tips, errors = 0, 0, []
    for seed in range(20):
        iq, radar, (rate_hz,), tip_mps = folded(seed, times)
        found = measure(iq, **radar)
        # where a few spans are nearly whole spacings the lines that come back lie on others
        if found.rotors_resolved and abs(found.chopping_hz / (2 * rate_hz) - 1) < 1e-3:
            right += 1
            assert found.body_velocity_mps == pytest.approx(5.0, abs=0.1)
            if np.isfinite(found.tip_speed_mps):
                tips += 1
                errors.append((found.tip_speed_mps - tip_mps) / found.tip_speed_mps_std)
                assert found.tip_speed_mps == pytest.approx(tip_mps, rel=0.05)
                assert found.bandwidth_hz > radar["prf_hz"]
    # it was 14, 9 and 2, the others fractions of the chopping frequency or not told apart, and no tips at all
    assert right >= least
    assert tips >= least - 2
    assert np.sqrt(np.mean(np.square(errors))) < 1.5


@pytest.mark.parametrize(("times", "least"), [(3.0, 36), (4.0, 32)])
def test_the_comb_of_far_faster_tips_is_sought_as_finely_as_they_reach(times, least):
    right = 0
    for seed in range(40):
        iq, radar, (rate_hz,), _ = folded(seed, times)
        comb, _ = find_comb(prepare(iq, **radar), 2)
        right += comb is not None and abs(comb.chopping * radar["prf_hz"] / 2 / rate_hz - 1) < 0.01
    assert right >= least  # it was 32 and 26, the others halves, thirds and fifths


def test_a_fraction_of_the_chopping_frequency_is_not_sure():
    """Where the span is whole spacings of it, the lines are the same and hardly any flash is seen."""
    for times, seed in ((3.0, 4), (3.0, 16), (3.0, 31), (4.0, 6), (4.0, 11), (4.0, 27)):
        iq, radar, (rate_hz,), _ = folded(seed, times)
        found = measure(iq, **radar, blades=2)
        if not np.isnan(found.chopping_hz):
            assert not found.rotors_resolved
            assert abs(found.chopping_hz - 2 * rate_hz) < 4 * found.chopping_hz_std


def test_no_rotors_of_changing_rates_are_sought_where_lines_come_back(monkeypatch):
    """They are of lines within the span alone: hundreds of them, fitted for seconds, told none apart."""

    def sought(*_):
        raise AssertionError

    monkeypatch.setattr(ChangingSeparation, "sought", sought)
    for seed in range(6):
        iq, radar, _, _ = folded(seed, 1.6, count=2, spread=0.004)
        measure(iq, **radar)


def test_slow_rotors_whose_lines_come_back_are_not_slower_ones():
    """What comes back lies between the lines, which passed for those of a rate at which no rotor chops."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rate_hz, blade_m = rng.uniform(18, 26), 0.5
        prf_hz = 4 * 2 * np.pi * rate_hz * blade_m / 2.3 / WAVELENGTH_M
        times_s = np.arange(int(0.3 * prf_hz)) / prf_hz
        echo = rotors_by_chance(rng, [rate_hz], times_s, wavelength_m=WAVELENGTH_M, length_m=blade_m)
        iq = (4 * echo + 5) * moving_at(5, times_s) + white(rng, len(times_s))
        found = measure(iq.astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
        assert found.chopping_hz == pytest.approx(2 * rate_hz, rel=0.01)


def test_a_rotor_within_the_span_whose_rate_changes_is_not_folded():
    """Its smeared lines spoke for one that reaches far to one side, about another body."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        prf_hz, rate_hz, blade_m = 10e3, rng.uniform(80, 110), 0.1
        times_s = np.arange(3000) / prf_hz
        motion = RotorMotion(rate_hz, 0.0, drift_hz_per_s=rng.uniform(-0.05, 0.05) * rate_hz)
        echo = rotor_echo(motion.angle_rad(times_s), wavelength_m=WAVELENGTH_M, blade_length_m=blade_m)
        iq = (4 * echo / np.sqrt(np.mean(np.abs(echo) ** 2)) + 4) * moving_at(2, times_s)
        found = measure((iq + white(rng, len(times_s))).astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
        assert np.isnan(found.chopping_hz) or found.body_velocity_mps == pytest.approx(2.0, abs=0.5)


def test_of_several_rotors_the_chopping_frequency_is_told_too():
    right = 0
    for seed in range(10):
        iq, radar, rates_hz, _ = folded(seed, 1.4, count=4, spread=0.02)
        found = measure(iq, **radar)
        right += abs(found.chopping_hz / (2 * rates_hz.mean()) - 1) < 0.01
    assert right >= 9


def test_a_radar_fast_enough_finds_the_same_tip():
    iq, radar, _, tip_mps = folded(4, 1.4)
    fast, wide, _, same_mps = folded(4, 0.6)
    assert tip_mps == same_mps
    few, many = measure(iq, **radar), measure(fast, **wide)
    assert abs(few.tip_speed_mps - many.tip_speed_mps) < 4 * np.hypot(few.tip_speed_mps_std, many.tip_speed_mps_std)


@pytest.mark.parametrize("prf_hz", [8e3, 9e3, 10e3])
def test_lines_count_as_far_out_as_they_are_told_from_the_others(prf_hz):
    pulses = 1000
    data = prepare(white(np.random.default_rng(0), pulses).astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
    fastest = 2 * FASTEST_TIP_MPS / WAVELENGTH_M / prf_hz
    for turns in np.random.default_rng(1).uniform(12, 90, 200):
        outermost = int(outermost_orders(data, 1 / turns))
        assert outermost >= int(turns / 2)
        assert outermost <= max(fastest, 0.5) * turns
        # by brute force: of all lines up to there none is so near to another on the circle
        places = np.sort(np.arange(-outermost, outermost + 1) / turns % 1)
        nearest_bins = np.diff(np.append(places, places[0] + 1)).min() * pulses
        if outermost > turns / 2 + 1:
            assert nearest_bins > 0.99 * FOLDED_BINS
        elif fastest > 0.5 + 1 / turns:  # and the next half span of them would be
            assert abs(turns - round(turns)) / turns * pulses < 1.01 * FOLDED_BINS


def test_lines_that_come_back_are_fitted_as_they_stand():
    pulses, spacing, centre = 1200, 0.0231, 0.013
    rng = np.random.default_rng(3)
    order = np.arange(-34, 35)
    amplitudes = rng.standard_normal(len(order)) + 1j * rng.standard_normal(len(order))
    iq = (amplitudes[:, None] * tone(centre + spacing * order, pulses, 1.0)).sum(axis=0) + 0.1 * white(rng, pulses)
    data = prepare(iq.astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=10e3)
    (fit,), rest = fit_combs(data, centre + 1e-5, [spacing + 2e-6], [(-34, 34)])
    assert np.abs(fit.orders).max() > 0.5 / spacing
    assert abs(fit.spacing - spacing) < 4 * fit.spacing_std < 1e-6
    assert np.mean(np.abs(rest) ** 2) < 2 * np.mean(np.abs(white(rng, pulses)) ** 2)


@pytest.mark.parametrize(("carrier_hz", "needed"), [(77e9, "12.3 kHz"), (0.1e9, "135 Hz")])
def test_a_prf_given_in_khz_is_told_what_is_needed(carrier_hz, needed):
    iq = white(np.random.default_rng(1), 200)
    reason = str(measure(iq, carrier_hz=carrier_hz, prf_hz=20.0).reason)
    assert reason.startswith("PRF too low")
    assert reason.endswith(f"raise it to {needed} at least")


@pytest.mark.parametrize(("prf_hz", "is_too_low"), [(4e3, True), (40e3, False)])
def test_lines_that_fill_a_span_slower_than_rotors_are_none_of_something_slow(prf_hz, is_too_low):
    """At 77 GHz and 4 kHz velocities are told to 3.9 m/s: a rotor's lines were said to reach no further than that."""
    wavelength_m = 299_792_458.0 / 77e9
    unambiguous_mps = wavelength_m * prf_hz / 4
    time_s = np.arange(int(0.2 * prf_hz)) / prf_hz
    rng = np.random.default_rng(3)
    # a comb over 3.5 m/s: all of the span at the low PRF, slower than any rotor at the high one
    orders = np.arange(-int(3.5 * 2 / wavelength_m / 140.3), int(3.5 * 2 / wavelength_m / 140.3) + 1)
    lines = np.exp(2j * np.pi * np.outer(orders * 140.3, time_s) + 2j * np.pi * rng.uniform(size=(len(orders), 1)))
    noise = rng.standard_normal((2, len(time_s)))
    iq = lines.sum(axis=0) + 10 + (noise[0] + 1j * noise[1]) / np.sqrt(2)
    reason = str(measure(iq.astype(np.complex64), carrier_hz=77e9, prf_hz=prf_hz).reason)
    assert ("PRF too low" in reason) == is_too_low
    if is_too_low:
        assert f"to {unambiguous_mps:.1f} m/s" in reason
        assert f"raise it to {12 / unambiguous_mps * prf_hz / 1e3:.1f} kHz at least" in reason
    else:
        assert "no rotor" in reason


@pytest.mark.parametrize(("times", "seed"), [(1.1, 5), (1.1, 8), (1.5, 7), (2.2, 5)])
def test_a_body_without_a_line_is_not_told_where_lines_not_told_apart_fill_the_span(times, seed):
    """Lines lie all around the circle, and any of them may be the middle: these were surely 4 to 105 m/s off."""
    iq, radar, (rate_hz,), _ = folded(seed, times, body=0.0)
    found = measure(iq, **radar)
    assert found.chopping_hz == pytest.approx(2 * rate_hz, rel=0.01)
    assert not found.rotors_resolved
    assert np.isnan(found.body_velocity_mps)


def test_a_body_without_a_line_is_told_by_lines_that_come_back_beside_the_others():
    told = 0
    for seed in range(7):
        iq, radar, _, _ = folded(seed, 1.5, body=0.0)
        found = measure(iq, **radar)
        told += abs(found.body_velocity_mps - 5.0) < 4 * found.body_velocity_mps_std < 12
    assert told == 7


@pytest.mark.parametrize(("carrier_hz", "prf_hz"), [(77e9, 5e3), (24e9, 1e3), (9.85e9, 1e3)])
def test_where_no_rotor_could_be_seen_the_prf_is_the_reason(carrier_hz, prf_hz):
    """Be it noise or a drone whose lines fold: that no comb is found says nothing of it."""
    rng, wavelength_m, times_s = np.random.default_rng(4), 299_792_458.0 / carrier_hz, np.arange(400) / prf_hz
    noise = white(rng, 4, 400)
    drone = rotors_by_chance(rng, [69.0, 70.0, 71.0], times_s, wavelength_m=wavelength_m, length_m=0.12)
    for iq in (noise, noise + 3 * (drone + 3)):
        found = measure(iq, carrier_hz=carrier_hz, prf_hz=prf_hz)
        assert all("PRF too low" in reason for reason in found.reason.tolist())
