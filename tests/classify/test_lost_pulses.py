"""What a recording tells of pulses that were lost, of channels that are missing, and of none of which a rotor comes."""

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier, answer, load_recording
from bladewing.classify.predict import long_look
from bladewing.classify.recording import Recording
from bladewing.features import measure
from bladewing.features.dropouts import BEYOND_FILLING_IN, longest_silence
from bladewing.simulate import Scene

from ..features.signals import white

PULSES = np.arange(20000)


def noise(rng: np.random.Generator, count: int) -> np.ndarray:
    """White noise of unit power as a recording holds it."""
    return white(rng, count).astype(np.complex64)


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
    stuck = Recording("walk", iq.real + np.complex64(12j), 24e9, 1e4)
    assert stuck.remarks(0.1, stuck.dwells(0.1))[0].startswith("one channel: Q is 12 in every pulse")
    alike = Recording("walk", (iq.real * (1 - 1j)).astype(np.complex64), 24e9, 1e4)
    assert alike.remarks(0.1, alike.dwells(0.1))[0].startswith("one channel: I and Q are the same but for a sign")
    assert not Recording("walk", iq, 24e9, 1e4).remarks(0.1, iq.reshape(2, -1))


def test_a_recording_tells_of_them_and_how_many() -> None:
    iq = noise(np.random.default_rng(4), 2000)
    iq[100:110] = 0
    recording = Recording("walk", iq, 24e9, 1e4)
    (said,) = recording.remarks(0.1, recording.dwells(0.1))
    assert said.startswith("lost: 10 of 2000 pulses were exactly 0")
    assert recording.filled_in == 10
    assert np.all(recording.iq[100:110] != 0)
    np.testing.assert_array_equal(np.delete(recording.iq, range(100, 110)), np.delete(iq, range(100, 110)))


def test_pulses_that_are_too_many_to_be_filled_in_are_not_said_to_be() -> None:
    iq = noise(np.random.default_rng(4), 2000)
    iq[::2] = 0
    recording = Recording("walk", iq, 24e9, 1e4)
    np.testing.assert_array_equal(recording.iq, iq)
    assert recording.filled_in == 0
    (said,) = recording.remarks(0.2, recording.dwells(0.2))
    assert said.startswith("lost: 1000 of 2000 pulses are exactly 0")


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


@pytest.mark.parametrize("how", ["mean removed", "held"])
def test_nor_do_those_that_are_not_0(how: str) -> None:
    """A sliding spot whose every 97th pulse was lost was a UAV, its mean taken out or its pulses held."""
    turning = 30 * np.exp(2j * np.pi * 0.0631 * PULSES)
    whole = (turning + noise(np.random.default_rng(10), len(PULSES))).astype(np.complex64)
    lost = np.arange(97, len(PULSES), 97)
    spoilt = whole.copy()
    if how == "held":
        spoilt[lost] = spoilt[lost - 1]
    else:
        spoilt[lost] = 0
        spoilt -= spoilt.mean()
    recording = Recording("spot", spoilt, 9.85e9, 25e3)
    assert recording.filled_in == len(lost)
    np.testing.assert_allclose(recording.iq[lost] - (spoilt - whole)[0], whole[lost], atol=6)  # the line, not the noise
    given = answer(recording, Classifier.load())
    assert not set(given.dwells.labels) & {"uav"}
    assert given.shown == {}
    (said,) = given.remarks
    assert said.startswith("lost: 206 of 20000 pulses were exactly 0, one value again and again or the pulse before")


def gull() -> np.ndarray:
    """Four seconds of a gull that flaps and heaves, 6 kHz at 9.85 GHz."""
    bird = {"name": "gull", "species": "herring_gull", "velocity_mps": -8.0, "heave_m": 0.02}
    return Scene.build({"radar": {"carrier_hz": 9.85e9, "prf_hz": 6e3, "pulses": 24000}, "bird": [bird]}).render(1).iq


def test_a_recording_made_of_samples_is_filled_in_as_one_that_is_read(tmp_path) -> None:
    """Of a gull whose every 40th pulse was lost, a comb that stays was once counted, and no wingbeat."""
    spoilt = gull().copy()
    spoilt[11::40] = 0
    np.save(tmp_path / "gull.npy", spoilt)
    radar = {"carrier_hz": 9.85e9, "prf_hz": 6e3}
    recordings = Recording("gull", spoilt, **radar), load_recording(tmp_path / "gull.npy", **radar)
    given, read = (answer(recording, Classifier.load("fast")) for recording in recordings)
    assert given.shown == read.shown
    assert "comb" not in given.shown
    assert given.shown["wings"] == pytest.approx(3.69, abs=0.1)
    np.testing.assert_array_equal(given.dwells.probabilities, read.dwells.probabilities)


def test_of_one_channel_a_wingbeat_is_found_too() -> None:
    both = gull()
    assert "wings" in long_look(both, 9.85e9, 6e3)
    assert "wings" in long_look(both.real.astype(np.complex64), 9.85e9, 6e3)


def test_nor_do_those_of_records_from_python() -> None:
    whole = (100 + noise(np.random.default_rng(10), len(PULSES))).astype(np.complex64).reshape(10, 2000)
    spoilt = whole.copy()
    spoilt[:, ::97] = 0
    given, clear = (Classifier.load().predict(iq, carrier_hz=9.85e9, prf_hz=25e3) for iq in (spoilt, whole))
    turned = given.labels != clear.labels
    assert turned.sum() <= 1  # one of the ten lies within what the filling changes of a threshold
    # to or from no answer: no record that is named is named another
    assert np.all((given.labels[turned] == "unknown") | (clear.labels[turned] == "unknown"))
    assert "uav" not in given.labels[turned]
    # one sample in a hundred is another: what a record turns by depends on the model, but all hold no rotor
    away = np.abs(given.probabilities - clear.probabilities)
    assert away.max() < 0.1
    assert away.mean() < 0.02


