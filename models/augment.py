"""Changes of a training batch that leave its class as it is, because physics says so."""

from collections.abc import Mapping

import torch
from torch import Tensor


class VelocityMirror:
    """Let half of the records, drawn at random, recede where they approached.

    A target flying away has the spectrum of one flying towards the radar, read backwards: the class stays.

    Parameters
    ----------
    signal
        Name of the input that shows the velocity; no other has a sign.
    axis
        The axis of velocity in it, the batch being axis 0; it must be symmetric about zero.
    """

    def __init__(self, signal: str, axis: int) -> None:
        self.signal, self.axis = signal, axis

    def __call__(self, batch: Mapping[str, Tensor], rng: torch.Generator) -> dict[str, Tensor]:
        """Return the batch with some of its records mirrored.

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
        values = batch[self.signal]
        turned = torch.rand(len(values), generator=rng) < 0.5
        mask = turned.to(values.device).reshape((-1,) + (1,) * (values.ndim - 1))
        return {**batch, self.signal: torch.where(mask, values.flip(self.axis), values)}
