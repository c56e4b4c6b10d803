"""Lost pulses: zeros where a receiver gives none."""

import numpy as np
import pytest
from bladewing.classify import Classifier, answer, load_recording
from bladewing.classify.dropouts import filled, longest_silence, lost_pulses
from bladewing.classify.recording import Recording

PULSES = np.arange(20000)


def noise(rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    """White noise of unit power."""
    return (rng.standard_normal((count, 2)) @ [1, 1j] / np.sqrt(2)).astype(np.complex64)


@pytest.mark.parametrize("lost", [3, 40, 1000])
@pytest.mark.parametrize("line", [0.0, 30.0])
def test_zeros_among_samples_without_steps_are_lost_pulses(lost: int, line: float) -> None:
    rng = np.random.default_rng(lost)
    iq = noise(rng) + np.complex64(line)
    iq[rng.choice(len(iq), lost, replace=False)] = 0
    assert lost_pulses(iq).sum() == lost
    assert lost_pulses(iq * np.complex64(1e-30j)).sum() == lost  # of any gain and phase


@pytest.mark.parametrize("steps", [0.5, 1.0, 2.0, 3.0, 5.0])
@pytest.mark.parametrize("channels", [1, 2])
def test_zeros_that_a_converter_gives_of_weak_noise_are_none(steps: float, channels: int) -> None:
    given = noise(np.random.default_rng(1)) * np.float32(steps)
    iq = np.round(given.real) + 1j * np.round(given.imag) * (channels == 2)
    assert np.any(iq == 0)
    assert not lost_pulses(iq.astype(np.complex64)).any()


@pytest.mark.parametrize("steps", [25, 100, 400, 1600])
@pytest.mark.parametrize("channels", [1, 2])
def test_a_few_zeros_of_a_fine_converter_are_none(steps: float, channels: int) -> None:
    called = 0
    for seed in range(100):
        given = noise(np.random.default_rng(seed)) * np.float32(steps)
        iq = np.round(given.real) + 1j * np.round(given.imag) * (channels == 2)
        called += bool(lost_pulses(iq.astype(np.complex64)).any())
    assert called == 0  # in one of ten thousand by chance


@pytest.mark.parametrize("sigma", [0.2, 0.3, 0.45, 0.6])
def test_nor_are_those_beside_something_strong_for_a_while(sigma: float) -> None:
    burst = np.where((PULSES > 8000) & (PULSES < 12000), 60 * np.sin(np.pi * (PULSES - 8000) / 4000), 0)
    given = burst * np.exp(0.0628j * PULSES) + sigma * np.sqrt(2) * noise(np.random.default_rng(12), len(PULSES))
    assert not lost_pulses((np.round(given.real) + 1j * np.round(given.imag)).astype(np.complex64)).any()


def test_zeros_among_the_steps_of_a_strong_line_are_lost_pulses() -> None:
    rng = np.random.default_rng(2)
    iq = np.round(100 * np.exp(0.3j * np.arange(4000)) + 3 * noise(rng)).real.astype(np.complex64) + 40j
    iq[::97] = 0
    assert np.flatnonzero(lost_pulses(iq.astype(np.complex64))).tolist() == list(range(0, len(iq), 97))


def test_nothing_at_all_and_nothing_lost_are_no_dropouts() -> None:
    assert not lost_pulses(np.zeros(100, np.complex64)).any()
    assert not lost_pulses(noise(np.random.default_rng(3))).any()
    assert not lost_pulses(np.zeros(0, np.complex64)).any()


@pytest.mark.parametrize("lost", [[700], [100, 1500], [40, 41]])
def test_one_lost_pulse_is_enough_where_samples_have_no_steps(lost: list[int]) -> None:
    """It stands 60 dB beside a strong line as noise that hides all blades."""
    pulse = np.arange(2000)
    iq = (1000 * np.exp(2j * np.pi * 0.003 * pulse) + noise(np.random.default_rng(2), 2000)).astype(np.complex64)
    iq[lost] = 0
    assert np.flatnonzero(lost_pulses(iq)).tolist() == lost
    assert not lost_pulses(np.round(iq).astype(np.complex64)).any()


@pytest.mark.parametrize("window", [np.bartlett, np.hanning, np.blackman])
def test_the_ends_of_a_window_are_no_lost_pulses(window) -> None:
    iq = noise(np.random.default_rng(2), 2000) * window(2000)
    assert not lost_pulses(iq.astype(np.complex64)).any()
    assert not lost_pulses((np.exp(0.3j * np.arange(2000)) - 1).astype(np.complex64)).any()


def test_one_lost_pulse_of_few_is_chance() -> None:
    rng = np.random.default_rng(1)
    few = np.rint(30 * rng.normal(size=(2000, 15))).astype(np.complex64)
    assert sum(lost_pulses(row).any() for row in few) == 0


def test_a_silence_is_no_lost_pulses() -> None:
    iq = noise(np.random.default_rng(5))
    iq[1000:2000] = 0
    assert not lost_pulses(iq).any()
    iq[10:20] = 0
    assert np.flatnonzero(lost_pulses(iq)).tolist() == list(range(10, 20))


def test_a_recording_tells_of_a_silence_that_cannot_be_filled_in() -> None:
    iq = noise(np.random.default_rng(5), 2000)
    iq[300:500] = iq[700:750] = 0
    assert longest_silence(iq) == (300, 200)
    recording = Recording("walk", iq, 24e9, 1e4)
    (said,) = recording.remarks(0.1, recording.dwells(0.1))
    assert said.startswith("silence: 200 pulses in a row are exactly 0 from 0.03 s on, too many to be filled in")
    coarse = np.round(0.25 * noise(np.random.default_rng(6), 20000).real).astype(np.complex64)
    for whole in (
        coarse,
        iq[:300],
        np.zeros(200, np.complex64),
        np.zeros(0, np.complex64),
        np.where(np.arange(300) < 32, 0, 1),
    ):
        assert longest_silence(whole)[1] == 0


def test_a_recording_tells_of_a_channel_that_is_missing() -> None:
    iq = noise(np.random.default_rng(6), 2000)
    for part, name in ((iq.real + 0j, "Q"), (1j * iq.imag, "I")):
        recording = Recording("walk", part.astype(np.complex64), 24e9, 1e4)
        (said,) = recording.remarks(0.1, recording.dwells(0.1))
        assert said.startswith(f"one channel: {name} is 0 in every pulse")
        (said,) = recording.remarks(0.1, recording.dwells(0.1), measured=True)
        assert said.endswith("neither tips nor the sign of a velocity can be believed: record I and Q")
    alike = Recording("walk", (iq.real * (1 - 1j)).astype(np.complex64), 24e9, 1e4)
    assert alike.remarks(0.1, alike.dwells(0.1))[0].startswith("one channel: I and Q are the same but for a sign")
    assert not Recording("walk", iq, 24e9, 1e4).remarks(0.1, iq.reshape(2, -1))


def test_a_recording_tells_of_them_and_how_many() -> None:
    iq = noise(np.random.default_rng(4), 2000)
    iq[100:110] = 0
    recording = Recording("walk", iq, 24e9, 1e4)
    (said,) = recording.remarks(0.1, recording.dwells(0.1))
    assert said.startswith("lost: 10 of 2000 pulses are exactly 0")


PATTERNS = {
    "each 97th": PULSES % 97 == 0,
    "each 7th": PULSES % 7 == 0,
    "a fifth at random": np.random.default_rng(7).random(len(PULSES)) < 0.2,
    "ten in a row": PULSES % 400 < 10,
    "at the ends": (PULSES < 20) | (len(PULSES) - 20 <= PULSES),
}


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("lines", [{0.003: 100.0}, {0.31: 1000.0}, {0.01: 100.0, -0.22: 30j}, {}])
def test_lost_pulses_are_filled_in_by_what_they_held(pattern: str, lines: dict[float, complex]) -> None:
    lost = PATTERNS[pattern]
    clear = sum((amplitude * np.exp(2j * np.pi * f * PULSES) for f, amplitude in lines.items()), np.zeros(len(PULSES)))
    whole = (clear + noise(np.random.default_rng(8), len(PULSES))).astype(np.complex64)
    given = np.where(lost, 0, whole)
    found = filled(given, lost_pulses(given))
    np.testing.assert_array_equal(found[~lost], whole[~lost])
    # of lines of up to 60 dB less is wrong than there is noise, and none of the noise is made up
    assert np.mean(np.abs(found - clear)[lost] ** 2) < 0.5


def test_too_many_lost_pulses_are_left_as_they_were() -> None:
    iq = np.where(PULSES % 2, noise(np.random.default_rng(9), len(PULSES)), 0)
    np.testing.assert_array_equal(filled(iq, lost_pulses(iq)), iq)
    few = np.array([1, 2j, 0, 0, 0, 3], np.complex64)
    np.testing.assert_array_equal(filled(few, few == 0), few)


def test_a_short_recording_and_one_without_noise_are_filled_in_too() -> None:
    for pulses in (64, 700):
        whole = np.exp(0.3j * np.arange(pulses)).astype(np.complex64)
        lost = np.arange(pulses) % 20 == 11
        found = filled(np.where(lost, 0, whole), lost)
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found, whole, atol=0.02)


