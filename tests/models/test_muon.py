"""Muon's steps weigh all directions of a layer alike."""

import numpy as np
import pytest
import torch
from bladewing.models.muon import Muon, orthogonal


@pytest.mark.parametrize("shape", [(4, 4), (3, 40), (40, 3), (48, 120), (1, 7), (5, 1)])
@pytest.mark.parametrize("spread", [1.0, 100.0])
@pytest.mark.parametrize("gain", [1e-6, 1.0, 1e6])
def test_singular_values_come_near_one_and_the_vectors_stay(shape, spread, gain):
    rng = np.random.default_rng(0)
    left, _, right = np.linalg.svd(rng.normal(size=shape), full_matrices=False)
    values = np.geomspace(1, 1 / spread, min(shape))
    found = orthogonal(torch.from_numpy(gain * (left * values) @ right)).numpy()
    inside = left.T @ found @ right.T  # in the basis of the singular vectors: diagonal
    diagonal = np.diag(inside)
    assert diagonal.min() > 0.65
    assert diagonal.max() < 1.25
    np.testing.assert_allclose(inside - np.diag(diagonal), 0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found), np.linalg.norm(diagonal), rtol=1e-9)


def test_nothing_to_follow_is_no_step():
    assert torch.equal(orthogonal(torch.zeros(3, 5)), torch.zeros(3, 5))


def test_a_kernel_moves_as_the_matrix_of_its_outputs_does():
    rng = torch.Generator().manual_seed(0)
    start, gradient = torch.randn(6, 2, 1, 5, generator=rng), torch.randn(6, 2, 1, 5, generator=rng)
    ends = []
    for shape in ((6, 2, 1, 5), (6, 10)):
        weights = torch.nn.Parameter(start.reshape(shape).clone())
        weights.grad = gradient.reshape(shape)
        Muon([weights], lr=0.1, weight_decay=0.5).step()
        ends.append(weights.detach().flatten())
    torch.testing.assert_close(ends[0], ends[1])


def test_weights_decay_by_rate_times_decay_and_a_tall_layer_moves_farther():
    for outputs, inputs, farther in ((8, 2, 2.0), (2, 8, 1.0)):
        weights = torch.nn.Parameter(torch.full((outputs, inputs), 10.0))
        weights.grad = torch.randn(outputs, inputs, generator=torch.Generator().manual_seed(1))
        Muon([weights], lr=0.1, weight_decay=0.5).step()
        moved = (weights.detach() - 9.5).numpy()
        np.testing.assert_allclose(np.linalg.svd(moved)[1], 0.1 * farther, rtol=0.35)


def test_it_finds_a_rare_direction_that_a_plain_step_is_slow_to_find():
    scale = torch.tensor([1.0, 0.1, 0.01])
    truth = torch.eye(3)
    left = {}
    for make in (lambda p: Muon([p], lr=0.1), lambda p: torch.optim.SGD([p], lr=0.5, momentum=0.9)):
        weights = torch.nn.Parameter(torch.zeros(3, 3))
        optimiser = make(weights)
        for _ in range(200):
            optimiser.param_groups[0]["lr"] *= 0.98
            optimiser.zero_grad()
            (((weights - truth) * scale) ** 2).sum().backward()
            optimiser.step()
        left[type(optimiser).__name__] = float((weights.detach() - truth).abs().max())
    assert left["Muon"] < 0.1
    assert left["SGD"] > 0.5
