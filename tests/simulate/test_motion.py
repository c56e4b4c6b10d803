import numpy as np
import pytest
from bladewing.simulate.motion import phasor, range_phasor, straight_path
from hypothesis import given
from hypothesis import strategies as st


@given(st.floats(-1e7, 1e7))
def test_phasor_keeps_its_digits_for_large_phases(phase_rad):
    oracle = np.exp(1j * np.longdouble(phase_rad))
    # float64 spaces 1e7 rad by 2e-9; the rest of the budget is float32's last digit.
    assert abs(complex(phasor(np.array([phase_rad]))[0]) - complex(oracle)) < 5e-7


def test_a_growing_range_gives_a_falling_phase():
    times_s = np.arange(1000) / 1e4
    wavelength_m, velocity_mps = 0.03, 12.0
    iq = range_phasor(straight_path(times_s, velocity_mps), wavelength_m)
    doppler_hz = np.angle(np.sum(iq[1:] * iq[:-1].conj())) / (2 * np.pi) * 1e4
    assert doppler_hz == pytest.approx(-2 * velocity_mps / wavelength_m, rel=1e-5)


def test_acceleration_shifts_the_doppler_by_two_a_t_over_wavelength():
    times_s = np.arange(2000) / 1e4
    iq = range_phasor(straight_path(times_s, 0.0, 5.0), 0.03)
    rate_hz = np.angle(iq[1:] * iq[:-1].conj()) / (2 * np.pi) * 1e4
    slope = np.polyfit(times_s[1:], rate_hz.astype(float), 1)[0]
    assert slope == pytest.approx(-2 * 5.0 / 0.03, rel=1e-3)
