"""Fit what each piece of a track counts and write classify/fusion.py. Run: python -m tests.benchmarks.fusion_fit.

Tracks of 2.5 s and every SNR, of radars and a seed of their own: record i comes from (SEED, i) alone. The table tells
what each piece brings on the carriers that it was not fitted on: below the middle of the band from those above it, and
the other way round. Eight minutes on two cores.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from bladewing.classify import Classifier
from bladewing.classify.fusion import CORRELATION, LOOKS, ODDS
from bladewing.classify.labels import CLASSES, decide
from bladewing.classify.predict import long_look
from bladewing.classify.track import fuse
from bladewing.models.calibration import expected_calibration_error
from bladewing.simulate import draw_records
from scipy import optimize

from .classification_tables import DWELL_S, OF_RADAR, track_radar

TABLE = Path(__file__).parents[2] / "classify" / "fusion.py"
SEED, RADARS = 2024, 160
LENGTHS = (1, 2, 5, 12, 31)
WHOLE = 31  # dwells of a track
AFTER = (2, 5, 10, 12, 20, WHOLE)  # numbers of dwells after which the fit scores the probabilities
RIDGE = 1e-4  # pulls a value that the tracks do not determine to 0: a weight or odds of 1, a correlation of a half
MIDDLE_HZ = 2e9 * (35 / 2) ** 0.5  # geometric middle of the carriers drawn

Arrays = dict[str, np.ndarray]


@lru_cache(maxsize=1)
def _classifier(model: str | None) -> Classifier:
    return Classifier.load(model)


def seen(model: str | None, group: int) -> Arrays:
    """Draw the tracks of one radar and compute what the decision reads of them, one row per track."""
    radar = track_radar(np.random.default_rng((SEED, group)))
    shown = {"carrier_hz": radar.carrier_hz, "prf_hz": radar.prf_hz}
    records = draw_records(radar, OF_RADAR, SEED, purpose="calibrate", start=group * OF_RADAR)
    out = {"label": records.label_indices, "carrier_hz": np.full(OF_RADAR, radar.carrier_hz)}
    out |= {"kind": records.truth["kind"], "snr_db": records.truth["snr_db"]}
    for length in LENGTHS:
        pulses = length * round(DWELL_S * radar.prf_hz)
        count = WHOLE // length
        looks = _classifier(model).predict(records.iq[:, : count * pulses].reshape(-1, count, pulses), **shown)
        out |= {f"p{length}": looks.probabilities, f"label{length}": looks.labels}
    found = [long_look(samples, radar.carrier_hz, radar.prf_hz) for samples in records.iq]
    out |= {name: np.array([name in rates_hz for rates_hz in found]) for name in ODDS}
    return out


def means(tracks: Arrays, after: int, length: int) -> np.ndarray:
    """Give the mean log-probability of the looks of `length` dwells within the first `after` dwells, (tracks, 3)."""
    return np.log(np.maximum(tracks[f"p{length}"][:, : after // length].astype(np.float64), 1e-6)).mean(axis=1)


def nats_a_track(p: np.ndarray, labels: np.ndarray) -> float:
    """Give the mean negative log probability of the true class [nat]."""
    return float(-np.log(np.maximum(p[np.arange(len(labels)), labels], np.finfo(float).tiny)).mean())


class Model:
    """The fitted values in one vector: the correlation's logit, then the logarithms of weights and odds.

    Parameters
    ----------
    lengths
        Lengths of the looks that count [dwells]; the weight of the first is 1.
    numbers
        Names of what the whole track shows, keys of `ODDS`.
    """

    def __init__(self, lengths: Sequence[int] = LENGTHS, numbers: Sequence[str] = tuple(ODDS)) -> None:
        self.lengths, self.numbers = tuple(lengths), tuple(numbers)
        self.values = np.array([1.0, *[1.0] * (len(lengths) - 1), *[1.0] * len(numbers)])

    def read(self, values: np.ndarray) -> tuple[float, dict[int, float], dict[str, float]]:
        """Turn the vector into correlation, weights and odds."""
        cut = len(self.lengths)
        weights = dict(zip(self.lengths, [1.0, *np.exp(values[1:cut])], strict=True))
        return float(1 / (1 + np.exp(-values[0]))), weights, dict(zip(self.numbers, np.exp(values[cut:]), strict=True))

    def fit(self, tracks: Arrays) -> "Model":
        """Choose the values with the fewest nats a track, averaged over the times in `AFTER`."""
        held = {after: {n: means(tracks, after, n) for n in self.lengths if n <= after} for after in AFTER}
        shown = {name: tracks[name] for name in self.numbers}

        def loss(values: np.ndarray) -> float:
            read = self.read(values)
            nats = [nats_a_track(fused(held[k], k, shown, *read), tracks["label"]) for k in AFTER]
            return float(np.mean(nats)) + RIDGE * float(values @ values)

        self.values = optimize.minimize(loss, self.values, method="L-BFGS-B").x
        return self

    def probabilities(self, tracks: Arrays) -> np.ndarray:
        """Give the probabilities of whole tracks, shape (tracks, 3)."""
        held = {length: means(tracks, WHOLE, length) for length in self.lengths}
        return fused(held, WHOLE, {name: tracks[name] for name in self.numbers}, *self.read(self.values))


def fused(
    held: dict[int, np.ndarray],
    after: int,
    shown: Arrays,
    correlation: float,
    weights: dict[int, float],
    odds: dict[str, float],
) -> np.ndarray:
    """Compute what `fuse` gives for tracks without silent dwells, all tracks at once, shape (tracks, 3)."""
    total = sum(weights[length] * mean for length, mean in held.items())
    evidence = total / sum(weights[length] for length in held) * (after / (1 + (after - 1) * correlation))
    if after == WHOLE:
        for name, factor in odds.items():
            evidence[:, CLASSES.index(ODDS[name][0])] += np.log(factor) * shown[name]
    p = np.exp(evidence - evidence.max(axis=1, keepdims=True))
    return p / p.sum(axis=1, keepdims=True)


def checked(tracks: Arrays) -> None:
    """Compare `fused` with the product's own `fuse`, at the product's present constants."""
    held = {length: means(tracks, WHOLE, length) for length in LOOKS}
    odds = {name: factor for name, (_, factor) in ODDS.items()}
    rule = partial(decide, accept=(0.5,) * len(CLASSES))  # the labels are not compared
    here = fused(held, WHOLE, tracks, CORRELATION, LOOKS, odds)
    for row in range(50):
        longer = {length: (tracks[f"p{length}"][row], tracks[f"label{length}"][row]) for length in LOOKS if length > 1}
        found = [name for name in odds if tracks[name][row]]
        there = fuse(tracks["p1"][row], tracks["label1"][row], rule=rule, longer=longer, shown=found).probabilities
        np.testing.assert_allclose(there, here[row], atol=1e-5)


def cut(tracks: Arrays, rows: np.ndarray) -> Arrays:
    """Select some of the tracks."""
    return {name: values[rows] for name, values in tracks.items()}


def gains(tracks: Arrays) -> None:
    """Print the gain from each piece, fitted on one half of the band and tested on the other."""
    pieces = {
        "dwells of 80 ms": Model((1,), ()),
        "and of 5 dwells": Model((1, 5), ()),
        "and of 2, 12, 31": Model(LENGTHS, ()),
        "and wingbeat": Model(LENGTHS, ("wings",)),
        "and heave": Model(LENGTHS, ("wings", "heaves")),
        "and step": Model(LENGTHS, ("wings", "heaves", "steps")),
        "and a comb that stays": Model(),
    }
    low = tracks["carrier_hz"] < MIDDLE_HZ
    bands = {"below": low, f"above {MIDDLE_HZ / 1e9:.1f} GHz": ~low}
    print(f"tested          {'':6s}" + "   ".join(f"{name:>29s}" for name in bands))
    print(f"{'':21s}" + "   ".join(f"{'accuracy':>10s} {'nats':>8s} {'ECE':>9s}" for _ in bands))
    for name, piece in pieces.items():
        cells = []
        for band in bands.values():
            p, test = piece.fit(cut(tracks, ~band)).probabilities(cut(tracks, band)), cut(tracks, band)
            clear = (test["snr_db"] >= 0) | (test["kind"] == "noise")
            right = p.argmax(axis=1) == test["label"]
            accuracy = np.mean([np.mean(right[clear & (test["label"] == k)]) for k in range(len(CLASSES))])
            nats = nats_a_track(p, test["label"])
            cells.append(f"{accuracy:10.3f} {nats:8.4f} {expected_calibration_error(p, test['label']):9.3f}")
        print(f"{name:21s}" + "   ".join(cells))
    print("accuracy at 0 dB and above, balanced; nats a track and calibration error at every SNR")


def written(model: Model, source: str, tracks: Arrays) -> str:
    """Give the text of the file `TABLE`."""
    correlation, weights, odds = model.read(model.values)
    looks = ", ".join(f"{length}: {weight:.2f}" for length, weight in weights.items())
    table = ", ".join(f'"{name}": ("{whose}", {odds[name]:.1f})' for name, (whose, _) in ODDS.items())
    error = expected_calibration_error(model.probabilities(tracks), tracks["label"])
    return f'''"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To {source}, on {len(tracks["label"])} simulated tracks of 2.5 s and every SNR: calibration error {error:.3f}.
"""

CORRELATION = {correlation:.2f}
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {{{looks}}}
"""Weight of the mean log-probability of all looks of a length, by the dwells of 80 ms that one look spans."""

ODDS = {{{table}}}
"""What the whole track shows: the class whose odds it multiplies, and the factor. "comb": a comb that stays; "wings": a
wingbeat; "heaves": a body that heaves as wings lift it; "steps": a body that sways as a walker's does."""
'''


def main() -> None:
    """Draw tracks, fit, print the gain from each piece, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", help="a shipped model's name or a file")
    parser.add_argument("--radars", type=int, default=RADARS, help=f"radars of {OF_RADAR} tracks each")
    parser.add_argument("--dry", action="store_true", help="write nothing")
    options = parser.parse_args()
    metadata = Classifier.load(options.model).metadata
    with ProcessPoolExecutor(2) as pool:
        parts = list(pool.map(partial(seen, options.model), range(options.radars)))
    tracks = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    checked(tracks)
    gains(tracks)
    text = written(Model().fit(tracks), f"{metadata['name']} {metadata['bladewing_sha256'][:12]}", tracks)
    print("\n" + text)
    if not options.dry:
        TABLE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
