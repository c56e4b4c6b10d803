"""Removal of the body line and the static background: a projection that leaves everything else as it was.

A window as low in side lobes as the spectrum's doubles the noise bandwidth. To measure lines at the bound the samples
must stay unwindowed, so what is strong and slow is taken out of them first, with the Slepian sequences that span all
signals of so narrow a band.
"""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: Sequences beyond the time-bandwidth product: what the band leaks past it falls under -100 dB.
EXTRA_SEQUENCES = 11


@lru_cache(maxsize=32)
def slepian(pulses: int, half_bins: float) -> NDArray[np.float64]:
    """Orthonormal sequences that hold the signals within so many bins of frequency 0, shape (sequences, pulses).

    Parameters
    ----------
    pulses : int
        Pulses of the dwell.
    half_bins : float
        Half width of the band [bins of PRF / pulses], > 0.
    """
    from scipy.linalg import eigh_tridiagonal

    count = min(pulses, int(np.ceil(2 * half_bins)) + EXTRA_SEQUENCES)
    n = np.arange(pulses)
    diagonal = ((pulses - 1 - 2 * n) / 2) ** 2 * np.cos(2 * np.pi * half_bins / pulses)
    off = n[1:] * (pulses - n[1:]) / 2
    _, vectors = eigh_tridiagonal(diagonal, off, select="i", select_range=(pulses - count, pulses - 1))
    out = np.ascontiguousarray(vectors.T)
    out.setflags(write=False)
    return out


def remove_bands(samples: NDArray[np.complex128], bands: Iterable[tuple[float, float]]) -> NDArray[np.complex128]:
    """Take narrow bands out of one record.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        One record.
    bands : iterable of (float, float)
        Centre [cycles a sample] and half width [bins] of each band.

    Returns
    -------
    ndarray of complex128, shape (pulses,)
        What is left; a line more than a few bins off the bands is unchanged.
    """
    pulses = len(samples)
    time = np.arange(pulses)
    blocks = [slepian(pulses, float(half)) * np.exp(2j * np.pi * centre * time) for centre, half in bands]
    if not blocks:
        return samples
    # jointly: taken out one after the other, each band would keep what the first took of the second's strong line
    gram = np.block([[a.conj() @ b.T if a is not b else np.eye(len(a)) for b in blocks] for a in blocks])
    basis = np.concatenate(blocks)
    seen: NDArray[np.complexfloating] = basis.conj() @ samples
    if len(blocks) > 1:
        seen = np.linalg.lstsq(gram, seen, rcond=1e-12)[0]
    return np.asarray(samples - seen @ basis, np.complex128)
