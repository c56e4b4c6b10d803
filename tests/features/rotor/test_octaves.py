"""The comb of several rotors is that of their chopping frequency, not of a fraction or a multiple of it."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.comb import find_comb
from bladewing.features.rotor.octaves import coarsest, over_neighbours
from bladewing.features.rotor.periodogram import prepare
from bladewing.features.rotor.unlike_blades import strong_multiple
from scipy import special

from ..signals import PRF_HZ, PULSES, RADAR, TIMES_S, WAVELENGTH_M, moving_at, rotors_by_chance, white

ROTOR = {"wavelength_m": WAVELENGTH_M, "length_m": 0.15}


def four_rotors(seed):
    """Rates within 3 %, 20 dB over the noise, at phases and a velocity of chance; with the mean rate [Hz]."""
    rng = np.random.default_rng(seed)
    rates_hz = 57.5 * (1 + rng.uniform(-0.015, 0.015, 4))
    iq = rotors_by_chance(rng, rates_hz, TIMES_S, **ROTOR) * 10 + 100
    iq *= moving_at(rng.uniform(-30, 30))
    return (iq + white(rng, PULSES)).astype(np.complex64), rates_hz.mean()


SEEDS = (1, 2, 4, 21, 23, 44, 51, 72)


@pytest.mark.parametrize("seed", SEEDS)
def test_four_rotors_have_no_comb_at_a_fraction_or_a_multiple(seed):
    # their lines fill all places between the high orders: a third of the spacing finds three times as many there
    iq, rate_hz = four_rotors(seed)
    comb, reason = find_comb(prepare(iq, **RADAR))
    assert comb is not None, reason
    assert comb.chopping * PRF_HZ == pytest.approx(2 * rate_hz, rel=0.02)


def test_tips_of_rotors_that_turn_evenly_apart_have_no_comb_at_a_third():
    # at 0 dB, a third of the spacing had 55 nats where the whole had 53
    rng = np.random.default_rng(60)
    rates_hz = (np.array([3400.0, 3424.0, 3448.0, 3472.0]) + rng.uniform(0, 20, 4)) / 60
    iq = rotors_by_chance(rng, rates_hz, TIMES_S, **ROTOR, points=1) + 10 + white(rng, PULSES)
    comb, reason = find_comb(prepare(iq.astype(np.complex64), **RADAR))
    assert comb is not None, reason
    assert comb.chopping * PRF_HZ == pytest.approx(2 * rates_hz.mean(), rel=0.02)


def test_what_any_place_has_is_no_evidence_and_single_lines_keep_theirs():
    evidence = np.full((1, 4000), -1.0, np.float32)
    evidence[0, ::40] = 5.0  # lines ten bins apart
    np.testing.assert_array_equal(over_neighbours(evidence, 96), evidence)
    full = over_neighbours(np.full((1, 4000), 4.0, np.float32), 96)
    np.testing.assert_allclose(full, 0, atol=1e-5)


def test_the_coarser_of_two_combs_that_speak_alike():
    assert coarsest([3.3, 10.0, 7.0], [200.0, 190.0, 195.0]) == 1
    # a fraction whose lines are there has far more; near the noise the likelihood decides
    assert coarsest([3.3, 10.0], [200.0, 70.0]) == 0
    assert coarsest([3.3, 10.0], [30.0, 28.5]) == 0
    assert coarsest([3.3, 10.0], [55.3, 53.4]) == 1


def test_lines_that_cancel_at_the_low_orders_only_make_no_unequal_blades():
    orders = np.arange(-20, 21)
    power = np.where((orders % 2 == 0) | (np.abs(orders) > 12), 100.0, 2.0)
    assert strong_multiple(orders, power, range(2, 5)) == 1


def test_of_many_lines_the_inner_half_tells_unlike_blades_of_rotors_whose_outer_lines_run_into_one_another():
    rng = np.random.default_rng(0)
    orders = np.arange(-60, 61)
    inner = np.abs(orders) <= 30
    for strong in (2, 3):
        mean = np.where(inner, np.where(orders % strong == 0, 40.0, 2.0), 6.0)
        found = [strong_multiple(orders, mean * rng.exponential(size=121), range(2, 5)) for _ in range(50)]
        assert np.mean(np.array(found) == strong) >= 0.9
        assert set(found) <= {1, strong}


def test_the_parity_of_a_tip_s_lines_makes_no_unlike_blades():
    """Their powers are Bessel functions squared, which near order zero favour even or odd orders by the argument."""
    rng = np.random.default_rng(1)
    for reach in np.linspace(31.5, 120, 300):
        orders = np.arange(-int(reach), int(reach) + 1)
        power = 1e4 * special.jv(orders, reach) ** 2 + rng.exponential(size=len(orders))
        assert strong_multiple(orders, power, range(2, 5)) == 1


@pytest.fixture(scope="module")
def five_tips():
    """Records of a rotor of five tips of which two or three lines show to a side."""
    prf_hz, pulses, beta_rad, turn_hz = 12_792.0, 1321, np.radians(73), 149.9
    time_s = np.arange(pulses) / prf_hz

    def one(seed):
        rng = np.random.default_rng(seed)
        phase, velocity_mps, *turns = rng.uniform(0, 6.28), rng.uniform(-15, 15), rng.random(), rng.random()
        wave = 2j * np.pi * 2 * 7.6e9 / 299_792_458
        angles = phase + 2 * np.pi * (turn_hz * time_s[:, None] + np.arange(5) / 5)
        tips = np.exp(wave * 0.1271 * np.cos(beta_rad) * np.cos(angles)).sum(axis=1)
        tips *= np.sqrt(10**2.26 / np.mean(np.abs(tips) ** 2)) * np.exp(2j * np.pi * turns[0])
        echo = (tips + 10 ** (46.1 / 20) * np.exp(2j * np.pi * turns[1])) * np.exp(-wave * velocity_mps * time_s)
        noise = rng.standard_normal(pulses) + 1j * rng.standard_normal(pulses)
        return (echo + noise / 2**0.5).astype(np.complex64)

    return lambda *seeds: (np.stack([one(seed) for seed in seeds]), {"carrier_hz": 7.6e9, "prf_hz": prf_hz})


def test_no_multiple_of_a_comb_is_told_beyond_what_is_sought(five_tips):
    """Once 6021 Hz, where up to 4 kHz and a fifth of the PRF are sought."""
    iq, radar = five_tips(7, 37)
    assert (measure(iq, **radar).chopping_hz < 12_792 / 5).all()


def test_blades_that_are_given_leave_no_fraction_of_their_comb(five_tips):
    """Found at half the spacing, it was told so where five blades were given, and right where they were not."""
    iq, radar = five_tips(*range(40))
    beta_rad = np.radians(73)
    found, open_ = measure(iq, **radar, blades=5, beta_rad=beta_rad), measure(iq, **radar, beta_rad=beta_rad)
    right, open_right = (np.abs(each.chopping_hz / 749.5 - 1) < 1e-3 for each in (found, open_))
    assert right.sum() >= max(open_right.sum() - 1, 28)
    np.testing.assert_allclose(found.rotation_hz[right], 149.9, rtol=1e-3)
    assert np.mean(np.abs(found.blade_length_m[right] / 0.1271 - 1) < 0.03) > 0.9


def test_weak_lines_that_are_not_there_are_no_unlike_blades(five_tips):
    """Of a comb found at half its spacing every second line is noise: two unlike blades were once told, for sure."""
    iq, radar = five_tips(*range(40))
    found = measure(iq, **radar, beta_rad=np.radians(73))
    right = np.abs(found.chopping_hz / 749.5 - 1) < 1e-3
    assert right.sum() >= 28
    assert np.isfinite(found.rotation_hz[right]).sum() <= 1


def test_strong_lines_that_do_not_divide_the_blades_are_no_comb_where_the_others_are_there():
    """Every third line of five blades that echo from one side mostly is strong: their comb was told at thrice that."""
    rng, radar, pulses, turn_hz = np.random.default_rng(2), {"carrier_hz": 24e9, "prf_hz": 50e3}, 2048, 83.399
    wave = 4j * np.pi * radar["carrier_hz"] / 299_792_458
    angle_rad = 5.7173 + 2 * np.pi * (np.arange(5) / 5 + turn_hz * np.arange(pulses)[:, None] / radar["prf_hz"])
    points_m = np.linspace(0.2, 1, 25)[:, None, None] * 0.25328
    blades = (1 + 0.3126 * np.cos(angle_rad)) * np.exp(-wave * points_m * np.sin(angle_rad)).mean(axis=0)
    echo = blades.sum(axis=1)
    noise = rng.standard_normal(pulses) + 1j * rng.standard_normal(pulses)
    iq = ((echo / np.std(echo) + 1) * 10 ** (29.7 / 20) + noise / 2**0.5).astype(np.complex64)
    assert measure(iq, **radar, blades=5).chopping_hz == pytest.approx(5 * turn_hz, rel=1e-4)
