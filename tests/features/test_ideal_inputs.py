"""Every feature on inputs whose answer is known, and what must not change it."""

import math

import numpy as np
import pytest
from bladewing.features import FEATURES, INPUT_SHAPES, model_inputs
from bladewing.features.chopping import _evidence
from bladewing.simulate.scene import Scene

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, by_name, rotors, tone, white

NAMES = [f.name for f in FEATURES]
STEP_HZ = 240.0  # of the comb, off the bin


def noise(level: float = 1.0, count: int = 1, seed: int = 0) -> np.ndarray:
    return level * white(np.random.default_rng(seed), count, PULSES)


def comb(orders: int = 20, step_hz: float = STEP_HZ, centre_hz: float = 0.0) -> np.ndarray:
    """Lines of equal height and random phases about a stronger one."""
    order = np.arange(-orders, orders + 1)
    phase = np.exp(2j * np.pi * np.random.default_rng(2).uniform(size=order.size))
    height = np.where(order == 0, 10, 1)
    return (height * phase) @ tone(centre_hz + step_hz * order)


def test_the_radar_columns_are_the_radar():
    values = by_name(noise())
    assert values["velocity_step_log"] == pytest.approx(math.log10(WAVELENGTH_M / 2 / (PULSES / PRF_HZ)), abs=1e-5)
    assert values["unambiguous_log"] == pytest.approx(math.log10(WAVELENGTH_M * PRF_HZ / 4), abs=1e-5)
    assert values["dwell_log"] == pytest.approx(math.log10(PULSES / PRF_HZ), abs=1e-5)
    assert values["pulses_log"] == pytest.approx(math.log10(PULSES), abs=1e-5)


def test_silence_has_no_body_band_comb_or_change():
    values = by_name(np.zeros(PULSES, np.complex64))
    # Nothing at all is the lowest level of the seen bins, and 0 wherever there is nothing to measure.
    for name in ("body_level_db", "rest_level_db", "notch_residual_db", "weak_70_110_db"):
        assert values[name] == -20, name
    zero = [n for n in NAMES if n.startswith(("bandwidth", "energy", "chopping", "change", "centroid"))]
    for name in [*zero, "span_share", "occupancy", "busy_swing_db", "symmetry", "smearing_index", "empty_side_db"]:
        assert values[name] == 0, name
    assert values["notch_residual_share"] == 0
    assert values["entropy"] == 1  # what carries no energy leans nowhere


def test_noise_is_flat_even_and_unrepeating():
    values = {name: np.median(value) for name, value in by_name(noise(count=60)).items()}
    for name in ("notch_residual_db", "empty_side_db"):
        assert abs(values[name]) < 0.7, name
    # means of levels, not of powers, of which the stronger and the weaker side are told apart
    assert -2 < values["weak_22_40_db"] < values["strong_22_40_db"] < 1
    # the largest of some 1400 independent exponentials: 10 log10(ln 1400 + 0.577)
    assert values["body_level_db"] == pytest.approx(8.9, abs=0.7)
    assert values["peak_over_mean_db"] == pytest.approx(8.9, abs=0.9)
    assert values["bandwidth_log"] == values["bandwidth_speed_mps"] == values["span_share"] == 0
    assert values["chopping_strength"] < 3.5
    assert values["ripple_db"] == pytest.approx(5.57, abs=0.3)
    assert abs(values["symmetry"]) < 0.1
    assert values["busy_swing_db"] < 0.6
    assert values["occupancy"] < 0.05  # 6 dB over the floor is exceeded with probability exp(-4) = 0.018
    assert values["entropy"] > 0.4


def test_one_line_is_a_body_and_leaves_noise():
    velocity_mps = -37.3
    lone = by_name(1e3 * tone(-2 * velocity_mps / WAVELENGTH_M) + noise(count=20))
    empty = by_name(noise(count=20))
    np.testing.assert_allclose(lone["body_speed_mps"], 37.3, atol=0.02)
    # amplitude 1000 over unit noise, 3000 pulses through a window of noise bandwidth 1.5 bins
    level_db = 60 + 10 * np.log10(PULSES / 1.5)
    np.testing.assert_allclose(lone["body_level_db"], level_db, atol=1.5)
    assert (lone["chopping_strength"] < 4.5).all()
    assert (lone["notch_residual_share"] < 1e-4).all()
    for name in ("notch_residual_db", "ripple_db", "peak_over_mean_db", "chopping_strength", "entropy", "occupancy"):
        assert np.median(lone[name]) == pytest.approx(np.median(empty[name]), rel=0.1, abs=0.7), name
    for name in ("bandwidth_speed_mps", "span_share", "chopping_orders"):
        assert np.median(lone[name]) == 0, name


