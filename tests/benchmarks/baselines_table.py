"""Our models beside what a user would pick instead, on the same records.

Run: python -m tests.benchmarks.baselines_table [--records N] [--epochs N]. MiniRocket is left out where `aeon` is not
installed (`pip install -e '.[baselines]'`). Costs are process CPU time from samples to answer over that of the bare FFT
of the same 2048 pulses, in turns; accuracies stand with their 95 % intervals.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from bladewing.classify import Classifier
from bladewing.classify.gather import Gathered, TrainingSets
from bladewing.classify.train import train_one
from bladewing.classify.training_config import TrainingConfig
from bladewing.features import model_inputs
from bladewing.models import LADDER
from bladewing.simulate import Radar, stream
from numpy.typing import NDArray
from scipy import fft

from .baselines import BASELINES
from .ratios import cpu_seconds, repeated

OURS = ("features-boosted", "spectrum-cnn-fast", "spectrum-cnn", "spectrum-cnn-wide")
TIMED = Radar(9.85e9, 25e3, 2048)


def gathered(purpose: str, count: int) -> tuple[Gathered, dict[str, NDArray[np.float32]]]:
    """Draw records of any radar; give our models' inputs, and what each baseline reads."""
    names = tuple(dict.fromkeys(name for model in OURS for name in LADDER[model].inputs))
    theirs: dict[str, list[NDArray]] = {name: [] for name in BASELINES}
    runs = []
    for records in stream(5, purpose, count):
        radar = records.radar
        given = model_inputs(records.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=names)
        runs.append(Gathered(given, records.label_indices, records.truth))
        for name, baseline in BASELINES.items():
            theirs[name].append(baseline.read(records.iq, radar))
    return Gathered.joined(runs, count), {name: np.concatenate(rows) for name, rows in theirs.items()}


def judged(scores: NDArray[np.floating], labels: NDArray[np.int64]) -> tuple[float, float, float]:
    """Give the balanced accuracy, half its 95 % interval, and the share of UAVs found at 1 % false alarms."""
    recall = np.array([np.mean(scores[labels == index].argmax(axis=1) == index) for index in range(3)])
    counts = np.bincount(labels, minlength=3)
    half = 1.96 * np.sqrt((recall * (1 - recall) / counts).sum()) / 3
    margin = scores[:, 0] - np.maximum(scores[:, 1], scores[:, 2])
    found = np.mean(margin[labels == 0] > np.quantile(margin[labels != 0], 0.99))
    return float(recall.mean()), float(half), float(found)


def costs_ffts(
    answers: dict[str, Callable[[NDArray[np.complex64]], object]], iq: NDArray[np.complex64], repeats: int
) -> dict[str, float]:
    """Give the cost of each answer over that of the bare FFT of the same records."""
    calls = {name: repeated(partial(call, iq), repeats) for name, call in answers.items()}
    spent_s = cpu_seconds({"": repeated(partial(fft.fft, iq), 20 * repeats)} | calls, rounds=7)
    return {name: 20 * spent_s[name] / spent_s[""] for name in answers}


def main() -> None:
    """Write the table to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=12_000, help="training records")
    parser.add_argument("--epochs", type=int, default=9, help="of every network")
    options = parser.parse_args()
    settings = TrainingConfig(records=options.records, seed=5, epochs=options.epochs)
    drawn = {purpose: gathered(purpose, count) for purpose, count in settings.sets.items()}
    sets = TrainingSets(**{purpose: ours for purpose, (ours, _) in drawn.items()})
    labels = sets.test.labels
    print(
        f"{options.records} training records of the whole envelope, {len(labels)} test records, {options.epochs} epochs"
    )
    rows: dict[str, tuple[float, ...]] = {}
    answers: dict[str, Callable[[NDArray[np.complex64]], object]] = {}
    for name in OURS:
        start = time.process_time()
        sealed, _ = train_one(name, settings, sets, lambda _: None)
        spent = time.process_time() - start
        classifier = Classifier(sealed, source=name)
        feed = {key: sets.test.inputs[key] for key in LADDER[name].inputs}
        (scores,) = classifier._session.run(["scores"], feed)
        rows[name] = (*judged(scores, labels), spent)
        answers[name] = partial(classifier.predict, carrier_hz=TIMED.carrier_hz, prf_hz=TIMED.prf_hz)
    for name, baseline in BASELINES.items():
        start = time.process_time()
        model = baseline.train(drawn["train"][1][name], sets.train.labels, options.epochs)
        spent = time.process_time() - start
        rows[baseline.words] = (*judged(model(drawn["test"][1][name]), labels), spent)

        def answer(iq: NDArray[np.complex64], read=baseline.read, model=model) -> object:
            return model(read(iq, TIMED))

        answers[baseline.words] = answer
    noise = np.random.default_rng(0).standard_normal((64, 2 * TIMED.pulses), np.float32).view(np.complex64)
    costs = [costs_ffts(answers, iq, 1 if len(iq) > 1 else 20) for iq in (noise, noise[:1])]
    print(f"{'':28s} accuracy          UAV found  cost x FFT at 64      at 1  training s of CPU")
    for name, (accuracy, half, found, spent) in rows.items():
        at = f"{costs[0][name]:17.1f} {costs[1][name]:9.1f}"
        print(f"{name:28s} {accuracy:.3f} +- {half:.3f} {found:11.3f} {at} {spent:18.0f}")


if __name__ == "__main__":
    main()
