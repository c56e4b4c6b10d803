"""The paper's claim, measured again: one FFT against the short-time Fourier transform."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
import scipy.fft
from bladewing.features.fast import windows
from numpy.typing import NDArray
from scipy.optimize import nnls

from ..timing import Work, quote, ratio, time_in_turns

# The paper's claim: how many times faster one FFT is than the STFT, by number of samples.
PAPER_RATIOS = {2000: (19.0, 46.0), 10_000: (22.0, 77.0)}
# The paper's STFT windows [samples] and overlaps. It does not state the number of frequencies; 512 suits all windows.
STFT_WINDOWS = (20, 80, 200)
STFT_OVERLAPS = (0.5, 0.9)
STFT_BINS = 512
# FFT lengths [samples] over which the law of computing time is fitted.
LAW_LENGTHS = (256, 512, 1024, 2000, 4096, 8192, 10_000, 16_384)


def stft(iq: NDArray[np.complex64], *, window: int, overlap: float) -> NDArray[np.complex64]:
    """Compute the short-time Fourier transform of one record with a Hann window, zero-padded to 512 frequencies.

    Parameters
    ----------
    iq : (pulses,) complex64
    window : int
        Window length [samples].
    overlap : float
        Share of a window that the next one covers, 0 <= overlap < 1.

    Returns
    -------
    (frames, 512) complex64
        FFT order along the frequencies.
    """
    return transformed(frames(iq, window=window, overlap=overlap))


def frames(iq: NDArray[np.complex64], *, window: int, overlap: float) -> NDArray[np.complex64]:
    """Give the overlapping frames of a record as a view, shape (frames, window)."""
    hop = max(1, round(window * (1.0 - overlap)))
    return windows(iq, ((len(iq) - window) // hop + 1, window), (hop, 1))


@lru_cache(maxsize=8)
def _taper(window: int) -> NDArray[np.float32]:
    """Give the Hann window, cached: making it is no part of a transform's cost."""
    return np.hanning(window).astype(np.float32)


def transformed(some: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Compute the spectra of frames (frames, window), shape (frames, 512)."""
    return scipy.fft.fft(some * _taper(some.shape[-1]), n=STFT_BINS, axis=-1)


def time_fft_against_stft(
    *, seed: int, seconds: float, least_rounds: int, on_share: Callable[[float], None]
) -> list[dict[str, Any]]:
    """Time one FFT against the paper's STFTs at its two record lengths.

    Parameters
    ----------
    seed : int
        Seed of the noise that is transformed.
    seconds : float
        Time to spend on each length [s].
    least_rounds : int
        Fewest rounds, however long they take.
    on_share : callable
        Called with the share done, 0 to 1.

    Returns
    -------
    list of dict
        One a record length: ``pulses``, ``paper_ratio`` [low, high], ``fft`` (as made by `timing.quote`) and ``stft``:
        a list of ``{"window", "overlap", "frames", "bins", ..., "ratio_to_fft"}``.
    """
    rng = np.random.default_rng(seed)
    results = []
    for place, (pulses, claim) in enumerate(PAPER_RATIOS.items()):
        iq = rng.standard_normal(2 * pulses, dtype=np.float32).view(np.complex64)
        grid = [(window, overlap) for window in STFT_WINDOWS for overlap in STFT_OVERLAPS]
        works: dict[str, Work] = {"fft": partial(scipy.fft.fft, iq)}
        for window, overlap in grid:
            works[f"{window} {overlap}"] = partial(stft, iq, window=window, overlap=overlap)

        def share(done: float, place: int = place) -> None:
            on_share((place + done) / len(PAPER_RATIOS))

        taken = time_in_turns(works, seconds=seconds, least_rounds=least_rounds, most_rounds=1000, on_share=share)
        bare = quote(taken["fft"])
        rows = []
        for window, overlap in grid:
            laps = taken[f"{window} {overlap}"]
            made = len(frames(iq, window=window, overlap=overlap))
            about = {"window": window, "overlap": overlap, "frames": made, "bins": STFT_BINS}
            rows.append({**about, **quote(laps), **ratio(laps, taken["fft"])})
        results.append({"pulses": pulses, "paper_ratio": list(claim), "fft": bare, "stft": rows})
    return results


def time_law(
    stfts: Sequence[Mapping[str, Any]],
    *,
    seed: int,
    seconds: float,
    least_rounds: int,
    on_share: Callable[[float], None],
) -> dict[str, Any]:
    """Fit the time of transforms to their number of operations, 5 N log2 N for one of length N.

    Parameters
    ----------
    stfts : sequence of dict
        As made by `time_fft_against_stft`; each counts as 5 N log2 N operations per frame, N = 512.
    seed, seconds, least_rounds, on_share
        As in `time_fft_against_stft`.

    Returns
    -------
    dict
        ``fft`` and ``stft``, each with ``points`` (``{"pulses", "window", "overlap", "operations", "time_us"}``) and
        the fit of time = ``call_us`` + ``ns_each`` * operations over them, with ``worst_factor``: the largest ratio
        between a point's time and its fit, the larger over the smaller.
    """
    rng = np.random.default_rng(seed)
    works: dict[int, Work] = {}
    for length in LAW_LENGTHS:
        iq = rng.standard_normal(2 * length, dtype=np.float32).view(np.complex64)
        works[length] = partial(scipy.fft.fft, iq)
    taken = time_in_turns(works, seconds=seconds, least_rounds=least_rounds, most_rounds=1000, on_share=on_share)
    single = [
        {
            "pulses": length,
            "window": None,
            "overlap": None,
            "operations": _operations(length),
            "time_us": quote(laps)["median_us"],
        }
        for length, laps in taken.items()
    ]
    several = [
        {
            "pulses": part["pulses"],
            "window": row["window"],
            "overlap": row["overlap"],
            "operations": row["frames"] * _operations(row["bins"]),
            "time_us": row["median_us"],
        }
        for part in stfts
        for row in part["stft"]
    ]
    return {"fft": _fitted(single), "stft": _fitted(several)}


def _operations(length: int) -> float:
    return float(5 * length * np.log2(length))


def _fitted(points: list[dict[str, Any]]) -> dict[str, Any]:
    """Fit by least squares of the relative errors; neither coefficient may be negative."""
    operations = np.array([point["operations"] for point in points])
    times_us = np.array([point["time_us"] for point in points])
    terms = np.stack([np.ones(len(points)), operations], axis=1) / times_us[:, None]
    # Columns are normalised first: one is a million times the other.
    sizes = np.linalg.norm(terms, axis=0)
    (call_us, each_us), _ = nnls(terms / sizes, np.ones(len(points)))
    call_us, each_us = float(call_us / sizes[0]), float(each_us / sizes[1])
    worst = float(np.exp(np.abs(np.log((call_us + each_us * operations) / times_us)).max()))
    return {"points": points, "call_us": call_us, "ns_each": 1e3 * each_us, "worst_factor": worst}
