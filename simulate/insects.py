"""Insects in the range cell: a few weak bodies on the wind, each with an echo that swells at its wingbeat."""

import numpy as np

from .laws import Draws
from .motion import TWO_PI, range_phasor, reduce_phase, straight_path
from .radar import Radar
from .target import Target

#: Most insects in the cell.
MAX_INSECTS = 20


def draw_insects(draws: Draws, radar: Radar) -> Target:
    """Draw and render insects.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    radar : Radar
        The radar that looks.

    Returns
    -------
    Target
        `micro` is the sum of all insects.
    """
    t = radar.times_s
    count = np.clip(np.rint(draws.value("insect_count")), 1, MAX_INSECTS)
    mean, spread = draws.value("insect_velocity_mps"), draws.value("insect_spread_mps")
    wingbeat, depth = draws.value("insect_wingbeat_hz"), draws.value("insect_depth")
    micro = np.zeros((len(draws), radar.pulses), np.complex64)
    for number in range(MAX_INSECTS):
        velocity = mean + spread * draws.normal()
        rate = wingbeat * (0.9 + 0.2 * draws.uniform())
        phase = draws.value("phase_rad")
        level = (np.exp(0.5 * draws.normal()) * np.exp(1j * draws.value("phase_rad"))).astype(np.complex64)
        there = np.flatnonzero(count > number)
        swell = reduce_phase(TWO_PI * rate[there, None] * t + phase[there, None])
        swell = 1 + depth[there, None].astype(np.float32) * np.cos(swell)
        echo = swell * range_phasor(straight_path(t, velocity[there]), radar.wavelength_m)
        micro[there] += level[there, None] * echo
    truth = {"members": count, "velocity_mps": mean, "width_mps": spread, "wingbeat_hz": wingbeat}
    return Target(micro, snr_law="clutter_snr_db", truth=truth)
