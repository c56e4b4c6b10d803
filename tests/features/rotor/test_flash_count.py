"""Unlike blades of one strength have equal lines at every multiple of the rotation rate: their flashes tell it."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.comb_fit import CombFit
from bladewing.features.rotor.flash_count import flashes_in_period

from ..signals import RADAR
from .test_weak_lines import unlike


@pytest.mark.parametrize("phases_rad", [(0.0, 1.2), (0.0, 1.6), (0.0, 2.0), (0.0, 1.5, -1.5), (0.0, 1.2, -1.2, 2.4)])
@pytest.mark.parametrize("is_given", [True, False])
def test_blades_some_rad_apart_have_their_rotation_rate(phases_rad, is_given):
    """Of two half of it was told, and blades of twice the length, as certain."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        rate_hz, blades = rng.uniform(47, 95), len(phases_rad)
        iq = unlike(rng, rate_hz, phases_rad, snr_db=10.0 * (seed % 3), velocity_mps=rng.uniform(-20, 20))
        found = measure(iq, **RADAR, blades=blades if is_given else None)
        assert found.rotors_resolved
        assert found.rotation_hz == pytest.approx(rate_hz, rel=1e-3)
        assert found.chopping_hz == pytest.approx(blades * rate_hz, rel=1e-3)
        assert found.rotor_rates_hz[0] == pytest.approx(found.chopping_hz)
        assert found.blade_length_m == pytest.approx(0.15, rel=0.012)


def comb(amplitudes):
    """A comb of these at the orders from 1 on, and the same on the other side, as by the symmetry of J_n."""
    order = np.arange(1, len(amplitudes) + 1)
    orders = np.concatenate([-order[::-1], order])
    both = np.concatenate([(amplitudes * (-1.0) ** order)[::-1], amplitudes])
    return CombFit(0.003, 0.0, 1e-6, 1e-6, orders, both, np.full(len(orders), 100.0))


@pytest.mark.parametrize("strengths", [(1.0, 1.0), (1.0, 0.5), (1.0, 1.0, 1.0), (1.0, 0.6, 0.8, 0.7)])
def test_each_of_unlike_blades_flashes_once_in_a_turn(strengths):
    blade, order = np.arange(len(strengths)), np.arange(1, 61)
    turned = np.exp(-2j * np.pi * np.outer(order, blade) / len(strengths))
    lines = turned @ (np.array(strengths) * np.exp(1j * blade**2))
    assert flashes_in_period(comb(lines), range(2, 5), 60.0) == (len(strengths), True)
    assert flashes_in_period(comb(turned[:, 0]), range(2, 5), 60.0) == (1, True)  # like blades flash together


@pytest.mark.parametrize(
    ("lines_off", "told"), [(0.1, (2, True)), (0.5, (2, False)), (3.0, (1, True)), (12.0, (1, True))]
)
def test_two_rotors_of_one_rate_flash_anywhere(lines_off, told):
    order = np.arange(1, 61)
    lines = 1 + np.exp(2j * np.pi * order * (0.5 + lines_off / len(order))) * np.exp(1.3j)
    assert flashes_in_period(comb(lines), range(2, 5), 60.0) == told
