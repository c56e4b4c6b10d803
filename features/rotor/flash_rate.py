"""Which multiple of a comb's spacing blades flash at, where the lines of that fall on those of the comb.

Where the PRF is nearly p / k times the chopping frequency, lines that come back from the other end of the span fall on
those of a k-th of it: both combs are the same lines, and no power of any tells which of them it is. But the power of
the samples comes and goes with the flashes.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..lines import squared
from .comb_scores import score
from .comb_search import FINE_STEPS, Candidate, factors_about, spacing_limits
from .flashes import flash_evidence
from .folding import comes_round, may_come_back, outermost_orders
from .octaves import MULTIPLE_SHARE
from .periodogram import PADDING, Periodogram

#: The power over time speaks where the mean line of it is so many times its noise.
LEAST_OVER_NOISE = 10.0

#: Factors by which a spacing may be too fine. Every so many-th line of the power holds one such part of it by chance;
#: where blades flash at that multiple it holds of the rest this share more. Over twice the spacing so little is asked
#: because the combs are asked as well: blades of an odd number flash twice a period, one on each side.
FACTORS = {2: 0.06, 3: 0.13, 5: 0.2, 7: 0.2}

#: Where a span is whole spacings but for so little [bins], no line of any multiple that comes back lies beside the
#: comb's own, however fast the tips are.
ALL_ROUND_BINS = 0.7


def of_flashes(data: Periodogram, found: Candidate) -> Candidate:
    """The comb at the multiple of a comb's spacing that blades flash at, where only that tells; else the same comb.

    Parameters
    ----------
    data : Periodogram
        The record.
    found : Candidate
        The comb found in it.
    """
    filled = may_come_back(found.last, found.spacing)
    if data.one_channel or not filled or not comes_round(found.spacing, data.pulses):
        return found
    highest = spacing_limits(data.pulses, data.prf_hz)[1]
    multiples = [multiple for multiple in _flash_multiples(data, found.spacing) if multiple * found.spacing <= highest]
    if not multiples:
        return found
    steps = factors_about(data.pulses, 2 * FINE_STEPS, FINE_STEPS)
    spacings = np.outer(multiples, found.spacing * steps).ravel()
    centres = np.full(len(spacings), found.centre)
    scores, lows, highs = score(data.contrast, spacings, centres, outermost_orders(data, spacings))
    scores += flash_evidence(data, spacings, centres, lows, highs)
    best = int(scores.argmax())
    # it must be the same lines: at 5.8 to 24 GHz 34 of 36 right ones had this share, 9 of 32 wrong ones had not
    if multiples[best // len(steps)] == 1 or scores[best] < MULTIPLE_SHARE * found.score:
        return found
    most = max(float(scores[best]), found.score)
    return Candidate(float(spacings[best]), found.centre, int(lows[best]), int(highs[best]), most)


def may_be_fraction(data: Periodogram, spacing: float, last: int) -> bool:
    """True where a comb may be every line there is of a multiple, and no flash tells which of them it is.

    Flashes shorter than a sample are seen by chance: of tips some times as fast as the unambiguous velocity.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacing : float
        Of the comb [cycles a sample].
    last : int
        Its outermost order.
    """
    if data.one_channel or not may_come_back(last, spacing) or not comes_round(spacing, data.pulses, ALL_ROUND_BINS):
        return False
    return not _flash_multiples(data, spacing)


def _flash_multiples(data: Periodogram, spacing: float) -> list[int]:
    """Multiples of a spacing that blades may flash at; none where they flash at that itself or nothing tells."""
    lines = _lines_of_power(data, spacing)
    if lines is None:
        return []
    around, multiple = round(1 / spacing), 1

    def share(factor: int) -> float:
        held = lines[multiple - 1 :: multiple].sum()
        return float(lines[factor * multiple - 1 :: factor * multiple].sum() / max(held, 1e-30))

    for factor, more in sorted(FACTORS.items(), reverse=True):
        # where the factor divides the way around, lines of that multiple come back to themselves alone
        while (
            around % factor
            and 2 * factor * multiple <= len(lines)
            and share(factor) > 1 / factor + more * (1 - 1 / factor)
        ):
            multiple *= factor
    if multiple == 1:
        return []
    return [multiple, multiple // 2] if multiple % 2 == 0 else [multiple]


def _lines_of_power(data: Periodogram, spacing: float) -> NDArray[np.float64] | None:
    """Power over noise of the lines, of all multiples of a spacing, that the power of the samples has over time.

    None where they hardly stand out of the noise. Flashes longer than a sample have their lines within the span.
    """
    power = squared(data.samples)
    size = fft.next_fast_len(PADDING * data.pulses, real=True)
    window = np.hanning(data.pulses)
    spectrum = squared(fft.rfft((power - power.mean()) * window, size))
    orders = np.arange(1, int(0.5 / spacing) + 1)
    lines = spectrum[np.minimum(np.rint(orders * spacing * size).astype(np.intp), len(spectrum) - 1)]
    # noise of unit power, and what it beats with the blades
    noise = float((window**2).sum()) * (2 * max(float(power.mean()) - 1, 0.0) + 1)
    lines = lines - noise
    return np.maximum(lines, 0.0) if lines.mean() > LEAST_OVER_NOISE * noise else None
