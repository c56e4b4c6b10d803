import numpy as np
import pytest
from bladewing.classify.measure_body import over_dwells


def test_of_a_steady_body_the_dwells_that_know_it_decide():
    rng = np.random.default_rng(0)
    std = np.where(np.arange(40) % 4 == 0, 0.01, 2.0)
    found, found_std = over_dwells(5.0 + std * rng.standard_normal(40), std)
    assert found == pytest.approx(5.0, abs=4 * found_std)
    assert found_std == pytest.approx(0.01 / np.sqrt(10), rel=0.3)


def test_one_dwell_is_taken_at_its_word():
    assert over_dwells(np.array([3.0]), np.array([0.1])) == (pytest.approx(3.0), pytest.approx(0.1))


@pytest.mark.parametrize("limbs", [0.0, 0.15])
def test_of_a_body_that_sways_the_middle_is_told_though_its_slow_end_is_known_best(limbs):
    # the weights of their variances told the slow end, by 4 to 10 deviations
    off = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        turns = rng.uniform() + 0.0713 * np.arange(37) * rng.uniform(0.8, 1.2)
        sway = 0.35 * np.sin(2 * np.pi * turns)
        std = np.where(sway < -0.2, 0.01, rng.uniform(0.1, 0.45, 37))
        value = 1.5 + sway + np.where((sway > 0) & (rng.uniform(size=37) < 2 * limbs), 2.0, 0.0)
        found, found_std = over_dwells(value, std)
        assert 0.03 < found_std < 0.2
        off.append((found - 1.5) / found_std)
    assert np.mean(np.abs(off) < 2) > 0.9
    assert np.sqrt(np.mean(np.square(off))) < 1.3
