"""At which multiple of a comb's spacing blades flash, where folding gives both combs the same lines.

If the PRF is nearly p / k times the chopping frequency, folded lines fall on those of a comb at a k-th of it. Both
combs are then the same lines, and no line power tells which of them is the rotor's. But the power of the samples over
time varies with the flashes.
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

#: The power over time counts if its lines have this many times its noise on average.
LEAST_OVER_NOISE = 10.0

#: Factors by which a spacing may be too fine, each with a least excess. By chance every k-th line of the power over
#: time holds 1 / k of it; if blades flash at k times the spacing, these lines hold that excess of the rest as well. It
#: is small for k = 2 since the combs are compared too: blades of an odd number flash twice a period, once on each side.
FACTORS = {2: 0.06, 3: 0.13, 5: 0.2, 7: 0.2}

#: If the span differs from whole spacings by no more than this [bins], no folded line of any multiple falls beside the
#: comb's own, however fast the tips are.
ALL_ROUND_BINS = 0.7


def of_flashes(data: Periodogram, found: Candidate) -> Candidate:
    """The comb at the multiple of a comb's spacing at which blades flash, where only flashes tell; else the same comb.

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
    # it must hold the same lines: at 5.8 to 24 GHz 34 of 36 right ones had this share of the score, 9 of 32 wrong ones
    # had not
    if multiples[best // len(steps)] == 1 or scores[best] < MULTIPLE_SHARE * found.score:
        return found
    most = max(float(scores[best]), found.score)
    return Candidate(float(spacings[best]), found.centre, int(lows[best]), int(highs[best]), most)


def may_be_fraction(data: Periodogram, spacing: float, last: int) -> bool:
    """True where a comb may be the folded lines of a multiple of its spacing, and no flashes tell which it is.

    Flashes of tips several times as fast as the unambiguous velocity are shorter than a sample and seen by chance.

    Parameters
    ----------
    data : Periodogram
        The record.
    spacing : float
        Spacing of the comb [cycles a sample].
    last : int
        Outermost order of the comb.
    """
    if data.one_channel or not may_come_back(last, spacing) or not comes_round(spacing, data.pulses, ALL_ROUND_BINS):
        return False
    return not _flash_multiples(data, spacing)


def _flash_multiples(data: Periodogram, spacing: float) -> list[int]:
    """Multiples of a spacing at which blades may flash; none where they flash at the spacing or nothing tells."""
    lines = _lines_of_power(data, spacing)
    if lines is None:
        return []
    around, multiple = round(1 / spacing), 1

    def share(factor: int) -> float:
        held = lines[multiple - 1 :: multiple].sum()
        return float(lines[factor * multiple - 1 :: factor * multiple].sum() / max(held, 1e-30))

    for factor, more in sorted(FACTORS.items(), reverse=True):
        # if the factor divides the spacings in the span, lines of that multiple fold onto themselves alone
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
    """Lines of the samples' power over time at all multiples of a spacing, noise subtracted.

    None where they hardly stand out of the noise. The lines of flashes longer than a sample lie within the span.
    """
    power = squared(data.samples)
    size = fft.next_fast_len(PADDING * data.pulses, real=True)
    window = np.hanning(data.pulses)
    spectrum = squared(fft.rfft((power - power.mean()) * window, size))
    orders = np.arange(1, int(0.5 / spacing) + 1)
    lines = spectrum[np.minimum(np.rint(orders * spacing * size).astype(np.intp), len(spectrum) - 1)]
    # noise of unit power, by itself and beating with the blades' echoes
    noise = float((window**2).sum()) * (2 * max(float(power.mean()) - 1, 0.0) + 1)
    lines = lines - noise
    return np.maximum(lines, 0.0) if lines.mean() > LEAST_OVER_NOISE * noise else None
