"""Lost pulses: zeros where a receiver gives none."""

import re

import numpy as np
import pytest
from bladewing.features import dropouts, measure
from bladewing.features.acceleration import body_acceleration
from bladewing.features.dropouts import (
    BEYOND_FILLING_IN,
    LEAST_DISTINCT,
    MOST_IN_A_ROW,
    _of_precision,
    filled,
    longest_silence,
    lost_pulses,
    mended,
    silent,
    unbroken,
)
from bladewing.features.one_channel import one_channel
from bladewing.features.one_thread import one_thread
from bladewing.features.wingbeat import wingbeat
from hypothesis import example, given
from hypothesis import strategies as st

from .signals import CARRIER_HZ, PRF_HZ, rotors

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


@pytest.mark.parametrize("period", [7, 10, 50])
@pytest.mark.parametrize("steps", [0.7, 1.5, 2.0])
def test_zeros_at_regular_distances_are_lost_among_those_that_a_converter_gives(steps: float, period: int) -> None:
    given = noise(np.random.default_rng(1)) * np.float32(steps * np.sqrt(2)) + 3 * np.exp(0.1j * PULSES[:4000])
    iq = (np.round(given.real) + 1j * np.round(given.imag)).astype(np.complex64)
    assert not lost_pulses(iq).any()
    iq[3::period] = 0
    assert lost_pulses(iq)[3::period].all()
    assert mended(iq)[0][3::period].all()
    iq[1000:1100] = 0
    assert not lost_pulses(iq)[1000:1100].any()  # a silence stays one


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


@pytest.mark.parametrize("lost", [[700], [1], [1998], [100, 1500], [40, 41]])
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
    for ends in (slice(None), slice(1, None), slice(-1)):  # both, and one alone
        assert not lost_pulses(iq[ends].astype(np.complex64)).any()
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


@pytest.mark.parametrize("start", [0, 1000])
@pytest.mark.parametrize(("pulses", "few"), [(MOST_IN_A_ROW, True), (MOST_IN_A_ROW + 1, False)])
def test_the_longest_run_that_is_filled_in_is_one_short_of_a_silence(start: int, pulses: int, few: bool) -> None:
    iq = noise(np.random.default_rng(5))
    iq[start : start + pulses] = 0
    assert lost_pulses(iq).sum() == few * pulses
    record, stretches = mended(iq)
    assert record.all() == few
    assert (stretches == {}) == few


@given(st.lists(st.tuples(st.integers(0, 300), st.integers(1, 200)), max_size=6), st.integers(0, 300))
@example([(0, 33)], 5)
def test_what_is_left_is_the_longest_stretch_without_a_silence(pieces: list[tuple[int, int]], rest: int) -> None:
    """Against looking at all stretches: pieces are so many samples and then so many zeros."""
    there = np.concatenate([np.repeat([True, False], pair) for pair in [*pieces, (rest, 0)]])
    iq = np.where(there, noise(np.random.default_rng(1), len(there)), 0)
    found = unbroken(iq)
    # from its first zero on each silence breaks: what is left between holds none
    runs = "".join("x" if one else "." for one in there)
    stretches = re.split(rf"\.{{{MOST_IN_A_ROW + 1},}}", runs)
    few = there.sum() < LEAST_DISTINCT  # a converter that hardly steps
    assert found.stop - found.start == (len(iq) if few else max(map(len, stretches)))
    assert few or runs[found] in stretches
    if not lost_pulses(iq).any():  # or they would be filled in first
        _, stretches = mended(np.stack([iq, noise(np.random.default_rng(2), len(iq))]))
        assert stretches == ({} if found == slice(0, len(iq)) else {(0,): found})


@pytest.mark.parametrize(("steps", "is_silence"), [(0.4, False), (0.55, False), (0.8, True), (2.0, True)])
def test_long_zeros_of_a_converter_of_few_steps_are_a_silence_where_it_is_hardly_ever_0(steps, is_silence) -> None:
    """Of any such converter they passed for its own: judged with holes in it, a line was a rotor's comb."""
    rng = np.random.default_rng(7)
    codes = np.round(np.clip(steps * noise(rng, 20_000).view(np.float32), -3, 3)).view(np.complex64)
    assert unbroken(codes) == slice(0, 20_000)
    gated = np.where(np.arange(20_000) % 160 < 40, 0, codes)
    assert (longest_silence(gated)[1] >= 40) == is_silence
    assert silent(gated).any() == is_silence
    assert not gated[silent(gated)].any()


def test_holes_in_a_line_of_few_steps_are_no_rotor() -> None:
    line = 0.4 * np.sqrt(2) * noise(np.random.default_rng(0), 10_000) + 2.2 * np.exp(0.08j * np.arange(10_000))
    codes = np.round(line.astype(np.complex64).view(np.float32)).view(np.complex64)
    for every, gone in ((250, 60), (160, 40), (400, 100)):
        gated = np.where(np.arange(10_000) % every < gone, 0, codes).astype(np.complex64).reshape(5, 2000)
        assert np.isnan(measure(gated, carrier_hz=CARRIER_HZ, prf_hz=25e3).chopping_hz).all()


