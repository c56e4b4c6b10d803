"""Echoes of point scatterers with exact ranges, exp(-4j pi R / wavelength), and a receiver of white noise.

The basis of the scenes in `independent_scenes`; it shares no code with `bladewing.simulate`. The radar is at the
origin, x points to the target, z up.
"""

from dataclasses import dataclass

import numpy as np

LIGHT_MPS = 299_792_458.0


@dataclass(frozen=True)
class Radar:
    """A pulse-Doppler or FMCW radar that keeps one range cell."""

    carrier_hz: float
    prf_hz: float
    pulses: int

    @property
    def wavelength_m(self) -> float:
        return LIGHT_MPS / self.carrier_hz

    @property
    def time_s(self) -> np.ndarray:
        return np.arange(self.pulses) / self.prf_hz

    @property
    def name(self) -> str:
        return f"{self.carrier_hz / 1e9:g} GHz {self.prf_hz / 1e3:g} kHz {1e3 * self.pulses / self.prf_hz:.0f} ms"


@dataclass(frozen=True)
class Scene:
    """Echoes without noise: the body (all that moves as a whole) and the micro-motion (blades, wings, limbs, wheels).

    Echoes without separate parts (ground, sea, rain) are all micro-motion; a gliding bird and noise have none.
    """

    body: np.ndarray
    micro: np.ndarray


def phasor(range_m: np.ndarray, radar: Radar) -> np.ndarray:
    """Give the two-way phasor of a range, complex64."""
    cycles = range_m * (-2 / radar.wavelength_m)
    cycles -= np.rint(cycles)
    angle = (2 * np.pi * cycles).astype(np.float32)
    out = np.empty(angle.shape, np.complex64)
    np.cos(angle, out=out.real)
    np.sin(angle, out=out.imag)
    return out


def echo(place_m: np.ndarray, radar: Radar, amplitude: np.ndarray | float = 1.0) -> np.ndarray:
    """Sum the echoes of scatterers at `place_m` (scatterers, pulses, 3); `amplitude` fits (scatterers, pulses)."""
    parts = phasor(np.sqrt(np.sum(place_m**2, axis=-1)), radar)
    return np.sum(parts * np.asarray(amplitude, np.float32), axis=0)


def unit(vector: np.ndarray) -> np.ndarray:
    """Scale vectors along the last axis to unit length."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give two directions perpendicular to a unit axis and to each other."""
    first = unit(np.cross(axis, [0.31, 0.95, 0.05]))
    return first, np.cross(axis, first)


def level(echoes: np.ndarray, power_db: float) -> np.ndarray:
    """Scale a series to a mean power [dB]; an all-zero series stays so."""
    power = np.mean(np.abs(echoes) ** 2)
    return echoes if power == 0 else echoes * np.sqrt(10 ** (power_db / 10) / power)


def white(rng: np.random.Generator, count: int) -> np.ndarray:
    """Complex Gaussian noise of unit power."""
    return rng.normal(0, np.sqrt(0.5), (count, 2)).astype(np.float32).view(np.complex64)[:, 0]


def noise_power(scene: Scene, snr_db: float, of: str) -> float:
    """Give the noise power per sample, `snr_db` below the whole target ("total") or its micro-motion ("micro", if any).

    An infinite `snr_db` means no noise. An empty cell has unit noise power at any `snr_db`.
    """
    whole = np.mean(np.abs(scene.body + scene.micro) ** 2)
    moving = np.mean(np.abs(scene.micro) ** 2)
    power = moving if of == "micro" and moving > 0 else whole
    return float(power / 10 ** (snr_db / 10)) if whole > 0 else 1.0


def received(scene: Scene, power: float, rng: np.random.Generator) -> np.ndarray:
    """Give the scene in white noise of this power per sample."""
    samples = scene.body + scene.micro + np.sqrt(power) * white(rng, len(scene.body))
    return samples.astype(np.complex64)


def visible(scene: Scene, power: float) -> bool:
    """Whether a spectrum shows the micro-motion: in four bins it is 10 dB over the noise and not below the body."""
    window = np.blackman(len(scene.body))
    window /= np.sqrt(np.sum(window**2))
    body, micro = (np.abs(np.fft.fft(window * part)) ** 2 for part in (scene.body, scene.micro))
    return bool(np.count_nonzero((micro >= 10 * power) & (micro >= body)) >= 4)
