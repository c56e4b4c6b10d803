"""What each part of the evidence brings `spectrum-cnn`: trained with it and without, on the same records.

Run: python -m tests.benchmarks.ablation_table [--records N] [--epochs N] [--seeds N]. The table it wrote last stands in
docs/ablation.md. A part of the measurements is taken away by holding it at zero.
"""

import argparse
from collections.abc import Callable

import numpy as np
from bladewing.classify.gather import Gathered, gather
from bladewing.classify.train_network import CLASS_OF_KIND, kinds_of
from bladewing.features.schema import FEATURES, LEVEL_CHANNELS
from bladewing.models.augment import VelocityMirror
from bladewing.models.calibration import softmax
from bladewing.models.cnn import SpectrumNet
from bladewing.models.training import TrainingData, TrainingOptions, network_scores, train_network
from numpy.typing import NDArray
from sklearn.metrics import log_loss

from .baselines_table import judged

#: Group of measurements to a test of whether a measurement's name belongs to it.
GROUPS: dict[str, Callable[[str], bool]] = {
    "comb (chopping frequency, its strength)": lambda name: name.startswith("chopping"),
    "spread (smearing index)": lambda name: name == "smearing_index",
    "band (bandwidth, energy, occupancy)": lambda name: name.startswith(("bandwidth", "span", "energy", "occupancy")),
    "notch residual": lambda name: name.startswith("notch_residual"),
    "levels of bands of speed": lambda name: name.startswith(("strong_", "weak_")),
    "change over the dwell": lambda name: name.startswith(("change_", "centroid_", "busy_")),
}

#: Inputs of each trial. "levels" are the spectrum's first channels; "change" are these and the next one.
TRIALS = {
    "levels": ("levels",),
    "levels, change": ("change",),
    "levels, change, parts": ("spectrum",),
    "levels, cadence": ("levels", "cadence"),
    "levels, cadence, combs": ("levels", "cadence", "combs"),
    "spectrum, cadence": ("spectrum", "cadence"),
    "spectrum, measurements": ("spectrum", "features"),
    "all without parts": ("change", "cadence", "combs", "features"),
    "all without combs": ("spectrum", "cadence", "features"),
    "all": ("spectrum", "cadence", "combs", "features"),
}

DRAWN = TRIALS["all"]

#: Name of the trial whose network is trained on classes alone; the others learn kinds too, as the shipped networks do.
CLASSES_TOLD = "all, told classes and no kinds"


def inputs_of(part: Gathered, names: tuple[str, ...], held: NDArray[np.bool_]) -> dict[str, NDArray]:
    """Give the named inputs; measurements marked in `held` are set to zero."""
    spectrum = part.inputs["spectrum"]
    given = part.inputs | {"levels": spectrum[:, :LEVEL_CHANNELS], "change": spectrum[:, : LEVEL_CHANNELS + 1]}
    given["features"] = np.where(held, np.float32(0), given["features"])
    return {name: given[name] for name in names}


def trial(
    sets: dict[str, Gathered],
    names: tuple[str, ...],
    held: NDArray[np.bool_],
    seed: int,
    epochs: int,
    *,
    kinds: bool = True,
) -> tuple[float, float, float, float]:
    """Train one network; give balanced accuracy, half its 95 % interval, UAVs found at 1 % and nats per record."""
    train, validate, test = (inputs_of(sets[purpose], names, held) for purpose in ("train", "validate", "bench"))
    shapes = {name: values.shape[1:] for name, values in train.items()}
    net = SpectrumNet(shapes, seed=seed, **({"kinds": CLASS_OF_KIND} if kinds else {}))
    train_network(
        net,
        TrainingData(train, sets["train"].labels, kinds_of(sets["train"]) if kinds else None),
        (validate, sets["validate"].labels),
        TrainingOptions(epochs),
        seed=seed,
        augment=VelocityMirror(names[0], -1),
    )
    scores, labels = network_scores(net, test), sets["bench"].labels
    return (*judged(scores, labels), log_loss(labels, softmax(scores)))


def main() -> None:
    """Write the table to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=60_000, help="training records")
    parser.add_argument("--epochs", type=int, default=12)
    parser.add_argument("--seeds", type=int, default=1, help="networks a row; the mean is shown")
    options = parser.parse_args()
    counts = {"train": options.records, "validate": options.records // 6, "bench": options.records // 3}
    sets = {purpose: gather(9, purpose, count, names=DRAWN) for purpose, count in counts.items()}
    print(
        f"{options.records} training records of the whole envelope, {counts['bench']} others; {options.epochs} epochs\n"
    )
    print("| the network reads | balanced accuracy | UAVs found at 1 % | nats |\n|---|---|---|---|")
    nothing = np.zeros(len(FEATURES), bool)
    without = {
        f"all without {words}": (DRAWN, np.array([of(feature.name) for feature in FEATURES]))
        for words, of in GROUPS.items()
    }
    trials = {words: (names, nothing) for words, names in TRIALS.items()}
    for words, (names, held) in (trials | {CLASSES_TOLD: (DRAWN, nothing)} | without).items():
        told = words != CLASSES_TOLD
        found = np.mean(
            [trial(sets, names, held, seed, options.epochs, kinds=told) for seed in range(options.seeds)], axis=0
        )
        print(f"| {words} | {found[0]:.3f} ± {found[1]:.3f} | {found[2]:.3f} | {found[3]:.4f} |", flush=True)


if __name__ == "__main__":
    main()
