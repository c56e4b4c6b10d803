"""Cadence: the rates at which the power outside the notches comes and goes within the dwell.

A blade's flash lasts a hundredth of its period. During that time it stands out of the noise a hundred times as far as
the blade's lines do on average, so the power over time shows rotors that the levels of the spectrum do not.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .axis import UNSEEN_DB, expected_peak
from .fast import as_ordered, at_most, means, power_of, to_db
from .notch import Mask, weights
from .schema import CADENCE_BINS
from .spectrum import Spectrum, per_floor
from .window import HANN, Window

#: Range of the shared axis of rates [Hz]: from slow wings to the tenth flash of the fastest propeller.
CADENCE_RANGE_HZ = (1.5, 6000.0)

#: The window is undone where it is at least this share of its largest value: elsewhere, rounding would be blown up.
LEAST_TAPER = 0.03

#: The power over time is clipped at this multiple of its mean: a spoilt pulse is one sample, a flash is many.
CLIP = 16.0

#: The mean power counts as at least this share of the noise floor: less is what rounding leaves of a lone line.
LEAST_MEAN = 0.1


@dataclass(frozen=True)
class CadencePlan:
    """What the cadence of one radar's dwell needs besides the samples.

    Parameters
    ----------
    span : slice
        Samples used: those at which the window is large enough to be undone.
    per_taper : ndarray of float32, shape (samples,)
        One over the square of the window at these samples.
    hann : ndarray of float32, shape (samples,)
        Taper of the power over time, of unit noise gain.
    spans : tuple of ndarray of int, shape (seen,) each
        First line of each bin of the axis, and how many it holds, at least 1: where the axis is finer than the lines
        the nearest one is repeated.
    seen : slice
        Bins of the axis from the first line to half the PRF.
    bins : int
        Length of the axis.
    """

    span: slice
    per_taper: NDArray[np.float32]
    hann: NDArray[np.float32]
    spans: tuple[NDArray[np.intp], NDArray[np.intp]]
    seen: slice
    bins: int

    @cached_property
    def expected_peak(self) -> NDArray[np.float32]:
        """Expected peak of unit-power noise in each seen bin of the axis."""
        return expected_peak(self.spans[1], HANN.noise_bandwidth_bins)


def cadence_edges_hz() -> NDArray[np.float64]:
    """Edges of the shared axis of rates [Hz], rising by equal ratios, shape (CADENCE_BINS + 1,)."""
    return np.geomspace(*CADENCE_RANGE_HZ, CADENCE_BINS + 1)


@lru_cache(maxsize=64)
def cadence_plan(pulses: int, prf_hz: float, window: Window) -> CadencePlan:
    """Plan for a dwell.

    Parameters
    ----------
    pulses : int
        Pulses of the dwell, at least 8.
    prf_hz : float
        Pulse repetition frequency [Hz].
    window : Window
        Of the spectrum.

    Returns
    -------
    CadencePlan
    """
    taper = window.taper(pulses)
    inside = np.flatnonzero(taper >= LEAST_TAPER * taper.max())
    count = fft.prev_fast_len(len(inside), real=True)
    first = int(inside[0]) + (len(inside) - count) // 2
    span = slice(first, first + count)

    line_hz, last = prf_hz / count, count // 2
    edges = cadence_edges_hz() / line_hz  # in lines
    middle = np.sqrt(edges[:-1] * edges[1:])
    within = np.flatnonzero((middle >= 1) & (middle <= last))
    seen = slice(int(within[0]), int(within[-1]) + 1) if len(within) else slice(0, 0)
    low, high = (np.ceil(part).astype(np.intp) for part in (edges[:-1][seen], edges[1:][seen]))
    nearest = np.rint(middle[seen]).astype(np.intp)
    starts = np.minimum(np.where(high > low, low, nearest), last)
    counts = np.maximum(np.minimum(high, last + 1) - starts, 1) if len(starts) else starts
    per_taper, spans = (1 / taper[span] ** 2).astype(np.float32), (starts, counts)
    return CadencePlan(span, per_taper, HANN.taper(count).astype(np.float32), spans, seen, CADENCE_BINS)


def power_over_time(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Power outside the notches over time, relative to its mean, without the ends of the dwell, which the window dims.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool or float32, shape (..., bins)
        From `notch_mask`, or its `weights`: without notches, body and background would hide all else.

    Returns
    -------
    ndarray of float32, shape (..., samples)
        Mean 1, or less where the notches leave hardly anything. Noise gives the exponential law.
    """
    plan = cadence_plan(spectrum.pulses, spectrum.prf_hz, spectrum.window)
    # a centred spectrum gives samples of alternating sign: their power is the same
    samples = fft.ifft(spectrum.transform * weights(mask), overwrite_x=True)[..., plan.span]
    power = power_of(samples)
    power *= plan.per_taper
    mean = means(power)
    power *= per_floor(np.maximum(mean, spectrum.transform_floor * np.float32(LEAST_MEAN)))[..., None]
    return power


def cadence_db(spectrum: Spectrum, mask: Mask) -> NDArray[np.float32]:
    """Spectrum of the power over time on a shared axis of rates: steady noise gives 0 dB at every rate.

    Parameters
    ----------
    spectrum : Spectrum
        Spectra, shape (..., bins).
    mask : ndarray of bool or float32, shape (..., bins)
        From `notch_mask`, or its `weights`.

    Returns
    -------
    ndarray of float32, shape (..., 2, CADENCE_BINS)
        Mean level of the lines in each bin of the axis, and the largest level over that expected of noise in as many
        lines [dB]; `UNSEEN_DB` at rates for which the dwell is too short or the PRF too low.
    """
    plan = cadence_plan(spectrum.pulses, spectrum.prf_hz, spectrum.window)
    power = power_over_time(spectrum, mask)
    at_most(power, CLIP, out=power)
    power -= means(power)[..., None]
    power *= plan.hann
    lines = power_of(fft.rfft(power, overwrite_x=True))
    out = np.full((*lines.shape[:-1], 2, plan.bins), UNSEEN_DB, np.float32)
    starts, counts = plan.spans
    if len(starts):
        reach = lines[..., : starts[-1] + counts[-1]]
        mean, peak = out[..., 0, plan.seen], out[..., 1, plan.seen]
        np.add.reduceat(reach, starts, axis=-1, out=mean)
        mean /= counts.astype(np.float32)
        np.maximum.reduceat(as_ordered(reach), starts, axis=-1, out=as_ordered(peak))
        peak /= plan.expected_peak
        out[..., plan.seen] = to_db(out[..., plan.seen])
    return out
