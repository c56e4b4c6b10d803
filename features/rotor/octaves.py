"""Which multiple or fraction of a comb's spacing is the rotor's, where several rotors' lines fill the outer orders."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: If the mean evidence nearby is at least this, lines fill the neighbourhood [nats]; that of noise is negative.
FILLED_NATS = 0.2

#: A comb at a multiple of the best one's spacing, within MULTIPLE_OFF of that (relative), is preferred from more than
#: MULTIPLE_SHARE of its score on; if that score is MULTIPLE_FROM or more [nats], of which chance is a small part.
MULTIPLE_OFF, MULTIPLE_SHARE, MULTIPLE_FROM = 0.025, 0.85, 50.0


def over_neighbours(evidence: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Evidence less the mean of its neighbourhood, where lines fill that [nats], same shape.

    At the high orders lines of several rotors fill the whole gap between two orders. A comb of a third of the spacing
    finds three times as many lines there, wherever it is placed: such bins do not tell one comb from another.

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
    """Index of the comb of highest score, or of the coarsest at a multiple of its spacing with nearly that score.

    Lines that a finer spacing adds speak as loudly as the others if they are a rotor's own. Of several rotors' lines
    some lie there by chance.

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
