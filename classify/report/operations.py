"""Counting floating-point operations: transforms are counted while they run, networks from their graphs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

#: Names of the transforms that are counted: complex ones, and real ones that cost half as much for the same length.
_COMPLEX, _REAL = ("fft", "ifft"), ("rfft", "irfft", "hfft", "ihfft", "dct", "idct")


class Counter:
    """Number of operations counted until now."""

    total = 0.0


@contextmanager
def counted_transforms() -> Iterator[Counter]:
    """Count the operations of transforms: 5 N log2 N for a complex one of length N, half of this for a real one.

    The count is of transforms that really ran within the ``with`` block: SciPy's and NumPy's functions are wrapped.

    Yields
    ------
    Counter
        Its ``total`` grows with every transform.
    """
    import numpy.fft
    import scipy.fft

    counter = Counter()

    def watched(transform: Callable[..., Any], share: float, inverse: bool) -> Callable[..., Any]:
        def count(x: Any, n: int | None = None, axis: int = -1, **others: Any) -> Any:
            found = transform(x, n=n, axis=axis, **others)
            length = n or (found if inverse else np.asarray(x)).shape[axis]
            rows = np.asarray(x).size / np.asarray(x).shape[axis]
            counter.total += rows * share * 5.0 * length * math.log2(max(length, 2))
            return found

        return count

    with ExitStack() as stack:
        for library in (scipy.fft, numpy.fft):
            for names, share in ((_COMPLEX, 1.0), (_REAL, 0.5)):
                for name in names:
                    if hasattr(library, name):
                        wrapped = watched(getattr(library, name), share, name in ("irfft", "hfft"))
                        stack.enter_context(patch.object(library, name, wrapped))
        yield counter


def network_operations(onnx_bytes: bytes) -> float:
    """Count the operations of one record through a graph: two per multiply-add, one per comparison in a tree.

    Convolutions, matrix products, linear classifiers and tree ensembles are counted; element-wise operations are not.

    Parameters
    ----------
    onnx_bytes : bytes
        An ONNX model whose only free axis is the batch.

    Returns
    -------
    float
    """
    import onnx

    model = onnx.shape_inference.infer_shapes(onnx.load_model_from_string(onnx_bytes))
    graph = model.graph
    weights = {one.name: tuple(one.dims) for one in graph.initializer}
    shapes = dict(weights)
    for value in (*graph.input, *graph.value_info, *graph.output):
        shapes[value.name] = tuple(dim.dim_value or 1 for dim in value.type.tensor_type.shape.dim)
    total = 0.0
    for node in graph.node:
        if node.op_type in ("Conv", "ConvInteger", "QLinearConv"):
            kernel = shapes[node.input[3 if node.op_type == "QLinearConv" else 1]]
            total += 2.0 * math.prod(shapes[node.output[0]]) * math.prod(kernel[1:])
        elif node.op_type in ("Gemm", "MatMul", "MatMulInteger", "QLinearMatMul"):
            operand = shapes[node.input[3 if node.op_type == "QLinearMatMul" else 1]]
            total += 2.0 * math.prod(operand)
        elif node.op_type.startswith("TreeEnsemble"):
            total += _comparisons(node)
        elif node.op_type == "LinearClassifier":
            total += 2.0 * len(_attribute(node, "coefficients"))
    return total


def _attribute(node: Any, name: str) -> list[Any]:
    import onnx

    return next((onnx.helper.get_attribute_value(one) for one in node.attribute if one.name == name), [])


def _comparisons(node: Any) -> float:
    """Sum over all trees the mean depth of the tree's leaves plus one addition."""
    trees, ids = _attribute(node, "nodes_treeids"), _attribute(node, "nodes_nodeids")
    low, high = _attribute(node, "nodes_truenodeids"), _attribute(node, "nodes_falsenodeids")
    modes = [bytes(mode) for mode in _attribute(node, "nodes_modes")]
    depth: dict[tuple[int, int], int] = {}
    leaves: dict[int, list[int]] = {}
    for tree, place, left, right, mode in sorted(zip(trees, ids, low, high, modes, strict=True)):
        here = depth.setdefault((tree, place), 0)
        if mode == b"LEAF":
            leaves.setdefault(tree, []).append(here)
        else:
            depth[tree, left] = depth[tree, right] = here + 1
    return float(sum(np.mean(found) + 1 for found in leaves.values()))