def test_a_record_that_a_silence_breaks_is_measured_by_its_longest_stretch() -> None:
    """Of one rotor, zeros at the end made two that were told apart, and regular silences of ground a comb."""
    radar, rng = {"carrier_hz": CARRIER_HZ, "prf_hz": PRF_HZ}, np.random.default_rng(3)
    whole = (3 * rotors([58.61], velocity_mps=7.3, body=10.0) + noise(rng, 3000)).astype("c8")
    padded = np.where(np.arange(3000) < 2300, whole, 0)
    found, alone = (measure(iq, **radar) for iq in (np.stack([padded, whole]), whole[:2300]))
    for name in ("chopping_hz", "chopping_hz_std", "bandwidth_hz", "rotor_count", "body_velocity_mps"):
        assert getattr(found, name)[0] == getattr(alone, name)
    assert found.rotor_count.tolist() == [1, 1]
    blanked = np.where(np.arange(3000) % 256 < MOST_IN_A_ROW + 1, 0, 10 + noise(rng, 3000))
    assert np.isnan(measure(blanked, **radar).chopping_hz)
    one = np.where(np.arange(3000) < 2300, whole.real, 0).astype("c8")
    assert measure(one, **radar).chopping_hz == measure(one[:2300], **radar).chopping_hz


PATTERNS = {
    "each 97th": PULSES % 97 == 0,
    "each 7th": PULSES % 7 == 0,
    "a fifth at random": np.random.default_rng(7).random(len(PULSES)) < 0.2,
    "ten in a row": PULSES % 400 < 10,
    "at the ends": (PULSES < 20) | (len(PULSES) - 20 <= PULSES),
}


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("lines", [{0.003: 100.0}, {0.31: 1000.0}, {0.01: 100.0, -0.22: 30j}, {}])
def test_lost_pulses_are_filled_in_by_what_they_held(pattern: str, lines: dict[float, complex], monkeypatch) -> None:
    lost = PATTERNS[pattern]
    clear = sum((amplitude * np.exp(2j * np.pi * f * PULSES) for f, amplitude in lines.items()), np.zeros(len(PULSES)))
    whole = (clear + noise(np.random.default_rng(8), len(PULSES))).astype(np.complex64)
    given = np.where(lost, 0, whole)
    found = filled(given, lost_pulses(given))
    np.testing.assert_array_equal(found[~lost], whole[~lost])
    # of lines of up to 60 dB less is wrong than there is noise, of which there is as much as elsewhere: where pulses
    # lost one in five came back without, a steady line was a UAV in 18 of 40 records
    assert 0.6 < np.mean(np.abs(found - clear)[lost] ** 2) < 1.5
    monkeypatch.setattr(dropouts, "_of_precision", lambda _, white: 0 * white)  # what the law tells, and no noise
    told = filled(given, lost_pulses(given))
    assert np.mean(np.abs(told - clear)[lost] ** 2) < 0.5


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


def test_measure_fills_lost_pulses_in() -> None:
    """Of each 72nd pulse that was lost, the comb was once that of the losses, 486 Hz and surely so."""
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": PRF_HZ}
    whole = (3 * rotors([58.61], velocity_mps=7.3, body=10.0) + noise(np.random.default_rng(12), 3000)).astype("c8")
    lost = np.where(np.arange(3000) % 72 == 11, 0, whole)
    given = np.stack([whole, lost, lost.real + 0j])
    before = given.copy()
    every = measure(given, **radar)
    np.testing.assert_array_equal(given, before)  # the caller's samples stay as they are
    assert every.chopping_hz == pytest.approx(2 * 58.61, rel=1e-3)
    assert every.tip_speed_mps[1] == pytest.approx(every.tip_speed_mps[0], rel=0.03)
    assert every.chopping_hz[0] == measure(whole, **radar).chopping_hz


@pytest.mark.parametrize("sigma", [0.4, 0.7, 1.0, 3.0])
@pytest.mark.parametrize("turn", ["phase", "channels set right", "motion taken out"])
def test_a_converter_s_zeros_stay_its_own_whichever_way_its_steps_are_turned(sigma: float, turn: str) -> None:
    held = np.round(sigma * noise(np.random.default_rng(3), 2000) * 2**0.5)
    turned = {
        "phase": held * np.exp(0.7j),
        "channels set right": held.real + 1j * (1.03 * held.imag + 0.02 * held.real),
        "motion taken out": held * np.exp(0.01j * np.arange(2000)),
    }[turn].astype(np.complex64)
    assert not turned.all()
    assert not lost_pulses(turned).any()


