"""The seal of a model file: a SHA-256 inside the file that shows any later change of a byte.

The digest stands in the ONNX metadata under `SEAL_KEY`. It is taken over the whole file with its own 64 characters set
to "0", so sealing changes neither the length nor anything else. It proves that a file is as it was
written, not who wrote it.
"""

import hashlib
import re

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
        raise ValueError(
            f"not a bladewing model: {len(spans)} entries {SEAL_KEY!r} in its metadata where there must be 1;"
            " use a file that `bladewing train` wrote"
        )
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
