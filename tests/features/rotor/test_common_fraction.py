"""Over a long dwell the chopping frequency is one rotor's, not a common fraction of several rotors' rates."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.comb_search import best_candidate
from bladewing.features.rotor.common_fraction import of_one_rotor
from bladewing.features.rotor.periodogram import prepare

from ..signals import CARRIER_HZ, PULSES, RADAR, TIMES_S, WAVELENGTH_M, moving_at, rotors_by_chance, white

PRF_HZ = 20e3


def quad(seed):
    """A quadcopter in a manoeuvre, over 0.25 to 0.5 s: its record, and the chopping frequencies [Hz]."""
    rng = np.random.default_rng(seed)
    while np.diff(rates_hz := np.sort(rng.uniform(60, 80, 4))).min() < 0.7:
        pass
    times_s = np.arange(int(PRF_HZ * rng.uniform(0.25, 0.5))) / PRF_HZ
    iq = 10 * rotors_by_chance(rng, rates_hz, times_s, wavelength_m=WAVELENGTH_M, length_m=0.12) + 30
    iq = iq * moving_at(5.0, times_s) + white(rng, len(times_s))
    return iq.astype(np.complex64), 2 * rates_hz


@pytest.mark.parametrize("seed", [37, 44, 63])
def test_the_rotors_of_a_long_dwell_are_told_apart(seed):
    # they passed for some of a fifth or a sixth of their rates
    iq, rates_hz = quad(seed)
    found = measure(iq, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    assert found.rotors_resolved
    np.testing.assert_allclose(found.rotor_rates_hz[:4], rates_hz, rtol=1e-3)
    assert np.isnan(found.gear_ratio)


def racer(seed):
    """Four small fast rotors of unlike rates: a record, and the chopping frequencies [Hz]."""
    rng = np.random.default_rng(seed)
    middle_hz = rng.uniform(450, 560)
    while np.diff(rates_hz := np.sort(middle_hz * (1 + rng.uniform(-0.06, 0.06, 4)))).min() < 4:
        pass
    iq = 10 * rotors_by_chance(rng, rates_hz, TIMES_S, wavelength_m=WAVELENGTH_M, length_m=0.04) + 30
    iq = iq * moving_at(rng.uniform(-20, 20)) + white(rng, PULSES)
    return iq.astype(np.complex64), 2 * rates_hz


@pytest.mark.parametrize("seed", [15, 54])
def test_lines_of_unlike_rotors_make_no_finer_comb(seed):
    # a comb of a fraction, no whole one, of their rates meets the lines of several by chance
    iq, rates_hz = racer(seed)
    data = prepare(iq, **RADAR)
    start = best_candidate(data)
    assert start.spacing * data.prf_hz < 0.6 * rates_hz[0]
    one = of_one_rotor(data, start).spacing * data.prf_hz
    assert np.abs(rates_hz / one - 1).min() < 2e-3
    found = measure(iq, **RADAR)
    np.testing.assert_allclose(found.rotor_rates_hz[:4], rates_hz, rtol=1e-3)
    assert found.chopping_hz == pytest.approx(rates_hz.mean(), rel=1e-3)


def test_a_comb_of_which_all_lines_are_there_is_kept():
    rng = np.random.default_rng(3)
    times_s = np.arange(6000) / PRF_HZ
    iq = 10 * rotors_by_chance(rng, [61.3], times_s, wavelength_m=WAVELENGTH_M, length_m=0.12) + 30
    data = prepare((iq + white(rng, len(times_s))).astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    start = best_candidate(data)
    assert of_one_rotor(data, start) is start


@pytest.mark.parametrize("snr_db", [-16, -13, -10])
def test_near_the_noise_the_comb_found_is_kept(snr_db):
    # of any comb many lines are missing there, and the best of thousands of others has more by chance
    rng = np.random.default_rng(4)
    for rate_hz in rng.uniform(40, 110, 8):
        iq = 10 ** (snr_db / 20) * rotors_by_chance(rng, [rate_hz], TIMES_S, wavelength_m=WAVELENGTH_M, length_m=0.15)
        data = prepare((iq + 10 + white(rng, PULSES)).astype(np.complex64), **RADAR)
        start = best_candidate(data)
        assert of_one_rotor(data, start) is start
