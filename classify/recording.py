"""Recordings: one range cell's IQ with the carrier and the PRF it was taken at."""

import math
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from bladewing.features.dropouts import filled, longest_silence, lost_pulses
from bladewing.features.one_channel import one_channel, varies
from bladewing.features.stand_ins import stand_ins
from numpy.typing import NDArray

from .arrays import ARRAY_SUFFIXES, read_array
from .clipping import clipped_values
from .envelope import dwell_length, refuse_exchanged
from .errors import BadInput, unreadable
from .limits import require_size
from .samples import complex_samples, positive
from .sigmf_file import ARCHIVES, find_sigmf, read_sigmf

#: Suffixes of packed files: their bytes could be read as samples without any error.
PACKED_SUFFIXES = (".gz", ".tgz", ".xz", ".bz2", ".zst", ".zip", ".tar", ".7z")

Result = TypeVar("Result")

_SAME = 1e-9  # relative: an option that repeats the file's number may be rounded as text is


@dataclass(frozen=True, eq=False)
class Recording:
    """Slow-time samples of one range cell.

    Attributes
    ----------
    name
        As it was asked for.
    iq
        Shape (pulses,), one sample a pulse; pulses that were lost are filled in from those beside them.
    carrier_hz, prf_hz
        Carrier and pulse repetition frequency [Hz].
    start_s
        Time of the first sample [s]; above 0 where a SigMF file says that it goes on from an earlier one.
    filled_in
        Number of pulses that were filled in.

    Raises
    ------
    BadInput
        The samples are not complex, not finite, none, or of several cells, a frequency is not above 0, carrier and PRF
        are exchanged, or the start is not a finite time.
    """

    name: str
    iq: NDArray[np.complex64]
    carrier_hz: float
    prf_hz: float
    start_s: float = 0.0
    filled_in: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        iq = complex_samples(self.iq, self.name)
        if iq.ndim != 1 or not len(iq):
            raise BadInput(f"{self.name}: samples of shape {iq.shape}: give those of one range cell, (pulses,)")
        lost = lost_pulses(iq) | stand_ins(iq)
        if lost.any():
            given, iq = iq, filled(iq, lost)
            object.__setattr__(self, "filled_in", int(np.count_nonzero(iq != given)))
        object.__setattr__(self, "iq", iq)
        for name in ("carrier_hz", "prf_hz"):
            object.__setattr__(self, name, positive(getattr(self, name), f"{self.name}: {name}"))
        refuse_exchanged(self.name, self.carrier_hz, self.prf_hz)
        if not math.isfinite(self.start_s):
            raise BadInput(f"{self.name}: start_s is {self.start_s}: it must be a finite time [s]")

    def dwells(self, dwell_s: float, least: int = 1) -> NDArray[np.complex64]:
        """Cut the recording into dwells that follow one another; a rest shorter than a dwell is left out.

        Parameters
        ----------
        dwell_s
            Length of a dwell [s], above 0 and at most 5; a recording shorter than one dwell is taken whole.
        least
            Fewest pulses of a dwell; the recording must hold as many.

        Returns
        -------
        ndarray
            Shape (dwells, pulses), complex64, a view.

        Raises
        ------
        BadInput
            `dwell_s` is no time above 0, longer than 5 s, or shorter than from one pulse to the next.
        """
        dwell_s = dwell_length(dwell_s)
        if dwell_s * self.prf_hz < 0.5:
            asked = f"a dwell of {dwell_s:g} s holds no pulse at a PRF of {self.prf_hz:g} Hz"
            cure = (
                f"give the PRF in hertz, {1 / self.prf_hz:g} if that is the interval from pulse to pulse"
                if self.prf_hz < 1
                else f"give more than {1 / self.prf_hz:.2g} s"
            )
            raise BadInput(f"{self.name}: {asked}: {cure}")
        pulses = max(least, round(min(dwell_s * self.prf_hz, len(self.iq))))
        count = len(self.iq) // pulses
        return self.iq[: count * pulses].reshape(count, pulses)

    @cached_property
    def clipped(self) -> int:
        """How many values of I and Q stand at the converter's largest, as `clipped_values` counts them."""
        return clipped_values(self.iq)

    def left_out_s(self, dwells: NDArray[np.complex64]) -> float:
        """What `dwells` left out at the end [s]."""
        return round((len(self.iq) - dwells.size) / self.prf_hz, 9)

    def cut_sentence(self, dwell_s: float, dwells: NDArray[np.complex64]) -> str:
        """How `dwells` of `dwell_s` seconds fit the recording, in words; empty where they fill it.

        Examples
        --------
        >>> recording = Recording("walk", np.ones(1000, np.complex64), 24e9, 1e4)
        >>> recording.cut_sentence(0.08, recording.dwells(0.08))
        'the last 0.02 s, shorter than a dwell, are left out'
        >>> recording.cut_sentence(0.5, recording.dwells(0.5))
        'its 0.1 s, shorter than a dwell of 0.5 s, are taken whole'
        """
        if dwell_s * self.prf_hz > len(self.iq) + 0.5:
            return f"its {len(self.iq) / self.prf_hz:.6g} s, shorter than a dwell of {dwell_s:g} s, are taken whole"
        left_out_s = self.left_out_s(dwells)
        return f"the last {left_out_s:.2g} s, shorter than a dwell, are left out" if left_out_s else ""

    def remarks(self, dwell_s: float, dwells: NDArray[np.complex64], *, measured: bool = False) -> tuple[str, ...]:
        """Remarks on the recording, a sentence each: `cut_sentence`, and the faults of its samples.

        What a fault means is said for measurements if `measured`, else for labels.
        """
        said = [self.cut_sentence(dwell_s, dwells)]
        clipped_so, one_channel_so = _OF_MEASUREMENTS if measured else _OF_LABELS
        if self.clipped:
            said.append(
                f"clipped: {self.clipped} values of I and Q stand at the converter's largest, which makes lines that "
                f"are no target's, so that {clipped_so}: lower the gain"
            )
        if self.filled_in:
            said.append(
                f"lost: {self.filled_in} of {len(self.iq)} pulses were exactly 0, one value again and again or the "
                "pulse before, which would draw lines that are no target's: they are filled in from those beside them"
            )
        if lost := int(lost_pulses(self.iq).sum()):
            said.append(
                f"lost: {lost} of {len(self.iq)} pulses are exactly 0, which draws lines that are no target's beside "
                "every line: interpolate them from their neighbours"
            )
        start, silent = longest_silence(self.iq)
        if silent:
            said.append(
                f"silence: {silent} pulses in a row are exactly 0 from {self.start_s + start / self.prf_hz:.6g} s on, "
                "too many to be filled in: of a dwell that they break its longest stretch is judged"
            )
        if one_channel(self.iq):
            still = [(name, part) for name, part in (("I", self.iq.real), ("Q", self.iq.imag)) if not varies(part)]
            told = [f"{name} is {part[0] + 0:g} in every pulse" for name, part in still]
            what = told[0] if told else "I and Q are the same but for a sign"
            said.append(f"one channel: {what}, so that both sides of the spectrum are one and {one_channel_so}")
        return tuple(sentence for sentence in said if sentence)


