"""Clipping: told where values pile up at the largest, never of noise, lines, constants or coarse steps."""

import numpy as np
import pytest
from bladewing.classify.clipping import clipped_values
from hypothesis import given, settings
from hypothesis import strategies as st

SEEDS = st.integers(0, 10_000)


def _noise(seed, pulses=2000):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((pulses, 2)).view(np.complex128)[:, 0]


def _line(seed, pulses=2000):
    rng = np.random.default_rng(seed)
    return np.exp(2j * np.pi * (rng.uniform(-0.5, 0.5) * np.arange(pulses) + rng.random()))


def _clipped(iq, largest, offset=0.0):
    """Each side of each channel cut where it exceeds the largest, an offset taken out afterwards."""
    return (iq.real.clip(-largest, largest) + 1j * iq.imag.clip(-largest, largest) - offset).astype(np.complex64)


def _quantised(iq, steps):
    """As a converter gives it whose full scale is just the largest value, with so many steps up to that."""
    step = max(np.abs(iq.real).max(), np.abs(iq.imag).max()) / steps
    return (np.rint(iq.real / step) + 1j * np.rint(iq.imag / step)).astype(np.complex64)


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.floats(0.3, 1.7), st.floats(-0.3, 0.3), st.sampled_from([1e-30, 1.0, 1e30]))
def test_what_is_cut_is_counted_whatever_the_gain_and_the_offset(seed, largest, share, gain):
    # of a side that an offset leaves too short the few values lie as far apart as coarse steps would
    iq = _noise(seed)
    found = clipped_values(_clipped(iq, largest, share * largest * (1 + 0.5j)) * np.float32(gain))
    sides = np.stack([side for part in (iq.real, iq.imag) for side in (part, -part)])
    # one may stand by chance as near to the largest as rounding, which counts with it
    assert (sides >= largest).sum() <= found <= (sides >= largest * (1 - 2e-6)).sum()


@settings(max_examples=100, deadline=None)
@given(SEEDS, st.integers(64, 5000), st.floats(0, 30), st.sampled_from([None, 50, 100, 127, 2047]))
def test_noise_and_lines_that_fit_are_not_called_clipped(seed, pulses, line_db, steps):
    iq = 10 ** (line_db / 20) * _line(seed, pulses) + _noise(seed, pulses)
    assert clipped_values(iq.astype(np.complex64) if steps is None else _quantised(iq, steps)) == 0


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.sampled_from([None, 60, 127, 511, 2047]))
def test_a_line_alone_turns_at_its_largest_without_clipping(seed, steps):
    iq = _line(seed)
    if steps is not None:  # some noise keeps what comes round nearly to where it was from the same few values
        iq = iq + 0.5 / steps * _noise(seed)
    assert clipped_values(iq.astype(np.complex64) if steps is None else _quantised(iq, steps)) == 0


@pytest.mark.parametrize("steps", [1, 2, 3, 7, 15, 31])
def test_coarse_steps_say_nothing(steps):
    for seed in range(20):
        assert clipped_values(_quantised(_line(seed) + 0.3 * _noise(seed), steps)) == 0


@pytest.mark.parametrize(
    "iq",
    [
        np.zeros(1000),
        np.full(1000, 3 - 4j),
        np.where(np.arange(1000) % 2, 1, -1),
        np.where(np.arange(1000) % 4 == 0, 2, 0),
        np.ones(1),
        np.zeros(0),
    ],
    ids=["silence", "constant", "square", "pulses", "one", "none"],
)
def test_what_has_one_value_alone_is_not_clipped(iq):
    assert clipped_values(iq.astype(np.complex64)) == 0


@pytest.mark.parametrize("period", [*range(5, 13), 16, 20, 24, 30])
def test_a_line_that_comes_round_to_the_same_few_values_is_not_clipped(period):
    turns = np.arange(20 * period) / period
    assert clipped_values(np.exp(2j * np.pi * turns).astype(np.complex64)) == 0
    blades = 0.1 * np.exp(6j * np.sin(2 * np.pi * turns / 2))
    assert clipped_values((np.exp(2j * np.pi * turns) + blades).astype(np.complex64)) == 0


@pytest.mark.parametrize("times", [2, 5, 20])
def test_what_is_played_again_and_again_is_not_clipped(times):
    for seed in range(40):
        once = (2 * _line(seed, 200) + _noise(seed, 200)).astype(np.complex64)
        once[17] *= 1.5  # stands alone at the top
        assert clipped_values(np.tile(once, times)) == 0
