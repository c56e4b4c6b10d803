"""IQ from .npy, .npz and .mat files. Nothing is ever unpickled."""

import lzma
import math
import warnings
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from tokenize import TokenError
from typing import IO

import numpy as np
from numpy.typing import NDArray

from .errors import BadInput, unreadable
from .limits import open_zip, require_size
from .mat_file import require_sound

ARRAY_SUFFIXES = (".npy", ".npz", ".mat")

# What zipfile raises for damaged, encrypted or unknown contents.
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError, ValueError)


# What numpy raises for a damaged .npy; an old header is Python text, so errors of the tokeniser are among them.
_NPY_ERRORS = (
    ValueError,
    EOFError,
    MemoryError,
    OverflowError,
    TypeError,
    KeyError,
    AttributeError,
    RecursionError,
    SyntaxError,
    TokenError,
)

# Version of the .npy format to the function that reads its header, and the bytes that hold the header's length.
_HEADERS = {(1, 0): (np.lib.format.read_array_header_1_0, 2), (2, 0): (np.lib.format.read_array_header_2_0, 4)}
_MOST_HEADER_BYTES = 10_000

# Names of two arrays that hold I and Q.
_PARTS = (("i", "q"), ("re", "im"), ("real", "imag"), ("inphase", "quadrature"))

_HDF5 = b"\x89HDF\r\n\x1a\n"


