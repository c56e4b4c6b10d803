"""What every target hands to the receiver: its parts before their powers are set, and the truth about it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .laws import LAWS

#: Draws `count` standard normal numbers from each record's own generator: (count) -> (records, count) float32.
Normals = Callable[[int], NDArray[np.float32]]


@dataclass
class Target:
    """A batch of targets of one kind.

    Parameters
    ----------
    micro : ndarray of complex64, shape (records, pulses)
        The part whose power the truth's SNR counts: blades, wings, limbs, or a clutter process as a whole.
    body : ndarray of complex64 or None, shape (records, pulses)
        The rest of the target, if it has one.
    body_db : ndarray or None, shape (records,)
        Power of the body over that of the micro-motion [dB].
    snr_law : str
        The law of the SNR.
    snr_of_body : ndarray of bool or None, shape (records,)
        Where the SNR is drawn for the body instead, by the law `clutter_snr_db`.
    truth : dict of str to ndarray, each of shape (records,)
        What is true of each record; names carry their units.
    """

    micro: NDArray[np.complex64]
    body: NDArray[np.complex64] | None = None
    body_db: NDArray[np.float64] | None = None
    snr_law: str = "snr_db"
    snr_of_body: NDArray[np.bool_] | None = None
    truth: dict[str, NDArray] = field(default_factory=dict)

    def snr_db(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """SNR of the micro-motion [dB] that the laws give for uniform numbers in [0, 1), shape (records,)."""
        drawn_db = LAWS[self.snr_law](u)
        if self.snr_of_body is None or self.body_db is None:
            return drawn_db
        return np.where(self.snr_of_body, LAWS["clutter_snr_db"](u) - self.body_db, drawn_db)


def mean_power(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Mean of |iq|^2 over the pulses, shape (records,)."""
    return np.mean(iq.real**2 + iq.imag**2, axis=-1)
