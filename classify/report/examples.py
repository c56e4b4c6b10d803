"""One record of each class as the report shows it: its Doppler spectrum and its STFT picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.fft
from bladewing.simulate import Radar, Records
from numpy.typing import NDArray

from .stft import STFT_BINS, stft

# The paper's middle window [samples] and its largest overlap.
WINDOW, OVERLAP = 80, 0.9
# Strong enough to see, weak enough to be honest [dB].
SNR_SHOWN_DB = (5.0, 20.0)
# Shown resolution: neighbouring values are pooled by their maximum, so that no line is lost.
POINTS, ROWS, COLUMNS = 400, 128, 90


def show_examples(records: Records, classes: tuple[str, ...]) -> list[dict[str, Any]]:
    """Pick and prepare the first fitting record of each class.

    Parameters
    ----------
    records : Records
        Those of 5 to 20 dB SNR are preferred.
    classes : tuple of str

    Returns
    -------
    list of dict
        One a class present: ``class``, ``kind``, ``snr_db`` (or None), ``dwell_s``, ``spectrum`` (``velocity_mps``,
        ``level_db`` above the noise floor) and ``picture`` (``velocity_mps`` [first, last], ``time_s`` [first, last],
        ``level_db`` rows of whole numbers, one a velocity, above the picture's median).
    """
    radar, shown = records.radar, []
    for name in classes:
        where = np.flatnonzero(np.asarray(records.labels) == name)
        if where.size == 0:
            continue
        snr_db = np.asarray(records.truth["snr_db"], np.float64)
        low, high = SNR_SHOWN_DB
        fitting = where[(snr_db[where] >= low) & (snr_db[where] <= high)]
        index = int(fitting[0] if fitting.size else where[0])
        known = float(snr_db[index]) if np.isfinite(snr_db[index]) else None
        shown.append(
            {
                "class": name,
                "kind": str(records.truth["kind"][index]),
                "snr_db": known,
                "dwell_s": radar.dwell_s,
                "spectrum": _spectrum(radar, records.iq[index]),
                "picture": _picture(radar, records.iq[index]),
            }
        )
    return shown


def _spectrum(radar: Radar, iq: NDArray[np.complex64]) -> dict[str, Any]:
    """Level above the noise floor against velocity, pooled."""
    from bladewing.features.spectrum import doppler_spectrum

    spectrum = doppler_spectrum(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    order = np.argsort(spectrum.velocity_mps)
    velocity, level = spectrum.velocity_mps[order], spectrum.level_db[order]
    pooled = _pool(level[:, None], POINTS)[:, 0]
    middle = np.array([float(part.mean()) for part in np.array_split(velocity, pooled.size)])
    return {"velocity_mps": np.round(middle, 3).tolist(), "level_db": np.round(pooled.astype(np.float64), 1).tolist()}


def _picture(radar: Radar, iq: NDArray[np.complex64]) -> dict[str, Any]:
    """STFT power [dB] with velocity down the rows, rising, and time across."""
    power = np.abs(scipy.fft.fftshift(stft(iq, window=WINDOW, overlap=OVERLAP), axes=-1)) ** 2
    level_db = 10.0 * np.log10(power + power.max() * 1e-12)
    # Doppler is -2 v / wavelength: rising velocity is falling frequency.
    rising = level_db.T[::-1]
    pooled = _pool(_pool(rising, ROWS).T, COLUMNS).T
    edge = radar.unambiguous_mps
    step = 2.0 * edge / STFT_BINS
    half_s = WINDOW / radar.prf_hz / 2.0
    return {
        "velocity_mps": [-edge + step / 2.0, edge + step / 2.0],
        "time_s": [half_s, radar.dwell_s - half_s],
        "level_db": np.round(pooled - np.median(pooled)).astype(int).tolist(),
    }


def _pool(values: NDArray[np.floating], rows: int) -> NDArray[np.floating]:
    """Largest value of each of ``rows`` runs of neighbouring rows; unchanged where there are no more than that."""
    if values.shape[0] <= rows:
        return values
    return np.stack([part.max(axis=0) for part in np.array_split(values, rows)])
