"""What `measure` says at radars and dwells far from those that rotors are usually measured with."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor import rotors
from bladewing.features.rotor.comb import LEAST_REACH_MPS
from bladewing.simulate import Radar, draw_records

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, folded, moving_at, rotors_by_chance, white
from .signals import rotors as blades


def comb(prf_hz: float, pulses: int, spacing_hz: float, amplitudes: np.ndarray, seed: int = 0) -> np.ndarray:
    """Lines about velocity zero, amplitudes of orders 0, 1, -1, 2, ..., of random phases, in noise."""
    rng = np.random.default_rng(seed)
    order = np.arange(len(amplitudes))
    order = np.where(order % 2, -(order + 1) // 2, order // 2)
    turns = np.outer(np.arange(pulses) / prf_hz, order * spacing_hz) + rng.uniform(size=len(order))
    return np.exp(2j * np.pi * turns) @ amplitudes + white(rng, pulses)


def test_lines_beyond_every_blades_speed_give_no_band():
    radar = {"carrier_hz": 2e9, "prf_hz": 100e3}  # 3700 m/s to each side
    whole = measure(comb(100e3, 8000, 116.3, np.append(20, np.full(800, 0.2))), **radar)
    assert abs(whole.chopping_hz - 116.3) < 0.5
    assert np.isnan([whole.tip_speed_mps, whole.bandwidth_hz]).all()
    assert "some 250 m/s from the body, faster than any blade's tip" in str(whole.band_reason)
    some = measure(comb(100e3, 8000, 116.3, np.append(20, np.full(20, 1.0))), **radar)
    assert abs(some.tip_speed_mps - 10.5 * 116.3 * 299_792_458 / 2e9 / 2) < 10
    assert some.band_reason == ""


def test_no_tip_is_faster_than_any_blades():
    radar = Radar(2e9, 1e5, 8000)
    iq = draw_records(radar, 12, 21, kind="quadcopter").iq
    tips = measure(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz).tip_speed_mps
    assert np.isfinite(tips).sum() > 3
    assert not (tips > 300).any()


def test_an_angle_that_makes_the_tip_faster_than_any_blades_leaves_the_band_alone():
    iq = comb(PRF_HZ, PULSES, 130.0, np.append(20, np.full(60, 1.0)))
    seen, turned = (measure(iq, **RADAR, blades=2, beta_rad=beta_rad) for beta_rad in (0.0, 1.5))
    assert seen.tip_speed_mps < 250 < seen.tip_speed_mps / np.cos(1.5)
    assert turned.bandwidth_hz == seen.bandwidth_hz
    assert np.isnan([turned.tip_speed_mps, turned.tip_speed_mps_std, turned.blade_length_m]).all()
    assert "beta of 85.94367 deg" in str(turned.band_reason)


def test_no_rotor_is_left_whose_band_ends_below_those_of_rotors():
    radar = Radar(1e11, 1e5, 6000)
    birds = draw_records(radar, 12, 11, start=12, kind="flapping_bird").iq
    found = measure(birds, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    some = np.isfinite(found.tip_speed_mps)
    assert (found.tip_speed_mps + found.tip_speed_mps_std >= LEAST_REACH_MPS)[some].all()
    assert np.isnan(found.chopping_hz[found.reason != ""]).all()


@pytest.mark.parametrize("weak", [0.0, 0.3])
def test_a_hum_between_whose_lines_others_stand_is_one(weak):
    strong = np.arange(1, 242) // 2 % 3 == 0  # every third of 20 Hz
    hum = measure(comb(20e3, 6000, 20.0, np.where(strong, 1.0, weak)), carrier_hz=24e9, prf_hz=20e3)
    assert "60.0 Hz may be the mains" in str(hum.reason)


def test_rotors_of_more_lines_than_are_fitted_together_are_not_told_apart(monkeypatch):
    iq = blades([56.6, 57.4, 58.3]) * 3 + white(np.random.default_rng(0), PULSES)
    assert measure(iq, **RADAR).rotor_count == 3
    monkeypatch.setattr(rotors, "MOST_LINES", 40)
    found = measure(iq, **RADAR)
    assert (found.rotor_count, found.rotors_resolved) == (1, False)


@pytest.mark.parametrize(("dwell_s", "chopping_hz"), [(0.01, 300.5), (0.02, 240.5), (0.02, 200.5)])
def test_a_short_dwell_does_not_tell_a_moving_rotor_from_hum_and_so_does_not_refuse_it(dwell_s, chopping_hz):
    """Any place is near a multiple of 50 or 60 Hz where these lie within a few bins of one another."""
    times_s = np.arange(round(dwell_s * PRF_HZ)) / PRF_HZ
    for seed in range(12):
        rng = np.random.default_rng(seed)
        blades = rotors_by_chance(rng, [chopping_hz / 2], times_s, wavelength_m=WAVELENGTH_M, length_m=0.1)
        iq = (blades + 3) * moving_at(rng.uniform(3, 15), times_s)
        found = measure(10 * iq + white(rng, len(times_s)), carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
        assert found.chopping_hz == pytest.approx(chopping_hz, rel=0.01)


@pytest.mark.parametrize(("times", "count", "least"), [(0.5, 1, 1), (0.5, 2, 0), (0.8, 4, 0)])
def test_an_edge_that_is_lost_in_the_noise_is_none(times, count, least):
    """Tips of 35 +- 31, 45 +- 43 and 7 +- 16 m/s were told of such of 75 to 106."""
    lost = 0
    for seed in range(14):
        iq, radar, _, _ = folded(seed, times, count=count, spread=0.03, snr_db=-12.0)
        found = measure(iq, **radar)
        assert np.isnan(found.tip_speed_mps) or found.tip_speed_mps_std < 0.3 * found.tip_speed_mps
        assert np.isnan(found.tip_speed_mps) == np.isnan(found.bandwidth_hz) == bool(found.band_reason or found.reason)
        lost += "lost in the noise" in str(found.band_reason)
    assert lost >= least
