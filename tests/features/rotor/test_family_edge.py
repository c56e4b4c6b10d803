"""The edge of unresolved rotors: their lines' or that of all power about the orders."""

import numpy as np
from bladewing.features import measure
from bladewing.features.rotor.family_edge import surer_edge
from hypothesis import given
from hypothesis import strategies as st

from ..signals import RADAR, TIMES_S, WAVELENGTH_M, moving_at, rotors_by_chance, white

EDGES = st.floats(0.02, 0.48)
SHARES = st.floats(0.001, 0.9)


@given(EDGES, SHARES, EDGES, SHARES)
def test_the_edge_chosen_is_one_of_both(lines, lines_share, around, around_share):
    one, other = (lines, lines_share * lines), (around, around_share * around)
    edge, std = surer_edge(one, other)
    assert edge in (lines, around)
    assert std >= min(one[1], other[1])


def test_power_that_ends_within_sure_lines_is_not_the_family():
    sure = (0.2, 0.01)
    assert surer_edge(sure, (0.1, 0.01)) == sure
    # lines that are nothing, or known no better than this, do not outvote the power about the orders
    assert surer_edge((0.2, 0.06), (0.1, 0.01)) == (0.1, 0.01)
    assert surer_edge((0.2, np.inf), (0.1, 0.01)) == (0.1, 0.01)
    # power past the lines may be rotors' that were not found
    assert surer_edge((0.1, 0.01), (0.2, 0.01)) == (0.2, 0.01)


def test_outer_points_of_unresolved_rotors_count():
    """Lines of the outermost points spread over more orders: once 8 of 12 tips were surely too low."""
    told = low = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        rates_hz = rng.uniform(60, 90) * (1 + rng.uniform(-0.06, 0.06, 4))
        echo = rotors_by_chance(rng, rates_hz, TIMES_S, wavelength_m=WAVELENGTH_M, length_m=0.15, points=6)
        iq = (0.6 * echo + 3) * moving_at(rng.uniform(-10, 10)) + white(rng, len(TIMES_S))
        found = measure(iq.astype(np.complex64), **RADAR)
        tip_mps = 2 * np.pi * 0.15 * rates_hz.max()
        told += bool(np.isfinite(found.tip_speed_mps))
        low += bool(found.tip_speed_mps < 0.9 * tip_mps - 4 * found.tip_speed_mps_std)
    assert told >= 10
    assert low <= 1
