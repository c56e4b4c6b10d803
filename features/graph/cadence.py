"""The power over time and its spectrum in graph operators (definitions: `cadence`)."""

import numpy as np

from .. import cadence as definition
from ..axis import UNSEEN_DB
from ..spectrum import Spectrum
from .operators import Value
from .spectrum import dft_power, pooled


def cadence_db(radar: Spectrum, transform: Value, floor: Value, kept: Value) -> Value:
    """As `cadence.cadence_db`: from the transform's parts, its floor (above 0) and the notches' weights."""
    plan = definition.cadence_plan(radar.pulses, radar.prf_hz, radar.window)
    if not len(plan.spans[0]):  # the dwell resolves no rate of the axis
        nothing = np.full((1, 2, plan.bins), UNSEEN_DB, np.float32)
        return kept.slice(0, 1).reshape(-1, 1, 1) * 0.0 + nothing
    start, stop = plan.span.start, plan.span.stop
    # the way back to time: a forward transform of the conjugate has the same power as an inverse one
    kept_parts = transform * kept.reshape(-1, 1, radar.bins)
    samples = dft_power(kept_parts, radar.bins, stop, parts=2, conjugate=True)
    power = samples.slice(start, stop) * (plan.per_taper / np.float32(radar.bins**2))
    mean = power.mean().at_least(floor * definition.LEAST_MEAN)
    power = (power / mean).at_most(definition.CLIP)
    count = stop - start
    lines = dft_power((power - power.mean()) * plan.hann, count, count // 2 + 1)
    return pooled(lines, count // 2 + 1, plan)
