"""A gain over the dwell that all lines share: told, divided out, and not found where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.family import GAIN_SHARE, ONE_GAIN_SHARE
from bladewing.features.rotor.gain import LEAST_GAIN, GainCorrected, gain_left
from bladewing.features.rotor.periodogram import prepared
from bladewing.features.spectrum import doppler_spectrum

from ...benchmarks import records
from ..signals import CARRIER_HZ, PRF_HZ, PULSES, family_of, white

AWAY = np.linspace(-1, 1, PULSES)  # from the middle of the dwell


@pytest.mark.parametrize("snr_db", [0.0, 20.0])
@pytest.mark.parametrize("gain", records.GAINS)
def test_a_rotor_whose_echo_swells_and_falls_is_one_rotor(gain, snr_db):
    """Nearly none of these were told apart at 20 dB, and some became several rotors that were called resolved."""
    right, tips, off = 0, 0, []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rate_hz = rng.uniform(45, 75)
        options = {"snr_db": snr_db, "body_db": 10, "velocity_mps": rng.uniform(-25, 25)}
        found = measure(records.record(rng, np.array([rate_hz]), gain=records.GAINS[gain], **options), **records.RADAR)
        right += bool(found.rotors_resolved) and found.rotor_count == 1
        off.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
        assert found.body_velocity_mps == pytest.approx(options["velocity_mps"], abs=0.02)
        tip_mps = 2 * np.pi * rate_hz * 0.15
        tips += abs(found.tip_speed_mps - tip_mps) < max(0.01 * tip_mps, 4 * found.tip_speed_mps_std)
    assert min(right, tips) >= 4
    assert np.sqrt(np.mean(np.square(off))) < 2.2  # of six draws: 99.9 %, one in a hundred of all rows


@pytest.mark.parametrize("snr_db", [0.0, 20.0])
def test_four_rotors_in_a_beam_that_sweeps_past_are_four(snr_db):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        rates_hz = records.apart(rng, 4, 20, 3395, 3500) / 60
        options = {"snr_db": snr_db, "body_db": 10, "velocity_mps": rng.uniform(-25, 25)}
        found = measure(records.record(rng, rates_hz, gain=records.GAINS["beam"], **options), **records.RADAR)
        assert found.rotors_resolved
        assert found.rotor_count == 4
        np.testing.assert_allclose(found.rotor_rates_hz[:4], 2 * rates_hz, rtol=2e-3)


def test_a_rate_that_changes_in_a_beam_that_sweeps_past_is_told():
    right = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        rate_hz, change = rng.uniform(45, 75), rng.choice([-0.01, 0.02])
        options = {"snr_db": 15.0, "body_db": 10, "velocity_mps": rng.uniform(-25, 25), "change": change}
        found = measure(
            records.record(rng, np.array([rate_hz]), gain=records.GAINS["beam"], **options), **records.RADAR
        )
        drift_hz_per_s = 2 * rate_hz * change * PRF_HZ / PULSES
        right += found.rotor_count == 1 and abs(found.chopping_drift_hz_per_s / drift_hz_per_s - 1) < 0.02
    assert right >= 3


@pytest.mark.parametrize("name", ["beam", "beam, late", "narrow beam", "cell"])
def test_the_gain_of_lines_is_what_they_were_multiplied_by(name):
    """As a factor on lines that are known; it explains all that steady ones of the same mean leave."""
    gain = records.GAINS[name] / records.GAINS[name].mean()
    iq = records.record(np.random.default_rng(1), np.array([57.0]), snr_db=60, body_db=-90, velocity_mps=0.0)
    data, _ = family_of(iq)
    lines, power = data.samples, np.abs(data.samples) ** 2
    steady = lines * float((gain * power).sum() / power.sum())
    found, share = gain_left(replace(data, samples=lines * gain), lines * gain - steady, 114.0 / PRF_HZ)
    found /= found.mean()
    assert np.average((found - gain) ** 2, weights=power) < (0.02 * gain.max()) ** 2  # where there are flashes
    assert share > 0.99


@pytest.mark.parametrize("apart_hz", [0.0, 0.05, 0.1, 0.15])
def test_steady_rotors_have_no_gain(apart_hz):
    """Neither one nor two whose lines beat so slowly that each swells or falls over the whole dwell."""
    shares = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rates_hz = 57.0 + np.array([0.0, apart_hz] if apart_hz else [0.0])
        _, family = family_of(records.record(rng, rates_hz, snr_db=20, body_db=10, velocity_mps=5.0))
        shares.append(gain_left(family.data, family.rotors.rest, family.comb.chopping)[1])
        assert family.data.ends_noise == 1.0
    assert np.sort(shares)[-2] < GAIN_SHARE < ONE_GAIN_SHARE  # of two so near one in 20 has more by chance
    assert np.median(shares) < GAIN_SHARE / 2


def test_noise_is_no_gain():
    rng = np.random.default_rng(3)
    lines = np.exp(2j * np.pi * 0.01 * np.outer(np.arange(-9, 10), np.arange(PULSES))).sum(axis=0)
    data, _ = family_of((lines + white(rng, PULSES)).astype(np.complex64))
    gain, share = gain_left(data, white(rng, PULSES), 0.01)
    assert share == 0.0
    np.testing.assert_array_equal(gain, 1.0)


def test_what_was_evened_has_lines_of_one_strength_and_says_how_loud_its_ends_are():
    rng = np.random.default_rng(4)
    time_s = np.arange(PULSES) / PRF_HZ
    gain = np.maximum(records.GAINS["beam"], LEAST_GAIN)
    line = 10 * np.exp(2j * np.pi * 5000 * time_s)
    iq = (line * gain + white(rng, PULSES)).astype(np.complex64)
    spectrum = doppler_spectrum(iq, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    data = prepared(iq, spectrum)
    # the line itself is taken for a body and is gone; put one where it can be seen
    even = GainCorrected.of(data, spectrum).by(gain).record
    noise = gain**-2.0
    assert even.ends_noise == pytest.approx(float((AWAY**2 * noise).mean() / (AWAY**2).mean() / noise.mean()), rel=1e-3)
    assert GainCorrected.of(data, spectrum).by(np.full(PULSES, 3.0)).record.ends_noise == pytest.approx(1.0)
    assert np.mean(np.abs(even.samples) ** 2) == pytest.approx(1.0, abs=5 / np.sqrt(PULSES))


def test_rates_in_a_beam_have_true_deviations():
    """Noise is louder at the ends of what was evened, where rates are told: by 1.5 in variance here."""
    off = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rate_hz = rng.uniform(50, 60)
        options = {"snr_db": 10.0, "body_db": 10, "velocity_mps": rng.uniform(-25, 25)}
        gain = 10 ** (-14 / 20 * AWAY**2)
        found = measure(records.record(rng, np.array([rate_hz]), gain=gain, **options), **records.RADAR)
        off.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
    assert 0.55 < np.mean(np.square(off)) < 1.6  # chi square of 40: 0.1 % to either side
