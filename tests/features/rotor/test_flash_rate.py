"""Folded lines of a comb that are those of a fraction of its spacing too: the flashes tell which of both it is."""

from fractions import Fraction

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.comb_search import Candidate
from bladewing.features.rotor.flash_rate import of_flashes
from bladewing.features.rotor.periodogram import prepare
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS

from ..signals import CARRIER_HZ, PRF_HZ, WAVELENGTH_M, moving_at, rotors, rotors_by_chance, white


def come_round(seed, turns, *, dwell_s=0.1, blade_m=0.09):
    """A rotor of so many chopping frequencies to the PRF, tips two to four times the unambiguous velocity."""
    rng = np.random.default_rng(seed)
    rate_hz = rng.uniform(75, 110)
    prf_hz = 2 * rate_hz * float(turns) * (1 + rng.uniform(-1, 1) * 2e-4)
    times_s = np.arange(int(dwell_s * prf_hz)) / prf_hz
    echo = rotors_by_chance(rng, [rate_hz], times_s, wavelength_m=WAVELENGTH_M, length_m=blade_m)
    iq = (echo + 5) * moving_at(rng.uniform(-10, 10), times_s)
    iq = iq + 0.16 * white(rng, len(times_s))
    return iq.astype(np.complex64), {"carrier_hz": CARRIER_HZ, "prf_hz": prf_hz}, 2 * rate_hz


@pytest.mark.parametrize(
    ("turns", "blade_m"),
    [
        (Fraction(61, 3), 0.09),
        (Fraction(67, 3), 0.09),
        (Fraction(77, 4), 0.09),
        (Fraction(81, 4), 0.09),
        (Fraction(269, 5), 0.15),
    ],
)
def test_the_chopping_frequency_is_not_a_fraction_whose_lines_are_the_same(turns, blade_m):
    for seed in range(6):
        iq, radar, chopping_hz = come_round(seed, turns, blade_m=blade_m)
        found = measure(iq, **radar)
        assert not found.reason
        assert found.chopping_hz == pytest.approx(chopping_hz, rel=1e-3)
        assert np.isnan(found.rotation_hz)  # lines that come back between the others tell of no unlike blades


def test_in_short_dwells_lines_that_come_back_are_none_of_a_finer_comb():
    """They lay halfway between the others, and the dwell was said to be too short."""
    right = 0
    for seed in range(12):
        iq, radar, chopping_hz = come_round(seed, Fraction(107, 2), dwell_s=0.028, blade_m=0.15)
        right += abs(measure(iq, **radar).chopping_hz / chopping_hz - 1) < 0.01
    assert right >= 6  # it was 2


def test_a_comb_that_ends_within_the_span_or_does_not_come_round_is_left_as_it_is():
    iq = rotors([57.3]) + 0.1 * white(np.random.default_rng(0), 3000)
    data = prepare(iq.astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    for spacing, order in ((1 / 150, 40), (1 / 150.5, 70)):
        found = Candidate(spacing, 0.0, -order, order, 100.0)
        assert of_flashes(data, found) is found


@pytest.mark.parametrize("seed", [10, 58, 103, 170, 188])
def test_flashes_of_several_rotors_take_no_comb_that_lacks_the_lines(seed):
    # flashes of four rotors at times of chance passed for those of three to five times their chopping frequency
    rng = np.random.default_rng(seed)
    carrier_hz, prf_hz, wavelength_m = 5.8e9, 5e3, SPEED_OF_LIGHT_MPS / 5.8e9
    around = rng.integers(20, 70) + rng.uniform(-0.05, 0.05)  # spacings in the span
    rates_hz = prf_hz / around / 2 * (1 + rng.uniform(-0.004, 0.004, 4))
    tip_mps = rng.uniform(0.9, 1.1) * wavelength_m * prf_hz / 4
    times_s = np.arange(512) / prf_hz
    length_m = tip_mps / (2 * np.pi * rates_hz.max())
    echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=wavelength_m, length_m=length_m) + 2
    iq = echo * moving_at(rng.uniform(-20, 20), times_s, wavelength_m) + 0.3 * white(rng, 512)
    found = measure(iq.astype(np.complex64), carrier_hz=carrier_hz, prf_hz=prf_hz)
    assert found.chopping_hz == pytest.approx(2 * rates_hz.mean(), rel=0.01)
