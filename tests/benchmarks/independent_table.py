"""What the shipped models call scenes of a simulator that is not theirs.

Run: python -m tests.benchmarks.independent_table [--scenes N] [--seed S] [--model NAME ...] [--kind NAME ...]
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from itertools import product

import numpy as np
from bladewing.classify import Classifier

from .independent_echo import Radar, noise_power, received, visible
from .independent_scenes import KINDS

RADARS = (
    Radar(9.85e9, 35e3, 3000),
    Radar(10e9, 10e3, 1024),
    Radar(24e9, 20e3, 2048),
    Radar(77e9, 25e3, 2048),
    Radar(94e9, 60e3, 4096),
    Radar(3e9, 5e3, 512),
    Radar(10e9, 25e3, 256),
    Radar(9.4e9, 5e3, 4096),
)
SNRS_DB = (0.0, 10.0, 20.0, 40.0, 70.0, np.inf)
ANSWERS = ("uav", "bird", "clutter", "unknown")

Counts = dict[tuple[str, str, str, str, float], Counter[str]]


def received_scenes(
    kinds: list[str], scenes: int, seed: int, noises: tuple[str, ...] = ("total", "micro")
) -> Iterator[tuple[tuple[str, Radar, str, float], np.ndarray, np.ndarray]]:
    """Make records by (kind, radar, what the SNR is of, SNR), shape (scenes, pulses), and tell which are `visible`."""
    for kind in kinds:
        make = KINDS[kind][1]
        for place, radar in enumerate(RADARS):
            rng = np.random.default_rng([seed, list(KINDS).index(kind), place])
            drawn = [make(rng, radar) for _ in range(scenes)]
            for of, snr_db in product(noises, SNRS_DB):
                powers = [noise_power(scene, snr_db, of) for scene in drawn]
                iq = np.stack([received(scene, power, rng) for scene, power in zip(drawn, powers, strict=True)])
                seen = np.array([visible(scene, power) for scene, power in zip(drawn, powers, strict=True)])
                yield (kind, radar, of, snr_db), iq, seen


def counted(models: list[str], kinds: list[str], scenes: int, seed: int) -> Counts:
    """Count answers by (model, kind, radar, what the SNR is of, SNR).

    "seen" counts the records whose micro-motion is `visible`, "seen right" those of them that are answered right.
    """
    classifiers = {name: Classifier.load(name) for name in models}
    counts: Counts = {}
    for (kind, radar, of, snr_db), iq, seen in received_scenes(kinds, scenes, seed):
        for name, classifier in classifiers.items():
            said = classifier.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz).labels
            count = Counter(said.tolist())
            count["seen"], count["seen right"] = int(seen.sum()), int((seen & (said == KINDS[kind][0])).sum())
            counts[name, kind, radar.name, of, snr_db] = count
    return counts


def line(counts: list[Counter[str]], truth: str) -> str:
    """Write the shares of the answers, the share that is seen, and the share of the seen that is right [%]."""
    whole: Counter[str] = sum(counts, Counter())
    total = sum(whole[answer] for answer in ANSWERS)
    shares = " ".join(f"{100 * whole[answer] / total:7.0f}{'*' if answer == truth else ' '}" for answer in ANSWERS)
    right = f"{100 * whole['seen right'] / whole['seen']:10.0f}" if whole["seen"] else "         -"
    return f"{shares} {100 * whole['seen'] / total:6.0f} {right}"


def main() -> None:
    """Write the tables to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=40, help="scenes of a kind and radar")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", nargs="+", default=["spectrum-cnn", "spectrum-cnn-wide"])
    parser.add_argument("--kind", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--radars", action="store_true", help="a line a radar too")
    options = parser.parse_args()
    counts = counted(options.model, options.kind, options.scenes, options.seed)
    print(f"{options.scenes} scenes of a kind and radar; shares of the answers [%], the right one starred")
    print("SNR a sample: total = whole target over noise, micro = blades, wings, limbs over noise (all, where none)")
    print("seen: a spectrum shows four bins of the micro-motion at 10 dB over noise and body; right: of these, right")
    names = [radar.name for radar in RADARS]
    for model in options.model:
        answers = " ".join(f"{answer:>7} " for answer in ANSWERS)
        print(f"\n{model}\n{'kind':<18}{'radar':<24}{'SNR dB':>12} {answers}   seen      right")
        for kind in options.kind:
            truth = KINDS[kind][0]
            for of in ("total", "micro"):
                for snr_db in SNRS_DB:
                    cells = {name: counts[model, kind, name, of, snr_db] for name in names}
                    print(f"{kind:<18}{'all':<24}{of:>7}{snr_db:5.0f} {line(list(cells.values()), truth)}")
                    for name in names if options.radars else ():
                        print(f"{kind:<18}{name:<24}{of:>7}{snr_db:5.0f} {line([cells[name]], truth)}")


if __name__ == "__main__":
    main()
