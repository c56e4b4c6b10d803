from functools import cache

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.acceleration import body_acceleration, without_acceleration
from bladewing.features.heave import heave
from bladewing.features.steady_comb import steady_comb
from bladewing.simulate import Scene

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, tone, white


def accelerated(iq, acceleration_mps2):
    time_s = (np.arange(iq.shape[-1]) - (iq.shape[-1] - 1) / 2) / PRF_HZ
    return iq * np.exp(-2j * np.pi * acceleration_mps2 * time_s**2 / WAVELENGTH_M)


@pytest.mark.parametrize("acceleration_mps2", [30.0, -30.0])
def test_a_smeared_comb_is_found_after_the_removal_and_not_before(acceleration_mps2):
    iq = accelerated(rotors([57.7], body=10.0, velocity_mps=-5.0), acceleration_mps2) + white(
        np.random.default_rng(1), PULSES
    )
    assert np.isnan(measure(iq, **RADAR).chopping_hz)
    found, _, smeared = body_acceleration(iq, **RADAR)
    assert smeared
    assert found == pytest.approx(acceleration_mps2, abs=0.2)
    after = measure(without_acceleration(iq, found, **RADAR), **RADAR)
    assert after.chopping_hz == pytest.approx(115.4, abs=0.1)


def test_the_deviation_of_an_acceleration_is_true():
    rng = np.random.default_rng(2)
    draws, truth = 40, 12.3
    iq = accelerated(np.tile(tone(777.7), (draws, 1)), truth) + white(rng, draws, PULSES)
    found, std, smeared = body_acceleration(iq, **RADAR)
    assert smeared.all()
    # a mean square of 40 normal errors lies within 0.45 and 1.8 in all but one of 1000 cases
    assert 0.45 < np.mean(((found - truth) / std) ** 2) < 1.8


@pytest.mark.parametrize("height_db", [24.0, 40.0])
@pytest.mark.parametrize("truth", [-17.7, 0.2, 12.3])
def test_the_acceleration_of_a_long_dwell_is_as_sure(height_db, truth):
    # 0.8 s: 1600 steps of acceleration, most of which are never looked at
    prf_hz, pulses = 8e3, 6400
    time_s = (np.arange(pulses) - (pulses - 1) / 2) / prf_hz
    line = np.exp(-2j * np.pi * (1234.5 * time_s + truth * time_s**2 / WAVELENGTH_M))
    noise = white(np.random.default_rng(7), pulses) * np.sqrt(pulses / 10 ** (height_db / 10))
    found, std, smeared = body_acceleration(line + noise, carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
    assert abs(found - truth) < 4 * std
    assert smeared


@pytest.mark.parametrize("pulses", [1600, 4096])
@pytest.mark.parametrize("snr_db", [0, 20, 40])
def test_the_deviation_is_the_bound_at_any_snr(pulses, snr_db):
    rng = np.random.default_rng(pulses + snr_db)
    line = accelerated(10 ** (snr_db / 20) * tone(-216.8, pulses), 4.0)
    found, std, _ = body_acceleration(line + np.array([white(rng, pulses) for _ in range(8)]), **RADAR)
    bound = np.sqrt(90 / (10 ** (snr_db / 10) * pulses**5)) * PRF_HZ**2 * WAVELENGTH_M / (2 * np.pi)
    assert 0.9 < np.median(std / bound) < 1.4
    assert np.all((std > 0.9 * bound) & (std < 3 * bound))
    assert np.all(np.abs(found - 4.0) < 5 * bound)


def test_steady_dwells_noise_and_silence_are_left_alone():
    rng = np.random.default_rng(3)
    iq = np.stack([rotors([57.7], body=5.0) + white(rng, PULSES), white(rng, PULSES), np.zeros(PULSES)])
    found, _, smeared = body_acceleration(iq.astype(np.complex64), **RADAR)
    assert not smeared.any()
    assert np.isnan(found[1:]).all()
    kept = without_acceleration(iq, np.zeros(3), **RADAR)
    assert np.array_equal(kept, iq.astype(np.complex64))


def test_an_acceleration_for_every_record_is_asked_for():
    iq = np.ones((2, 4, PULSES), np.complex64)
    whole = without_acceleration(iq, np.full((2, 4), 3.0), **RADAR)
    for alike in (3.0, np.full(4, 3.0), np.full((2, 1), 3.0)):
        assert np.array_equal(without_acceleration(iq, alike, **RADAR), whole)
    for shape in (3, (4, 2), (1, 2, 4)):
        with pytest.raises(ValueError, match=r"acceleration_mps2 has shape .*: it must have that .* iq, \(2, 4\)"):
            without_acceleration(iq, np.ones(shape), **RADAR)


def test_acceleration_batch_gain_and_scale():
    iq = accelerated(np.stack([rotors([57.7], body=5.0)] * 2), np.array([[8.0], [-20.0]]))
    iq = iq + white(np.random.default_rng(4), 2, PULSES)
    together = body_acceleration(iq, **RADAR)[0]
    for index in range(2):
        assert body_acceleration(1e3j * iq[index], **RADAR)[0] == pytest.approx(together[index], rel=1e-3)
        for largest in (1e-40, 3.3e38):
            extreme = (iq[index] * (largest / abs(iq[index]).max())).astype(np.complex64)
            assert body_acceleration(extreme, **RADAR)[0] == pytest.approx(together[index], rel=2e-2)
    scaled = body_acceleration(iq, carrier_hz=2 * CARRIER_HZ, prf_hz=2 * PRF_HZ)[0]
    np.testing.assert_allclose(scaled, 2 * together, rtol=1e-3)


@cache
def over_ground(airframe: str) -> np.ndarray:
    """Records of 2000 pulses of a hovering UAV over ground; shorter ones begin alike."""
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 25e3, "pulses": 2000}
    ground = {"name": "ground", "kind": "ground", "level_db": 10.0}
    scene = Scene.build({"radar": radar, "uav": [{"name": "uav", "airframe": airframe}], "clutter": [ground]})
    return np.stack([scene.render(seed).iq for seed in range(64)])


