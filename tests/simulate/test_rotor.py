import numpy as np
import pytest
from bladewing.simulate import RotorMotion, rotor_echo
from bladewing.simulate.rotor import LARGEST_GAMMA
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import jv

WAVELENGTH_M = 0.03

#: Places on a blade, 0 at its root and 1 at its tip, and their weights, for integrals along it.
NODES, WEIGHTS = (np.polynomial.legendre.leggauss(400) + np.array([[1.0], [0.0]])) / 2


def turns(rotation_hz: float, periods: int, samples: int) -> np.ndarray:
    """Instants that hold whole turns, so that lines fall on bins."""
    return np.arange(samples) * (periods / rotation_hz / samples)


@settings(max_examples=40, deadline=None)
@given(
    blades=st.integers(1, 6),
    length_m=st.floats(0.05, 1.0),
    root_share=st.floats(0, 0.9),
    beta_rad=st.floats(0, np.pi),
    asymmetry=st.floats(-1, 1),
    points=st.none() | st.integers(1, 12),
    farther=st.sampled_from([1, 1000]),
)
def test_closed_form_equals_point_scatterers(blades, length_m, root_share, beta_rad, asymmetry, points, farther):
    wavelength_m = WAVELENGTH_M if points is None else WAVELENGTH_M / farther  # beyond float32, in double precision
    angle = np.linspace(0, 2 * np.pi, 97)
    closed = rotor_echo(
        angle,
        wavelength_m=wavelength_m,
        blade_length_m=length_m,
        root_m=root_share * length_m,
        beta_rad=beta_rad,
        blade_amplitudes=np.ones(blades),
        edge_asymmetry=asymmetry,
        points=points,
    )
    if points is None:  # Gauss's rule is exact to rounding: phases span 420 rad at most
        radii, shares = length_m * (root_share + (1 - root_share) * NODES), WEIGHTS
    else:
        radii = length_m * np.linspace(root_share if points > 1 else 1, 1, points)
        shares = np.full(points, 1 / points)
    brute = np.zeros(len(angle), complex)
    for blade in range(blades):
        theta = angle + 2 * np.pi * blade / blades
        phase = 4 * np.pi / wavelength_m * np.cos(beta_rad) * np.cos(theta)[:, None] * radii
        brute += (1 + asymmetry * np.sin(theta)) * (np.exp(1j * phase) @ shares)
    # a float32 phase loses 6e-8 of itself, in what is added up of a blade and in its middle; beyond LARGEST_GAMMA none.
    # The asymmetry makes a blade's echo, and what is lost of it, so much larger
    rounding = (
        2e-7 * (1 + abs(asymmetry)) * min(4 * np.pi / wavelength_m * length_m * abs(np.cos(beta_rad)), LARGEST_GAMMA)
    )
    np.testing.assert_allclose(closed, brute, atol=blades * max(2e-5, rounding))


def test_a_wander_without_a_rate_is_refused():
    for rate_hz in (0.0, -1.0, np.nan, [1.0, 0.0]):
        with pytest.raises(ValueError, match="wander_rate_hz is"):
            RotorMotion(50.0, wander_hz=0.5, wander_rate_hz=rate_hz)


@pytest.mark.parametrize("blades", [1, 2, 3, 4, 5])
def test_point_scatterers_give_the_bessel_lines_of_eq_24(blades):
    # A blade that reflects at its tip alone is the paper's point scatterer.
    radius_m, beta_rad, phase_rad, rotation_hz = 0.15, np.deg2rad(30), 0.4, 50.0
    times_s = turns(rotation_hz, 4, 4096)
    angle = RotorMotion(rotation_hz, phase_rad).angle_rad(times_s)
    iq = rotor_echo(
        angle,
        wavelength_m=WAVELENGTH_M,
        blade_length_m=radius_m,
        root_m=radius_m,
        beta_rad=beta_rad,
        blade_amplitudes=np.ones(blades),
    )
    lines = np.fft.fft(iq) / len(iq)
    gamma = 4 * np.pi * radius_m * np.cos(beta_rad) / WAVELENGTH_M
    expected = np.zeros(len(iq), complex)
    reach = int(gamma) + 30
    for order in range(-reach, reach + 1):
        if order % blades == 0:
            # exp(j G cos x) = sum j^n J_n(G) exp(j n x); N equal blades keep every N-th order, N-fold
            expected[4 * order] = blades * 1j**order * jv(order, gamma) * np.exp(1j * order * phase_rad)
    assert abs(lines - expected).max() < 1e-5 * abs(expected).max() * blades * 10


