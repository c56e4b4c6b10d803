"""SigMF recordings, read through the `sigmf` library (which checks the SHA-512) with the rules for one range cell."""

import io
import json
import re
import tarfile
import warnings
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import BadInput, unreadable
from .files import read_bounded, settle
from .limits import MOST_TEXT_BYTES, open_zip, require_size, unpacked
from .samples import positive

if TYPE_CHECKING:
    from sigmf import SigMFFile

META, DATA = ".sigmf-meta", ".sigmf-data"

#: Field of a capture: index of its first sample in all that the receiver gave.
_INDEX = "core:global_index"

#: _TIME: field of a capture, the time when it began. The difference of two captures' times may depart from the duration
#: of the samples between them by the share _DRIFT of that duration, plus _CLOCK_S, by which a computer's clock may be
#: off, if both times have fractions of a second, else plus _ROUNDED_S for their rounding [s].
_TIME = "core:datetime"
_CLOCK_S, _ROUNDED_S, _DRIFT = 0.1, 1.5, 1e-3

_MOST_COUNT = 1 << 63  # JSON's whole numbers are unbounded: larger ones would overflow every integer type
ARCHIVES = (".sigmf", ".sigmf.gz", ".sigmf.xz", ".sigmf.zip")
_DATATYPE = re.compile(r"([cr])(?!f8|f16)([fiu])(8|16|32|64)(_le|_be)?")


class SigmfSamples(NamedTuple):
    """What a SigMF recording holds.

    Attributes
    ----------
    iq
        Shape (pulses,); fixed-point samples are scaled to -1..1.
    carrier_hz, prf_hz
        `core:frequency` and `core:sample_rate` [Hz]; None where the file does not say.
    first_sample
        Index of the first sample in the whole recording: the first capture's `core:global_index`, else its
        `core:sample_start`; without captures `core:offset`.
    """

    iq: NDArray[np.generic]
    carrier_hz: float | None
    prf_hz: float | None
    first_sample: int


def find_sigmf(path: Path) -> Path | None:
    """Return the metadata file or the archive that a name stands for, or None where it is not SigMF.

    Parameters
    ----------
    path
        A .sigmf-meta, a .sigmf-data, their stem, or an archive.

    Raises
    ------
    BadInput
        Half of a recording is missing, or it is a collection.
    """
    if path.name.endswith(".sigmf-collection"):
        raise BadInput(f"{path}: a collection of recordings: name the recordings themselves (.sigmf-meta)")
    if path.name.endswith(ARCHIVES):
        return path if path.is_file() else None
    with suppress(OSError):
        settle(path.parent)  # finishes a pair of files that was left half written
    if path.name.endswith((META, DATA)):
        stem, missing = path.with_suffix(""), f"{path}: no such file"
    elif path.is_file() or not path.name:
        return None
    else:
        stem, missing = path, ""
    meta, data = (stem.with_name(stem.name + suffix) for suffix in (META, DATA))
    if meta.is_file():
        return meta
    if data.is_file():
        raise BadInput(
            f"{data}: its metadata {meta.name} are missing: a SigMF recording is both files; samples alone, beside "
            "--carrier-hz and --prf-hz, are saved as .npy"
        )
    if missing:
        is_folder = path.is_dir()
        raise BadInput(f"{path}: it is a directory: name a file" if is_folder else missing)
    return None


def read_sigmf(path: Path) -> SigmfSamples:
    """Read a recording of one channel at one carrier.

    Parameters
    ----------
    path
        As `find_sigmf` gives it.

    Raises
    ------
    BadInput
        Damaged, cut short or altered, not complex, of several channels or carriers, or with a field that is wrong.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what matters of the library's warnings is an error below
        try:
            return _read_pair(path) if path.name.endswith(META) else _read_archive(path)
        except OSError as error:
            raise unreadable(path, error) from None


def _each_once(path: Path, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of metadata; a field given twice with different values is refused: nobody can tell which holds."""
    said = dict(pairs)
    for name, value in pairs:
        if said[name] is not value and said[name] != value:
            raise BadInput(f"{path}: {name} is said twice, {value!r} and {said[name]!r}: leave one of them")
    return said


