import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.body_velocity import NOISE_BINS
from bladewing.features.window import KAISER_BETA
from bladewing.simulate import RotorMotion, rotor_echo

from .signals import CARRIER_HZ, PRF_HZ, RADAR, WAVELENGTH_M, moving_at, rotors_by_chance, white

PULSES = 700
BIN_MPS = PRF_HZ / PULSES * WAVELENGTH_M / 2


def lines(rng, draws, *, snr_db, beside=()):
    """A body's line of this level over the noise and others (bins off, amplitude) beside it, and its velocities."""
    velocity_mps = rng.uniform(-30, 30, draws)
    time_s = np.arange(PULSES) / PRF_HZ
    iq = np.sqrt(PULSES) * 10 ** (-snr_db / 20) * white(rng, draws, PULSES)
    for away_bins, amplitude in ((0.0, 1.0), *beside):
        turns = -2 * (velocity_mps[:, None] - away_bins * BIN_MPS) / WAVELENGTH_M * time_s
        iq += amplitude * np.exp(2j * np.pi * (turns + rng.uniform(size=(draws, 1))))
    return iq, velocity_mps


def normalised(iq, velocity_mps):
    found = measure(iq, **RADAR)
    return (found.body_velocity_mps - velocity_mps) / found.body_velocity_mps_std


@pytest.mark.parametrize("snr_db", [23.0, 26.0, 30.0])
def test_the_deviation_of_a_line_in_noise_is_true(snr_db):
    errors = normalised(*lines(np.random.default_rng(int(snr_db)), 60, snr_db=snr_db))
    # chi-squared of 60 degrees of freedom over 60 lies within 0.53..1.63 in 99.8 %
    assert 0.53 < np.mean(errors**2) < 1.63


def test_the_noise_of_the_interpolation_follows_from_the_window():
    # brute force: the three bins about a line that lies anywhere between two of them, with little noise and without
    rng = np.random.default_rng(3)
    pulses, draws = 256, 4000
    window, time = np.kaiser(pulses, KAISER_BETA), np.arange(pulses)
    clean = np.exp(2j * np.pi * rng.uniform(-0.5, 0.5, (draws, 1)) / pulses * time)
    bins = np.exp(-2j * np.pi * np.array([[-1], [0], [1]]) / pulses * time) * window
    tops = []
    for iq in (clean, clean + 1e-3 * white(rng, draws, pulses)):
        left, middle, right = np.log(np.abs(bins @ iq.T))
        tops.append((right - left) / (2 * (2 * middle - left - right)))
    level = np.exp(2 * middle) / (window**2).sum() * 1e6
    errors = (tops[1] - tops[0]) * np.sqrt(level)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(NOISE_BINS, rel=0.03)


@pytest.mark.parametrize("beside", [((2.5, 0.3), (-2.5, 0.3)), ((3.0, 0.7),), ((-4.0, 0.7), (4.0, 0.7))])
def test_lines_beside_the_body_show_in_its_deviation(beside):
    rng = np.random.default_rng(4)
    errors = normalised(*lines(rng, 60, snr_db=40, beside=beside))
    assert np.mean(np.abs(errors) > 4) < 0.05


def test_without_a_comb_a_line_as_strong_may_be_the_body_as_well():
    rng = np.random.default_rng(5)
    iq, velocity_mps = lines(rng, 20, snr_db=35, beside=((80.0, 1.05),))
    found = measure(iq, **RADAR)
    combless = np.isnan(found.chopping_hz)
    assert combless.sum() > 15
    off_mps = np.abs(found.body_velocity_mps - velocity_mps)[combless]
    assert off_mps.max() > 50  # the other one is the stronger
    assert (off_mps < 4 * found.body_velocity_mps_std[combless]).all()
    # one that is far weaker says nothing
    alone = measure(lines(rng, 20, snr_db=35, beside=((80.0, 0.3),))[0], **RADAR)
    assert np.median(alone.body_velocity_mps_std) < 0.05


