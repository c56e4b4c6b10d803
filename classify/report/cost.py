"""What an answer costs: every step from IQ to probabilities, compared with the bare FFT in the same run."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import scipy.fft
from bladewing.features.inputs import model_inputs
from bladewing.models.session import quiet_session
from numpy.typing import NDArray

from ..inference import Classifier
from ..timing import Work, quote, ratio, time_in_turns

BATCHES = (1, 64)

#: Largest number of batches that take turns. Each is then timed a dozen times, so that one disturbance does not count.
_MOST_TURNS = 250


def time_chain(
    models: Mapping[str, bytes],
    classifiers: Mapping[str, Classifier],
    iq: NDArray[np.complex64],
    *,
    carrier_hz: float,
    prf_hz: float,
    seconds: float,
    least_rounds: int,
    on_share: Callable[[float], None] | None = None,
) -> list[dict[str, Any]]:
    """Time the bare FFT, every input, every model and every whole chain, all in turns and on one thread.

    Parameters
    ----------
    models : mapping of str to bytes
        Name to sealed ONNX model, timed on inputs that are ready.
    classifiers : mapping of str to Classifier
        What answers: the models themselves, and cascades made of several of them.
    iq : (64 or more, pulses) complex64
        Records; they are split into batches that are used in turn.
    carrier_hz, prf_hz : float
        Of the records [Hz].
    seconds : float
        Time to spend on each batch size [s].
    least_rounds : int
        Fewest rounds, however long they take.
    on_share : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    list of dict
        One a batch size: ``batch`` and ``stages``, a list of ``{"stage", "name", "median_us", "p99_us", "passed_us",
        "rounds", "ratio_to_fft", "ratio_low", "ratio_high"}`` (see `timing.quote` and `timing.ratio`); stage is "fft",
        "input" (name: the input), "model" (name: the model) or "chain" (name: the classifier). Times are per record
        (see `timing.quote`).
    """
    results = []
    for place, batch in enumerate(BATCHES):
        works = _works(models, classifiers, iq, batch, carrier_hz=carrier_hz, prf_hz=prf_hz)

        def share(done: float, place: int = place) -> None:
            if on_share is not None:
                on_share((place + done) / len(BATCHES))

        most = max(5000, least_rounds)
        taken = time_in_turns(works, seconds=seconds, least_rounds=least_rounds, most_rounds=most, on_share=share)
        bare = taken["fft", "fft"]
        turns = len(_batches(iq, batch))  # a cascade takes longer over some records than over others
        stages = [
            {"stage": stage, "name": name, **quote(laps, per=batch, turns=turns), **ratio(laps, bare, turns=turns)}
            for (stage, name), laps in taken.items()
        ]
        results.append({"batch": batch, "stages": stages})
    return results


def _batches(iq: NDArray[np.complex64], batch: int) -> list[NDArray[np.complex64]]:
    """Split the records into full batches, at most `_MOST_TURNS` of them."""
    return [iq[start : start + batch] for start in range(0, len(iq) - batch + 1, batch)][:_MOST_TURNS]


def _works(
    models: Mapping[str, bytes],
    classifiers: Mapping[str, Classifier],
    iq: NDArray[np.complex64],
    batch: int,
    *,
    carrier_hz: float,
    prf_hz: float,
) -> dict[tuple[str, str], Work]:
    """Build the work of each step, keyed (stage, name); every call takes the next batch of the records."""
    wanted = tuple(dict.fromkeys(name for classifier in classifiers.values() for name in classifier.inputs))
    batches = _batches(iq, batch)
    ready = [model_inputs(some, carrier_hz=carrier_hz, prf_hz=prf_hz, names=wanted) for some in batches]

    make = partial(model_inputs, carrier_hz=carrier_hz, prf_hz=prf_hz)
    works: dict[tuple[str, str], Work] = {("fft", "fft"): in_turn([partial(scipy.fft.fft, some) for some in batches])}
    for name in wanted:
        works["input", name] = in_turn([partial(make, some, names=(name,)) for some in batches])
    for name, content in models.items():
        works["model", name] = _network(content, classifiers[name].inputs, ready)
    for name, classifier in classifiers.items():
        answer = partial(classifier.predict, carrier_hz=carrier_hz, prf_hz=prf_hz)
        works["chain", name] = in_turn([partial(answer, some) for some in batches])
    return works


def _network(content: bytes, inputs: tuple[str, ...], ready: list[dict[str, NDArray[np.float32]]]) -> Work:
    """Build the bare ONNX call of a model on inputs that are ready."""
    session = quiet_session(content)
    feeds = [{name: one[name] for name in inputs} for one in ready]
    return in_turn([partial(session.run, ["probabilities"], feed) for feed in feeds])


def in_turn(works: list[Work]) -> Work:
    """Combine several pieces of work into one: each call does the next piece, and after the last the first again."""
    turns = itertools.cycle(works)
    return lambda: next(turns)()
