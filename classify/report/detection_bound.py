"""Upper bound on how well any detector finds a rotor in receiver noise; the measured curves are compared with it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .scores import FALSE_ALARM_RATE

#: Numbers of comb lines for which the bound is drawn; 0: the whole echo is known except its phase.
LINES = (0, 30, 120)
_SNR_DB = np.arange(-35.0, 35.5, 1.0)


def detection_bound(snr_db: ArrayLike, *, pulses: int, lines: int, false_alarm_rate: float) -> NDArray[np.float64]:
    """Give the largest detection rate of an echo in white noise.

    The energy in `lines` known lines follows a chi-square law with two degrees of freedom per line. Without the echo
    the law is central; with it the non-centrality is the echo's energy. An echo known except its phase is one line.

    Parameters
    ----------
    snr_db : array_like
        Power of the echo over the noise in one sample [dB].
    pulses : int
        Samples.
    lines : int
        Number of lines, at known frequencies, that the echo's energy is spread over; 0: its whole shape is known.
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
    """Give the page's curves: ``lines``, ``snr_db`` and ``found``, starting at SNRs too low to find anything."""
    curves = []
    for lines in LINES:
        found = detection_bound(_SNR_DB, pulses=pulses, lines=lines, false_alarm_rate=FALSE_ALARM_RATE)
        curves.append({"lines": lines, "snr_db": _SNR_DB.tolist(), "found": np.round(found, 4).tolist()})
    return curves
