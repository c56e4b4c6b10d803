"""Rotors whose lines fill the span: what is left of those not found is no noise, and they are not said to be all."""

from dataclasses import replace

import numpy as np
from bladewing.features import measure
from bladewing.features.rotor.left_flashes import others_flash
from bladewing.features.rotor.periodogram import prepare

from ..signals import CARRIER_HZ, PRF_HZ, PULSES, WAVELENGTH_M, folded, moving_at, rotors, rotors_by_chance, white


def test_what_is_left_of_a_rotor_is_none_and_that_of_others_is():
    rng = np.random.default_rng(0)
    found, others = rotors([57.3], body=0.0), rotors([55.1, 56.4, 59.2], body=0.0)
    noise = white(rng, PULSES)
    data = prepare((found + noise).astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)

    def said(rest, edge=0.49):
        return others_flash(replace(data, samples=found + rest), rest, [2 * 57.3 / PRF_HZ], edge)

    assert said(noise + others)
    assert said(noise + others, edge=0.35)  # those of a rotor a quarter faster would fill it
    assert not said(noise + others, edge=0.3)  # past the lines' edge what is there tells the noise
    assert not said(noise)
    assert not said(noise + 0.7 * found)  # weak lines are not fitted to the end
    assert not said(0.2 * (noise + others))  # as are strong ones


def test_rotors_that_fill_the_span_are_not_all_where_most_of_the_power_is_left():
    """Three were said to be all of four, and their mean known to a third of what it was off by."""
    right = 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        rates_hz = rng.uniform(75, 110) * (1 + 0.05 * np.sort(rng.uniform(-1, 1, 4)))
        prf_hz = 2 * rates_hz.mean() * 60 * rng.uniform(0.95, 1.05)
        times_s = np.arange(360) / prf_hz
        echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=WAVELENGTH_M, length_m=0.15)
        iq = 6.3 * (echo + 5) * moving_at(rng.uniform(-10, 10), times_s)
        found = measure((iq + white(rng, 360)).astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
        assert not (found.rotor_count < 4 and found.rotors_resolved)
        off_hz = abs(found.chopping_hz - 2 * rates_hz.mean())
        right += bool(off_hz < 2 * found.chopping_hz_std < 0.08 * found.chopping_hz)
    assert right >= 12


def test_a_weak_rotor_that_fills_the_span_is_not_said_to_be_all_of_them():
    """Nothing past its lines told the noise, so that nothing was said to be left: 10 of these 16 were one rotor."""
    told = []
    for seed in range(16):
        iq, radar, _, _ = folded(seed, 1.1, count=2, spread=0.03, snr_db=-10.0)
        told.append(measure(iq, **radar))
    assert sum(found.rotor_count > 0 for found in told) >= 12
    assert not any(found.rotors_resolved and found.rotor_count < 2 for found in told)