@pytest.mark.parametrize("blades", [2, 3, 4])
def test_lines_stand_at_multiples_of_the_chopping_frequency_alone(blades):
    rotation_hz = 58.33
    iq = rotor_echo(
        RotorMotion(rotation_hz, 0.3).angle_rad(turns(rotation_hz, 5, 6000)),
        wavelength_m=WAVELENGTH_M,
        blade_length_m=0.15,
        blade_amplitudes=np.ones(blades),
    )
    power = abs(np.fft.fft(iq)) ** 2
    on_comb = np.zeros(len(iq), bool)
    on_comb[np.arange(0, len(iq), 5 * blades)] = True
    on_comb[-np.arange(5 * blades, len(iq) // 2, 5 * blades)] = True
    assert power[~on_comb].sum() < 1e-9 * power.sum()


def test_unequal_blades_leak_lines_at_the_rotation_rate():
    iq = rotor_echo(
        RotorMotion(60.0).angle_rad(turns(60.0, 5, 6000)),
        wavelength_m=WAVELENGTH_M,
        blade_length_m=0.15,
        blade_amplitudes=[1.0, 0.7],
    )
    power = abs(np.fft.fft(iq)) ** 2
    assert power[5] > 1e-4 * power.max()  # once a turn, between the lines of two blades
    assert power[3] < 1e-9 * power.max()


@pytest.mark.parametrize("beta_deg", [0, 30, 60])
def test_the_band_ends_at_the_tip_doppler_of_eq_26(beta_deg):
    length_m, rotation_hz, prf_hz = 0.15, 58.33, 35e3
    times_s = np.arange(3000) / prf_hz
    iq = rotor_echo(
        RotorMotion(rotation_hz, 0.1).angle_rad(times_s),
        wavelength_m=WAVELENGTH_M,
        blade_length_m=length_m,
        beta_rad=np.deg2rad(beta_deg),
    )
    power = abs(np.fft.fft(iq * np.kaiser(3000, 12.5))) ** 2
    frequency_hz = abs(np.fft.fftfreq(3000, 1 / prf_hz))
    tip_hz = 2 / WAVELENGTH_M * 2 * np.pi * rotation_hz * length_m * np.cos(np.deg2rad(beta_deg))
    # Bessel amplitudes die within some orders behind the edge; a line stands every 117 Hz
    assert power[frequency_hz > tip_hz * 1.05 + 6 * 117].max() < 1e-6 * power.max()
    near_edge = (frequency_hz > 0.8 * tip_hz) & (frequency_hz < tip_hz)
    assert power[near_edge].max() > 1e-4 * power.max()


def test_a_line_of_sight_along_the_axis_shows_no_motion():
    iq = rotor_echo(np.linspace(0, 20, 500), wavelength_m=WAVELENGTH_M, blade_length_m=0.3, beta_rad=np.pi / 2)
    np.testing.assert_allclose(iq, 2.0, atol=1e-6)


def test_reversed_rotation_is_reversed_time():
    times_s = np.arange(500) / 1e4
    forward = rotor_echo(
        RotorMotion(80.0, 0.7).angle_rad(times_s), wavelength_m=0.03, blade_length_m=0.1, blade_amplitudes=[1, 0.5, 0.2]
    )
    back = rotor_echo(
        RotorMotion(-80.0, 0.7).angle_rad(-times_s),
        wavelength_m=0.03,
        blade_length_m=0.1,
        blade_amplitudes=[1, 0.5, 0.2],
    )
    np.testing.assert_array_equal(forward, back)


def test_batch_equals_loop():
    rng = np.random.default_rng(1)
    lengths, betas = rng.uniform(0.05, 0.4, 6), rng.uniform(0, 1.5, 6)
    angle = rng.uniform(-50, 50, (6, 333))
    amplitudes = rng.uniform(0, 1, (6, 3))
    batch = rotor_echo(angle, wavelength_m=0.02, blade_length_m=lengths, beta_rad=betas, blade_amplitudes=amplitudes)
    for i in range(6):
        one = rotor_echo(
            angle[i], wavelength_m=0.02, blade_length_m=lengths[i], beta_rad=betas[i], blade_amplitudes=amplitudes[i]
        )
        np.testing.assert_array_equal(batch[i], one)


def test_a_wandering_rate_is_the_derivative_of_the_angle():
    times_s = np.linspace(0, 1, 20_001)
    motion = RotorMotion(50.0, 0.2, drift_hz_per_s=3.0, wander_hz=2.0, wander_rate_hz=4.0, wander_phase_rad=0.5)
    rate_hz = np.gradient(motion.angle_rad(times_s), times_s) / (2 * np.pi)
    expected = 50 + 3 * times_s + 2 * np.cos(2 * np.pi * 4 * times_s + 0.5)
    np.testing.assert_allclose(rate_hz[1:-1], expected[1:-1], atol=1e-3)


@pytest.mark.parametrize("points", [65, 300, 1000])
def test_rows_of_many_points_are_as_exact_as_short_ones(points):
    angle, length_m, wavelength_m = np.linspace(0, 2 * np.pi, 257), 0.6, 0.03
    found = rotor_echo(angle, wavelength_m=wavelength_m, blade_length_m=length_m, blade_amplitudes=[1.0], points=points)
    radius_m = np.linspace(0, length_m, points)
    exact = np.exp(4j * np.pi / wavelength_m * radius_m[:, None] * np.cos(angle)).mean(axis=0)
    np.testing.assert_allclose(found, exact, atol=2e-6)


def test_a_blade_has_one_point_or_more():
    with pytest.raises(ValueError, match="points is 0: a blade has at least 1"):
        rotor_echo(np.zeros(8), wavelength_m=WAVELENGTH_M, blade_length_m=0.2, points=0)
