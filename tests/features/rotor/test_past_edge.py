"""What flashes past the edge of the lines that are told apart says that they do not end there."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.rotor.past_edge import past_edge
from bladewing.features.rotor.periodogram import prepare
from bladewing.simulate import Scene
from bladewing.simulate.catalogue import AIRFRAMES

from ..signals import CARRIER_HZ, PRF_HZ, folded, rotors, white

RADAR = {"carrier_hz": 77e9, "prf_hz": 20e3}  # velocities are told to 19.5 m/s


def dwells(seed: int, velocity_mps: float) -> np.ndarray:
    """Two of 80 ms of a quadcopter of tips at 53.5 m/s."""
    drone = AIRFRAMES["quadcopter_12cm"].fields | {"name": "drone", "velocity_mps": velocity_mps}
    iq = Scene.build({"radar": RADAR | {"pulses": 4096}, "uav": [drone]}).render(seed).iq
    return iq[:3200].reshape(2, 1600)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("velocity_mps", [-3.0, 5.0])
def test_tips_some_times_the_unambiguous_velocity_give_no_band(seed, velocity_mps):
    """A tip at 12.6 +- 0.26 m/s was told, and that there is no rotor: the band ends at 3 m/s."""
    found = measure(dwells(seed, velocity_mps), **RADAR)
    assert np.isnan(found.tip_speed_mps).all()
    for reason, band in zip(found.reason, found.band_reason, strict=True):
        assert str(reason).startswith("no comb: lines are told apart to") or "lines may fill" in str(band)
        assert "raise the PRF" in str(reason) + str(band)


@pytest.mark.parametrize(("times", "seed"), [(2.5, 6)])
def test_of_rotors_at_the_noise_too(times, seed):
    iq, radar, rates_hz, _ = folded(seed, times, count=4, spread=0.02, snr_db=0.0)
    found = measure(iq, **radar)
    assert found.chopping_hz == pytest.approx(2 * rates_hz.mean(), rel=0.02)
    assert np.isnan(found.tip_speed_mps)  # it was 14.7 +- 2.2 of 101 m/s
    assert "raise the PRF" in str(found.band_reason)


def seen_past(iq: np.ndarray, edge_mps: float, rate_hz: float):
    data = prepare(iq.astype(np.complex64), carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    edge = edge_mps / data.span_mps
    return past_edge(data, iq, 0.0, np.array([2 * rate_hz / PRF_HZ]), (edge, 0.01 * edge))


@pytest.mark.parametrize("noise", [0.03, 0.3, 1.0])
def test_it_flashes_within_the_band_and_not_past_it(noise):
    iq = rotors([100.0], length_m=0.15) + noise * white(np.random.default_rng(1), 3000)
    tip_mps = 2 * np.pi * 100 * 0.15
    within, past = seen_past(iq, tip_mps / 3, 100.0), seen_past(iq, tip_mps, 100.0)
    assert within.seen
    assert within.flashes
    assert past.seen
    assert not past.flashes


def test_noise_does_not_flash():
    rng = np.random.default_rng(2)
    assert not any(seen_past(white(rng, 3000), rng.uniform(10, 200), rng.uniform(20, 200)).flashes for _ in range(100))


def test_nothing_is_seen_past_the_end_of_the_span():
    iq = rotors([100.0], length_m=0.15) + white(np.random.default_rng(1), 3000)
    assert not seen_past(iq, 0.499 * 299_792_458.0 / CARRIER_HZ * PRF_HZ / 2, 100.0).seen