def _read_pair(path: Path) -> SigmfSamples:
    import sigmf

    try:
        text = read_bounded(path, MOST_TEXT_BYTES)
        metadata = json.loads(text, object_pairs_hook=partial(_each_once, path))
    except BadInput:
        raise
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        if not text:
            raise BadInput(f"{path}: the file is empty (0 bytes): copy it again") from None
        raise BadInput(f"{path}: not JSON: {error}: SigMF metadata are a JSON object") from None
    except RecursionError:
        raise BadInput(f"{path}: nested too deep to be read: SigMF metadata are an object of a few levels") from None
    except ValueError as error:  # the file too large, or a number that Python does not read
        what = "a number in it has thousands of digits" if "digits" in str(error) else str(error)
        raise BadInput(f"{path}: cannot be read: {what}: write the metadata again") from None
    _check_structure(metadata, path)
    data = path.with_suffix(DATA)
    if metadata["global"].get("core:dataset"):
        raise BadInput(
            f"{path}: core:dataset names a file that is not SigMF ({metadata['global']['core:dataset']!r}): "
            f"store the samples as {data.name} and leave core:dataset out"
        )
    if not data.is_file():
        raise BadInput(f"{path}: its samples {data.name} are missing: a SigMF recording is both files")
    _check_length(metadata, require_size(data), path)
    try:
        recording = sigmf.SigMFFile(metadata=metadata, data_file=data)
    except OSError:
        raise
    except Exception as error:  # the library's own errors, and Python's where a field that is not used here is odd
        raise BadInput(_library_message(data, error)) from None
    return _samples(recording, path)


def _read_archive(path: Path) -> SigmfSamples:
    from sigmf.archivereader import SigMFArchiveReader

    try:
        recording = SigMFArchiveReader(**_bounded_archive(path)).sigmffile
    except (BadInput, OSError):
        raise
    except Exception as error:  # tar, zip, xz, JSON and schema each raise their own
        raise BadInput(_library_message(path, error)) from None
    metadata = {
        "global": recording.get_global_info(),
        "captures": recording.get_captures(),
        "annotations": recording.get_annotations(),
    }
    _check_structure(metadata, path)
    _check_length(metadata, recording.data_size_bytes, path)
    return _samples(recording, path)


def _bounded_archive(path: Path) -> dict[str, Any]:
    """Arguments for the library's reader, once the archive is bounded: the library reads members whole."""
    require_size(path)
    with open(path, "rb") as file:
        if file.read(2) == b"PK":
            with open_zip(path) as packed:
                _require_one([name for name in packed.namelist() if not name.endswith("/")], path)
                file.seek(0)
                return {"name": path} if path.name.endswith(".zip") else {"archive_buffer": io.BytesIO(file.read())}
        content = unpacked(path)
        file.seek(0)
        with tarfile.open(fileobj=file if content is None else io.BytesIO(content), mode="r:") as tar:
            for member in tar.getmembers():
                if member.isfile() and (member.issparse() or member.size < 0):
                    raise ValueError(f"{member.name!r} is stored sparse: pack the recording without holes")
            _require_one([member.name for member in tar.getmembers() if member.isfile()], path)
    return {"name": path} if content is None else {"archive_buffer": io.BytesIO(content)}


def _require_one(names: list[str], path: Path) -> None:
    """Refuse an archive of anything but one recording's two files: which of several is meant, nobody can tell."""
    metas, datas = ([name for name in names if name.endswith(suffix)] for suffix in (META, DATA))
    if len(metas) != 1 or len(datas) != 1:
        held = f"{len(metas)} files {META} and {len(datas)} files {DATA}"
        raise BadInput(f"{path}: the archive holds {held}: pack each recording, one of each, in an archive of its own")
    if metas[0].removesuffix(META) != datas[0].removesuffix(DATA):
        raise BadInput(f"{path}: {metas[0]} and {datas[0]} are not one recording: give them one name")


