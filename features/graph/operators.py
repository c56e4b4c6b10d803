"""ONNX operators written like arithmetic: values with +, <, & and reductions along the last axis."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from onnx import NodeProto, TensorProto, helper, numpy_helper

Operand: TypeAlias = "Value | float | NDArray[Any]"


class Value:
    """A tensor of a graph that is being built; operators give new ones.

    A number or an array beside it becomes a constant of its type.

    Parameters
    ----------
    graph : Graph
        Where it stands.
    name : str
        Its name there.
    dtype : dtype
        Its element type.
    """

    # an array on the left must leave the arithmetic to this class
    __array_ufunc__ = None

    def __init__(self, graph: "Graph", name: str, dtype: DTypeLike) -> None:
        self.graph, self.name, self.dtype = graph, name, np.dtype(dtype)

    def on(self, graph: "Graph") -> "Value":
        """The same tensor for a graph that follows this one."""
        return Value(graph, self.name, self.dtype)

    def __add__(self, other: Operand) -> "Value":
        return self.graph.op("Add", self, other)

    def __radd__(self, other: Operand) -> "Value":
        return self.graph.op("Add", other, self)

    def __sub__(self, other: Operand) -> "Value":
        return self.graph.op("Sub", self, other)

    def __rsub__(self, other: Operand) -> "Value":
        return self.graph.op("Sub", other, self)

    def __mul__(self, other: Operand) -> "Value":
        return self.graph.op("Mul", self, other)

    def __rmul__(self, other: Operand) -> "Value":
        return self.graph.op("Mul", other, self)

    def __truediv__(self, other: Operand) -> "Value":
        return self.graph.op("Div", self, other)

    def __rtruediv__(self, other: Operand) -> "Value":
        return self.graph.op("Div", other, self)

    def __neg__(self) -> "Value":
        return self.graph.op("Neg", self)

    def __gt__(self, other: "Value | float") -> "Value":
        return self.graph.op("Greater", self, other, dtype=bool)

    def __ge__(self, other: "Value | float") -> "Value":
        return self.graph.op("GreaterOrEqual", self, other, dtype=bool)

    def __lt__(self, other: "Value | float") -> "Value":
        return self.graph.op("Less", self, other, dtype=bool)

    def __le__(self, other: "Value | float") -> "Value":
        return self.graph.op("LessOrEqual", self, other, dtype=bool)

    def __and__(self, other: Operand) -> "Value":
        return self.graph.op("And", self, other)

    def __or__(self, other: Operand) -> "Value":
        return self.graph.op("Or", self, other)

    def apply(self, operator: str) -> "Value":
        """One of the operators of one operand: "Abs", "Log", "Sqrt", "Round" (half to even), "Floor"."""
        return self.graph.op(operator, self)

    def at_least(self, other: Operand) -> "Value":
        """The larger of both."""
        return self.graph.op("Max", self, other)

    def at_most(self, other: Operand) -> "Value":
        """The smaller of both."""
        return self.graph.op("Min", self, other)

    def to(self, dtype: DTypeLike) -> "Value":
        """The same values as another type."""
        target = helper.np_dtype_to_tensor_dtype(np.dtype(dtype))
        return self if self.dtype == np.dtype(dtype) else self.graph.op("Cast", self, dtype=dtype, to=target)

    def _reduce(self, operator: str, axis: int, keep: bool) -> "Value":
        return self.graph.op(operator, self, np.array([axis]), dtype=self.dtype, keepdims=int(keep))

    def sum(self, axis: int = -1, *, keep: bool = True) -> "Value":
        """Sum along an axis, which stays with length 1."""
        return self._reduce("ReduceSum", axis, keep)

    def mean(self, axis: int = -1) -> "Value":
        """Mean along an axis, which stays with length 1."""
        return self._reduce("ReduceMean", axis, True)

    def max(self, axis: int = -1, *, keep: bool = True) -> "Value":
        """Largest along an axis, which stays with length 1."""
        return self._reduce("ReduceMax", axis, keep)

    def min(self) -> "Value":
        """Smallest along the last axis, which stays with length 1."""
        return self._reduce("ReduceMin", -1, True)

    def count(self) -> "Value":
        """Number of true values along the last axis, as float32, exact up to 2**24."""
        return self.to(np.float32).sum()

    def argmax(self) -> "Value":
        """Index of the first largest along the last axis, shape (..., 1), int64."""
        return self.graph.op("ArgMax", self, dtype=np.int64, axis=-1, keepdims=1)

    def cumsum(self) -> "Value":
        """Running sum along the last axis in float64."""
        return self.graph.op("CumSum", self.to(np.float64), np.array(-1))

    def ranked(self, rank: int, count: int = 1) -> "Value":
        """The values of `count` ranks of the last axis from `rank` on (0 the smallest), highest first, (..., count)."""
        lowest = self.graph.op("TopK", self, np.array([rank + count]), outputs=2, largest=0, sorted=0)
        return self.graph.op("TopK", lowest, np.array([count]), outputs=2)

    def std(self) -> "Value":
        """Standard deviation along the last axis."""
        away = self - self.mean()
        return (away * away).mean().apply("Sqrt")

    def slice(self, start: int, stop: int, axis: int = -1) -> "Value":
        """The elements start to stop - 1 of an axis."""
        return self.graph.op("Slice", self, *(np.array([number]) for number in (start, stop, axis)), dtype=self.dtype)

    def take(self, index: NDArray[np.integer], axis: int = -1) -> "Value":
        """Elements at fixed places of an axis, which is replaced by the axes of the index."""
        return self.graph.op("Gather", self, index.astype(np.int64), dtype=self.dtype, axis=axis)

    def pick(self, index: "Value") -> "Value":
        """Elements of the last axis at each record's own places; the shapes agree but for the last axis."""
        return self.graph.op("GatherElements", self, index.to(np.int64), dtype=self.dtype, axis=-1)

    def take_rows(self, index: "Value") -> "Value":
        """Elements of a table of one axis at each record's places, in the shape of the places."""
        return self.graph.op("Gather", self, index, axis=0)

    def squeeze(self) -> "Value":
        """Without the last axis, which has length 1."""
        return self.graph.op("Squeeze", self, np.array([-1]))

    def reshape(self, *shape: int) -> "Value":
        """The same elements in another shape; 0 keeps a length, -1 takes what is left."""
        return self.graph.op("Reshape", self, np.array(shape), dtype=self.dtype)

    def transpose(self, *axes: int) -> "Value":
        """The axes in another order."""
        return self.graph.op("Transpose", self, perm=list(axes))

    def pad(self, before: int, after: int, value: float = 0.0) -> "Value":
        """A value before and after the last axis."""
        if not before and not after:
            return self
        operands = np.array([before, after]), np.array(value, self.dtype), np.array([-1])
        return self.graph.op("Pad", self, *operands, dtype=self.dtype)


