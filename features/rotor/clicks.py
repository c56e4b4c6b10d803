"""Single samples that stand far out of a record: clicks, unless they are the flashes of a rotor."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared

#: A click: one sample so many times over the noise, and over both beside it; fewer in a record than a rotor's flashes.
#: A flash is as long as the rotor's band is narrow: its samples beside are as strong.
CLICK_POWER, CLICK_OVER_BESIDE, MOST_CLICKS = 25.0, 4.0, 5

#: Or as many as this share of the pulses, where no distance from click to click, a pulse more or less, is that of more
#: than so large a share of them: interference at random times.
CLICKED_SHARE, PERIOD_SHARE = 1 / 64, 0.4

#: A click fills the whole span and leaves it empty; a sample cut out of a rotor's band fills what was empty beside it.
#: Where that rises by this factor they were no clicks.
EMPTY_RISE = 1.1


def without_clicks(samples: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Samples with single ones that stand far out set to 0: two clicks are as far apart as the flashes of some rotor.

    Parameters
    ----------
    samples : ndarray of complex128, shape (pulses,)
        One record, strong lines taken out.
    """
    power = squared(samples)
    noise = float(np.median(power)) / np.log(2)
    beside = np.maximum(np.roll(power, 1), np.roll(power, -1))
    beside[[0, -1]] = np.inf  # the record may have cut a flash there
    clicks = (power > CLICK_POWER * noise) & (power > CLICK_OVER_BESIDE * beside)
    places = np.flatnonzero(clicks)
    if not len(places) or (len(places) > MOST_CLICKS and not _at_random(places, len(samples))):
        return samples
    without = np.where(clicks, 0.0, samples)
    before, after = np.quantile(squared(fft.fft(np.stack([samples, without]))), 0.25, axis=-1)
    return without if after < EMPTY_RISE * before else samples


def _at_random(places: NDArray[np.intp], pulses: int) -> bool:
    """True where clicks are few and no distance comes so often among them as a rotor's period would."""
    if len(places) > CLICKED_SHARE * pulses:
        return False
    apart = np.bincount((places[:, None] - places)[np.triu_indices(len(places), 1)[::-1]], minlength=3)
    return bool((apart[:-2] + apart[1:-1] + apart[2:]).max() < PERIOD_SHARE * len(places))
