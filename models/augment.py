"""Changes of a training batch that leave its class as it is, because physics says so."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor


class VelocityMirror:
    """Let half of the records, drawn at random, recede where they approached.

    A target flying away has the spectrum of one flying towards the radar, read backwards: the class stays.

    Parameters
    ----------
    axes
        Input name to the axis of velocity in it, the batch being axis 0; that axis must be symmetric about zero.
    odd
        Input name to the indices of the measurements that change their sign with the velocity.
    """

    def __init__(self, *, axes: Mapping[str, int], odd: Mapping[str, Sequence[int]]) -> None:
        self.axes = dict(axes)
        self.odd = {name: list(indices) for name, indices in odd.items()}

    def __call__(self, batch: Mapping[str, Tensor], rng: torch.Generator) -> dict[str, Tensor]:
        """Return the batch with some of its records mirrored; the same records in every input.

        Parameters
        ----------
        batch
            Input name to tensor (n, ...); is left as it was.
        rng
            Generator on the CPU.

        Returns
        -------
        dict
            Input name to tensor of the same shape.
        """
        count = len(next(iter(batch.values())))
        turned = torch.rand(count, generator=rng) < 0.5
        result = dict(batch)
        for name, axis in self.axes.items():
            values = result[name]
            mask = turned.to(values.device).reshape((-1,) + (1,) * (values.ndim - 1))
            result[name] = torch.where(mask, values.flip(axis), values)
        for name, indices in self.odd.items():
            values = result[name].clone()
            sign = 1 - 2 * turned.to(values)
            values[:, indices] *= sign[:, None]
            result[name] = values
        return result
