import numpy as np
import pytest
from bladewing.features.heave import heave
from bladewing.features.wingbeat import wingbeat
from bladewing.simulate import Scene

from .signals import CARRIER_HZ, PRF_HZ, WAVELENGTH_M, moving_at, tone, white

LONG = {"carrier_hz": CARRIER_HZ, "prf_hz": 4e3}
SECONDS = 2.5


def bird(species, snr_db, seed=0, **changes):
    """A bird whose wings have `snr_db` a sample, and its truth."""
    radar = {**LONG, "pulses": round(SECONDS * LONG["prf_hz"])}
    values = {"name": "bird", "species": species, "heading_deg": 50.0, "velocity_mps": 6.0, "acceleration_mps2": -1.5}
    values |= changes
    quiet = {**values, "wing_db": 0.0, "body_db": -150.0}
    wings = Scene.build({"radar": radar, "bird": [quiet], "off": ["noise"]}).render(seed).iq
    values |= {"wing_db": snr_db - 10 * np.log10(np.mean(np.abs(wings) ** 2)), "body_db": snr_db + 10.0}
    drawn = Scene.build({"radar": radar, "bird": [values]}).render(seed)
    return drawn.iq, drawn.truth[0]


BIRDS = ("mute_swan", "herring_gull", "jackdaw", "swallow", "starling")


# a siskin's wings hardly leave the body's cell at this carrier: below 5 dB it cannot be told from fading
@pytest.mark.parametrize(
    ("species", "snr_db"), [(name, snr_db) for name in BIRDS for snr_db in (0.0, 10.0)] + [("siskin", 5.0)]
)
def test_birds_beat_at_their_rate(species, snr_db):
    iq, truth = bird(species, snr_db)
    found = wingbeat(iq, **LONG)
    assert found.wingbeat_hz == pytest.approx(truth["wingbeat_hz"], abs=0.3)
    assert found.acceleration_mps2 == pytest.approx(-1.5, abs=0.2)
    assert found.reason == ""


def scene(**parts):
    return Scene.build({"radar": {**LONG, "pulses": 10000}, **parts}).render(1).iq


@pytest.mark.parametrize("airframe", ["helicopter_41cm", "quadcopter_12cm", "hexacopter_30cm"])
def test_rotors_do_not_beat(airframe):
    found = wingbeat(scene(uav=[{"name": "uav", "airframe": airframe, "beta_deg": 20.0}]), **LONG)
    assert np.isnan(found.wingbeat_hz)
    assert str(found.reason).startswith("no wingbeat")


def test_clutter_noise_and_silence_do_not_beat():
    rng = np.random.default_rng(5)
    kinds = ("ground", "sea", "rain")
    clutter = [scene(clutter=[{"name": kind, "kind": kind, "level_db": 20.0}]) for kind in kinds]
    found = wingbeat(np.stack([*clutter, *white(rng, 3, 10000), np.zeros(10000)]), **LONG)
    assert np.isnan(found.wingbeat_hz).all()
    assert all(found.reason)
    assert "unambiguous only" in str(wingbeat(white(rng, 4000), carrier_hz=CARRIER_HZ, prf_hz=1.5e3).reason)
    assert "less than" in str(wingbeat(white(rng, 2000), **LONG).reason)


@pytest.mark.parametrize("carrier_hz", [1e8, 2.45e8, 3e8])
def test_a_wave_too_long_for_wings_gets_a_reason(carrier_hz):
    rng = np.random.default_rng(1)
    iq = np.exp(2j * np.pi * 3 * np.arange(1700) / 1e3) + 0.1 * white(rng, 1700)
    found = wingbeat(iq, carrier_hz=carrier_hz, prf_hz=1e3)
    assert np.isnan(found.wingbeat_hz)
    assert "no wingbeat" in str(found.reason)


