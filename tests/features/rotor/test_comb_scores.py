"""Sums of evidence along combs: against plain loops, and the quick scores against the full ones."""

import numpy as np
import pytest
from bladewing.features.evidence import MOST_SNRS, Evidence
from bladewing.features.rotor.comb_scores import even_scores, heights, running_sums, score


@pytest.mark.parametrize("combs", [1, 40, 900])
def test_running_sums_are_those_of_a_loop(combs):
    rng = np.random.default_rng(combs)
    bins, reach = 2000, 900.0
    evidence = rng.standard_normal((3, bins)).astype(np.float32)
    steps = np.sort(rng.uniform(7, 120, (1, combs)))
    starts = rng.uniform(5, 90, (1, combs))
    blocks = list(running_sums(Evidence(evidence), starts, steps, reach))
    for comb in {0, combs // 2, combs - 1}:
        order = np.arange(1, int(reach / steps[0, comb]) + 1)
        places = np.floor(starts[0, comb] + order * steps[0, comb] + 0.5).astype(int)
        own = np.concatenate([block[:, 0, comb] for block in blocks if comb < block.shape[2]])
        np.testing.assert_allclose(own[: len(order), :3], evidence[:, places].cumsum(axis=1).T, atol=1e-3)
        # nothing is added past the last line, nor for a line SNR that is not there
        np.testing.assert_array_equal(own[len(order) :], own[[len(order) - 1]].repeat(len(own) - len(order), axis=0))
        assert own.shape[1] == MOST_SNRS
        assert not own[:, 3:].any()


def test_heights_are_the_scores():
    rng = np.random.default_rng(5)
    evidence = (rng.standard_normal((3, 4001)) - 0.2).astype(np.float32)
    spacings = np.exp(rng.uniform(np.log(0.004), np.log(0.2), 300))
    centres = rng.uniform(-0.7, 0.7, 300)
    expected, low, high = score(Evidence(evidence), spacings, centres)
    np.testing.assert_allclose(heights(Evidence(evidence), spacings, centres), expected, atol=1e-3)
    assert np.any(-low != high)  # some of them reach unequally far
    assert len(heights(Evidence(evidence), spacings[:0], centres[:0])) == 0


def test_even_scores_are_those_of_a_loop():
    rng = np.random.default_rng(6)
    size = 4001
    evidence = (rng.standard_normal((3, size)) - 0.2).astype(np.float32)
    spacings, centres = np.sort(rng.uniform(0.004, 0.2, 200)), rng.uniform(-0.7, 0.7, 200)
    scores, reach = even_scores(Evidence(evidence), spacings, centres)
    for number in range(0, 200, 7):
        order = np.arange(1, int(0.5 / spacings[number]) + 1)
        sides = [np.rint((centres[number] + sign * spacings[number] * order) * size) for sign in (-1, 1)]
        sums = sum(evidence[:, side.astype(int) % size] for side in sides).cumsum(axis=1)
        assert scores[number] == pytest.approx(max(sums.max(), 0), abs=1e-3)
        if scores[number] > 1:
            assert reach[number] == np.unravel_index(sums.argmax(), sums.shape)[1] + 1
