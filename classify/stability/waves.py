"""Stages of the simulator against mpmath and long double: range and phase, blades, Bessel lines."""

from collections.abc import Iterator

import mpmath
import numpy as np
from bladewing.simulate.analytic import blade_coefficients, highest_order, point_coefficients
from bladewing.simulate.motion import range_phasor, straight_path
from bladewing.simulate.radar import SPEED_OF_LIGHT_MPS
from bladewing.simulate.rotor import RotorMotion, rotor_echo

from .cell import Cell, sweep

_DIGITS = 50
_CARRIER_HZ, _PRF_HZ = 10e9, 20e3

_PHASE_GUARD = "phase in float64, reduced to one turn before float32"
_BLADE_GUARD = "angle reduced in float64; the error of a float32 phase falls with the blade's own sin(x)/x"


def cells(quick: bool) -> Iterator[Cell]:
    """Measure every cell of these stages; `quick` leaves out the slow ones."""
    yield from _phases()
    yield from _blades()
    yield from _lines(quick)


def _phase_error(range_m: np.ndarray, carrier_hz: float) -> float:
    """Give the largest error of the two-way phasor; the float64 range is taken as exact."""
    found = range_phasor(range_m, SPEED_OF_LIGHT_MPS / carrier_hz)
    worst = 0.0
    with mpmath.workdps(_DIGITS):
        for one, value in zip(range_m, found, strict=True):
            turns = 2 * mpmath.mpf(float(one)) * mpmath.mpf(carrier_hz) / mpmath.mpf(SPEED_OF_LIGHT_MPS)
            worst = max(worst, float(abs(mpmath.expjpi(-2 * turns) - mpmath.mpc(complex(value)))))
    return worst


def _phases() -> Iterator[Cell]:
    stage, measure = "range and phase", "largest error of the unit phasor [1]"
    t = np.linspace(0, 0.08, 9)
    yield from sweep(
        stage,
        "range, 10 GHz",
        [1.0, 1e3, 1e5, 1e6, 1e7, 1e8],
        measure,
        1e-3,
        _PHASE_GUARD,
        lambda r: _phase_error(r + straight_path(t, 12.3), _CARRIER_HZ),
        "{:g} m".format,
    )
    yield from sweep(
        stage,
        "carrier, 1e7 m",
        [0.1e9, 1e9, 10e9, 100e9, 300e9],
        measure,
        1e-3,
        _PHASE_GUARD,
        lambda f: _phase_error(1e7 + straight_path(t, 12.3), f),
        lambda f: f"{f / 1e9:g} GHz",
    )
    yield from sweep(
        stage,
        "acceleration, 60 s",
        [0.0, 1.0, 30.0, 1000.0],
        measure,
        1e-3,
        _PHASE_GUARD,
        lambda a: _phase_error(straight_path(np.linspace(0, 60, 9), 12.3, a), _CARRIER_HZ),
        "{:g} m/s²".format,
    )
    unambiguous = SPEED_OF_LIGHT_MPS / _CARRIER_HZ * _PRF_HZ / 4
    yield from sweep(
        stage,
        "velocity over the unambiguous one",
        [0.0, 0.999, 1.0, 1.001, 10.0, 1e6],
        measure,
        1e-3,
        "aliases as the samples do; " + _PHASE_GUARD,
        lambda v: _phase_error(straight_path(t, v * unambiguous), _CARRIER_HZ),
    )


def _blade_error(
    gamma: float = 100.0, *, rpm: float = 6000.0, beta_rad: float = 0.0, blades: int = 2, dwell_s: float = 0.08
) -> float:
    """Give the largest error of a rotor's echo, relative to the sum of its blades' amplitudes."""
    wavelength = SPEED_OF_LIGHT_MPS / _CARRIER_HZ
    length = gamma * wavelength / (4 * np.pi)
    times = np.linspace(0, dwell_s, 41)
    if rpm and gamma:  # more times around the flash, where the blade is broadside and its phase passes through zero
        across = np.pi / 2 - 0.3 + np.array([-3.0, -1.0, -0.1, 0.0, 0.1, 1.0, 3.0]) / max(gamma, 10.0)
        times = np.append(times, across / (2 * np.pi * rpm / 60))
    angle = RotorMotion(rpm / 60, 0.3).angle_rad(times)
    found = rotor_echo(
        angle,
        wavelength_m=wavelength,
        blade_length_m=length,
        beta_rad=beta_rad,
        blade_amplitudes=np.ones(blades),
        edge_asymmetry=0.4,
    )
    worst = 0.0
    with mpmath.workdps(_DIGITS):
        half = mpmath.mpf(2) * mpmath.pi * mpmath.mpf(length) / mpmath.mpf(wavelength)
        for instant, value in zip(times, found, strict=True):
            first = mpmath.mpf(0.3) + 2 * mpmath.pi * mpmath.mpf(float(instant)) * mpmath.mpf(rpm) / 60
            total = mpmath.mpc(0)
            for number in range(blades):
                theta = first + 2 * mpmath.pi * number / blades
                x = half * mpmath.cos(mpmath.mpf(beta_rad)) * mpmath.cos(theta)
                share = mpmath.sin(x) / x if x else mpmath.mpf(1)
                total += (1 + mpmath.mpf(0.4) * mpmath.sin(theta)) * mpmath.expj(x) * share
            worst = max(worst, float(abs(total - mpmath.mpc(complex(value)))))
    return worst / max(blades, 1)