def test_fading_does_not_beat():
    # a gain that swings at the rate of a gull's wings, over a body and a wide echo about it
    rng = np.random.default_rng(6)
    time_s = np.arange(10000) / LONG["prf_hz"]
    spread = np.fft.ifft(np.fft.fft(white(rng, 10000)) * (np.abs(np.fft.fftfreq(10000)) < 0.05))
    gain = np.exp(np.sin(2 * np.pi * 4.0 * time_s))
    iq = gain * (20 * tone(-500.0 / LONG["prf_hz"] * PRF_HZ, pulses=10000) + 10 * spread) + white(rng, 10000)
    found = wingbeat(iq, **LONG)
    assert np.isnan(found.wingbeat_hz)
    assert "as fading does" in str(found.reason) or "nothing repeats" in str(found.reason)


def scatterers(rng, velocity_mps, swing_mps, rate_hz, body):
    """A body, and scatterers whose speed swings about its own, as limbs and wheels have them."""
    time_s = np.arange(10000) / LONG["prf_hz"]
    turn = 2 * np.pi * rate_hz
    iq = body * moving_at(velocity_mps, time_s)
    for share in rng.uniform(0.5, 1.0, 8):
        path = velocity_mps * time_s + share * swing_mps / turn * np.sin(turn * time_s + rng.uniform(0, 2 * np.pi))
        iq = iq + np.exp(-4j * np.pi * path / WAVELENGTH_M + 2j * np.pi * rng.uniform())
    return iq + white(rng, 10000)


@pytest.mark.parametrize(
    ("velocity_mps", "swing_mps", "rate_hz"), [(8.0, 8.0, 4.0), (14.0, 14.0, 7.0), (1.5, 3.0, 1.7)]
)
def test_wheels_and_limbs_are_no_wings(velocity_mps, swing_mps, rate_hz):
    for seed in range(5):
        iq = scatterers(np.random.default_rng(seed), velocity_mps, swing_mps, rate_hz, 15.0)
        assert np.isnan(wingbeat(iq, **LONG).wingbeat_hz)


def test_wingbeat_batch_gain_and_scale():
    iq, _ = bird("starling", 5.0)
    alone = wingbeat(iq, **LONG)
    together = wingbeat(np.stack([iq, 50j * iq])[:, None], **LONG)
    np.testing.assert_allclose(together.wingbeat_hz[:, 0], alone.wingbeat_hz, rtol=1e-4)
    np.testing.assert_allclose(together.acceleration_mps2[:, 0], alone.acceleration_mps2, rtol=1e-3)
    for largest in (1e-40, 3.3e38):
        extreme = wingbeat((iq * (largest / abs(iq).max())).astype(np.complex64), **LONG)
        assert extreme.wingbeat_hz == pytest.approx(float(alone.wingbeat_hz), rel=1e-2)


@pytest.mark.parametrize(("heading_deg", "velocity_mps"), [(0.0, 6.0), (20.0, 8.0), (40.0, 6.0), (0.0, 12.0)])
def test_a_gull_flies_as_far_a_beat_as_a_wheel_rolls_a_turn_but_flashes(heading_deg, velocity_mps):
    iq, truth = bird("herring_gull", 10.0, heading_deg=heading_deg, velocity_mps=velocity_mps)
    found = wingbeat(iq, **LONG)
    assert found.wingbeat_hz == pytest.approx(truth["wingbeat_hz"], abs=0.3), found.reason


