import numpy as np
import pytest
from bladewing.features.rotor.comb import find_comb
from bladewing.features.rotor.comb_fit import fit_combs, over_orders
from bladewing.features.rotor.periodogram import prepare

from ...benchmarks import records
from ..signals import RADAR, rotors


@pytest.mark.parametrize("seed", range(12))
def test_a_line_half_taken_out_with_the_static_background_is_no_stronger_than_its_neighbours(seed):
    # let go, it came out a thousand times as strong, and drew the rate half a deviation with it
    rng = np.random.default_rng(seed)
    shown = {"snr_db": 20, "body_db": 20, "velocity_mps": rng.uniform(-6, 6)}
    iq = records.record(rng, rng.uniform(50, 60, 1), **shown)
    comb, _ = find_comb(prepare(iq, **records.RADAR), None)
    assert comb.fit.snr.max() < 3 * np.median(comb.fit.snr)


def test_powers_are_averaged_over_the_orders_used_of_one_comb():
    comb, order = np.repeat([0, 1], 9), np.tile(np.arange(-4, 5), 2)
    used = np.abs(order) > 0
    used[order == 4] = False
    values = np.where(used, 10.0**comb, 1e6)
    smooth = over_orders(comb, order, used)(values)
    np.testing.assert_allclose(smooth, 10.0**comb)
    rising = over_orders(comb, order, used)(np.where(used, order, 1e6).astype(float))
    assert rising[0] == pytest.approx(np.mean([-4, -3, -2]))
    assert rising[4] == pytest.approx(0.0)


def test_a_comb_is_fitted_as_far_out_again_as_it_was() -> None:
    """Its margin is none of its reach: fitted to again and again, it would grow."""
    data = prepare(rotors([59.3]).astype(np.complex64), **RADAR)
    spacing, reach = 2 * 59.3 / RADAR["prf_hz"], (-20, 22)
    for _ in range(3):
        fitted = fit_combs(data, 0.0, [spacing], [reach])
        assert fitted is not None
        ((fit,), _) = fitted
        assert fit.reach == (-20, 22)
        reach = fit.reach
