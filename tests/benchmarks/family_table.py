"""What a model says of families it was not trained on. Run: python tests/benchmarks/family_table.py [--records N].

Each family is taken out of the records that train and calibrate, a model is made of the rest, and both it and the model
of all records are asked about the family, beside all records of the other classes.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import onnxruntime
from bladewing.classify.gather import Gathered, gather
from bladewing.classify.labels import UNKNOWN, decide
from bladewing.classify.train import Sets, _train_one
from bladewing.classify.training_config import TrainingConfig
from bladewing.models import LADDER
from bladewing.models.calibration import expected_calibration_error

FAMILIES: dict[str, Callable[[dict[str, np.ndarray]], np.ndarray]] = {
    "hexacopters": lambda truth: truth["kind"] == "hexacopter",
    "helicopters": lambda truth: truth["kind"] == "helicopter",
    "flocks": lambda truth: truth["kind"] == "flock",
    "sea": lambda truth: truth["kind"] == "sea",
    "wind turbines": lambda truth: truth["kind"] == "wind_turbine",
    "band 18-40 GHz": lambda truth: (truth["carrier_hz"] >= 18e9) & (truth["carrier_hz"] < 40e9),
    "PRF 8-20 kHz": lambda truth: (truth["prf_hz"] >= 8e3) & (truth["prf_hz"] < 20e3),
}


def part(records: Gathered, rows: np.ndarray) -> Gathered:
    """Some of the records."""
    return Gathered(
        {name: values[rows] for name, values in records.inputs.items()},
        records.labels[rows],
        {name: values[rows] for name, values in records.truth.items()},
    )


def trained(name: str, settings: TrainingConfig, sets: Sets, test: Gathered) -> tuple[np.ndarray, np.ndarray]:
    """Probabilities and labels that a model of these sets gives the test records."""
    sealed, account = _train_one(name, settings, sets, lambda _: None)
    session = onnxruntime.InferenceSession(sealed, providers=["CPUExecutionProvider"])
    feed = {key: test.inputs[key].astype(np.float32) for key in LADDER[name].inputs}
    probabilities = session.run(["probabilities"], feed)[0]
    return probabilities, decide(probabilities, account["accept"])[0]


def described(probabilities: np.ndarray, answers: np.ndarray, test: Gathered, rows: np.ndarray) -> list[float]:
    """Balanced accuracy, share unknown, share wrongly named, and calibration error of the family.

    The balance is over the three classes; those that the family does not belong to stand with all their records.
    """
    own = np.unique(test.labels[rows])
    recall = []
    for index in range(3):
        among = (test.labels == index) & (rows if index in own else True)
        recall.append(np.mean(probabilities[among].argmax(axis=1) == index))
    named = answers[rows] != UNKNOWN
    right = probabilities[rows].argmax(axis=1) == test.labels[rows]
    error = expected_calibration_error(probabilities[rows], test.labels[rows])
    return [float(np.mean(recall)), float(np.mean(~named)), float(np.mean(named & ~right)), error]


def main() -> None:
    """Write the table to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=30_000, help="training records before a family is taken out")
    choices = [name for name, rung in LADDER.items() if "image" not in rung.inputs]
    parser.add_argument("--model", choices=choices, default="features-boosted")
    options = parser.parse_args()
    settings = TrainingConfig(records=options.records, seed=3, epochs=8)  # eight networks are trained
    names = LADDER[options.model].inputs
    counts = {"train": options.records, "validate": settings.held_out, "calibrate": settings.held_out}
    sets = {purpose: gather(3, purpose, count, names=names) for purpose, count in counts.items()}
    test = gather(3, "bench", options.records, names=names)
    whole = Sets(**sets, test=part(test, np.arange(600)))
    with_all = trained(options.model, settings, whole, test)
    print(
        f"{options.model}, {options.records} training records, {len(test)} test records; shares of the family's records"
    )
    print(
        f"{'':16s} {'n':>6s} | accuracy with  without  fall | unknown with  without | wrong with  without | ECE without"
    )
    for family, is_in in FAMILIES.items():
        kept = {purpose: part(records, ~is_in(records.truth)) for purpose, records in sets.items()}
        without = trained(options.model, settings, replace(whole, **kept), test)
        rows = is_in(test.truth)
        a, b = (described(*answer, test, rows) for answer in (with_all, without))
        print(
            f"{family:16s} {rows.sum():6d} | {a[0]:13.3f} {b[0]:8.3f} {a[0] - b[0]:5.3f} | {a[1]:12.3f} {b[1]:8.3f} | "
            f"{a[2]:10.3f} {b[2]:8.3f} | {b[3]:11.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
