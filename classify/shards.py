"""Shards of a data set: a run of records as two plain .npy files, one of samples and one of their truth.

`NAME.iq.npy` holds the records' samples one behind the other, complex64; `NAME.table.npy` one row a record, `ROW`. Both
load with `numpy.load` and map into memory. This module uses a file only if its bytes have the digest that the data
set's manifest gives and its header is, to the byte, the one that this module writes: no header is ever interpreted.
"""

import hashlib
import io
import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bladewing.simulate import CLASSES, Radar
from bladewing.simulate.dataset import KIND_CLASS, TRUTH_UNITS, Records
from numpy.typing import NDArray

from .errors import BadInput, unreadable
from .files import read_bounded, write_whole

#: Samples, one behind the other.
SAMPLE = np.dtype("<c8")

#: The truth of a record; units as in `bladewing.simulate.dataset.TRUTH_UNITS`, NaN where a value has no meaning.
ROW = np.dtype(
    [("carrier_hz", "<f8"), ("prf_hz", "<f8"), ("pulses", "<i8"), ("label", "S7"), ("kind", "S16")]
    + [(name, "<f8") for name in TRUTH_UNITS]
)

_KINDS, _LABELS = (np.array([text.encode() for text in texts]) for texts in (KIND_CLASS, KIND_CLASS.values()))


@dataclass(frozen=True)
class Contents:
    """What the manifest says of a shard.

    Parameters
    ----------
    records, samples : int
        Records, and samples of all of them together.
    iq_sha256, table_sha256 : str
        Digests of the two files, hexadecimal.
    """

    records: int
    samples: int
    iq_sha256: str
    table_sha256: str


def shard_bytes(records: int, samples: int) -> int:
    """Size of a shard's two files together [bytes]."""
    return sum(
        len(_header(dtype, count)) + count * dtype.itemsize for dtype, count in ((SAMPLE, samples), (ROW, records))
    )


def write_shard(folder: Path, name: str, groups: Iterable[Records]) -> Contents:
    """Write records as a shard; each of its two files appears whole or not at all.

    Parameters
    ----------
    folder, name
        Where, and under what name.
    groups : iterable of Records
        The records in order, in runs that one radar saw.

    Returns
    -------
    Contents

    Raises
    ------
    OSError
        The folder is not writable, or the disk is full.
    """
    samples, rows = [], []
    for group in groups:
        table = np.empty(len(group), ROW)
        for field in ("carrier_hz", "prf_hz", "pulses"):
            table[field] = getattr(group.radar, field)
        table["label"] = group.labels.astype("S7")
        table["kind"] = group.truth["kind"].astype("S16")
        for field in TRUTH_UNITS:
            table[field] = group.truth[field]
        samples.append(group.iq.reshape(-1))
        rows.append(table)
    iq, table = np.concatenate(samples), np.concatenate(rows)
    digests = []
    for path, array in zip(_paths(folder, name), (iq.astype(SAMPLE, copy=False), table), strict=True):
        content = _header(array.dtype, len(array)) + array.tobytes()
        digests.append(hashlib.sha256(content).hexdigest())
        write_whole(path, content)
    return Contents(len(table), len(iq), *digests)


def intact(folder: Path, name: str, contents: Contents) -> bool:
    """Whether both files of a shard are there and have their digests."""
    try:
        _read(folder, name, contents)
    except BadInput:
        return False
    return True


def read_shard(folder: Path, name: str, contents: Contents) -> Iterator[Records]:
    """Read a shard as the runs of records that it was written from.

    Parameters
    ----------
    folder, name
        Where, and under what name.
    contents : Contents
        What the manifest says of it.

    Yields
    ------
    Records
        Consecutive records that one radar saw.

    Raises
    ------
    BadInput
        A file is missing, altered, of another form, or holds what no record can be.
    """
    iq, table = _read(folder, name, contents)
    where = _paths(folder, name)[1]
    pulses = table["pulses"]
    if not (np.all(pulses >= 1) and np.all(pulses <= len(iq)) and pulses.sum() == len(iq)):
        raise BadInput(f"{where}: pulses do not add up to the {len(iq)} samples: write the data set again")
    kind_of = dict(zip(_KINDS.tolist(), _LABELS.tolist(), strict=True))
    if any(
        kind_of.get(kind) != label for kind, label in zip(table["kind"].tolist(), table["label"].tolist(), strict=True)
    ):
        raise BadInput(f"{where}: a kind or a label that is none of {', '.join(CLASSES)}: write the data set again")
    if not np.isfinite(iq.view(np.float32)).all():
        raise BadInput(f"{_paths(folder, name)[0]}: a sample is not finite: write the data set again")
    ends = np.cumsum(pulses)
    radars = [tuple(row) for row in table[["carrier_hz", "prf_hz", "pulses"]].tolist()]
    at = 0
    for (carrier_hz, prf_hz, length), run in itertools.groupby(radars):
        count = sum(1 for _ in run)
        rows = table[at : at + count]
        try:
            radar = Radar(carrier_hz, prf_hz, length)
        except ValueError as error:
            raise BadInput(f"{where}: row {at}: {error}: write the data set again") from None
        first = int(ends[at]) - length
        truth: dict[str, NDArray] = {"kind": rows["kind"].astype("<U16")}
        truth |= {field: rows[field].astype(np.float64) for field in TRUTH_UNITS}
        records = iq[first : first + count * length].reshape(count, length)
        yield Records(radar, records, rows["label"].astype("<U7"), truth)
        at += count


def _read(folder: Path, name: str, contents: Contents) -> tuple[NDArray[np.complex64], NDArray[np.void]]:
    """The two arrays of a shard, after its files were checked against the manifest."""
    arrays: list[NDArray] = []
    wanted = (SAMPLE, contents.samples, contents.iq_sha256), (ROW, contents.records, contents.table_sha256)
    for path, (dtype, count, sha256) in zip(_paths(folder, name), wanted, strict=True):
        header = _header(dtype, count)
        size = len(header) + count * dtype.itemsize
        try:
            content = read_bounded(path, size)
        except FileNotFoundError:
            raise BadInput(f"{path}: missing: write the data set again, or copy it whole") from None
        except OSError as error:
            raise unreadable(path, error) from None
        except ValueError as error:
            raise BadInput(f"{path}: altered or damaged: {error}: write it again") from None
        if hashlib.sha256(content).hexdigest() != sha256:
            raise BadInput(f"{path}: altered or damaged: its SHA-256 is not the one in the manifest: write it again")
        if len(content) != size or not content.startswith(header):
            raise BadInput(f"{path}: not {count} values as bladewing writes them: write the data set again")
        arrays.append(np.frombuffer(content, dtype, offset=len(header)))
    return arrays[0], arrays[1]


def _paths(folder: Path, name: str) -> tuple[Path, Path]:
    return folder / f"{name}.iq.npy", folder / f"{name}.table.npy"


def _header(dtype: np.dtype, count: int) -> bytes:
    """The header of an .npy file that holds `count` values in one axis."""
    file = io.BytesIO()
    described = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(file, described)
    return file.getvalue()
