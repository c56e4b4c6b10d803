"""What every array of IQ samples must be, wherever it comes from."""

import math
from numbers import Real

import numpy as np
from bladewing.features.samples import FILL_IN
from numpy.typing import ArrayLike, NDArray

from .errors import BadInput

_COMPLEX64 = np.dtype(np.complex64)
# _LOOKED_AT: samples that are examined for a wrong order of bytes. _MOST_DECADES: the samples of a recording, all but a
# twentieth at either end, lie within this many decades.
_LOOKED_AT, _MOST_DECADES = 1 << 16, 6.0


def complex_samples(values: ArrayLike, name: str) -> NDArray[np.complex64]:
    """Check samples and give them as complex64.

    Parameters
    ----------
    values
        Complex array of any shape.
    name
        What the samples are, for the error message: a file, or an argument.

    Raises
    ------
    BadInput
        The samples are a Recording, or not complex numbers, one is not finite as complex64, or all of a record become 0
        in complex64.
    """
    if type(values).__name__ == "Recording":  # by its name: the module of the type imports this one
        raise BadInput(f"{name} is a Recording: give recording.dwells(0.08), or call answer(recording, classifier)")
    if np.ma.is_masked(values):
        hidden = np.ma.count_masked(values)
        raise BadInput(f"{name}: {hidden} samples are masked: every sample counts: {FILL_IN}")
    try:
        given = np.asarray(values)
    except ValueError:
        raise BadInput(f"{name}: rows of unequal length: every record must have as many pulses") from None
    if given.dtype.names is not None:
        fields = list(given.dtype.names)
        one, other = fields if len(fields) == 2 else ("re", "im")
        raise BadInput(
            f"{name}: a structured array with fields {fields}: store complex samples: x[{one!r}] + 1j * x[{other!r}]"
        )
    if given.dtype.kind == "O":
        raise BadInput(f"{name}: an array of Python objects: store complex samples (complex64)")
    if given.dtype.kind in "fiu" and given.ndim > 1 and 2 in (given.shape[0], given.shape[-1]):
        parts = ("x[..., 0]", "x[..., 1]") if given.shape[-1] == 2 else ("x[0]", "x[1]")
        raise BadInput(
            f"{name}: real samples of shape {given.shape}: I and Q must be one complex number: "
            f"store {parts[0]} + 1j * {parts[1]}"
        )
    if given.dtype.kind in "fiub":
        raise BadInput(
            f"{name}: real samples ({given.dtype}): IQ must be complex, I + jQ (complex64), neither magnitude nor dB: "
            "of I and Q by turns x[0::2] + 1j * x[1::2] makes it, of one channel scipy.signal.hilbert(x)"
        )
    if given.dtype.kind != "c":
        raise BadInput(f"{name}: samples of type {given.dtype}: IQ must be complex, I + jQ (complex64)")
    iq = given
    if given.dtype != _COMPLEX64:
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is found below, with its index
            iq = given.astype(np.complex64)
        vanished = np.atleast_1d(given)[~np.atleast_1d(iq).any(axis=-1)]
        if vanished.any():
            largest = float(np.abs(vanished).max())
            raise BadInput(f"{name}: samples of at most {largest:.2g}, which complex64 holds as 0: raise the gain")
    if not np.isfinite(np.ascontiguousarray(iq).view(np.float32)).all():  # as real numbers: a quarter of the time
        finite = np.isfinite(iq)
        first = np.unravel_index(int(np.argmin(finite)), iq.shape)
        where = int(first[0]) if iq.ndim == 1 else tuple(int(i) for i in first)
        with np.errstate(invalid="ignore"):  # a signalling NaN is cast to be shown
            shown = str(given[first])
        cure = FILL_IN
        if np.isfinite(given[first]):
            cure = "lower the gain"
        elif _in_other_order(given):
            cure = "the bytes seem to be in the other order: swap _le and _be in core:datatype, or give x.byteswap()"
        raise BadInput(
            f"{name}: sample {where} is {shown}: every sample must be finite in complex64 "
            f"({int(np.sum(~finite))} of {iq.size} are not): {cure}"
        )
    return iq


def _in_other_order(samples: NDArray[np.complexfloating]) -> bool:
    """Whether samples were read with their bytes in the wrong order: swapped, all are finite and of similar size."""
    some = samples.ravel()[:_LOOKED_AT]
    turned = some.byteswap()
    decades = []
    for one in (some, turned):
        size = np.abs(one.real[np.isfinite(one.real) & (one.real != 0)])
        decades.append(float(np.ptp(np.log10(np.quantile(size, [0.05, 0.95])))) if len(size) else 0.0)
    return bool(np.isfinite(turned).all()) and decades[1] < _MOST_DECADES < decades[0] / 2


def positive(value: object, name: str) -> float:
    """Check a frequency or a time: a finite number above 0.

    Raises
    ------
    BadInput
        It is not; `name` (with its unit) says what.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:  # as an .npz file gives it
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, Real):
        raise BadInput(f"{name} is {value!r}: it must be a number above 0")
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not math.isfinite(number) or number <= 0:
        raise BadInput(f"{name} is {number:g}: it must be a finite number above 0")
    return number
