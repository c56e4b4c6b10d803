"""The feature vector: every measurement of the spectrum, in the order of the schema."""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .axis import axis_velocities_mps
from .bandwidth import energy_band_mps, noise_threshold_db, threshold_band_hz
from .change import Parts, busy_db, centroid_mps, change_db
from .chopping import cepstral_chopping
from .notch import body_line, notch_mask, notch_residual_db, residual, weights
from .schema import FEATURES, FeatureTable
from .shape import band_levels_db, entropy, ripple_db, symmetry
from .smearing import smearing_index
from .spectrum import Spectrum

#: Energy counts where the level is this far over the floor [dB]: noise passes it in 2 % of the bins.
SIGNIFICANT_DB = 6.0

_SIGNIFICANT = np.float32(10 ** (SIGNIFICANT_DB / 10) - 1)


#: Names of the bands' levels on the stronger and on the weaker side.
_BANDS = tuple([f.name for f in FEATURES if f.name.startswith(stem)] for stem in ("strong_", "weak_"))

#: Speeds that part the change over the dwell into slow, middle and fast [m/s].
_CHANGE_MPS = (3.0, 20.0)


@lru_cache(maxsize=4)
def _axis_plan(bins: int) -> tuple[NDArray[np.float64], NDArray[np.intp], tuple[int, int, int]]:
    """The shared axis [m/s], where its fast, middle, slow, middle and fast parts begin, and how many bins each has."""
    axis_mps = axis_velocities_mps(bins)
    edges = np.searchsorted(axis_mps, [-_CHANGE_MPS[1], -_CHANGE_MPS[0], _CHANGE_MPS[0], _CHANGE_MPS[1]])
    fast, middle, slow, *others = np.diff(edges, prepend=0, append=bins)
    return axis_mps, np.append(0, edges), (int(slow), int(middle + others[0]), int(fast + others[1]))


def radar_columns(spectrum: Spectrum) -> dict[str, float]:
    """What the radar allows to be seen, as logarithms."""
    dwell = spectrum.pulses / spectrum.prf_hz
    return {
        "velocity_step_log": math.log10(spectrum.wavelength_m / (2 * dwell)),
        "unambiguous_log": math.log10(spectrum.wavelength_m * spectrum.prf_hz / 4),
        "dwell_log": math.log10(dwell),
        "pulses_log": math.log10(spectrum.pulses),
    }


def lay_out(columns: Mapping[str, ArrayLike], table: FeatureTable, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Put named columns in a table's order, each held in its range and NaN (no value) set to 0, clipped to the range.

    Parameters
    ----------
    columns : dict of str to ndarray
        One entry a feature, broadcastable to `shape`.
    table : FeatureTable
        Order and ranges.
    shape : tuple of int
        Leading shape.

    Returns
    -------
    ndarray of float32, shape (*shape, len(table))
    """
    rows = np.empty((len(table), *shape), np.float32)
    for number, feature in enumerate(table):
        rows[number] = columns[feature.name]
    out = np.ascontiguousarray(np.moveaxis(rows, 0, -1))
    # fmax and fmin would take a bound for NaN; "no value" is 0
    out[np.isnan(out)] = 0
    np.maximum(out, table.low, out=out)
    return np.minimum(out, table.high, out=out)


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
    kept = weights(mask)
    above = residual(spectrum)
    excess = above * kept
    energy = excess * (excess > _SIGNIFICANT)  # a choice bin by bin would cost ten times as much
    chopping = cepstral_chopping(spectrum, kept)
    residual_db = notch_residual_db(spectrum, kept)

    low_hz, high_hz = threshold_band_hz(spectrum, noise_threshold_db(spectrum.bins), mask)
    width_hz = high_hz - low_hz
    low, high, occupancy = energy_band_mps(spectrum, energy)
    faster_positive = np.abs(high) >= np.abs(low)
    far = np.where(faster_positive, high, -low)
    near = np.where(faster_positive, low, -high)

    axis_mps, change_parts, change_widths = _axis_plan(axis_db.shape[-1])
    change = change_db(parts) if change is None else change
    changes = np.add.reduceat(change, change_parts, axis=-1)
    centre = changes[..., 2], changes[..., 1] + changes[..., 3], changes[..., 0] + changes[..., 4]
    slow, middle, fast = (value / width for value, width in zip(centre, change_widths, strict=True))
    centroid = centroid_mps(parts, axis_mps)
    strong, weak = band_levels_db(axis_db, axis_mps)
    half = spectrum.bins // 2
    power = spectrum.relative_power
    side = np.add.reduce(power[..., :half], axis=-1) / half, np.add.reduce(power[..., -half:], axis=-1) / half
    total = np.add.reduce(above, axis=-1)
    peak = excess.max(axis=-1)

    columns: dict[str, NDArray | float] = {
        **radar_columns(spectrum),
        "body_level_db": body.level_db,
        "body_speed_mps": np.abs(body.velocity_mps),
        "rest_level_db": spectrum.level_db[..., half - 1 : half + 2].max(axis=-1),
        "notch_residual_db": residual_db,
        "notch_residual_share": np.add.reduce(excess, axis=-1) / np.where(total > 0, total, 1),
        "bandwidth_log": np.log10(np.maximum(width_hz, 1)),
        "bandwidth_speed_mps": width_hz * (spectrum.wavelength_m / 2),
        "span_share": width_hz / spectrum.prf_hz,
        "energy_speed_high_mps": far,
        "energy_speed_low_mps": near,
        "energy_width_mps": high - low,
        "occupancy": occupancy,
        "entropy": entropy(energy),
        "ripple_db": ripple_db(spectrum, kept),
        "peak_over_mean_db": 10 * np.log10(peak + 1) - residual_db,
        "symmetry": symmetry(spectrum, energy, body),
        "chopping_log": np.log10(np.maximum(chopping.frequency_hz, 1)),
        "chopping_step_mps": chopping.frequency_hz * np.float32(spectrum.wavelength_m / 2),
        "chopping_strength": chopping.strength,
        "chopping_repeats": chopping.repeats,
        "chopping_turns": np.log10(np.maximum(chopping.frequency_hz * (spectrum.pulses / spectrum.prf_hz), 0.01)),
        "chopping_orders": width_hz / np.maximum(chopping.frequency_hz, 1),
        "smearing_index": smearing_index(spectrum, energy, body, chopping),
        "change_slow_db": slow,
        "change_middle_db": middle,
        "change_fast_db": fast,
        "centroid_swing_mps": centroid.std(axis=-1),
        "centroid_drift_mps": np.abs(centroid[..., -1] - centroid[..., 0]),
        "busy_swing_db": busy_db(parts).std(axis=-1),
        "empty_side_db": np.abs(10 * np.log10(np.maximum(side[0], 1e-2) / np.maximum(side[1], 1e-2))),
    }
    for names, levels in zip(_BANDS, (strong, weak), strict=True):
        columns.update(zip(names, np.moveaxis(levels, -1, 0), strict=True))
    return lay_out(columns, FEATURES, spectrum.floor.shape)
