"""Single samples that stand far out of a record: clicks, unless they are the flashes of a rotor."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .dropouts import keep_within
from .fast import means, power_of
from .lines import squared
from .samples import energies, safe_scale, scaled

#: A click is a single sample with more than CLICK_POWER times the noise power, and more than CLICK_OVER_BESIDE times
#: that of both samples beside it. (A flash lasts the longer the narrower the rotor's band is: the samples beside its
#: peak are as strong.) A record has at most MOST_CLICKS, fewer than a rotor's flashes.
CLICK_POWER, CLICK_OVER_BESIDE, MOST_CLICKS = 25.0, 4.0, 5

#: Pulses about a click that tell the noise there: noise that swells and falls stands as high over its mean where it is
#: loud.
_AROUND = np.arange(-64, 65)

#: Interference at random times may have more clicks, up to CLICKED_SHARE of the pulses. Times are random if fewer than
#: PERIOD_SHARE pairs per click are the same distance apart, a pulse more or less.
CLICKED_SHARE, PERIOD_SHARE = 1 / 64, 0.4

#: If the lower quartile of the spectrum rises by this factor when clicks are cut out, they were no clicks. A click
#: fills the whole span, which is empty without it; a sample cut out of a rotor's flash fills what was empty beside the
#: rotor's band.
EMPTY_RISE = 1.1

#: `clicks_filled` searches records of at least LEAST_PULSES, as a shorter one may hold a single flash of a rotor; and
#: only if a sample has more than OVER_MEAN times the mean power, which one in 9 million samples of noise has.
LEAST_PULSES, OVER_MEAN = 256, 16.0

#: A sample that a click hid is restored from the lines of the record: bins with more than this times the median power.
LINE_POWER = 15.0


def clicks(samples: NDArray[np.complexfloating]) -> NDArray[np.bool_]:
    """Find the clicks of a record.

    Parameters
    ----------
    samples : ndarray of complex, shape (pulses,)
        One record.

    Returns
    -------
    ndarray of bool, same shape
        False throughout where there are no clicks, or nothing but clicks.
    """
    power = squared(samples)
    noise = float(_of_rank(power, 0.5)) / np.log(2)
    beside = np.maximum(np.roll(power, 1), np.roll(power, -1))
    beside[[0, -1]] = np.inf  # the record may have cut a flash there
    places = np.flatnonzero((power > CLICK_POWER * noise) & (power > CLICK_OVER_BESIDE * beside) & (noise > 0))
    found, none = np.zeros((2, len(samples)), bool)
    if not len(places) or (len(places) > MOST_CLICKS and not _at_random(places, len(samples))):
        return none
    around = power[np.clip(places[:, None] + _AROUND, 0, len(power) - 1)]
    found[places] = power[places] > CLICK_POWER / np.log(2) * _of_rank(around, 0.5)
    if not found.any():
        return none
    both = np.stack([samples, np.where(found, 0.0, samples)])
    before, after = _of_rank(squared(fft.fft(both)), 0.25)
    return found if after < EMPTY_RISE * before else none


def without_clicks(samples: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Samples with clicks set to 0, because two clicks are as far apart as the flashes of some rotor.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        One record, strong lines taken out.
    """
    return np.where(clicks(samples), 0.0, samples)


def clicks_filled(iq: NDArray[np.complex64], largest: NDArray[np.float32]) -> NDArray[np.complex64]:
    """Records with each click replaced by what the record's lines come to at that pulse.

    One click lifts the floor of the whole spectrum and hides what lies below. The autoregressive law that fills in lost
    pulses (`dropouts`) would take thirty times as long.

    Parameters
    ----------
    iq : ndarray of complex64, shape (records, pulses)
        Records as they were received, finite.
    largest : ndarray of float32, shape (records,)
        Largest real or imaginary part of each record, by magnitude.

    Returns
    -------
    ndarray of complex64, same shape
        The array given where there is no click.
    """
    pulses = iq.shape[-1]
    if pulses < LEAST_PULSES:
        return iq
    energy, safe = energies(iq)
    with np.errstate(over="ignore", under="ignore"):  # in records that are not safe, which are searched in any case
        maybe = (2 * pulses * np.square(largest) > OVER_MEAN * energy) | ~safe
    out = iq
    if not np.count_nonzero(maybe):
        return out
    rows = np.flatnonzero(maybe)
    records = iq[rows]
    scale = safe_scale(records)
    records = scaled(records, scale)
    power = power_of(records)
    loud = power > np.float32(OVER_MEAN) * means(power)[:, None]
    row, pulse = np.divmod(np.flatnonzero(loud), pulses)  # a tenth of the time of `np.nonzero` along two axes
    beside = np.maximum(power[row, pulse - 1], power[row, (pulse + 1) % pulses])
    for index in np.unique(row[power[row, pulse] > CLICK_OVER_BESIDE * beside]):
        if (found := clicks(records[index])).any():
            out = iq.copy() if out is iq else out
            out[rows[index], found] = _hidden(records[index], found) / scale[index]
            keep_within(out[rows[index]], found)
    return out


def _hidden(record: NDArray[np.complex64], found: NDArray[np.bool_]) -> NDArray[np.complex128]:
    """What the lines of a record come to at its clicks, shape (clicks,)."""
    transform = fft.fft(np.where(found, 0, record))
    power = squared(transform)
    return np.asarray(fft.ifft(np.where(power > LINE_POWER * _of_rank(power, 0.5), transform, 0))[found], np.complex128)


def _of_rank(values: NDArray[np.floating], share: float) -> NDArray[np.floating]:
    """The value that a share of the others lies below: NumPy's quantile takes five times as long."""
    rank = round(share * (values.shape[-1] - 1))
    return np.asarray(np.partition(values, rank, axis=-1)[..., rank])


def _at_random(places: NDArray[np.intp], pulses: int) -> bool:
    """True where clicks are few and no distance between two recurs as often as a rotor's period would."""
    if len(places) > CLICKED_SHARE * pulses:
        return False
    apart = np.bincount(np.abs(places[:, None] - places).ravel(), minlength=3)  # each distance twice
    apart[0] = 0
    return bool((apart[:-2] + apart[1:-1] + apart[2:]).max() < 2 * PERIOD_SHARE * len(places))