@pytest.mark.parametrize(("ground", "unsure"), [(30.0, False), (1.5, True)])
def test_without_a_comb_the_body_moves_in_front_of_a_stronger_background(ground, unsure):
    """What stands at rest is the background where it is far stronger, and may be the body where it hardly is."""
    pulses, rng = 4 * PULSES, np.random.default_rng(6)
    slow = np.cumsum(white(rng, pulses)) * np.hanning(pulses)
    for velocity_mps in (-17.0, 8.0, 25.0):
        turns = -2 * velocity_mps / WAVELENGTH_M * np.arange(pulses) / PRF_HZ
        iq = np.exp(2j * np.pi * turns) + ground * (1 + 0.1 * slow / np.abs(slow).max()) + 0.3 * white(rng, pulses)
        found = measure(iq, **RADAR)
        assert np.isnan(found.chopping_hz)
        assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.01)
        assert (found.body_velocity_mps_std > abs(velocity_mps) / 4) == unsure


@pytest.mark.parametrize("velocity_mps", [-88.0, 70.0])
def test_a_body_weaker_than_its_blades_stays_within_the_unambiguous_span(velocity_mps):
    """Its comb's centre may be fitted beyond: there it is the same line as on the other side."""
    prf_hz, times_s = 12e3, np.arange(1500) / 12e3
    rng = np.random.default_rng(3)
    span_mps = WAVELENGTH_M * prf_hz / 4
    turn = moving_at(velocity_mps, times_s)
    for _ in range(8):
        angle_rad = RotorMotion(rng.uniform(50, 70), rng.uniform(0, 6)).angle_rad(times_s)
        blades = rotor_echo(angle_rad, wavelength_m=WAVELENGTH_M, blade_length_m=0.12)
        iq = 2 * (blades / np.sqrt(np.mean(abs(blades) ** 2)) + 0.05) * turn + white(rng, 1500)
        assert abs(measure(iq, carrier_hz=CARRIER_HZ, prf_hz=prf_hz).body_velocity_mps) <= span_mps


def short_drone(seed, velocity_mps, body_db):
    """Four rotors' tips and a body line over them in 12 to 25 ms, in a tenth of which lines part; with the radar."""
    rng = np.random.default_rng(seed)
    carrier_hz, tip_mps, length_m = rng.uniform(5e9, 18e9), rng.uniform(60, 120), rng.uniform(0.1, 0.3)
    wavelength_m = 299_792_458.0 / carrier_hz
    prf_hz = max(5 * tip_mps / wavelength_m, 8e3)
    times_s = np.arange(int(rng.uniform(0.012, 0.025) * prf_hz)) / prf_hz
    rates_hz = tip_mps / (2 * np.pi * length_m) * (1 + rng.uniform(-0.06, 0.06, 4))
    echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=wavelength_m, length_m=length_m, points=1)
    echo = (echo + 10 ** (body_db / 20)) * 10 ** (rng.uniform(0, 25) / 20)
    iq = echo * moving_at(velocity_mps, times_s, wavelength_m) + white(rng, len(times_s))
    return iq.astype(np.complex64), {"carrier_hz": carrier_hz, "prf_hz": prf_hz}


@pytest.mark.parametrize(
    ("seed", "velocity_mps"), [(149, 0.0), (172, 0.0), (195, 0.0), (195, 3.0), (113, -5.0), (150, 7.0)]
)
def test_no_other_line_is_surely_the_body(seed, velocity_mps):
    """Beside rest its own line is the strongest; without a comb the blades' many lines are no body's."""
    iq, radar = short_drone(seed, velocity_mps, body_db=30.0)
    found = measure(iq, **radar, blades=2)
    error_mps = abs(float(found.body_velocity_mps) - velocity_mps)
    if seed == 149 and np.isnan(error_mps):
        return  # blades' lines all over the span: any may be the body's
    assert error_mps < max(0.3, 4 * float(found.body_velocity_mps_std))  # 5 to 109 m/s, of which 0.3 were told


