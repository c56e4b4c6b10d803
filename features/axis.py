"""The velocity axis that all radars share: fine where birds and bodies are, coarse where blade tips are."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from .spectrum import LOWEST_DB, NOISE_BANDWIDTH_BINS, SPEED_OF_LIGHT_MPS, to_db

#: Velocity below which bins are of about equal width [m/s]; above it their width grows with the velocity.
KNEE_MPS = 4.0

#: Outer edge of the axis [m/s], beyond the fastest tips (below Mach 0.6).
LIMIT_MPS = 200.0

#: Spectra of up to so many bins to one of the axis are averaged by matrices; longer sums are faster one by one.
COARSE = 4

#: Most axis bins and spectrum bins of a matrix. Larger products are cut into parts by how many spectra there are, and a
#: record would then be summed in another order among others than alone.
_RUN, _LONGEST_SUM = 16, 256

#: Level of a bin outside the radar's unambiguous span [dB]: lower than any noise, so "not seen" differs from "empty".
UNSEEN_DB = LOWEST_DB / 2

# The spectrum bins that it takes, the seen axis bins that it gives, and the shares of the former in the latter.
_Copy = tuple[NDArray[np.intp], slice]
_Matrix = tuple[slice, slice, NDArray[np.float32]]


def axis_edges_mps(bins: int) -> NDArray[np.float64]:
    """Edges of the shared axis [m/s], rising, shape (bins + 1,): equal steps of asinh(v / KNEE_MPS)."""
    limit = np.arcsinh(LIMIT_MPS / KNEE_MPS)
    return KNEE_MPS * np.sinh(np.linspace(-limit, limit, bins + 1))


def axis_velocities_mps(bins: int) -> NDArray[np.float64]:
    """Centres of the shared axis [m/s], rising, shape (bins,)."""
    edges = axis_edges_mps(bins)
    return (edges[1:] + edges[:-1]) / 2


def expected_peak(counts: NDArray[np.intp], bandwidth: float) -> NDArray[np.float32]:
    """Mean of the largest of so many bins of noise of unit power, of which `bandwidth` neighbours are alike."""
    independent = np.maximum(counts / bandwidth, 1)
    return np.maximum(np.log(independent) + np.euler_gamma, 1).astype(np.float32)


@dataclass(frozen=True)
class Pooling:
    """How one radar's bins fall onto the shared axis: on both sides alike, so a mirrored spectrum is mirrored there.

    Parameters
    ----------
    starts : ndarray of int, shape (seen / 2,)
        First spectrum bin of each axis bin of a side, from frequency 0 outwards; both sides hold frequency 0. The bin
        at half the PRF, which has no mirror, is on neither.
    counts : ndarray of int, shape (seen / 2,)
        Spectrum bins in each, at least 1: where the axis is finer than the spectrum the nearest bin is repeated.
    spectrum_bins : int
        Length of the spectrum.
    seen : slice
        The axis bins (rising velocity) within the unambiguous span.
    bins : int
        Length of the axis.
    """

    starts: NDArray[np.intp]
    counts: NDArray[np.intp]
    spectrum_bins: int
    seen: slice
    bins: int

    def mean_db(
        self, power: NDArray[np.float32], per_unit: NDArray[np.float32] | None = None, *, from_floor: bool = False
    ) -> NDArray[np.float32]:
        """Mean level of each axis bin.

        Parameters
        ----------
        power : ndarray of float32, shape (..., spectrum bins)
            Power spectra.
        per_unit : ndarray of float32, shape (..., 1), optional
            What brings them into units of the noise floor, if they are not.
        from_floor : bool
            Count nothing below the floor: 0 dB there, and where nothing is seen.

        Returns
        -------
        ndarray of float32, shape (..., bins)
            [dB]
        """
        flat = power.reshape(-1, power.shape[-1])
        rows, seen = self._blank((len(flat),))
        self._mean(flat, seen)
        out = rows.reshape(*power.shape[:-1], self.bins)
        if per_unit is not None:
            out *= per_unit
        return self._levels(out, 0.0 if from_floor else LOWEST_DB)

    def mean_and_peak_db(self, relative_power: NDArray[np.float32]) -> NDArray[np.float32]:
        """Mean level of each axis bin, and its largest over that of noise in as many [dB], shape (..., 2, bins)."""
        flat = relative_power.reshape(-1, relative_power.shape[-1])
        rows, seen = self._blank((len(flat), 2))
        self._mean(flat, seen[:, 0])
        peak = seen[:, 1]
        self._pooled(np.maximum, flat, peak)
        peak *= self._per_expected_peak
        return self._levels(rows, LOWEST_DB).reshape(*relative_power.shape[:-1], 2, self.bins)

    def _blank(self, shape: tuple[int, ...]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Room for the axis with 0 where nothing is seen, and the part of it that is to be filled."""
        out = np.zeros((*shape, self.bins), np.float32)
        return out, out[..., self.seen]

    def _mean(self, power: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write the mean power of each seen axis bin, in rising velocity; a row a spectrum."""
        if self.spectrum_bins > COARSE * self.bins:
            self._pooled(np.add, power, out)
            out *= self._shares
        elif len(power) == 1:
            # a product of a single row would be summed in another order than the row is among others
            twice = np.empty((2, out.shape[1]), np.float32)
            self._mean(np.repeat(power, 2, axis=0), twice)
            out[:] = twice[:1]
        else:
            # all spectra under one another: one product of matrices instead of one for each record
            copies, matrices = self._products
            for bins, axis_bins in copies:
                out[:, axis_bins] = power.take(bins, axis=1)
            for span, axis_bins, shares in matrices:
                np.matmul(power[:, span], shares, out=out[:, axis_bins])

    def _levels(self, out: NDArray[np.float32], lowest_db: float) -> NDArray[np.float32]:
        """Power to level in place: of the whole axis, which lies in one piece and so takes half the time."""
        to_db(out, lowest_db, out=out)
        if self.seen.start and lowest_db < UNSEEN_DB:
            out[..., : self.seen.start] = out[..., self.seen.stop :] = UNSEEN_DB
        return out

    @cached_property
    def spans(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """First spectrum bin of each seen axis bin, in rising velocity, and how many it holds, shape (seen,) each."""
        middle = self.spectrum_bins // 2
        receding, approaching = middle + 1 - self.starts - self.counts, middle + self.starts  # Doppler falls, and rises
        return np.concatenate([approaching[::-1], receding]), np.concatenate([self.counts[::-1], self.counts])

    @cached_property
    def _shares(self) -> NDArray[np.float32]:
        """One over the number of spectrum bins in each."""
        return (1 / self.spans[1]).astype(np.float32)

    @cached_property
    def _products(self) -> tuple[list[_Copy], list[_Matrix]]:
        """The pooling as copies, where the axis is so fine that there is nothing to add up, and as matrices.

        A run of axis bins needs few spectrum bins, so the zeros that are multiplied too do not matter.
        """
        starts, counts = self.spans
        stops = starts + counts
        copies: list[_Copy] = []
        matrices: list[_Matrix] = []
        stop = 0
        while stop < len(starts):
            first, stop = stop, min(stop + _RUN, len(starts))
            while stop > first + 2 and stops[first:stop].max() - starts[first:stop].min() > _LONGEST_SUM:
                stop -= 1
            if len(starts) - stop == 1:  # a single column would be summed in another order
                stop -= 1
            axis_bins = slice(first, stop)
            if (counts[axis_bins] == 1).all():
                if copies and copies[-1][1].stop == first:
                    axis_bins = slice(copies.pop()[1].start, stop)
                copies.append((starts[axis_bins], axis_bins))
                continue
            low, high = int(starts[axis_bins].min()), int(stops[axis_bins].max())
            position = np.arange(low, high)[:, None]
            inside = (position >= starts[axis_bins]) & (position < stops[axis_bins])
            shares = np.ascontiguousarray(inside * self._shares[axis_bins], np.float32)
            matrices.append((slice(low, high), axis_bins, shares))
        return copies, matrices

    @cached_property
    def expected_peak(self) -> NDArray[np.float32]:
        """Mean of the largest of so many exponentials, in rising velocity."""
        return expected_peak(self.spans[1], NOISE_BANDWIDTH_BINS)

    @cached_property
    def _per_expected_peak(self) -> NDArray[np.float32]:
        return np.reciprocal(self.expected_peak)

    def _pooled(self, operation: np.ufunc, relative_power: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write the sum or the largest of the spectrum bins of each seen axis bin, in rising velocity."""
        side, middle, reach = len(self.starts), self.spectrum_bins // 2, int(self.starts[-1] + self.counts[-1])
        rising = relative_power[..., middle : middle + reach]
        falling = relative_power[..., middle + 1 - reach : middle + 1][..., ::-1]
        operation.reduceat(rising, self.starts, axis=-1, out=out[..., :side][..., ::-1])
        operation.reduceat(falling, self.starts, axis=-1, out=out[..., side:])


@lru_cache(maxsize=64)
def pooling(spectrum_bins: int, carrier_hz: float, prf_hz: float, bins: int) -> Pooling:
    """Pooling of a centred spectrum onto the shared axis.

    Parameters
    ----------
    spectrum_bins : int
        Length of the spectrum.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz].
    bins : int
        Length of the shared axis, even.

    Returns
    -------
    Pooling
    """
    step_mps = prf_hz / spectrum_bins * SPEED_OF_LIGHT_MPS / carrier_hz / 2
    edges = axis_edges_mps(bins)[bins // 2 :] / step_mps  # of one side, in bins of the spectrum
    centre = (edges[:-1] + edges[1:]) / 2
    within = centre <= spectrum_bins / 2
    within[0] = True  # the innermost bins hold frequency 0, however slow the radar
    side, reach = np.count_nonzero(within), (spectrum_bins + 1) // 2
    first = np.minimum(np.ceil(edges[: side + 1]).astype(np.intp), reach)
    nearest = np.rint(centre[:side]).astype(np.intp)
    starts = np.minimum(np.where(first[1:] > first[:-1], first[:-1], nearest), reach - 1)
    starts = np.maximum.accumulate(starts)
    end = max(int(first[-1]), int(starts[-1]) + 1)
    counts = np.maximum(np.diff(starts, append=end), 1)
    return Pooling(starts, counts, spectrum_bins, slice(bins // 2 - side, bins // 2 + side), bins)
