"""The numbers read off an STFT image, on inputs whose answer is known."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from bladewing.features.shape import SPEED_BANDS_MPS

from .signals import CARRIER_HZ, PRF_HZ, PULSES, TIMES_S, WAVELENGTH_M, by_name, tone, white

#: Cadences of frames over a dwell stand so far apart [Hz].
CADENCE_HZ = PRF_HZ / PULSES

joint = partial(by_name, which="joint_features")


def line(velocity_mps: float, level: float = 30.0) -> np.ndarray:
    return level * tone(-2 * velocity_mps / WAVELENGTH_M)


def noise(seed: int = 0) -> np.ndarray:
    return white(np.random.default_rng(seed), PULSES)


@pytest.mark.parametrize("rate_hz", [35.0, 50.0, 70.0])
def test_flashes_show_their_rate(rate_hz):
    flashing = 20 * noise(1) * (rate_hz * TIMES_S % 1 < 0.2)
    values = joint(flashing + noise(2))
    assert 10 ** values["flash_log"] == pytest.approx(rate_hz, abs=0.75 * CADENCE_HZ)
    assert values["flash_strength"] > 1.5
    steady = joint(20 * noise(1) + noise(2))
    assert values["frame_swing_db"] > 3 * steady["frame_swing_db"]


def test_flashes_of_the_body_s_speeds_are_none():
    """Limbs and bodies come and go too, below 8 m/s."""
    swell = 1 + np.sin(2 * np.pi * 50.0 * TIMES_S)
    for velocity_mps, seen in ((3.0, [0, 1, 2]), (30.0, [6])):
        iq = np.stack([line(velocity_mps) * swell + noise(seed) for seed in range(6)])
        off_hz = np.abs(10 ** joint(iq)["flash_log"] - 50.0)
        assert (off_hz < 0.75 * CADENCE_HZ).sum() in seen


def test_power_that_peaks_once_is_peakier_than_what_stays():
    """Kurtosis of one frame in n that is above all others, n - 2 + 1/(n - 1); of two equal halves 1."""
    middle_s = TIMES_S[-1] / 2
    once = line(30.0, 1e3) * (np.abs(TIMES_S - middle_s) < 1e-3)
    half = line(30.0, 1e3) * (middle_s > TIMES_S)
    one, two = (float(joint(iq + noise(2))["frame_kurtosis"]) for iq in (once, half))
    assert 4 < one < 31
    assert two == pytest.approx(1.0, abs=0.5)


@pytest.mark.parametrize("velocity_mps", [-55.0, -9.0, 4.0, 18.0])
def test_a_steady_line_stands_in_the_band_of_its_speed_and_swings_nowhere(velocity_mps):
    values = joint(line(velocity_mps, 3.0) + noise())
    bands = [f"{low:g}_{high:g}_db" for low, high in pairwise(SPEED_BANDS_MPS)]
    own = next(b for b, high in zip(bands, SPEED_BANDS_MPS[1:], strict=True) if abs(velocity_mps) < high)
    for what in ("joint_mean", "joint_peak"):
        assert max(bands, key=lambda band: values[f"{what}_{band}"]) == own
    assert values[f"joint_swing_{own}"] < 0.2 * values[f"joint_mean_{own}"]
    assert values["joint_bandwidth_mps"] < 30  # now and then a bin of noise stands over 6 dB
    assert values["joint_centroid_swing_mps"] < 8
    assert values["frame_swing_db"] < 1


def test_the_band_of_two_lines_is_as_wide_as_they_lie_apart():
    apart = joint(line(-20.0, 3.0) + line(25.0, 3.0) + noise())
    lobe_mps = 4 * PRF_HZ / (PULSES // 8) * WAVELENGTH_M / 2  # of a frame's window
    assert 45 < apart["joint_bandwidth_mps"] < 45 + 2 * lobe_mps
    assert apart["joint_bandwidth_swing_mps"] < 10
    # by turns, at 12 Hz: each frame is narrow, and where it lies swings by half of what they lie apart
    first = np.sin(2 * np.pi * 12.0 * TIMES_S) > 0
    turns = joint(np.where(first, line(-20.0), line(25.0)) + noise())
    assert turns["joint_centroid_swing_mps"] == pytest.approx(22.5, abs=7.0)


def test_noise_fills_the_image_evenly_and_a_line_a_part_of_it():
    assert joint(noise())["joint_entropy"] > joint(line(20.0) + noise())["joint_entropy"] + 0.05


def test_silence_has_nothing():
    values = joint(np.zeros(PULSES, complex))
    assert values["joint_bandwidth_mps"] == values["flash_log"] == values["flash_strength"] == 0
    assert values["frame_kurtosis"] == values["frame_swing_db"] == values["joint_centroid_swing_mps"] == 0


@pytest.mark.parametrize("change", [lambda iq: 2.0**40 * iq, lambda iq: iq * np.exp(0.7j), np.conj])
def test_neither_gain_nor_phase_nor_side_change_a_number(change):
    """Speeds count, not their sign: bands are of both sides together."""
    iq = line(20.0) * (1 + np.sin(2 * np.pi * 50.0 * TIMES_S)) + noise()
    one, other = joint(iq), joint(change(iq))
    for name, value in one.items():
        assert other[name] == pytest.approx(float(value), rel=2e-3, abs=2e-2), name


def test_a_carrier_and_a_prf_scaled_together_change_rates_alone():
    iq = line(20.0) * (1 + np.sin(2 * np.pi * 50.0 * TIMES_S)) + noise()
    one, other = joint(iq), joint(iq, carrier_hz=2 * CARRIER_HZ, prf_hz=2 * PRF_HZ)
    assert other["flash_log"] - one["flash_log"] == pytest.approx(np.log10(2), abs=1e-4)
    for name in ("joint_bandwidth_mps", "joint_centroid_swing_mps", "frame_kurtosis", "flash_strength"):
        assert other[name] == pytest.approx(float(one[name]), rel=1e-4)
