"""Accuracy against cost: which models no other beats, and what a time budget buys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..ladder import non_dominated

BUDGETS_US = (100.0, 300.0, 1000.0, 3000.0)


def weigh_up(scores: Mapping[str, Mapping[str, Any]], cost: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Set each model's balanced accuracy against what its whole chain costs.

    Parameters
    ----------
    scores : mapping
        Name to the model's scores, as made by `scores.score`.
    cost : sequence
        As made by `cost.time_chain`.

    Returns
    -------
    list of dict
        One a batch size: ``batch``, ``points`` (``{"model", "cost_us", "balanced_accuracy", "front"}``, cheapest
        first; ``front``: no other model beats it) and ``budgets`` (``{"budget_us", "model", "cost_us",
        "balanced_accuracy", "cheapest"}``: the most accurate model whose median cost keeps to the budget, None if none
        does, and the name of the cheapest model).
    """
    weighed = []
    for part in cost:
        chain = {stage["name"]: stage["median_us"] for stage in part["stages"] if stage["stage"] == "chain"}
        names = sorted((name for name in chain if scores[name]["accuracy"]["count"]), key=lambda name: chain[name])
        accuracy = {name: scores[name]["balanced_accuracy"]["value"] for name in names}
        front = non_dominated([chain[name] for name in names], [accuracy[name] for name in names])
        points = [
            {"model": name, "cost_us": chain[name], "balanced_accuracy": accuracy[name], "front": kept}
            for name, kept in zip(names, front, strict=True)
        ]
        budgets = [_best_within(points, budget_us) for budget_us in BUDGETS_US]
        weighed.append({"batch": part["batch"], "points": points, "budgets": budgets})
    return weighed


def _best_within(points: Sequence[Mapping[str, Any]], budget_us: float) -> dict[str, Any]:
    """Give the most accurate point that costs no more than the budget; of equally accurate ones the cheapest."""
    affordable = [point for point in points if point["cost_us"] <= budget_us]
    if not affordable:
        cheapest = points[0]["model"] if points else None
        nothing = {"model": None, "cost_us": None, "balanced_accuracy": None}
        return {"budget_us": budget_us, **nothing, "cheapest": cheapest}
    best = max(affordable, key=lambda point: point["balanced_accuracy"])
    chosen = {key: best[key] for key in ("model", "cost_us", "balanced_accuracy")}
    return {"budget_us": budget_us, **chosen, "cheapest": points[0]["model"]}