#: What clipping and a single channel mean for labels, and for what is measured.
_OF_LABELS = (
    "a strong line's harmonics may pass for a rotor, and no comb that stays is counted",
    "it is not told whether a target comes or goes: record I and Q",
)
_OF_MEASUREMENTS = (
    "tips may come out too fast",
    "neither tips nor the sign of a velocity can be believed: record I and Q",
)


def load_recording(
    path: str | os.PathLike[str],
    *,
    carrier_hz: float | None = None,
    prf_hz: float | None = None,
    variable: str | None = None,
    options: bool = False,
) -> Recording:
    """Read a SigMF recording, or IQ from a .npy, .npz or .mat file.

    Parameters
    ----------
    path
        SigMF: the .sigmf-meta, the .sigmf-data, their common stem, or an archive (.sigmf, .sigmf.gz, .sigmf.xz,
        .sigmf.zip). Arrays: .npy, .npz, .mat (up to version 7).
    carrier_hz, prf_hz
        Carrier and pulse repetition frequency [Hz], where the file does not say.
    variable
        Which array of an .npz or .mat file; needed where it holds several complex ones.
    options
        Whether errors name the options of the command line, in place of the arguments.

    Raises
    ------
    BadInput
        The file is missing, damaged or cut short, holds no finite complex samples of one range cell, or lacks the
        carrier or the PRF, or contradicts the ones given. Nothing is ever unpickled.
    """
    name = os.fspath(path).encode("utf-8", "backslashreplace").decode()  # else JSON that holds it would not be UTF-8
    found = find_recording(path)
    if found.suffix.lower() in ARRAY_SUFFIXES:
        samples, file_carrier_hz, file_prf_hz, first = read_array(found, variable), None, None, 0
    elif variable is not None:
        raise BadInput(
            f"{name}: variable {variable!r} given, but a SigMF recording holds one signal only: leave it out"
        )
    else:
        samples, file_carrier_hz, file_prf_hz, first = read_sigmf(found)
    iq = _one_range_cell(samples, name)
    of_carrier, of_prf = ("--carrier-hz", "--prf-hz") if options else ("carrier_hz=", "prf_hz=")
    carrier = _agreed(name, "carrier", of_carrier, carrier_hz, file_carrier_hz)
    prf = _agreed(name, "PRF", of_prf, prf_hz, file_prf_hz)
    if carrier is None or prf is None:
        missing = {"carrier (SigMF core:frequency)": carrier, "PRF (SigMF core:sample_rate)": prf}
        of_array = found.suffix.lower() in ARRAY_SUFFIXES
        no = " and no ".join(what for what, value in missing.items() if value is None)
        says = "of arrays the samples alone are read" if of_array else f"the file says no {no}"
        give = " and ".join(option for option, value in ((of_carrier, carrier), (of_prf, prf)) if value is None)
        raise BadInput(f"{name}: {says}: give {give} [Hz]")
    return Recording(name, iq, carrier, prf, first / prf)