def _library_message(path: Path, error: Exception) -> str:
    if "hash does not match" in str(error):
        return f"{path}: altered or damaged: the SHA-512 of its samples is not the one in core:sha512: copy it again"
    first = (str(error).splitlines() or [""])[0]
    return f"{path}: not a readable SigMF recording ({type(error).__name__}: {first}): copy or record it again"


def _check_structure(metadata: Any, path: Path) -> None:
    """Check the type and the value of every field that is used here."""
    if not isinstance(metadata, dict) or not isinstance(metadata.get("global"), dict):
        raise BadInput(f"{path}: no 'global' object: SigMF metadata are an object of global, captures, annotations")
    for section in ("captures", "annotations"):
        entries = metadata.setdefault(section, [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise BadInput(f"{path}: {section!r} must be a list of objects")
        for index, entry in enumerate(entries):
            entry["core:sample_start"] = _count(entry, "core:sample_start", f"{path}: {section}[{index}]")
            if "core:sample_count" in entry:
                _count(entry, "core:sample_count", f"{path}: {section}[{index}]")
    general = metadata["global"]
    if isinstance(digest := general.get("core:sha512"), str):  # SigMF allows either case, its library lower case only
        general["core:sha512"] = digest.lower()
    _check_captures(metadata["captures"], path)
    _check_times(metadata["captures"], general.get("core:sample_rate"), path)
    datatype = general.get("core:datatype")
    match = _DATATYPE.fullmatch(datatype) if isinstance(datatype, str) else None
    if match is None:
        said = f"is {datatype!r}" if "core:datatype" in general else "is missing"
        raise BadInput(
            f"{path}: core:datatype {said}: it must be the SigMF type of the samples, such as 'cf32_le' "
            "(c for complex; f of 32 or 64 bits, i or u of 8, 16, 32 or 64; _le or _be)"
        )
    if match[1] == "r":
        raise BadInput(
            f"{path}: real samples (core:datatype {datatype}): IQ must be complex, such as cf32_le: of one channel "
            "scipy.signal.hilbert makes it"
        )
    channels = _count(general, "core:num_channels", str(path), absent=1)
    if channels != 1:
        raise BadInput(
            f"{path}: {channels} channels (core:num_channels): a recording is one range cell: "
            "store each channel in a recording of its own"
        )
    headers = any(_count(capture, "core:header_bytes", str(path)) for capture in metadata["captures"])
    if headers or _count(general, "core:trailing_bytes", str(path)):
        raise BadInput(f"{path}: core:header_bytes or core:trailing_bytes above 0: store the samples alone")


def _check_captures(captures: list[dict[str, Any]], path: Path) -> None:
    """Refuse captures that are out of order, or with samples missing between them: a dwell would lie over the gap."""
    for index, (one, two) in enumerate(pairwise(captures)):
        start, following = one["core:sample_start"], two["core:sample_start"]
        if following < start:
            raise BadInput(
                f"{path}: captures[{index + 1}] starts at sample {following}, captures[{index}] at {start}: "
                "they must follow one another: put them in order"
            )
    # the index is optional: a capture without one is taken to continue those beside it
    places = [
        (number, entry["core:sample_start"], _count(entry, _INDEX, f"{path}: captures"))
        for number, entry in enumerate(captures)
        if _INDEX in entry
    ]
    for (before, start, place), (after, following, later) in pairwise(places):
        if missing := later - place - (following - start):
            wrong = (
                f"{missing} samples are missing between captures[{before}] and captures[{after}]"
                if missing > 0
                else f"captures[{after}] begins {-missing} samples before captures[{before}] ends"
            )
            raise BadInput(f"{path}: {wrong} ({_INDEX}): store each run in a recording of its own")


def _check_times(captures: list[dict[str, Any]], prf_hz: object, path: Path) -> None:
    """Refuse captures whose times differ by another duration than that of the samples between them."""
    if isinstance(prf_hz, bool) or not isinstance(prf_hz, int | float) or not 0 < prf_hz < np.inf:
        return  # it is missing or wrong, which is reported elsewhere
    dated = [
        (number, entry["core:sample_start"], *time)
        for number, entry in enumerate(captures)
        if (time := _time(entry.get(_TIME))) is not None
    ]
    for (before, start, begun, fine), (after, following, later, fine_too) in pairwise(dated):
        lasted_s = (following - start) / prf_hz
        apart_s = (later - begun).total_seconds()
        slack_s = lasted_s * _DRIFT + (_CLOCK_S if fine and fine_too else _ROUNDED_S)
        # equal times are that of the whole recording's beginning
        if later != begun and abs(apart_s - lasted_s) > slack_s:
            raise BadInput(
                f"{path}: captures[{after}] is dated {apart_s:.6g} s after captures[{before}] ({_TIME}), but the "
                f"samples between last {lasted_s:.6g} s: store each run in a recording of its own"
            )


def _time(text: object) -> tuple[datetime, bool] | None:
    """The time that a field says, and whether it has fractions of a second; None where it says none."""
    with suppress(ValueError):
        if isinstance(text, str):
            given = datetime.fromisoformat(text)
            return given if given.tzinfo else given.replace(tzinfo=UTC), "." in text or "," in text
    return None


def _count(entry: dict[str, Any], field: str, where: str, absent: int = 0) -> int:
    value = entry.get(field, absent)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < _MOST_COUNT:
        large = isinstance(value, int) and abs(value) >= _MOST_COUNT
        shown = f"of {value.bit_length()} bits" if large else repr(value)
        raise BadInput(f"{where}: {field} is {shown}: it must be a whole number of 0 to below 2^63")
    return value


def _check_length(metadata: dict[str, Any], size_bytes: int, path: Path) -> None:
    """The data must be whole samples, and as many as the metadata speak of."""
    datatype = metadata["global"]["core:datatype"]
    match = _DATATYPE.fullmatch(datatype)
    assert match is not None  # _check_structure came first
    sample_bytes = 2 * int(match[3]) // 8
    if size_bytes == 0:
        raise BadInput(f"{path}: no samples, its data are empty (0 bytes): copy or record it again")
    if size_bytes % sample_bytes:
        raise BadInput(
            f"{path}: cut short: {size_bytes} bytes of data are not a whole number of {datatype} samples "
            f"({sample_bytes} bytes each): copy it again"
        )
    samples = size_bytes // sample_bytes
    offset = _count(metadata["global"], "core:offset", str(path))
    for section in ("captures", "annotations"):
        for index, entry in enumerate(metadata[section]):
            claimed = entry["core:sample_start"] + entry.get("core:sample_count", 0) - offset
            if claimed > samples:
                raise BadInput(
                    f"{path}: cut short: {section}[{index}] speaks of {claimed} samples, the data hold {samples}: "
                    "copy it again"
                )


def _samples(recording: "SigMFFile", path: Path) -> SigmfSamples:
    general, captures = recording.get_global_info(), recording.get_captures()
    offset = general["core:offset"]
    start = captures[0]["core:sample_start"] if captures else offset
    if start < offset:
        raise BadInput(
            f"{path}: captures[0] starts at sample {start}, before core:offset {offset}: correct one of them"
        )
    iq = recording.read_samples()[start - offset :]
    prf = general.get("core:sample_rate")
    prf_hz = None if prf is None else positive(prf, f"{path}: core:sample_rate (the PRF) [Hz]")
    carriers = {
        positive(capture["core:frequency"], f"{path}: captures[{index}] core:frequency (the carrier) [Hz]"): index
        for index, capture in reversed(list(enumerate(captures)))
        if capture.get("core:frequency") is not None
    }
    if len(carriers) > 1:
        said = ", ".join(
            f"captures[{index}] {carrier:.12g} Hz" for carrier, index in sorted(carriers.items(), key=lambda c: c[1])
        )
        raise BadInput(f"{path}: {len(carriers)} carriers ({said}): store each one in a recording of its own")
    first = _count(captures[0], _INDEX, str(path), absent=start) if captures else start
    return SigmfSamples(iq, next(iter(carriers), None), prf_hz, first)
