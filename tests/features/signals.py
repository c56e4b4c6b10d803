"""Signals of known spectra for the tests of this folder."""

import numpy as np
from bladewing.features import FEATURES, JOINT_FEATURES, model_inputs
from bladewing.features.rotor.family import Family, find_family
from bladewing.features.rotor.periodogram import Periodogram, prepared
from bladewing.features.spectrum import doppler_spectrum
from bladewing.simulate import RotorMotion, rotor_echo

from ..benchmarks.records import CARRIER_HZ, PRF_HZ, PULSES, RADAR, TIMES_S, WAVELENGTH_M, apart, moving_at, white

__all__ = ["CARRIER_HZ", "PRF_HZ", "PULSES", "RADAR", "TIMES_S", "WAVELENGTH_M", "moving_at", "white"]


def tone(frequency_hz, pulses: int = PULSES, prf_hz: float = PRF_HZ) -> np.ndarray:
    return np.exp(2j * np.pi * np.asarray(frequency_hz)[..., None] * np.arange(pulses) / prf_hz)


def rotors(
    rates_hz, *, length_m: float = 0.15, amplitudes=(1.0, 1.0), velocity_mps: float = 0.0, body: float = 3.0
) -> np.ndarray:
    """Body line and rotors of unit blade power as the paper's radar sees them."""
    iq = np.zeros(PULSES, complex)
    for number, rate_hz in enumerate(rates_hz):
        iq += rotor_echo(
            RotorMotion(rate_hz, 0.3 + 1.7 * number).angle_rad(TIMES_S),
            wavelength_m=WAVELENGTH_M,
            blade_length_m=length_m,
            blade_amplitudes=amplitudes,
        )
    iq /= np.sqrt(np.mean(abs(iq) ** 2))
    return (iq + body) * moving_at(velocity_mps)


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


def crowded(seed: int) -> tuple[np.ndarray, dict[str, float], np.ndarray]:
    """Four steady rotors at 24 GHz, whose lines are half as many as the pulses: record, radar, chopping frequencies."""
    rng, pulses, radar = np.random.default_rng(seed), 800, {"carrier_hz": 24e9, "prf_hz": 10e3}
    times_s, wavelength_m = np.arange(pulses) / radar["prf_hz"], 299_792_458.0 / radar["carrier_hz"]
    rates_hz = rng.uniform(23.5, 27) * (1 + apart(rng, 4, 0.004, -0.03, 0.03))
    echo = 10 * rotors_by_chance(rng, rates_hz, times_s, wavelength_m=wavelength_m, length_m=0.12)
    body = 32 * np.exp(2j * np.pi * rng.uniform())
    iq = (echo + body) * moving_at(rng.uniform(-8, 8), times_s, wavelength_m) + white(rng, pulses)
    return iq.astype(np.complex64), radar, 2 * rates_hz


def folded(
    seed: int,
    times: float,
    *,
    count: int = 1,
    spread: float = 0.0,
    snr_db: float = 15.0,
    velocity_mps: float = 5.0,
    body: float = 5.0,
) -> tuple[np.ndarray, dict[str, float], np.ndarray, float]:
    """Rotors whose tips are so many times as fast as the unambiguous velocity: record, radar, rates, tip speed."""
    rng = np.random.default_rng(seed)
    rates_hz = rng.uniform(75, 130) * (1 + spread * np.linspace(-1, 1, count) if count > 1 else np.ones(1))
    tip_mps = 2 * np.pi * rates_hz.max() * 0.15
    prf_hz = 4 * tip_mps / times / WAVELENGTH_M * rng.uniform(0.95, 1.05)
    times_s = np.arange(int(0.1 * prf_hz)) / prf_hz
    echo = rotors_by_chance(rng, rates_hz, times_s, wavelength_m=WAVELENGTH_M, length_m=0.15)
    iq = (echo + body) * moving_at(velocity_mps, times_s)
    iq = iq + 10 ** (-snr_db / 20) * white(rng, len(times_s))
    return iq.astype(np.complex64), {"carrier_hz": CARRIER_HZ, "prf_hz": prf_hz}, rates_hz, tip_mps


def family_of(iq: np.ndarray) -> tuple[Periodogram, Family]:
    """A record of the paper's radar made ready, and its line family."""
    spectrum = doppler_spectrum(iq, **RADAR)
    data = prepared(iq, spectrum)
    return data, find_family(data, spectrum)[0]


def by_name(iq: np.ndarray, which: str = "features", **radar: float) -> dict[str, np.ndarray]:
    """What a model is given of records of the paper's radar, or of another, by name: features or joint features."""
    rows = model_inputs(iq, **(RADAR | radar), names=(which,))[which]
    table = {"features": FEATURES, "joint_features": JOINT_FEATURES}[which]
    return dict(zip([f.name for f in table], np.moveaxis(rows, -1, 0), strict=True))


def cell_of(rate_hz: float, edges_hz: np.ndarray) -> int:
    """Which cell of an axis holds a rate."""
    return int(np.searchsorted(edges_hz, rate_hz, side="right")) - 1
