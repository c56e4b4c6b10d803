"""Wingbeat of a bird, and the trend of its body, from the sequence of spectra of a long recording."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .dropouts import unbroken
from .following import by_recording, followed, normed, standing
from .repetition import HARMONICS, LevelSpectrum, Repetition, level_spectrum, repetition, while_moving
from .spectrum import LEAST_FLOOR, SPEED_OF_LIGHT_MPS
from .stft import stft

#: Wingbeats that are sought [Hz]: the slowest is a swan's in a slow beat, the fastest a small songbird's.
WINGBEAT_RANGE_HZ = (2.4, 20.0)

#: The search begins this far below the slowest wingbeat [Hz]: the flank of a slower rate must not pass for a wingbeat.
SLOWER_HZ = 0.2

#: Shortest recording [s]: several beats of a slow bird.
LEAST_S = 1.5

#: FRAME_S: shortest and longest frame of the sequence [s]; frames are longer at a lower carrier, for velocity cells of
#: CELL_MPS [m/s]. HOP_S: time from frame to frame [s].
FRAME_S, CELL_MPS, HOP_S = (0.012, 0.024), 1.0, 0.003

#: Wings move within this of the body [m/s], and birds fly no faster.
WING_MPS = 25.0

#: Fewest velocity cells within WING_MPS of the body in which wings can be seen.
LEAST_CELLS = 4

#: LEAST_EVIDENCE: least evidence of a repetition [standard deviations]. LEAST_MOVING_SHARE: least share of its pattern
#: that moves through the velocities: what rises and falls at all of them alike is fading, or lines that beat.
LEAST_EVIDENCE, LEAST_MOVING_SHARE = 40.0, 0.08

#: Evidence above which the same rate, seen beyond WING_MPS of the body, is a rotor's [standard deviations].
FAR_EVIDENCE = 15.0

#: Highest rate that is looked at, for the multiples of the beat [Hz].
HIGHEST_HZ = 48.0

#: Half width of the window's main lobe [cells].
LOBE_CELLS = 1.5

#: MOST_BODY_DB: most that wings may be below the body [dB]. LEAST_SWING: least swing of their power over a beat
#: (`_Motion`): wings flash, limbs and wheels echo all the time.
MOST_BODY_DB, LEAST_SWING = 32.0, 0.5

#: Limits of a walker. GAIT_HZ: highest rate of the pattern [Hz], which repeats at twice the gait, because the legs
#: swing in step. GAIT_MPS: highest speed of the body [m/s]. LIMB_SPEEDS: speed of the feet about the body over the
#: body's, at most (1 m/s is added).
GAIT_HZ, GAIT_MPS, LIMB_SPEEDS = 4.6, 3.0, 2.5


@dataclass(frozen=True)
class Wingbeat:
    """Wingbeat and body of each recording of a batch; NaN where there is no value.

    Parameters
    ----------
    wingbeat_hz, wingbeat_hz_std : ndarray of float64, shape (...)
        Wingbeat rate while the wings beat [Hz]; less well known for a bird that glides or bounds in between.
    velocity_mps : ndarray of float64, shape (...)
        Radial velocity of the body in the middle of the recording [m/s].
    acceleration_mps2, acceleration_mps2_std : ndarray of float64, shape (...)
        Mean radial acceleration of the body, from the track of its line [m/s^2].
    reason : ndarray of str, shape (...)
        Why there is no wingbeat; empty where there is one.
    """

    wingbeat_hz: NDArray[np.float64]
    wingbeat_hz_std: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    acceleration_mps2: NDArray[np.float64]
    acceleration_mps2_std: NDArray[np.float64]
    reason: NDArray[np.str_]


@dataclass(frozen=True)
class _Motion:
    """Motion and power of what repeats, compared with the body.

    Parameters
    ----------
    reach_mps : float
        Half the range of its radial velocities less `LOBE_CELLS` [m/s]; 0 if it stays within the body's main lobe.
    body_db : float
        The body's power over its own [dB]; inf if it stays within the body's main lobe.
    swing : float
        Swing of its power over a beat, all velocities together: rms of its multiples of the rate, over its mean [1].
    """

    reach_mps: float
    body_db: float
    swing: float


def wingbeat(iq: NDArray[np.complexfloating], *, carrier_hz: float, prf_hz: float) -> Wingbeat:
    """Wingbeat rate and body acceleration of long recordings, or why there is no wingbeat.

    A background at rest and the body's trend are taken out first. Then a rate is sought at which the pattern of levels
    over velocity and time repeats (`repetition`). This rate is a wingbeat unless the pattern rises and falls at all
    velocities alike (fading), repeats beyond the wings' speeds as well (rotors), or is what a walker's limbs or a
    vehicle's wheels would give.

    Parameters
    ----------
    iq : ndarray of complex, shape (..., pulses)
        Slow-time samples of one range cell.
    carrier_hz, prf_hz : float
        Carrier and pulse repetition frequency [Hz], > 0.

    Returns
    -------
    Wingbeat

    Raises
    ------
    ValueError
        If `iq` is not complex or not finite, or a frequency is not positive.
    """
    return Wingbeat(*by_recording(iq, _one, carrier_hz, prf_hz))


def _one(iq: NDArray[np.complex64], carrier_hz: float, prf_hz: float) -> tuple:
    """The fields of `Wingbeat` of one recording."""
    nothing = (np.nan,) * 5
    if len(iq) < LEAST_S * prf_hz:
        return (*nothing, f"no wingbeat: {len(iq) / prf_hz:.2g} s, less than {LEAST_S:g} s")
    if not iq.any():
        return (*nothing, "no wingbeat: no signal")
    if round(FRAME_S[0] * prf_hz) < 8:
        return (*nothing, f"no wingbeat: PRF {prf_hz:g} Hz is too low")
    wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
    if prf_hz * wavelength_m / 4 < 1.1 * WING_MPS:
        # a rotor folded into the wings' speeds cannot be told from them
        return (*nothing, f"no wingbeat: unambiguous only to {prf_hz * wavelength_m / 4:.1f} m/s")
    iq = iq[unbroken(iq)]  # silences may repeat, and the signal then comes and goes with them
    if len(iq) < LEAST_S * prf_hz:
        return (*nothing, f"no wingbeat: silences leave less than {LEAST_S:g} s in one piece")
    shown, body = followed(normed(iq), carrier_hz, prf_hz)
    velocity = body[0]
    if np.isnan(velocity):
        return (*nothing, "no wingbeat: no body line")
    steady = standing(shown, body, carrier_hz, prf_hz)
    frame_s = float(np.clip(wavelength_m / 2 / CELL_MPS, *FRAME_S))
    frames = stft(steady, carrier_hz=carrier_hz, prf_hz=prf_hz, window_s=frame_s, overlap=1 - HOP_S / frame_s)
    # the floor from a low quantile of each bin's mean: wings fill the middle
    mean = frames.power.mean(axis=0, dtype=np.float64)
    floor = max(float(np.quantile(mean, 0.2)), float(LEAST_FLOOR * mean.mean()))
    # closing on the radar is a positive Doppler shift, and a velocity below the body's
    velocities = velocity - frames.frequency_hz * wavelength_m / 2
    near = np.abs(velocities - velocity) <= WING_MPS
    if near.sum() < LEAST_CELLS:  # the frames are too short for so long a wavelength
        return (np.nan, np.nan, *body, "no wingbeat: wings are slower than this carrier tells apart")
    levels = level_spectrum(frames.power[:, near], floor, frames.frame_rate_hz, HIGHEST_HZ)
    if levels is None:
        return (np.nan, np.nan, *body, "no wingbeat: nothing moves")
    found = repetition(levels, WINGBEAT_RANGE_HZ[0] - SLOWER_HZ, WINGBEAT_RANGE_HZ[1])
    far = level_spectrum(frames.power[:, ~near], floor, frames.frame_rate_hz, HIGHEST_HZ)
    motion = _motion(found, frames.power[:, near], floor, velocities[near], velocity, frames.frame_rate_hz)
    reason = _not_wings(found, velocity, motion, far)
    if reason:
        return (np.nan, np.nan, *body, f"no wingbeat: {reason}")
    return (*while_moving(levels, found), *body, "")


def _motion(
    found: Repetition,
    power: NDArray[np.float32],
    floor: float,
    velocity_mps: NDArray[np.float64],
    body_mps: float,
    frame_rate_hz: float,
) -> _Motion:
    """The `_Motion` of what repeats, from the power of cells (frames, cells) at these radial velocities."""
    lobe = LOBE_CELLS * float(np.abs(np.diff(velocity_mps[:2])[0]))
    inner = np.abs(velocity_mps - body_mps) <= lobe
    cells = found.cells & ~inner
    if not cells.any():
        return _Motion(0.0, np.inf, 0.0)
    reach = max(float(np.ptp(velocity_mps[found.cells])) / 2 - lobe, 0.0)
    over = power[:, cells].sum(axis=1, dtype=np.float64) - floor * cells.sum()
    body = power[:, inner].sum(axis=1).mean() - floor * inner.sum()
    weight = np.hanning(len(over) + 2)[1:-1]
    turn = 2 * np.pi * found.rate_hz / frame_rate_hz * np.arange(len(over))
    swings = np.exp(-1j * np.arange(1, HARMONICS + 1)[:, None] * turn) @ (weight * over)
    mean = float(max(over.mean(), 1e-9 * floor))
    swing = float(np.sqrt(2 * (np.abs(swings) ** 2).sum()) / (weight.sum() * mean))
    return _Motion(reach, 10 * float(np.log10(max(body / mean, 1e-9))), swing)


def _not_wings(found: Repetition, body_mps: float, motion: _Motion, far: LevelSpectrum | None) -> str:
    """Why a repetition is not a wingbeat; empty where it may be one."""
    rate, reach, speed = found.rate_hz, motion.reach_mps, abs(body_mps)
    if found.evidence < LEAST_EVIDENCE:
        return f"nothing repeats: {max(found.evidence, 0):.0f} deviations over chance, {LEAST_EVIDENCE:.0f} are needed"
    if found.moving_share < LEAST_MOVING_SHARE:
        return f"what repeats at {rate:.1f} Hz rises and falls at all velocities alike, as fading does"
    if far is not None and far.at(rate) > FAR_EVIDENCE:
        return f"what repeats at {rate:.1f} Hz lies beyond {WING_MPS:g} m/s of the body too, too fast for wings"
    if speed > WING_MPS:
        return f"the body moves at {speed:.0f} m/s, faster than birds fly"
    if rate < WINGBEAT_RANGE_HZ[0]:
        return f"what repeats at {rate:.1f} Hz is too slow for wings"
    if motion.body_db == np.inf:
        return f"what repeats at {rate:.1f} Hz does not leave the body's cell"
    if motion.body_db > MOST_BODY_DB:
        return f"what repeats at {rate:.1f} Hz is {motion.body_db:.0f} dB below the body, too weak for wings"
    if motion.swing < LEAST_SWING:
        return f"what repeats at {rate:.1f} Hz echoes all the time, as limbs and wheels do, and not in flashes"
    if rate < GAIT_HZ and speed < GAIT_MPS and reach < LIMB_SPEEDS * speed + 1:
        return f"what repeats at {rate:.1f} Hz may be a walker's gait"
    return ""
