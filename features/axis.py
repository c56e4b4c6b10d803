"""The velocity axis that all radars share: fine where birds and bodies are, coarse where blade tips are."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from .fast import LOWEST_DB, as_ordered, to_db
from .spectrum import SPEED_OF_LIGHT_MPS
from .window import HANN

#: Velocity below which bins are of about equal width [m/s]; above it their width grows with the velocity.
KNEE_MPS = 4.0

#: Outer edge of the axis [m/s], beyond the fastest tips (below Mach 0.6).
LIMIT_MPS = 200.0

#: Level of a bin outside the radar's unambiguous span [dB]: lower than any noise, so "not seen" differs from "empty".
UNSEEN_DB = LOWEST_DB / 2


def axis_edges_mps(bins: int) -> NDArray[np.float64]:
    """Edges of the shared axis [m/s], rising, shape (bins + 1,): equal steps of asinh(v / KNEE_MPS)."""
    limit = np.arcsinh(LIMIT_MPS / KNEE_MPS)
    return KNEE_MPS * np.sinh(np.linspace(-limit, limit, bins + 1))


def axis_velocities_mps(bins: int) -> NDArray[np.float64]:
    """Centres of the shared axis [m/s], rising, shape (bins,)."""
    edges = axis_edges_mps(bins)
    return (edges[1:] + edges[:-1]) / 2


def expected_peak(counts: NDArray[np.intp], bandwidth: float) -> NDArray[np.float32]:
    """Mean of the largest of `counts` bins of unit-power noise, of which one in `bandwidth` is independent."""
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
            Factors that bring them into units of the noise floor, if they are in others.
        from_floor : bool
            Whether levels below the noise floor, and outside the unambiguous span, become 0 dB.

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
        """Mean and peak level of each axis bin [dB], shape (..., 2, bins).

        The peak is relative to the expected peak of noise in as many spectrum bins. For spectra through Hann's window.
        """
        flat = relative_power.reshape(-1, relative_power.shape[-1])
        rows, seen = self._blank((len(flat), 2))
        self._mean(flat, seen[:, 0])
        peak = seen[:, 1]
        self._pooled(np.maximum, as_ordered(flat), as_ordered(peak))
        peak *= self._per_expected_peak
        return self._levels(rows, LOWEST_DB).reshape(*relative_power.shape[:-1], 2, self.bins)

    def _blank(self, shape: tuple[int, ...]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Zeros for the whole axis, and a view of the seen part, which is to be filled."""
        out = np.zeros((*shape, self.bins), np.float32)
        return out, out[..., self.seen]

    def _mean(self, power: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write the mean power of each seen axis bin, in rising velocity; one row per spectrum."""
        # bin by bin: for many spectra matrix products take a third of the time, but their order of summation depends on
        # the number of spectra, so that a record's last digits would differ between alone and within a batch
        self._pooled(np.add, power, out)
        out *= self._shares

    def _levels(self, out: NDArray[np.float32], lowest_db: float) -> NDArray[np.float32]:
        """Convert power to level, in place: on the whole axis, which is contiguous and so takes half the time."""
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
        """One over the number of spectrum bins in each seen axis bin."""
        return (1 / self.spans[1]).astype(np.float32)

    @cached_property
    def expected_peak(self) -> NDArray[np.float32]:
        """Expected peak of unit-power noise in each seen axis bin, in rising velocity."""
        return expected_peak(self.spans[1], HANN.noise_bandwidth_bins)

    @cached_property
    def _per_expected_peak(self) -> NDArray[np.float32]:
        return np.reciprocal(self.expected_peak)

    def _pooled(self, operation: np.ufunc, relative_power: NDArray, out: NDArray) -> None:
        """Write the sum or the largest of the spectrum bins of each seen axis bin, in rising velocity."""
        side, middle, reach = len(self.starts), self.spectrum_bins // 2, int(self.starts[-1] + self.counts[-1])
        alone = self._alone
        if alone:  # copied, which takes a tenth of the time
            out[..., side - alone : side + alone] = relative_power.take(self._copied, axis=-1)
        if alone < side:
            outer = self.starts[alone:]
            rising = relative_power[..., middle : middle + reach]
            falling = relative_power[..., middle + 1 - reach : middle + 1][..., ::-1]
            operation.reduceat(rising, outer, axis=-1, out=out[..., : side - alone][..., ::-1])
            operation.reduceat(falling, outer, axis=-1, out=out[..., side + alone :])

    @cached_property
    def _alone(self) -> int:
        """Number of axis bins of a side, from velocity zero outwards, before the first that holds several."""
        more = np.flatnonzero(self.counts > 1)
        return int(more[0]) if len(more) else len(self.counts)

    @cached_property
    def _copied(self) -> NDArray[np.intp]:
        """The spectrum bin of each of the `_alone` axis bins of both sides, in rising velocity."""
        side = len(self.starts)
        return self.spans[0][side - self._alone : side + self._alone]


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
    within[0] = True  # the innermost bins hold frequency 0, however low the PRF
    side, reach = np.count_nonzero(within), (spectrum_bins + 1) // 2
    first = np.minimum(np.ceil(edges[: side + 1]).astype(np.intp), reach)
    nearest = np.rint(centre[:side]).astype(np.intp)
    starts = np.minimum(np.where(first[1:] > first[:-1], first[:-1], nearest), reach - 1)
    starts = np.maximum.accumulate(starts)
    end = max(int(first[-1]), int(starts[-1]) + 1)
    counts = np.maximum(np.diff(starts, append=end), 1)
    return Pooling(starts, counts, spectrum_bins, slice(bins // 2 - side, bins // 2 + side), bins)
