"""What speaks for a line in each bin of a periodogram."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .fast import at_most

#: Line powers over noise that a comb may have, and the share of its lines that may be missing.
LINE_SNRS = (1.2, 6.0, 40.0)
MISSING_SHARE = 0.15

#: No single line speaks for more than this [nats]: a lone line is no comb.
LINE_CAP = 5.0

#: A line weaker than its neighbourhood by this factor in power is a leak or an imbalance, not a line of the comb.
NEIGHBOUR_SHARE = 0.03


#: Line SNRs that are looked up side by side, at most: they are taken from the table as one complex number.
MOST_SNRS = 4


@dataclass(frozen=True)
class Evidence:
    """What speaks for a line in every bin.

    Parameters
    ----------
    rows : ndarray of float32, shape (line SNRs, bins)
        Log likelihood ratio of a line against noise, FFT order; 0 where a line cannot be seen [nats].
    """

    rows: NDArray[np.float32]

    @cached_property
    def table(self) -> NDArray[np.complex128]:
        """All line SNRs of a bin as one number of `MOST_SNRS` float32, 0 where there is no such SNR, shape (bins,)."""
        table = np.zeros((self.rows.shape[1], MOST_SNRS), np.float32)
        table[:, : len(self.rows)] = self.rows.T
        return table.view(np.complex128)[:, 0]


def line_evidence(power: NDArray[np.floating], block: int) -> NDArray[np.float32]:
    """Log likelihood ratio of a line against noise in every bin [nats], shape (len(LINE_SNRS), bins).

    Line and noise are complex Gaussian of the variances 1 + snr and 1, or the line is missing. Lines far below the
    strongest of their neighbourhood are leaks or an imbalance of the blades and count less.

    Parameters
    ----------
    power : ndarray, shape (bins,)
        Power over noise, FFT order.
    block : int
        Bins of a neighbourhood.
    """
    from scipy.ndimage import maximum_filter1d  # here, because predicting needs no such import

    power = power.astype(np.float32)
    strongest = maximum_filter1d(power, block, mode="wrap")
    held = power / (1 + np.float32(NEIGHBOUR_SHARE) * np.maximum(strongest - 10, 0))
    held = at_most(held, 60)
    return np.asarray(line_log_ratio(held, np.array(LINE_SNRS, np.float32)[:, None]), np.float32)


def line_log_ratio(power: NDArray[np.floating], snr: float | NDArray[np.floating]) -> NDArray[np.floating]:
    """Log likelihood ratio of a line of an SNR, which may be missing, against noise, at most `LINE_CAP` [nats].

    Parameters
    ----------
    power : ndarray
        Power over noise, of a size whose exponential its type holds.
    snr : float or ndarray
        SNR of the line in a bin, broadcast against `power`.
    """
    out = power * (snr / (1 + snr))
    np.exp(out, out=out)
    out *= (1 - MISSING_SHARE) / (1 + snr)
    out += out.dtype.type(MISSING_SHARE)
    np.log(out, out=out)
    return at_most(out, LINE_CAP, out=out)