@pytest.mark.parametrize("every", [2, 3, 6, 10])
def test_of_a_record_that_lost_too_many_nothing_is_told(every: int) -> None:
    """What is left was once read as it was: lines that the losses draw, and rotors of them."""
    given = np.zeros((2, 1600), np.complex64)
    given[:, ::every] = (30 * np.exp(0.3j * np.arange(1600)) + noise(np.random.default_rng(4), 1600))[::every]
    given[1] = 30 * np.exp(0.3j * np.arange(1600)) + noise(np.random.default_rng(4), 1600)
    records, stretches = mended(given)
    np.testing.assert_array_equal(records, given)
    assert stretches == {(0,): slice(0, 0)}
    found = measure(given, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    assert found.reason[0] == BEYOND_FILLING_IN
    assert np.isnan(found.body_velocity_mps[0])
    assert np.isfinite(found.body_velocity_mps[1])


def test_pulses_are_filled_in_on_one_thread(monkeypatch) -> None:
    """On several, which wait for one another, a record of 1600 pulses took up to 13 s."""
    whole = np.exp(0.3j * np.arange(700)).astype(np.complex64)
    lost = np.arange(700) % 20 == 11
    held = []
    solve = np.linalg.solve
    monkeypatch.setattr(np.linalg, "solve", lambda *a: (held.append(one_thread._inside), solve(*a))[1])
    filled(np.where(lost, 0, whole), lost)
    assert held == [1]


@pytest.mark.parametrize("other", ["offset", "the same", "turned round"])
def test_what_is_filled_in_of_one_channel_stays_one(other: str) -> None:
    """Q that is held at an offset was filled in beside it, and both sides of the spectrum were believed."""
    channel = 3 * np.cos(0.3 * np.arange(2000)) + noise(np.random.default_rng(9), 2000).real
    part = {"offset": 0.3 + 0 * channel, "the same": channel, "turned round": -channel}[other]
    whole = (channel + 1j * part).astype(np.complex64)
    lost = np.zeros(2000, bool)
    lost[[77, 500, 501, 1400]] = True
    found = filled(np.where(lost, 0, whole), lost)
    assert one_channel(found)
    assert np.abs(found[lost]).min() > 0


@pytest.mark.parametrize(("lost", "every"), [(1, 128), (10, 128), (33, 256)])
def test_of_a_quiet_converter_that_is_off_zero_pulses_are_lost_as_of_any(lost: int, every: int) -> None:
    """Its codes are few, but none is 0: what was lost passed for a rotor's comb."""
    rng = np.random.default_rng(1)
    codes = 2048 + np.round(0.7 * rng.standard_normal((2, 20_000)))
    whole = (codes[0] + 1j * codes[1]).astype(np.complex64)
    gone = np.arange(20_000) % every < lost
    given = np.where(gone, 0, whole).astype(np.complex64)
    assert not lost_pulses(whole).any()
    if lost <= MOST_IN_A_ROW:
        np.testing.assert_array_equal(lost_pulses(given), gone)
    else:
        assert unbroken(given) == slice(19_745, 20_000)  # the last 32 may be filled in


def test_a_pulse_lost_beside_a_line_of_100_db_is_one() -> None:
    iq = (1e5 + noise(np.random.default_rng(2), 2048)).astype(np.complex64)
    lost = np.arange(2048) % 128 == 3
    np.testing.assert_array_equal(lost_pulses(np.where(lost, 0, iq).astype(np.complex64)), lost)


@pytest.mark.parametrize(("sigma", "line", "channels", "every"), [(30, 90, 1, 50), (30, 3, 1, 50), (10, 0, 2, 43)])
def test_lost_pulses_of_a_converter_that_is_not_turned_are_told_by_chance(
    sigma: float, line: float, channels: int, every: int
) -> None:
    """Its own zeros are some tenths of these: a comb of the losses was told of 38 in 50 such records."""
    for seed in range(5):
        given = sigma * noise(np.random.default_rng(seed), 3000) * 2**0.5 + line * np.exp(0.4j * np.arange(3000))
        given = np.round(given if channels == 2 else given.real + 0j)
        assert not lost_pulses(given.astype(np.complex64)).any()
        given[5::every] = 0
        assert lost_pulses(given.astype(np.complex64))[5::every].all(), seed


def test_of_what_lost_too_many_no_course_is_told_either() -> None:
    given = (30 * np.exp(0.3j * np.arange(16_000)) + noise(np.random.default_rng(4), 16_000)).astype(np.complex64)
    given[1::2] = 0
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 8e3}
    beat = wingbeat(given, **radar)
    assert np.isnan([beat.velocity_mps, beat.acceleration_mps2, beat.wingbeat_hz]).all()
    assert np.isnan(body_acceleration(given[:2000], **radar)[0])
    called: list[int] = []
    measure(given.reshape(4, -1), **radar, on_record=called.append)
    assert called == [1, 2, 3, 4]


@pytest.mark.parametrize("beside", [1, 7])
def test_what_no_law_explains_has_the_covariance_that_it_is_to_have(beside: int) -> None:
    rng = np.random.default_rng(beside)
    root = np.tril(np.triu(rng.normal(size=(12, 12)) + 1j * rng.normal(size=(12, 12)), -beside)) + 4 * np.eye(12)
    matrix = root @ root.conj().T
    bands = np.zeros((beside + 1, 12), complex)
    for below in range(beside + 1):
        bands[below, : 12 - below] = np.diagonal(matrix, -below)
    through = np.stack([_of_precision(bands, one) for one in np.eye(12)], axis=1)
    np.testing.assert_allclose(through @ through.conj().T, np.linalg.inv(matrix), atol=1e-12)