def _blades() -> Iterator[Cell]:
    stage, measure = "blade closed form", "largest error over the blades' amplitudes [1]"
    limit = 1e-3
    yield from sweep(
        stage,
        "Gamma = 4 pi L / wavelength",
        [0.0, 1e-12, 1.0, 100.0, 1e4, 1e6],
        measure,
        limit,
        _BLADE_GUARD + "; a blade without length is a point",
        _blade_error,
    )
    yield from sweep(
        stage,
        "rotation rate",
        [0.0, 1e-3, 6000.0, 1e5, 1e6],
        measure,
        limit,
        _BLADE_GUARD,
        lambda rpm: _blade_error(rpm=rpm),
        "{:g} rpm".format,
    )
    yield from sweep(
        stage,
        "beta",
        [0.0, 1.0, np.pi / 2 - 1e-9, np.pi / 2],
        measure,
        limit,
        "sin(x)/x = 1 where no phase is left: the echo stands still",
        lambda beta: _blade_error(beta_rad=beta),
        lambda beta: f"{np.rad2deg(beta):.9g}°",
    )
    yield from sweep(
        stage,
        "blades",
        [0, 1, 2, 3, 7, 100],
        measure,
        limit,
        "blades in pairs, odd ones alone; none give no echo",
        lambda blades: _blade_error(blades=blades),
    )
    yield from sweep(
        stage,
        "dwell",
        [1e-4, 1.0, 60.0],
        measure,
        limit,
        _BLADE_GUARD,
        lambda dwell: _blade_error(dwell_s=dwell),
        "{:g} s".format,
    )


def _bessel(gamma: float, order: int) -> float:
    """Compute J_m by the trapezoid rule in long double.

    The rule's error falls faster than any power of its number of points once that number exceeds gamma + order.
    """
    count = 1 << max(8, int(np.ceil(np.log2(2 * (gamma + order) + 200))))
    tau = 2 * np.arctan(np.longdouble(1)) * 4 * np.arange(count, dtype=np.longdouble) / count
    return float(np.cos(np.longdouble(gamma) * np.sin(tau) - order * tau).mean())


def _line_error(gamma: float) -> float:
    orders = sorted({0, 1, int(gamma / 2), int(gamma), int(gamma) + 3})
    found = point_coefficients(gamma, orders[-1])
    return max(abs(found[order] - _bessel(gamma, order)) for order in orders)


def _mean_line_error(gamma: float) -> float:
    """Compare the summed power of a whole blade's lines with the closed form's mean power over the angle; relative."""
    highest = highest_order(gamma)
    lines = blade_coefficients(0.0, gamma, highest)
    angle = np.linspace(0, 2 * np.pi, 2 * highest + 64, endpoint=False)
    x = gamma / 2 * np.cos(angle.astype(np.longdouble))
    power = np.mean(np.sinc(x / np.longdouble(np.pi)) ** 2)
    return abs(float(lines[0] ** 2 + 2 * np.sum(lines[1:] ** 2)) / float(power) - 1)


def _lines(quick: bool) -> Iterator[Cell]:
    gammas = [0.0, 1e-8, 1.0, 100.0, 1e4, *([] if quick else [1e6])]
    yield from sweep(
        "Bessel lines",
        "Gamma",
        gammas,
        "largest error of a line's amplitude [1]",
        1e-9,
        "orders to gamma + 12 gamma^(1/3) + 20, where J falls below 1e-17",
        _line_error,
    )
    yield from sweep(
        "Power of Bessel lines",
        "Gamma, whole blade",
        gammas,
        "error of the power of all lines, relative [1]",
        1e-9,
        "a blade shorter than 1e-6 is a point; sums from the highest order down",
        _mean_line_error,
    )
