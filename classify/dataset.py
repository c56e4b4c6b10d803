"""Labelled records on the disk: a folder of shards and a manifest that lists the ones that are whole.

The manifest is written first, with no shard in it, and again after each shard, in one step each time. Whatever
interrupts the work, what it lists is whole; the same command goes on from there, and since every record depends on the
seed, the purpose and its number alone, the bytes are those of a run that nothing interrupted.
"""

import errno
import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bladewing.simulate import Radar, draw_records, stream
from bladewing.simulate.dataset import KIND_CLASS, RADAR_GROUP, Records, draw_radar

from .errors import BadInput, unreadable, unwritable
from .files import clear_litter, no_empty_folder, only_writer, read_bounded, settle, write_whole
from .progress import Progress
from .shards import Contents, intact, read_shard, shard_bytes, write_shard
from .training_config import TrainingConfig, training_config
from .workers import in_order

#: Name of the manifest.
MANIFEST = "dataset.json"

#: Records of a shard: whole radar groups, some 17 MB of samples.
SHARD_RECORDS = 40 * RADAR_GROUP

#: The sets that a training takes, each from random streams of its own.
PURPOSES = ("train", "validate", "calibrate", "test")

_FORMAT = 1
_MANIFEST_BYTES = 64 << 20
_MOST = 10_000_000  # most records of a set; it bounds what a manifest can ask for


@dataclass(frozen=True)
class Shard:
    """A run of consecutive records of one purpose."""

    purpose: str
    start: int
    records: int

    @property
    def name(self) -> str:
        """Stem of its files."""
        return f"{self.purpose}-{self.start // SHARD_RECORDS:05d}"


@dataclass(frozen=True)
class DataSetPlan:
    """What a data set holds.

    Parameters
    ----------
    seed : int
        Root of all randomness.
    records : dict of str to int
        Purpose to number of records.
    """

    seed: int
    records: dict[str, int]

    @classmethod
    def of(cls, settings: TrainingConfig) -> "DataSetPlan":
        """What `bladewing train` draws with these settings."""
        return cls(settings.seed, settings.sets)

    def shards(self, *purposes: str) -> list[Shard]:
        """The shards of these purposes, by default of all, in order."""
        return [
            Shard(purpose, start, min(SHARD_RECORDS, count - start))
            for purpose, count in self.records.items()
            if not purposes or purpose in purposes
            for start in range(0, count, SHARD_RECORDS)
        ]


