"""Lost pulses: zeros where a receiver gives none."""

import numpy as np
import pytest
from bladewing.classify.dropouts import lost_pulses
from bladewing.classify.recording import Recording


def noise(rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    """White noise of unit power."""
    return (rng.standard_normal((count, 2)) @ [1, 1j] / np.sqrt(2)).astype(np.complex64)


@pytest.mark.parametrize("lost", [3, 40, 1000])
@pytest.mark.parametrize("line", [0.0, 30.0])
def test_zeros_among_samples_without_steps_are_lost_pulses(lost: int, line: float) -> None:
    rng = np.random.default_rng(lost)
    iq = noise(rng) + np.complex64(line)
    iq[rng.choice(len(iq), lost, replace=False)] = 0
    assert lost_pulses(iq) == lost
    assert lost_pulses(iq * np.complex64(1e-30j)) == lost  # of any gain and phase


@pytest.mark.parametrize("steps", [0.5, 1.0, 2.0, 3.0, 5.0])
@pytest.mark.parametrize("channels", [1, 2])
def test_zeros_that_a_converter_gives_of_weak_noise_are_none(steps: float, channels: int) -> None:
    given = noise(np.random.default_rng(1)) * np.float32(steps)
    iq = np.round(given.real) + 1j * np.round(given.imag) * (channels == 2)
    assert np.any(iq == 0)
    assert lost_pulses(iq.astype(np.complex64)) == 0


def test_zeros_among_the_steps_of_a_strong_line_are_lost_pulses() -> None:
    rng = np.random.default_rng(2)
    iq = np.round(100 * np.exp(0.3j * np.arange(4000)) + 3 * noise(rng)).real.astype(np.complex64) + 40j
    iq[::97] = 0
    assert lost_pulses(iq.astype(np.complex64)) == len(iq[::97])


def test_nothing_at_all_and_nothing_lost_are_no_dropouts() -> None:
    assert lost_pulses(np.zeros(100, np.complex64)) == 0
    assert lost_pulses(noise(np.random.default_rng(3))) == 0
    assert lost_pulses(np.zeros(0, np.complex64)) == 0


def test_a_silence_is_no_lost_pulses() -> None:
    iq = noise(np.random.default_rng(5))
    iq[1000:2000] = 0
    assert lost_pulses(iq) == 0
    iq[10:20] = 0
    assert lost_pulses(iq) == 10


def test_a_recording_tells_of_a_channel_that_is_missing() -> None:
    iq = noise(np.random.default_rng(6), 2000)
    for part, name in ((iq.real + 0j, "Q"), (1j * iq.imag, "I")):
        recording = Recording("walk", part.astype(np.complex64), 24e9, 1e4)
        (said,) = recording.remarks(0.1, recording.dwells(0.1))
        assert said.startswith(f"one channel: {name} is 0 in every pulse")
    assert not Recording("walk", iq, 24e9, 1e4).remarks(0.1, iq.reshape(2, -1))


def test_a_recording_tells_of_them_and_how_many() -> None:
    iq = noise(np.random.default_rng(4), 2000)
    iq[100:110] = 0
    recording = Recording("walk", iq, 24e9, 1e4)
    (said,) = recording.remarks(0.1, recording.dwells(0.1))
    assert said.startswith("lost: 10 of 2000 pulses are exactly 0")
