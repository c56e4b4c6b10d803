"""Tables of the classifier's promises. Run: python -m tests.benchmarks.classification_tables [TABLE ...].

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
from bladewing.classify.fusion import ODDS
from bladewing.classify.inference import Prediction
from bladewing.classify.labels import CLASSES, decide_by_sets
from bladewing.classify.ladder import COST_KEY, by_place, shipped_account
from bladewing.classify.model_file import COVERAGES
from bladewing.classify.predict import answer
from bladewing.classify.recording import Recording, load_recording
from bladewing.classify.rules import Rule, Rules, counted_pulses
from bladewing.classify.training_account import figures
from bladewing.features.wingbeat import wingbeat
from bladewing.simulate import Radar, draw_records
from bladewing.simulate.dataset import KIND_CLASS, KINDS, draw_radar, draw_target, powered
from bladewing.simulate.laws import LAWS, WIDTH, Draws
from bladewing.simulate.uav import ROTORS

from .independent_scenes import KINDS as SCENES
from .independent_table import received_scenes

SURE_LIMITS = [(one, one) for one in (0.0, 0.6, 0.7, 0.8, 0.9, 0.95, 1.01)] + [(0.95, 0.85), (0.97, 0.85), (0.99, 0.9)]
"""Thresholds on the probability of the winning class ("uav", the others) from which the first model counts as sure."""

SHARED_FFTS = 6.0
"""Cost of what the networks' inputs share (the spectrum, the levels, the cadence), over that of the bare FFT."""

PAPER_RADAR = Radar(9.85e9, 25e3, 2048)
SNR_EDGES_DB = np.arange(-20, 33, 2)
RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"


