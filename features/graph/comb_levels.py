"""The comb levels in graph operators (definitions: `comb_levels`)."""

import numpy as np

from .. import comb_levels as definition
from ..axis import UNSEEN_DB
from ..evidence import LINE_CAP, MISSING_SHARE
from ..schema import COMB_BINS
from ..spectrum import Spectrum
from .operators import Value
from .spectrum import dft, to_db


def line_nats(relative_power: Value) -> Value:
    """As `comb_levels.line_nats`."""
    snr = definition.WEAK_SNR
    lifted = (relative_power.at_most(float(definition.MOST_POWER)) * (snr / (1 + snr))).apply("Exp")
    seen = lifted * ((1 - MISSING_SHARE) / (1 + snr)) + MISSING_SHARE
    return seen.apply("Log").at_most(LINE_CAP)


def comb_levels_db(radar: Spectrum, relative_power: Value, kept: Value) -> Value:
    """As `comb_levels.comb_levels_db`."""
    graph = relative_power.graph
    plan = definition.comb_plan(radar.bins, radar.pulses, radar.carrier_hz, radar.prf_hz)
    if plan is None:
        nothing = np.full((1, 1, COMB_BINS), UNSEEN_DB, np.float32)
        return relative_power.slice(0, 1).reshape(-1, 1, 1) * 0.0 + nothing
    first, stop = plan.band.start, plan.band.stop
    size = (stop - first) // plan.blocks
    counts = kept.slice(first, stop).reshape(-1, plan.blocks, size)
    nats = line_nats(relative_power.slice(first, stop)).reshape(-1, plan.blocks, size)
    mean = (nats * counts).sum() / counts.sum().at_least(1.0)
    line = ((nats - mean) * counts).reshape(-1, stop - first).pad(0, plan.length - (stop - first))
    re, im = dft(line, plan.length, plan.length // 2 + 1, real=True)
    number = kept.slice(first, stop).sum().at_least(1.0)
    heights = ((re * re + im * im) / number).apply("Sqrt") * plan.per_noise - definition.MEAN_HEIGHT
    peaks = heights.pad(0, 1).take(np.minimum(plan.lags, plan.length // 2 + 1))
    up_to = (np.arange(definition.ENDS[-1]) < np.array(definition.ENDS)[:, None]).astype(np.float32)
    levels = (graph.matmul(up_to, peaks) * plan.per_deviation).transpose(0, 2, 1).max(keep=False).at_least(0.0)
    starts, counted = plan.spans
    within = starts[:, None] + np.minimum(np.arange(counted.max()), counted[:, None] - 1)
    seen = to_db(levels.take(within).max(keep=False).at_least(1.0))
    whole = seen.pad(plan.seen.start, COMB_BINS - plan.seen.stop, UNSEEN_DB)
    return whole.take(np.arange(COMB_BINS)[::-1]).reshape(-1, 1, COMB_BINS)
