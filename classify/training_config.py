"""The settings of a training: one validated table, from defaults, a TOML file and the command line."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from .errors import BadInput
from .limits import LEAST_RECORDS, SEEDS
from .settings_file import build_settings, named

#: What `--quick` changes: enough to see every step work, not a model to use.
QUICK = {"records": 3000, "epochs": 3, "iterations": 20}


class TrainingConfig(BaseModel):
    """Settings of a training; every field has a default and unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    #: Records that are trained on; those for validation, calibration and test come on top.
    records: Annotated[int, Field(ge=LEAST_RECORDS, le=10_000_000)] = 30_000
    seed: Annotated[int, Field(ge=0, lt=SEEDS)] = 0
    #: Passes of a network over the records; a network with a teacher makes twice as many.
    epochs: Annotated[int, Field(ge=1, le=1000)] = 8
    #: Epochs in a row without a lower validation loss after which a network stops; 0: never.
    patience: Annotated[int, Field(ge=0, le=1000)] = 20
    #: Records a step of a network.
    batch: Annotated[int, Field(ge=2, le=8192)] = 256
    learning_rate: Annotated[float, Field(gt=0, le=1)] = 0.02
    weight_decay: Annotated[float, Field(ge=0, le=10)] = 0.3
    #: Whether networks compute in bfloat16 while they learn: faster where the processor or the GPU has it, slower else.
    bfloat16: bool = False
    #: iterations: rounds of a boosted model, each of one tree a class; leaves: leaves of a tree.
    iterations: Annotated[int, Field(ge=1, le=1000)] = 80
    leaves: Annotated[int, Field(ge=2, le=256)] = 15
    #: Share of the records named a class that must be right: it sets the thresholds under which "unknown" is said.
    precision: Annotated[float, Field(gt=1 / 3, le=1)] = 0.9
    #: Largest share of birds and clutter that may be named UAV: the threshold on "uav" keeps to this as well.
    false_alarm: Annotated[float, Field(gt=0, lt=1)] = 0.01
    models: Annotated[tuple[str, ...], Field(min_length=1, strict=False)] = (
        "features-linear",
        "features-boosted",
        "spectrum-cnn-fast",
        "spectrum-cnn",
        "joint-boosted",
        "image-cnn",
    )

    @property
    def held_out(self) -> int:
        """Records of each of the three sets that are not trained on: validation, calibration and test."""
        return max(LEAST_RECORDS, min(self.records // 6, 30_000))

    @property
    def sets(self) -> dict[str, int]:
        """Records of each set: purpose (see `bladewing.simulate.stream`) to number."""
        return {"train": self.records, **dict.fromkeys(("validate", "calibrate", "test"), self.held_out)}


def training_config(
    file: Path | None = None,
    *,
    records: int | None = None,
    seed: int | None = None,
    quick: bool = False,
    stored: Mapping[str, int] | None = None,
) -> TrainingConfig:
    """Put the settings together: defaults, then `--quick`, then the file, then the options.

    Parameters
    ----------
    file : Path, optional
        TOML file with fields of `TrainingConfig` at its top level.
    records, seed : int, optional
        Override the file.
    quick : bool
        Start from few records and epochs.
    stored : mapping of str to int, optional
        Records and seed of the data set that is trained on; the file and the options may only say the same.

    Returns
    -------
    TrainingConfig

    Raises
    ------
    BadInput
        If the file cannot be read, is not TOML, or a field is unknown or out of its range.
    """
    from bladewing.models import LADDER

    defaults = QUICK if quick else {}
    config = build_settings(TrainingConfig, file, defaults, stored=stored, records=records, seed=seed)
    place = named("models", file, {})
    for name in config.models:
        if name not in LADDER:
            raise BadInput(f"{place} holds {name!r}: it may hold {', '.join(LADDER)}")
        if config.models.count(name) > 1:
            raise BadInput(f"{place} holds {name!r} twice: name each once")
    return config
