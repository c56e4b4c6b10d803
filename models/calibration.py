"""Calibrated probabilities from scores, and the thresholds below which the answer is "unknown".

Vector scaling: probabilities = softmax(scale * scores + bias), with one scale and one bias a class, fitted on records
that the model did not train on. Temperature scaling (Guo et al. 2017), scale = 1 / temperature, is the case without
biases.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import CLASS_COUNT, require_finite, require_labels

# Standard deviations of the Gaussian priors on the logarithm of the scale and on the biases. The priors keep a fit on
# few or separable records bounded; a thousand records outweigh them. The prior of the scale is centred where the scaled
# scores have a standard deviation of 1, so that the units of the scores do not matter.
_LOG_SCALE_SIGMA = np.log(10.0)
_BIAS_SIGMA = 1.0

NEVER = 1.01
"""Acceptance threshold that no probability reaches: the class cannot keep the promised precision."""


def softmax(scores: ArrayLike) -> NDArray[np.float64]:
    """Turn scores into probabilities along the last axis.

    Parameters
    ----------
    scores
        Shape (..., K), any finite values.

    Returns
    -------
    ndarray
        Shape (..., K), each vector sums to 1.
    """
    scores = np.asarray(scores, dtype=np.float64)
    with np.errstate(over="ignore", under="ignore"):  # a score that far below the largest gets 0
        powers = np.exp(scores - scores.max(axis=-1, keepdims=True))
    return powers / powers.sum(axis=-1, keepdims=True)


@dataclass(frozen=True)
class Calibration:
    """How a model's scores become probabilities.

    Parameters
    ----------
    scale
        Factor on every score, positive; 1 / temperature.
    bias
        Added to the scaled scores, one a class in the order uav, bird, clutter.

    Raises
    ------
    ValueError
        Where the scale is not positive and finite, or there are not three finite biases.
    """

    scale: float = 1.0
    bias: tuple[float, ...] = (0.0,) * CLASS_COUNT

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"scale is {self.scale}; it must be positive and finite")
        if len(self.bias) != CLASS_COUNT or not np.isfinite(self.bias).all():
            raise ValueError(f"bias is {self.bias}; it must be {CLASS_COUNT} finite numbers, one a class")

    def probabilities(self, scores: ArrayLike) -> NDArray[np.float64]:
        """Return the calibrated probabilities.

        Parameters
        ----------
        scores
            Raw scores of the model, shape (..., 3).

        Returns
        -------
        ndarray
            Shape (..., 3), each vector sums to 1.
        """
        return softmax(self.scale * np.asarray(scores, dtype=np.float64) + np.asarray(self.bias))


def fit_vector_scaling(scores: NDArray[np.floating], labels: NDArray[np.integer]) -> Calibration:
    """Fit one scale and a bias for each class by maximum likelihood, with weak priors on the scale and the biases.

    Parameters
    ----------
    scores
        Raw scores on records that the model did not train on, shape (n, 3).
    labels
        Shape (n,), whole numbers 0 to 2.

    Returns
    -------
    Calibration
        Its biases sum to 0.

    Raises
    ------
    ValueError
        Where shapes disagree, there is no record, or a score is not finite.
    """
    from scipy.optimize import minimize

    _require_table(scores, labels, "scores")
    scores = np.asarray(scores, dtype=np.float64)
    count = len(scores)
    truth = np.eye(CLASS_COUNT)[labels]
    spread = (scores - scores.mean(axis=1, keepdims=True)).std()
    centre = -np.log(max(float(spread), 1e-6))

    def loss(parameters: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Penalised mean negative log likelihood, and its gradient."""
        log_scale, bias = parameters[0], parameters[1:]
        pull = (log_scale - centre) / _LOG_SCALE_SIGMA
        logits = np.exp(log_scale) * scores + bias
        top = logits.max(axis=1, keepdims=True)
        log_sum = top + np.log(np.exp(logits - top).sum(axis=1, keepdims=True))
        value = (log_sum[:, 0] - (logits * truth).sum(axis=1)).mean()
        slope = (np.exp(logits - log_sum) - truth) / count
        value += (pull**2 + ((bias / _BIAS_SIGMA) ** 2).sum()) / (2 * count)
        by_scale = np.exp(log_scale) * (slope * scores).sum() + pull / _LOG_SCALE_SIGMA / count
        by_bias = slope.sum(axis=0) + bias / _BIAS_SIGMA**2 / count
        return value, np.concatenate([[by_scale], by_bias])

    start = np.array([centre] + [0.0] * CLASS_COUNT)
    bounds = [(value - 10, value + 10) for value in start]
    best = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12, "gtol": 1e-8}).x
    bias = best[1:] - best[1:].mean()
    return Calibration(scale=float(np.exp(best[0])), bias=tuple(float(b) for b in bias))