def test_two_lines_are_a_band_of_one_line():
    offset_mps, below_db = 60.0, 20.0
    second = 10 ** (-below_db / 20) * tone(-2 * offset_mps / WAVELENGTH_M)
    values = by_name(300 * (tone(0.0) + second) + noise())
    assert values["body_speed_mps"] == pytest.approx(0, abs=0.01)
    assert values["body_level_db"] == pytest.approx(values["rest_level_db"], abs=1e-3)
    # the residual: the second line alone, its energy in a few neighbouring bins, and no other side
    assert values["energy_speed_high_mps"] == pytest.approx(offset_mps, abs=1)
    assert values["energy_speed_low_mps"] == pytest.approx(offset_mps, abs=1)
    assert values["energy_width_mps"] < 1.5
    assert values["bandwidth_speed_mps"] < 3
    assert values["occupancy"] > 0.9
    assert values["entropy"] < 0.25
    assert values["notch_residual_share"] == pytest.approx(0.01 / 1.01, rel=0.05)
    assert values["symmetry"] < 0.1
    assert values["strong_40_70_db"] > values["weak_40_70_db"] + 1.5


@pytest.mark.parametrize(
    ("speed_mps", "name"), [(1.5, "slow"), (4.5, "middle"), (-17.0, "middle"), (25.0, "fast"), (-70.0, "fast")]
)
def test_what_begins_within_the_dwell_changes_the_level_at_its_own_speed_alone(speed_mps, name):
    begins = np.clip((np.arange(PULSES) / PULSES - 0.4) / 0.2, 0, 1)
    line = 3 * begins * tone(-2 * speed_mps / WAVELENGTH_M)
    without, with_it = by_name(noise()), by_name(noise() + line)
    more = {one: with_it[f"change_{one}_db"] - without[f"change_{one}_db"] for one in ("slow", "middle", "fast")}
    assert max(more, key=more.get) == name, more


@pytest.mark.parametrize(("first_mps", "last_mps"), [(30.0, 30.0), (-25.0, -25.0), (20.0, 40.0), (40.0, 20.0)])
def test_the_centroid_drifts_as_far_as_the_line_does(first_mps, last_mps):
    range_m = np.cumsum(np.linspace(first_mps, last_mps, PULSES)) / PRF_HZ
    values = by_name(300 * np.exp(-4j * np.pi / WAVELENGTH_M * range_m) + noise())
    # parts are a quarter of the dwell: the middles of the first and the last are three quarters of it apart
    assert values["centroid_drift_mps"] == pytest.approx(abs(last_mps - first_mps) * 3 / 4, abs=1.5)


@pytest.mark.parametrize("centre_hz", [0.0, 611.0, -1234.0])
def test_a_perfect_comb_has_its_step_its_orders_and_no_smear(centre_hz):
    values = by_name(10 * comb(centre_hz=centre_hz) + noise())
    assert 10 ** values["chopping_log"] == pytest.approx(STEP_HZ, rel=0.003)
    assert values["chopping_step_mps"] == pytest.approx(STEP_HZ * WAVELENGTH_M / 2, rel=0.003)
    assert 10 ** values["chopping_turns"] == pytest.approx(STEP_HZ * PULSES / PRF_HZ, rel=0.003)
    assert values["chopping_orders"] == pytest.approx(40, abs=0.5)  # the window widens the last line
    assert values["span_share"] == pytest.approx(40 * STEP_HZ / PRF_HZ, rel=0.02)
    assert 10 ** values["bandwidth_log"] == pytest.approx(40 * STEP_HZ, rel=0.02)
    assert values["chopping_strength"] > 10
    assert values["chopping_repeats"] > 0.3  # the stronger the lines, the wider on a scale of dB, and it fades
    assert values["smearing_index"] < 0.003
    assert values["symmetry"] > 0.8


def test_a_ripple_of_the_band_does_not_outweigh_a_comb():
    """Higher than the comb's peak, but at a short period, and nothing at twice the period."""
    peaks = np.full((2, 1025), 0.1, np.float32)
    peaks[:, [300, 600, 900]] = 1.0, 0.6, 0.3
    peaks[0, 42] = 1.4
    peaks[1, [42, 84]] = 1.4, 0.9  # this one repeats: a comb of wider lines
    first, last = 16, 585
    np.testing.assert_array_equal(first + _evidence(peaks, first, last).argmax(axis=-1), [300, 42])


def test_a_hexacopter_over_ground_is_not_taken_for_a_ripple_of_its_band():
    scene = Scene.load("hexacopter")
    iq = np.stack([scene.render(seed).iq.reshape(-1) for seed in range(6)])
    values = by_name(iq, carrier_hz=scene.sight.carrier_hz, prf_hz=scene.sight.prf_hz)
    # Two blades at 35 Hz. The highest peak alone is right in about 3 of 24, and 500 Hz in the rest.
    right = np.abs(10 ** values["chopping_log"] / 70 - 1) < 0.04
    assert np.count_nonzero(right) >= 4


@pytest.mark.parametrize("last", [12, 40, 60])
def test_a_short_cepstrum_has_evidence_for_every_period_sought(last):
    peaks = np.random.default_rng(0).uniform(0, 1, (3, 65)).astype(np.float32)
    assert _evidence(peaks, 10, last).shape == (3, last - 9)


