"""Pulses of another radar, one sample each at a fixed distance, are no rotor, and what they hide is measured."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.even_pulses import even_pulses
from bladewing.features.rotor.periodogram import prepare

from ..signals import PRF_HZ, PULSES, RADAR, rotors, white


def pulsed(iq: np.ndarray, period: float, amplitude: float, rng: np.random.Generator, *, coherent: bool) -> np.ndarray:
    """A record with a pulse after each period [samples]."""
    places = np.rint(np.arange(7, PULSES - 1, period)).astype(int)
    turns = 0.13 * np.arange(len(places)) if coherent else rng.uniform(size=len(places))
    out = iq.copy()
    out[places] += amplitude * np.exp(2j * np.pi * turns)
    return out


@pytest.mark.parametrize("period", [64, 129, 100.4])
@pytest.mark.parametrize("coherent", [True, False])
def test_pulses_are_no_rotor(period, coherent):
    rng = np.random.default_rng(3)
    found = measure(pulsed(white(rng, PULSES), period, 20.0, rng, coherent=coherent), **RADAR)
    assert np.isnan(found.chopping_hz)
    assert f"single pulses {PRF_HZ / period:.1f} times a second" in str(found.reason)


def test_a_rotor_that_they_hide_is_measured():
    rng = np.random.default_rng(4)
    iq = 0.7 * rotors([58.61], velocity_mps=7.3, body=10.0) + white(rng, PULSES)
    found = measure(pulsed(iq, 75, 60.0, rng, coherent=True), **RADAR)
    assert found.chopping_hz == pytest.approx(2 * 58.61, abs=0.1)
    assert found.tip_speed_mps == pytest.approx(2 * np.pi * 58.61 * 0.15, rel=0.05)


@pytest.mark.parametrize("length_m", [0.05, 0.15, 0.3])
@pytest.mark.parametrize("rate_hz", [70.0, 58.61, 101.9])
def test_flashes_are_none(length_m, rate_hz):
    """Also where they come after 250 samples for sure, at 70 Hz."""
    iq = 30 * rotors([rate_hz], length_m=length_m, body=10.0) + white(np.random.default_rng(5), PULSES)
    data = prepare(iq.astype(np.complex64), **RADAR)
    assert not len(even_pulses(data, 2 * rate_hz / PRF_HZ))
