"""The training of one network: its kinds, its teacher, and how it goes on after an interruption."""

import math
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from bladewing.features import INPUT_SHAPES
from bladewing.models import LADDER, TEACHER
from bladewing.simulate.dataset import KIND_CLASS
from numpy.typing import NDArray

from .errors import BadInput
from .gather import Gathered, TrainingSets
from .labels import CLASSES
from .parts import Parts
from .training_config import TrainingConfig

if TYPE_CHECKING:
    from bladewing.models.cnn import EvidenceNet
    from bladewing.models.training import TrainingResult

CLASS_OF_KIND = tuple(CLASSES.index(label) for label in KIND_CLASS.values())
"""Class of each kind that networks learn to tell, in the order of `KIND_CLASS`."""

PUPIL_EPOCHS = 2
"""Factor on the settings' epochs for a pupil: it goes on gaining from its teacher's answers (docs/ablation.md)."""

OnFraction = Callable[[float], None]

ScoresOf = Callable[[Gathered], NDArray[np.floating]]

Taught = Callable[[], NDArray[np.floating]]
"""Returns the teacher's probabilities of the kinds of the training records, shape (n, kinds); called only to train."""


def kinds_of(part: Gathered) -> NDArray[np.int64]:
    """Kind of each record, a place in `KIND_CLASS`.

    An empty cell with a background is ground, not noise: otherwise a hovering rotor, whose body's line is at rest as
    the ground's is, would be taken for noise too.
    """
    place = {kind: number for number, kind in enumerate(KIND_CLASS)}
    kinds = np.array([place[kind] for kind in part.truth["kind"]], np.int64)
    kinds[(kinds == place["noise"]) & np.isfinite(part.truth["background_db"])] = place["ground"]
    return kinds


def epochs_of(name: str) -> str:
    """Name of the part that holds a network's state after its last whole epoch."""
    return f"{name}-epochs"


def train_net(
    name: str,
    settings: TrainingConfig,
    sets: TrainingSets,
    on_fraction: OnFraction,
    parts: Parts | None,
    taught: Taught | None = None,
) -> tuple[ScoresOf, Callable[[Any], bytes], dict[str, Any]]:
    """Train a network, from its last whole epoch on where some are kept.

    Returns
    -------
    scores_of, export, detail
        A function that gives the scores of records, one that exports the network with a calibration, and the network's
        part of the account.
    """
    from bladewing.models.export import export_network
    from bladewing.models.training import network_scores

    net, result = _trained(name, taught, settings, sets, on_fraction, parts)
    net.compact()
    detail = {
        "device": result.device,
        "teacher": TEACHER if taught else "",
        "best_epoch": result.best_epoch,
        "stopped_early": result.stopped_early,
        "seconds": round(result.seconds, 1),  # of all epochs, those before an interruption too
        "epochs": [{key: _told(key, value) for key, value in epoch.items()} for epoch in result.epochs],
    }
    return (
        lambda part: network_scores(net, _inputs(name, part)),
        lambda calibration: export_network(net, net.input_shapes, calibration),
        detail,
    )


def _trained(
    name: str,
    taught: Taught | None,
    settings: TrainingConfig,
    sets: TrainingSets,
    on_fraction: OnFraction,
    parts: Parts | None,
) -> tuple["EvidenceNet", "TrainingResult"]:
    from bladewing.models.augment import VelocityMirror
    from bladewing.models.cnn import ImageNet, SpectrumNet
    from bladewing.models.training import TrainingData, TrainingOptions, train_network
    from bladewing.models.training_state import ForeignSnapshot

    rung, seed = LADDER[name], settings.seed
    shapes = {key: INPUT_SHAPES[key] for key in rung.inputs}
    signal = rung.inputs[0]
    image = len(shapes[signal]) == 3
    net: EvidenceNet = (
        ImageNet(shapes, seed=seed, kinds=CLASS_OF_KIND)
        if image
        else SpectrumNet(shapes, seed=seed, widen=rung.widen, kinds=CLASS_OF_KIND)
    )
    options = settings.model_dump(include={field.name for field in fields(TrainingOptions)})
    if taught:
        options["epochs"] *= PUPIL_EPOCHS
    epochs_part = epochs_of(name)
    try:
        result = train_network(
            net,
            TrainingData(
                _inputs(name, sets.train), sets.train.labels, kinds_of(sets.train), taught() if taught else None
            ),
            (_inputs(name, sets.validate), sets.validate.labels),
            TrainingOptions(**options),
            seed=seed,
            # no other input depends on the sign of the velocity, so only the signal is mirrored
            augment=VelocityMirror(signal, -2 if image else -1),
            snapshot=parts.arrays(epochs_part) if parts else None,
            on_snapshot=partial(parts.keep_arrays, epochs_part) if parts else None,
            on_epoch=lambda epoch, epochs, _: on_fraction(epoch / epochs),
        )
    except ForeignSnapshot as error:
        assert parts
        raise parts.refusal(epochs_part, str(error)) from None
    except FloatingPointError as error:
        raise BadInput(f"{name}: {error}: choose a smaller one") from None
    return net, result


def _inputs(name: str, part: Gathered) -> dict[str, NDArray]:
    return {key: part.inputs[key] for key in LADDER[name].inputs}


def _told(metric: str, value: float) -> float | None:
    """A metric of an epoch as the account holds it; None if not finite, as JSON cannot hold that."""
    if not math.isfinite(value):
        return None
    return float(f"{value:.3g}") if metric == "learning_rate" else round(value, 4)
