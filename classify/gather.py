"""Synthetic records to model inputs: streamed, several processes at a time, nothing kept of the samples themselves."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from bladewing.features import INPUT_SHAPES, model_inputs
from bladewing.simulate import Radar, draw_records, stream
from bladewing.simulate.dataset import RADAR_GROUP, Records
from numpy.typing import NDArray

from .parts import Parts
from .rules import counted_pulses
from .workers import in_order

#: Records of one task: whole radar groups, so that no record is drawn twice.
TASK_RECORDS = 10 * RADAR_GROUP

#: Number of tasks whose inputs are kept together as a part of a long run: some 90 MB.
KEPT_TASKS = 50

#: Inputs kept as float16 until a batch needs them: dB values of at most 120 keep a resolution of 0.06 dB.
_COMPACT = ("levels", "spectrum", "cadence", "combs", "image")

_INPUT, _TRUTH = "input/", "truth/"


@lru_cache(maxsize=1)
def inputs_digest() -> str:
    """Digest of every input of a few records; it changes with the measurements and with the rounding of the machine."""
    records = draw_records(Radar(10e9, 20e3, 512), 12, 0, purpose="bench")
    inputs = model_inputs(records.iq, carrier_hz=10e9, prf_hz=20e3, names=tuple(INPUT_SHAPES))
    return hashlib.sha256(b"".join(inputs[name].astype("<f4").tobytes() for name in INPUT_SHAPES)).hexdigest()


@dataclass(frozen=True)
class Gathered:
    """Model inputs of many records, with their labels and the truth.

    Parameters
    ----------
    inputs : dict of str to ndarray
        Name to array (records, *shape); float16 for spectra and images, float32 for vectors of measurements.
    labels : ndarray of int, shape (records,)
        Index in ("uav", "bird", "clutter").
    truth : dict of str to ndarray, each of shape (records,)
        The simulator's truth, and the radar: "carrier_hz", "prf_hz", "pulses".
    """

    inputs: dict[str, NDArray]
    labels: NDArray[np.int64]
    truth: dict[str, NDArray]

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def pulses_counted(self) -> NDArray[np.float64]:
        """Pulses of each record that count for the rules by which it is named."""
        return counted_pulses(self.truth["pulses"], self.truth["carrier_hz"], self.truth["prf_hz"])

    def arrays(self) -> dict[str, NDArray]:
        """All of it as plain arrays by name."""
        groups = (_INPUT, self.inputs), (_TRUTH, self.truth)
        return {"labels": self.labels} | {prefix + name: a for prefix, group in groups for name, a in group.items()}

    @classmethod
    def of(cls, arrays: Mapping[str, NDArray], names: Sequence[str]) -> Gathered:
        """Rebuild from what `arrays` gave, with the inputs in the order of `names`.

        Raises
        ------
        KeyError, ValueError
            The arrays are not what `arrays` gives for these inputs.
        """
        inputs = {name: arrays[_INPUT + name] for name in names}
        truth = {name.removeprefix(_TRUTH): array for name, array in arrays.items() if name.startswith(_TRUTH)}
        labels = arrays["labels"]
        if any(array.shape != (len(labels), *INPUT_SHAPES[name]) for name, array in inputs.items()):
            raise ValueError("its inputs have other shapes")
        return cls(inputs, labels, truth)

    @classmethod
    def joined(cls, runs: Iterable[Gathered], count: int) -> Gathered:
        """Join consecutive runs, `count` records together, in one allocation: a list of them would need it twice.

        Raises
        ------
        ValueError
            The runs hold another number of records.
        """
        whole: Gathered | None = None
        at = 0
        for run in runs:
            if whole is None:
                whole = run.like(count)
            whole.put(at, run)
            at += len(run)
        if whole is None or at != count:
            raise ValueError(f"the sources hold {at} records, not {count}")
        return whole

    def like(self, count: int) -> Gathered:
        """Allocate room for `count` records of this form; its values are not set."""
        empty = {name: np.empty((count, *array.shape[1:]), array.dtype) for name, array in self.arrays().items()}
        return Gathered.of(empty, tuple(self.inputs))

    def put(self, at: int, run: Gathered) -> None:
        """Set the records from `at` on to those of a run.

        Raises
        ------
        KeyError, ValueError
            The run is longer than the room, or of another form.
        """
        theirs = run.arrays()
        for name, array in self.arrays().items():
            array[at : at + len(run)] = theirs[name]


@dataclass(frozen=True)
class TrainingSets:
    """Records for each step; they share no stream, so no scene stands in two of them."""

    train: Gathered
    validate: Gathered
    calibrate: Gathered
    test: Gathered


def gather(
    seed: int,
    purpose: str,
    count: int,
    *,
    names: Sequence[str] = tuple(INPUT_SHAPES),
    workers: int | None = None,
    on_records: Callable[[int], None] | None = None,
    parts: Parts | None = None,
) -> Gathered:
    """Draw `count` records of a purpose and turn them into model inputs.

    Parameters
    ----------
    seed, purpose, count
        As in `bladewing.simulate.stream`.
    names : sequence of str
        Inputs to compute, see `bladewing.features.INPUT_SHAPES`.
    workers : int, optional
        Processes; by default one a processor. 1 works in this process. The result does not depend on it.
    on_records : callable, optional
        Called with the number of records of each finished task.
    parts : Parts, optional
        Where finished inputs are kept, and found after an interruption; made for all that the inputs depend on.

    Returns
    -------
    Gathered

    Raises
    ------
    BadInput
        What was kept is damaged.
    """
    sources = [
        partial(stream, seed, purpose, min(TASK_RECORDS, count - at), start=at) for at in range(0, count, TASK_RECORDS)
    ]
    return gather_from(sources, purpose, count, names=names, workers=workers, on_records=on_records, parts=parts)


def gather_from(
    sources: Sequence[Callable[[], Iterable[Records]]],
    purpose: str,
    count: int,
    *,
    names: Sequence[str],
    workers: int | None = None,
    on_records: Callable[[int], None] | None = None,
    parts: Parts | None = None,
) -> Gathered:
    """Turn records into model inputs, wherever they come from.

    Parameters
    ----------
    sources : sequence of callable
        Each gives a run of consecutive records when it is called, in any process; at least one.
    purpose, count
        Name under which the records are kept, and their number.
    names, workers, on_records, parts
        As in `gather`.

    Returns
    -------
    Gathered

    Raises
    ------
    BadInput
        As `gather`.
    ValueError
        The sources hold another number of records.
    """

    def told() -> Iterator[Gathered]:
        for done in _done(sources, purpose, names, workers, parts):
            yield done
            if on_records:
                on_records(len(done))

    return Gathered.joined(told(), count)


def _done(
    sources: Sequence[Callable[[], Iterable[Records]]],
    purpose: str,
    names: Sequence[str],
    workers: int | None,
    parts: Parts | None,
) -> Iterator[Gathered]:
    """Inputs of the sources in order: those kept before, then the others, which are kept `KEPT_TASKS` at a time."""
    made = partial(in_order, partial(_inputs_of, tuple(names)), workers=workers)
    if parts is None:
        yield from made(sources)
        return
    kept = 0
    while kept < len(sources) and (arrays := parts.arrays(name := _kept_name(purpose, kept))) is not None:
        try:
            yield Gathered.of(arrays, names)
        except (KeyError, ValueError) as error:
            raise parts.refusal(name, str(error)) from None
        kept += KEPT_TASKS
    waiting: list[Gathered] = []
    for number, done in enumerate(made(sources[kept:]), kept + 1):
        yield done
        waiting.append(done)
        if number % KEPT_TASKS == 0 or number == len(sources):
            parts.keep_arrays(
                _kept_name(purpose, number - len(waiting)), Gathered.joined(waiting, sum(map(len, waiting))).arrays()
            )
            waiting = []


def _kept_name(purpose: str, first: int) -> str:
    """Name of the part that holds the inputs of the tasks from a first one on."""
    return f"drawn-{purpose}-{first // KEPT_TASKS:05d}"


def _inputs_of(names: tuple[str, ...], source: Callable[[], Iterable[Records]]) -> Gathered:
    """Inputs of one run of consecutive records."""
    runs = []
    for records in source():
        radar = records.radar
        computed = model_inputs(records.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=names)
        inputs = {name: computed[name].astype(np.float16 if name in _COMPACT else np.float32) for name in names}
        given = {"carrier_hz": radar.carrier_hz, "prf_hz": radar.prf_hz, "pulses": radar.pulses}
        radars = {name: np.full(len(records), value) for name, value in given.items()}
        runs.append(Gathered(inputs, records.label_indices, records.truth | radars))
    return Gathered.joined(runs, sum(map(len, runs)))
