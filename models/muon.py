"""Muon, an optimiser for matrices and the kernels of convolutions: its steps are the momentum, made orthogonal."""

from collections.abc import Iterable

import torch
from torch import Tensor

#: Weight of the past in the running average of the gradients, and of that average in Nesterov's look-ahead.
MOMENTUM = 0.95

_NEWTON_SCHULZ = (3.4445, -4.7750, 2.0315)  # K. Jordan's: singular values end between 0.7 and 1.2, not exactly at 1
_STEPS = 5


class Muon(torch.optim.Optimizer):
    """Momentum, orthogonalised (K. Jordan, kellerjordan.github.io/posts/muon, 2024), with decoupled weight decay.

    Few directions dominate the gradient of a layer; in an orthogonal step the rare ones are learnt as fast. torch's own
    Muon takes only matrices and computes in bfloat16; here a kernel is a matrix with one row for each output, and keeps
    its precision.

    Parameters
    ----------
    parameters
        Tensors of two dimensions or more, outputs first.
    lr
        Learning rate: about how far a step moves a layer's outputs, whatever its shape.
    weight_decay
        Share of the weights that a step of rate 1 would take away.
    """

    def __init__(self, parameters: Iterable[Tensor], *, lr: float, weight_decay: float = 0.0) -> None:
        super().__init__(parameters, {"lr": lr, "weight_decay": weight_decay})
        for group in self.param_groups:
            for weights in group["params"]:
                self.state[weights]["average"] = torch.zeros_like(weights)

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Take one step."""
        for group in self.param_groups:
            for weights in group["params"]:
                average = self.state[weights]["average"].lerp_(weights.grad, 1 - MOMENTUM)
                ahead = weights.grad.lerp(average, MOMENTUM)
                outputs, inputs = len(weights), weights[0].numel()
                step = orthogonal(ahead.reshape(outputs, inputs)).reshape(weights.shape)
                weights.mul_(1 - group["lr"] * group["weight_decay"])
                weights.add_(step, alpha=-group["lr"] * max(1.0, outputs / inputs) ** 0.5)


def orthogonal(matrix: Tensor) -> Tensor:
    """Bring all singular values of a matrix near 1 and keep its singular vectors, by Newton-Schulz iteration.

    Parameters
    ----------
    matrix
        Shape (rows, columns); a matrix of zeros stays as it is.

    Returns
    -------
    Tensor
        Same shape; singular values 0.7 to 1.2, except those that were below about 1/1000 of the matrix's norm.
    """
    a, b, c = _NEWTON_SCHULZ
    tall = matrix.shape[0] > matrix.shape[1]
    x = matrix.T if tall else matrix
    x = x / (x.norm() + 1e-7)
    for _ in range(_STEPS):
        square = x @ x.T
        x = torch.addmm(x, torch.addmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return x.T if tall else x
