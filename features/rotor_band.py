"""Where the line family of a rotor ends: the edge fitted to all lines, instead of a threshold and a count."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: Phase deviation of the blade the roll-off is tabulated from [rad]; in its own unit it is the same for all.
_GAMMA = 400

#: Range of the table, in units of the roll-off's width.
_REACH = 6.0


#: What strong lines leak past the edge, and blades unlike the uniform one put there, as a share of their power.
LEAK_SHARE = 0.001


#: What the fit is off by where noise is no limit, in spacings: a real blade's roll-off is not the uniform one's.
MODEL_ERROR_SPACINGS = 0.1


@lru_cache(maxsize=1)
def roll_off() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Line power of a uniform blade about the tip's Doppler, 1 well inside.

    A line of rotation order n has the amplitude (1 / Gamma) x integral of J_n from 0 to Gamma, Gamma the phase
    deviation at the tip (the paper's eq. 16). Near n = Gamma that depends on (n - Gamma) / Gamma^(1/3) alone.

    Returns
    -------
    place, power : ndarray
        Place (n - Gamma) / Gamma^(1/3), rising from -`_REACH`, and power there.
    """
    angle = 2 * np.pi * np.arange(8192) / 8192
    x = _GAMMA * np.cos(angle) / 2
    lines = np.fft.fft(np.exp(1j * x) * np.sinc(x / np.pi)) / len(angle)
    order = np.arange(int(_GAMMA - 6 * _GAMMA ** (1 / 3)), _GAMMA + 200)
    return (order - _GAMMA) / _GAMMA ** (1 / 3), np.abs(lines[order] * _GAMMA) ** 2


def expected_power(away: NDArray[np.float64], edge: NDArray[np.float64], rotation: float) -> NDArray[np.float64]:
    """Line power at distances from the body, 1 well inside the edge; shapes of `away` and `edge` broadcast."""
    place, power = roll_off()
    width = rotation * np.maximum(edge / rotation, 1.0) ** (1 / 3)
    return np.interp((away - edge) / width, place, power, left=1.0, right=0.0)


def _log_likelihood(
    away: NDArray[np.float64],
    power: NDArray[np.float64],
    bins: NDArray[np.float64],
    rotation: float,
    edges: NDArray[np.float64],
    levels: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Log likelihood of each edge, over the levels; line and noise are complex Gaussian."""
    mean = 1 + levels[:, None, None] * expected_power(away, edges[:, None], rotation)
    return np.logaddexp.reduce(-(bins * (np.log(mean) + power / mean)).sum(axis=-1), axis=0)


def fit_edge(
    away: NDArray[np.float64], power: NDArray[np.float64], bins: NDArray[np.float64], rotation: float
) -> tuple[float, float]:
    """Fit the edge of a line family.

    Parameters
    ----------
    away : ndarray, shape (lines,)
        Distance of the lines from the body, > 0 [any frequency unit].
    power : ndarray, shape (lines,)
        Mean power over noise about each line; noise alone has mean 1.
    bins : ndarray, shape (lines,)
        Independent bins in each mean.
    rotation : float
        Rotation rate, same unit as `away`; it sets how sharp the edge is.

    Returns
    -------
    edge, edge_std : float
        The tip's Doppler frequency and its standard deviation, in the unit of `away`.
    """
    spacing = float(np.min(away))
    power = power / (1 + LEAK_SHARE * float(np.quantile(power, 0.9)))
    levels = np.geomspace(0.3, max(10.0, 2 * float(power.max())), 8)
    coarse = np.arange(1.5 * spacing, away.max() + spacing, spacing)
    best = coarse[_log_likelihood(away, power, bins, rotation, coarse, levels).argmax()]
    fine = best + spacing * np.arange(-3, 3.01, 1 / 16)
    fine = fine[fine > spacing]
    likelihood = _log_likelihood(away, power, bins, rotation, fine, levels)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    edge = float((weight * fine).sum())
    spread = float(np.sqrt((weight * (fine - edge) ** 2).sum()))
    return edge, float(np.hypot(spread, MODEL_ERROR_SPACINGS * spacing))
