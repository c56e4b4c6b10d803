"""The power over time and its spectrum in graph operators (definitions: `cadence`)."""

import numpy as np

from .. import cadence as definition
from ..axis import UNSEEN_DB
from ..spectrum import Spectrum
from .operators import Value
from .spectrum import dft, pooled, power_of


def cadence_db(radar: Spectrum, transform: tuple[Value, Value], floor: Value, kept: Value) -> Value:
    """As `cadence.cadence_db`: from the transform's parts, its floor (above 0) and the notches' weights."""
    graph, plan = kept.graph, definition.cadence_plan(radar.pulses, radar.prf_hz)
    re, im = (part * kept for part in transform)
    # back in time by the conjugate: the power is the same
    packed = graph.concat(re.reshape(-1, 1, radar.bins), -im.reshape(-1, 1, radar.bins), axis=1)
    samples = power_of(dft(packed, radar.bins, plan.span.stop))
    power = samples.slice(plan.span.start, plan.span.stop) * (plan.per_taper / np.float32(radar.bins**2))
    mean = power.mean().at_least(floor * definition.LEAST_MEAN)
    power = (power / mean).at_most(definition.CLIP)
    count = plan.span.stop - plan.span.start
    lines = power_of(dft((power - power.mean()) * plan.hann, count, count // 2 + 1, real=True))
    if not len(plan.spans[0]):  # the dwell tells no rate of the axis
        nothing = np.full((1, 2, plan.bins), UNSEEN_DB, np.float32)
        return lines.slice(0, 1).reshape(-1, 1, 1) * 0.0 + nothing
    mean_db, peak_db = (row.reshape(-1, 1, plan.bins) for row in pooled(lines, plan))
    return graph.concat(mean_db, peak_db, axis=1)