def needed(nodes: Sequence[NodeProto], outputs: Iterable[str]) -> list[NodeProto]:
    """The nodes, in their order, that the named outputs depend on: a runtime would compute the others as well."""
    wanted, kept = set(outputs), []
    for node in reversed(nodes):
        if wanted.intersection(node.output):
            wanted.update(node.input)
            kept.append(node)
    return kept[::-1]


class Graph:
    """Nodes and constants in the order in which they are needed.

    Parameters
    ----------
    prefix : str
        Beginning of every name, so that graphs can be joined.
    """

    def __init__(self, prefix: str = "iq") -> None:
        self.prefix = prefix
        self.nodes: list[NodeProto] = []
        self.initializers: list[TensorProto] = []
        self._constants: dict[tuple[Any, ...], str] = {}

    def constant(self, values: ArrayLike, dtype: DTypeLike | None = None) -> Value:
        """A fixed tensor; equal ones are stored once."""
        array = np.ascontiguousarray(values, dtype).reshape(np.shape(values))
        key = array.dtype.str, array.shape, array.tobytes()
        if key not in self._constants:
            self._constants[key] = name = f"{self.prefix}_constant_{len(self._constants)}"
            self.initializers.append(numpy_helper.from_array(array, name))
        return Value(self, self._constants[key], array.dtype)

    def op(
        self, operator: str, *operands: Operand, dtype: DTypeLike | None = None, outputs: int = 1, **attributes: Any
    ) -> Value:
        """Append an operator and give its first output.

        Parameters
        ----------
        operator : str
            Name in the ONNX standard.
        operands : Value, float or ndarray
            Integer arrays stay what they are (axes, places); numbers and other arrays take the type of the first value.
        dtype : dtype, optional
            Type of the output; by default that of the first value among the operands.
        outputs : int
            How many the operator has.
        attributes
            Of the operator.

        Returns
        -------
        Value
        """
        first = next(operand for operand in operands if isinstance(operand, Value))
        names = [self._operand(operand, first.dtype).name for operand in operands]
        made = [f"{self.prefix}_{len(self.nodes)}_{number}" for number in range(outputs)]
        self.nodes.append(helper.make_node(operator, names, made, **attributes))
        return Value(self, made[0], first.dtype if dtype is None else dtype)

    def where(self, condition: Value, yes: Operand, no: Operand) -> Value:
        """Choose element by element."""
        dtype = next((one.dtype for one in (yes, no) if isinstance(one, Value)), np.dtype(np.float32))
        yes, no = self._operand(yes, dtype), self._operand(no, dtype)
        return self.op("Where", condition, yes, no, dtype=dtype)

    def concat(self, *values: Value, axis: int = -1) -> Value:
        """One after the other along an axis."""
        return self.op("Concat", *values, axis=axis)

    def matmul(self, left: Operand, right: Operand) -> Value:
        """Matrix product of the last two axes."""
        return self.op("MatMul", left, right)

    def name(self, value: Value, name: str) -> Value:
        """Give a value a name of its own."""
        self.nodes.append(helper.make_node("Identity", [value.name], [name]))
        return Value(self, name, value.dtype)

    def _operand(self, operand: Operand, dtype: np.dtype) -> Value:
        if isinstance(operand, Value):
            return operand
        if isinstance(operand, np.ndarray) and operand.dtype.kind == "i" and dtype.kind != "i":
            return self.constant(operand, np.int64)
        return self.constant(operand, dtype)
