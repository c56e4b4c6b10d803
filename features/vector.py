"""The feature vector: every measurement of the spectrum, in the order of the schema."""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .axis import axis_velocities_mps
from .bandwidth import energy_band_mps, noise_threshold_db, threshold_band_hz
from .change import centroid_mps, swing
from .chopping import cepstral_chopping
from .fast import means, sums
from .notch import Body, notch_residual_db, residual, weights
from .schema import FEATURES, FeatureTable
from .shape import band_levels_db, entropy, ripple_db, symmetry
from .smearing import smearing_index
from .spectrum import SPEED_OF_LIGHT_MPS, Spectrum

#: Power over the floor above which a bin's energy counts, at a level of 6 dB: noise exceeds it in 2 % of the bins.
SIGNIFICANT = np.float32(10 ** (6.0 / 10) - 1)

#: EMPTIEST: lower bound of a side's mean power over the floor, for empty sides. LEAST_TURNS: lower bound of the
#: chopping periods in a dwell.
EMPTIEST, LEAST_TURNS = 1e-2, 0.01

#: Names of the bands' levels on the stronger and on the weaker side.
BANDS = tuple([f.name for f in FEATURES if f.name.startswith(stem)] for stem in ("strong_", "weak_"))

#: Speeds that divide the change over the dwell into slow, middle and fast [m/s].
_CHANGE_MPS = (3.0, 20.0)


