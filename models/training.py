"""The loop that trains a network: one seed, one schedule, the best state kept."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.optim.lr_scheduler import OneCycleLR

from ._checks import require_every_class, require_kinds, require_labels, require_shares
from .cnn import EvidenceNet
from .muon import Muon
from .training_state import Snapshot, Work

Inputs = Mapping[str, NDArray[np.floating]]
"""Input name to array (n, *shape); float16 saves memory, every batch is cast to float32."""

Augment = Callable[[Mapping[str, Tensor], torch.Generator], Mapping[str, Tensor]]
"""Takes a batch and a CPU generator, returns the batch to learn from; see `augment.VelocityMirror`."""

OnEpoch = Callable[[int, int, dict[str, float]], None]
"""Called with the epoch just done (from 1), the number of epochs, and the metrics of the epoch."""

OnSnapshot = Callable[[Snapshot], None]
"""Called with the state after an epoch; the arrays are copies."""

RISE = 0.2
"""Share of the steps in which the learning rate rises."""

ADAM = 0.3
"""Adam's learning rate over Muon's."""

TAUGHT = 0.75
"""Weight of the teacher's answer in a network's target; the label has the rest."""

SMOOTHING = 0.02
"""Label smoothing: share of the target that is spread evenly over the classes, or over the kinds."""

WIDE = 400_000
"""Weights from which on a network is computed on two threads."""

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")

_AT_ONCE = 1024  # records that a network is asked about in one call


@dataclass(frozen=True)
class TrainingData:
    """What a network is trained on.

    Parameters
    ----------
    inputs
        Input name to array (n, *shape).
    labels
        Shape (n,), whole numbers 0 to 2, at least two records of each.
    kinds
        Kind of each record, shape (n,), an index into the network's `kinds`, of the class that its label says. Where
        given, the network learns the kinds as well: their loss is added to that of the classes.
    teacher
        Probabilities that another network gives each kind of the records, shape (n, kinds);
        they have the weight `TAUGHT` in the targets. A label is one draw of what a record leaves open, the teacher's
        answer is near the mean of such draws, so that a step errs less (Hinton, Vinyals and Dean, arXiv:1503.02531),
        also where the teacher is as small as its pupil (Furlanello and others, arXiv:1805.04770).
    """

    inputs: Inputs
    labels: NDArray[np.integer]
    kinds: NDArray[np.integer] | None = None
    teacher: NDArray[np.floating] | None = None

    def require(self, net: EvidenceNet) -> int:
        """Check that a network can be trained on these data, and return the number of records."""
        count = net.require(self.inputs)
        require_labels(self.labels, count, "labels")
        require_every_class(self.labels, "labels")
        if self.teacher is not None:
            require_shares(self.teacher, count, len(net.kinds), "teacher")
        if self.kinds is not None:
            require_kinds(self.kinds, self.labels, net.kinds)
        return count


@dataclass(frozen=True)
class TrainingOptions:
    """How long a network is trained, and how fast.

    Parameters
    ----------
    epochs
        Passes over the records, at least 1.
    batch
        Records a step, at least 2. The rest of an epoch that fills no batch is left out of it.
    learning_rate
        Peak of the schedule, of Muon; Adam's is `ADAM` times as high.
    weight_decay
        Of Muon.
    patience
        Epochs in a row without a lower validation loss after which the training stops; 0: never. The learning-rate
        schedule is laid out for all epochs: a training that stops early does not reach its end.
    bfloat16
        Compute the scores and their gradients in bfloat16; weights and steps stay in float32. On processors that
        multiply such numbers in hardware (AVX-512 BF16, AMX) a step takes 0.6 of the time, and networks trained on
        96 000 records learned no worse (docs/ablation.md); on others it takes longer.

    Raises
    ------
    ValueError
        Where there are too few epochs or records a step, or `patience` is negative.
    """

    epochs: int
    batch: int = 256
    learning_rate: float = 0.02
    weight_decay: float = 0.3
    patience: int = 0
    bfloat16: bool = False

    def __post_init__(self) -> None:
        if self.epochs < 1 or self.batch < 2 or self.patience < 0:
            raise ValueError(
                f"epochs is {self.epochs}, batch {self.batch}, patience {self.patience}; they must be at least 1, 2 "
                "and 0"
            )


@dataclass(frozen=True)
class TrainingResult:
    """What a training did.

    Parameters
    ----------
    best_epoch
        Epoch whose state the network was left in, counted from 1.
    device
        "cpu" or "cuda".
    seconds
        Wall time [s].
    epochs
        One mapping an epoch: learning_rate (of its last step), train_loss and validation_loss [nats],
        validation_accuracy (0 to 1), seconds (since the start) [s].
    stopped_early
        Whether epochs were left out because the validation loss no longer fell.
    """

    best_epoch: int
    device: str
    seconds: float
    epochs: tuple[dict[str, float], ...]
    stopped_early: bool


def _few_threads(
    work: Callable[Concatenate[EvidenceNet, _Given], _Result],
) -> Callable[Concatenate[EvidenceNet, _Given], _Result]:
    """Hold torch to one thread for a network, or to two for one of `WIDE`.

    Threads of layers this small wait for one another longer than they compute: on one thread a step of 256 records of
    `spectrum-cnn` takes 0.6 of its time on two; of the widest network a step on two threads takes 0.57 of its time on
    one. Another busy process then slows the training by no more than its share, and the result does not depend, to the
    bit, on the number of processors.
    """

    @wraps(work)
    def held(net: EvidenceNet, *args: _Given.args, **options: _Given.kwargs) -> _Result:
        threads = torch.get_num_threads()
        torch.set_num_threads(1 + (sum(weights.numel() for weights in net.parameters()) >= WIDE))
        try:
            return work(net, *args, **options)
        finally:
            torch.set_num_threads(threads)

    return held


@_few_threads
def train_network(
    net: EvidenceNet,
    data: TrainingData,
    validation: tuple[Inputs, NDArray[np.integer]],
    options: TrainingOptions,
    *,
    seed: int,
    augment: Augment | None = None,
    snapshot: Snapshot | None = None,
    on_snapshot: OnSnapshot | None = None,
    on_epoch: OnEpoch | None = None,
) -> TrainingResult:
    """Train in place, on a GPU where there is one, and leave the network in its best state, on the CPU.

    Measures the standardisation of the inputs, then runs Muon (matrices, kernels) and Adam (all else) on a one-cycle
    schedule. The best state is that of the least validation loss. On a CPU the outcome is a function of the seed, bit
    by bit, also where the training was interrupted and goes on from a snapshot.

    Parameters
    ----------
    net
        The network; its present weights are where it starts.
    data
        What it is trained on.
    validation
        Inputs and labels of other records, which choose the best epoch.
    options
        How long, and how fast.
    seed
        Draws the order of the records and the augmentation.
    augment
        Changes each training batch.
    snapshot
        State to go on from: what `on_snapshot` was given by a training with the same arguments.
    on_snapshot
        Called after each epoch, before `on_epoch`, with all that the next epochs depend on.
    on_epoch
        Called after each epoch; what it raises ends the training.

    Returns
    -------
    TrainingResult
        The metrics of every epoch.

    Raises
    ------
    ValueError
        Where an array has the wrong shape or values.
    ForeignSnapshot
        Where the snapshot is of another training.
    FloatingPointError
        Where no epoch gave a finite validation loss.
    """
    count = data.require(net)
    require_labels(validation[1], net.require(validation[0]), "validation labels")
    started = time.perf_counter()
    place = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    epochs, batch = options.epochs, min(options.batch, count)
    steps = count // batch
    net.standardise_by(data.inputs)
    # the stubs do not know this argument; channels last, a step takes a fifth less time on a CPU
    net.to(place, memory_format=torch.channels_last)  # type: ignore[call-overload]
    tensors = {name: _tensor(data.inputs[name]).to(place) for name in net.input_shapes}
    loss_of = _Loss(net, data, place)
    optimisers, schedules = _scheduled(net, max(3, epochs * steps), options)
    rng = torch.Generator().manual_seed(seed)
    work = Work(net, optimisers, schedules, rng)
    if snapshot is not None:
        work.restore(snapshot, epochs=epochs, steps=steps)
        started -= work.history[-1]["seconds"]
    while len(work.history) < epochs and not 0 < options.patience <= len(work.history) - work.best_epoch:
        net.train()
        total = torch.zeros((), device=place)
        order = torch.randperm(count, generator=rng)[: steps * batch].to(place)
        for rows in order.split(batch):
            part: Mapping[str, Tensor] = {name: values[rows].float() for name, values in tensors.items()}
            if augment:
                part = augment(part, rng)
            with torch.autocast(place.type, torch.bfloat16, enabled=options.bfloat16):
                kind_scores = net.kind_scores(*(part[name] for name in net.input_shapes))
            loss = loss_of(kind_scores.float(), rows)
            net.zero_grad(set_to_none=True)
            loss.backward()
            rate = optimisers[0].param_groups[0]["lr"]
            for optimiser, schedule in zip(optimisers, schedules, strict=True):
                optimiser.step()
                schedule.step()
            total += loss.detach()
        metrics = {
            "learning_rate": float(rate),
            "train_loss": float(total) / steps,
            **_validated(net, *validation),
            "seconds": time.perf_counter() - started,
        }
        work.add(metrics)
        if on_snapshot:
            on_snapshot(work.snapshot())
        if on_epoch:
            on_epoch(len(work.history), epochs, metrics)
    if not work.best:
        raise FloatingPointError(
            f"no epoch gave a finite validation loss; learning_rate {options.learning_rate} is too high"
        )
    net.to("cpu", memory_format=torch.contiguous_format).load_state_dict(work.best)  # type: ignore[call-overload]
    net.eval()
    seconds = time.perf_counter() - started
    return TrainingResult(work.best_epoch, place.type, seconds, tuple(work.history), len(work.history) < epochs)


@_few_threads
def network_scores(net: EvidenceNet, inputs: Inputs) -> NDArray[np.float32]:
    """Return the raw scores of a network, and leave it in the state for inference.

    Parameters
    ----------
    net
        The network, on any device.
    inputs
        Input name to array (n, *shape), finite.

    Returns
    -------
    ndarray
        Shape (n, 3), float32, in the order uav, bird, clutter.

    Raises
    ------
    ValueError
        Where an input is missing, has another shape, or holds NaN or infinity.
    """
    count = net.require(inputs)
    place = next(net.parameters()).device
    net.eval()
    scores = []
    with torch.inference_mode():
        for start in range(0, count, _AT_ONCE):
            part = (_tensor(inputs[name][start : start + _AT_ONCE]).to(place).float() for name in net.input_shapes)
            scores.append(net(*part).cpu())
    return torch.cat(scores).numpy()


class _Loss:
    """Loss of a network on training records: that of their classes and, where kinds are given, that of their kinds."""

    def __init__(self, net: EvidenceNet, data: TrainingData, place: torch.device) -> None:
        self._net, self._criterion = net, nn.CrossEntropyLoss(label_smoothing=SMOOTHING)
        said, classes_said = None, None
        if data.teacher is not None:
            said = torch.as_tensor(data.teacher, dtype=torch.float32)
            classes_said = said @ nn.functional.one_hot(torch.tensor(net.kinds)).float()
        self._classes = _target(data.labels, classes_said, place)
        self._kinds = None if data.kinds is None else _target(data.kinds, said, place)

    def __call__(self, kind_scores: Tensor, rows: Tensor) -> Tensor:
        loss = self._criterion(self._net.class_scores(kind_scores), self._classes[rows])
        return loss if self._kinds is None else loss + self._criterion(kind_scores, self._kinds[rows])


def _target(labels: NDArray[np.integer], said: Tensor | None, place: torch.device) -> Tensor:
    """Targets: the labels or, with a teacher's probabilities, the mean of both weighted by `TAUGHT`."""
    truth = torch.as_tensor(labels, dtype=torch.int64)
    if said is not None:
        truth = TAUGHT * said + (1 - TAUGHT) * nn.functional.one_hot(truth, said.shape[1])
    return truth.to(place)


