"""The feature vector: every measurement of the spectrum, in the order of the schema."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .axis import axis_velocities_mps
from .bandwidth import energy_band_mps, noise_threshold_db, threshold_band_hz
from .change import Parts, busy_db, centroid_mps, change_db
from .chopping import cepstral_chopping
from .notch import body_line, notch_mask, notch_residual_db, residual
from .schema import FEATURES, Feature
from .shape import band_levels_db, entropy, ripple_db, symmetry
from .smearing import smearing_index
from .spectrum import Spectrum

#: Energy counts where the level is this far over the floor [dB]: noise passes it in 2 % of the bins.
SIGNIFICANT_DB = 6.0


def radar_columns(spectrum: Spectrum) -> dict[str, float]:
    """What the radar allows to be seen, as logarithms."""
    dwell = spectrum.pulses / spectrum.prf_hz
    return {
        "velocity_step_log": np.log10(spectrum.wavelength_m / (2 * dwell)),
        "unambiguous_log": np.log10(spectrum.wavelength_m * spectrum.prf_hz / 4),
        "dwell_log": np.log10(dwell),
        "pulses_log": np.log10(spectrum.pulses),
    }


def lay_out(columns: dict[str, NDArray], table: tuple[Feature, ...], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Put named columns in a table's order, each held in its range and NaN (no value) set to 0, clipped to the range.

    Parameters
    ----------
    columns : dict of str to ndarray
        One entry a feature, broadcastable to `shape`.
    table : tuple of Feature
        Order and ranges.
    shape : tuple of int
        Leading shape.

    Returns
    -------
    ndarray of float32, shape (*shape, len(table))
    """
    out = np.empty((*shape, len(table)), np.float32)
    for number, feature in enumerate(table):
        out[..., number] = columns[feature.name]
    low, high = _ranges(table)
    # fmax and fmin would take a bound for NaN; "no value" is 0
    return np.clip(np.where(np.isnan(out), np.float32(0), out), low, high)


@lru_cache(maxsize=4)
def _ranges(table: tuple[Feature, ...]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lower and upper bounds of a table's features."""
    return np.array([f.low for f in table], np.float32), np.array([f.high for f in table], np.float32)


def feature_vector(
    spectrum: Spectrum, axis_db: NDArray[np.float32], parts: Parts, change: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Every number of the schema's `FEATURES`, in its order.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    axis_db : ndarray of float32, shape (..., axis bins)
        Their mean level on the shared axis.
    parts : Parts
        Spectra of the dwells' parts.
    change : ndarray of float32, shape (..., axis bins), optional
        `change_db(parts)` if it is at hand.

    Returns
    -------
    ndarray of float32, shape (..., len(FEATURES))
        Finite, each within its range.
    """
    body = body_line(spectrum)
    mask = notch_mask(spectrum, body)
    excess = residual(spectrum, mask)
    energy = np.where(spectrum.level_db > SIGNIFICANT_DB, excess, np.float32(0))
    chopping = cepstral_chopping(spectrum, mask)
    residual_db = notch_residual_db(spectrum, mask)

    outside = Spectrum(
        np.where(mask, spectrum.relative_power, np.float32(0)),
        spectrum.floor,
        spectrum.carrier_hz,
        spectrum.prf_hz,
        spectrum.pulses,
        spectrum.scale,
    )
    low_hz, high_hz = threshold_band_hz(outside, noise_threshold_db(spectrum.bins))
    width_hz = high_hz - low_hz
    low, high, occupancy = energy_band_mps(spectrum, energy)
    faster_positive = np.abs(high) >= np.abs(low)
    far = np.where(faster_positive, high, -low)
    near = np.where(faster_positive, low, -high)

    axis_mps = axis_velocities_mps(axis_db.shape[-1])
    speed = np.abs(axis_mps)
    change = change_db(parts) if change is None else change
    centroid = centroid_mps(parts, axis_mps)
    strong, weak = band_levels_db(axis_db, axis_mps)
    half = spectrum.bins // 2
    side = spectrum.relative_power[..., :half].mean(-1), spectrum.relative_power[..., -half:].mean(-1)
    total = np.maximum(spectrum.relative_power - 1, 0).sum(axis=-1)
    peak = excess.max(axis=-1)

    columns: dict[str, NDArray] = {
        **{name: np.asarray(value) for name, value in radar_columns(spectrum).items()},
        "body_level_db": body.level_db,
        "body_speed_mps": np.abs(body.velocity_mps),
        "rest_level_db": spectrum.level_db[..., half - 1 : half + 2].max(axis=-1),
        "notch_residual_db": residual_db,
        "notch_residual_share": excess.sum(axis=-1) / np.where(total > 0, total, 1),
        "bandwidth_log": np.log10(np.maximum(width_hz, 1)),
        "bandwidth_speed_mps": width_hz * (spectrum.wavelength_m / 2),
        "span_share": width_hz / spectrum.prf_hz,
        "energy_speed_high_mps": far,
        "energy_speed_low_mps": near,
        "energy_width_mps": high - low,
        "occupancy": occupancy,
        "entropy": entropy(energy),
        "ripple_db": ripple_db(spectrum, mask),
        "peak_over_mean_db": 10 * np.log10(np.maximum(peak + 1, 1)) - residual_db,
        "symmetry": symmetry(spectrum, energy, body),
        "chopping_log": np.log10(np.maximum(chopping.frequency_hz, 1)),
        "chopping_step_mps": chopping.frequency_hz * np.float32(spectrum.wavelength_m / 2),
        "chopping_strength": chopping.strength,
        "chopping_repeats": chopping.repeats,
        "chopping_turns": np.log10(np.maximum(chopping.frequency_hz * (spectrum.pulses / spectrum.prf_hz), 0.01)),
        "chopping_orders": width_hz / np.maximum(chopping.frequency_hz, 1),
        "smearing_index": smearing_index(spectrum, energy, body, chopping),
        "change_slow_db": change[..., speed < 3].mean(axis=-1),
        "change_middle_db": change[..., (speed >= 3) & (speed < 20)].mean(axis=-1),
        "change_fast_db": change[..., speed >= 20].mean(axis=-1),
        "centroid_swing_mps": centroid.std(axis=-1),
        "centroid_drift_mps": np.abs(centroid[..., -1] - centroid[..., 0]),
        "busy_swing_db": busy_db(parts).std(axis=-1),
        "empty_side_db": np.abs(10 * np.log10(np.maximum(side[0], 1e-2) / np.maximum(side[1], 1e-2))),
    }
    names = [f.name for f in FEATURES]
    for stem, levels in (("strong_", strong), ("weak_", weak)):
        bands = [name for name in names if name.startswith(stem)]
        columns.update({name: levels[..., i] for i, name in enumerate(bands)})
    return lay_out(columns, FEATURES, spectrum.floor.shape)
