"""Signals of known spectra for the tests of this folder."""

import numpy as np
from bladewing.features.rotor.family import Family, find_family
from bladewing.features.rotor.periodogram import Periodogram, prepared
from bladewing.features.spectrum import doppler_spectrum
from bladewing.simulate import RotorMotion, rotor_echo

CARRIER_HZ, PRF_HZ, PULSES = 9.85e9, 35e3, 3000
WAVELENGTH_M = 299_792_458.0 / CARRIER_HZ


def tone(frequency_hz, pulses: int = PULSES, prf_hz: float = PRF_HZ) -> np.ndarray:
    return np.exp(2j * np.pi * np.asarray(frequency_hz)[..., None] * np.arange(pulses) / prf_hz)


def white(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Complex noise of unit power a sample."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) * np.sqrt(0.5)


def rotors(
    rates_hz, *, length_m: float = 0.15, amplitudes=(1.0, 1.0), velocity_mps: float = 0.0, body: float = 3.0
) -> np.ndarray:
    """Body line and rotors of unit blade power as the paper's radar sees them."""
    times_s = np.arange(PULSES) / PRF_HZ
    iq = np.zeros(PULSES, complex)
    for number, rate_hz in enumerate(rates_hz):
        iq += rotor_echo(
            RotorMotion(rate_hz, 0.3 + 1.7 * number).angle_rad(times_s),
            wavelength_m=WAVELENGTH_M,
            blade_length_m=length_m,
            blade_amplitudes=amplitudes,
        )
    iq /= np.sqrt(np.mean(abs(iq) ** 2))
    return (iq + body) * np.exp(-4j * np.pi * velocity_mps * times_s / WAVELENGTH_M)


def rotors_by_chance(
    rng: np.random.Generator, rates_hz, times_s: np.ndarray, *, wavelength_m: float, length_m: float, points=None
) -> np.ndarray:
    """Echo of rotors of these rates at phases of chance, unit power a sample."""
    echo = np.zeros(len(times_s), complex)
    for rate_hz in rates_hz:
        angle_rad = RotorMotion(rate_hz, rng.uniform(0, 2 * np.pi)).angle_rad(times_s)
        one = rotor_echo(angle_rad, wavelength_m=wavelength_m, blade_length_m=length_m, points=points)
        echo += one * np.exp(2j * np.pi * rng.uniform())
    return echo / np.sqrt(np.mean(np.abs(echo) ** 2))


def family_of(iq: np.ndarray) -> tuple[Periodogram, Family]:
    """A record of the paper's radar made ready, and its line family."""
    spectrum = doppler_spectrum(iq, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ)
    data = prepared(iq, spectrum)
    return data, find_family(data, spectrum)[0]
