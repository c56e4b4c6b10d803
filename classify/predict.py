"""The work behind `bladewing predict`: recordings in, one answer a dwell and one a recording out."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from bladewing.features.heave import heave
from bladewing.features.one_channel import made_analytic
from bladewing.features.steady_comb import steady_comb
from bladewing.features.wingbeat import wingbeat

from .envelope import Envelope, dwell_length, in_kilohertz, require_hertz
from .errors import BadInput, one_line
from .fusion import LOOKS, ODDS
from .labels import CLASSES, UNKNOWN
from .limits import DWELL_S
from .recording import Recording
from .rules import counted_pulses
from .terminal import counted, print_table, print_words
from .track import Track, carry_evidence, fuse

if TYPE_CHECKING:
    from bladewing.models.operating import OperatingPoint
    from rich.console import Console

    from .inference import Classifier, Prediction

LONG_S = 5.0
"""Length of the start of a recording that `long_look` is given [s]."""

# A track of which fewer pulses count is named by the thresholds of records of as many. On tracks of 2 to 12 dwells of
# 64 to 255 pulses, 85 to 93 in 100 named birds are right with these, 82 to 89 with the thresholds of all records. On
# tracks of more pulses the thresholds of all records are the better ones.
FEW_PULSES = 1024

_SHOWN = {
    "comb": "a comb of about {:.0f} Hz stays",
    "wings": "wingbeat {:.1f} Hz",
    "heaves": "body heaves as a bird's at {:.1f} Hz",
    "steps": "body sways as a walker's at {:.1f} Hz",
}
_WHOSE = {"uav": "a UAV", "bird": "a bird", "clutter": "clutter"}

_COLOURS = {"uav": "bold red", "bird": "green", "clutter": "cyan", UNKNOWN: "yellow"}


def terms(point: "OperatingPoint", *, by_sets: bool = False) -> str:
    """Say what a chosen false-alarm rate costs; with `by_sets`, prediction sets may cost further UAVs."""
    return (
        f"uav from {point.threshold:.4f} on: at most {point.false_alarm:.4g} of birds and clutter are named uav, and "
        f"{'at most ' if by_sets else ''}{point.detection:.3f} of UAVs (synthetic calibration records of the whole "
        "envelope)"
    )


@dataclass(frozen=True, eq=False)
class Answer:
    """What is said of one recording.

    Attributes
    ----------
    name
        Name of the recording, as it was asked for.
    start_s, stop_s
        Shape (dwells,): where each dwell begins and ends [s].
    dwells
        The answers, shape (dwells,).
    track
        The answer for the dwells together and what the whole recording shows.
    shown
        What the whole recording shows [Hz], by the keys of `ODDS`: the approximate chopping frequency of a comb that
        stays (of several rotors, one's), the rate of wings, of a body that heaves or of a walker's steps. The last
        three are sought in recordings of 1.5 s and more.
    left_out_s
        The end of the recording that is shorter than a dwell [s].
    remarks
        Remarks on the recording, a sentence each.
    """

    name: str
    start_s: np.ndarray
    stop_s: np.ndarray
    dwells: "Prediction"
    track: Track
    shown: Mapping[str, float] = field(default_factory=dict)
    left_out_s: float = 0.0
    remarks: tuple[str, ...] = ()

    @property
    def declared_s(self) -> float | None:
        """From the beginning of the recording to the end of the dwell that let a class be declared [s], or None."""
        if not self.track.declared:
            return None
        return round(float(self.stop_s[self.track.declared_after - 1] - self.start_s[0]), 9)

    def json_objects(self) -> Iterator[dict[str, Any]]:
        """One object a dwell and a closing one, as `predict --json` prints them."""
        rows = zip(
            self.start_s, self.stop_s, self.dwells.labels, self.dwells.probabilities, self.dwells.reasons, strict=True
        )
        for start_s, stop_s, label, probabilities, reason in rows:
            yield {
                "file": self.name,
                "start_s": round(float(start_s), 9),
                "stop_s": round(float(stop_s), 9),
                "label": str(label),
                "probabilities": _named(probabilities),
                "reason": str(reason) or None,
            }
        rates = {name: round(rate_hz, 3) for name, rate_hz in self.shown.items()}
        track = {
            "label": self.track.label,
            "probabilities": _named(self.track.probabilities),
            "reason": self.track.reason or None,
            "dwells": len(self.dwells.labels),
            "used": self.track.used,
            "declared": self.track.declared or None,
            "declared_s": self.declared_s,
            "comb_hz": rates.get("comb"),
            "wingbeat_hz": rates.get("wings"),
            "heave_hz": rates.get("heaves", rates.get("steps")),
            "steps": "steps" in rates,
            "left_out_s": self.left_out_s,
            "remarks": list(self.remarks),
        }
        yield {"file": self.name, "track": track}

    def _runs(self) -> Iterator[tuple[int, int]]:
        """First dwell and number of dwells of each line of the table: dwells in a row refused alike share a line."""
        reasons, p = self.dwells.reasons, np.round(self.dwells.probabilities, 6)
        goes_on = (reasons[1:] != "") & (reasons[1:] == reasons[:-1]) & (p[1:] == p[:-1]).all(axis=1)
        ends = np.append(np.flatnonzero(~goes_on) + 1, len(reasons))
        yield from zip(np.append(0, ends[:-1]).tolist(), np.diff(ends, prepend=0).tolist(), strict=True)

    def _heard(self) -> str:
        """Words for how many dwells were named (as any class), how many were not sure, and how many not judged."""
        named = int(np.count_nonzero(self.dwells.labels != UNKNOWN))
        counts = {"named": named, "unsure": self.track.used - named}
        counts["not judged"] = len(self.dwells.labels) - self.track.used
        return ", ".join(f"{number} {words}" for words, number in counts.items() if number)

    def print(self, console: "Console") -> None:
        """Write a table, one line a dwell or a run of dwells refused alike, and the line of the recording."""
        from rich.table import Table
        from rich.text import Text

        table = Table("start s", "stop s", "label", *CLASSES, "reason", box=None, pad_edge=False)
        for column in (0, 1, 3, 4, 5):
            table.columns[column].justify = "right"
        for column in range(6):
            table.columns[column].no_wrap = True
        for first, count in self._runs():
            label, reason = str(self.dwells.labels[first]), str(self.dwells.reasons[first])
            table.add_row(
                f"{self.start_s[first]:.3f}",
                f"{self.stop_s[first + count - 1]:.3f}",
                Text(label, style=_COLOURS[label]),
                *(f"{share:.2f}" for share in _named(self.dwells.probabilities[first]).values()),
                Text(f"{count} dwells: {reason}" if count > 1 else reason),
            )
        console.print(Text(one_line(self.name), style="bold"), soft_wrap=True)
        print_table(console, table)
        shares = "  ".join(f"{name} {share:.2f}" for name, share in zip(CLASSES, self.track.probabilities, strict=True))
        line = Text("track: ").append(self.track.label, style=_COLOURS[self.track.label])
        line.append(f"  {shares}  from {counted(len(self.dwells.labels))}: {self._heard()}")
        if self.track.reason:
            line.append(f"  ({self.track.reason})")
        print_words(console, line)
        for remark in self.remarks:
            print_words(console, Text(remark))
        for name, rate_hz in self.shown.items():
            whose, odds = ODDS[name]
            said = f"{_SHOWN[name].format(rate_hz)}: the odds of {_WHOSE[whose]} are multiplied by {odds:g}"
            print_words(console, Text(said))
        if self.declared_s is not None:
            later = (
                ""
                if self.track.declared == self.track.label
                else ", which later dwells and longer looks do not bear out"
            )
            print_words(console, Text(f"declared {self.track.declared} after {self.declared_s:.3g} s{later}"))


def answer(recording: Recording, classifier: "Classifier", *, dwell_s: float = DWELL_S) -> Answer:
    """Cut a recording into dwells and judge each, and all of them together.

    Parameters
    ----------
    recording
        One range cell.
    classifier
        The model to ask.
    dwell_s
        Length of a dwell [s], above 0 and at most 5. Dwells follow one another without overlap; a rest shorter than a
        dwell is left out, but a recording shorter than one dwell is taken whole.

    Raises
    ------
    BadInput
        `dwell_s` is not above 0 or longer than 5 s, `recording` is a path or samples alone, its carrier or PRF is no
        radar's, its PRF seems to be given in kilohertz, or `classifier` is a name.
    """
    if not isinstance(recording, Recording):
        raise BadInput(
            f"recording is of type {type(recording).__name__}: it must be a Recording: load_recording(path, ...) reads "
            "one, Recording(name, iq, carrier_hz, prf_hz) makes one of samples"
        )
    if isinstance(classifier, str):
        raise BadInput(
            f"classifier is {classifier!r}: it must be a Classifier: Classifier.load({classifier!r}) gives one"
        )
    require_hertz(recording.name, recording.carrier_hz, recording.prf_hz)
    if meant := in_kilohertz(recording.prf_hz):  # else thousands of dwells of a few pulses would all be refused
        least_hz = classifier.envelope.prf_min_hz
        raise BadInput(f"{recording.name}: PRF {recording.prf_hz:g} Hz is below {least_hz:g} Hz: {meant}")
    dwell_s = dwell_length(dwell_s)
    iq = recording.dwells(dwell_s)
    count, wanted = iq.shape
    dwells = classifier.predict(iq, carrier_hz=recording.carrier_hz, prf_hz=recording.prf_hz)
    start_s = recording.start_s + np.arange(count) * wanted / recording.prf_hz
    longer = {}
    for length in [length for length in LOOKS if 1 < length <= count]:
        joined = iq[: count // length * length].reshape(count // length, length * wanted)
        looks = classifier.predict(joined, carrier_hz=recording.carrier_hz, prf_hz=recording.prf_hz)
        longer[length] = looks.probabilities, looks.labels
    seen = int(np.count_nonzero(carry_evidence(dwells.probabilities, dwells.labels)))
    pulses = float(counted_pulses(seen * wanted, recording.carrier_hz, recording.prf_hz))
    few = seen == 1 or pulses < FEW_PULSES
    shown: dict[str, float] = {}
    if seen:
        shown = long_look(recording.iq[: round(LONG_S * recording.prf_hz)], recording.carrier_hz, recording.prf_hz)
        if recording.clipped:  # clipping makes combs of its own
            shown.pop("comb", None)
    track = fuse(
        dwells.probabilities,
        dwells.labels,
        longer=longer,
        shown=shown,
        rule=partial(classifier.decide, pulses=pulses) if few else classifier.decide,
        dwell_s=min(wanted / recording.prf_hz, Envelope.dwell_max_s),  # in whole pulses it may be a trifle longer
    )
    stop_s = start_s + wanted / recording.prf_hz
    left_out_s, remarks = recording.left_out_s(iq), recording.remarks(dwell_s, iq)
    return Answer(recording.name, start_s, stop_s, dwells, track, shown, left_out_s, remarks)


def long_look(iq: np.ndarray, carrier_hz: float, prf_hz: float) -> dict[str, float]:
    """What a long look shows of one target and a single dwell does not [Hz], by the keys of `ODDS`."""
    radar = {"carrier_hz": carrier_hz, "prf_hz": prf_hz}
    whole = made_analytic(iq)  # else both sides of one channel move as mirror images; a comb shows better without
    body = heave(whole, **radar)
    rates_hz = {
        "comb": steady_comb(iq, **radar).chopping_hz,
        "wings": wingbeat(whole, **radar).wingbeat_hz,
        "steps" if body.walks else "heaves": body.heave_hz,
    }
    return {name: float(rate_hz) for name, rate_hz in rates_hz.items() if np.isfinite(rate_hz)}


def summary(labels: Counter[str], unreadable: int) -> str:
    """One line about many recordings.

    Examples
    --------
    >>> summary(Counter(uav=2, clutter=1), 1)
    '4 recordings: 2 uav, 1 clutter, 1 unreadable'
    """
    parts = [f"{labels[name]} {name}" for name in (*CLASSES, UNKNOWN) if labels[name]]
    if unreadable:
        parts.append(f"{unreadable} unreadable")
    return f"{labels.total() + unreadable} recordings: {', '.join(parts)}"


def _named(probabilities: np.ndarray) -> dict[str, float]:
    return {name: round(float(value), 6) for name, value in zip(CLASSES, probabilities, strict=True)}
