"""Real files of every kind that is read, mutations of them, and the readers that must accept or refuse each."""

import contextlib
import io
import json
import shutil
import signal
import struct
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

import numpy as np
from bladewing.classify import Classifier
from bladewing.classify import dataset as data_sets
from bladewing.classify.errors import BadInput
from bladewing.classify.progress import Progress
from bladewing.classify.recording import load_recording
from bladewing.classify.training_config import training_config
from bladewing.models.seal import PLACEHOLDER, seal, verify
from bladewing.simulate.scene import Scene, SceneError

#: Longest that a reader may take over one small file [s]; machines are shared.
HANG_S = 20

#: Longest line of a refusal [characters]; it may quote text from the file.
LONGEST_LINE = 6000


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    Parameters
    ----------
    seeds
        Contents of real files.
    read
        Writes a content into a folder and reads it; raises BadInput or SceneError if the content is refused.
    """

    seeds: tuple[bytes, ...] = field(repr=False)
    read: Callable[[bytes, Path], object]


class Hang(BaseException):
    """A reader took too long."""


@contextlib.contextmanager
def time_limit(seconds: int = HANG_S) -> Iterator[None]:
    """Raise `Hang` in the main thread after the given number of seconds."""

    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def verdict(reader: Reader, content: bytes, folder: Path) -> str:
    """Read one content and return "read", "refused", "hang", or what went wrong."""
    try:
        with time_limit():
            reader.read(content, folder)
    except (BadInput, SceneError) as refusal:
        problems = refusal.problems if isinstance(refusal, SceneError) else [str(refusal)]
        text = max(problems, key=len)
        # Line breaks in a SceneError are allowed: the command line escapes text quoted from a scene.
        if isinstance(refusal, BadInput) and "\n" in text:
            return f"several lines: {text[:200]!r}"
        return "refused" if len(text) <= LONGEST_LINE else f"a line of {len(text)} characters: {text[:200]!r}"
    except Hang:
        return "hang"
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:300]}"
    return "read"


_NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1)
_WORDS = (
    b"-1", b"1e400", b"nan", b"inf", b"null", b"true", b"[]", b"{}", b"\x00", b"\xff\xfe", b"|O", b"../../", b"9" * 30,
    b"[" * 50, b"'", b'"', b"\n", b"=", b",", b"location",
)  # fmt: skip


def mutate(seeds: tuple[bytes, ...], rng: np.random.Generator) -> bytes:
    """Change a seed at random in ways that break readers: bits, numbers, words, cuts, repeats, splices."""
    content = bytearray(seeds[rng.integers(len(seeds))])
    for _ in range(int(rng.integers(1, 8))):
        if not content:
            break
        # Headers and directories, which matter most, lie at the two ends of a file.
        edge = min(len(content), 400)
        at = int(rng.integers(edge) if rng.random() < 0.5 else rng.integers(len(content)))
        at = len(content) - 1 - at if rng.random() < 0.2 else at
        match int(rng.integers(7)):
            case 0:
                content[at] ^= 1 << int(rng.integers(8))
            case 1:
                width = int(rng.choice([1, 2, 4, 8]))
                number = _NUMBERS[rng.integers(len(_NUMBERS))] & ((1 << 8 * width) - 1)
                content[at : at + width] = number.to_bytes(width, "little" if rng.random() < 0.7 else "big")
            case 2:
                content[at:at] = _WORDS[rng.integers(len(_WORDS))]
            case 3:
                del content[at : at + int(rng.integers(1, 64))]
            case 4:
                del content[at:]
            case 5:
                content[at:at] = content[at : at + int(rng.integers(1, 256))] * int(rng.integers(1, 4))
            case 6:
                other = seeds[rng.integers(len(seeds))]
                start = int(rng.integers(max(1, len(other))))
                content[at : at + 32] = other[start : start + 32]
    return bytes(content)


def readers(place: Path) -> dict[str, Reader]:
    """Give every reader with its seeds, which are made in a folder."""
    place.mkdir(parents=True, exist_ok=True)
    return {
        "npy": Reader(_npy_seeds(), _recording("x.npy")),
        "npz": Reader((*_npz_seeds(), *_npy_seeds()), _read_npz),
        "mat": Reader(_mat_seeds(), _recording("x.mat")),
        "sigmf": Reader(_sigmf_seeds(), _read_sigmf_pair),
        "sigmf archive": Reader((*_archive_seeds(), *_sigmf_seeds()), _read_sigmf_archive),
        "toml": Reader(_toml_seeds(), _read_toml),
        "model": Reader(_model_seeds(), _read_model),
        "data set": Reader(_dataset_seeds(place / "data set"), lambda content, at: _read_dataset(content, at, place)),
    }


def _iq() -> np.ndarray:
    rng = np.random.default_rng(0)
    return (rng.normal(size=200) + 1j * rng.normal(size=200)).astype(np.complex64)


def _saved(save: Callable[[io.BytesIO], None]) -> bytes:
    file = io.BytesIO()
    save(file)
    return file.getvalue()


def _npy_seeds() -> tuple[bytes, ...]:
    iq = _iq()
    arrays = (iq, iq.astype(np.complex128), np.asfortranarray(iq.reshape(1, -1)), np.zeros(3, [("a", "<c8")]))
    return tuple(_saved(lambda file, one=one: np.save(file, one)) for one in arrays)


def _npz_seeds() -> tuple[bytes, ...]:
    iq = _iq()
    return (
        _saved(lambda file: np.savez(file, iq=iq)),
        _saved(lambda file: np.savez_compressed(file, iq=iq, note=np.arange(3))),
    )


def _mat_seeds() -> tuple[bytes, ...]:
    from scipy.io import savemat

    iq = _iq()
    values = {"iq": iq, "prf": 25e3, "name": "x", "more": {"a": iq}}
    return (
        _saved(lambda file: savemat(file, values)),
        _saved(lambda file: savemat(file, values, do_compression=True)),
        _saved(lambda file: savemat(file, {"iq": iq}, format="4")),
    )


def _metadata(**changes: object) -> bytes:
    general = {"core:datatype": "cf32_le", "core:version": "1.2.0", "core:sample_rate": 25e3} | changes
    capture = {"core:sample_start": 0, "core:frequency": 9.85e9}
    note = {"core:sample_start": 0, "core:sample_count": 10, "core:label": "x"}
    return json.dumps({"global": general, "captures": [capture], "annotations": [note]}).encode()


#: Separates the metadata and the samples of a SigMF pair in one content, so that one mutation may change both.
_SEAM = b"\x00--seam--\x00"


def _sigmf_seeds() -> tuple[bytes, ...]:
    iq = _iq().tobytes()
    short = np.zeros(400, "<i2").tobytes()
    return (_metadata() + _SEAM + iq, _metadata(**{"core:datatype": "ci16_le", "core:offset": 5}) + _SEAM + short)


def _archive_seeds() -> tuple[bytes, ...]:
    return _packed({"x/x.sigmf-meta": _metadata(), "x/x.sigmf-data": _iq().tobytes()})


def _packed(members: dict[str, bytes]) -> tuple[bytes, ...]:
    """Make an archive of each kind, preceded by a letter that tells the kind."""
    seeds = []
    for mode, kind in (("w:", b"T"), ("w:gz", b"G"), ("w:xz", b"X")):
        file = io.BytesIO()
        with tarfile.open(fileobj=file, mode=mode) as tar:  # type: ignore[call-overload]
            for name, content in members.items():
                info = tarfile.TarInfo(name)
                info.size = len(content)
                tar.addfile(info, io.BytesIO(content))
        seeds.append(kind + file.getvalue())
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return (*seeds, b"Z" + file.getvalue())


def _toml_seeds() -> tuple[bytes, ...]:
    folder = resources.files("bladewing.simulate") / "scenes"
    scenes = [entry.read_bytes() for entry in folder.iterdir() if entry.name.endswith(".toml")]
    return (*scenes, b'records = 3000\nseed = 1\nepochs = 2\nmodels = ["features-linear"]\nlearning_rate = 1e-3\n')


def _model_seeds() -> tuple[bytes, ...]:
    folder = resources.files("bladewing.models.pretrained")
    return ((folder / "spectrum-cnn-fast.onnx").read_bytes(), (folder / "spectrum-cnn.onnx").read_bytes())


def _dataset_seeds(place: Path) -> tuple[bytes, ...]:
    """Make a data set; give its manifest and each file of a shard, preceded by a digit that tells which file it is."""
    plan = data_sets.DataSetPlan(1, dict.fromkeys(data_sets.PURPOSES, 6))
    data_sets.write_dataset(place, plan, Progress(visible=False), workers=1)
    names = (data_sets.MANIFEST, "train-00000.iq.npy", "train-00000.table.npy")
    return tuple(str(number).encode() + (place / name).read_bytes() for number, name in enumerate(names))


def _recording(name: str) -> Callable[[bytes, Path], object]:
    def read(content: bytes, folder: Path) -> object:
        (folder / name).write_bytes(content)
        return load_recording(folder / name, carrier_hz=9.85e9, prf_hz=25e3)

    return read


def _read_sigmf_pair(content: bytes, folder: Path) -> object:
    meta, _, data = content.partition(_SEAM)
    (folder / "x.sigmf-meta").write_bytes(meta)
    (folder / "x.sigmf-data").write_bytes(data)
    return load_recording(folder / "x.sigmf-meta")


def _read_npz(content: bytes, folder: Path) -> object:
    if not content.startswith(b"PK"):  # an array: packed after its mutation, or the archive's checksum would refuse it
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("iq.npy", content)
        content = file.getvalue()
    return _recording("x.npz")(content, folder)


def _read_sigmf_archive(content: bytes, folder: Path) -> object:
    if _SEAM in content:  # a pair: packed after its mutation
        meta, _, data = content.partition(_SEAM)
        content = _packed({"x/x.sigmf-meta": meta, "x/x.sigmf-data": data})[len(content) % 4]
    suffix = {b"G": ".gz", b"X": ".xz", b"Z": ".zip"}.get(content[:1], "")
    path = folder / f"x.sigmf{suffix}"
    path.write_bytes(content[1:])
    try:
        return load_recording(path)
    finally:
        path.unlink()


def _read_toml(content: bytes, folder: Path) -> object:
    path = folder / "x.toml"
    path.write_bytes(content)
    if b"radar" in content:
        scene = Scene.load(path)
        return scene.warnings()
    return training_config(path)


def _read_model(content: bytes, folder: Path) -> object:
    path = folder / "x.onnx"
    # Half of them are sealed again, as a forger would do, so that the checks behind the seal are tried too.
    if len(content) % 2:
        with contextlib.suppress(ValueError):
            content = resealed(content)
    path.write_bytes(content)
    return Classifier.load(path)


def resealed(content: bytes) -> bytes:
    """Give a model a seal that fits its content."""
    with contextlib.suppress(ValueError):
        return seal(content.replace(verify(content).encode(), PLACEHOLDER.encode()))
    at = content.find(b"bladewing_sha256")
    if at < 0:
        raise ValueError("no seal")
    return seal(content[: at + 18] + PLACEHOLDER.encode() + content[at + 82 :])


def _read_dataset(content: bytes, folder: Path, place: Path) -> object:
    import hashlib

    target = folder / "data"
    if not target.exists():
        shutil.copytree(place / "data set", target)
    names = (data_sets.MANIFEST, "train-00000.iq.npy", "train-00000.table.npy")
    originals = [(place / "data set" / name).read_bytes() for name in names]
    which, body = min(max(content[0] - 48, 0), 2) if content else 0, content[1:]
    files = dict(zip(names, originals, strict=True)) | {names[which]: body}
    if which and len(body) % 2:  # make the digest fit, as a forger would do
        field = ("iq_sha256", "table_sha256")[which - 1]
        manifest = json.loads(originals[0])
        manifest["shards"]["train-00000"][field] = hashlib.sha256(body).hexdigest()
        files[names[0]] = json.dumps(manifest).encode()
    for name, text in files.items():
        (target / name).write_bytes(text)
    data = data_sets.DataSet(target)
    return [list(source()) for source in data.sources("train")]


def tar_with(name: bytes, size: int, kind: bytes = b"0") -> bytes:
    """Make a tar of one member whose header claims any name, size and kind; the member has no content."""
    header = bytearray(512)
    header[: len(name)] = name
    header[100:108] = b"0000644\0"
    header[124:136] = b"%011o\0" % size if size < 1 << 33 else b"\x80" + size.to_bytes(11, "big")
    header[156:157] = kind
    header[257:265] = b"ustar  \0"
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\0 " % sum(header)
    return bytes(header) + bytes(1024)


def npy_claiming(shape: str, descr: str = "'<c8'", body: bytes = b"") -> bytes:
    """Make an .npy whose header claims any shape and type."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n".encode("latin-1")
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + body
