"""Muon: steps along a momentum whose directions all weigh the same, for matrices and the kernels of convolutions."""

from collections.abc import Iterable

import torch
from torch import Tensor

#: Share of the past in the average of the gradients, with Nesterov's look ahead.
MOMENTUM = 0.95

_NEWTON_SCHULZ = (3.4445, -4.7750, 2.0315)  # Jordan's: not exact, singular values end between 0.7 and 1.2
_STEPS = 5


class Muon(torch.optim.Optimizer):
    """Momentum, orthogonalised (K. Jordan, kellerjordan.github.io/posts/muon, 2024), with decoupled weight decay.

    A gradient of a layer is dominated by few directions; made orthogonal, the rare ones are learnt as fast. torch's own
    takes matrices alone and computes in bfloat16; here a kernel is the matrix of its outputs, in the precision it has.

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
    """Bring all singular values of a matrix near 1, its singular vectors kept: Newton and Schulz, no decomposition.

    Parameters
    ----------
    matrix
        Shape (rows, columns). Of rank 0, what is returned is 0.

    Returns
    -------
    Tensor
        Same shape; singular values 0.7 to 1.2, but for those below about 1/1000 of the whole.
    """
    a, b, c = _NEWTON_SCHULZ
    tall = matrix.shape[0] > matrix.shape[1]
    x = matrix.T if tall else matrix
    x = x / (x.norm() + 1e-7)
    for _ in range(_STEPS):
        square = x @ x.T
        x = torch.addmm(x, torch.addmm(square, square, square, beta=b, alpha=c), x, beta=a)
    return x.T if tall else x