def drawn(
    radars: list[Radar], count: int, kind: str | None = None, purpose: str = "bench"
) -> Iterator[tuple[np.ndarray, dict]]:
    """Draw records and truth of each radar in turn, `count` in all (rounded up to equal numbers)."""
    for number, radar in enumerate(radars):
        each = -(-count // len(radars))
        records = draw_records(radar, each, 7, purpose=purpose, start=number * each, kind=kind)
        yield records.iq, {"label": records.labels, **records.truth}


def scored(
    classifier: Classifier, radars: list[Radar], count: int, kind: str | None = None, purpose: str = "bench"
) -> dict[str, np.ndarray]:
    """Give the answers on many records together with their truth."""
    parts = []
    for radar, (iq, truth) in zip(radars, drawn(radars, count, kind, purpose), strict=True):
        given = classifier.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
        own = {"p": given.probabilities, "over_noise": over(given), "answer": given.labels}
        pulses = np.full(len(iq), counted_pulses(radar.pulses, radar.carrier_hz, radar.prf_hz))
        parts.append({**own, "pulses": pulses, **truth})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def over(given: Prediction) -> np.ndarray:
    """Give the score that separates UAVs from noise alone; without a noise output it is the probability of "uav"."""
    uav = given.probabilities[..., 0]
    return np.where(np.isnan(given.noise), uav, uav / (uav + given.noise))


def ideal(radar: Radar, count: int, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Draw records of a kind through a receiver without faults, without a background, and their SNRs [dB]."""
    rng = np.random.default_rng([7, list(KIND_CLASS).index(kind)])
    parts, snrs = [], []
    for _ in range(0, count, 250):
        draws = Draws(rng.random((250, WIDTH)))
        noise = rng.standard_normal((250, radar.pulses, 2), np.float32).view(np.complex64)[..., 0] * np.float32(
            0.5**0.5
        )
        target = draw_target(
            draws, radar, kind, lambda _: lambda n: rng.standard_normal((250, n), np.float32), np.arange(250)
        )
        snr_db = target.snr_db(rng.random(250))
        parts.append(noise + powered(target, snr_db))
        snrs.append(snr_db)
    return np.concatenate(parts), np.concatenate(snrs)


def ideal_detection(classifier: Classifier, count: int) -> None:
    """Detection of UAVs in white noise alone, receivers without faults, at a false-alarm rate of 1 %."""

    found = {kind: ideal(PAPER_RADAR, count, kind) for kind in KIND_CLASS}
    radar = {"carrier_hz": PAPER_RADAR.carrier_hz, "prf_hz": PAPER_RADAR.prf_hz}
    given = {kind: classifier.predict(iq, **radar) for kind, (iq, _) in found.items()}
    uav = {kind: one.probabilities[:, 0] for kind, one in given.items()}
    over_noise = {kind: over(one) for kind, one in given.items()}
    others = [kind for name in ("bird", "clutter") for kind in KINDS[name] if kind != "noise"]
    tables = {
        "noise, by uav over uav and noise": (over_noise, ["noise"]),
        "noise, by uav": (uav, ["noise"]),
        "birds and clutter": (uav, others),
    }
    print(
        f"\ndetection at 1 % false alarms, {PAPER_RADAR.pulses} pulses at 9.85 GHz and 25 kHz, receivers without faults"
    )
    for against, (p, foes) in tables.items():
        threshold = np.quantile(np.concatenate([p[kind] for kind in foes]), 0.99)
        print(f"against {against}\n{'at blades of [dB]':34s} {' '.join(f'{kind:>12s}' for kind in ROTORS)}    all")
        for low, high in pairwise(SNR_EDGES_DB[SNR_EDGES_DB <= 12]):
            hits = [p[kind][(found[kind][1] >= low) & (found[kind][1] < high)] > threshold for kind in ROTORS]
            cells = " ".join(f"{one.mean() if len(one) else np.nan:12.3f}" for one in hits)
            print(f"{low:20d} .. {high:<14d} {cells} {np.concatenate(hits).mean():6.3f}")


def any_radars(count: int, pulses: int) -> list[Radar]:
    """Draw radars of the envelope with the given number of pulses in a dwell."""
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
        against = [
            (clear, everything["over_noise"], np.quantile(noise["over_noise"][empty], 0.99)),
            (uav, everything["p"][:, 0], np.quantile(everything["p"][~uav, 0], 0.99)),
        ]
        for low, high in pairwise(SNR_EDGES_DB):
            cells = []
            for among, score, threshold in against:
                rows = among & (everything["snr_db"] >= low) & (everything["snr_db"] < high)
                hits = score[rows] > threshold
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


#: Rules for saying "unknown": the model's own thresholds, or prediction sets of a coverage and a UAV false-alarm rate.
RULES = ({}, {"coverage": 0.9, "max_false_alarm": 0.01}, {"coverage": 0.8, "max_false_alarm": 0.01})


def rules(classifier: Classifier, count: int) -> None:
    """What each rule for saying "unknown" gives on measured recordings and on scenes of an independent simulator."""
    scenes = max(count // 600, 1)
    truth: list[str] = []
    given: dict[str, list[tuple[np.ndarray, int]]] = {}
    for (kind, radar, _, _), iq, _ in received_scenes(list(SCENES), scenes, 1, ("total",)):
        p = classifier.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz).probabilities
        given.setdefault("scenes", []).append((p, iq.shape[-1]))
        truth += [SCENES[kind][0]] * len(iq)
    for path in sorted(RECORDINGS.glob("*.sigmf-meta")):
        recording = load_recording(path)
        if classifier.envelope.reason(recording.carrier_hz, recording.prf_hz, round(DWELL_S * recording.prf_hz)):
            continue
        p = answer(recording, classifier, dwell_s=DWELL_S).dwells.probabilities
        pulses = recording.dwells(DWELL_S).shape[-1]
        given.setdefault("drone" if path.name.startswith("drone") else "others", []).append((p, pulses))
    true = np.array(truth)
    print(f"\nscenes of an independent simulator ({len(true)}), measured recordings of a drone and of others")
    print(f"{'':28s} |         scenes             UAVs           others | drone     | others")
    print(f"{'rule':28s} |   right   wrong unknown     uav   wrong     uav |       uav |        uav  unknown")
    name = classifier.metadata["name"]
    for options in RULES:
        decide_by = Classifier.load(name, **options).decide
        said = {place: np.concatenate([decide_by(*part)[0] for part in parts]) for place, parts in given.items()}
        own, unknown = said["scenes"], said["scenes"] == "unknown"
        wrong, uavs = (own != true) & ~unknown, true == "uav"
        shares = (own == true, wrong, unknown, (own == true)[uavs], wrong[uavs], (own == "uav")[~uavs])
        cells = " ".join(f"{share.mean():7.3f}" for share in shares)
        rule = ", ".join(f"{key.split('_')[-1]} {value:g}" for key, value in options.items()) or "model's thresholds"
        print(
            f"{rule:28s} | {cells} | {np.mean(said['drone'] == 'uav'):9.3f} | "
            f"{np.mean(said['others'] == 'uav'):10.3f} {np.mean(said['others'] == 'unknown'):8.3f}"
        )


TRACK_S, DWELL_S, OF_RADAR = 2.5, 0.08, 24


def track_radars(count: int) -> Iterator[Radar]:
    """Draw radars for tracks: unambiguous to 40 m/s or more; PRFs up to 25 kHz, so that a track fits in a few MB."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        yield track_radar(rng)


def track_radar(rng: np.random.Generator) -> Radar:
    """Draw one such radar from the next two random numbers."""
    carrier_hz = 2e9 * (35 / 2) ** rng.random()
    prf_hz = min(4 * carrier_hz / 299_792_458 * 40 * (200 / 40) ** rng.random(), 25e3)
    return Radar(carrier_hz, prf_hz, round(TRACK_S * prf_hz))


def drawn_tracks(count: int) -> Iterator[tuple[Radar, np.ndarray, dict]]:
    """Draw samples and truth of each radar's tracks, balanced over the classes."""
    for number, radar in enumerate(track_radars(-(-count // OF_RADAR))):
        records = draw_records(radar, OF_RADAR, 7, purpose="bench", start=number * OF_RADAR)
        yield radar, records.iq, {"label": records.labels, **records.truth}


def tracks(classifier: Classifier, count: int) -> None:
    """Tracks of 2.5 s at 0 dB and above, noise among them: accuracy, what was declared and when, wingbeat."""
    parts = []
    for radar, iq, truth in drawn_tracks(count // 6):
        for row, samples in enumerate(iq):
            if not (truth["snr_db"][row] >= 0 or truth["kind"][row] == "noise"):
                continue
            given = answer(Recording("drawn", samples, radar.carrier_hz, radar.prf_hz), classifier, dwell_s=DWELL_S)
            beat = wingbeat(samples, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
            declared_s = np.inf if given.declared_s is None else given.declared_s
            said = {"best": CLASSES[int(given.track.probabilities.argmax())], "final": given.track.label}
            said |= {"first": given.dwells.labels[0], "declared": given.track.declared, "declared_s": declared_s}
            parts.append(
                {name: values[row] for name, values in truth.items()}
                | said
                | {"beat": beat.wingbeat_hz, "beat_std": beat.wingbeat_hz_std}
                | {name: given.shown.get(name, np.nan) for name in ODDS}
            )
    every = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    truth = every["label"]
    print(f"\ntracks of {TRACK_S} s at 0 dB and above, dwells of {DWELL_S} s, {len(parts)} tracks")
    recalls = [np.mean(every["best"][truth == name] == name) for name in CLASSES]
    print(f"balanced accuracy of the most probable class {np.mean(recalls):.3f} (goal 0.97)")
    named = every["final"] != "unknown"
    print(f"named {named.mean():.3f}, of these right {np.mean((every['final'] == truth)[named]):.3f}")
    spoke = every["declared"] != ""
    open_, other = ((every["final"] == "unknown")[spoke], (every["final"] != every["declared"])[spoke])
    print(f"declared {spoke.mean():.3f}, of these right {np.mean((every['declared'] == truth)[spoke]):.3f}", end="; ")
    print(f"at the end unknown {open_.mean():.3f}, another class {np.mean(other & ~open_):.3f}")
    other = truth != "uav"
    for rule in ("first", "declared", "final"):
        print(f"birds and clutter named uav, {rule}: {np.mean(every[rule][other] == 'uav'):.4f}")
    uav = (truth == "uav") & (every["declared"] == "uav")
    found = np.where(uav, every["declared_s"], np.inf)[truth == "uav"]
    within, ever = np.mean(found <= 0.1), np.isfinite(found).mean()
    print(f"UAVs: declared within 0.1 s {within:.3f}, ever {ever:.3f}, median {np.median(found):.3g} s")
    flapping = every["kind"] == "flapping_bird"
    error = np.abs(every["beat"] - every["wingbeat_hz"])[flapping]
    some = np.isfinite(error)
    close = (error[some] <= 0.3).mean()
    print(
        f"wingbeat of flapping birds: found in {some.mean():.3f} of {len(some)}, of these within 0.3 Hz {close:.3f}",
        end="",
    )
    spread = np.mean((error / every["beat_std"][flapping])[some & (error <= 0.3)] ** 2)
    print(f", normalised variance {spread:.2f}")
    kinds = [kind for group in ("uav", "clutter") for kind in KINDS[group]]
    false = {kind: np.isfinite(every["beat"][every["kind"] == kind]) for kind in kinds}
    print(
        "wingbeats where there is none: " + ", ".join(f"{kind} {hit.sum()}/{len(hit)}" for kind, hit in false.items())
    )
    for name in ODDS:
        shares = {kind: np.isfinite(every[name][every["kind"] == kind]) for group in KINDS.values() for kind in group}
        print(f"{name}: " + ", ".join(f"{kind} {hit.mean():.3f}" for kind, hit in shares.items()))
    beats = np.abs(every["heaves"] - every["wingbeat_hz"])[flapping]
    print(
        f"heaves of flapping birds within 0.3 Hz of the wingbeat {(beats <= 0.3).sum() / np.isfinite(beats).sum():.2f}"
    )
    print(f"{'':16s} {'n':>6s} {'best':>8s} " + " ".join(f"{name:>8s}" for name in (*CLASSES, "unknown")))
    groups = {kind: every["kind"] == kind for group in KINDS.values() for kind in group}
    # A mover no faster than birds shows one line, just as a gliding bird does: the two cannot be told apart.
    faster = np.abs(every["velocity_mps"]) > LAWS["bird_speed_mps"].high
    groups |= {"slow movers": groups["mover"] & ~faster, "fast movers": groups["mover"] & faster}
    for kind, rows in groups.items():
        shares = [np.mean(every["best"][rows] == truth[rows])]
        shares += [np.mean(every["final"][rows] == name) for name in (*CLASSES, "unknown")]
        print(f"{kind:16s} {rows.sum():6d} " + " ".join(f"{share:8.3f}" for share in shares))


def coverage(classifier: Classifier, count: int) -> None:
    """Prediction sets, fitted on separate records, against the model's acceptance thresholds."""
    parts = []
    for purpose in ("calibrate", "bench"):
        radars = [draw_radar(7, purpose, group) for group in range(count // 24)]
        given = scored(classifier, radars, count, purpose=purpose)
        labels = np.array([CLASSES.index(name) for name in given["label"]])
        parts.append((given["p"].astype(np.float64), labels, given["pulses"]))
    known, (p, truth, pulses) = parts
    print(f"\nprediction sets on {len(p)} records of the whole envelope, fitted on {len(known[0])} others")
    print("rule            covered: uav   bird clutter |  named   right | UAVs named  others named uav")

    def row(name: str, labels: np.ndarray, covered: list[float]) -> None:
        named, is_uav = labels != "unknown", labels == "uav"
        right = np.mean((labels == np.asarray(CLASSES)[truth])[named])
        true, false = is_uav[truth == 0].mean(), is_uav[truth != 0].mean()
        shares = " ".join(f"{value:7.3f}" for value in covered)
        print(f"{name:18s} {shares} | {named.mean():6.3f} {right:7.3f} | {true:10.3f} {false:16.4f}")

    row("model's thresholds", classifier.decide(p, pulses)[0], [np.nan] * 3)
    promised = {"precision": 0.9, "false_alarm": 0.01}
    rules = Rules.fitted(*known, Rule.fitted(*known[:2], coverages=COVERAGES, **promised), **promised)
    for wanted in COVERAGES:
        limits = rules.sets(pulses, wanted)
        held = [float(np.mean((p >= limits)[truth == index, index])) for index in range(len(CLASSES))]
        row(f"coverage {wanted:g}", decide_by_sets(p, limits, wanted)[0], held)


def cascade(classifier: Classifier, count: int) -> None:
    """Accuracy against cost if the fastest model answers first and this one only where the fastest is unsure."""
    account = shipped_account()
    names = (by_place("fast", account), classifier.metadata["name"])
    radars = [draw_radar(7, "bench", group) for group in range(count // 24)]
    first, second = (scored(Classifier.load(name), radars, count) for name in names)
    cheap, dear = (float(account[name][COST_KEY]) for name in names)
    truth = np.array([CLASSES.index(name) for name in first["label"]])
    print(f"\n{names[0]} first, {names[1]} where it is not sure; {len(truth)} records")
    print(" uav others  asked | accuracy  found at 1 % | false  named  right | x FFT: inputs shared    made anew")
    for uav, others in SURE_LIMITS:
        asked = first["p"].max(axis=1) < np.array([uav, others, others])[first["p"].argmax(axis=1)]
        p = np.where(asked[:, None], second["p"], first["p"])
        given = figures(p, truth, classifier.rules.accept(first["pulses"]), 0.01)
        # The best case: the second model reuses the inputs that the first has made, and splitting the batch is free.
        shared, anew = (cheap + asked.mean() * cost for cost in (dear - SHARED_FFTS, dear))
        print(
            f"{uav:4.2f} {others:6.2f} {asked.mean():6.2f} | {given['balanced_accuracy']:8.4f} "
            f"{given['uav_detection']:13.3f} | {given['false_uav']:.4f} {given['named_share']:6.3f} "
            f"{given['named_accuracy']:6.3f} | {shared:20.1f} {anew:12.1f}"
        )


TABLES: dict[str, Callable[[Classifier, int], None]] = {
    "detection": detection,
    "ideal": ideal_detection,
    "kinds": kinds,
    "tracks": tracks,
    "coverage": coverage,
    "cascade": cascade,
    "rules": rules,
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
