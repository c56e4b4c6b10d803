"""A rate that changes within the dwell: measured, taken out, and not found where several rotors are steady."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.drift import ahead_left, resampled
from bladewing.features.rotor.family import find_family
from bladewing.features.rotor.periodogram import prepared
from bladewing.features.rotor.slow_lines import remove_bands
from bladewing.features.rotor.turning import Resampling, bend, is_sure
from bladewing.features.spectrum import doppler_spectrum

from ...benchmarks import records
from ..signals import family_of

DWELL_S = records.PULSES / records.PRF_HZ


def one_rotor(seed: int, change: float, *, snr_db: float = 10.0) -> tuple[np.ndarray, float]:
    """A record of one rotor whose rate changes by a share of itself over the dwell, and its chopping frequency."""
    rng = np.random.default_rng(seed)
    rate_hz = rng.uniform(45, 105)
    options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-25, 25), "change": change}
    return records.record(rng, np.array([rate_hz]), **options), 2 * rate_hz


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
    read = Resampling(echo(whole) * np.exp(2j * np.pi * centre * whole), centre).read(late)
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
            error = max(0.02 * abs(drift_hz_per_s), 5 * found.chopping_drift_hz_per_s_std)
            assert found.chopping_drift_hz_per_s == pytest.approx(drift_hz_per_s, abs=error)
            assert found.chopping_hz == pytest.approx(chopping_hz, rel=3e-4)
            tips.append(found.tip_speed_mps / (np.pi * chopping_hz * 0.15) - 1)
    assert sum(told) >= 5
    assert np.median(np.abs(tips)) < 0.005


@pytest.mark.parametrize(("snr_db", "change"), [(0.0, 0.0), (0.0, 0.002), (0.0, 0.01), (20.0, 0.01)])
def test_deviations_of_the_change_are_true(snr_db, change):
    """Of 27 draws the mean square of normalised errors is 1 +- 0.27, within 2 lie 0.95 +- 0.04; at 20 dB one or two are
    further off, whose lines lie about a notch."""
    drifts, rates = [], []
    for seed in range(27):
        iq, chopping_hz = one_rotor(100 + seed, change, snr_db=snr_db)
        found = measure(iq, **records.RADAR)
        if found.rotors_resolved and found.rotor_count == 1:
            away = found.chopping_drift_hz_per_s - chopping_hz * change / DWELL_S
            drifts.append(away / found.chopping_drift_hz_per_s_std)
            rates.append((found.chopping_hz - chopping_hz) / found.chopping_hz_std)
    assert len(drifts) >= 22
    for errors in (drifts, rates):
        assert np.mean(np.abs(errors) < 2) > 0.8
        assert 0.4 < np.mean(np.square(errors)) < (2.2 if snr_db < 10 else 4.0)


def test_a_steady_rotor_is_left_as_it_is():
    for seed in range(6):
        data, family = family_of(one_rotor(seed, 0.0)[0])
        assert family.data is data
        assert family.ahead is not None
        assert not is_sure(*family.ahead)


def test_turned_round_in_time_a_rate_that_rises_falls():
    """And the gain does not matter."""
    iq, _ = one_rotor(3, 0.01)
    there, back, loud = (measure(one, **records.RADAR) for one in (iq, iq[::-1].conj(), 1e3j * iq))
    std = there.chopping_drift_hz_per_s_std
    assert there.chopping_drift_hz_per_s > 10 * std
    assert back.chopping_drift_hz_per_s == pytest.approx(-there.chopping_drift_hz_per_s, abs=2 * std)
    assert loud.chopping_drift_hz_per_s == pytest.approx(there.chopping_drift_hz_per_s, abs=0.1 * std)


def measured_both_ways(iq: np.ndarray, monkeypatch) -> tuple:
    """What is measured, and what would be without a thought of change."""
    evened = []

    def watched(*given, **options):
        evened.append(resampled(*given, **options))
        return evened[-1]

    with monkeypatch.context() as patch:
        patch.setattr("bladewing.features.rotor.family.resampled", watched)
        found = measure(iq, **records.RADAR)
        if all(even is None for even in evened):  # it was thought of to no effect: the same again
            return found, found
        patch.setattr("bladewing.features.rotor.family.resampled", lambda *_, **__: None)
        return found, measure(iq, **records.RADAR)


@pytest.mark.parametrize("snr_db", [0.0, 20.0])
@pytest.mark.parametrize("weaker", [1.0, 0.6])
@pytest.mark.parametrize(("count", "apart_hz"), [(2, 0.1), (3, 0.05), (3, 0.1), (4, 0.4)])
def test_several_steady_rotors_are_not_taken_for_one_that_changes(count, apart_hz, weaker, snr_db, monkeypatch):
    """Be they as strong as one another or not."""
    rng = np.random.default_rng(5)
    for _ in range(4):
        rates_hz = rng.uniform(50, 90) + apart_hz * np.arange(count)
        options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-20, 20)}
        iq = records.record(rng, rates_hz, strengths=weaker ** np.arange(count), **options)
        found, plain = measured_both_ways(iq, monkeypatch)
        assert found.rotor_count == plain.rotor_count
        assert found.rotors_resolved == plain.rotors_resolved


def test_the_drift_of_several_steady_rotors_is_none_and_of_rotors_not_told_apart_unknown():
    rng = np.random.default_rng(2)
    iq = records.record(rng, np.array([56.6, 57.2, 57.7, 58.3]), snr_db=10, body_db=20, velocity_mps=7.0)
    found = measure(iq, **records.RADAR)
    assert found.rotor_count == 4
    assert abs(found.chopping_drift_hz_per_s) < 4 * found.chopping_drift_hz_per_s_std
    assert found.chopping_drift_hz_per_s_std < 1.0
    iq = records.record(rng, np.array([56.6, 56.65]), snr_db=20, body_db=20, velocity_mps=7.0)
    found = measure(iq, **records.RADAR)
    assert not found.rotors_resolved
    assert np.isnan([found.chopping_drift_hz_per_s, found.chopping_drift_hz_per_s_std]).all()
    assert np.isnan(found.rotor_drifts_hz_per_s).all()


def test_a_small_change_that_is_left_comes_with_its_sign_and_size(monkeypatch):
    monkeypatch.setattr("bladewing.features.rotor.family.resampled", lambda *_, **__: None)
    for change in (-0.0004, 0.0004):
        data, family = family_of(one_rotor(4, change, snr_db=10.0)[0])
        assert family.data is data
        left, std = (
            bend(values, records.PULSES) for (values,) in ahead_left(data, [family.comb.fit], family.comb.rest)
        )
        assert left == pytest.approx(change / records.PULSES, abs=max(4 * std, 0.1 * abs(change) / records.PULSES))
        assert abs(left) > 4 * std


@pytest.mark.parametrize(("change", "pull_mps2"), [(0.0, 0.0), (0.01, 0.0), (0.0, 0.5), (0.0, 2.0)])
def test_of_a_one_sided_comb_neither_body_nor_acceleration_passes_for_a_change(change, pull_mps2):
    """There the body's frequency and its change go with those of the rotor's."""
    rng = np.random.default_rng(8)
    drifts, rates = [], []
    for _ in range(24):
        rate_hz = rng.uniform(45, 105)
        lines = np.fft.fft(records.rotors(rng, np.array([rate_hz]), change=change))
        lines[np.fft.fftfreq(records.PULSES) < 0] *= 0.17
        blades = np.fft.ifft(lines) / np.sqrt(np.mean(np.abs(lines) ** 2) / records.PULSES)
        time_s = records.TIMES_S - DWELL_S / 2
        range_m = rng.uniform(-25, 25) * time_s + pull_mps2 * time_s**2 / 2
        iq = (blades + 10) * np.exp(-4j * np.pi * range_m / records.WAVELENGTH_M) + records.white(rng, records.PULSES)
        found = measure(iq.astype(np.complex64), **records.RADAR)
        if found.rotors_resolved and found.rotor_count == 1:
            away = found.chopping_drift_hz_per_s - 2 * rate_hz * change / DWELL_S
            drifts.append(away / found.chopping_drift_hz_per_s_std)
            rates.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
            assert found.rotor_rates_hz_std[0] == pytest.approx(found.chopping_hz_std)
    assert len(drifts) >= 12
    assert np.mean(np.square(drifts)) < 2.5  # of 12 draws and more: 1 +- 0.4
    assert np.mean(np.square(rates)) < 2.5


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
    found = find_family(data, spectrum)[0]
    noise = np.sqrt(spectrum.floor)
    even = resampled(data, found.comb, found.edge, least_gain=0.0)
    # an even rotor has turned as far, on the mean over the dwell
    error = even.samples * noise - remove_bands(comb(time + change * records.PULSES / 24), data.strong.bands)
    ends = np.abs(time) > 0.495 * records.PULSES
    assert np.mean(np.abs(error[ends]) ** 2) < 300  # of 30 samples; the comb has 2880, without margins 410 are wrong
    assert np.mean(np.abs(error) ** 2) < 4.5  # of which 1 is the noise; without margins 5.5
