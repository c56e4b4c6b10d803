"""The comb levels in graph operators (definitions: `comb_levels`)."""

import numpy as np

from .. import comb_levels as definition
from ..axis import UNSEEN_DB
from ..evidence import LINE_CAP, MISSING_SHARE
from ..schema import COMB_BINS
from ..spectrum import Spectrum
from ..window import NEIGHBOUR_SHARE
from .operators import Value
from .spectrum import dft_power, power_of, spans_of, to_db


def line_nats(relative_power: Value) -> Value:
    """As `comb_levels.line_nats`."""
    snr = definition.WEAK_SNR
    lifted = (relative_power.at_most(float(definition.MOST_POWER)) * (snr / (1 + snr))).apply("Exp")
    seen = lifted * ((1 - MISSING_SHARE) / (1 + snr)) + MISSING_SHARE
    return seen.apply("Log").at_most(LINE_CAP)


def broad_power(radar: Spectrum, transform: Value, floor: Value, band: slice) -> Value:
    """As `comb_levels.broad_power`: from parts (n, 2, bins) and the floor to power (n, bins of the band)."""
    bins, first, stop = radar.bins, band.start, band.stop
    around = transform
    if not (first and stop < bins):  # bins are on a circle: beyond one end lies the other
        around = transform.graph.concat(transform.slice(bins - 1, bins), transform, transform.slice(0, 1))
        first, stop = first + 1, stop + 1
    beside = around.slice(first - 1, stop - 1) + around.slice(first + 1, stop + 1)
    lines = around.slice(first, stop) + beside * NEIGHBOUR_SHARE
    return power_of(lines, stop - first) / (floor * float(definition.NOISE_GAIN))


def comb_levels_db(radar: Spectrum, transform: Value, floor: Value, kept: Value) -> Value:
    """As `comb_levels.comb_levels_db`: from the transform's parts, its floor (above 0) and the notches' weights."""
    graph = transform.graph
    plan = definition.comb_plan(radar.bins, radar.pulses, radar.carrier_hz, radar.prf_hz)
    if plan is None:
        nothing = np.full((1, 1, COMB_BINS), UNSEEN_DB, np.float32)
        return kept.slice(0, 1).reshape(-1, 1, 1) * 0.0 + nothing
    first, stop = plan.band.start, plan.band.stop
    size = (stop - first) // plan.blocks
    counts = kept.slice(first, stop).reshape(-1, plan.blocks, size)
    nats = line_nats(broad_power(radar, transform, floor, plan.band)).reshape(-1, plan.blocks, size)
    mean = (nats * counts).sum() / counts.sum().at_least(1.0)
    line = ((nats - mean) * counts).reshape(-1, stop - first).pad(0, plan.length - (stop - first))
    # one coefficient more, of height 0: multiples of a period beyond the last one count as noise of mean height
    beyond = plan.length // 2 + 1
    squares = dft_power(line, plan.length, beyond + 1)
    number = kept.slice(first, stop).sum().at_least(1.0)
    per_noise = np.append(plan.per_noise, np.float32(0))
    heights = (squares / number).apply("Sqrt") * per_noise - definition.MEAN_HEIGHT * np.sign(per_noise)
    peaks = heights.take(np.minimum(plan.lags, beyond))
    up_to = (np.arange(definition.ENDS[-1]) < np.array(definition.ENDS)[:, None]).astype(np.float32)
    levels = (graph.matmul(up_to, peaks) * plan.per_deviation).transpose(0, 2, 1).max(keep=False)
    starts, held = (part[::-1] for part in plan.spans)  # rising in rate
    elements, within = spans_of(levels, plan.lags.shape[1], starts, held)
    seen = to_db((elements * within.astype(np.float32)).max(keep=False), 0.0)
    return seen.pad(COMB_BINS - plan.seen.stop, plan.seen.start, UNSEEN_DB).reshape(-1, 1, COMB_BINS)