@pytest.mark.parametrize("airframe", ["quadcopter_12cm", "fixed_wing_15cm", "helicopter_41cm", "hexacopter_30cm"])
@pytest.mark.parametrize("pulses", [500, 1000, 2000])
def test_blades_and_a_background_beside_the_line_show_in_its_deviation(airframe, pulses):
    # the hexacopter has no line that stands out: its blades gave -25.9 +- 0.02 m/s^2
    iq = over_ground(airframe)[:, :pulses]
    found, std, smeared = body_acceleration(iq, carrier_hz=CARRIER_HZ, prf_hz=25e3)
    # one in ten at most: of a few draws alone, more or fewer by chance
    assert (np.abs(found) > 4 * std).mean() <= 1 / 10
    # and what is taken out is less than a line is wide
    assert smeared.mean() <= 1 / 12
    step_mps2 = WAVELENGTH_M / 2 * (25e3 / pulses) ** 2
    assert np.all(np.abs(found[smeared]) < step_mps2)


@pytest.mark.parametrize("wind_mph", [10.0, 30.0])
def test_ground_that_sways_is_no_body_that_accelerates(wind_mph):
    # its own line bent by up to ten bins, so that one steady rotor before it counted as three or more
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 25e3, "pulses": 4000}
    ground = {"name": "ground", "kind": "ground", "level_db": 40.0, "values": {"wind_mph": wind_mph}}
    scene = Scene.build({"radar": radar, "clutter": [ground]})
    iq = np.stack([scene.render(seed).iq for seed in range(80)])
    assert not body_acceleration(iq, carrier_hz=CARRIER_HZ, prf_hz=25e3)[2].any()


def test_a_hovering_body_that_accelerates_before_weaker_ground_is_steadied():
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 25e3, "pulses": 2000}
    ground = {"name": "ground", "kind": "ground", "level_db": 10.0}
    uav = {"name": "uav", "airframe": "quadcopter_12cm", "velocity_mps": -0.32, "acceleration_mps2": 8.0}
    scene = Scene.build({"radar": radar, "uav": [uav], "clutter": [ground]})
    iq = np.stack([scene.render(seed).iq for seed in range(80)])
    assert body_acceleration(iq, carrier_hz=CARRIER_HZ, prf_hz=25e3)[2].mean() > 0.8  # 0.88 of many, 0.04 of these