def find_recording(path: str | os.PathLike[str]) -> Path:
    """Return the file that stands for a recording: the same one for all names of a SigMF recording.

    Parameters
    ----------
    path
        As for `load_recording`.

    Raises
    ------
    BadInput
        There is no such file, or it is of no known kind.
    """
    given = Path(path)
    if os.fspath(path) in ("", "-"):
        raise BadInput(
            f"{os.fspath(path)!r} names no file: recordings are not read from standard input: give their names"
        )
    try:
        sigmf = find_sigmf(given)
        if sigmf is not None:
            return sigmf
        if given.is_dir():
            raise _folder(given)
        if not given.exists():
            named = given.suffix.lower() in ARRAY_SUFFIXES
            raise BadInput(f"{path}: no such file" + ("" if named else f", and no {given.name}.sigmf-meta beside it"))
        require_size(given)
    except OSError as error:
        raise unreadable(path, error) from None
    if given.suffix.lower() in PACKED_SUFFIXES:
        raise BadInput(f"{path}: it is packed: unpack it first, or name a SigMF archive {', '.join(ARCHIVES)}")
    if given.suffix.lower() not in ARRAY_SUFFIXES:
        raise BadInput(
            f"{path}: not a kind of recording known here: give SigMF, {', '.join(ARRAY_SUFFIXES)} (I and Q by turns: "
            'x = np.fromfile(path, "<i2") of int16, "<f4" of float32, np.loadtxt(path, delimiter=",").ravel() of CSV, '
            'scipy.io.wavfile.read(path)[1].ravel() of WAV; np.save("cell.npy", x[::2] + 1j * x[1::2]))'
        )
    return given


def _folder(given: Path) -> BadInput:
    """Error for a folder that is named as a recording, by what the folder holds."""
    kinds = ("*.sigmf-meta", "*.sigmf", *(f"*{suffix}" for suffix in ARRAY_SUFFIXES))
    held = next((kind for kind in kinds if any(given.glob(kind))), None)
    if held is None:
        return BadInput(f"{given} is a directory that holds no recording: name a SigMF, .npy, .npz or .mat file")
    return BadInput(f"{given} is a directory: name the recordings in it, such as {given}/{held}")


def of_each(
    work: Callable[[Recording], Result],
    paths: Iterable[Path],
    *,
    carrier_hz: float | None = None,
    prf_hz: float | None = None,
    variable: str | None = None,
) -> Iterator[Result | BadInput]:
    """Work on recordings one after another; one that is bad gives its error instead and does not stop the others.

    Parameters
    ----------
    work
        Makes a result of a recording, or raises `BadInput`.
    paths
        One that is named twice is worked on once.
    carrier_hz, prf_hz, variable
        As for `load_recording`.
    """
    for path in _distinct(paths):
        try:
            yield work(load_recording(path, carrier_hz=carrier_hz, prf_hz=prf_hz, variable=variable, options=True))
        except BadInput as error:
            yield error


def _distinct(paths: Iterable[Path]) -> Iterator[Path]:
    """Leave out every name that stands for a recording named before.

    A shell pattern gives both files of a SigMF recording; it is answered once, under the first of its names. A name
    for which no recording is found is passed on, so that reading it says what is wrong.
    """
    seen = set()
    for path in paths:
        try:
            found = find_recording(path)
            # a link is not resolved: several may point at one metadata file, each with its own samples beside it
            key = found.parent.resolve() / found.name
        except BadInput:
            key = path
        if key not in seen:
            seen.add(key)
            yield path


def _one_range_cell(samples: NDArray[np.generic], name: str) -> NDArray[np.complex64]:
    """Check the samples, and drop axes of length 1 (every vector of MATLAB has one)."""
    if samples.size == 0:
        raise BadInput(f"{name}: no samples (shape {samples.shape}): a recording needs at least one pulse")
    if samples.dtype.kind in "fiu":
        complex_samples(samples, name)  # raises: how to join I and Q matters before the shape
    if samples.ndim == 0 or samples.size != max(samples.shape):
        raise BadInput(
            f"{name}: samples of shape {samples.shape}: a recording is one range cell, shape (pulses,): "
            "keep the target's cell alone, cube[:, cell] of a cube (pulses, cells)"
        )
    return complex_samples(samples.reshape(-1), name)


def _agreed(name: str, what: str, option: str, given: float | None, in_file: float | None) -> float | None:
    """Take the file's number or the one given; two that differ are an error, because one of them is wrong."""
    if given is not None:
        given = positive(given, f"{what} given ({option})")
    if given is None or in_file is None:
        return in_file if given is None else given
    if abs(given - in_file) > _SAME * in_file:
        raise BadInput(f"{name}: {what} {given:.12g} Hz given, but the file says {in_file:.12g} Hz: leave {option} out")
    return in_file