def test_an_offset_of_the_receiver_is_not_the_body_of_a_slow_drone():
    """Beside a line at rest without a skirt such drones stood still, or their lines were too near to be told apart."""
    wavelength_m = 299_792_458.0 / 94e9
    times_s = np.arange(4000) / 100e3
    for seed in range(4):
        rng = np.random.default_rng(seed)
        velocity_mps = rng.uniform(0.6, 1.2) * rng.choice([-1, 1])
        blades = rotors_by_chance(rng, [58.3], times_s, wavelength_m=wavelength_m, length_m=0.08)
        iq = (0.4 * blades + 5) * moving_at(velocity_mps, times_s, wavelength_m)
        iq += 150 * np.exp(1j * rng.uniform(0, 6)) + white(rng, len(times_s))
        found = measure(iq, carrier_hz=94e9, prf_hz=100e3)
        assert found.chopping_hz == pytest.approx(116.6, rel=0.01)
        assert abs(found.body_velocity_mps - velocity_mps) < max(4 * found.body_velocity_mps_std, 0.1)


def hovering_drone(seed, velocity_mps):
    """Four rotors whose lines are refused as the mains', 3 m/s a spacing, and a body line 17 dB over them."""
    rng, times_s = np.random.default_rng(seed), np.arange(1024) / 10e3
    wavelength_m = 299_792_458.0 / 3.3e9
    rates_hz, length_m = 75 * (1 + rng.uniform(-0.01, 0.01, 4)), rng.uniform(0.05, 0.08)
    echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=wavelength_m, length_m=length_m)
    iq = 3 * (echo + 7) * moving_at(velocity_mps, times_s, wavelength_m)
    return iq + white(rng, 1024)


@pytest.mark.parametrize(("velocity_mps", "sure"), [(-0.7, True), (0.7, True), (0.3, False)])
def test_without_a_comb_no_blade_is_the_body_of_a_drone_that_hovers(velocity_mps, sure):
    """Off rest by more than a bin the strongest line is no background's; nearer to rest the deviation leaves both open.

    What stands at rest was a background, however clean: the body moved with a line of the blades, 14 m/s off.
    """
    iq = np.stack([hovering_drone(seed, velocity_mps) for seed in (0, 5, 6, 7, 9, 10)])
    found = measure(iq, carrier_hz=3.3e9, prf_hz=10e3)
    assert np.isnan(found.chopping_hz).all()
    assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.05)
    assert ((found.body_velocity_mps_std < 0.1) == sure).all()
    assert ((found.body_velocity_mps_std > 2) != sure).all()


def swaying_ground(rng, draws, pulses, prf_hz, wavelength_m):
    """Half of its power stands still, half falls off with the speed as in a wind."""
    shape = np.exp(-5.5 * np.abs(np.fft.fftfreq(pulses, 1 / prf_hz)) * wavelength_m / 4)
    skirt = np.fft.ifft(np.fft.fft(white(rng, draws, pulses)) * shape)
    return np.sqrt(0.5) * (1 + skirt / np.sqrt(np.mean(np.abs(skirt) ** 2)))


@pytest.mark.parametrize(("ground_db", "speed_mps"), [(12.0, 2.0), (12.0, 3.0), (20.0, 3.0), (30.0, 3.1), (30.0, 4.0)])
def test_a_slow_body_before_ground_moves_and_ground_alone_does_not(ground_db, speed_mps):
    """Its line stands out of what leaves make on the other side; 0 +- 0.02 m/s was told, the ground's."""
    rng, pulses, prf_hz = np.random.default_rng(5), 1600, 20e3
    velocity_mps = speed_mps * np.array([-1, 1] * 4)
    body = 10 ** (15 / 20) * moving_at(velocity_mps[:, None], np.arange(pulses) / prf_hz)
    before = 10 ** ((15 + ground_db) / 20) * swaying_ground(rng, 8, pulses, prf_hz, WAVELENGTH_M) + white(
        rng, 8, pulses
    )
    radar = {"carrier_hz": CARRIER_HZ, "prf_hz": prf_hz}
    np.testing.assert_allclose(measure(body + before, **radar).body_velocity_mps, velocity_mps, atol=0.03)
    np.testing.assert_allclose(measure(before, **radar).body_velocity_mps, 0.0, atol=0.1)