class DataSet:
    """A data set on the disk, complete, ready to be read. Its manifest is checked when it is opened.

    Parameters
    ----------
    folder : Path
        As `bladewing dataset` wrote it.

    Attributes
    ----------
    plan : DataSetPlan
        What it holds.
    simulator_sha256 : str
        `simulator_digest` of the simulator that wrote it.

    Raises
    ------
    BadInput
        There is no data set, it is not complete, or its manifest is not one.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        manifest = _read_manifest(folder)
        if manifest is None:
            raise BadInput(f"{folder}: holds no {MANIFEST}: give the folder that `bladewing dataset` wrote")
        self.plan, self._contents, self.simulator_sha256 = manifest
        missing = len(self.plan.shards()) - len(self._contents)
        if missing:
            raise BadInput(f"{folder}: not complete, {missing} shards are missing: run `bladewing dataset` again")

    def sources(self, purpose: str) -> list[Callable[[], Iterator[Records]]]:
        """Give, for each shard of a purpose, a function that reads it (see `shards.read_shard`)."""
        shards = self.plan.shards(purpose)
        return [partial(read_shard, self.folder, shard.name, self._contents[shard.name]) for shard in shards]


def run_dataset(
    out: Path,
    *,
    records: int | None = None,
    seed: int | None = None,
    config: Path | None = None,
    progress: bool = True,
) -> DataSetPlan:
    """Write the records that a training with these settings draws, or go on where an earlier run was interrupted.

    Parameters
    ----------
    out : Path
        Folder of the data set; made if it is missing, else empty or begun by the same command.
    records, seed, config
        See `training_config`; fields that do not concern the records have no effect.
    progress : bool
        Show progress on stderr.

    Returns
    -------
    DataSetPlan
        What the folder now holds.

    Raises
    ------
    BadInput
        A setting is wrong, the folder holds something else or cannot be written, or the disk is too small.
    """
    plan = DataSetPlan.of(training_config(config, records=records, seed=seed))
    with Progress(visible=progress) as bars:
        written = write_dataset(Path(out), plan, bars)
    count, shards = sum(plan.records.values()), len(plan.shards())
    bars.say(f"{out}: complete: {count} records in shards: {shards}, of which {written} were written now")
    return plan


def write_dataset(folder: Path, plan: DataSetPlan, bars: Progress, *, workers: int | None = None) -> int:
    """Write the missing shards of a data set; return their number.

    Parameters
    ----------
    folder, plan, bars
        Where, what, and where progress is shown.
    workers : int, optional
        Processes, by default one a processor; no byte depends on it.

    Raises
    ------
    BadInput
        As `run_dataset`.
    """
    with _writable(folder):
        contents = _begun(folder, plan, bars)
        missing = [shard for shard in plan.shards() if shard.name not in contents]
        _require_room(folder, plan, missing)
        if missing:
            _write_manifest(folder, plan, contents)
            total, done = sum(shard.records for shard in missing), 0
            with bars.phase(f"write {total} records", total) as on_done:
                drawn = in_order(partial(_draw, folder, plan.seed), missing, workers)
                for shard, written in zip(missing, drawn, strict=True):
                    contents[shard.name] = written
                    _write_manifest(folder, plan, contents)
                    done += shard.records
                    on_done(done)
    return len(missing)


def _draw(folder: Path, seed: int, shard: Shard) -> Contents:
    return write_shard(folder, shard.name, stream(seed, shard.purpose, shard.records, start=shard.start))


@contextmanager
def _writable(folder: Path) -> Iterator[None]:
    """Context in which no other process writes to a folder; errors of the disk become errors of one line."""
    with no_empty_folder(folder) as made:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            settle(folder)  # does another command's pending renames: its files are no litter
            with only_writer(folder, wait=False):
                yield
        except BlockingIOError:
            made.clear()  # keep it: a process that has just begun may have written nothing yet
            cure = "let it finish, or give another folder"
            raise BadInput(f"{folder}: another process is writing there: {cure}") from None
        except OSError as error:
            never = error.errno in (errno.EEXIST, errno.ENOTDIR, errno.EACCES, errno.EPERM, errno.EROFS)
            cure = "give another folder" if never else "what is whole stays; the same command goes on"
            raise unwritable(folder, error, cure) from None


def _begun(folder: Path, plan: DataSetPlan, bars: Progress) -> dict[str, Contents]:
    """The shards that an earlier run left whole."""
    manifest = _read_manifest(folder)
    mixture: BadInput | None = None  # shards of two simulators must not mix; a complete set may be another's
    if manifest is None:
        if any(not path.name.startswith(".bladewing-") for path in folder.iterdir()):
            raise BadInput(f"{folder}: not empty, and it holds no {MANIFEST}: give a new folder")
        contents: dict[str, Contents] = {}
    else:
        found, contents, simulator = manifest
        if found != plan:
            raise BadInput(
                f"{folder}: holds another data set (seed {found.seed}, records {found.records}; asked for: seed "
                f"{plan.seed}, records {plan.records}): give another folder"
            )
        if simulator != simulator_digest():
            mixture = BadInput(f"{folder}: begun with another simulator or on another machine: give another folder")
            if len(contents) < len(plan.shards()):
                raise mixture
    clear_litter(folder)
    if contents:
        with bars.phase(f"check {len(contents)} shards", len(contents)) as on_done:
            for number, (name, listed) in enumerate(list(contents.items())):
                if not intact(folder, name, listed):
                    if mixture:
                        raise mixture
                    del contents[name]
                on_done(number + 1)
    return contents


def _require_room(folder: Path, plan: DataSetPlan, missing: list[Shard]) -> None:
    """Refuse at once what the disk cannot hold: the radars, and so the sizes, are known before a record is drawn."""
    needed = 0
    for shard in missing:
        samples = 0
        for at in range(shard.start, shard.start + shard.records, RADAR_GROUP):
            inside = min(RADAR_GROUP, shard.start + shard.records - at)
            samples += inside * draw_radar(plan.seed, shard.purpose, at // RADAR_GROUP).pulses
        needed += shard_bytes(shard.records, samples)
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise BadInput(
            f"{folder}: {needed / 1e9:.3g} GB are needed, {free / 1e9:.3g} GB are free: make room or draw fewer"
        )


@lru_cache(maxsize=1)
def simulator_digest() -> str:
    """Digest of a few records of every kind; it changes with the simulator and with the rounding of the machine."""
    digest = hashlib.sha256()
    for kind in KIND_CLASS:
        digest.update(draw_records(Radar(10e9, 20e3, 64), 4, 0, purpose="bench", kind=kind).iq.astype("<c8").tobytes())
    return digest.hexdigest()


def _write_manifest(folder: Path, plan: DataSetPlan, contents: dict[str, Contents]) -> None:
    manifest = {
        "product": "bladewing dataset",
        "format": _FORMAT,
        "seed": plan.seed,
        "records": plan.records,
        "shard_records": SHARD_RECORDS,
        "simulator_sha256": simulator_digest(),
        "versions": {name: version(name) for name in ("bladewing", "numpy")},
        "shards": {shard.name: asdict(contents[shard.name]) for shard in plan.shards() if shard.name in contents},
    }
    write_whole(folder / MANIFEST, json.dumps(manifest, indent=1, allow_nan=False) + "\n")


def _read_manifest(folder: Path) -> tuple[DataSetPlan, dict[str, Contents], str] | None:
    """What a manifest says, every field checked; None where there is none."""
    path = folder / MANIFEST
    try:
        manifest = json.loads(read_bounded(path, _MANIFEST_BYTES))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise unreadable(path, error) from None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the manifest of a data set: {error or 'nested too deep'}") from None
    try:
        return _checked(manifest)
    except ValueError as error:
        raise BadInput(f"{path}: not the manifest of a data set: {error}") from None


def _checked(manifest: Any) -> tuple[DataSetPlan, dict[str, Contents], str]:
    if not isinstance(manifest, dict) or manifest.get("product") != "bladewing dataset":
        raise ValueError("its product is not 'bladewing dataset'")
    for field, expected in (("format", _FORMAT), ("shard_records", SHARD_RECORDS)):
        if manifest.get(field) != expected:
            raise ValueError(f"{field} is {manifest.get(field)!r:.60}: this version reads {expected}")
    records = manifest.get("records")
    if not isinstance(records, dict) or list(records) != list(PURPOSES):
        raise ValueError(f"records must hold {', '.join(PURPOSES)}")
    plan = DataSetPlan(
        _whole(manifest.get("seed"), "seed", 0),
        {purpose: _whole(count, f"records of {purpose}", 1, _MOST) for purpose, count in records.items()},
    )
    shards = {shard.name: shard for shard in plan.shards()}
    listed = manifest.get("shards")
    if not isinstance(listed, dict) or not set(listed) <= set(shards):
        raise ValueError("it lists shards that such a data set does not have")
    contents = {}
    for name, entry in listed.items():
        if not isinstance(entry, dict) or set(entry) != set(Contents.__annotations__):
            raise ValueError(f"shard {name} must hold {', '.join(Contents.__annotations__)}")
        if entry["records"] != shards[name].records:
            raise ValueError(f"shard {name} must hold {shards[name].records} records")
        _whole(entry["samples"], f"samples of {name}", 1, 1 << 30)
        for field in ("iq_sha256", "table_sha256"):
            _digest(entry[field], f"{field} of {name}")
        contents[name] = Contents(**entry)
    return plan, contents, _digest(manifest.get("simulator_sha256"), "simulator_sha256")


def _whole(value: Any, name: str, least: int, most: int | None = None) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < least or (most is not None and value > most):
        raise ValueError(f"{name} is {value!r:.60}: it must be a whole number from {least}")
    return value


def _digest(value: Any, name: str) -> str:
    if not isinstance(value, str) or len(value) != 64 or not set(value) <= set("0123456789abcdef"):
        raise ValueError(f"{name} is {value!r:.60}: it must be 64 hexadecimal digits")
    return value
