"""How well any detector could find a rotor in receiver noise: what the measured curves are held against."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .scores import FALSE_ALARM_RATE

#: Lines of the combs whose bound is drawn; 0: the whole echo is known but for its phase.
LINES = (0, 30, 120)
_SNR_DB = np.arange(-35.0, 35.5, 1.0)


def detection_bound(snr_db: ArrayLike, *, pulses: int, lines: int, false_alarm_rate: float) -> NDArray[np.float64]:
    """Largest detection rate of an echo in white noise.

    The energy of so many known lines follows a chi-square law with two degrees of freedom a line, central without the
    echo and with the echo's energy as its non-centrality; an echo known but for its phase is one line.

    Parameters
    ----------
    snr_db : array_like
        Power of the echo over the noise, a sample [dB].
    pulses : int
        Samples.
    lines : int
        Lines the echo's energy is spread over, at places that are known; 0: its whole shape is known.
    false_alarm_rate : float
        0 to 1.

    Returns
    -------
    ndarray of float64
        0 to 1, of the shape of `snr_db`.
    """
    from scipy.stats import chi2, ncx2

    freedom = 2 * max(lines, 1)
    energy = 2.0 * pulses * 10 ** (np.asarray(snr_db, np.float64) / 10)
    bound: NDArray[np.float64] = ncx2.sf(chi2.isf(false_alarm_rate, freedom), freedom, energy)
    return bound


def detection_bounds(pulses: int) -> list[dict[str, Any]]:
    """Curves for the page: ``lines``, ``snr_db`` and ``found``, from SNRs at which nothing is found."""
    curves = []
    for lines in LINES:
        found = detection_bound(_SNR_DB, pulses=pulses, lines=lines, false_alarm_rate=FALSE_ALARM_RATE)
        curves.append({"lines": lines, "snr_db": _SNR_DB.tolist(), "found": np.round(found, 4).tolist()})
    return curves
