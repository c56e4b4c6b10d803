"""How strong the lines of a rotor are, order by order, for blades that reflect in several ways.

The line of rotation order n of a blade whose reflectivity is g(u), u = 0..1 from the hub to the tip, has the amplitude
of the n-th Fourier coefficient of the integral of g(u) exp(j Gamma u cos(theta)): with g at the tip alone J_n(Gamma),
the paper's eq. (24). Gamma, the phase deviation at the tip (eq. 16), is the tip's Doppler frequency in rotation rates.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

#: PROFILES: prior probabilities of blades that reflect evenly; at their tips alone, a model of the literature rather
#: than a blade; from a beginning anywhere between the shares ROOTS of their length; and evenly with a point at the tip,
#: of TIP_AMPLITUDE of the whole blade's amplitude at rest and a phase of cosine 0, TIP_COSINE or -TIP_COSINE.
PROFILES, ROOTS, TIP_AMPLITUDE, TIP_COSINE = (0.5, 0.05, 0.35, 0.04, 0.03, 0.03), (0.03, 0.6), 0.2, 0.87

#: Lines below LEAST_AMPLITUDE of a blade at rest, 60 dB under any that counts, are set to 0: single precision errs by a
#: third of it, and beyond a phase deviation of EXACT_TO [rad] by more with its root.
LEAST_AMPLITUDE, EXACT_TO = 1e-6, 300.0

#: Replaces 0 [rad].
NEAR_ZERO = 1e-4

#: Power about an order counts to midway between its neighbours: effectively this far to either side [orders].
WINDOW_ORDERS = 0.35


def line_powers(gamma: NDArray[np.float64], blades: int, count: int) -> NDArray[np.float64]:
    """Powers of the lines of rotors whose blades reflect as `PROFILES` says.

    Parameters
    ----------
    gamma : ndarray, shape (tips,)
        Phase deviation at the tip [rad].
    blades : int
        Number of equal blades: only its multiples have a line.
    count : int
        Lines wanted, orders `blades` to `count` x `blades`.

    Returns
    -------
    ndarray of float64, shape (profiles, tips, count)
        Relative to a blade at rest.
    """
    widest = float(gamma.max())
    # for an even number of blades only the real part remains, the same on both sides of a right angle
    fold = 2 - blades % 2
    orders = blades // fold * np.arange(1, count + 1)
    # long enough for the transform's aliases to fall beyond the tip, where there are no lines
    beyond = int(widest + 6 * widest ** (1 / 3)) // fold
    steps = fft.next_fast_len(max(count * blades // fold, (count * blades // fold + beyond) // 2) + 8, real=True)
    # single precision, 1e-7 of a blade at rest: lines weaker than 1e-3 of the family's do not count
    z = (gamma[:, None] * np.cos(np.pi / fold * np.arange(steps + 1) / steps)).astype(np.float32)
    z[np.abs(z) < NEAR_ZERO] = NEAR_ZERO
    sine, cosine = np.sin(z), np.cos(z)
    parts = [np.stack([sine / z, cosine])]
    if fold == 1:
        parts.append(np.stack([(1 - cosine) / z, sine]))
    amplitudes = np.empty((2, len(gamma), count))
    for odd, part in enumerate(parts):
        own = orders % 2 == odd if fold == 1 else slice(None)
        amplitudes[..., own] = fft.dct(part, 1)[..., orders[own]]
    amplitudes /= 2 * steps
    # else rounding errors would be lines past the edge of a family
    amplitudes *= np.abs(amplitudes) > LEAST_AMPLITUDE * np.sqrt(np.maximum(gamma / EXACT_TO, 1.0))[:, None]
    even, tip = amplitudes**2
    # at orders inside its beginning a blade has no lines but the ripple of both its ends
    begins = np.clip((blades * np.arange(1, count + 1) / gamma[:, None] - ROOTS[0]) / (ROOTS[1] - ROOTS[0]), 0, 1)
    level = 1 / gamma[:, None]
    ends = (np.abs(amplitudes[0]) - level) ** 2 + level**3 / (np.pi * np.mean(ROOTS))
    both, beat = even + TIP_AMPLITUDE**2 * tip, 2 * TIP_COSINE * TIP_AMPLITUDE * amplitudes[0] * amplitudes[1]
    return np.stack([even, tip, begins * even + (1 - begins) * ends, both, both + beat, both - beat])


def spread_powers(gamma: NDArray[np.float64], blades: int, count: int, spread: float) -> NDArray[np.float64]:
    """`line_powers` about each order where the rotors' rates are spread over `spread`, relative.

    Line n of a rotor at r times the mean rate lies at order n r of the mean rate. The power about an order is the mean
    over the lines that fall there, each spread evenly to midway between its neighbours.
    """
    half = WINDOW_ORDERS + np.arange(1, count + 1) * spread / 2
    if half[-1] < 0.5:
        return line_powers(gamma, blades, count)
    powers = line_powers(gamma, blades, count + int(np.ceil(half[-1])))
    mixed = half > 0.5
    ends = np.arange(count)[mixed] + 0.5 + np.array([[-1], [1]]) * half[mixed]
    whole = ends.astype(np.intp)
    padded = np.pad(powers, ((0, 0), (0, 0), (1, 1)))
    upto = np.cumsum(padded, axis=-1)[..., whole] + (ends - whole) * padded[..., whole + 1]
    powers = powers[..., :count]
    powers[..., mixed] = (upto[..., 1, :] - upto[..., 0, :]) / (2 * half[mixed])
    return powers
