"""A rendered scene as a SigMF recording, with the truth in its annotations."""

import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import BadInput, unwritable
from .files import read_bounded, settle, write_together
from .limits import MOST_TEXT_BYTES
from .sigmf_file import ARCHIVES, DATA, META

if TYPE_CHECKING:
    from bladewing.simulate.render import Rendering
    from bladewing.simulate.scene import Scene

#: The `core:recorder` of a rendering's metadata.
RECORDER = "bladewing simulate"

#: Version of the fields under "bladewing:".
EXTENSION_VERSION = "1.0.0"


def write_rendering(stem: Path, rendering: "Rendering", scene: "Scene", seed: int) -> list[Path]:
    """Write a rendering as NAME.sigmf-data and NAME.sigmf-meta, both or neither.

    `core:sample_rate` is the PRF, the capture's `core:frequency` the carrier; each part of the scene is an annotation
    over all samples with its name as the label and its truth under "bladewing:".

    Parameters
    ----------
    stem
        Path without the suffix; a .sigmf, .sigmf-meta or .sigmf-data at its end, or the suffix of an archive, is taken
        off.
    rendering, scene, seed
        The rendering, its scene and its seed.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    BadInput
        The folder is missing or cannot be written to, a sample is not finite, or a recording of that name was not made
        by a rendering.
    """
    name = stem.name.removesuffix(next(filter(stem.name.endswith, (META, DATA, *ARCHIVES)), ""))
    if not name or name == "..":
        raise BadInput(f"{stem}: no name for the recording: give --out NAME")
    if stem.is_dir():
        raise BadInput(f"{stem} is a folder: name the recording in it: give --out {stem / 'NAME'}")
    if not np.isfinite(rendering.iq).all():
        raise BadInput(f"{stem}: the scene's samples exceed what complex64 holds: lower its levels")
    with suppress(OSError):  # a folder that is missing or cannot be written to is refused below
        settle(stem.parent)
    if foreign := _foreign(stem.parent / f"{name}{META}", stem.parent / f"{name}{DATA}"):
        raise BadInput(f"{foreign} is there and was not simulated: it is not written over: give another --out NAME")
    data = rendering.iq.astype("<c8").tobytes()
    meta = metadata(rendering, scene, seed, hashlib.sha512(data).hexdigest())
    text = json.dumps(meta, indent=2, allow_nan=False) + "\n"
    files: dict[str, bytes | str] = {f"{name}{DATA}": data, f"{name}{META}": text}
    try:
        write_together(stem.parent, files)
    except OSError as error:
        raise unwritable(stem, error, "give a folder that can be written to") from None
    return [stem.parent / file for file in files]


def _foreign(meta: Path, data: Path) -> Path | None:
    """The file of a recording that is there and was not made by a rendering, or None."""
    if not meta.exists():
        return data if data.exists() else None
    try:
        recorder = json.loads(read_bounded(meta, MOST_TEXT_BYTES))["global"]["core:recorder"]
    except (OSError, ValueError, LookupError, TypeError):
        return meta
    return None if recorder == RECORDER else meta


def metadata(rendering: "Rendering", scene: "Scene", seed: int, sha512: str) -> dict[str, Any]:
    """SigMF metadata of a rendering, ready for JSON."""
    radar = rendering.radar
    span = {"core:sample_start": 0, "core:sample_count": radar.pulses}
    return {
        "global": {
            "core:datatype": "cf32_le",
            "core:sample_rate": radar.prf_hz,
            "core:version": "1.2.0",
            "core:sha512": sha512,
            "core:description": scene.title or "simulated scene",
            "core:recorder": RECORDER,
            "core:extensions": [{"name": "bladewing", "version": EXTENSION_VERSION, "optional": True}],
            "bladewing:seed": seed,
            "bladewing:scene": scene.model_dump(mode="json"),
            "bladewing:warnings": rendering.warnings,
        },
        "captures": [{"core:sample_start": 0, "core:frequency": radar.carrier_hz}],
        "annotations": [
            {
                **span,
                "core:label": part["name"],
                "core:comment": f"{part['label']}: {part['kind']}",
                **{f"bladewing:{field}": value for field, value in part.items() if field != "name"},
            }
            for part in rendering.truth
        ],
    }
