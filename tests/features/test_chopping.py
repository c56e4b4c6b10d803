"""The cepstral start of the chopping estimate, piece by piece."""

import numpy as np
import pytest
from bladewing.features.chopping import prominence, surroundings


@pytest.mark.parametrize("count", [5, 64, 1025, 4096, 4097, 32_769])
def test_prominence_is_that_of_plain_sums(count):
    """Whatever the length: long sums are taken in several products."""
    heights = np.random.default_rng(count).rayleigh(size=(2, count)).astype(np.float32)
    before = np.concatenate([np.zeros((2, 1)), np.cumsum(heights, axis=1, dtype=np.float64)], axis=1)
    (first, stop), shares = surroundings(count)
    around = ((before[:, stop] - before[:, first]) * shares).max(axis=1)
    plain = np.maximum(heights - around + before[:, -1:] / count, 0)
    plain[:, :2] = 0
    # a sum is rounded by some units in the last place of the sum of all, and so is a mean of few, which differs by them
    atol = 40 * 2.0**-24 * before[:, -1:] * shares.max(axis=0) + 1e-6
    assert (np.abs(prominence(heights) - plain) <= atol).all()
