"""What a record weighs in each form it can be kept in."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

# zlib's own default level, which most container formats use when told to compress.
ZLIB_LEVEL = 6
RECORDS_QUOTED = 1_000_000


def weigh(forms: Mapping[str, NDArray[np.generic]]) -> list[dict[str, Any]]:
    """Give the bytes per record of each form, uncompressed and compressed.

    Parameters
    ----------
    forms : mapping of str to (n, ...) array
        The same n records in each form.

    Returns
    -------
    list of dict
        ``form``, ``shape`` (of one record), ``dtype``, ``bytes``, ``compressed_bytes`` (zlib level 6, mean over the
        records, each compressed alone) and ``bytes_per_million``.
    """
    rows = []
    for form, records in forms.items():
        size = records[0].nbytes
        packed = [len(zlib.compress(np.ascontiguousarray(record).tobytes(), ZLIB_LEVEL)) for record in records]
        row = {"form": form, "shape": list(records.shape[1:]), "dtype": records.dtype.name, "bytes": size}
        rows.append({**row, "compressed_bytes": float(np.mean(packed)), "bytes_per_million": size * RECORDS_QUOTED})
    return rows
