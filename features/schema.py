"""The one table of what models take: every feature with its unit, range and meaning, and the shape of every input."""

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .change import PARTS
from .shape import SPEED_BANDS_MPS

#: Bins of the shared velocity axis of the "levels" and "spectrum" inputs.
AXIS_BINS = 256

#: Channels of the "levels" input: mean level, peak level over noise [dB each].
LEVEL_CHANNELS = 2

#: Channels of the "spectrum" input: the levels, their change over the dwell's parts, and the mean level in each [dB].
SPECTRUM_CHANNELS = LEVEL_CHANNELS + 1 + PARTS

#: Bins of the shared axis of rates of the "cadence" input.
CADENCE_BINS = 96

#: Bins of the axis of chopping frequencies of the "combs" input.
COMB_BINS = 64

#: Velocity bins and frames of the "image" input.
IMAGE_BINS, IMAGE_FRAMES = 64, 32


@dataclass(frozen=True)
class Feature:
    """One number of a feature vector.

    Parameters
    ----------
    name : str
        Name, unit at its end where it has one.
    unit : str
        Unit; "1" for a pure number.
    low, high : float
        Range the value is held in.
    meaning : str
        What it says.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str


class FeatureTable(tuple[Feature, ...]):
    """Features in the order of their vector, with their ranges as arrays."""

    @cached_property
    def low(self) -> NDArray[np.float32]:
        """Lower bounds, shape (features,)."""
        return np.array([feature.low for feature in self], np.float32)

    @cached_property
    def high(self) -> NDArray[np.float32]:
        """Upper bounds, shape (features,)."""
        return np.array([feature.high for feature in self], np.float32)


def _bands(stem: str, what: str) -> tuple[Feature, ...]:
    return tuple(
        Feature(f"{stem}_{a:g}_{b:g}_db", "dB", -20, 100, f"{what}, {a:g}-{b:g} m/s")
        for a, b in pairwise(SPEED_BANDS_MPS)
    )


_RADAR = (
    Feature("velocity_step_log", "log10 m/s", -4, 2, "velocity resolution of the dwell, wavelength / (2 dwell)"),
    Feature("unambiguous_log", "log10 m/s", 0, 4, "unambiguous velocity, wavelength x PRF / 4"),
    Feature("dwell_log", "log10 s", -4, 2, "dwell, pulses / PRF"),
    Feature("pulses_log", "log10", 0, 5, "pulses"),
)

FEATURES = FeatureTable(
    (
        *_RADAR,
        Feature("body_level_db", "dB", -20, 120, "strongest line over the noise floor"),
        Feature("body_speed_mps", "m/s", 0, 300, "speed of the strongest line, either way"),
        Feature("rest_level_db", "dB", -20, 120, "level at velocity zero"),
        Feature("notch_residual_db", "dB", -20, 120, "mean power outside the notches over the noise floor"),
        Feature("notch_residual_share", "1", 0, 1, "energy outside the notches over all energy"),
        Feature("bandwidth_log", "log10 Hz", 0, 6, "Doppler bandwidth by threshold outside the notches (eq. 26)"),
        Feature("bandwidth_speed_mps", "m/s", 0, 800, "the same as a velocity"),
        Feature("span_share", "1", 0, 1, "the same over the unambiguous span"),
        Feature(
            "energy_speed_high_mps", "m/s", 0, 400, "faster edge of the band that holds 95 % of the residual energy"
        ),
        Feature("energy_speed_low_mps", "m/s", -400, 400, "its slower edge, signed with the faster one"),
        Feature("energy_width_mps", "m/s", 0, 800, "its width"),
        Feature("occupancy", "1", 0, 1, "share of the bins in that band that hold energy"),
        Feature("entropy", "1", 0, 1, "evenness of the residual energy over the bins"),
        Feature("ripple_db", "dB", 0, 60, "standard deviation of the level outside the notches"),
        Feature("peak_over_mean_db", "dB", 0, 120, "strongest residual line over the residual mean"),
        Feature("symmetry", "1", -1, 1, "correlation of the two sides about the body line"),
        Feature("chopping_log", "log10 Hz", 0, 4, "cepstral chopping frequency (eq. 25); 0 where none can be sought"),
        Feature("chopping_step_mps", "m/s", 0, 400, "the same as a velocity"),
        Feature("chopping_strength", "1", 0, 60, "prominence of the cepstral peak over the rms of noise"),
        Feature("chopping_repeats", "1", 0, 2, "cepstral peaks at twice and three times the period, over the first"),
        Feature("chopping_turns", "log10", -2, 4, "chopping periods in the dwell"),
        Feature("chopping_orders", "1", 0, 400, "bandwidth over chopping frequency: lines in the comb"),
        Feature("smearing_index", "1", 0, 0.3, "spread of rotor rates from the growth of line width with order"),
        Feature("change_slow_db", "dB", 0, 40, "change over the dwell, speeds below 3 m/s"),
        Feature("change_middle_db", "dB", 0, 40, "change over the dwell, 3-20 m/s"),
        Feature("change_fast_db", "dB", 0, 40, "change over the dwell, above 20 m/s"),
        Feature("centroid_swing_mps", "m/s", 0, 200, "standard deviation of the centroid over the dwell's parts"),
        Feature("centroid_drift_mps", "m/s", 0, 200, "rise or fall of the centroid over the dwell"),
        Feature("busy_swing_db", "dB", 0, 60, "standard deviation of the mean level over the dwell's parts"),
        Feature("empty_side_db", "dB", 0, 100, "mean level of the fuller side over the emptier one's"),
        *_bands("strong", "stronger side"),
        *_bands("weak", "weaker side"),
    )
)

JOINT_FEATURES = FeatureTable(
    (
        *_RADAR,
        Feature("joint_bandwidth_mps", "m/s", 0, 800, "mean width of the frames' bands over 6 dB"),
        Feature("joint_bandwidth_swing_mps", "m/s", 0, 400, "its standard deviation over the frames"),
        Feature("joint_centroid_swing_mps", "m/s", 0, 400, "standard deviation of the frames' centroid"),
        Feature("joint_entropy", "1", 0, 1, "evenness of the energy over the image"),
        Feature("flash_log", "log10 Hz", 0, 5, "rate of the strongest cadence of the fast bins; 0 where there is none"),
        Feature("flash_strength", "1", 0, 60, "that cadence over the rms of all"),
        Feature("frame_swing_db", "dB", 0, 60, "standard deviation of the frames' mean level"),
        Feature("frame_kurtosis", "1", 0, 40, "peakedness of the fast bins' power over the frames: flashes"),
        *_bands("joint_mean", "mean over the frames"),
        *_bands("joint_swing", "standard deviation over the frames"),
        *_bands("joint_peak", "largest over the frames"),
    )
)

#: Shape of each named model input for one record, float32.
INPUT_SHAPES: dict[str, tuple[int, ...]] = {
    "features": (len(FEATURES),),
    "levels": (LEVEL_CHANNELS, AXIS_BINS),
    "spectrum": (SPECTRUM_CHANNELS, AXIS_BINS),
    "cadence": (2, CADENCE_BINS),
    "combs": (1, COMB_BINS),
    "joint_features": (len(JOINT_FEATURES),),
    "image": (1, IMAGE_BINS, IMAGE_FRAMES),
}


def schema_hash() -> str:
    """SHA-256 (hex) of names, units, ranges, meanings and shapes: a model made for another is refused."""
    table = {
        "features": [asdict(f) for f in FEATURES],
        "joint_features": [asdict(f) for f in JOINT_FEATURES],
        "shapes": {name: list(shape) for name, shape in INPUT_SHAPES.items()},
        "parts": PARTS,
    }
    return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()
