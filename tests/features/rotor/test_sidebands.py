"""Lines that a supply or an oscillator draws about a strong one are no rotor; as few of blades are one."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.simulate import RotorMotion, rotor_echo

from ..signals import PULSES, RADAR, TIMES_S, WAVELENGTH_M, moving_at, white

BODY = 100 * moving_at(7.3)

#: Amplitude and phase [rad] of each of a supply's harmonics.
HARMONICS = ((0.04, 0.3), (0.02, 2.0), (0.03, 4.1))


def ripple(rate_hz: float) -> np.ndarray:
    return sum(
        size * np.cos(2 * np.pi * rate_hz * (order + 1) * TIMES_S + phase)
        for order, (size, phase) in enumerate(HARMONICS)
    )


@pytest.mark.parametrize("turn", [1, 1j, np.exp(0.7j)])
@pytest.mark.parametrize("rate_hz", [523.7, 1120.7])
def test_sidebands_of_a_supply_are_no_rotor(turn, rate_hz):
    """Of gain, of the oscillator's phase, and of both."""
    noise = white(np.random.default_rng(6), PULSES)
    found = measure(BODY * (1 + turn * ripple(rate_hz)) + noise, **RADAR)
    assert np.isnan(found.chopping_hz)
    assert f"lines every {rate_hz:.1f} Hz, alike on both sides" in str(found.reason)
    assert found.body_velocity_mps == pytest.approx(7.3, abs=0.05)


def small_rotor(blades: int, phase_rad: float, amplitudes: tuple[float, ...]) -> np.ndarray:
    """Blades of 15 mm beside the same body, their own line in phase with that."""
    angle_rad = RotorMotion(2400.0 / blades, phase_rad).angle_rad(TIMES_S)
    echo = rotor_echo(angle_rad, wavelength_m=WAVELENGTH_M, blade_length_m=0.02, blade_amplitudes=amplitudes)
    return BODY * (1 + 0.05 * echo / np.sqrt(np.mean(np.abs(echo) ** 2)))


@pytest.mark.parametrize("blades", [2, 3, 4])
@pytest.mark.parametrize("phase_rad", [0.0, 0.4, 1.1])
def test_the_few_lines_of_short_blades_are_a_rotor_s(blades, phase_rad):
    """They are alike on both sides as well, but all at their flash's phases."""
    iq = small_rotor(blades, phase_rad, (1.0,) * blades) + white(np.random.default_rng(7), PULSES)
    assert "alike" not in str(measure(iq, **RADAR).reason)


def test_sidebands_beside_a_line_of_their_own_strength_are_not_told():
    """Nothing as strong was modulated by that: it may be a blade's own line."""
    shares = BODY * ripple(1120.7)
    iq = shares + 0.02 * BODY + white(np.random.default_rng(8), PULSES)
    assert "alike" not in str(measure(iq, **RADAR).reason)
