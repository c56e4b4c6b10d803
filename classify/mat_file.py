"""Checks on a MATLAB file before scipy reads it: a wrong type or size leads its compiled reader out of its memory."""

import math
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from .limits import inflate, require_size

#: Bytes of a number by its type in the file: int8 to uint32, single, double, int64 and uint64.
_NUMBER_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}

_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED = 1, 5, 6, 14, 15

#: Classes of arrays that hold plain numbers: double to uint64.
_NUMERIC_CLASSES = range(6, 16)

_MOST_AXES = 32


def require_sound(path: Path) -> None:
    """Check every array of numbers of a version 5 file: types, sizes, and what compressed ones unpack to.

    Parameters
    ----------
    path : Path
        A file of version 5 to 7, as `scipy.io.matlab.matfile_version` says.

    Raises
    ------
    ValueError
        A type is unknown, a size does not fit, or the file ends too early.
    BadInput
        It is too large, or unpacks to too much.
    """
    require_size(path)
    content = path.read_bytes()
    order = "<" if content[126:128] == b"IM" else ">"  # as scipy decides it
    at, budget = 128, [0]
    try:
        while at < len(content):
            kind, size = struct.unpack_from(f"{order}II", content, at)
            body = content[at + 8 : at + 8 + size]
            if len(body) != size:
                raise ValueError("it ends within an array")
            if kind == _COMPRESSED:
                body = inflate(path, body, budget)
                kind, size = struct.unpack_from(f"{order}II", body)
                body = body[8 : 8 + size]
            if kind != _MATRIX:
                raise ValueError(f"an element of type {kind} where an array must be")
            _require_matrix(body, order)
            at += 8 + struct.unpack_from(f"{order}II", content, at)[1]
    except (struct.error, zlib.error, EOFError) as error:
        raise ValueError(str(error)) from None


def _require_matrix(body: bytes, order: str) -> None:
    elements = _elements(body, order)
    kind, flags = next(elements)
    if kind != _UINT32 or len(flags) != 8:
        raise ValueError("an array without flags")
    word = struct.unpack_from(f"{order}I", flags)[0]
    if word & 0xFF not in _NUMERIC_CLASSES:
        return  # only its header is ever read
    kind, axes = next(elements)
    if kind != _INT32 or not axes or len(axes) % 4 or len(axes) > 4 * _MOST_AXES:
        raise ValueError("an array without a shape")
    shape = struct.unpack_from(f"{order}{len(axes) // 4}i", axes)
    if any(length < 0 for length in shape):
        raise ValueError(f"an array of shape {shape}")
    if next(elements)[0] != _INT8:
        raise ValueError("an array without a name")
    for _ in range(2 if word & 0x800 else 1):  # real, and imaginary
        kind, numbers = next(elements)
        if kind not in _NUMBER_BYTES:
            raise ValueError(f"numbers of type {kind}")
        if len(numbers) != math.prod(shape) * _NUMBER_BYTES[kind]:
            raise ValueError(f"{len(numbers)} bytes of numbers for shape {shape}")


def _elements(body: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Type and content of the elements within an array."""
    at = 0
    while True:
        word = struct.unpack_from(f"{order}I", body, at)[0]
        if word >> 16:  # a small element: up to four bytes within its own tag
            kind, size = word & 0xFFFF, word >> 16
            if size > 4:
                raise ValueError(f"a small element of {size} bytes")
            content, at = body[at + 4 : at + 4 + size], at + 8
        else:
            kind, size = struct.unpack_from(f"{order}II", body, at)
            content, at = body[at + 8 : at + 8 + size], at + 8 + size + -size % 8
        if len(content) != size:
            raise ValueError("it ends within an array")
        yield kind, content
