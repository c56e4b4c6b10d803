"""Simulated records for the tables of measurements: 3000 pulses at 35 kHz and 9.85 GHz; rates are not bin-centred."""

import numpy as np
from bladewing.simulate import RotorMotion, rotor_echo
from numpy.typing import ArrayLike

CARRIER_HZ, PRF_HZ, PULSES = 9.85e9, 35e3, 3000
RADAR = {"carrier_hz": CARRIER_HZ, "prf_hz": PRF_HZ}
WAVELENGTH_M = 299_792_458.0 / CARRIER_HZ
TIMES_S = np.arange(PULSES) / PRF_HZ

_AWAY = np.linspace(-1, 1, PULSES)  # time from the middle of the dwell, in half dwells

#: Amplitude gains of a target's echo over the dwell, of mean power 1: a beam that sweeps past (in "beam, late" its
#: maximum comes after the middle), a range cell that is entered and left, and fading between two paths.
GAINS = {
    name: gain / np.sqrt(np.mean(gain**2))
    for name, gain in {
        "beam": 10 ** (-6 / 20 * _AWAY**2),
        "beam, late": 10 ** (-8 / 20 * (_AWAY - 0.5) ** 2),
        "narrow beam": 10 ** (-25 / 20 * _AWAY**2),
        "cell": np.cos(np.pi / 2 * 0.95 * _AWAY) ** 2,
        "fading": 1 + 0.6 * np.cos(2 * np.pi * 0.8 * _AWAY + 1.0),
    }.items()
}


def white(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Draw complex noise of unit power per sample."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) * np.sqrt(0.5)


def moving_at(velocity_mps: float, times_s: np.ndarray = TIMES_S, wavelength_m: float = WAVELENGTH_M) -> np.ndarray:
    """Give the unit-amplitude echo of a point that moves away at a velocity."""
    return np.exp(-4j * np.pi * velocity_mps * times_s / wavelength_m)


def apart(rng: np.random.Generator, count: int, least: float, low: float, high: float) -> np.ndarray:
    """Draw rising rates within [low, high], neighbours at least `least` apart (any unit)."""
    while True:
        rates = np.sort(rng.uniform(low, high, count))
        if np.diff(rates).min(initial=np.inf) >= least:
            return rates


def rotors(
    rng: np.random.Generator,
    rates_hz: np.ndarray,
    *,
    length_m: float = 0.15,
    root_m: float = 0.0,
    amplitudes: ArrayLike = (1.0, 1.0),
    strengths: ArrayLike = 1.0,
    change: ArrayLike = 0.0,
) -> np.ndarray:
    """Make the blades' echo of rotors with random phases, of unit power per sample together.

    `strengths` are the rotors' amplitudes. Over the dwell each rate changes linearly by the relative `change`, the same
    for all or one for each rotor; `rates_hz` are the rates in the middle of the dwell.
    """
    echo = np.zeros(PULSES, complex)
    each = (np.broadcast_to(values, np.shape(rates_hz)) for values in (strengths, change))
    for rate_hz, strength, own_change in zip(rates_hz, *each, strict=True):
        drift_hz_per_s = rate_hz * own_change * PRF_HZ / PULSES
        motion = RotorMotion(rate_hz * (1 - own_change / 2), rng.uniform(0, 2 * np.pi), drift_hz_per_s=drift_hz_per_s)
        angle = motion.angle_rad(TIMES_S)
        blade = {"blade_length_m": length_m, "root_m": root_m, "blade_amplitudes": amplitudes}
        one = rotor_echo(angle, wavelength_m=WAVELENGTH_M, **blade)
        echo += strength * one * np.exp(2j * np.pi * rng.uniform())
    return echo / np.sqrt(np.mean(np.abs(echo) ** 2))


def ground(rng: np.random.Generator, per_mps: float = 5.5) -> np.ndarray:
    """Make a static return and a skirt around it that falls as exp(-per_mps |v|), each with a power of one half."""
    speed = np.abs(np.fft.fftfreq(PULSES, 1 / PRF_HZ)) * WAVELENGTH_M / 2
    skirt = np.fft.ifft(np.fft.fft(white(rng, PULSES)) * np.exp(-per_mps * speed / 2))
    return (1 + skirt / np.sqrt(np.mean(np.abs(skirt) ** 2))) * np.sqrt(0.5)


def record(
    rng: np.random.Generator,
    rates_hz: np.ndarray,
    *,
    snr_db: float,
    body_db: float,
    velocity_mps: float,
    ground_db: float | None = None,
    tail: np.ndarray | None = None,
    gain: ArrayLike = 1.0,
    **rotor: ArrayLike,
) -> np.ndarray:
    """Make one record: blades at `snr_db` over the noise, body and ground at their levels [dB] over the blades.

    `tail` adds the blades of a tail rotor. The gain over the dwell applies to target and ground, not to the noise.
    """
    amplitude = 10 ** (snr_db / 20)
    blades = rotors(rng, rates_hz, **rotor)
    if tail is not None:
        blades += tail
        blades /= np.sqrt(np.mean(np.abs(blades) ** 2))
    target = blades + 10 ** (body_db / 20) * np.exp(2j * np.pi * rng.uniform())
    iq = amplitude * target * moving_at(velocity_mps)
    if ground_db is not None:
        iq = iq + amplitude * 10 ** (ground_db / 20) * ground(rng)
    return (iq * gain + white(rng, PULSES)).astype(np.complex64)


def bound_hz(echo: np.ndarray, chopping_hz: float, snr_db: float) -> float:
    """Give the Cramer-Rao bound of the chopping frequency [Hz], body frequency unknown; `echo` has unit power."""
    order = np.arange(-int(PRF_HZ / 2 / chopping_hz), int(PRF_HZ / 2 / chopping_hz) + 1)
    lines = np.exp(-2j * np.pi * np.outer(order * chopping_hz, TIMES_S)) @ echo / PULSES
    power = np.abs(lines) ** 2 * 10 ** (snr_db / 10)
    moment = (order**2 * power).sum() - (order * power).sum() ** 2 / power.sum()
    return float(np.sqrt(6 / (PULSES * (PULSES**2 - 1) * moment)) / (2 * np.pi) * PRF_HZ)
