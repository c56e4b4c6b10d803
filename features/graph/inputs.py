"""Raw IQ to the model inputs without an STFT in graph operators, for one radar and one dwell."""

from collections.abc import Collection

import numpy as np

from ..axis import pooling
from ..change import PARTS, frame_starts, part_length
from ..dropouts import AS_NEAR, LEAST_DISTINCT, LEAST_LOST, MOST_IN_A_ROW
from ..notch import LEAST_RESIDUAL
from ..samples import LEAST_PART
from ..schema import AXIS_BINS, FEATURES, INPUT_SHAPES
from ..spectrum import Spectrum, doppler_spectrum
from ..vector import BANDS, EMPTIEST, LEAST_TURNS, SIGNIFICANT, radar_columns
from ..window import HANN
from .cadence import cadence_db
from .comb_levels import comb_levels_db
from .empty_side import filled_sides
from .measurements import (
    Body,
    band_levels_db,
    body_line,
    centroid_mps,
    cepstral_chopping,
    change_levels_db,
    energy_band,
    entropy,
    log10,
    notch_weights,
    ratio,
    ripple_db,
    smearing_index,
    symmetry,
    threshold_width_hz,
)
from .operators import Graph, Value
from .spectrum import (
    centred_transform,
    noise_floor,
    noise_shows,
    pooled,
    pooled_mean,
    power_of,
    side_floors,
    to_db,
    unit_scale,
)

#: The model inputs that are made in a graph.
IN_GRAPH = ("features", "levels", "spectrum", "cadence", "combs")

#: Name of the graph's input: float32, shape (records, pulses, 2), I and Q.
IQ = "iq"


#: Largest relative difference between samples of a converter's least step: others are as alike by chance alone.
_OF_A_STEP = 1e-5


def input_graph(
    graph: Graph, *, carrier_hz: float, prf_hz: float, pulses: int, names: Collection[str]
) -> tuple[dict[str, Value], Value]:
    """Append the operators that make model inputs from the value named `IQ`.

    Parameters
    ----------
    graph : Graph
        The graph that they are appended to.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.
    pulses : int
        Pulses of a record, at least `inputs.MIN_PULSES`.
    names : collection of str
        Some of `IN_GRAPH`.

    Returns
    -------
    inputs : dict of str to Value
        As `inputs.model_inputs` gives them, shape (records, *INPUT_SHAPES[name]).
    live : Value
        Whether a record holds a signal, only finite samples, no lost pulses and, if it holds noise, two channels; shape
        (records, 1).

    Raises
    ------
    ValueError
        If a name is not one of them.
    """
    unknown = set(names) - set(IN_GRAPH)
    if unknown:
        raise ValueError(f"model input {sorted(unknown)[0]!r} is not made in a graph: only {', '.join(IN_GRAPH)} are")
    # a spectrum without signal, for what depends on the radar alone
    radar = doppler_spectrum(np.zeros(pulses, np.complex64), carrier_hz=carrier_hz, prf_hz=prf_hz, window=HANN)
    iq = Value(graph, IQ, np.float32)
    flat = iq.reshape(-1, 2 * pulses)
    largest = flat.apply("Abs").max()
    scaled = flat * unit_scale(largest)
    # a sum with a value that is not finite is in no limit; such a record spoils no other, and its answer is replaced
    live = (largest >= LEAST_PART) & (scaled.sum().apply("Abs") <= 8.0 * pulses)
    of_pulses = scaled.reshape(-1, pulses, 2)
    size = of_pulses.apply("Abs")
    live = live & _none_lost(graph, size.max(keep=False), pulses)
    packed = of_pulses.transpose(0, 2, 1)

    transform = centred_transform(packed, pulses, radar.bins, radar.window)
    power = power_of(transform, radar.bins)
    packed, transform = filled_sides(packed, transform, power, pulses, radar.bins, radar.window)
    power = power_of(transform, radar.bins)
    floor = noise_floor(power, side_floors(power, radar.bins, radar.window))
    live = live & (_two_channels(of_pulses) | noise_shows(power, floor).apply("Not"))
    relative_power = power / floor
    pool = pooling(radar.bins, radar.carrier_hz, radar.prf_hz, AXIS_BINS)
    levels = pooled(relative_power, radar.bins, pool)

    out = {"levels": levels}
    if {"features", "cadence", "combs"} & set(names):
        body = body_line(radar, relative_power)
        kept = notch_weights(radar, body)
    if "cadence" in names:
        out["cadence"] = cadence_db(radar, transform, floor, kept)
    if "combs" in names:
        out["combs"] = comb_levels_db(radar, transform, floor, kept)
    if "spectrum" in names or "features" in names:
        length = part_length(pulses)
        starts, _ = frame_starts(pulses, length, PARTS)
        frames = graph.concat(*(packed.slice(start, start + length) for start in starts), axis=1)
        bins = doppler_spectrum(np.zeros(length, np.complex64), carrier_hz=carrier_hz, prf_hz=prf_hz).bins
        whole = centred_transform(frames.reshape(-1, 2, length), length, bins, radar.window)
        parts = power_of(whole, bins).reshape(-1, PARTS, bins)
        pool = pooling(bins, radar.carrier_hz, radar.prf_hz, AXIS_BINS)
        parts_db = pooled_mean(parts / floor.reshape(-1, 1, 1), pool).at_least(0.0)
        away = parts_db - parts_db.sum(-2) / PARTS
        change = ((away * away).sum(-2, keep=False) / PARTS).apply("Sqrt")
        out["spectrum"] = graph.concat(levels, change.reshape(-1, 1, AXIS_BINS), parts_db, axis=1)
        if "features" in names:
            level_db = to_db(relative_power)
            mean = levels.slice(0, 1, axis=-2).reshape(-1, AXIS_BINS)
            out["features"] = _feature_vector(radar, relative_power, level_db, body, kept, mean, parts_db, change)
    return {name: out[name] for name in INPUT_SHAPES if name in names}, live


