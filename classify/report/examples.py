"""One record of each class as the report shows it: its Doppler spectrum and its STFT picture."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import scipy.fft
from bladewing.features import measure
from bladewing.features.notch import NOTCH_MPS
from bladewing.features.spectrum import doppler_spectrum
from bladewing.simulate import Radar, Records, draw_records
from numpy.typing import NDArray

from .fft_against_stft import STFT_BINS, frames, stft
from .pictures import STFT_SETTINGS

# The paper's middle window [samples] and its largest overlap.
WINDOW, OVERLAP = STFT_SETTINGS[0]
# EXAMPLE_RADAR: its dwell is long enough to hold a wingbeat. EXAMPLE_WINDOW: STFT window [samples], long enough to
# separate the micro-motion's lines from the body's.
EXAMPLE_RADAR, EXAMPLE_WINDOW = Radar(carrier_hz=9.85e9, prf_hz=10e3, pulses=3000), 160
# EXAMPLE_KINDS: typical kind of each class. EXAMPLES_DRAWN: records drawn of each kind, to pick the shown one from.
EXAMPLE_KINDS, EXAMPLES_DRAWN = ("quadcopter", "flapping_bird", "vehicle"), 100
# SNRs of the records shown: high enough to see something, low enough to be realistic [dB].
SNR_SHOWN_DB = (12.0, 20.0)
# Preferred are records with a line more than this far over the noise [dB].
CLEAR_DB = 20.0
# Largest number of points of a spectrum, and of rows and columns of a picture. Neighbouring values are pooled by their
# maximum, so that no line is lost.
POINTS, ROWS, COLUMNS = 400, 128, 90
# The velocity axis reaches MARGIN times as far as the fastest line above LINE_DB [dB over the noise], at least to
# LEAST_SPAN_MPS [m/s] and at most to the unambiguous velocity.
LINE_DB, MARGIN, LEAST_SPAN_MPS = 10.0, 1.4, 25.0


def draw_examples(seed: int, classes: tuple[str, ...]) -> list[dict[str, Any]]:
    """Draw one suitable record of each of `EXAMPLE_KINDS`, as `show_examples` gives them.

    Parameters
    ----------
    seed : int
        Root seed of the records.
    classes : tuple of str
    """
    drawn = (draw_records(EXAMPLE_RADAR, EXAMPLES_DRAWN, seed, purpose="bench", kind=kind) for kind in EXAMPLE_KINDS)
    return [one for records in drawn for one in show_examples(records, classes)]


def show_examples(records: Records, classes: tuple[str, ...]) -> list[dict[str, Any]]:
    """Pick and prepare the most suitable record of each class; of equally suitable ones the first.

    Parameters
    ----------
    records : Records
        Preferred are those of 12 to 20 dB SNR, among these those without a background, then those with a clear line.
    classes : tuple of str

    Returns
    -------
    list of dict
        One a class present: ``class``, ``kind``, ``snr_db`` (or None), ``dwell_s``, ``spectrum`` (``velocity_mps``,
        ``level_db`` above the noise floor), ``measured`` (``reason`` why there is no comb or no band, else "";
        ``body_mps``, ``chopping_hz``, ``chopping_mps``, ``orders``, ``band_hz``, ``band_mps`` [slowest, fastest],
        ``tip_mps``; None where there is no value; ``notches_mps``: pairs) and ``picture`` (``velocity_mps`` [first,
        last], ``time_s`` [first, last], ``level_db`` rows of whole numbers, one a velocity, above the median over all
        velocities). Fast velocities at which nothing is seen are cut off.
    """
    radar, shown = records.radar, []
    for name in classes:
        where = np.flatnonzero(np.asarray(records.labels) == name)
        if where.size == 0:
            continue
        index = min(map(int, where), key=partial(_flaws, records))
        snr_db = np.asarray(records.truth["snr_db"], np.float64)
        known = float(snr_db[index]) if np.isfinite(snr_db[index]) else None
        velocity, level = _spectrum(radar, records.iq[index])
        span = _span_mps(radar, velocity, level)
        inside = np.abs(velocity) <= span
        shown.append(
            {
                "class": name,
                "kind": str(records.truth["kind"][index]),
                "snr_db": known,
                "dwell_s": radar.dwell_s,
                "spectrum": _curve(velocity[inside], level[inside]),
                "measured": _measured(radar, records.iq[index]),
                "picture": _picture(radar, records.iq[index], span, window=EXAMPLE_WINDOW, overlap=OVERLAP),
            }
        )
    return shown


def _flaws(records: Records, row: int) -> tuple[bool, bool, bool]:
    """Say what speaks against showing a record, the worst first: a wrong SNR, a background, no clear line."""
    low, high = SNR_SHOWN_DB
    if not low <= records.truth["snr_db"][row] <= high:
        return True, True, True
    alone = "background_db" not in records.truth or np.isnan(records.truth["background_db"][row])
    clear = _spectrum(records.radar, records.iq[row])[1].max() > CLEAR_DB
    if clear and alone and records.labels[row] == "uav":  # the figure marks comb and band, so both must be measured
        clear = not _measured(records.radar, records.iq[row])["reason"]
    return False, not alone, not clear


def show_stfts(seed: int) -> dict[str, Any]:
    """Give the four STFTs of the paper's quadcopter, and the one spectrum of the same record.

    Parameters
    ----------
    seed : int
        Of the scene's noise.

    Returns
    -------
    dict
        ``scene``; ``pictures``, one a setting: ``window``, ``overlap``, ``frames`` and a picture as in `show_examples`;
        ``spectrum`` as there; ``fft_bytes`` and in each picture ``bytes``: size as complex64, all frequencies kept.
    """
    from bladewing.simulate import Scene

    scene = Scene.load("quadcopter")
    iq, radar = scene.render(seed).iq, scene.sight
    velocity, level = _spectrum(radar, iq)
    span = _span_mps(radar, velocity, level)
    inside = np.abs(velocity) <= span
    pictures = []
    for window, overlap in STFT_SETTINGS:
        count = len(frames(iq, window=window, overlap=overlap))
        about = {"window": window, "overlap": overlap, "frames": count, "bytes": 8 * count * STFT_BINS}
        pictures.append({**about, **_picture(radar, iq, span, window=window, overlap=overlap)})
    curve = _curve(velocity[inside], level[inside])
    return {"scene": "quadcopter", "spectrum": curve, "fft_bytes": 8 * radar.pulses, "pictures": pictures}


def _measured(radar: Radar, iq: NDArray[np.complex64]) -> dict[str, Any]:
    """Give what `measure` finds in a record, frequencies also as velocities."""
    found = measure(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)

    def known(value: Any, scale: float = 1.0) -> float | None:
        return float(value) * scale if np.isfinite(value) else None

    half = radar.wavelength_m / 2
    body, band = known(found.body_velocity_mps), known(found.bandwidth_hz, half)
    middles = [0.0] if body is None else [0.0, body]
    return {
        "reason": str(found.reason) or str(found.band_reason),
        "body_mps": body,
        "chopping_hz": known(found.chopping_hz),
        "chopping_mps": known(found.chopping_hz, half),
        "orders": None if known(found.comb_order) is None else int(found.comb_order),
        "band_hz": known(found.bandwidth_hz),
        "band_mps": None if band is None or body is None else [body - band / 2, body + band / 2],
        "tip_mps": known(found.tip_speed_mps),
        "notches_mps": [[middle - NOTCH_MPS, middle + NOTCH_MPS] for middle in middles],
    }


def _spectrum(radar: Radar, iq: NDArray[np.complex64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give rising velocities and the level over the noise floor at each [dB]."""
    spectrum = doppler_spectrum(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    order = np.argsort(spectrum.velocity_mps)
    return spectrum.velocity_mps[order], spectrum.level_db[order].astype(np.float64)


def _span_mps(radar: Radar, velocity: NDArray[np.float64], level: NDArray[np.float64]) -> float:
    """Give how far the velocity axis reaches to either side [m/s]."""
    lines = np.abs(velocity[level > LINE_DB])
    return min(radar.unambiguous_mps, max(LEAST_SPAN_MPS, MARGIN * float(lines.max(initial=0.0))))


def _curve(velocity: NDArray[np.float64], level: NDArray[np.float64]) -> dict[str, Any]:
    """Pool a spectrum for JSON: the mean velocity and the highest level of each pool."""
    middle, highest = _pools(velocity, POINTS).mean(axis=1), _pools(level, POINTS).max(axis=1)
    return {"velocity_mps": np.round(middle, 3).tolist(), "level_db": np.round(highest, 1).tolist()}


def _picture(
    radar: Radar, iq: NDArray[np.complex64], span_mps: float, *, window: int, overlap: float
) -> dict[str, Any]:
    """Give the pooled STFT power [dB]: one row per velocity, rising, and one column per time."""
    power = np.abs(scipy.fft.fftshift(stft(iq, window=window, overlap=overlap), axes=-1)) ** 2
    level_db = 10.0 * np.log10(power + power.max() * 1e-12)
    # The Doppler frequency is -2 v / wavelength: rising velocity is falling frequency.
    rising = level_db.T[::-1]
    step = 2.0 * radar.unambiguous_mps / STFT_BINS
    velocity = -step * (np.arange(STFT_BINS) - STFT_BINS // 2)[::-1]
    inside = np.abs(velocity) <= span_mps
    time_s = (window / 2.0 + round(window * (1.0 - overlap)) * np.arange(rising.shape[1])) / radar.prf_hz
    rows = _pools(rising[inside], ROWS).max(axis=1)
    pooled = _pools(rows.T, COLUMNS).max(axis=1).T
    return {
        "velocity_mps": _outer_edges(_pools(velocity[inside], ROWS)),
        "time_s": _outer_edges(_pools(time_s, COLUMNS)),
        "level_db": np.round(pooled - np.median(rising)).astype(int).tolist(),
    }


def _pools(values: NDArray[np.floating], most: int) -> NDArray[np.floating]:
    """Group neighbours along the first axis into at most `most` pools of equal size; a remainder is dropped."""
    size = -(-values.shape[0] // most)
    count = values.shape[0] // size
    return values[: count * size].reshape(count, size, *values.shape[1:])


def _outer_edges(pools: NDArray[np.floating]) -> list[float]:
    """Give where the first pool of an evenly spaced axis begins and where the last one ends."""
    axis = pools.ravel()
    half = (axis[1] - axis[0]) / 2.0
    return [float(axis[0] - half), float(axis[-1] + half)]
