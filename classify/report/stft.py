"""The paper's claim, measured again: one FFT against the short-time Fourier transform."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from .timing import Work, quote, time_in_turns

# The paper's claim: how many times faster one FFT is than the STFT, by number of samples.
PAPER_RATIOS = {2000: (19.0, 46.0), 10_000: (22.0, 77.0)}
# Its STFT windows [samples] and overlaps; the number of frequencies is not stated there, 512 serves all windows.
STFT_WINDOWS = (20, 80, 200)
STFT_OVERLAPS = (0.5, 0.9)
STFT_BINS = 512


def stft(iq: NDArray[np.complex64], *, window: int, overlap: float) -> NDArray[np.complex64]:
    """Short-time Fourier transform of one record with a Hann window, zero-padded to 512 frequencies.

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
    hop = max(1, round(window * (1.0 - overlap)))
    frames = np.lib.stride_tricks.sliding_window_view(iq, window)[::hop]
    return scipy.fft.fft(frames * np.hanning(window).astype(np.float32), n=STFT_BINS, axis=-1)


def time_fft_against_stft(
    *, seed: int, seconds: float, least_rounds: int, on_share: Callable[[float], None] | None = None
) -> list[dict[str, Any]]:
    """Time one FFT against the paper's STFTs at its two record lengths.

    Parameters
    ----------
    seed : int
        Of the noise they are fed.
    seconds : float
        Time to spend on each length [s].
    least_rounds : int
        Rounds to make however long they take.
    on_share : callable, optional
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
            if on_share is not None:
                on_share((place + done) / len(PAPER_RATIOS))

        taken = time_in_turns(works, seconds=seconds, least_rounds=least_rounds, most_rounds=1000, on_share=share)
        bare = quote(taken["fft"])
        rows = []
        for window, overlap in grid:
            timed = quote(taken[f"{window} {overlap}"])
            frames = stft(iq, window=window, overlap=overlap).shape[0]
            about = {"window": window, "overlap": overlap, "frames": frames, "bins": STFT_BINS}
            rows.append({**about, **timed, "ratio_to_fft": timed["median_us"] / bare["median_us"]})
        results.append({"pulses": pulses, "paper_ratio": list(claim), "fft": bare, "stft": rows})
    return results
