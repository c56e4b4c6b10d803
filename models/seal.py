"""The seal of a model file: a SHA-256 inside the file that shows any later change of a byte.

The digest stands in the ONNX metadata under `SEAL_KEY`. It is taken over the whole file with its own 64 characters set
to "0", so sealing changes neither the length nor anything else. It proves that a file is as it was
written, not who wrote it.
"""

import hashlib
import re
from collections.abc import Iterator

SEAL_KEY = "bladewing_sha256"
PLACEHOLDER = "0" * 64

# How protocol buffers store one metadata entry: field 1 (key) and field 2 (value), each with its length before it.
_ENTRY = re.compile(
    rb"\x0a"
    + bytes([len(SEAL_KEY)])
    + SEAL_KEY.encode()
    + rb"\x12"
    + re.escape(bytes([len(PLACEHOLDER)]))
    + rb"([0-9a-f]{64})"
)


def _digest_span(onnx_bytes: bytes) -> tuple[int, int]:
    """Return where the 64 characters stand; refuse a file with none or several."""
    spans = [match.span(1) for match in _ENTRY.finditer(onnx_bytes)]
    if len(spans) != 1:
        found = f"{len(spans)} seals, where there must be one" if spans else "no seal"
        raise ValueError(f"not a bladewing model: it bears {found}: use a file that `bladewing train` wrote")
    return spans[0]


def seal(onnx_bytes: bytes) -> bytes:
    """Write the digest over its placeholder.

    Parameters
    ----------
    onnx_bytes
        A serialised ONNX model whose metadata hold `PLACEHOLDER` under `SEAL_KEY` (see `export.attach_metadata`).

    Returns
    -------
    bytes
        The sealed model, of the same length.

    Raises
    ------
    ValueError
        Where there is no place for the seal, or one is there already.
    """
    start, stop = _digest_span(onnx_bytes)
    if onnx_bytes[start:stop] != PLACEHOLDER.encode():
        raise ValueError("the model is sealed already; seal it once, after the last change")
    return onnx_bytes[:start] + hashlib.sha256(onnx_bytes).hexdigest().encode() + onnx_bytes[stop:]


def verify(onnx_bytes: bytes) -> str:
    """Check that a model is as it was when it was sealed.

    Parameters
    ----------
    onnx_bytes
        The content of a model file.

    Returns
    -------
    str
        The digest, 64 hexadecimal characters.

    Raises
    ------
    ValueError
        Where the file is not a bladewing model, was never sealed, or was altered after it was written.
    """
    start, stop = _digest_span(onnx_bytes)
    found = onnx_bytes[start:stop].decode()
    expected = hashlib.sha256(onnx_bytes[:start] + PLACEHOLDER.encode() + onnx_bytes[stop:]).hexdigest()
    if found != expected:
        raise ValueError(
            f"the model was altered after it was written: its SHA-256 is {expected[:12]}..., its seal says"
            f" {found[:12]}...; fetch or train it again"
        )
    return found


def read_metadata(onnx_bytes: bytes) -> dict[str, str]:
    """Read a model's metadata from its bytes alone, before any runtime opens it.

    Parameters
    ----------
    onnx_bytes
        The content of a model file.

    Returns
    -------
    dict of str to str
        Its metadata.

    Raises
    ------
    ValueError
        Where it is no ONNX model, holds a key twice, or refers to data outside the file.
    """
    if b"location" in onnx_bytes:  # the one key by which a tensor can name another file
        raise ValueError("the model refers to data outside its file; use a file that `bladewing train` wrote")
    metadata: dict[str, str] = {}
    for number, content in _fields(onnx_bytes):
        if number == _METADATA_FIELD:
            entry = dict(_fields(content))
            key, value = (entry.get(part, b"").decode() for part in (1, 2))
            if key in metadata:
                raise ValueError(f"damaged metadata: {key!r} stands there twice")
            metadata[key] = value
    return metadata


_METADATA_FIELD = 14  # of the message ModelProto


def _fields(message: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield number and content of each field of a protocol buffer; the content is empty where the field is a number."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = 0
        for shift in range(0, 70, 7):
            if at >= len(message):
                raise ValueError("not an ONNX model: it ends within a number")
            byte = message[at]
            at += 1
            value |= (byte & 127) << shift
            if byte < 128:
                return value
        raise ValueError("not an ONNX model: a number of too many bytes")

    while at < len(message):
        tag = varint()
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            varint()
            size = 0
        elif kind in (1, 2, 5):
            size = varint() if kind == 2 else 8 if kind == 1 else 4
        else:
            raise ValueError(f"not an ONNX model: a field of kind {kind}")
        if size > len(message) - at:
            raise ValueError("not an ONNX model: cut short")
        yield number, message[at : at + size] if kind == 2 else b""
        at += size
