"""The state of a training between two epochs, as plain arrays; a training resumed from it ends with the same bits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

Snapshot = Mapping[str, NDArray[np.generic]]
"""Name to array of plain numbers, so that it is stored and read without pickle."""


class ForeignSnapshot(ValueError):  # noqa: N818 - said of the snapshot
    """The snapshot is not one of this training."""


_HISTORY = "history/"
_BEST_EPOCH = "best_epoch"


class Work:
    """What a training changes from epoch to epoch.

    Parameters
    ----------
    net
        The network, on its device, standardisation measured.
    optimisers
        The network's parameters are divided among them; they have taken no step yet.
    schedules
        One-cycle schedules over the optimisers.
    rng
        Generator of the order and the augmentation.

    Attributes
    ----------
    history : list of dict
        The metrics of each epoch.
    best_epoch : int
        Epoch of the least validation loss, from 1; 0 where none was finite.
    best : dict
        State of the network after that epoch, on the CPU.
    """

    def __init__(
        self,
        net: nn.Module,
        optimisers: Sequence[torch.optim.Optimizer],
        schedules: Sequence[torch.optim.lr_scheduler.OneCycleLR],
        rng: torch.Generator,
    ) -> None:
        self._net, self._optimisers, self._schedules, self._rng = net, optimisers, schedules, rng
        self.history: list[dict[str, float]] = []
        self.best_epoch, self.best = 0, dict[str, Tensor]()

    def add(self, metrics: dict[str, float]) -> None:
        """Note an epoch, and keep the network's state if it is the best yet."""
        least = self.history[self.best_epoch - 1]["validation_loss"] if self.best_epoch else math.inf
        self.history.append(metrics)
        if metrics["validation_loss"] < least:
            self.best_epoch = len(self.history)
            self.best = {name: value.detach().cpu().clone() for name, value in self._net.state_dict().items()}

    def snapshot(self) -> dict[str, NDArray[np.generic]]:
        """Copy all that the next epochs depend on; the schedule follows from the number of epochs."""
        columns = {_HISTORY + name: np.array([epoch[name] for epoch in self.history]) for name in self.history[0]}
        tensors = {f"best/{name}": value for name, value in self.best.items()} | self._moving()
        arrays = {name: value.detach().cpu().numpy().copy() for name, value in tensors.items()}
        return {**columns, _BEST_EPOCH: np.array(self.best_epoch), **arrays}

    def restore(self, snapshot: Snapshot, *, epochs: int, steps: int) -> None:
        """Go on where a snapshot was made; nothing is changed where it does not fit.

        Parameters
        ----------
        snapshot
            As `snapshot` gave it.
        epochs, steps
            Number of epochs of the training, and of steps of one epoch.

        Raises
        ------
        ForeignSnapshot
            The snapshot holds no history of 1 to `epochs` epochs, or the arrays of another network.
        """
        columns = {name: values for name, values in snapshot.items() if name.startswith(_HISTORY)}
        told = {_HISTORY + "validation_loss", _HISTORY + "seconds"} <= columns.keys()
        done = {values.shape for values in columns.values()}
        count = next(iter(done))[0] if len(done) == 1 and len(next(iter(done))) == 1 else 0
        best_epoch = snapshot.get(_BEST_EPOCH, np.array(-1))
        if not (told and 1 <= count <= epochs and best_epoch.shape == () and 0 <= best_epoch <= count):
            raise ForeignSnapshot(f"the snapshot holds no history of 1 to {epochs} epochs")
        for optimiser in self._optimisers:
            for parameter in (parameter for group in optimiser.param_groups for parameter in group["params"]):
                if not optimiser.state[parameter]:  # what Adam itself creates at its first step
                    averages = {name: torch.zeros_like(parameter) for name in ("exp_avg", "exp_avg_sq")}
                    optimiser.state[parameter] = {"step": torch.tensor(0.0), **averages}
        state = self._net.state_dict()
        expected = self._moving() | ({f"best/{name}": value for name, value in state.items()} if best_epoch else {})
        found = {name: values for name, values in snapshot.items() if name not in columns and name != _BEST_EPOCH}
        for name in sorted(expected.keys() | found.keys()):
            wanted, given = (
                None if value is None else (tuple(value.shape), str(value.dtype).removeprefix("torch."))
                for value in (expected.get(name), found.get(name))
            )
            if wanted != given:
                raise ForeignSnapshot(
                    f"the snapshot's {name} is {given or 'missing'}; this training has {wanted or 'none'}"
                )
        tensors = {name: torch.from_numpy(np.array(values)) for name, values in found.items()}
        with torch.no_grad():
            for name, value in self._moving().items():
                if not name.startswith("generator/"):
                    value.copy_(tensors[name])
        self._rng.set_state(tensors["generator/batches"])
        at = {"last_epoch": count * steps - 1, "_step_count": count * steps + 1}
        for schedule in self._schedules:
            schedule.load_state_dict(schedule.state_dict() | at)
            schedule.step()  # a rate of this schedule follows from the number of steps alone
        self.history = [
            {name.removeprefix(_HISTORY): float(values[epoch]) for name, values in columns.items()}
            for epoch in range(count)
        ]
        self.best_epoch = int(best_epoch)
        self.best = {name: tensors[f"best/{name}"] for name in state} if best_epoch else {}

    def _moving(self) -> dict[str, Tensor]:
        """The tensors that the next epochs depend on: not copies, except the generator's state."""
        moving = {f"network/{name}": value for name, value in self._net.state_dict().items()}
        held = {parameter: state for optimiser in self._optimisers for parameter, state in optimiser.state.items()}
        for place, parameter in enumerate(self._net.parameters()):
            moving |= {f"optimiser/{place}/{name}": value for name, value in held[parameter].items()}
        moving["generator/batches"] = self._rng.get_state()
        return moving
