"""A network's part of a training: its generations, its teachers, and what an interruption leaves of it."""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from bladewing.features import INPUT_SHAPES
from bladewing.models import LADDER
from bladewing.simulate.dataset import KIND_CLASS
from numpy.typing import NDArray

from .gather import Gathered, Sets
from .labels import CLASSES
from .parts import Parts
from .training_config import TrainingConfig

if TYPE_CHECKING:
    from bladewing.models.cnn import EvidenceNet
    from bladewing.models.training import TrainingResult

CLASS_OF_KIND = tuple(CLASSES.index(label) for label in KIND_CLASS.values())
"""Class of each kind that networks learn to tell, in the order of `KIND_CLASS`."""

OnFraction = Callable[[float], None]

ScoresOf = Callable[[Gathered], NDArray[np.floating]]

Taught = Callable[[], NDArray[np.floating]]
"""Gives what a network's teacher says of the training records, shape (n, kinds); asked only by one that is trained."""


def kinds_of(part: Gathered) -> NDArray[np.int64]:
    """Kind of each record, a place in `KIND_CLASS`."""
    place = {kind: number for number, kind in enumerate(KIND_CLASS)}
    return np.array([place[kind] for kind in part.truth["kind"]], np.int64)


def parts_of(name: str) -> Iterator[str]:
    """Names of the parts that hold what is done of a network: each generation's epochs, and the answers of all but one.

    The last generation's answers are those of the finished network.
    """
    for generation in range(LADDER[name].generations):
        yield _epochs_of(name, generation)
        if generation:
            yield _answers_of(name, generation - 1)


def _epochs_of(name: str, generation: int) -> str:
    return f"{name}-{generation}-epochs"


def _answers_of(name: str, generation: int) -> str:
    return f"{name}-{generation}-answers"


def train_net(
    name: str,
    settings: TrainingConfig,
    sets: Sets,
    on_fraction: OnFraction,
    parts: Parts | None,
    taught: Taught | None = None,
) -> tuple[ScoresOf, Callable[[Any], bytes], dict[str, Any]]:
    """Train a network as often as the ladder says, each time but the first by the answers of the one before.

    Returns
    -------
    scores_of, export, detail
        What gives the scores of records, what exports it with a calibration, and its part of the account.
    """
    from bladewing.models.export import export_network
    from bladewing.models.training import network_scores, network_shares

    rung, earlier_s = LADDER[name], 0.0
    told = taught
    for generation in range(rung.generations - 1):
        kept = parts.arrays(_answers_of(name, generation)) if parts else None
        if kept is None:
            net, result = _generation(name, generation, told, settings, sets, on_fraction, parts)
            answers = network_shares(net, _inputs(name, sets.train)).astype(np.float16)
            kept = {"answers": answers, "seconds": np.array(result.seconds)}
            if parts:
                parts.keep_arrays(_answers_of(name, generation), kept)
        earlier_s += float(kept["seconds"])
        told = partial(_whole, kept["answers"])
    net, result = _generation(name, rung.generations - 1, told, settings, sets, on_fraction, parts)
    net.compact()
    detail = {
        "device": result.device,
        "teacher": rung.teacher if taught else "",
        "generations": rung.generations,
        "best_epoch": result.best_epoch,
        "stopped_early": result.stopped_early,
        # of all generations and epochs, those before an interruption too
        "seconds": round(earlier_s + result.seconds, 1),
        "epochs": [{key: _told(key, value) for key, value in epoch.items()} for epoch in result.epochs],
    }
    return (
        lambda part: network_scores(net, _inputs(name, part)),
        lambda calibration: export_network(net, net.input_shapes, calibration),
        detail,
    )


def _generation(
    name: str,
    generation: int,
    told: Taught | None,
    settings: TrainingConfig,
    sets: Sets,
    on_fraction: OnFraction,
    parts: Parts | None,
) -> tuple["EvidenceNet", "TrainingResult"]:
    """Train a network once, from weights of its own."""
    from bladewing.models.augment import VelocityMirror
    from bladewing.models.cnn import ImageNet, SpectrumNet
    from bladewing.models.training import train_network
    from bladewing.models.training_state import ForeignSnapshot

    rung, seed = LADDER[name], settings.seed + generation
    shapes = {key: INPUT_SHAPES[key] for key in rung.inputs}
    signal = rung.inputs[0]
    image = len(shapes[signal]) == 3
    net: EvidenceNet = (
        ImageNet(shapes, seed=seed, kinds=CLASS_OF_KIND)
        if image
        else SpectrumNet(shapes, seed=seed, widen=rung.widen, kinds=CLASS_OF_KIND)
    )
    epochs_part = _epochs_of(name, generation)
    try:
        result = train_network(
            net,
            _inputs(name, sets.train),
            sets.train.labels,
            (_inputs(name, sets.validate), sets.validate.labels),
            seed=seed,
            epochs=settings.epochs,
            patience=settings.patience,
            batch=settings.batch,
            learning_rate=settings.learning_rate,
            weight_decay=settings.weight_decay,
            bfloat16=settings.bfloat16,
            # no measurement is signed, so only the picture is mirrored
            augment=VelocityMirror(axes={signal: -2 if image else -1}, odd={}),
            teacher=told() if told else None,
            kinds=kinds_of(sets.train),
            snapshot=parts.arrays(epochs_part) if parts else None,
            on_snapshot=partial(parts.keep_arrays, epochs_part) if parts else None,
            on_epoch=lambda epoch, epochs, _: on_fraction((generation + epoch / epochs) / rung.generations),
        )
    except ForeignSnapshot as error:
        assert parts
        raise parts.refusal(epochs_part, str(error)) from None
    return net, result


def _inputs(name: str, part: Gathered) -> dict[str, NDArray]:
    return {key: part.inputs[key] for key in LADDER[name].inputs}


def _whole(answers: NDArray[np.float16]) -> NDArray[np.float32]:
    """Shares that were stored in half precision, 1 in sum again."""
    shares = answers.astype(np.float32)
    return shares / shares.sum(axis=1, keepdims=True)


def _told(metric: str, value: float) -> float | None:
    """A metric of an epoch as the account holds it; JSON has no word for one that is not finite."""
    if not math.isfinite(value):
        return None
    return float(f"{value:.3g}") if metric == "learning_rate" else round(value, 4)
