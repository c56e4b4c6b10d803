"""Insects in the range cell: a few weak bodies on the wind, each with an echo that swells at its wingbeat."""

import numpy as np

from .laws import Draws, Law
from .motion import TWO_PI, range_phasor, straight_path
from .radar import Radar
from .target import Target

#: What insects are drawn from; they are part of scenes, not of the training records.
INSECT_LAWS: dict[str, Law] = {
    "insect_count": Law("uniform", 1.0, 12.0, "1", "in one range cell, from single ones to a swarm's edge"),
    "insect_velocity_mps": Law("uniform", -8.0, 8.0, "m/s", "they drift with the wind"),
    "insect_spread_mps": Law("log", 0.2, 3.0, "m/s", "rms of their own flight; airspeeds of 1-6 m/s"),
    "insect_wingbeat_hz": Law("log", 20.0, 250.0, "Hz", "locusts at 20 Hz to bees and flies at 200 Hz and more"),
    "insect_depth": Law("uniform", 0.05, 0.5, "1", "swing of the amplitude: wings are small beside the body"),
}

_MOST = 20


def draw_insects(draws: Draws, radar: Radar) -> Target:
    """Draw and render insects.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers; it must know `INSECT_LAWS`.
    radar : Radar
        The radar that looks.

    Returns
    -------
    Target
        `micro` is the sum of all insects.
    """
    t = radar.times_s
    count = np.clip(np.rint(draws.value("insect_count")), 1, _MOST)
    mean, spread = draws.value("insect_velocity_mps"), draws.value("insect_spread_mps")
    wingbeat, depth = draws.value("insect_wingbeat_hz"), draws.value("insect_depth")
    micro = np.zeros((len(draws), radar.pulses), np.complex64)
    for number in range(_MOST):
        velocity = mean + spread * draws.normal()
        rate = wingbeat * (0.9 + 0.2 * draws.uniform())
        phase = draws.value("phase_rad")
        level = np.where(count > number, np.exp(0.5 * draws.normal()), 0.0) * np.exp(1j * draws.value("phase_rad"))
        swell = 1 + depth[:, None] * np.cos(TWO_PI * rate[:, None] * t + phase[:, None])
        echo = swell.astype(np.float32) * range_phasor(straight_path(t, velocity), radar.wavelength_m)
        micro += level.astype(np.complex64)[:, None] * echo
    truth = {"members": count, "velocity_mps": mean, "width_mps": spread, "wingbeat_hz": wingbeat}
    return Target(micro, truth=truth)
