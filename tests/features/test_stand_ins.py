"""What stands in for lost pulses besides 0: one value that comes again and again, or the pulse before."""

import numpy as np
import pytest
from bladewing.features.stand_ins import stand_ins

from .signals import white

LOST = np.array([5, 300, 301, 302, 900, 1500, 1990])


def noise(seed: int, count: int = 2000) -> np.ndarray:
    """White noise of unit power as a recording holds it."""
    return white(np.random.default_rng(seed), count).astype(np.complex64)


def spoilt(iq: np.ndarray, how: str) -> np.ndarray:
    """The same with some pulses lost, and what is left in their place."""
    out = iq.copy()
    if how == "held":
        for place in LOST:
            out[place] = out[place - 1]
        return out
    out[LOST] = 0
    return out - out.mean() if how == "mean removed" else out + np.complex64(0.3 - 0.1j)


@pytest.mark.parametrize("how", ["held", "mean removed", "offset"])
@pytest.mark.parametrize("line", [0.0, 10.0])
@pytest.mark.parametrize("gain", [1.0, 1e-30j, 2e37])
def test_pulses_that_hold_no_sample_of_their_own_are_found(how: str, line: float, gain: complex) -> None:
    turning = line * np.exp(2j * np.pi * 0.0123 * np.arange(2000))
    given = spoilt((noise(1) + turning).astype(np.complex64), how) * np.complex64(gain)
    np.testing.assert_array_equal(np.flatnonzero(stand_ins(given.astype(np.complex64))), LOST)


def test_those_of_a_fine_converter_are_found_too() -> None:
    counts = np.round(2000 * noise(2))
    for how in ("held", "offset"):
        given = spoilt(counts, how) if how == "held" else np.round(spoilt(counts, how) + np.complex64(7 - 3j))
        assert set(LOST) <= set(np.flatnonzero(stand_ins(given.astype(np.complex64))))


@pytest.mark.parametrize("step", [0.02, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("channels", [1, 2])
def test_of_a_coarse_converter_nothing_is_told(step: float, channels: int) -> None:
    for seed in range(20):
        slow = 3 * np.exp(2j * np.pi * 0.001 * np.arange(2000))  # nearly alike from pulse to pulse
        for given in (noise(seed), noise(seed) * 0.1 + slow, noise(seed) + np.float32(0.3)):
            steps = np.round(given.real / step) + 1j * np.round(given.imag / step) * (channels == 2)
            assert not stand_ins(steps.astype(np.complex64)).any()


def test_what_is_whole_holds_none() -> None:
    zeros = noise(3)
    zeros[LOST] = 0  # `dropouts` finds these
    ends = noise(4)
    clipped = np.clip(ends.real, -0.3, 0.3) + 1j * np.clip(ends.imag, -0.3, 0.3)
    tone = np.exp(2j * np.pi * np.arange(2000) / 8)
    for whole in (
        noise(5),
        zeros,
        clipped,
        tone,
        np.ones(2000),
        np.zeros(2000),
        noise(6).real,
        noise(7, 3),
        noise(8, 0),
    ):
        assert not stand_ins(np.asarray(whole, np.complex64)).any()


def test_more_than_a_quarter_is_no_loss() -> None:
    twice = np.repeat(noise(9), 2)  # what holds every pulse for two
    assert not stand_ins(twice).any()
