"""That two rotors pass for one shows in the phases and powers of few lines alone: their number must not be guessed."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.comb_fit import CombFit
from bladewing.features.rotor.like_lines import like_shares

from ..signals import rotors_by_chance, white

#: Eight lines to each side of the body.
CARRIER_HZ, PRF_HZ, PULSES = 3.3e9, 10e3, 1024
ORDERS, SPACING = np.concatenate([np.arange(-9, 0), np.arange(1, 10)]), 0.018


def four(seed, spread, snr_db, *, least_hz=0.0, points=None):
    """What is measured of four rotors whose chopping frequencies lie by chance within a share of 180 Hz."""
    rng, times_s = np.random.default_rng(seed), np.arange(PULSES) / PRF_HZ
    rates_hz = np.zeros(4)
    while np.diff(rates_hz).min() <= least_hz / 2:
        rates_hz = np.sort(90 * (1 + spread * rng.uniform(-0.5, 0.5, 4)))
    echo = rotors_by_chance(
        rng, rates_hz, times_s, wavelength_m=299_792_458.0 / CARRIER_HZ, length_m=0.12, points=points
    )
    iq = 10 ** (snr_db / 20) * (echo + 3) * np.exp(2j * np.pi * 110 * times_s) + white(rng, PULSES)
    return measure(iq, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)


def comb(*flashes, tilt=0.0):
    """Lines of rotors that one comb holds, of these phase steps and factors, in little noise."""
    shape = np.exp(-tilt * np.abs(ORDERS)) * (1 + 0.3j * np.cos(ORDERS))
    amplitudes = sum(factor * shape * np.exp(1j * step * ORDERS) for step, factor in flashes)
    return CombFit(SPACING, 0.0, 1e-6, 1e-6, ORDERS, amplitudes, np.full(len(ORDERS), 1e3))


@pytest.mark.parametrize("spread", [0.03, 0.08])
def test_few_lines_do_not_make_four_rotors_fewer(spread):
    found = [four(seed, spread, 0) for seed in range(24)]
    told = [int(m.rotor_count) for m in found if m.rotors_resolved]
    assert sum(count != 4 for count in told) <= 1 + len(told) // 20


@pytest.mark.parametrize("points", [None, 1, 4])
def test_rotors_far_enough_apart_are_told_by_few_lines(points):
    """Whatever their blades are: along their length, at the tips, or rows of points."""
    found = [four(seed, 0.08, 20, least_hz=1.8, points=points) for seed in range(12)]
    assert sum(bool(m.rotors_resolved) and m.rotor_count == 4 for m in found) >= 11


def test_like_lines_are_alike_whatever_the_blades_are_and_whenever_they_flash():
    fits = [comb((0.4, 1.0), tilt=0.2), comb((-2.1, 0.7j), tilt=0.2), comb((1.3, 1.1), tilt=0.2)]
    assert like_shares(fits, 9.5 * SPACING) == pytest.approx(np.ones(3), abs=0.02)


def test_two_rotors_of_one_comb_are_like_none():
    one, other, both = comb((0.4, 1.0)), comb((-2.1, 0.7j)), comb((1.3, 1.0), (2.4, 1.0))
    shares = like_shares([one, both, other], 9.5 * SPACING)
    assert shares[1] < 0.7
    assert shares[[0, 2]].min() > 0.95


def test_lines_past_the_edge_do_not_count():
    first, last = comb((0.4, 1.0)), comb((1.4, 1.0))
    first.amplitudes[np.abs(ORDERS) > 6] = 5.0
    assert like_shares([first, last], 6.2 * SPACING).min() > 0.95