@lru_cache(maxsize=4)
def axis_plan(bins: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The shared axis [m/s], and each bin's share in the mean over the slow, middle and fast ones, shape (3, bins)."""
    axis_mps = axis_velocities_mps(bins)
    part = np.searchsorted(_CHANGE_MPS, np.abs(axis_mps))
    inside = part == np.arange(3)[:, None]
    return axis_mps.astype(np.float32), (inside / inside.sum(axis=1, keepdims=True)).astype(np.float32)


@lru_cache(maxsize=64)
def radar_columns(carrier_hz: float, prf_hz: float, pulses: int) -> dict[str, float]:
    """The features that depend on the radar and the dwell alone, as logarithms to base 10."""
    wavelength_m, dwell_s = SPEED_OF_LIGHT_MPS / carrier_hz, pulses / prf_hz
    return {
        "velocity_step_log": math.log10(wavelength_m / (2 * dwell_s)),
        "unambiguous_log": math.log10(wavelength_m * prf_hz / 4),
        "dwell_log": math.log10(dwell_s),
        "pulses_log": math.log10(pulses),
    }


def lay_out(columns: Mapping[str, ArrayLike], table: FeatureTable, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Put named columns in a table's order, each held in its range; NaN (no value) becomes 0.

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
    out = rows.reshape(len(table), -1).T.copy()
    # fmax and fmin would take a bound for NaN; "no value" is 0
    out[np.isnan(out)] = 0
    np.maximum(out, table.low, out=out)
    np.minimum(out, table.high, out=out)
    return out.reshape(*shape, len(table))


def feature_vector(
    spectrum: Spectrum,
    body: Body,
    mask: NDArray[np.bool_],
    axis_db: NDArray[np.float32],
    parts: NDArray[np.float32],
    change: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Every number of the schema's `FEATURES`, in its order.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    body : Body
        From `body_line`.
    mask : ndarray of bool, shape (..., bins)
        From `notch_mask`.
    axis_db : ndarray of float32, shape (..., axis bins)
        Their mean level on the shared axis.
    parts : ndarray of float32, shape (..., PARTS, axis bins)
        Levels of the dwells' parts, from `parts_db`.
    change : ndarray of float32, shape (..., axis bins)
        Their change, from `change_db`.

    Returns
    -------
    ndarray of float32, shape (..., len(FEATURES))
        Finite, each within its range.
    """
    kept = weights(mask)
    above = residual(spectrum)
    total = sums(above)
    excess = np.multiply(above, kept, out=above)
    energy = excess * weights(excess > SIGNIFICANT)  # a choice bin by bin would cost ten times as much
    root = np.sqrt(energy)
    chopping = cepstral_chopping(spectrum, kept)
    residual_db = notch_residual_db(spectrum, kept)

    low_hz, high_hz = threshold_band_hz(spectrum, noise_threshold_db(spectrum.bins), mask)
    width_hz = high_hz - low_hz
    low, high, occupancy = energy_band_mps(spectrum, energy)

    axis_mps, change_shares = axis_plan(axis_db.shape[-1])
    changes = (change_shares @ change[..., None])[..., 0]
    centroid = centroid_mps(parts, axis_mps)
    half, side = spectrum.bins // 2, (spectrum.bins - 1) // 2  # without the bin at half the PRF, which has no mirror
    power = spectrum.relative_power
    left, right = sums(power[..., half - side : half]), sums(power[..., half + 1 : half + 1 + side])
    emptiest = np.float32(EMPTIEST * side)
    peak = np.maximum.reduce(excess, axis=-1)
    chopping_hz = np.maximum(chopping.frequency_hz, np.float32(1))
    half_wavelength_m = np.float32(spectrum.wavelength_m / 2)
    dwell_s = np.float32(spectrum.pulses / spectrum.prf_hz)

    speed_mps = np.abs(body.velocity_mps)  # refined from the bin at half the PRF, it may lie beyond: folded back below

    columns: dict[str, ArrayLike] = {
        **radar_columns(spectrum.carrier_hz, spectrum.prf_hz, spectrum.pulses),
        "body_level_db": body.level_db,
        "body_speed_mps": np.minimum(speed_mps, np.float32(spectrum.prf_hz * spectrum.wavelength_m / 2) - speed_mps),
        "rest_level_db": np.maximum.reduce(spectrum.level_db[..., half - 1 : half + 2], axis=-1),
        "notch_residual_db": residual_db,
        "notch_residual_share": sums(excess) / np.maximum(total, np.float32(1e-30)),
        "bandwidth_log": np.log10(np.maximum(width_hz, np.float32(1))),
        "bandwidth_speed_mps": width_hz * half_wavelength_m,
        "span_share": width_hz * np.float32(1 / spectrum.prf_hz),
        "energy_speed_high_mps": np.maximum(high, -low),
        "energy_speed_low_mps": np.maximum(low, -high),
        "energy_width_mps": high - low,
        "occupancy": occupancy,
        "entropy": entropy(energy),
        "ripple_db": ripple_db(spectrum, kept),
        "peak_over_mean_db": np.log10(peak + np.float32(1)) * np.float32(10) - residual_db,
        "symmetry": symmetry(root, body),
        "chopping_log": np.log10(chopping_hz),
        "chopping_step_mps": chopping.frequency_hz * half_wavelength_m,
        "chopping_strength": chopping.strength,
        "chopping_repeats": chopping.repeats,
        "chopping_turns": np.log10(np.maximum(chopping.frequency_hz * dwell_s, np.float32(LEAST_TURNS))),
        "chopping_orders": width_hz / chopping_hz,
        "smearing_index": smearing_index(spectrum, energy, body, chopping, root),
        "change_slow_db": changes[..., 0],
        "change_middle_db": changes[..., 1],
        "change_fast_db": changes[..., 2],
        "centroid_swing_mps": swing(centroid),
        "centroid_drift_mps": np.abs(centroid[..., -1] - centroid[..., 0]),
        "busy_swing_db": swing(means(parts)),
        "empty_side_db": np.abs(np.log10(np.maximum(left, emptiest) / np.maximum(right, emptiest))) * np.float32(10),
    }
    for names, levels in zip(BANDS, band_levels_db(axis_db), strict=True):
        columns.update(zip(names, levels.reshape(-1, len(names)).T, strict=True))
    return lay_out(columns, FEATURES, spectrum.transform_floor.shape)
