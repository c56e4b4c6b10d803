"""The skirt of a static background is neither a line of a comb nor what rotors leave."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.periodogram import prepare
from bladewing.simulate import Scene
from bladewing.simulate.catalogue import AIRFRAMES

from ..signals import PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, tone, white


def ground(rng, half_mps, power=2.0):
    """A background whose spectrum falls as so high a power of the velocity, unit power, a tenth of it at rest."""
    speed_mps = np.abs(np.fft.fftfreq(PULSES, 1 / PRF_HZ)) * WAVELENGTH_M / 2
    shape = np.sqrt(1 / (1 + (speed_mps / half_mps) ** power))
    moving = np.fft.ifft(np.fft.fft(white(rng, PULSES)) * shape)
    return np.sqrt(0.9) * moving / np.sqrt(np.mean(np.abs(moving) ** 2)) + np.sqrt(0.1)


def before_ground(seed, ground_db):
    rng = np.random.default_rng(seed)
    rate_hz, velocity_mps = rng.uniform(40, 110), rng.uniform(8, 25) * rng.choice([-1, 1])
    iq = rotors([rate_hz], velocity_mps=velocity_mps, body=5.0) + 10 ** (ground_db / 20) * ground(rng, 0.4)
    return (iq + 0.2 * white(rng, PULSES)).astype(np.complex64), rate_hz, velocity_mps


@pytest.mark.parametrize(("ground_db", "least"), [(20.0, 11), (30.0, 6)])
def test_a_rotor_before_a_wide_skirt_is_one_rotor_about_its_body(ground_db, least):
    right, resolved = 0, 0
    for seed in range(12):
        iq, rate_hz, velocity_mps = before_ground(seed, ground_db)
        found = measure(iq, **RADAR)
        if abs(found.chopping_hz / (2 * rate_hz) - 1) < 0.002:
            assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.1)
            right += 1
            resolved += bool(found.rotors_resolved)
    assert right >= 10
    # without a look at the skirt none were, and two in three bodies wrong at 30 dB, where few lines stand out of it
    assert resolved >= least


def test_rotors_not_told_apart_are_none_before_a_skirt_either():
    resolved = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        rates_hz = rng.uniform(50, 60) * (1 + 0.004 * np.array([-1.0, -0.3, 0.5, 1.0]))
        iq = rotors(rates_hz, velocity_mps=12.0, body=5.0) + 10 * ground(rng, 0.4) + 0.2 * white(rng, PULSES)
        resolved += bool(measure(iq.astype(np.complex64), **RADAR).rotors_resolved)
    assert resolved <= 1


def test_only_what_falls_from_velocity_zero_is_a_skirt():
    iq, *_ = before_ground(0, 30.0)
    skirt = prepare(iq, **RADAR)
    near, far = np.array([0.01, -0.01]), np.array([0.45, -0.45])
    assert skirt.in_skirt(near).all()
    assert not skirt.in_skirt(far).any()
    assert (skirt.in_skirt(near) == skirt.in_skirt(near + 1)).all()  # aliases are folded
    rng = np.random.default_rng(0)
    for plain in (white(rng, PULSES), 30 + white(rng, PULSES), 100 * tone(400.0) + white(rng, PULSES)):
        assert not prepare(plain.astype(np.complex64), **RADAR).in_skirt(np.arange(-0.5, 0.5, 0.001)).any()


def test_lines_of_many_rotors_that_fill_their_band_are_none():
    radar = {"carrier_hz": 9.85e9, "prf_hz": 18582.0}
    for seed in range(6):
        uav = AIRFRAMES["hexacopter_30cm"].fields | {"name": "drone", "velocity_mps": 5.0}
        iq = Scene.build({"radar": radar | {"pulses": 1486}, "uav": [uav]}).render(seed).iq
        assert not prepare(iq, **radar).in_skirt(np.arange(-0.5, 0.5, 0.001)).any()