class _PickledError(BadInput):
    """An array of Python objects."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"{name}: an array of Python objects, which is never unpickled here: store complex samples (complex64)"
        )


def read_array(path: Path, variable: str | None = None) -> NDArray[np.generic]:
    """Read the array of samples out of a file.

    Parameters
    ----------
    path
        An existing .npy, .npz or .mat file.
    variable
        Which array of an .npz or .mat file.

    Returns
    -------
    numpy.ndarray
        Whatever shape and type it has; `bladewing.classify.recording` judges that.

    Raises
    ------
    BadInput
        The file is damaged or cut short, or does not say which array is meant.
    """
    suffix = path.suffix.lower()
    if suffix == ".npy" and variable is not None:
        raise BadInput(f"{path}: variable {variable!r} given, but a .npy file holds one array: leave it out")
    try:
        if not require_size(path):
            raise BadInput(f"{path}: the file is empty (0 bytes): copy or record it again")
        if suffix == ".npy":
            with open(path, "rb") as file:
                return _parse_npy(file, str(path), path.stat().st_size)
        arrays = _read_npz(path, variable) if suffix == ".npz" else _read_mat(path, variable)
    except OSError as error:
        if error.errno is None:  # not from the system: readers raise it for a file that ends too early
            raise BadInput(_damaged(path, error)) from None
        raise unreadable(path, error) from None
    return _choose(arrays, variable, path)


def _parse_npy(file: IO[bytes], name: str, size: int) -> NDArray[np.generic]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about headers of old versions
            _require_whole(file, name, size)
            return np.lib.format.read_array(file, allow_pickle=False)
    except BadInput:
        raise
    except _NPY_ERRORS as error:
        if "Object arrays" in str(error):
            raise _PickledError(name) from None
        raise BadInput(_damaged(name, error)) from None


def _require_whole(file: IO[bytes], name: str, size: int) -> None:
    """Refuse a header that claims more data than the file holds, before memory is allocated for it."""
    magic = file.read(len(np.lib.format.MAGIC_PREFIX))
    if magic != np.lib.format.MAGIC_PREFIX:
        raise BadInput(f"{name}: not an .npy file, whatever its name says: save the samples with numpy.save")
    file.seek(0)
    version = np.lib.format.read_magic(file)
    if version == (3, 0):  # only for names of fields, which samples do not have
        raise BadInput(f"{name}: version 3.0 of the .npy format: save the samples with numpy.save, which writes 1.0")
    if version not in _HEADERS:
        raise ValueError(f"version {version} of the format")
    read_header, width = _HEADERS[version]
    start, length = file.tell(), int.from_bytes(file.read(width), "little")
    if length > _MOST_HEADER_BYTES:
        raise ValueError(f"a header of {length} bytes")
    file.seek(start)
    shape, _, dtype = read_header(file)
    if any(length < 0 for length in shape):
        raise ValueError(f"shape {shape}")
    claimed, held = math.prod(shape) * dtype.itemsize, size - file.tell()
    if claimed > held and not dtype.hasobject:
        raise ValueError(f"its header speaks of {claimed} bytes, {held} are there")
    file.seek(0)


def _read_npz(path: Path, variable: str | None) -> dict[str, NDArray[np.generic]]:
    arrays: dict[str, NDArray[np.generic]] = {}
    pickled: dict[str, _PickledError] = {}
    try:
        with open_zip(path) as archive:
            entries = archive.infolist()
            for entry in [entry for entry in entries if entry.filename.endswith(".npy")] or entries:
                member = entry.filename
                name = member.removesuffix(".npy")
                with archive.open(entry) as file:
                    try:
                        arrays[name] = _parse_npy(file, f"{path}: {member}", entry.file_size)
                    except _PickledError as error:
                        pickled[name] = error
    except BadInput:
        raise
    except _ZIP_ERRORS as error:
        raise BadInput(_damaged(path, error)) from None
    if variable in pickled:
        raise pickled[variable]
    if pickled and not any(array.dtype.kind == "c" for array in arrays.values()):
        raise next(iter(pickled.values()))
    return arrays


def _read_mat(path: Path, variable: str | None) -> dict[str, NDArray[np.generic]]:
    import scipy.io

    try:
        with open(path, "rb") as file:
            head = file.read(len(_HDF5))
        if head == _HDF5:  # HDF5 without the header that MATLAB writes before it
            raise _hdf5(path)
        if _mat_version(path, head) == 1:
            require_sound(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about variables that are not read here
            kinds = {name: kind for name, _, kind in scipy.io.whosmat(path, appendmat=False)}
            numeric = [name for name, kind in kinds.items() if kind.startswith(("double", "single", "int", "uint"))]
            if variable in kinds and variable not in numeric:
                raise BadInput(f"{path}: variable {variable!r} is a {kinds[variable]}: store complex numbers")
            if kinds and not numeric:
                held = ", ".join(f"{name}, a {kind}" for name, kind in sorted(kinds.items()))
                raise BadInput(f"{path}: it holds {held}: store the complex samples as an array of their own")
            read = scipy.io.loadmat(path, appendmat=False, variable_names=numeric) if numeric else {}
            return {name: read[name] for name in numeric}
    except (BadInput, OSError):
        raise
    except NotImplementedError:
        raise _hdf5(path) from None
    except Exception as error:  # a damaged file makes scipy raise nearly anything
        raise BadInput(_damaged(path, error)) from None


def _mat_version(path: Path, head: bytes) -> int:
    """Version of the format: 0 for 4, 1 for 5 to 7, 2 for 7.3."""
    from scipy.io.matlab import matfile_version

    try:
        return int(matfile_version(path)[0])
    except Exception as error:
        if isinstance(error, OSError) or head.startswith(b"MATLAB"):
            raise
        cure = "save the samples with save(name, 'iq', '-v7') or scipy.io.savemat"
        raise BadInput(f"{path}: not a MATLAB file, whatever its name says: {cure}") from None


def _hdf5(path: Path) -> BadInput:
    return BadInput(f"{path}: a MATLAB 7.3 file (HDF5): save it with version 7: save(name, 'iq', '-v7')")


def _choose(arrays: Mapping[str, NDArray[np.generic]], variable: str | None, path: Path) -> NDArray[np.generic]:
    """The array that was named, or the only one that can be meant."""
    if variable is not None:
        if variable not in arrays:
            raise BadInput(f"{path}: no variable {variable!r}: it holds {_listed(arrays)}")
        return arrays[variable]
    if len(arrays) == 1:  # if it is not complex, later checks say so, as for a .npy file
        return next(iter(arrays.values()))
    candidates = [name for name, array in arrays.items() if array.dtype.kind == "c"]
    if len(candidates) == 1:
        return arrays[candidates[0]]
    if candidates:
        complex_ones = _listed({name: arrays[name] for name in candidates})
        raise BadInput(f"{path}: {len(candidates)} complex arrays, {complex_ones}: say which with --variable NAME")
    cure = "IQ must be complex, I + jQ (complex64)"
    named = {name.lower(): name for name in arrays}
    for real, imaginary in _PARTS:
        if real in named and imaginary in named:
            cure += f": store {named[real]} + 1j * {named[imaginary]}"
            break
    raise BadInput(f"{path}: no complex array, it holds {_listed(arrays)}: {cure}")


def _listed(arrays: Mapping[str, NDArray[np.generic]]) -> str:
    parts = [f"{name} {array.dtype} {array.shape}" for name, array in sorted(arrays.items())]
    return ", ".join(parts) or "no array of numbers"


def _damaged(name: object, error: BaseException) -> str:
    first_line = (str(error).splitlines() or [type(error).__name__])[0]
    return f"{name}: damaged or cut short ({first_line}): copy or save it again"
