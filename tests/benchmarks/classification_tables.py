"""Tables of the classifier's promises. Run: python tests/benchmarks/classification_tables.py [TABLE ...].

Records are drawn for purpose "bench": neither training nor calibration, nor the test of a training, has seen them.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from bladewing.classify import Classifier
from bladewing.classify.labels import CLASSES
from bladewing.classify.predict import answer
from bladewing.classify.recording import load_recording
from bladewing.simulate import Radar, draw_records
from bladewing.simulate.dataset import KINDS, draw_radar

PAPER_RADAR = Radar(9.85e9, 25e3, 2048)
SNR_EDGES_DB = np.arange(-20, 33, 2)
RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"


def drawn(radars: list[Radar], count: int, kind: str | None = None) -> Iterator[tuple[np.ndarray, dict]]:
    """Records and truth of each radar in turn, `count` in all."""
    for number, radar in enumerate(radars):
        each = -(-count // len(radars))
        records = draw_records(radar, each, 7, purpose="bench", start=number * each, kind=kind)
        yield records.iq, {"label": records.labels, **records.truth}


def scored(classifier: Classifier, radars: list[Radar], count: int, kind: str | None = None) -> dict[str, np.ndarray]:
    """Probabilities of many records beside their truth."""
    parts = []
    for radar, (iq, truth) in zip(radars, drawn(radars, count, kind), strict=True):
        given = classifier.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
        parts.append({"p": given.probabilities, "answer": given.labels, **truth})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def any_radars(count: int, pulses: int) -> list[Radar]:
    """Radars of the envelope with that many pulses in a dwell."""
    return [replace(draw_radar(7, "bench", group), pulses=pulses) for group in range(count)]


def detection(classifier: Classifier, count: int) -> None:
    """Detection of UAVs at a false-alarm rate of 1 % against SNR."""
    for name, radars in (("9.85 GHz, 25 kHz", [PAPER_RADAR]), ("50 radars of the envelope", any_radars(50, 2048))):
        everything = scored(classifier, radars, 3 * count)
        noise = scored(classifier, radars, count, "noise")
        empty = np.isnan(noise["background_db"])
        uav = everything["label"] == "uav"
        clear = uav & np.isnan(everything["background_db"])
        print(f"\ndetection at 1 % false alarms, 2048 pulses, {name}, {uav.sum()} UAVs")
        print(" SNR of the blades [dB] | against noise (no background)   n | against birds and clutter     n")
        thresholds = [np.quantile(p, 0.99) for p in (noise["p"][empty, 0], everything["p"][~uav, 0])]
        for low, high in pairwise(SNR_EDGES_DB):
            cells = []
            for among, threshold in zip((clear, uav), thresholds, strict=True):
                rows = among & (everything["snr_db"] >= low) & (everything["snr_db"] < high)
                hits = everything["p"][rows, 0] > threshold
                cells.append(f"{hits.mean() if len(hits) else np.nan:13.3f} {len(hits):18d}")
            print(f" {low:9d} .. {high:<9d} | " + " | ".join(cells))


def kinds(classifier: Classifier, count: int) -> None:
    """What each kind is called, over radars of the envelope as training draws them."""
    everything = scored(classifier, [draw_radar(7, "bench", group) for group in range(count // 24)], count)
    print(f"\nanswers by kind, {len(everything['label'])} records over the whole envelope")
    print(f"{'':16s} {'n':>6s} " + " ".join(f"{name:>8s}" for name in (*CLASSES, "unknown")))
    for kind in (kind for group in KINDS.values() for kind in group):
        rows = everything["kind"] == kind
        shares = [np.mean(everything["answer"][rows] == name) for name in (*CLASSES, "unknown")]
        print(f"{kind:16s} {rows.sum():6d} " + " ".join(f"{share:8.3f}" for share in shares))


def recordings(classifier: Classifier, _: int) -> None:
    """Measured recordings, dwells of 80 ms: never trained on."""
    print("\nmeasured recordings, dwells of 80 ms")
    totals: dict[str, Counter[str]] = {}
    for path in sorted(RECORDINGS.glob("*.sigmf-meta")):
        given = answer(load_recording(path), classifier, dwell_s=0.08)
        labels = Counter(given.dwells.labels.tolist())
        totals.setdefault(path.name.split("-")[0], Counter()).update(labels)
        print(f"{path.stem[:48]:48s} {dict(labels)!s:46s} track {given.track.label}")
    for group, counts in totals.items():
        print(f"{group:10s} " + ", ".join(f"{name} {n} ({n / counts.total():.1%})" for name, n in counts.items()))


TABLES: dict[str, Callable[[Classifier, int], None]] = {
    "detection": detection,
    "kinds": kinds,
    "recordings": recordings,
}


def main() -> None:
    """Write the chosen tables to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*TABLES, []], help="tables to write; all by default")
    parser.add_argument("--model", help="a shipped model's name or a file")
    parser.add_argument("--records", type=int, default=6000, help="UAV records of a table")
    options = parser.parse_args()
    classifier = Classifier.load(options.model)
    for name in options.tables or TABLES:
        TABLES[name](classifier, options.records)


if __name__ == "__main__":
    main()
