"""A rate that changes within the dwell: measured, taken out, and never found where several rotors are steady."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.drift import ahead_left, bend, is_sure, resampled, straightened
from bladewing.features.family import find_family
from bladewing.features.periodogram import prepared
from bladewing.features.spectrum import doppler_spectrum

from ..benchmarks import records

DWELL_S = records.PULSES / records.PRF_HZ


def one_rotor(seed: int, change: float, *, snr_db: float = 10.0) -> tuple[np.ndarray, float]:
    """A record of one rotor whose rate changes by a share of itself over the dwell, and its chopping frequency."""
    rng = np.random.default_rng(seed)
    rate_hz = rng.uniform(45, 105)
    options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-25, 25), "change": change}
    return records.record(rng, np.array([rate_hz]), **options), 2 * rate_hz


def family_of(iq: np.ndarray):
    """The record made ready, and its line family."""
    spectrum = doppler_spectrum(iq, **records.RADAR)
    data = prepared(iq, spectrum)
    return data, find_family(iq, spectrum, data)[0]


@pytest.mark.parametrize(("margin", "pulses"), [(0, 512), (40, 501), (64, 3000)])
def test_a_comb_read_later_is_the_closed_form_at_those_times(margin, pulses):
    rng = np.random.default_rng(1)
    size = pulses + 2 * margin
    orders = np.arange(-20, 21)
    amplitudes = rng.standard_normal(41) + 1j * rng.standard_normal(41)
    centre, spacing = 0.11, 10 / size  # about the centre the whole repeats, so nothing is lost at its ends

    def echo(time: np.ndarray) -> np.ndarray:
        return np.exp(2j * np.pi * spacing * time[:, None] * orders) @ amplitudes

    whole = np.arange(size) - (size - 1) / 2
    time = np.arange(pulses) - (pulses - 1) / 2
    late = 3.0 * (2 * time / pulses) ** 2 - 1.3
    turn = np.exp(2j * np.pi * centre * time)
    read = resampled(echo(whole) * np.exp(2j * np.pi * centre * whole), centre, late)
    np.testing.assert_allclose(read, echo(time + late) * turn, atol=1e-4)


@pytest.mark.parametrize("change", [-0.03, -0.01, 0.002, 0.01, 0.03])
def test_one_rotor_whose_rate_changes_is_one_rotor(change):
    """Before its change was taken out most of these were unresolved, or two and more."""
    told, tips = [], []
    for seed in range(6):
        iq, chopping_hz = one_rotor(seed, change)
        found = measure(iq, **records.RADAR)
        told.append(bool(found.rotors_resolved) and found.rotor_count == 1)
        if told[-1]:
            drift_hz_per_s = chopping_hz * change / DWELL_S
            error = max(0.1 * abs(drift_hz_per_s), 5 * found.chopping_drift_hz_per_s_std)
            assert found.chopping_drift_hz_per_s == pytest.approx(drift_hz_per_s, abs=error)
            assert found.chopping_hz == pytest.approx(chopping_hz, rel=3e-4)
            tips.append(found.tip_speed_mps / (np.pi * chopping_hz * 0.15) - 1)
    assert sum(told) >= 5
    assert np.median(np.abs(tips)) < 0.005


@pytest.mark.parametrize(("change", "most"), [(0.0, 2.0), (0.002, 2.5), (0.01, 3.0)])
def test_deviations_of_the_change_are_true(change, most):
    """Of 40 draws the mean square of normalised errors is 1 +- 0.22; a few do not converge to the end."""
    drifts, rates = [], []
    for seed in range(40):
        iq, chopping_hz = one_rotor(100 + seed, change, snr_db=0.0)
        found = measure(iq, **records.RADAR)
        if found.rotors_resolved and found.rotor_count == 1:
            away = found.chopping_drift_hz_per_s - chopping_hz * change / DWELL_S
            drifts.append(away / found.chopping_drift_hz_per_s_std)
            rates.append((found.chopping_hz - chopping_hz) / found.chopping_hz_std)
    assert len(drifts) >= 32
    assert 0.4 < np.mean(np.square(drifts)) < most
    assert 0.4 < np.mean(np.square(rates)) < most


def test_a_steady_rotor_is_left_as_it_is():
    for seed in range(6):
        data, family = family_of(one_rotor(seed, 0.0)[0])
        assert family.bend == 0.0
        assert family.ahead is not None
        assert not is_sure(*family.ahead)
        assert family.data is data


def test_turned_round_in_time_a_rate_that_rises_falls():
    """And the gain does not matter."""
    iq, _ = one_rotor(3, 0.01)
    there, back, loud = (measure(one, **records.RADAR) for one in (iq, iq[::-1].conj(), 1e3j * iq))
    std = there.chopping_drift_hz_per_s_std
    assert there.chopping_drift_hz_per_s > 10 * std
    assert back.chopping_drift_hz_per_s == pytest.approx(-there.chopping_drift_hz_per_s, abs=2 * std)
    assert loud.chopping_drift_hz_per_s == pytest.approx(there.chopping_drift_hz_per_s, abs=0.1 * std)


@pytest.mark.parametrize("snr_db", [0.0, 20.0])
@pytest.mark.parametrize(("count", "apart_hz"), [(2, 0.1), (3, 0.1), (4, 0.4)])
def test_several_steady_rotors_are_not_taken_for_one_that_changes(count, apart_hz, snr_db, monkeypatch):
    """What is said of them is what was said without a thought of change."""
    rng = np.random.default_rng(5)
    for _ in range(5):
        rates_hz = rng.uniform(50, 90) + apart_hz * np.arange(count)
        iq = records.record(rng, rates_hz, snr_db=snr_db, body_db=20, velocity_mps=rng.uniform(-20, 20))
        found = measure(iq, **records.RADAR)
        with monkeypatch.context() as without:
            without.setattr("bladewing.features.family.straightened", lambda *_, **__: None)
            plain = measure(iq, **records.RADAR)
        assert found.rotor_count == plain.rotor_count
        assert found.rotors_resolved == plain.rotors_resolved


def test_several_rotors_have_no_common_drift():
    rng = np.random.default_rng(2)
    iq = records.record(rng, np.array([56.6, 57.2, 57.7, 58.3]), snr_db=10, body_db=20, velocity_mps=7.0)
    found = measure(iq, **records.RADAR)
    assert found.rotor_count == 4
    assert np.isnan(found.chopping_drift_hz_per_s)
    assert np.isnan(found.chopping_drift_hz_per_s_std)


def test_rotors_that_change_together_are_told_apart():
    """As their throttle is opened."""
    told = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rates_hz = records.apart(rng, 4, 0.4, 56.5, 58.5)
        options = {"snr_db": 10, "body_db": 20, "velocity_mps": rng.uniform(-20, 20), "change": 0.01}
        found = measure(records.record(rng, rates_hz, **options), **records.RADAR)
        told += bool(found.rotors_resolved and found.rotor_count == 4)
    assert told >= 3


def test_what_is_left_of_a_change_comes_with_its_sign():
    """A record straightened by too little has the rest of it left."""
    iq, _ = one_rotor(4, 0.004, snr_db=20.0)
    spectrum = doppler_spectrum(iq, **records.RADAR)
    data = prepared(iq, spectrum)
    family = find_family(iq, spectrum, data)[0]
    even = straightened(iq / np.sqrt(spectrum.floor), data, family.comb, family.edge, narrow=True, least_gain=0.0)
    assert even.bend == pytest.approx(0.004 / records.PULSES, rel=0.02)
    left, std = ahead_left(family.data, family.comb.fit, family.comb.rest)
    assert abs(bend(left, records.PULSES)) < 5 * bend(std, records.PULSES)


def test_straightened_to_its_ends():
    """What repeats with a step between its ends would be wrong there by a part of that."""
    rng = np.random.default_rng(6)
    time = np.arange(records.PULSES) - (records.PULSES - 1) / 2
    orders, centre, spacing, change = np.arange(-40, 41), 0.0312, 0.00523, 0.01
    amplitudes = 6.0 * np.exp(2j * np.pi * rng.random(81)) * (orders != 0)

    def comb(turned: np.ndarray) -> np.ndarray:
        lines = np.exp(2j * np.pi * spacing * turned[:, None] * orders) @ amplitudes
        return lines * np.exp(2j * np.pi * centre * time)

    body = 300 * np.exp(2j * np.pi * centre * time)
    iq = comb(time + change / records.PULSES * time**2 / 2) + body + records.white(rng, records.PULSES)
    iq = iq.astype(np.complex64)
    spectrum = doppler_spectrum(iq, **records.RADAR)
    data = prepared(iq, spectrum)
    found = find_family(iq, spectrum, data)[0]
    noise = np.sqrt(spectrum.floor)
    even = straightened((iq - body) / noise, data, found.comb, found.edge, narrow=False, least_gain=0.0)
    # an even rotor has turned as far, on the mean over the dwell
    error = even.samples * noise - comb(time + change * records.PULSES / 24)
    ends = np.abs(time) > 0.495 * records.PULSES
    assert np.mean(np.abs(error[ends]) ** 2) < 50  # of 30 samples; the comb has 2880, without margins 430 are wrong
    assert np.mean(np.abs(error) ** 2) < 1.5  # of which 1 is the noise
