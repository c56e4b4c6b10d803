"""Two models of a vector of measurements: logistic regression and boosted trees."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from bladewing.features.one_thread import one_thread
from numpy.typing import NDArray

from ._checks import require_every_class, require_labels, require_vectors

if TYPE_CHECKING:
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.pipeline import Pipeline

Progress = Callable[[int, int], None]
"""Called with the steps done and the steps at most."""

LEARNING_RATE = 0.15
"""Share of each tree that is added."""

_ITERATIONS_A_CALL = 10


def train_linear(
    x: NDArray[np.float32], y: NDArray[np.integer], *, seed: int, progress: Progress | None = None
) -> "Pipeline":
    """Fit standardisation and multinomial logistic regression.

    Parameters
    ----------
    x
        Measurements, float32, shape (n, F), finite; units are free, each column is standardised.
    y
        Labels, shape (n,), whole numbers 0 to 2, at least two records of each.
    seed
        Every trainer takes one; this fit is convex and draws nothing.
    progress
        Called once before and once after the fit.

    Returns
    -------
    sklearn.pipeline.Pipeline
        Fitted; its scores come from `tabular_scores`.

    Raises
    ------
    ValueError
        Where an array has the wrong shape, type or values, or a class is missing.
    """
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    _require_training_set(x, y)
    if progress:
        progress(0, 1)
    # its products are so small that threads wait for one another longer than they compute: on two processors a third of
    # the time alone, a twentieth beside other work; and the model is the same to the bit whatever their number
    with one_thread:
        model = make_pipeline(StandardScaler(), LogisticRegression(max_iter=2000, random_state=seed)).fit(x, y)
    if progress:
        progress(1, 1)
    return model


def train_boosted(
    x: NDArray[np.float32],
    y: NDArray[np.integer],
    *,
    seed: int,
    iterations: int = 80,
    leaves: int = 15,
    progress: Progress | None = None,
) -> "HistGradientBoostingClassifier":
    """Fit gradient-boosted trees; a tenth of the records, drawn by the seed, tells when to stop.

    Parameters
    ----------
    x
        Measurements, float32, shape (n, F), finite. float32 on purpose: the exported trees compare in float32.
    y
        Labels, shape (n,), whole numbers 0 to 2, at least two records of each.
    seed
        Draws the records that are held back.
    iterations
        Trees a class at most, at least 1. With `leaves` it sets the size of the exported model:
        about 3 * iterations * (2 * leaves - 1) * 32 bytes.
    leaves
        Leaves a tree at most, at least 2.
    progress
        Called with the iterations done and the iterations at most.

    Returns
    -------
    sklearn.ensemble.HistGradientBoostingClassifier
        Fitted; its scores come from `tabular_scores`.

    Raises
    ------
    ValueError
        Where an array has the wrong shape, type or values, or a class is missing.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier

    _require_training_set(x, y)
    model = HistGradientBoostingClassifier(
        max_leaf_nodes=leaves,
        learning_rate=LEARNING_RATE,
        l2_regularization=1.0,
        early_stopping=True,
        validation_fraction=0.1,
        n_iter_no_change=10,
        random_state=seed,
        warm_start=True,
    )
    done = 0
    while done < iterations:
        target = min(done + _ITERATIONS_A_CALL, iterations)
        model.set_params(max_iter=target).fit(x, y)
        done = model.n_iter_
        if progress:
            progress(done, iterations)
        if done < target:
            break
    _round_thresholds(model)
    return model


def tabular_scores(model: "Pipeline | HistGradientBoostingClassifier", x: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the raw scores of a fitted model, before any calibration.

    Parameters
    ----------
    model
        From `train_linear` or `train_boosted`.
    x
        Measurements, float32, shape (n, F), finite.

    Returns
    -------
    ndarray
        Shape (n, 3), in the order uav, bird, clutter; their softmax is the model's own probability.

    Raises
    ------
    ValueError
        Where `x` has the wrong shape, type or values.
    """
    require_vectors(x)
    return np.asarray(model.decision_function(x), dtype=np.float64)


def _round_thresholds(model: "HistGradientBoostingClassifier") -> None:
    """Round every threshold down to float32, so that the exported trees, which hold float32, route every record alike.

    No answer changes: a float32 x is at most t exactly where it is at most the greatest float32 not above t.
    """
    for trees in model._predictors:
        for tree in trees:
            exact = tree.nodes["num_threshold"]
            near = exact.astype(np.float32)
            tree.nodes["num_threshold"] = np.where(near > exact, np.nextafter(near, np.float32(-np.inf)), near)


def _require_training_set(x: NDArray[np.float32], y: NDArray[np.integer]) -> None:
    require_vectors(x)
    require_labels(y, len(x), "y")
    require_every_class(y, "y")
