"""The page's plain sentences: first what fails, then what the model can do, then what an answer costs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bladewing.models import DEFAULT_MODEL

from .words import MINUS, batch_words, count, micros, millis, number, percent, size, spoken

# Kinds and slices with fewer records than this are not mentioned in a sentence.
LEAST_NAMED = 20
# Share of UAVs from which on the model counts as reliable.
GOOD_SHARE = 0.9


def headline_model(report: Mapping[str, Any]) -> str:
    """Name the model that the summary is about: the default one, else the most accurate."""
    names = [model["name"] for model in report["models"]]
    if DEFAULT_MODEL in names:
        return DEFAULT_MODEL
    return max(names, key=lambda name: report["scores"][name]["balanced_accuracy"]["value"] or 0.0)


def sentences(report: Mapping[str, Any]) -> list[tuple[str, list[str]]]:
    """Put the report's findings into sentences.

    Parameters
    ----------
    report : mapping
        The content of ``report.json``.

    Returns
    -------
    list of (str, list of str)
        A heading and its sentences, the failures first.
    """
    name = headline_model(report)
    found = report["scores"][name]
    return [
        ("What fails", list(_failures(report, name, found))),
        ("What it can do", list(_merits(report, name, found))),
        ("What it costs", list(_costs(report))),
    ]


def _failures(report: Mapping[str, Any], name: str, found: Mapping[str, Any]) -> Iterator[str]:
    yield (
        "Every record here is synthetic, from the same simulator that made the training records. "
        "No measured record is scored in this report (what the shipped models say of some stands in docs/expect.md): "
        "expect less on your own radar."
    )
    wrong = found["false_uav"]
    worst = sorted(
        (row for row in found["by_kind"] if row["class"] != "uav" and _enough(row["called"]["uav"])),
        key=lambda row: -row["called"]["uav"]["value"],
    )[:2]
    if wrong["best"]["count"]:
        named = " and ".join(f"{spoken(row['kind'])} ({percent(row['called']['uav']['value'])})" for row in worst)
        tail = f"; most often {named}" if named else ""
        yield (
            f"False drones: {name} calls {_with_interval(wrong['best'])} of the birds and the clutter UAV{tail}. "
            f"Where it may say \u201cunknown\u201d that falls to {percent(wrong['accepted']['value'])}."
        )
    mistake = _commonest_mistake(report["classes"], found["confusion"]["best"])
    if mistake:
        yield f"Its commonest mistake: {percent(mistake[2])} of the {mistake[0]} records are called {mistake[1]}."
    yield from _weak_end(found["by_snr"], "At the lowest SNR", 1.0, "dB")
    yield from _weak_end(found["by_dwell"], "In the shortest dwells", 1e3, "ms")
    coverage = found["acceptance"]["coverage"]["value"]
    if coverage is not None and coverage < 0.5:
        yield f"Allowed to say \u201cunknown\u201d, it says so to {percent(1 - coverage)} of the records."
    yield from _best_other(report, name, clearly=True)
    effect = found["design_effect"]
    if effect is not None and effect > 1.5:
        yield (
            f"The test records share {report['records']['radars']} radars, and some radars are harder than others: the "
            f"variance of the accuracy is {number(effect)} times that of independent records, so read the intervals as "
            f"{number(effect**0.5)} times wider."
        )


def _merits(report: Mapping[str, Any], name: str, found: Mapping[str, Any]) -> Iterator[str]:
    yield f"{name} has a balanced accuracy of {_with_interval(found['balanced_accuracy'])} over three classes."
    detection = found["uav_at_pfa"]["detection"]
    if detection["count"]:
        allowed = found["uav_at_pfa"]["allowed"]
        yield f"With one false alarm in {number(1 / allowed)} it finds {_with_interval(detection)} of the UAVs."
    good = _good_from(found["by_snr"])
    if good is not None:
        yield f"From {number(good)} dB SNR up it calls at least 9 UAVs in 10 by their name."
    accepted = found["acceptance"]
    if accepted["coverage"]["value"] is not None and accepted["accuracy"]["value"] is not None:
        yield (
            f"Allowed to say \u201cunknown\u201d, it answers {percent(accepted['coverage']['value'])} of the records "
            f"and is right on {_with_interval(accepted['accuracy'])} of those."
        )
    ece = found["reliability"]["ece"]
    if ece is not None:
        yield f"Its probabilities are off by {percent(ece)} on average (expected calibration error)."
    yield from _best_other(report, name, clearly=False)


def _costs(report: Mapping[str, Any]) -> Iterator[str]:
    yield from front_budgets(report, batch=report["cost"]["batches"][-1]["batch"])
    for part in report["trade"]:
        bought = budget_sentence(part["budgets"])
        yield (
            "Accuracy at any radar of the envelope, time of a record of "
            f"{count(report['reference']['pulses'])} pulses on one thread, {batch_words(part['batch'])}: {bought}"
        )
    for part in report["fft_against_stft"]:
        ratios = [row["ratio_to_fft"] for row in part["stft"]]
        low, high = part["paper_ratio"]
        within = sum(low <= ratio <= high for ratio in ratios)
        yield (
            f"At {count(part['pulses'])} samples one FFT is {number(min(ratios))} to {number(max(ratios))} times "
            f"faster than the STFT, by its window and overlap. The paper says {low:g} to {high:g}: "
            f"{within} of {len(ratios)} settings fall within."
        )
    weights = {row["form"]: row["bytes"] for row in report["storage"]}
    words = ", ".join(f"{spoken(form)} {size(weight)}" for form, weight in weights.items())
    yield f"A record of {count(report['reference']['pulses'])} pulses weighs: {words}."


def front_budgets(report: Mapping[str, Any], *, batch: int | None = None) -> list[str]:
    """Name in one sentence per batch size (or for the one given) and budget the most accurate choice within it."""
    lines = []
    for one in report["front"]["budgets"]:
        if batch not in (None, one["batch"]):
            continue
        head = f"Under {micros(one['budget_us'])} a record, {batch_words(one['batch'])}"
        if one["choice"] is None:
            lines.append(f"{head}: nothing.")
            continue
        what = one["choice"] if one["kind"] == "model" else f"{one['words']} (trained here)"
        lines.append(
            f"{head}: {what}, dwells of {millis(one['dwell_s'])}, balanced accuracy "
            f"{_with_interval(one['balanced_accuracy'])} for {micros(one['cost_us'])}; at one false alarm in 100 it "
            f"finds {_with_interval(one['uav_found'])} of the UAVs."
        )
    return lines


def budget_sentence(budgets: Sequence[Mapping[str, Any]]) -> str:
    """Say what each time budget buys, the smallest first; a larger one that buys the same is not repeated."""
    parts = []
    idle = [micros(budget["budget_us"]) for budget in budgets if budget["model"] is None]
    if idle:
        parts.append(f"nothing fits {' or '.join(idle)}")
    last = None
    for budget in budgets:
        if budget["model"] not in (None, last):
            bought = f"{budget['model']} ({percent(budget['balanced_accuracy'])} for {micros(budget['cost_us'])})"
            parts.append(f"{micros(budget['budget_us'])} buys {bought}")
        last = budget["model"]
    if len(budgets) > 1 and last is not None and budgets[-2]["model"] == last:
        parts.append("more time buys nothing better")
    return "; ".join(parts) + "."


def _with_interval(rate: Mapping[str, Any]) -> str:
    if rate["value"] is None:
        return "–"
    return f"{percent(rate['value'])} ({100 * rate['low']:.1f} to {100 * rate['high']:.1f})"


def _best_other(report: Mapping[str, Any], name: str, *, clearly: bool) -> Iterator[str]:
    """Name the most accurate model if it is another one and its interval lies (or does not lie) above this one's."""
    accuracy = {one: found["balanced_accuracy"] for one, found in report["scores"].items()}
    best = max(accuracy, key=lambda one: accuracy[one]["value"] or 0.0)
    if best == name or accuracy[name]["value"] is None:
        return
    if (accuracy[best]["low"] > accuracy[name]["high"]) is clearly:
        yield f"The most accurate model here is {best}: {_with_interval(accuracy[best])}."