def expected_calibration_error(
    probabilities: ArrayLike, labels: NDArray[np.integer], bins: int = 15, weights: ArrayLike = 1.0
) -> float:
    """Return the mean gap between the winning probability and how often the winner is right.

    Parameters
    ----------
    probabilities
        Shape (n, 3).
    labels
        Shape (n,), whole numbers 0 to 2.
    bins
        Number of equal bins of the winning probability over 0 to 1, at least 1.
    weights
        What each record counts, shape (n,), at least 0, not all 0; alike by default.

    Returns
    -------
    float
        Gap weighted by the records in each bin, 0 to 1. Never quite 0 on a sample: up to about
        0.4 sqrt(bins / n) for perfectly calibrated probabilities.

    Raises
    ------
    ValueError
        Where shapes disagree, there is no record, or `bins` is below 1.
    """
    table = _require_table(probabilities, labels, "probabilities")
    if bins < 1:
        raise ValueError(f"bins is {bins}; it must be at least 1")
    winner = table.max(axis=1)
    right = table.argmax(axis=1) == labels
    place = np.clip(np.ceil(winner * bins).astype(int) - 1, 0, bins - 1)
    share = np.broadcast_to(np.asarray(weights, np.float64), len(table))
    gaps = np.bincount(place, weights=share * (winner - right), minlength=bins)
    return float(np.abs(gaps).sum() / share.sum())


def acceptance_thresholds(
    probabilities: ArrayLike, labels: NDArray[np.integer], precision: float = 0.9, support: int = 10
) -> NDArray[np.float64]:
    """Return, for each class, the least winning probability at and above which its answers keep a precision.

    Parameters
    ----------
    probabilities
        Calibrated, of records that the model did not train on, shape (n, 3).
    labels
        Shape (n,), whole numbers 0 to 2.
    precision
        Share of accepted answers that must be right, above 0 and at most 1.
    support
        Fewest accepted answers that a threshold may rest on, at least 1: fewer may keep the precision by chance.

    Returns
    -------
    ndarray
        Shape (3,). Of the records that class c wins with at least threshold c, at least `precision` are right.
        1/3 (every answer) where that holds of all of them; `NEVER` where it holds at no threshold.

    Raises
    ------
    ValueError
        Where shapes disagree, there is no record, or `precision` or `support` is out of range.
    """
    table = _require_table(probabilities, labels, "probabilities")
    if not 0 < precision <= 1:
        raise ValueError(f"precision is {precision}; it must be above 0 and at most 1")
    if support < 1:
        raise ValueError(f"support is {support}; it must be at least 1")
    thresholds = np.full(CLASS_COUNT, NEVER)
    for index in range(CLASS_COUNT):
        won = table.argmax(axis=1) == index
        order = np.argsort(-table[won, index], kind="stable")
        winner = table[won, index][order]
        right = np.cumsum((labels[won] == index)[order])
        accepted = np.arange(1, len(winner) + 1)
        last_of_ties = np.append(winner[1:] != winner[:-1], True)[: len(winner)]
        kept = np.flatnonzero((right / accepted >= precision) & last_of_ties & (accepted >= support))
        if kept.size:
            thresholds[index] = 1 / CLASS_COUNT if kept[-1] == len(winner) - 1 else winner[kept[-1]]
    return thresholds


def conformal_thresholds(probabilities: ArrayLike, labels: NDArray[np.integer], coverage: float) -> NDArray[np.float64]:
    """Return, for each class, the least probability at which a prediction set holds it.

    Class-conditional conformal prediction: with n records of a class, the threshold is the k-th smallest probability
    that they gave to it, k = floor((1 - coverage) (n + 1)). The rank of a new record of that class among them is
    uniform, so its set misses the class with probability at most k / (n + 1).

    Parameters
    ----------
    probabilities
        Of records that the model did not train on, shape (n, 3).
    labels
        Shape (n,), whole numbers 0 to 2.
    coverage
        Least share of each class's records whose set holds that class, above 0 and below 1.

    Returns
    -------
    ndarray
        Shape (3,): the set of a record holds class c where its probability is at least threshold c. 0 (every set holds
        the class) where there are too few records of the class for any higher threshold.

    Raises
    ------
    ValueError
        Where shapes disagree, there is no record, or `coverage` is out of range.

    References
    ----------
    Vovk, "Conditional validity of inductive conformal predictors", Machine Learning 92 (2013): one quantile a class.
    """
    table = _require_table(probabilities, labels, "probabilities")
    if not 0 < coverage < 1:
        raise ValueError(f"coverage is {coverage}; it must be above 0 and below 1")
    thresholds = np.zeros(CLASS_COUNT)
    for index in range(CLASS_COUNT):
        truth = np.sort(table[labels == index, index])
        rank = min(int((1 - coverage) * (len(truth) + 1) * (1 + 1e-9)), len(truth))
        if rank:
            thresholds[index] = truth[rank - 1]
    return thresholds


def _require_table(table: ArrayLike, labels: NDArray[np.integer], name: str) -> NDArray[np.float64]:
    table = np.asarray(table, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] != CLASS_COUNT or not len(table):
        raise ValueError(f"{name} has shape {table.shape}; it must be (n, {CLASS_COUNT}) with n at least 1")
    require_finite(table, name)
    require_labels(labels, len(table), "labels")
    return table
