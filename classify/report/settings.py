"""How much a report measures: one validated table, from defaults, a TOML file and the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from ..limits import SEEDS
from ..settings_file import build_settings

#: Settings under `--quick`: enough records to draw every figure, but with wide intervals.
QUICK: dict[str, Any] = {
    "records": 2400,
    "reference_records": 128,
    "chain_s": 4.0,
    "stft_s": 2.0,
    "least_rounds": 100,
    "repeats": 100,
    "front_train": 1500,
    "front_test": 200,
    "front_epochs": 6,
    "front_s": 0.5,
    "family_train": 1500,
}

Seconds = Annotated[float, Field(gt=0, le=3600)]


class ReportConfig(BaseModel):
    """Settings of a report; every field has a default and unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    #: Root seed of the test records.
    seed: Annotated[int, Field(ge=0, lt=SEEDS)] = 0
    #: Test records of any radar in the envelope.
    records: Annotated[int, Field(ge=3, le=10_000_000)] = 30_000
    #: Records that are timed, weighed and shown.
    reference_records: Annotated[int, Field(ge=64, le=100_000)] = 512
    #: Time to spend on the timings of the models, for each batch size [s].
    chain_s: Seconds = 30.0
    #: Time to spend on FFT against STFT, for each record length [s].
    stft_s: Seconds = 30.0
    #: Fewest rounds of the timings of the models, however long they take.
    least_rounds: Annotated[int, Field(ge=1, le=100_000)] = 300
    #: Fewest repeats of the FFT and STFT timings, however long they take; the paper made 1000.
    repeats: Annotated[int, Field(ge=1, le=1000)] = 1000
    #: Training records of each network of the front, all dwells together.
    front_train: Annotated[int, Field(ge=210, le=10_000_000)] = 21_000
    #: Test records of each dwell of the front.
    front_test: Annotated[int, Field(ge=6, le=10_000_000)] = 3000
    #: Passes over the training records.
    front_epochs: Annotated[int, Field(ge=1, le=1000)] = 12
    #: Time to spend on the timings of each dwell of the front and batch size [s].
    front_s: Seconds = 5.0
    #: Training records of the left-out-family comparison, before a family is removed; as many records test it.
    family_train: Annotated[int, Field(ge=600, le=10_000_000)] = 24_000


def report_config(file: Path | None = None, *, seed: int | None = None, quick: bool = False) -> ReportConfig:
    """Put the settings together: defaults, then `--quick`, then the file, then the options.

    Parameters
    ----------
    file : Path, optional
        TOML file with fields of `ReportConfig` at its top level.
    seed : int, optional
        Overrides the file.
    quick : bool
        Start from few records and short timings.

    Returns
    -------
    ReportConfig

    Raises
    ------
    BadInput
        If the file cannot be read, is not TOML, or a field is unknown or out of its range.
    """
    return build_settings(ReportConfig, file, QUICK if quick else {}, seed=seed)
