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


#: How unlike the powers of a family's lines may be: variances over the mean's square. A uniform blade's inner lines
#: are nearly equal, a real one's fade and scatter; what the lines themselves show decides.
POWER_VARIANCES = (0.02, 0.1, 0.3, 1.0)

#: Step of the edges tried, in spacings.
FINE_STEP = 1 / 12


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
    shape: NDArray[np.float64], power: NDArray[np.float64], bins: NDArray[np.float64], level: float, share: float
) -> NDArray[np.float64]:
    """Log likelihood of expected line powers `level` x `shape` over the noise.

    The mean of lines of the amplitudes' variance `share` x level^2 in noise, as a gamma law of the same mean and
    variance: exact for noise alone and for lines that are complex Gaussian (share 1).
    """
    line = level * shape
    mean = 1 + line
    number = bins * mean**2 / (1 + 2 * line + share * line**2)
    ratio = power / mean
    # Stirling's series for the gamma function
    return np.asarray((0.5 * np.log(number) - 1 / (12 * number) - number * (ratio - 1 - np.log(ratio))).sum(axis=-1))


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
    power = np.maximum(power / (1 + LEAK_SHARE * float(np.quantile(power, 0.9))), 1e-3)
    levels = np.geomspace(0.3, max(10.0, 2 * float(power.max())), 8)
    coarse = np.arange(1.5 * spacing, away.max() + spacing, spacing)
    shape = expected_power(away, coarse[:, None], rotation)
    likelihood = np.logaddexp.reduce([_log_likelihood(shape, power, bins, level, 1.0) for level in levels], axis=0)
    best = coarse[likelihood.argmax()]
    fine = best + spacing * np.arange(-3, 3.01, FINE_STEP)
    fine = fine[fine > spacing]
    shape = expected_power(away, fine[:, None], rotation)
    # the level that fits each edge best, and others as far off as chance allows
    height = np.maximum(((power - 1) * bins * shape).sum(axis=1) / (bins * shape**2).sum(axis=1), 0.1)[:, None]
    total = (bins * shape).sum(axis=1)[:, None]
    tables = []
    for share in POWER_VARIANCES:
        off = np.sqrt((1 + 2 * height + share * height**2) / total)
        for deviations in (-1.5, -0.5, 0.5, 1.5):
            level = np.maximum(height + deviations * off, 0.05)
            tables.append(_log_likelihood(shape, power, bins, level, share))
    likelihood = np.logaddexp.reduce(tables, axis=0)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    edge = float((weight * fine).sum())
    spread = float(np.sqrt((weight * (fine - edge) ** 2).sum()))
    return edge, float(np.hypot(spread, MODEL_ERROR_SPACINGS * spacing))