def test_of_a_recording_that_clips_no_comb_that_stays_is_counted(tmp_path) -> None:
    line = 100 * np.exp(2j * np.pi * 20 / 25e3 * PULSES) + noise(np.random.default_rng(11), len(PULSES))
    clipped = np.clip(line.real, -70, 70) + 1j * np.clip(line.imag, -70, 70)
    clipped[::97] = 0  # what is filled in must not hide it
    np.save(tmp_path / "clipped.npy", clipped.astype(np.complex64))
    recording = load_recording(tmp_path / "clipped.npy", carrier_hz=9.85e9, prf_hz=25e3)
    given = answer(recording, Classifier.load())
    # four times the line's own: it is there, and does not count
    assert long_look(recording.iq, 9.85e9, 25e3)["comb"] == pytest.approx(80, rel=0.01)
    assert "comb" not in given.shown
    assert set(given.dwells.labels) <= {"unknown", "clutter"}
    assert "may pass for a rotor, and no comb that stays is counted" in given.remarks[0]
    assert "tips may come out too fast" in recording.remarks(0.08, recording.dwells(0.08), measured=True)[0]


def test_a_record_that_a_silence_breaks_is_judged_by_its_longest_stretch() -> None:
    """Blanked at a steady rate, ground was once a UAV, surely, with a comb that stays."""
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3}
    ground = (10 + noise(np.random.default_rng(11), len(PULSES))).astype(np.complex64)
    ground[PULSES % 400 < 60] = 0
    records, classifier = ground.reshape(10, 2000), Classifier.load()
    given, alone = classifier.predict(records, **radar), classifier.predict(records[:, 60:400], **radar)
    np.testing.assert_array_equal(given.probabilities, alone.probabilities)
    assert list(given.labels) == list(alone.labels)
    assert list(given.reasons) == list(alone.reasons)
    assert given.noise.tolist() == alone.noise.tolist()
    track = answer(Recording("ground", ground, **radar), classifier)
    assert track.track.label != "uav"
    assert track.shown == {}
    assert "of a dwell that they break its longest stretch is judged" in track.remarks[0]


def test_a_stretch_that_holds_no_decision_is_unknown_with_the_reason() -> None:
    records = 10 + noise(np.random.default_rng(12), 3 * 2000).reshape(3, 2000)
    records[1, 50:] = 0
    records[2, PULSES[:2000] % 400 < 300] = 0
    given = Classifier.load().predict(records, carrier_hz=9.85e9, prf_hz=25e3)
    clear = Classifier.load().predict(records[:1], carrier_hz=9.85e9, prf_hz=25e3)
    assert (given.labels[0], given.reasons[0]) == (clear.labels[0], clear.reasons[0])
    assert given.labels[1:].tolist() == ["unknown"] * 2
    for number, pulses in ((1, 50), (2, 100)):
        start = f"silence: no more than {pulses} pulses in a row are not 0: "
        assert given.reasons[number].startswith(start)
        assert given.reasons[number].endswith(", 0.005 s, or more (dwell = pulses / PRF)")
        np.testing.assert_allclose(given.probabilities[number], 1 / 3)


def test_records_of_a_batch_are_broken_each_in_its_way() -> None:
    records = (10 + noise(np.random.default_rng(13), 12 * 1000).reshape(3, 4, 1000)).astype(np.complex64)
    stretches = [slice(0, 700), slice(0, 700), slice(300, 1000), slice(None)]
    for cell, stretch in enumerate(stretches):
        kept = np.zeros(1000, bool)
        kept[stretch] = True
        records[:, cell, ~kept] = 0
    radar, classifier = {"carrier_hz": 9.85e9, "prf_hz": 25e3}, Classifier.load()
    given = classifier.predict(records, **radar)
    for cell, stretch in enumerate(stretches):
        alone = classifier.predict(records[:, cell, stretch], **radar)
        np.testing.assert_array_equal(given.probabilities[:, cell], alone.probabilities)
        assert given.labels[:, cell].tolist() == alone.labels.tolist()
        assert given.reasons[:, cell].tolist() == alone.reasons.tolist()


def test_what_lost_more_pulses_than_can_be_filled_in_is_unknown() -> None:
    """One pulse in ten of a bird that glides was a UAV in a third of the records."""
    iq = (30 * np.exp(0.3j * np.arange(1600)) + noise(np.random.default_rng(8), 1600)).astype(np.complex64)
    few = np.where(np.arange(1600) % 10 == 0, iq, 0)
    answers = Classifier.load().predict(np.stack([iq, few]), carrier_hz=10e9, prf_hz=20e3)
    assert not answers.reasons[0].startswith("lost")
    assert (answers.labels[1], answers.reasons[1]) == ("unknown", BEYOND_FILLING_IN)
    np.testing.assert_allclose(answers.probabilities[1], 1 / 3, atol=1e-6)


def test_a_record_too_weak_for_complex64_is_told_of_alone_and_among_others() -> None:
    iq = np.stack([np.ones(2048, complex), np.full(2048, 1e-50j)])
    radar = {"carrier_hz": 10e9, "prf_hz": 20e3}
    for given in (iq, iq[1]):
        with pytest.raises(BadInput, match=r"at most 1e-50, which complex64 holds as 0: raise the gain"):
            Classifier.load().predict(given, **radar)
        with pytest.raises(ValueError, match="complex64 holds as 0: raise the gain"):
            measure(given, **radar)
