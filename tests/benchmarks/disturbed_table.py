"""What models call things beside a receiver's or a platform's own lines, from the simulator that is not theirs.

Run: python -m tests.benchmarks.disturbed_table [--scenes N] [--seed S] [--model NAME ...]
"""

import argparse
from collections.abc import Callable
from functools import partial

import numpy as np
from bladewing.classify import Classifier

from .independent_echo import Radar, Scene, level, phasor, white
from .independent_scenes import KINDS
from .independent_table import ANSWERS

RADARS = (
    Radar(3.3e9, 10e3, 1024),
    Radar(5.8e9, 8e3, 1024),
    Radar(10e9, 20e3, 2048),
    Radar(24e9, 20e3, 2048),
    Radar(10e9, 10e3, 512),
)

#: Level of each thing over the noise of a sample [dB].
LEVEL_DB = 18.0


def plain(rng: np.random.Generator, radar: Radar, speeds_mps: tuple[float, float]) -> Scene:
    """Make a thing of a single line that closes or opens at a speed of this range."""
    velocity = rng.uniform(*speeds_mps) * rng.choice([-1, 1])
    return Scene(phasor(rng.uniform(0, 1) + velocity * radar.time_s, radar), np.zeros(radar.pulses, np.complex64))


SLOW: dict[str, Callable[[np.random.Generator, Radar], Scene]] = {
    "rest": partial(plain, speeds_mps=(0, 0)),
    "mover": partial(plain, speeds_mps=(0, 15)),
    "ground": KINDS["ground"][1],
    "person": KINDS["person"][1],
}
"""Things with few lines of their own."""

FAST: dict[str, Callable[[np.random.Generator, Radar], Scene]] = {"fast mover": partial(plain, speeds_mps=(18, 28))}

DRONES = {name: KINDS[name][1] for name in ("quadcopter", "hexacopter")}


def with_lines(echoes: np.ndarray, rng: np.random.Generator, count: int, over_bin_db: float) -> np.ndarray:
    """Add steady lines of chance Dopplers and phases, so far over the noise of a bin [dB]."""
    turns = rng.random((count, 1)) * np.arange(len(echoes)) + rng.random((count, 1))
    return echoes + np.sqrt(10 ** (over_bin_db / 10) / len(echoes)) * np.exp(2j * np.pi * turns).sum(axis=0)


def rippled(echoes: np.ndarray, rng: np.random.Generator, radar: Radar, depth_db: float, turns: bool) -> np.ndarray:
    """Multiply by a ripple of 50 to 400 Hz with one to five harmonics: sidebands that far under each line [dB]."""
    rate_hz = 50 * 8 ** rng.random()
    order = np.arange(1, rng.integers(2, 7))[:, None]
    swing = rng.uniform(0.3, 1, order.shape) * np.cos(
        2 * np.pi * (order * rate_hz * radar.time_s + rng.random(order.shape))
    )
    swing = swing.sum(axis=0)
    swing *= 10 ** (depth_db / 20) / np.sqrt(np.mean(swing**2))
    return echoes * (np.exp(1j * swing) if turns else 1 + swing)


def imaged(echoes: np.ndarray, under_db: float) -> np.ndarray:
    """Add the image of a receiver whose channels are unlike."""
    return echoes + 10 ** (-under_db / 20) * echoes.conj()


Disturb = Callable[[np.ndarray, np.random.Generator, Radar], np.ndarray]

ROWS: list[tuple[str, dict[str, Callable[[np.random.Generator, Radar], Scene]], Disturb]] = [
    ("slow things and ground", SLOW, lambda x, rng, radar: x),
    *(
        (
            f"beside {count} lines {db} dB over a bin",
            SLOW,
            lambda x, rng, _, n=count, db=db: with_lines(x, rng, n, db),
        )
        for count in (2, 4, 8)
        for db in (12, 16, 20)
    ),
    ("shaken, sidebands at -30 dB", SLOW, lambda x, rng, radar: rippled(x, rng, radar, -30, True)),
    ("a supply's ripple at -30 dB", SLOW, lambda x, rng, radar: rippled(x, rng, radar, -30, False)),
    ("fast movers", FAST, lambda x, rng, radar: x),
    ("fast movers, image 32 dB under them", FAST, lambda x, rng, radar: imaged(x, 32)),
    ("drones", DRONES, lambda x, rng, radar: x),
    ("drones beside 4 such lines at 16 dB", DRONES, lambda x, rng, _: with_lines(x, rng, 4, 16)),
    ("drones, such a ripple", DRONES, lambda x, rng, radar: rippled(x, rng, radar, -30, False)),
]


def answers(classifiers: list[Classifier], row: int, scenes: int, seed: int) -> np.ndarray:
    """Share of each of `ANSWERS` that each classifier gives to a row's scenes, shape (classifiers, answers)."""
    _, things, disturb = ROWS[row]
    counts = np.zeros((len(classifiers), len(ANSWERS)))
    for place, radar in enumerate(RADARS):
        for number, make in enumerate(things.values()):
            rng = np.random.default_rng([seed, place, number])
            iq = []
            for _ in range(scenes):
                scene = make(rng, radar)
                echoes = level(scene.body + scene.micro, LEVEL_DB)
                iq.append(disturb(echoes, rng, radar) + white(rng, radar.pulses))
            for count, classifier in zip(counts, classifiers, strict=True):
                said = classifier.predict(
                    np.asarray(iq, np.complex64), carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz
                ).labels
                count += [np.count_nonzero(said == answer) for answer in ANSWERS]
    return counts / counts.sum(axis=1, keepdims=True)


def main() -> None:
    """Write the table to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=60, help="scenes of a thing and radar")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", nargs="+", default=["spectrum-cnn-fast", "spectrum-cnn", "spectrum-cnn-wide"])
    options = parser.parse_args()
    classifiers = [Classifier.load(name) for name in options.model]
    print(
        f"{len(RADARS)} radars, {options.scenes} scenes of each thing, {LEVEL_DB:g} dB over the noise of a sample [%]"
    )
    print(f"{'':36s}" + " ".join(f"| {name:>31s}" for name in options.model))
    print(f"{'':36s}" + " ".join("| " + " ".join(f"{answer:>7s}" for answer in ANSWERS) for _ in options.model))
    for row, (title, _, _) in enumerate(ROWS):
        shares = answers(classifiers, row, options.scenes, options.seed)
        cells = " ".join("| " + " ".join(f"{100 * share:7.1f}" for share in of) for of in shares)
        print(f"{title:36s}{cells}")


if __name__ == "__main__":
    main()