@pytest.mark.parametrize("pulses", [8, 500])
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_not_finite_and_no_radar_are_refused(pulses, wrong):
    iq = tone(0.1, pulses) if pulses > 100 else np.ones(pulses, np.complex64)
    for find in (body_acceleration, heave, steady_comb):
        for radar in ({**RADAR, "carrier_hz": 0.0}, {**RADAR, "prf_hz": -1.0}):
            with pytest.raises(ValueError, match="must be a finite number above 0"):
                find(iq, **radar)
        with pytest.raises(ValueError, match="not finite"):
            find(np.where(np.arange(pulses) == 3, wrong, iq).astype(np.complex64), **RADAR)


@pytest.mark.parametrize("value", [3 - 4j, (12 - 7j) / 32768, 1e-20, 1e20])
def test_a_constant_has_a_body_at_rest_and_no_acceleration(value):
    samples = np.full((2, 800), value, np.complex64)
    samples[1] += np.complex64(abs(value) / 100) * white(np.random.default_rng(0), 800).astype(np.complex64)
    found, std, smeared = body_acceleration(samples, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    assert np.isfinite(std).all()
    assert (std > 0).all()
    np.testing.assert_allclose(found, 0, atol=1e-2)
    assert not smeared.any()


@pytest.mark.parametrize("smear_bins", [0.3, 0.9, 1.6, 2.4, 2.8, 3.2])
def test_a_smear_of_a_fraction_of_a_bin_to_some_is_taken_out_and_one_rotor_stays_one(smear_bins):
    step_mps2 = WAVELENGTH_M / 2 * (PRF_HZ / PULSES) ** 2
    rng = np.random.default_rng(int(10 * smear_bins))
    for _ in range(4):
        rates_hz, velocity_mps = rng.uniform(45, 90, 1), rng.uniform(-15, 15)
        iq = accelerated(10 * rotors(rates_hz, body=10.0, velocity_mps=velocity_mps), smear_bins * step_mps2)
        iq = iq + white(rng, PULSES)
        found, std, smeared = body_acceleration(iq, **RADAR)
        assert smeared
        assert abs(found - smear_bins * step_mps2) < 5 * std
        after = measure(without_acceleration(iq, found, **RADAR), **RADAR)
        assert after.rotor_count == 1
        assert after.rotors_resolved
        assert after.chopping_hz == pytest.approx(2 * rates_hz[0], rel=1e-4)


def test_no_acceleration_found_is_none_to_take_out():
    iq = white(np.random.default_rng(2), 2, PULSES)
    with pytest.raises(ValueError, match=r"acceleration_mps2 holds a value that is not finite.* put 0 there"):
        without_acceleration(iq, np.array([np.nan, 1.0]), **RADAR)


def test_ground_that_sways_is_in_the_deviation_of_what_hovers_before_it():
    scene = Scene.load("quadcopter")
    iq = np.stack([scene.render(seed=seed).iq for seed in range(30)])
    found, std, smeared = body_acceleration(iq, carrier_hz=scene.radar.carrier_hz, prf_hz=scene.radar.prf_hz)
    assert not smeared.any()
    # a mean square of 30 normal errors lies below 2.0 in all but one of 1000 cases; it was 7
    assert np.nanmean((found / std) ** 2) < 2.0


def test_of_a_dwell_that_a_silence_breaks_the_longest_stretch_is_searched():
    """It was sought in the whole, and not found: what `measure` then measured of the stretch was smeared."""
    whole = accelerated(100 * tone(777.7), 12.3) + white(np.random.default_rng(3), PULSES)
    broken = np.where(np.arange(PULSES) < PULSES * 0.35, 0, whole)
    found = body_acceleration(np.stack([broken, whole]), **RADAR)
    alone = body_acceleration(broken[broken != 0], **RADAR)
    for both, one in zip(found, alone, strict=True):
        assert both[0] == pytest.approx(one, rel=1e-6)
    assert found[2].all()
    assert abs(found[0][0] - 12.3) < 4 * found[1][0]


def test_one_channel_that_accelerates_stays_one_and_has_no_band():
    """Turned, it passed for two: a tip was told, half as fast again as it is."""
    iq = accelerated(rotors([58.61], velocity_mps=5.0, body=20.0), 15.0) + white(np.random.default_rng(2), PULSES) / 3
    one = iq.real + 0j
    pull, _, smeared = body_acceleration(one, **RADAR)
    assert smeared
    assert abs(pull) == pytest.approx(15.0, rel=0.1)
    found = measure(without_acceleration(one, pull, **RADAR), **RADAR)
    assert "one channel" in str(found.band_reason)
    assert found.chopping_hz == pytest.approx(2 * 58.61, rel=1e-3)