def _scheduled(
    net: EvidenceNet, planned: int, options: TrainingOptions
) -> tuple[tuple[torch.optim.Optimizer, ...], tuple[OneCycleLR, ...]]:
    """Muon for matrices and kernels, Adam for all else, and their learning-rate schedules over `planned` steps."""
    matrices = [weights for weights in net.parameters() if weights.ndim > 1]
    others = [weights for weights in net.parameters() if weights.ndim <= 1]
    optimisers = (
        Muon(matrices, lr=options.learning_rate, weight_decay=options.weight_decay),
        torch.optim.Adam(others, lr=ADAM * options.learning_rate),
    )
    rise = max(RISE, 2 / planned)  # two steps or more: a rise of one step has no length
    schedules = tuple(
        OneCycleLR(optimiser, optimiser.defaults["lr"], planned, pct_start=rise, cycle_momentum=False)
        for optimiser in optimisers
    )
    return optimisers, schedules


def _validated(net: EvidenceNet, inputs: Inputs, y: NDArray[np.integer]) -> dict[str, float]:
    """Loss and accuracy on records that are not trained on."""
    scores = torch.from_numpy(network_scores(net, inputs))
    labels = torch.as_tensor(y, dtype=torch.int64)
    return {
        "validation_loss": float(nn.functional.cross_entropy(scores, labels)),
        "validation_accuracy": float((scores.argmax(1) == labels).float().mean()),
    }


def _tensor(values: NDArray[np.floating]) -> Tensor:
    """Share the memory of an array where torch can; copy where it is read-only or not contiguous."""
    return torch.from_numpy(np.require(values, requirements=["C", "W"]))
