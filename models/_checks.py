"""Checks of the arrays that training functions take; each check that fails raises one clear line."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CLASS_COUNT = 3
"""Number of classes: uav, bird, clutter."""


def require_finite(values: NDArray[np.floating], name: str) -> None:
    """Refuse NaN and infinity.

    Parameters
    ----------
    values
        Array of any shape.
    name
        What the array is called in the message.

    Raises
    ------
    ValueError
        Where a value is NaN or infinite; names the index of the first.
    """
    bad = ~np.isfinite(values)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ValueError(
            f"{name}{list(index)} is {values[index]}; every value must be finite: drop or repair the record"
        )


def require_vectors(x: NDArray[np.floating]) -> None:
    """Refuse everything but finite float32 vectors.

    Parameters
    ----------
    x
        Array that should have the shape (n, F) with n and F at least 1.

    Raises
    ------
    ValueError
        Where the shape, the type or a value is wrong.
    """
    if x.ndim != 2 or 0 in x.shape:
        raise ValueError(f"x has shape {x.shape}; it must be (records, features), neither of them 0")
    if x.dtype != np.float32:
        raise ValueError(f"x is {x.dtype}; it must be float32, as in the exported model: use astype(numpy.float32)")
    require_finite(x, "x")


def require_labels(y: NDArray[np.integer], count: int, name: str) -> None:
    """Refuse labels that are not one class index a record.

    Parameters
    ----------
    y
        Array that should have the shape (n,), whole numbers 0 to 2.
    count
        Number of records n.
    name
        What the array is called in the message.

    Raises
    ------
    ValueError
        Where the shape, the type or a value is wrong.
    """
    if y.shape != (count,):
        raise ValueError(f"{name} has shape {y.shape}; it must be ({count},), one label a record")
    if not np.issubdtype(y.dtype, np.integer):
        raise ValueError(f"{name} is {y.dtype}; labels must be integers: 0 uav, 1 bird, 2 clutter")
    if count and (y.min() < 0 or y.max() >= CLASS_COUNT):
        wrong = y[(y < 0) | (y >= CLASS_COUNT)][0]
        raise ValueError(f"{name} holds the label {wrong}; labels must be 0 (uav), 1 (bird) or 2 (clutter)")


def require_kinds(kinds: NDArray[np.integer], y: NDArray[np.integer], class_of: Sequence[int]) -> None:
    """Refuse kinds that are not one for each record, or not of the record's class.

    Parameters
    ----------
    kinds
        Array that should have the shape of `y`, each an index into `class_of`.
    y
        Labels, shape (n,), whole numbers 0 to 2.
    class_of
        Class of each kind.

    Raises
    ------
    ValueError
        Where the shape, the type or a value is wrong.
    """
    if kinds.shape != y.shape or not np.issubdtype(kinds.dtype, np.integer):
        raise ValueError(f"kinds is {kinds.dtype} of shape {kinds.shape}; it must be whole numbers of shape {y.shape}")
    outside = (kinds < 0) | (kinds >= len(class_of))
    if outside.any():
        raise ValueError(f"kinds holds {kinds[outside][0]}; each must be 0 to {len(class_of) - 1}")
    other = np.flatnonzero(np.asarray(class_of)[kinds] != y)
    if len(other):
        raise ValueError(f"kinds[{other[0]}] is {kinds[other[0]]}; it must be of the class of its label, {y[other[0]]}")


def require_every_class(y: NDArray[np.integer], name: str) -> None:
    """Refuse a training set that lacks a class.

    Parameters
    ----------
    y
        Labels, shape (n,), whole numbers 0 to 2.
    name
        What the array is called in the message.

    Raises
    ------
    ValueError
        Where a class has fewer than two records.
    """
    counts = np.bincount(y, minlength=CLASS_COUNT)
    if counts.min() < 2:
        raise ValueError(f"{name} has {counts.tolist()} records of uav, bird, clutter; each needs 2: give more records")


def require_shares(values: NDArray[np.floating], count: int, kinds: int, name: str) -> None:
    """Refuse probabilities that are not one for each record and kind, or whose rows do not sum to 1.

    Parameters
    ----------
    values
        Array that should have the shape (n, kinds), each row summing to 1.
    count, kinds
        Number of records n, and of kinds.
    name
        What the array is called in the message.

    Raises
    ------
    ValueError
        Where the shape or a value is wrong.
    """
    if values.shape != (count, kinds):
        raise ValueError(f"{name} has shape {values.shape}; it must be ({count}, {kinds}), one row a record")
    require_finite(values, name)
    off = np.flatnonzero((values < 0).any(axis=1) | (np.abs(values.sum(axis=1) - 1) > 1e-3))
    if len(off):
        raise ValueError(f"{name}[{off[0]}] is {values[off[0]].tolist()}; each row must be shares of 1")
