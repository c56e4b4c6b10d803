"""Physics of whole records: what the radar sees of a target is where the target's truth says."""

import numpy as np
import pytest
from bladewing.simulate import Radar
from bladewing.simulate.discretes import draw_discrete
from bladewing.simulate.laws import WIDTH, Draws
from bladewing.simulate.uav import ROTORS, draw_uav

RADAR = Radar(9.85e9, 40e3, 4000)


def draws(records: int, seed: int) -> Draws:
    return Draws(np.random.default_rng(seed).random((records, WIDTH)))


def spectrum(iq):
    power = abs(np.fft.fft(iq * np.kaiser(iq.shape[-1], 12.5), axis=-1)) ** 2
    return power, -np.fft.fftfreq(iq.shape[-1], 1 / RADAR.prf_hz) * RADAR.wavelength_m / 2


@pytest.mark.parametrize("kind", list(ROTORS))
def test_the_body_line_is_at_the_body_velocity(kind):
    target = draw_uav(draws(20, 1), RADAR, kind)
    power, velocity = spectrum(target.body)
    drift = target.truth["velocity_mps"] + target.truth["acceleration_mps2"] * RADAR.dwell_s / 2
    np.testing.assert_allclose(velocity[power.argmax(axis=1)], drift, atol=0.6)


@pytest.mark.parametrize("kind", ["fixed_wing", "quadcopter", "hexacopter"])
def test_no_blade_is_faster_than_its_tip(kind):
    target = draw_uav(draws(30, 2), RADAR, kind)
    power, velocity = spectrum(target.micro)
    # wander and drift move a rate by at most some per cent; acceleration smears the body
    limit = target.truth["tip_mps"] * np.cos(target.truth["beta_rad"]) * 1.12 + 3
    away = abs(velocity[None, :] - target.truth["velocity_mps"][:, None])
    folded = np.minimum(away, 2 * RADAR.unambiguous_mps - away)
    outside = np.where(folded > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3


def test_a_walkers_limbs_stay_below_three_times_the_torso():
    target = draw_discrete(draws(40, 3), RADAR, "person")
    power, velocity = spectrum(target.micro)
    limit = 3.6 * abs(target.truth["velocity_mps"]) + 0.8  # resolution at 0.1 s
    outside = np.where(abs(velocity)[None, :] > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3


def test_wheels_run_from_rest_to_twice_the_vehicle():
    target = draw_discrete(draws(40, 4), RADAR, "vehicle")
    power, velocity = spectrum(target.micro)
    speed, acceleration = target.truth["velocity_mps"], target.truth["acceleration_mps2"]
    margin = abs(acceleration) * RADAR.dwell_s + 0.8
    along = velocity[None, :] * np.sign(speed)[:, None]
    inside = (along > -margin[:, None]) & (along < (2 * abs(speed) + margin)[:, None])
    assert (np.where(inside, power, 0).sum(axis=1) / power.sum(axis=1)).min() > 0.999


def test_turbine_blades_stay_below_their_tip_and_the_tower_rests():
    target = draw_discrete(draws(40, 5), RADAR, "wind_turbine")
    power, velocity = spectrum(target.micro)
    limit = target.truth["tip_mps"] + 0.8
    outside = np.where(abs(velocity)[None, :] > limit[:, None], power, 0).sum(axis=1) / power.sum(axis=1)
    assert outside.max() < 1e-3
    np.testing.assert_array_equal(target.body, target.body[:, :1] * np.ones(RADAR.pulses, np.complex64))