def test_lost_pulses_of_a_recording_draw_no_rotor(tmp_path) -> None:
    """Of each 97th pulse that was lost, ground was once a UAV, surely, with a comb of 258 Hz."""
    whole = (100 + noise(np.random.default_rng(10), len(PULSES))).astype(np.complex64)
    whole[::97] = 0
    np.save(tmp_path / "ground.npy", whole)
    recording = load_recording(tmp_path / "ground.npy", carrier_hz=9.85e9, prf_hz=25e3)
    given = answer(recording, Classifier.load())
    assert given.track.label != "uav"
    assert not set(given.dwells.labels) & {"uav"}
    assert given.shown == {}
    (said,) = given.remarks
    assert said.startswith("lost: 207 of 20000 pulses were exactly 0")
    assert said.endswith("filled in from those beside them")


def test_of_a_recording_that_clips_no_comb_that_stays_is_counted(tmp_path) -> None:
    line = 100 * np.exp(2j * np.pi * 20 / 25e3 * PULSES) + noise(np.random.default_rng(11), len(PULSES))
    clipped = np.clip(line.real, -70, 70) + 1j * np.clip(line.imag, -70, 70)
    clipped[::97] = 0  # what is filled in must not hide it
    np.save(tmp_path / "clipped.npy", clipped.astype(np.complex64))
    given = answer(load_recording(tmp_path / "clipped.npy", carrier_hz=9.85e9, prf_hz=25e3), Classifier.load())
    assert "comb" not in given.shown  # of 80 Hz, four times the line's own
    assert set(given.dwells.labels) == {"unknown"}
    assert "no comb that stays is counted" in given.remarks[0]
    recording = load_recording(tmp_path / "clipped.npy", carrier_hz=9.85e9, prf_hz=25e3)
    assert "tips may come out too fast" in recording.remarks(0.08, recording.dwells(0.08), measured=True)[0]