def _enough(rate: Mapping[str, Any]) -> bool:
    return bool(rate["count"] >= LEAST_NAMED)


def _commonest_mistake(classes: Sequence[str], table: Sequence[Sequence[int]]) -> tuple[str, str, float] | None:
    """True class, answer and share of the largest off-diagonal share, None where nothing is mistaken."""
    shares = [
        (table[i][j] / sum(table[i]), classes[i], classes[j])
        for i in range(len(classes))
        for j in range(len(classes))
        if i != j and table[i][j]
    ]
    if not shares:
        return None
    share, true, answer = max(shares)
    return true, answer, share


def _weak_end(slices: Sequence[Mapping[str, Any]], where: str, scale: float, unit: str) -> Iterator[str]:
    """Say how accurate the answers are in the lowest slice with enough records."""
    usable = [one for one in slices if _enough(one["all"])]
    if usable:
        span = f"{scale * usable[0]['from']:g} to {scale * usable[0]['to']:g} {unit}".replace("-", MINUS)
        yield f"{where} ({span}) it is right on {_with_interval(usable[0]['all'])} of the records."


def _good_from(slices: Sequence[Mapping[str, Any]]) -> float | None:
    """Give the SNR from which on every slice with enough records finds at least nine UAVs in ten, or None."""
    usable = [one for one in slices if _enough(one["uav"])]
    good = None
    for one in reversed(usable):
        if one["uav"]["value"] < GOOD_SHARE:
            break
        good = one["from"]
    return good