def _none_lost(graph: Graph, size: Value, pulses: int) -> Value:
    """Whether no pulses were lost, and no silence breaks a record, much as `dropouts` tells them, shape (records, 1).

    Fewer than three zeros are never lost pulses. Where a converter gives the zeros, more samples have its least step:
    eight places are that step from 0, for one that is 0. This does not hold for a signal that hardly reaches that step:
    such a record counts as one with lost pulses, unless its samples have hardly any other size.
    """
    is_there = size > 0.0
    there = is_there.count()
    others = graph.where(is_there, size, float(np.finfo(np.float32).max))
    least = others.min()
    steps = (others <= least * (1 + _OF_A_STEP)).count()
    zeros = pulses - there
    # beside a strong line at rest samples are nearly alike too, but then none is as large as a next step
    is_step = (size.max() >= least * AS_NEAR) | (size.max() <= least * (1 + _OF_A_STEP))
    hardly_steps = (size.max() <= least * LEAST_DISTINCT) & (there <= steps * LEAST_DISTINCT)
    upto = is_there.cumsum().pad(1, 0)
    in_a_row = min(MOST_IN_A_ROW, pulses - 1) + 1
    unbroken = (upto.slice(in_a_row, pulses + 1) - upto.slice(0, pulses + 1 - in_a_row)).min() > 0.0
    return (zeros < float(LEAST_LOST)) | (is_step & ((unbroken & (zeros < steps)) | hardly_steps))


def _two_channels(of_pulses: Value) -> Value:
    """Whether a record has two channels, much as `one_channel.one_channel` tells them, shape (records, 1).

    `of_pulses` holds I and Q, shape (records, pulses, 2).
    """
    real, imaginary = of_pulses.slice(0, 1), of_pulses.slice(1, 2)
    apart = of_pulses.graph.concat(real - imaginary, real + imaginary).apply("Abs").max(axis=-2, keep=False)
    highest, lowest = of_pulses.max(axis=-2, keep=False), -((-of_pulses).max(axis=-2, keep=False))
    spans = highest - lowest
    still = spans.max() <= 0.0  # a record that is the same in every pulse is not of one channel
    return still | (of_pulses.graph.concat(spans, apart).min() > 0.0)


