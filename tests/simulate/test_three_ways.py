"""Three ways to one spectrum: dense point scatterers, the closed form, and the paper's eq. (24)."""

import numpy as np
import pytest
from bladewing.simulate import rotor_echo
from bladewing.simulate.analytic import blade_coefficients, highest_order, rotor_lines
from bladewing.simulate.exact import blade_points, blade_range_m, dense_rotor_echo, hub_range_m
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import jv

WAVELENGTH_M = 0.03
GAMMAS = (1.0, 3.7, 12.0, 63.0, 410.0, 2000.0)


def radius_of(gamma: float, beta_rad: float) -> float:
    return gamma * WAVELENGTH_M / (4 * np.pi * np.cos(beta_rad))


def spectra(gamma: float, amplitudes: np.ndarray, *, root_share: float, asymmetry: float, beta_rad=0.3, phase_rad=0.7):
    """Lines of one turn, orders 0..n-1 modulo n: dense, closed form, eq. (24)."""
    length_m = radius_of(gamma, beta_rad)
    highest = highest_order(gamma)
    n = 2 * highest + 2
    angle = phase_rad + 2 * np.pi * np.arange(n) / n
    shape = {"wavelength_m": WAVELENGTH_M, "beta_rad": beta_rad, "blade_amplitudes": amplitudes}
    points = blade_points(root_share * length_m, length_m, int(gamma / 4) + 30, "gauss")
    dense = dense_rotor_echo(np.zeros(n), angle, points, edge_asymmetry=asymmetry, far_field=True, **shape)
    blade = {"blade_length_m": length_m, "root_m": root_share * length_m, "edge_asymmetry": asymmetry}
    closed = rotor_echo(angle, **shape, **blade)
    lines = rotor_lines(rotation_hz=1.0, phase_rad=phase_rad, **shape, **blade)
    analytic = np.zeros(n, complex)
    analytic[lines.orders % n] = lines.amplitude
    return np.fft.fft(dense) / n, np.fft.fft(closed) / n, analytic


@pytest.mark.parametrize("blades", [1, 2, 3, 4, 5, 6])
@pytest.mark.parametrize("root_share", [0.15, 1.0], ids=["blade", "point"])
@pytest.mark.parametrize("gamma", GAMMAS)
def test_three_ways_agree_line_by_line_to_60_db(gamma, root_share, blades):
    dense, closed, analytic = spectra(gamma, np.ones(blades), root_share=root_share, asymmetry=0.0)
    strongest = abs(analytic).max()
    assert abs(dense - analytic).max() < 1e-9 * strongest  # both are float64
    assert abs(closed - analytic).max() < 1e-3 * strongest
    # of N equal blades every N-th line is left
    orders = np.rint(np.fft.fftfreq(len(dense), 1 / len(dense))).astype(int)
    assert abs(dense[orders % blades != 0]).max(initial=0) < 1e-9 * strongest


@settings(max_examples=30, deadline=None)
@given(
    gamma=st.floats(1.0, 200.0),
    amplitudes=st.lists(st.floats(0.1, 2.0), min_size=1, max_size=6),
    root_share=st.floats(0, 1),
    asymmetry=st.floats(-1, 1),
)
def test_three_ways_agree_for_unequal_blades_with_unlike_edges(gamma, amplitudes, root_share, asymmetry):
    dense, closed, analytic = spectra(gamma, np.array(amplitudes), root_share=root_share, asymmetry=asymmetry)
    strongest = abs(analytic).max()
    assert abs(dense - analytic).max() < 1e-9 * strongest
    assert abs(closed - analytic).max() < 1e-3 * strongest


@pytest.mark.parametrize(("gamma_root", "gamma_tip"), [(0.0, 0.5), (0.0, 30.0), (7.0, 30.0), (29.99, 30.0)])
def test_blade_coefficients_are_means_of_bessel_functions(gamma_root, gamma_tip):
    ours = blade_coefficients(gamma_root, gamma_tip, 40)
    for order in (0, 1, 2, 17, 40):
        mean = quad(lambda g, m=order: jv(m, g), gamma_root, gamma_tip, epsabs=1e-13)[0] / (gamma_tip - gamma_root)
        assert ours[order] == pytest.approx(mean, abs=1e-11)


def test_the_lines_sum_to_the_echo_of_a_moving_rotor_with_aliases():
    # A radar too slow for the tips: the sum of lines folds as the samples do.
    times_s = np.arange(300) / 4e3
    rotor = {"wavelength_m": WAVELENGTH_M, "blade_length_m": 0.15, "root_m": 0.02, "blade_amplitudes": [1.0, 0.6]}
    lines = rotor_lines(rotation_hz=58.3, phase_rad=0.2, velocity_mps=-7.0, **rotor)
    body = np.exp(-4j * np.pi / WAVELENGTH_M * -7.0 * times_s)
    closed = body * rotor_echo(0.2 + 2 * np.pi * 58.3 * times_s, **rotor)
    np.testing.assert_allclose(lines.echo(times_s), closed, atol=1e-5)


@settings(max_examples=50, deadline=None)
@given(
    rho=st.floats(1.0, 1e4),
    share=st.floats(0, 0.9),
    angle=st.floats(-7, 7),
)
def test_exact_ranges_are_those_of_euclid_and_the_far_field_is_their_limit(rho, share, angle):
    offset = share * min(rho, 5.0)
    exact = hub_range_m(rho, offset, angle)
    # the radar at the origin, the centre at (rho, 0), the hub towards the radar by offset cos(angle)
    assert exact == pytest.approx(np.hypot(rho - offset * np.cos(angle), offset * np.sin(angle)), rel=1e-14)
    far = hub_range_m(rho, offset, angle, far_field=True)
    assert -1e-9 <= exact - far <= (offset * np.sin(angle)) ** 2 / (exact + far) * (1 + 1e-9) + 1e-9
    cosine = np.array(np.cos(0.4) * np.cos(angle))
    x, out = offset * cosine, offset * np.sqrt(1 - cosine**2)
    np.testing.assert_allclose(blade_range_m(np.array(rho), offset, cosine), np.hypot(rho - x, out), rtol=1e-14)
    np.testing.assert_allclose(blade_range_m(np.array(rho), offset, cosine, far_field=True), rho - x, rtol=1e-14)


def test_even_points_grow_into_the_gauss_points():
    angle = np.linspace(0, 6.3, 50)
    hub = np.full(50, 20.0)
    best = dense_rotor_echo(hub, angle, blade_points(0.01, 0.15, 60, "gauss"), wavelength_m=WAVELENGTH_M)
    errors = [
        abs(dense_rotor_echo(hub, angle, blade_points(0.01, 0.15, n), wavelength_m=WAVELENGTH_M) - best).max()
        for n in (60, 120, 240)
    ]
    assert errors[0] < 2e-2
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4, rtol=0.05)  # the midpoint rule


@pytest.mark.parametrize(("root_m", "points"), [(-0.1, 5), (0.3, 5), (float("nan"), 5), (0.1, 0)])
def test_bad_blades_are_refused(root_m, points):
    with pytest.raises(ValueError, match=r"root_m|points"):
        blade_points(root_m, 0.2, points)
