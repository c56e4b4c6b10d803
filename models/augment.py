"""Augmentation of a training batch: changes that, by the physics, leave the class of each record as it is."""

from collections.abc import Mapping

import torch
from torch import Tensor


class VelocityMirror:
    """Mirrors the radial velocity of records drawn at random, each with probability 1/2.

    A target flying away has the spectrum of one flying towards the radar, read backwards: the class stays.

    Parameters
    ----------
    signal
        Name of the input with a velocity axis; no other input depends on the sign of the velocity.
    axis
        Its velocity axis, which must be symmetric about zero; axis 0 is the batch.
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
