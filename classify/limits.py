"""The default dwell, and limits on file sizes, on what packed files unpack to, on records and on seeds."""

import bz2
import io
import lzma
import stat
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import BadInput

#: Largest file of samples that is read [bytes]; they are held in memory.
MOST_BYTES = 1 << 32

#: Largest text that describes something: JSON, TOML [bytes].
MOST_TEXT_BYTES = 16 << 20

#: Largest model [bytes].
MOST_MODEL_BYTES = 1 << 28

#: Length of a dwell where none is asked for [s]; the paper's.
DWELL_S = 0.08

#: Fewest records that can be trained on. Each of the other three sets holds at least this many too, so that it has some
#: of every kind.
LEAST_RECORDS = 600

#: Seeds of a training or a report are below this: scikit-learn takes no larger.
SEEDS = 1 << 32

# A packed file may unpack to _FREE_BYTES, or to _RATIO times its size if that is more: samples hardly compress, and
# text, which does, is small.
_FREE_BYTES, _RATIO = 64 << 20, 100

_CHUNK = 1 << 20
_LZMA_BYTES = 256 << 20  # for its dictionary


def most_unpacked(packed_bytes: int) -> int:
    """The most that a packed file of this size may unpack to [bytes]."""
    return min(MOST_BYTES, max(_FREE_BYTES, _RATIO * packed_bytes))


def require_size(path: Path) -> int:
    """Size of a file of samples [bytes]; too large a file is refused.

    Raises
    ------
    BadInput
        The file is larger than `MOST_BYTES`, or a pipe or a device.
    OSError
        Its status cannot be read.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise BadInput(f"{path}: a pipe or a device, no file: copy what it gives into one")
    size = status.st_size
    if size > MOST_BYTES:
        raise BadInput(f"{path}: {size} bytes are more than the {MOST_BYTES} that are read at once: cut it into parts")
    return size


def require_unpacked(path: Path, unpacked: int) -> None:
    """Refuse a packed file that unpacks to more bytes than it may (see `most_unpacked`).

    Raises
    ------
    BadInput
        It unpacks to too much.
    """
    most = most_unpacked(path.stat().st_size)
    if unpacked > most:
        raise BadInput(
            f"{path}: it unpacks to {unpacked} bytes or more, a file of its size may to {most}: unpack it first"
        )


@contextmanager
def open_zip(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a zip archive whose members together are not too large; no member can give more than it declares.

    Raises
    ------
    BadInput
        It unpacks to too much.
    Exception
        What `zipfile` raises for a damaged one.
    """
    with zipfile.ZipFile(path) as archive:
        require_unpacked(path, sum(member.file_size for member in archive.infolist()))
        yield archive


def unpacked(path: Path) -> bytes | None:
    """Content of a gzip, bzip2 or xz file, whatever its name; None where it is none of these.

    Raises
    ------
    BadInput
        It unpacks to too much.
    Exception
        What the decompressors raise for a damaged one.
    """
    with open(path, "rb") as file:
        head = file.read(6)
    for magic, make in (
        (b"\x1f\x8b", lambda: zlib.decompressobj(zlib.MAX_WBITS | 16)),
        (b"BZh", bz2.BZ2Decompressor),
        (b"\xfd7zXZ\x00", lambda: lzma.LZMADecompressor(memlimit=_LZMA_BYTES)),
    ):
        if head.startswith(magic):
            out = io.BytesIO()
            waiting = path.read_bytes()
            while waiting.startswith(magic):  # parallel packers write several streams, one after the other
                stream = make()
                for part in _stream(stream, waiting):
                    out.write(part)
                    require_unpacked(path, out.tell())
                waiting = stream.unused_data
            return out.getvalue()
    return None


def _stream(decompressor: object, packed: bytes) -> Iterator[bytes]:
    """Unpack one stream in parts of at most a chunk; what follows it is left."""
    waiting = packed
    while True:
        part = decompressor.decompress(waiting, _CHUNK)  # type: ignore[attr-defined]
        yield part
        if decompressor.eof:  # type: ignore[attr-defined]
            return
        # zlib gives back what it has not read, the others keep it
        waiting = getattr(decompressor, "unconsumed_tail", b"")
        if not part and not waiting:
            raise EOFError("it ends before its own end")


def inflate(path: Path, packed: bytes, total: list[int]) -> bytes:
    """Unpack one zlib stream of a file; `total[0]` counts the bytes of all streams of the file.

    Raises
    ------
    BadInput
        The streams together unpack to too much.
    """
    out = io.BytesIO()
    for part in _stream(zlib.decompressobj(), packed):
        out.write(part)
        total[0] += len(part)
        require_unpacked(path, total[0])
    return out.getvalue()
