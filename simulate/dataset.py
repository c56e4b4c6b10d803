"""Labelled records for training and testing: drawn one by one, rendered in batches.

Record i of a data set depends on (seed, purpose, i) alone: it owns the stream ``generator(seed, purpose, i)``, from
which come first its uniform numbers, then its noise, then what its clutter process and its receiver need.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bird import draw_bird
from .clutter import draw_clutter, draw_ground, gaussian_ground
from .discretes import DISCRETES, draw_discrete
from .generator import generator
from .laws import LAWS, WIDTH, Draws
from .radar import SPEED_OF_LIGHT_MPS, Radar, whole
from .receiver import NormalsOf, Receiver
from .target import Target, mean_power
from .uav import ROTORS, draw_uav

#: The classes, in the order of every table of probabilities.
CLASSES = ("uav", "bird", "clutter")

#: Kinds of each class and how often each is drawn within it.
KINDS: dict[str, dict[str, float]] = {
    "uav": {"fixed_wing": 0.25, "quadcopter": 0.3, "hexacopter": 0.15, "octocopter": 0.1, "helicopter": 0.2},
    "bird": {"flapping_bird": 0.68, "gliding_bird": 0.15, "flock": 0.17},
    "clutter": {
        "noise": 0.17,  # most of what a radar sees; with 0.11, weak structure in noise was taken for a UAV too often
        "ground": 0.06,
        "rain": 0.09,
        "sea": 0.07,
        "person": 0.12,
        "vehicle": 0.26,
        "wind_turbine": 0.09,
        "mover": 0.08,
        "insects": 0.06,
    },
}

#: Class of each kind.
KIND_CLASS = {kind: label for label, kinds in KINDS.items() for kind in kinds}

#: Share of the records with hardly any thermal noise: simulated ones, near targets, laboratories. It applies to all
#: kinds alike: if one class alone had such a high SNR, the level would reveal the class.
QUIET = 0.12

#: Share of the backgrounds that are rain or sea: if they were never behind a target, a model would take a drone over
#: the sea for clutter.
WEATHER = 0.2

#: Uniform numbers that a background of sea takes; rain takes fewer.
_WEATHER_NUMBERS = 28

#: What a set of records is for; each has streams of its own, so a test record is never a training record.
PURPOSES = {"train": 0, "validate": 1, "calibrate": 2, "test": 3, "bench": 4, "report": 5}

#: Columns of `Records.truth`: name -> unit. Where a column has no meaning for a record it holds NaN. Velocities are
#: those at the first pulse; a vehicle's is that in the middle of the dwell. `tip_mps` is the tips' own speed, whatever
#: the aspect. Levels are before the receiver's fading, which may shift a whole short record by some decibels.
TRUTH_UNITS = {
    "snr_db": "dB",
    "velocity_mps": "m/s",
    "acceleration_mps2": "m/s^2",
    "beta_rad": "rad",
    "rotation_hz": "Hz",
    "rotation_spread": "1",
    "tail_rotation_hz": "Hz",
    "chopping_hz": "Hz",
    "blades": "1",
    "rotors": "1",
    "blade_length_m": "m",
    "tip_mps": "m/s",
    "wingbeat_hz": "Hz",
    "mass_kg": "kg",
    "span_m": "m",
    "members": "1",
    "wind_mph": "mph",
    "width_mps": "m/s",
    "texture_shape": "1",
    "gait_hz": "Hz",
    "body_db": "dB",
    "background_db": "dB",
    "quiet_db": "dB",
}

#: Consecutive records of a stream that look through the same radar.
RADAR_GROUP = 24

_RADAR_STREAM = 1 << 40  # beyond any record's index
_CHUNK_SAMPLES = 1 << 19  # samples rendered at a time: memory stays flat whatever the count
_MAX_PULSES = 8192  # longest training record of most radars; beyond it a record only gains resolution
_LONG_CHANCE = 0.12  # probability of a radar with `long_dwell_s`, as tracks have: half the cost of all records
_MAX_LONG_PULSES = 65536  # longest record of those


@dataclass(frozen=True, eq=False)
class Records:
    """Labelled slow-time records.

    Parameters
    ----------
    radar : Radar
        The radar that looked.
    iq : ndarray of complex64, shape (count, pulses)
        One range cell, one sample a pulse.
    labels : ndarray of str, shape (count,)
        One of `CLASSES`.
    truth : dict of str to ndarray, each of shape (count,)
        "kind" (str) and the columns of `TRUTH_UNITS` (float64, NaN where without meaning).
    """

    radar: Radar
    iq: NDArray[np.complex64]
    labels: NDArray[np.str_]
    truth: dict[str, NDArray]

    def __len__(self) -> int:
        return len(self.iq)

    @property
    def label_indices(self) -> NDArray[np.int64]:
        """Index of each label in `CLASSES`, shape (count,)."""
        return np.array([CLASSES.index(label) for label in self.labels], np.int64)


def draw_records(
    radar: Radar, count: int, seed: int, *, purpose: str = "train", start: int = 0, kind: str | None = None
) -> Records:
    """Draw labelled records as seen by one radar, balanced over the classes.

    Parameters
    ----------
    radar : Radar
        The radar that looks.
    count : int
        Records to draw, >= 0.
    seed : int
        Root seed, >= 0.
    purpose : {"train", "validate", "calibrate", "test", "bench", "report"}
        What the records are for; each purpose has random streams of its own.
    start : int
        Index of the first record: records 10..19 are the same bits whether drawn alone or as part of 0..99.
    kind : str, optional
        Draw this kind alone (see `KINDS`) instead of all classes in turn.

    Returns
    -------
    Records

    Raises
    ------
    ValueError
        If `purpose` or `kind` is unknown, or `count`, `seed` or `start` is no whole number or negative.
    """
    _require(purpose, count=count, seed=seed, start=start)
    if kind is not None and kind not in KIND_CLASS:
        raise ValueError(f"kind is {kind!r}: it must be one of {', '.join(KIND_CLASS)}")
    iq = np.empty((count, radar.pulses), np.complex64)
    kinds = np.empty(count, dtype="<U16")
    truth = {name: np.full(count, np.nan) for name in TRUTH_UNITS}
    step = max(1, _CHUNK_SAMPLES // radar.pulses)
    for first in range(0, count, step):
        stop = min(first + step, count)
        part = slice(first, stop)
        _render(radar, seed, PURPOSES[purpose], start + first, iq[part], kinds[part], truth, part, kind)
    labels = np.array([KIND_CLASS[name] for name in kinds], dtype="<U7")
    return Records(radar, iq, labels, {"kind": kinds, **truth})


def _require(purpose: str, **numbers: int) -> None:
    """Check that the purpose is known and that the numbers are whole and not negative."""
    if purpose not in PURPOSES:
        raise ValueError(f"purpose is {purpose!r}: it must be one of {', '.join(PURPOSES)}")
    for name, value in numbers.items():
        whole(value, name)


def draw_radar(seed: int, purpose: str, group: int) -> Radar:
    """Draw the radar of one group of a stream: any carrier, PRF and dwell of the envelope.

    Parameters
    ----------
    seed, purpose
        As in `draw_records`.
    group : int
        Number of the group.

    Returns
    -------
    Radar

    Raises
    ------
    ValueError
        If `purpose` is unknown, or `seed` or `group` is no whole number or negative.
    """
    _require(purpose, seed=seed, group=group)
    u = generator(seed, PURPOSES[purpose], _RADAR_STREAM + group).random(4)
    carrier = float(LAWS["carrier_hz"](u[0]))
    prf = 4 * float(LAWS["unambiguous_mps"](u[1])) * carrier / SPEED_OF_LIGHT_MPS
    prf = min(max(prf, 1e3), 1e5)
    law, most = ("long_dwell_s", _MAX_LONG_PULSES) if u[3] < _LONG_CHANCE else ("dwell_s", _MAX_PULSES)
    pulses = round(prf * float(LAWS[law](u[2])))
    return Radar(carrier, prf, min(max(pulses, 64), most))


def stream(seed: int, purpose: str, count: int, *, start: int = 0) -> Iterator[Records]:
    """Records as seen by many radars, a group of `RADAR_GROUP` consecutive ones a radar.

    Parameters
    ----------
    seed, purpose, start
        As in `draw_records`; record i is the same whatever `start` and `count`.
    count : int
        Records in all.

    Yields
    ------
    Records
        One radar's share of the records, in order.

    Raises
    ------
    ValueError
        At the first record asked for, if `purpose` is unknown or a number is no whole one or negative.
    """
    _require(purpose, count=count, seed=seed, start=start)
    at, stop = start, start + count
    while at < stop:
        group = at // RADAR_GROUP
        upto = min(stop, (group + 1) * RADAR_GROUP)
        yield draw_records(draw_radar(seed, purpose, group), upto - at, seed, purpose=purpose, start=at)
        at = upto


def _render(
    radar: Radar,
    seed: int,
    purpose: int,
    first: int,
    iq: NDArray[np.complex64],
    kinds: NDArray[np.str_],
    truth: dict[str, NDArray],
    part: slice,
    only: str | None,
) -> None:
    """Draw and render one chunk of records in place."""
    count = len(iq)
    indices = range(first, first + count)
    generators = [generator(seed, purpose, i) for i in indices]
    uniforms = np.stack([g.random(WIDTH) for g in generators])
    normals_of = NormalsOf(generators)
    white = normals_of(np.arange(count))(2 * radar.pulses).reshape(count, radar.pulses, 2)
    noise = np.ascontiguousarray(white).view(np.complex64)[..., 0] * np.float32(np.sqrt(0.5))
    kinds[:] = [_kind_of(i, u, only) for i, u in zip(indices, uniforms[:, 0], strict=True)]

    draws = Draws(uniforms[:, 1:])
    receiver = Receiver(draws)
    signal = _background(draws, radar, normals_of, truth["background_db"][part])
    common = draws.uniform(8)  # a target's own numbers begin behind those that all kinds share
    quiet_db = np.where(common[:, 1] < QUIET, LAWS["quiet_db"](common[:, 2]), 0.0)
    for kind in np.unique(kinds):
        rows = np.flatnonzero(kinds == kind)
        own = Draws(uniforms[rows, 1 + draws.taken :])
        target = draw_target(own, radar, str(kind), normals_of, rows)
        snr_db = target.snr_db(common[rows, 0])
        signal[rows] += powered(target, snr_db)
        columns = dict(target.truth)
        if target.body_db is not None:
            columns["body_db"] = target.body_db
        if kind != "noise":
            columns["snr_db"] = snr_db + quiet_db[rows]
        for name, values in columns.items():
            truth[name][part.start + rows] = values
    signal *= (10 ** (quiet_db / 20)).astype(np.float32)[:, None]
    truth["background_db"][part] += quiet_db
    truth["quiet_db"][part] = quiet_db
    iq[:] = receiver.receive(signal, noise, radar, lambda _: normals_of)
    # scaled back, so that the noise sinks and no echo grows out of float32's range; a power of two keeps all digits
    iq *= np.exp2(-np.rint(quiet_db * np.log2(10) / 20)).astype(np.float32)[:, None]


def _kind_of(index: int, u: float, only: str | None) -> str:
    """Kind of a record: its class by its index, so that classes are balanced, its kind within the class by chance."""
    if only is not None:
        return only
    kinds = KINDS[CLASSES[index % len(CLASSES)]]
    edges = np.cumsum(list(kinds.values()))
    return list(kinds)[min(int(np.searchsorted(edges, u * edges[-1], side="right")), len(kinds) - 1)]


def draw_target(draws: Draws, radar: Radar, kind: str, normals_of: NormalsOf, rows: NDArray[np.intp]) -> Target:
    """Draw and render the rows of one kind."""
    if kind in ROTORS:
        return draw_uav(draws, radar, kind)
    if kind in KINDS["bird"]:
        return draw_bird(draws, radar, kind)
    if kind in DISCRETES:
        return draw_discrete(draws, radar, kind)
    return draw_clutter(draws, radar, kind, normals_of(rows))


def powered(target: Target, snr_db: NDArray[np.float64]) -> NDArray[np.complex64]:
    """Scale a target so that its micro-motion has the SNR and its body the power that was drawn."""

    def scaled(iq: NDArray[np.complex64], level_db: NDArray[np.float64]) -> NDArray[np.complex64]:
        power = mean_power(iq)
        gain = np.sqrt(10 ** (level_db / 10) / np.where(power > 0, power, 1))
        return iq * gain.astype(np.float32)[:, None]

    out = scaled(target.micro, snr_db)
    if target.body is not None and target.body_db is not None:
        out += scaled(target.body, snr_db + target.body_db)
    return out


def _background(draws: Draws, radar: Radar, normals_of: NormalsOf, level_db: NDArray[np.float64]) -> NDArray:
    """Draw what is in the cell behind any target: nothing, a return at rest, wind-blown ground, rain or sea."""
    present, blown = draws.chance(0.6), draws.chance(0.5)
    drawn_db, wind = draws.value("background_db"), draws.value("wind_mph")
    phase, gaussian = draws.value("phase_rad"), gaussian_ground(draws)
    weather, wet, own = draws.chance(WEATHER), draws.chance(0.5), draws.uniform(_WEATHER_NUMBERS)
    drawn_db = np.where(weather, draws.value("weather_db"), drawn_db)
    level_db[:] = np.where(present, drawn_db, np.nan)
    out = np.exp(1j * phase).astype(np.complex64)[:, None] * np.ones((1, radar.pulses), np.complex64)
    rows = np.flatnonzero(present & blown & ~weather)
    if len(rows):
        out[rows] = draw_ground(
            normals_of(rows), radar, wind[rows], phase[rows], (gaussian[0][rows], gaussian[1][rows])
        )
    for kind, of_kind in (("rain", wet), ("sea", ~wet)):
        rows = np.flatnonzero(present & weather & of_kind)
        if len(rows):
            out[rows] = draw_clutter(Draws(own[rows]), radar, kind, normals_of(rows)).micro
    return out * np.where(present, 10 ** (drawn_db / 20), 0.0).astype(np.float32)[:, None]
