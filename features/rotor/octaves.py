"""Which of a comb's multiples and fractions is the rotor's: several rotors' lines fill all places further out."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Where a place has so much evidence on average, lines fill its neighbourhood [nats]; noise has less than none.
FILLED_NATS = 0.2

#: A comb at a multiple of the best one's spacing, so near to it, relative, is taken from this share of its score where
#: that is so much [nats], and chance little of it.
MULTIPLE_OFF, MULTIPLE_SHARE, MULTIPLE_FROM = 0.025, 0.85, 50.0


def over_neighbours(evidence: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Evidence less what any place of its neighbourhood has, where lines fill that [nats], same shape.

    At the high orders the lines of several rotors fill all there is between two orders. A comb of a third of the
    spacing finds three times as many lines there, wherever it looks: such places tell no comb from another.

    Parameters
    ----------
    evidence : ndarray of float32, shape (line SNRs, bins)
        Evidence of a line in every bin [nats].
    block : int
        Bins of a neighbourhood.
    """
    from scipy.ndimage import uniform_filter1d  # here, because predicting needs no such import

    anywhere = uniform_filter1d(evidence, block, axis=-1, mode="wrap")
    anywhere[anywhere < FILLED_NATS] = 0.0
    return np.asarray(evidence - anywhere, np.float32)


def coarsest(spacings: ArrayLike, scores: ArrayLike) -> int:
    """Which comb has the highest score, or lies at a multiple of that one's spacing and comes near its score.

    The lines that a fraction of the spacing adds, if they are there, speak as loudly as the others; of several rotors'
    lines some lie there by chance.

    Parameters
    ----------
    spacings : array_like, shape (combs,)
        Of the combs, any unit.
    scores : array_like, shape (combs,)
        Their scores [nats].
    """
    spacing, score = np.asarray(spacings), np.asarray(scores)
    best = int(score.argmax())
    if score[best] < MULTIPLE_FROM:
        return best
    multiple = spacing / spacing[best]
    whole = np.abs(multiple / np.maximum(np.rint(multiple), 2) - 1) < MULTIPLE_OFF
    as_good = whole & (score > MULTIPLE_SHARE * score[best])
    return int(np.where(as_good, multiple, 0).argmax()) if as_good.any() else best
