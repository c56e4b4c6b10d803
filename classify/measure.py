"""The work behind `bladewing measure`: a recording in, the measurements of its dwells out."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bladewing.features.acceleration import body_acceleration, without_acceleration
from bladewing.features.inputs import MIN_PULSES
from bladewing.features.measure import MOST_BLADES_GIVEN
from bladewing.features.one_channel import half_empty, made_analytic
from bladewing.features.samples import scaled, unit_scale
from bladewing.features.spectrum import centred_power
from bladewing.features.window import KAISER
from bladewing.features.wingbeat import LEAST_S, wingbeat

from .envelope import Envelope, dwell_length, in_kilohertz, require_hertz
from .errors import BadInput
from .measure_dwells import measure_dwells
from .measured import Measured
from .progress import Progress
from .recording import Recording
from .terminal import counted

#: Most pulses of a dwell, as for classification: to measure a dwell of this many takes a quarter of a minute.
MOST_PULSES = Envelope.pulses_max

#: A recording is taken for one channel if half of the spectrum is empty in more than this share of its dwells.
ONE_SIDED = 0.5


@dataclass(frozen=True)
class Settings:
    """What is asked of every recording.

    Attributes
    ----------
    dwell_s
        Length of a dwell [s].
    blades
        Blades of a rotor, if known.
    beta_rad
        Angle between line of sight and rotor plane [rad], if known.
    """

    dwell_s: float
    blades: int | None
    beta_rad: float | None

    @classmethod
    def checked(cls, *, dwell_s: float, blades: int | None, beta_deg: float | None) -> "Settings":
        """Check the options of the command.

        Raises
        ------
        BadInput
            The dwell is not above 0 and at most 5 s, the number of blades is out of range, or beta is not at least 0
            and below 90 degrees.
        """
        if blades is not None and not 1 <= blades <= MOST_BLADES_GIVEN:
            raise BadInput(f"--blades is {blades}: it must be a whole number of 1 to {MOST_BLADES_GIVEN}")
        if beta_deg is not None and not 0 <= beta_deg < 90:
            raise BadInput(f"--beta-deg is {beta_deg:g}: it must be at least 0 and below 90 [deg]")
        return cls(dwell_length(dwell_s, "--dwell [s]"), blades, None if beta_deg is None else math.radians(beta_deg))


def checked_plot(path: Path | None) -> None:
    """Check the option --plot before anything is measured.

    Raises
    ------
    BadInput
        It is no .svg file, or none can be written there.
    """
    if path is None:
        return
    if path.suffix.lower() != ".svg":
        raise BadInput(f"--plot {path}: the drawing is SVG: name a file that ends in .svg")
    target = Path(os.path.realpath(path))  # a link is followed
    try:
        if not target.parent.is_dir():
            raise BadInput(f"--plot {path}: there is no folder {target.parent}: name a file in an existing folder")
        if target.exists() and not target.is_file():
            what = "is a directory" if target.is_dir() else "is no regular file"
        else:
            what = "" if os.access(target.parent, os.W_OK) else f"nothing can be written into {target.parent}"
    except OSError as error:  # a name that is too long, a folder that is locked
        what = str(error.strerror)
    if what:
        raise BadInput(f"--plot {path}: {what}: name a file that can be written")


def measure_recording(recording: Recording, settings: Settings, progress: Progress | None = None) -> Measured:
    """Cut a recording into dwells and measure each.

    Parameters
    ----------
    recording
        One range cell. A rest shorter than a dwell is left out, but a recording shorter than one dwell is taken whole.
    settings
        What is asked.
    progress
        Shows the dwells that are done; by default nothing does.

    Raises
    ------
    BadInput
        The recording holds fewer than 2 pulses, a dwell more than `MOST_PULSES` or one of several fewer than
        `MIN_PULSES`, or a frequency is no radar's or stands in the other's place.
    """
    if len(recording.iq) < 2:
        raise BadInput(f"{recording.name}: 1 pulse: a measurement needs at least 2, rotors some hundred: record more")
    require_hertz(recording.name, recording.carrier_hz, recording.prf_hz)
    iq = recording.dwells(settings.dwell_s, least=2)
    if iq.shape[1] > MOST_PULSES:
        raise BadInput(
            f"{recording.name}: a dwell of {settings.dwell_s:g} s takes {iq.shape[1]} pulses, more than {MOST_PULSES}: "
            f"give --dwell in seconds, {0.99 * MOST_PULSES / recording.prf_hz:.2g} at most"
        )
    if iq.shape[1] < MIN_PULSES and len(iq) > 1:
        meant = in_kilohertz(recording.prf_hz)
        raise BadInput(
            f"{recording.name}: a dwell of {settings.dwell_s:g} s takes {iq.shape[1]} pulses at a PRF of "
            f"{recording.prf_hz:g} Hz, fewer than {MIN_PULSES}: {meant + ', or ' if meant else ''}give --dwell "
            f"{math.ceil(1e4 * MIN_PULSES / recording.prf_hz) / 1e4:g} or more"
        )
    whole = made_analytic(recording.iq)  # as a whole: each dwell made analytic alone would have edge effects
    iq = whole[: iq.size].reshape(len(iq), iq.shape[1])
    count, pulses = iq.shape
    radar = {"carrier_hz": recording.carrier_hz, "prf_hz": recording.prf_hz}
    acceleration, acceleration_std, smeared = body_acceleration(iq, **radar)
    iq = without_acceleration(iq, np.where(smeared, acceleration, 0.0), **radar)
    with (progress or Progress(visible=False)).phase(f"measure {counted(count)}", count) as on_record:
        values = measure_dwells(iq, on_record=on_record, **radar, blades=settings.blades, beta_rad=settings.beta_rad)
    start_s = recording.start_s + np.arange(count) * pulses / recording.prf_hz
    long = len(recording.iq) >= LEAST_S * recording.prf_hz
    beat = wingbeat(whole, **radar) if long else None
    stop_s = start_s + pulses / recording.prf_hz
    remarks = recording.remarks(settings.dwell_s, iq, measured=True)
    if meant := in_kilohertz(recording.prf_hz):
        remarks += (f"PRF {recording.prf_hz:g} Hz: {meant}, if that is what it is",)
    direction_known = whole is recording.iq  # else a remark says that there is one channel
    if direction_known:
        empty = sum(bool(half_empty(centred_power(scaled(dwell, unit_scale(dwell)), window=KAISER))) for dwell in iq)
        direction_known = empty <= ONE_SIDED * count
        if not direction_known:
            remarks += (
                f"one side: half of the spectrum is empty in {empty} of {counted(count)}, as of a single channel that "
                "was made analytic: whether a body comes or goes is not told",
            )
    return Measured(
        recording=recording,
        iq=iq,
        start_s=start_s,
        stop_s=stop_s,
        values=values,
        acceleration_mps2=acceleration,
        acceleration_mps2_std=acceleration_std,
        beat=beat,
        remarks=remarks,
        direction_known=direction_known,
    )
