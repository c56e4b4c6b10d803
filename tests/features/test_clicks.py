"""Clicks that are filled in before a record is judged: found at any gain, and no flashes among them."""

import numpy as np
import pytest
from bladewing.features.clicks import LEAST_PULSES, clicks_filled
from bladewing.features.one_channel import one_channel
from bladewing.features.samples import largest_part

from .signals import white

PLACES = [40, 333, 1200]


def noise(seed: int, count: int = 2000) -> np.ndarray:
    """White noise of unit power as a recording holds it."""
    return white(np.random.default_rng(seed), count).astype(np.complex64)


def filled_in(iq: np.ndarray) -> np.ndarray:
    """Records with their clicks filled in."""
    return clicks_filled(iq, largest_part(iq))


@pytest.mark.parametrize("gain", [1.0, 1e-30, 1e35j])
@pytest.mark.parametrize("times", [10.0, 30.0, 100.0])
def test_a_pulse_that_interference_hit_is_filled_in(times: float, gain: complex) -> None:
    whole = noise(1) + 8 * np.exp(2j * np.pi * 0.03 * np.arange(2000)).astype(np.complex64)
    hit = np.stack([whole, whole, noise(2)])
    hit[1, PLACES] += np.float32(8 * times)
    given = (hit * np.complex64(gain)).astype(np.complex64)
    out = filled_in(given)
    np.testing.assert_array_equal(out[[0, 2]], given[[0, 2]])
    rest = np.delete(np.arange(2000), PLACES)
    np.testing.assert_array_equal(out[1, rest], given[1, rest])
    assert np.abs(out[1, PLACES] / gain - whole[PLACES]).max() < 4.0  # the line is there again
    np.testing.assert_array_equal(filled_in(given[1:2])[0], out[1])  # each as if it were alone


def test_noise_that_swells_and_falls_stays_as_it_is() -> None:
    """Where it is loud single samples stand high over all the record: of 100 such records 35 were changed."""
    swells = (1 + np.cos(2 * np.pi * 3 * np.arange(2000) / 2000)).astype(np.float32)
    given = np.stack([noise(seed) * swells for seed in range(100)])
    assert (filled_in(given) != given).any(axis=1).sum() <= 5
    given[0, 650] = 60  # where it is loudest, and so loud is no noise
    assert abs(filled_in(given[:1])[0, 650]) < 6


@pytest.mark.parametrize("turn", [1.0, 1j, 1 + 1j, 1 - 1j])
def test_one_channel_that_a_pulse_hit_stays_one(turn: complex) -> None:
    """What was filled in left rounding in the other, and both sides of the spectrum were believed."""
    hit = noise(1).real + 8 * np.cos(0.2 * np.arange(2000)).astype(np.float32)
    hit[PLACES] += 200
    given = (hit * np.complex64(turn)).astype(np.complex64)
    found = filled_in(given[None])
    assert np.abs(found).max() < 20
    assert one_channel(found) == [True]


def test_clicks_at_random_times_are_filled_in_and_flashes_are_not() -> None:
    rng = np.random.default_rng(3)
    random = noise(3)
    random[np.sort(rng.choice(2000, 20, replace=False))] += 60
    assert np.abs(filled_in(random[None])).max() < 6
    flashes = noise(4)
    flashes[7::100] += 60  # a pulse each, as of a rotor at a low PRF
    np.testing.assert_array_equal(filled_in(flashes[None])[0], flashes)
    wide = noise(5)
    wide[[100, 101, 900, 901]] += 60
    np.testing.assert_array_equal(filled_in(wide[None])[0], wide)


def test_of_few_pulses_and_of_nothing_but_a_click_none_is() -> None:
    short = noise(6, LEAST_PULSES - 1)
    short[50] += 60
    alone = np.zeros(2000, np.complex64)
    alone[50] = 1
    for whole in (short, alone, np.zeros(2000, np.complex64), np.ones(2000, np.complex64)):
        np.testing.assert_array_equal(filled_in(whole[None])[0], whole)