@pytest.mark.parametrize("level", [3.0, 500.0])
def test_silences_do_not_beat(level):
    """A quarter of each tenth of a second is silent; where 1.5 s are whole, these are looked at."""
    count = 16_000
    steady = level * tone(-10 / WAVELENGTH_M, count, prf_hz=8e3) + white(np.random.default_rng(1), count)
    gated = np.where(np.arange(count) % 800 < 200, 0, steady).astype(np.complex64)
    found = wingbeat(gated, carrier_hz=CARRIER_HZ, prf_hz=8e3)
    assert np.isnan(found.wingbeat_hz)
    assert "silences leave less than 1.5 s in one piece" in str(found.reason)
    assert np.isnan([found.velocity_mps, found.acceleration_mps2]).all()
    assert np.isnan(heave(gated, carrier_hz=CARRIER_HZ, prf_hz=8e3).heave_hz)
    once = np.where(np.arange(count) // 200 == 5, 0, steady).astype(np.complex64)
    assert "silences" not in str(wingbeat(once, carrier_hz=CARRIER_HZ, prf_hz=8e3).reason)


@pytest.mark.parametrize("wingbeat_hz", [9.9, 10.05, 12.2, 19.9])
def test_a_heave_makes_no_slope(wingbeat_hz):
    """Dwells of a tenth of a second side by side made one of a heave of that rate, hundreds of deviations off."""
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 8e3}
    bird = {"name": "bird", "species": "starling", "wingbeat_hz": wingbeat_hz, "heave_m": 0.004, "elevation_deg": 30.0}
    bird |= {"velocity_mps": 5.0, "acceleration_mps2": 1.0, "heading_deg": 40.0, "body_db": 25.0}
    birds = [bird | {"phase_deg": phase} for phase in (0.0, 135.0, 225.0)]
    scenes = [Scene.build({"radar": {**radar, "pulses": 20_000}, "bird": [one]}) for one in birds]
    iq = [one.render(1, full=True).iq for one in scenes]
    found = wingbeat(np.stack(iq), **radar)
    np.testing.assert_array_less(np.abs(found.acceleration_mps2 - 1), 2.5 * found.acceleration_mps2_std)
    np.testing.assert_array_less(found.acceleration_mps2_std, 0.1)


@pytest.mark.parametrize("species", ["swallow", "siskin"])
def test_a_bird_that_pauses_has_the_rate_of_its_beating_wings(species):
    """In pauses the wings' phase stands still: a line beside the rate was told, 10 to 60 deviations off."""
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": 8e3}
    bird = {"name": "bird", "species": species, "velocity_mps": 5.0, "wing_db": 20.0, "body_db": 20.0}
    errors, stds = [], []
    for seed, heading_deg in enumerate((20.0, 140.0, 200.0, 320.0)):
        one = bird | {"heading_deg": heading_deg, "elevation_deg": 30.0}
        rendering = Scene.build({"radar": {**radar, "pulses": 28_000}, "bird": [one]}).render(seed)
        found = wingbeat(rendering.iq, **radar)
        errors.append(found.wingbeat_hz - rendering.truth[0]["wingbeat_hz"])
        stds.append(found.wingbeat_hz_std)
    told = np.isfinite(errors)
    assert told.sum() >= 3
    assert (np.abs(np.array(errors)[told]) < np.minimum(0.3, 4 * np.array(stds)[told])).all()


@pytest.mark.parametrize(("snr_db", "pulses"), [(0.0, 6000), (20.0, 12_000)])
def test_the_deviation_of_a_recordings_acceleration_is_true(snr_db, pulses):
    """Of dwells that overlap the errors take one another away: it was three times too wide."""
    prf_hz, rng = 4e3, np.random.default_rng(pulses)
    times_s = (np.arange(pulses) - (pulses - 1) / 2) / prf_hz
    velocity_mps, truth = rng.uniform(3, 15, (40, 1)), rng.uniform(-2, 2, (40, 1))
    range_m = velocity_mps * times_s + truth / 2 * times_s**2
    iq = 10 ** (snr_db / 20) * np.exp(-4j * np.pi * range_m / WAVELENGTH_M) + white(rng, 40, pulses)
    found = wingbeat(iq, carrier_hz=CARRIER_HZ, prf_hz=prf_hz)
    errors = (found.acceleration_mps2 - truth[:, 0]) / found.acceleration_mps2_std
    # of 40 normal errors the mean square lies within 0.45 and 1.8; the medians of slopes are off by twice what least
    # squares are, as the deviation has it, or by a little less
    assert 0.3 < np.mean(errors**2) < 1.8