def test_ground_that_sways_over_many_bins_is_no_surer_of_a_body_in_it():
    """Its strongest line may be anywhere in what leaves make: that is no line which stands out of it."""
    pulses, prf_hz = 3200, 20e3
    radar = {"carrier_hz": 77e9, "prf_hz": prf_hz}
    shape = np.exp(-0.25 * (np.fft.fftfreq(pulses, 1 / prf_hz) / 40) ** 2)  # the power by a Gaussian law of 40 Hz rms
    ground = np.fft.ifft(np.fft.fft(white(np.random.default_rng(2), 24, pulses)) * shape)
    iq = 30 * ground / np.sqrt(np.mean(np.abs(ground) ** 2)) + white(np.random.default_rng(3), 24, pulses)
    found = measure(iq, **radar)
    assert np.mean(np.abs(found.body_velocity_mps) > 5 * found.body_velocity_mps_std) < 0.2


@pytest.mark.parametrize(("asymmetry", "body_db"), [(0.6, 30.0), (0.9, 15.0)])
def test_a_hovering_drones_blade_is_not_its_body_where_edges_reflect_unlike(asymmetry, body_db):
    """The other side of rest holds a line as far from it, however weak; 11 m/s were told for sure."""
    rng, times_s, wavelength_m = np.random.default_rng(1), np.arange(800) / 8e3, 299_792_458.0 / 2.5e9
    length_m = 1.7 * 2 * wavelength_m / (4 * np.pi)  # tips 1.7 chopping frequencies out
    iq = []
    for rate_hz in rng.uniform(72, 108, 6):
        angle_rad = RotorMotion(rate_hz, rng.uniform(0, 2 * np.pi)).angle_rad(times_s)
        echo = rotor_echo(angle_rad, wavelength_m=wavelength_m, blade_length_m=length_m, edge_asymmetry=asymmetry)
        echo /= np.sqrt(np.mean(np.abs(echo) ** 2))
        iq.append(10 * (echo + 10 ** (body_db / 20) * np.exp(2j * np.pi * rng.uniform())) + white(rng, 800))
    found = measure(np.stack(iq), carrier_hz=2.5e9, prf_hz=8e3)
    assert np.isnan(found.chopping_hz).all()
    assert (np.abs(found.body_velocity_mps) < np.maximum(0.3, 5 * found.body_velocity_mps_std)).all()


def test_before_stronger_ground_the_body_of_rotors_not_told_apart_is_its_own_line():
    """The comb's centre was told in its place, centimetres a second off for sure."""
    wavelength_m, times_s, errors = 299_792_458.0 / 3.3e9, np.arange(750) / 15e3, []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        rates_hz, velocity_mps = 100 * (1 - 0.01 * rng.uniform(size=4)), rng.uniform(5, 20)
        echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=wavelength_m, length_m=60 / (2 * np.pi * 100))
        drone = 5.6 * (echo + 10) * moving_at(velocity_mps, times_s, wavelength_m)
        ground = 178 * swaying_ground(rng, 1, 750, 15e3, wavelength_m)[0]
        found = measure(drone + ground + white(rng, 750), carrier_hz=3.3e9, prf_hz=15e3, blades=2)
        if np.isfinite(found.chopping_hz):
            errors.append((found.body_velocity_mps - velocity_mps) / found.body_velocity_mps_std)
    assert len(errors) > 4
    assert np.max(np.abs(errors)) < 5
