"""Blades not quite alike: the weak lines between the strong ones must not pass for another or a changing rate."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.comb import find_comb
from bladewing.features.periodogram import prepare
from bladewing.features.weak_lines import without_weak_lines

from .signals import CARRIER_HZ, PRF_HZ, PULSES, rotors, white

RADAR = {"carrier_hz": CARRIER_HZ, "prf_hz": PRF_HZ}


def unlike(rng, rate_hz, phases_rad, *, snr_db=20.0, velocity_mps=0.0):
    """A steady rotor whose blades' echoes differ by these phases; 0.1 rad is a quarter of a millimetre at 10 GHz."""
    count = len(phases_rad)
    blades = [
        np.exp(1j * phase) * rotors([rate_hz], amplitudes=np.eye(count)[number], body=0.0)
        for number, phase in enumerate(phases_rad)
    ]
    echo = sum(blades)
    echo = echo / np.sqrt(np.mean(np.abs(echo) ** 2))
    turn = np.exp(-4j * np.pi * velocity_mps * np.arange(PULSES) / PRF_HZ * CARRIER_HZ / 299_792_458.0)
    return ((echo + 10) * turn + 10 ** (-snr_db / 20) * white(rng, PULSES)).astype(np.complex64)


@pytest.mark.parametrize("phase_rad", [0.0, 0.1, 0.3, 0.6])
@pytest.mark.parametrize("snr_db", [20.0, 30.0])
def test_blades_a_little_apart_neither_shift_the_rate_nor_change_it(phase_rad, snr_db):
    rng = np.random.default_rng(int(10 * phase_rad + snr_db))
    shifts, drifts = [], []
    for rate_hz in (33.6, 38.1, 45.7, 61.9, 81.5, 112.0):
        found = measure(
            unlike(rng, rate_hz, (0.0, phase_rad), snr_db=snr_db, velocity_mps=rng.uniform(-20, 20)), **RADAR
        )
        assert found.rotor_count == 1
        assert found.rotors_resolved
        shifts.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
        drifts.append(found.chopping_drift_hz_per_s / found.chopping_drift_hz_per_s_std)
    # once 25 deviations of the rate, and 20 of a change that is not there
    assert np.abs(shifts).max() < 4.5
    assert np.abs(drifts).max() < 5
    assert np.mean(np.square(shifts)) < 3.5  # six normal errors: in one of a thousand more


@pytest.mark.parametrize("phases_rad", [(0.0, 0.3), (0.0, 0.2, -0.25)])
def test_they_tell_the_number_of_blades(phases_rad):
    rng = np.random.default_rng(len(phases_rad))
    for rate_hz in (43.3, 71.9):
        found = measure(unlike(rng, rate_hz, phases_rad), **RADAR)
        assert found.rotation_hz == pytest.approx(rate_hz, rel=1e-4)
        assert found.chopping_hz == pytest.approx(len(phases_rad) * rate_hz, rel=1e-4)


def test_like_blades_have_none():
    told = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        found = measure(unlike(rng, rng.uniform(40, 90), (0.0, 0.0), snr_db=rng.uniform(-5, 30)), **RADAR)
        told += bool(np.isfinite(found.rotation_hz))
    assert told == 0


def test_of_blades_given_no_other_number_is_tried():
    rng = np.random.default_rng(5)
    data = prepare(unlike(rng, 43.3, (0.0, 0.3)), **RADAR)
    comb = find_comb(data)[0]
    assert comb.per_turn == 1
    for given, told in ((None, 2), (2, 2), (3, None), (1, None)):
        left, fitted = without_weak_lines(data, comb, given)
        assert fitted.blades == told
        assert (left is data) == (told is None)
        assert fitted.fit.spacing == pytest.approx(comb.fit.spacing, rel=1e-4)