def _feature_vector(
    radar: Spectrum,
    relative_power: Value,
    level_db: Value,
    body: Body,
    kept: Value,
    axis_db: Value,
    parts_db: Value,
    change: Value,
) -> Value:
    """As `vector.feature_vector`: a feature that has no value is 0 from the start, never NaN."""
    graph, bins = relative_power.graph, radar.bins
    over = (relative_power - 1.0).at_least(0.0)
    excess = over * kept
    energy = excess * (excess > float(SIGNIFICANT)).to(np.float32)
    residual_db = 10.0 * log10(((relative_power * kept).sum() / kept.sum().at_least(1.0)).at_least(LEAST_RESIDUAL))
    width_hz = threshold_width_hz(radar, relative_power, kept)
    low, high, occupancy = energy_band(radar, energy)
    changes = change_levels_db(change, AXIS_BINS)
    centroid = centroid_mps(parts_db, AXIS_BINS)
    strong, weak = band_levels_db(axis_db, AXIS_BINS)
    half, side = bins // 2, (bins - 1) // 2
    left = relative_power.slice(half - side, half).mean()
    right = relative_power.slice(half + 1, half + 1 + side).mean()

    speed_mps = body.velocity_mps.apply("Abs")

    columns: dict[str, Value | float] = {
        **radar_columns(radar.carrier_hz, radar.prf_hz, radar.pulses),
        "body_level_db": body.level_db,
        "body_speed_mps": speed_mps.at_most(radar.prf_hz * radar.wavelength_m / 2 - speed_mps),
        "rest_level_db": level_db.slice(half - 1, half + 2).max(),
        "notch_residual_db": residual_db,
        "notch_residual_share": ratio(excess.sum(), over.sum()),
        "bandwidth_log": log10(width_hz.at_least(1.0)),
        "bandwidth_speed_mps": width_hz * (radar.wavelength_m / 2),
        "span_share": width_hz / radar.prf_hz,
        "energy_speed_high_mps": high.at_least(-low),
        "energy_speed_low_mps": low.at_least(-high),
        "energy_width_mps": high - low,
        "occupancy": occupancy,
        "entropy": entropy(energy, bins),
        "ripple_db": ripple_db(level_db, kept),
        "peak_over_mean_db": 10.0 * log10((excess.max() + 1.0).at_least(1.0)) - residual_db,
        "symmetry": symmetry(radar, energy, body),
        **{f"change_{speed}_db": changes.slice(i, i + 1) for i, speed in enumerate(("slow", "middle", "fast"))},
        "centroid_swing_mps": centroid.std(),
        "centroid_drift_mps": (centroid.slice(PARTS - 1, PARTS) - centroid.slice(0, 1)).apply("Abs"),
        "busy_swing_db": parts_db.mean().squeeze().std(),
        "empty_side_db": (10.0 * log10(left.at_least(EMPTIEST) / right.at_least(EMPTIEST))).apply("Abs"),
    }
    for names, levels in zip(BANDS, (strong, weak), strict=True):
        columns.update((name, levels.slice(i, i + 1)) for i, name in enumerate(names))
    comb = cepstral_chopping(radar, level_db, kept)
    if comb is not None:
        frequency, dwell_s = comb.frequency_hz, radar.pulses / radar.prf_hz
        told = {
            "chopping_log": log10(frequency.at_least(1.0)),
            "chopping_step_mps": frequency * (radar.wavelength_m / 2),
            "chopping_turns": log10((frequency * dwell_s).at_least(LEAST_TURNS)),
            "chopping_orders": width_hz / frequency.at_least(1.0),
        }
        columns |= {name: graph.where(comb.given, value, 0.0) for name, value in told.items()}
        columns |= {"chopping_strength": comb.strength, "chopping_repeats": comb.repeats}
        columns["smearing_index"] = smearing_index(radar, energy, body, comb)
    nothing = relative_power.slice(0, 1) * 0.0
    table = [columns.get(feature.name, 0.0) for feature in FEATURES]
    rows = [column if isinstance(column, Value) else nothing + float(column) for column in table]
    return graph.concat(*rows).at_least(FEATURES.low).at_most(FEATURES.high)
