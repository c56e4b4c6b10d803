"""Evidence of a line in each bin of a periodogram."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .fast import at_most

#: LINE_SNRS: SNRs that a comb's lines may have. MISSING_SHARE: share of its lines that may be missing.
LINE_SNRS = (1.2, 6.0, 40.0)
MISSING_SHARE = 0.15

#: Largest evidence of a single line [nats]: a lone line is no comb.
LINE_CAP = 5.0

#: A line below this share of the strongest power in its neighbourhood is a leak or comes of an imbalance of the blades:
#: it is not a line of the comb.
NEIGHBOUR_SHARE = 0.03


#: Most line SNRs that can be looked up together: they are taken from the table as one complex number.
MOST_SNRS = 4


@dataclass(frozen=True)
class Evidence:
    """Evidence of a line in every bin.

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

    A bin is complex Gaussian, of variance 1 + snr with a line and 1 without; a line may be missing. Lines far below the
    strongest of their neighbourhood are leaks or come of an imbalance of the blades, and count less.

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
    """Log likelihood ratio of a line, which may be missing, against noise alone, at most `LINE_CAP` [nats].

    Parameters
    ----------
    power : ndarray
        Power over noise, small enough that its exponential does not overflow its type.
    snr : float or ndarray
        SNR of the line in a bin, broadcast against `power`.
    """
    out = power * (snr / (1 + snr))
    np.exp(out, out=out)
    out *= (1 - MISSING_SHARE) / (1 + snr)
    out += out.dtype.type(MISSING_SHARE)
    np.log(out, out=out)
    return at_most(out, LINE_CAP, out=out)
