"""What a training says of the models it made: their figures on the test records, and the table on the terminal."""

from pathlib import Path
from typing import Any

import numpy as np
from bladewing.models.operating import least_named
from numpy.typing import NDArray

from .labels import CLASSES
from .ladder import ACCOUNT, CASCADE, COST_KEY, STAGES_KEY
from .terminal import console, print_table

#: A cascade whose second model is asked about more records than this is of no use.
MOST_ASKED = 0.9


def covered(
    probabilities: NDArray[np.floating], labels: NDArray[np.integer], limits: NDArray[np.floating]
) -> list[float]:
    """Share of the records whose prediction set holds their class, by thresholds of shape (coverages, records, 3)."""
    each = np.arange(len(labels))
    truth = probabilities[each, labels]
    return [float(np.mean(truth >= of[each, labels])) for of in limits]


def figures(
    probabilities: NDArray[np.floating],
    labels: NDArray[np.integer],
    accept: NDArray[np.floating],
    false_alarm: float,
) -> dict[str, Any]:
    """The figures that the table quotes: `accept` sets what is named, `false_alarm` the threshold for detection."""
    winner = probabilities.argmax(axis=1)
    recall = [float(np.mean(winner[labels == index] == index)) for index in range(len(CLASSES))]
    threshold = least_named(probabilities[labels != 0, 0], false_alarm)
    named = probabilities.max(axis=1) >= np.broadcast_to(accept, probabilities.shape)[np.arange(len(winner)), winner]
    return {
        "balanced_accuracy": round(float(np.mean(recall)), 4),
        "recall": {name: round(value, 4) for name, value in zip(CLASSES, recall, strict=True)},
        "uav_detection": round(float(np.mean(probabilities[labels == 0, 0] >= threshold)), 4),
        "false_uav": round(float(np.mean(((winner == 0) & named)[labels != 0])), 4),
        "named_share": round(float(np.mean(named)), 4),
        "named_accuracy": round(float(np.mean((winner == labels)[named])), 4) if named.any() else None,
    }


def print_account(account: dict[str, Any], out: Path) -> None:
    """Write the table of all models to the terminal."""
    from rich.table import Table

    title = f"{account['records']['test']} test records, looked at once"
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("model", no_wrap=True)
    for column in ("accuracy", "found", "false", "named", "right", "ECE", "kB", "s", "FFTs"):
        table.add_column(column, justify="right", no_wrap=True)
    cascade = account[CASCADE]
    for name, model in [*account["models"].items(), *([(CASCADE, cascade)] if cascade else [])]:
        figures = model["test"]
        right = figures["named_accuracy"]
        table.add_row(
            name,
            f"{figures['balanced_accuracy']:.3f}",
            f"{figures['uav_detection']:.3f}",
            f"{figures['false_uav']:.3f}",
            f"{figures['named_share']:.3f}",
            "-" if right is None else f"{right:.3f}",
            f"{figures['expected_calibration_error']:.3f}",
            f"{model['bytes'] / 1000:.0f}" if "bytes" in model else "",
            f"{model['seconds']:.0f}" if "seconds" in model else "",
            f"{model[COST_KEY]:.1f}",
        )
    printed = console()
    printed.print(title)
    print_table(printed, table)
    printed.print(
        "accuracy  balanced over the classes; radars of 2 to 100 GHz, dwells from 5 ms,\n"
        "          SNR from -20 dB: many records hold nothing to see\n"
        f"found     UAVs found where {100 * account['false_alarm']:.3g}% of birds and clutter would be called UAV\n"
        "false     birds and clutter that are named UAV\n"
        "named     records not answered 'unknown'; right: how many of these are right\n"
        "ECE       expected calibration error of the probabilities\n"
        "kB, s     size of the file; seconds that training it took\n"
        "FFTs      time of a record, samples to answer, over that of its bare FFT"
    )
    if cascade:
        first, second = cascade[STAGES_KEY]
        useless = " (so many that the second alone is no slower)" if cascade["asked"] > MOST_ASKED else ""
        printed.print(
            f"cascade   {first} first, then {second}\n"
            f"          about the {cascade['asked']:.0%} that it is not sure of{useless}"
        )
    since = " since the interruption" if account["resumed"] else ""
    took = f"trained in {account['seconds']['all']:.0f} s{since}"
    printed.print(f"Models and {ACCOUNT} are in {out}; {took}.", soft_wrap=True)