def test_a_constant_is_a_body_at_rest():
    values = by_name(np.full(PULSES, 3 - 4j))
    assert values["body_speed_mps"] == pytest.approx(0, abs=1e-3)
    assert values["rest_level_db"] == values["body_level_db"] > 100
    assert values["notch_residual_share"] < 1e-6


SILENT = np.zeros(PULSES, np.complex64)
SPIKE = SILENT.copy()
SPIKE[1234] = 1
EXTREMES = {
    "silence": SILENT,
    "one spike": SPIKE,
    "constant": np.ones(PULSES, np.complex64),
    "alternating": tone(PRF_HZ / 2),
    "real": tone(500.0).real.astype(complex),
    "scene": rotors([58.6]) + noise()[0],
}


@pytest.mark.parametrize("name", EXTREMES)
@pytest.mark.parametrize("gain", [1e-30, 1.0, 1e30])
def test_no_gain_warns_overflows_or_changes_a_feature(name, gain):
    reference = model_inputs(EXTREMES[name], **RADAR, names=tuple(INPUT_SHAPES))
    with np.errstate(all="raise", under="ignore"):
        changed = model_inputs(EXTREMES[name] * gain, **RADAR, names=tuple(INPUT_SHAPES))
    for key, values in changed.items():
        assert np.isfinite(values).all()
        if name in ("silence", "scene"):  # of the rest the floor, or the highest of equal bins, is what rounding leaves
            np.testing.assert_allclose(values, reference[key], rtol=1e-3, atol=2e-2)


def test_batch_equals_loop_on_unlike_records():
    iq = np.stack([*(EXTREMES[n] for n in ("silence", "one spike", "scene")), noise()[0], 30 * comb() + noise()[0]])
    batch = model_inputs(iq, **RADAR, names=("features", "spectrum"))
    for number, one in enumerate(iq):
        alone = model_inputs(one, **RADAR, names=("features", "spectrum"))
        for key in batch:
            np.testing.assert_allclose(batch[key][number], alone[key], rtol=1e-3, atol=1e-2)


def test_a_phase_changes_nothing():
    iq = rotors([58.6], velocity_mps=12.0) + noise(0.3)[0]
    one, other = by_name(iq), by_name(iq * np.exp(2.1j))
    for name in NAMES:
        assert other[name] == pytest.approx(one[name], rel=2e-3, abs=1e-2), name


def test_time_reversed_and_conjugated_is_the_same_spectrum():
    """Running the pulses backwards mirrors the Doppler; conjugating mirrors it back."""
    iq = rotors([58.6], velocity_mps=12.0) + noise(0.3)[0]
    one, other, mirrored = (by_name(x) for x in (iq, iq[::-1].conj(), iq[::-1]))
    for name in NAMES:
        assert other[name] == pytest.approx(one[name], rel=2e-3, abs=0.05), name
        if name not in ("smearing_index", "chopping_repeats"):  # ratios of what the mirrored bins' floor moves
            assert mirrored[name] == pytest.approx(one[name], rel=0.05, abs=0.5), name


def test_carrier_and_prf_scaled_together_change_times_and_no_velocity_or_level():
    iq = rotors([58.6], velocity_mps=12.0) + noise(0.3)[0]
    factor = 1.7
    one, other = by_name(iq), by_name(iq, carrier_hz=factor * CARRIER_HZ, prf_hz=factor * PRF_HZ)
    moved = {"dwell_log": -1, "bandwidth_log": 1, "chopping_log": 1}
    for name in NAMES:
        expected = one[name] + moved.get(name, 0) * math.log10(factor)
        # the chopping frequency is sought in a range of Hz, and over that range noise is judged
        rel = 0.02 if name == "chopping_strength" else 2e-3
        assert other[name] == pytest.approx(expected, rel=rel, abs=5e-3), name


def test_longer_looks_keep_what_is_not_about_resolution():
    """Power densities, speeds, shares and widths of noise: no count of pulses in them."""
    rng = np.random.default_rng(3)
    rows = []
    for pulses in (1024, 4096):
        values = by_name(white(rng, 60, pulses))
        rows.append({name: np.median(value) for name, value in values.items()})
    for name in ("notch_residual_db", "ripple_db", "empty_side_db", "strong_6_12_db"):
        assert rows[0][name] == pytest.approx(rows[1][name], abs=0.8), name
    # a mean of levels in dB lies the lower the fewer bins each is a mean of: of 600 records by 1.07 dB here
    assert rows[0]["weak_40_70_db"] == pytest.approx(rows[1]["weak_40_70_db"] - 1.07, abs=0.8)
    for name in ("bandwidth_speed_mps", "span_share"):
        assert rows[0][name] == rows[1][name] == 0
    assert rows[0]["chopping_strength"] == pytest.approx(rows[1]["chopping_strength"], abs=0.8)
