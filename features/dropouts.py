"""Lost pulses: samples that are exactly 0 where hardly any is nearly 0, and what they would have held."""

import numpy as np
from numpy.typing import NDArray

from .one_thread import one_thread

#: NEAR_STEPS: samples other than 0, no further from it than this many steps of the converter, are nearly 0. NEAR_SHARE:
#: zeros, unless regular, are lost pulses only if there are more of them than this share of the samples nearly 0.
#: (Samples without steps differ by next to nothing, so that next to none is nearly 0.)
NEAR_STEPS, NEAR_SHARE = 2.1, 0.5

#: Zeros are lost pulses only if there are at least LEAST_LOST, and if the probability of as many by chance is less than
#: CHANCE. Samples of two channels have PLACES values this near to 0, itself included, all about as likely; those of one
#: channel have PLACES_OF_ONE, which takes six zeros. If less than the share ALIKE of samples have the size of another,
#: there are no steps and zeros are no chance: among ENOUGH such samples and more a single zero is a lost pulse, but for
#: one at an end, where a window or a beginning may be 0.
LEAST_LOST, CHANCE, PLACES, PLACES_OF_ONE, ALIKE, ENOUGH = 3, 1e-4, 25, 5, 0.01, 100

#: More zeros in a row than this are silence, too long to be filled in: it breaks every line.
MOST_IN_A_ROW = 32

#: A lost pulse is told from at most MOST_ORDERS pulses before and after it, by an autoregressive law. Each law is
#: fitted to a block of at least BLOCK pulses (or all there are) and some beside it. The law's order is halved until
#: there are STRETCHES times as many stretches without a lost pulse; at an order below two nothing is filled in.
MOST_ORDERS, BLOCK, STRETCHES = 32, 8192, 6

#: Ridge on the diagonals of the equations for a law and for the lost pulses, as a share of these diagonals: next to
#: nothing beside any noise.
RIDGE = 1e-10

#: NOTHING: stretch that is whole of a record that lost too many pulses to be filled in. BEYOND_FILLING_IN: the reason
#: why nothing is measured of such a record.
NOTHING = slice(0, 0)
BEYOND_FILLING_IN = "lost pulses: so many are exactly 0 that they cannot be filled in"

#: Seed of the noise in pulses that are filled in, which is the same for all records with the same number of pulses.
_SEED = 22

#: Two values True beside each other, as one number.
_TWO_TRUE = np.array([True, True]).view(np.uint16)

#: If samples have fewer different sizes than this, the converter hardly steps at all: it may give 0 most of the time.
LEAST_DISTINCT = 8

#: If samples were turned in phase, or their channels corrected, the converter's steps show only near 0. They show if
#: two or more samples have the smallest size, to the share SAME_SIZE of it, and that size is no more than AS_NEAR times
#: the distance to any other sample, or the next size is larger by the factor NEXT_SIZE. That size is then the step.
#: Within NEAR_TURNED steps lie as many values as lie near 0 if steps were not turned.
SAME_SIZE, AS_NEAR, NEXT_SIZE, NEAR_TURNED = 1e-6, 1.5, 1.2, 2.9


def lost_pulses(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Find the pulses that hold nothing at all, not even noise.

    Each lost pulse spoils every line of the spectrum as an impulse would. A few of them, at whatever spacing, look like
    a rotor's flashes.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.

    Returns
    -------
    ndarray of bool, same shape
        False everywhere if there are no zeros, no more than a converter of coarse steps gives of noise, or nothing but
        zeros. Zeros of silences, longer than `MOST_IN_A_ROW`, are no lost pulses.
    """
    zero = _zeros(iq)
    if not zero.any():
        return zero
    lost = _among_steps(iq, zero)
    return lost if lost.any() else _regular(zero)


def _regular(zero: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Zeros at their most frequent distance from end to end: no chance, even for a converter of coarse steps.

    A rotor's flashes are as regular, and pulses lost in this way pass for them.
    """
    places, none = np.flatnonzero(zero), np.zeros(len(zero), bool)
    period = int(np.bincount(np.diff(places), minlength=2).argmax())
    if period < 2:
        return none
    first = int(np.bincount(places % period).argmax())
    members = len(zero[first::period])
    share = (len(places) - members + 1) / (len(zero) - members + 1)
    if not zero[first::period].all() or len(zero) ** 2 * share**members > CHANCE:
        return none
    lost = none.copy()
    lost[first::period] = True
    return lost & _in_short_runs(zero)


def _among_steps(iq: NDArray[np.complex64], zero: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Zeros that are lost pulses because there are more than the steps of a converter give; else none."""
    none = np.zeros(len(iq), bool)
    size = _sizes(iq)
    held, steps = _sorted_steps(size[~zero])
    if _hardly_steps(held, steps):
        return none
    nearly = np.float32(NEAR_STEPS) * np.median(steps)
    near = int(np.searchsorted(held, nearly, side="right"))
    if np.count_nonzero(zero) <= NEAR_SHARE * near:  # most records of converters of coarse steps end here
        return none
    step = _turned_step(iq, zero)
    if step:
        size, nearly = np.abs(iq), np.float32(NEAR_TURNED * step)
        near = int(np.count_nonzero((size <= nearly) & ~zero))
    lost = _in_short_runs(zero)
    zeros = int(lost.sum())
    if zeros <= NEAR_SHARE * near:
        return none
    # a lost pulse stands among larger samples; zeros of what hardly reaches the first step stand among small ones
    beside = ~zero & (np.convolve(lost, [1, 0, 1], "same") > 0)
    if np.median(size[beside]) <= nearly:
        return none
    places = PLACES if iq.real.any() and iq.imag.any() else PLACES_OF_ONE
    stepless = not step and 1 - (len(steps) + 1) / len(held) < ALIKE
    if zeros < LEAST_LOST:
        no_chance = stepless and len(held) >= ENOUGH and not lost[[0, -1]].any()
    else:
        no_chance = stepless or _chance(zeros, near, 1 / places) < CHANCE
    return lost if no_chance else none


def _sorted_steps(size: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sizes of samples that are not 0, rising, and the differences between neighbours that differ."""
    held = np.sort(size)
    steps = np.diff(held)
    return held, steps[steps > 0]


def _hardly_steps(held: NDArray[np.float32], steps: NDArray[np.float32]) -> bool:
    """Whether samples that are not 0 have only a few sizes, and 0 is as near to them as they are to one another.

    A converter's noise about another value than 0 has few sizes as well, but 0 is far from these.

    Parameters
    ----------
    held, steps : ndarray
        From `_sorted_steps`.
    """
    if len(steps) + 1 >= LEAST_DISTINCT:
        return False
    few = len(held) < LEAST_DISTINCT or not len(steps)  # too few to tell
    return few or bool(held[0] <= NEAR_STEPS * np.median(steps))


def _turned_step(iq: NDArray[np.complex64], zero: NDArray[np.bool_]) -> float:
    """A converter's step where steps show only near 0, however they were turned in phase; 0 where none shows."""
    held = iq[~zero]
    sizes = np.abs(held)
    smallest = sizes.min()
    one_size = sizes <= (1 + SAME_SIZE) * smallest
    if np.count_nonzero(one_size) < 2:
        return 0.0
    apart = np.abs(held - held[sizes.argmin()])
    others, larger = apart[apart > SAME_SIZE * smallest], sizes[~one_size]
    as_near = len(others) and smallest <= AS_NEAR * others.min()
    stands_out = len(larger) and larger.min() >= NEXT_SIZE * smallest
    return float(smallest) if as_near or stands_out else 0.0


def mended(iq: NDArray[np.complex64]) -> tuple[NDArray[np.complex64], dict[tuple[int, ...], slice]]:
    """Records with lost pulses filled in, and the longest whole stretch of those that a silence still breaks.

    Parameters
    ----------
    iq
        Records, shape (..., pulses), finite.

    Returns
    -------
    records : ndarray of complex64, same shape
        Pulses that were not lost are returned as they are.
    stretches : dict of tuple of int to slice
        Of each broken record, by its index, the longest whole stretch (see `unbroken`), or `NOTHING` where lost pulses
        could not be filled in.
    """
    zeros, out = _zeros(iq), iq
    stretches: dict[tuple[int, ...], slice] = {}
    if not np.count_nonzero(zeros):
        return out, stretches
    for index in map(tuple, np.argwhere(zeros.any(axis=-1))):
        lost = lost_pulses(iq[index])
        if lost.any():
            out = iq.copy() if out is iq else out
            out[index] = filled(iq[index], lost)
        stretch = unbroken(out[index]) if out[index][lost].all() else NOTHING
        if stretch != slice(0, iq.shape[-1]):
            stretches[index] = stretch
    return out, stretches


def _chance(zeros: int, near: int, share: float) -> float:
    """Probability of `zeros` or more zeros among `zeros + near` samples, each 0 with probability `share`."""
    from scipy.special import bdtrc  # here, because most dwells are judged without it

    return float(bdtrc(zeros - 1, zeros + near, share))


def _sizes(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """The larger of |I| and |Q| of each sample, which rises in steps of the converter."""
    return np.asarray(np.maximum(np.abs(iq.real), np.abs(iq.imag)))


def _zeros(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """True where samples are exactly 0: I and Q at once, in a sixth of the time of a complex comparison."""
    both = np.ascontiguousarray(iq).view(np.float32) == 0
    return np.asarray(both.view(np.uint16) == _TWO_TRUE, np.bool_)


def _runs(zero: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Start and length of each run of zeros in a record [pulses]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]])))
    return edges[::2], np.diff(edges)[::2]


def _in_short_runs(zero: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True at the zeros of a record that are too few in a row to be silence."""
    _, lengths = _runs(zero)
    out = zero.copy()
    out[zero] = np.repeat(lengths, lengths) <= MOST_IN_A_ROW
    return out


def _silences(iq: NDArray[np.complex64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Start and length of each run of zeros too long to be filled in [pulses]; none if the record is 0 throughout."""
    zero = _zeros(iq)
    starts, lengths = _runs(zero)
    long = lengths > MOST_IN_A_ROW
    if lengths.max(initial=0) == len(iq):
        long[:] = False
    elif long.any() and _hardly_steps(*_sorted_steps(_sizes(iq)[~zero])):
        # a converter that hardly steps is often 0: does the share of zeros elsewhere give so long a run by chance?
        others = len(iq) - int(lengths[long].sum())
        share = int(lengths[~long].sum()) / others
        if others < LEAST_DISTINCT or others * share**MOST_IN_A_ROW > CHANCE:
            long[:] = False
    return starts[long], lengths[long]


def silent(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """True where samples of one record lie in a run of zeros too long to be filled in, shape (pulses,)."""
    out = np.zeros(len(iq), bool)
    starts, lengths = _silences(iq)
    for start, length in zip(starts, lengths, strict=True):
        out[start : start + length] = True
    return out


def longest_silence(iq: NDArray[np.complex64]) -> tuple[int, int]:
    """Start and length of the longest run of zeros too long to be filled in [pulses]; 0 and 0 where there is none."""
    starts, lengths = _silences(iq)
    if not len(lengths):
        return 0, 0
    longest = int(lengths.argmax())
    return int(starts[longest]), int(lengths[longest])


def unbroken(iq: NDArray[np.complex64]) -> slice:
    """The longest stretch of a record without a silence too long to be filled in.

    A signal that begins or ends within a record widens all of its lines, and regular silences draw a comb beside each.

    Parameters
    ----------
    iq
        Samples of one record, shape (pulses,), finite.

    Returns
    -------
    slice
        The whole record where there is no such silence, or nothing but silence.
    """
    starts, lengths = _silences(iq)
    begin, end = np.append(0, starts + lengths), np.append(starts, len(iq))
    longest = int((end - begin).argmax())
    return slice(int(begin[longest]), int(end[longest]))


def filled(iq: NDArray[np.complex64], lost: NDArray[np.bool_]) -> NDArray[np.complex64]:
    """Fill in lost pulses from those before and after them.

    To each block an autoregressive law is fitted, forwards and backwards: each pulse follows from those beside it. The
    lost pulses are those that leave the least residual of this law, which is exact for a few lines. Noise is added, as
    strong as the residual elsewhere tells: without it noise would come and go as pulses are lost. I and Q are held
    within their range elsewhere (`keep_within`): a converter that clipped does so there too, and a channel that is the
    same in every pulse stays so.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.
    lost
        From `lost_pulses`, same shape.

    Returns
    -------
    ndarray of complex64, same shape
        Where too many pulses are lost for any law, they stay as they were.

    References
    ----------
    Janssen, Veldhuis and Vries, "Adaptive interpolation of discrete-time signals that can be modeled as autoregressive
    processes", IEEE Trans. ASSP 34 (1986).
    """
    out, noise = iq.copy(), np.random.default_rng((_SEED, len(iq)))
    with one_thread:
        for block in np.array_split(np.arange(len(iq)), max(len(iq) // BLOCK, 1)):
            own = lost[block]
            if own.any():
                start = max(block[0] - 2 * MOST_ORDERS, 0)
                part = slice(start, block[-1] + 1 + 2 * MOST_ORDERS)
                out[block[own]] = _filled_block(iq[part].astype(np.complex128), lost[part], noise)[block[own] - start]
    keep_within(out, lost)
    return out


def keep_within(iq: NDArray[np.complex64], filled_in: NDArray[np.bool_]) -> None:
    """Hold samples that were filled in, in place, to the range of I and Q elsewhere; one channel stays one, to the bit.

    Parameters
    ----------
    iq
        Samples of one record, shape (pulses,), finite.
    filled_in
        True where a sample was filled in, same shape; not everywhere.
    """
    for part in (iq.real, iq.imag):
        given = part[~filled_in]
        part[filled_in] = np.clip(part[filled_in], given.min(), given.max())
    for sign in (1, -1):
        if (iq.real[~filled_in] == sign * iq.imag[~filled_in]).all():
            iq.imag[filled_in] = sign * iq.real[filled_in]


def _filled_block(
    iq: NDArray[np.complex128], lost: NDArray[np.bool_], noise: np.random.Generator
) -> NDArray[np.complex128]:
    """`filled` of a block, with one law."""
    from scipy.linalg import solveh_banded  # here, because recordings without lost pulses need no such import

    orders = min(MOST_ORDERS, len(iq) // 2)
    while orders > 1:
        clear = ~np.lib.stride_tricks.sliding_window_view(lost, orders + 1).any(axis=1)
        if clear.sum() >= STRETCHES * orders:
            break
        orders //= 2
    else:
        return iq
    stretches = np.lib.stride_tricks.sliding_window_view(iq, orders + 1)[clear]
    # the law tells the last pulse of a stretch from those before it, and the first, conjugated, from those after it
    both = np.concatenate([stretches[:, ::-1], stretches.conj()])
    products = both.conj().T @ both
    products.flat[:: orders + 2] += RIDGE * products.trace().real / (orders + 1)
    law = np.concatenate([[1.0], -np.linalg.solve(products[1:, 1:], products[1:, 0])])
    # the residuals of all pulses that have `orders` pulses before or after them, squared and summed: `apart` holds the
    # weights of products of pulses by their distance; at the ends of the block only one of both directions counts
    apart = np.correlate(law, law, "full")[orders:]
    places, steps = np.flatnonzero(lost), np.arange(orders)
    known = np.where(lost, 0, iq)
    pull = np.convolve(known, np.concatenate([apart[:0:-1].conj(), apart]))[orders : orders + len(iq)]
    row, column = np.indices((orders, orders))
    first = np.where(row >= column, law[np.maximum(row - column, 0)], 0)
    last = np.where(row <= column, law[orders - np.maximum(column - row, 0)], 0)
    first, last = first.conj().T @ first, last.conj().T @ last
    first, last = (first + last[::-1, ::-1].conj()) / 2, (last + first[::-1, ::-1].conj()) / 2
    ends = [(0, first), (len(iq) - orders, last)]
    for start, excess in ends:
        pull[start + steps] -= excess @ known[start + steps]
    # the lower triangle of the equations, by its diagonals; pulses further apart than the law reaches have no products
    inner = np.zeros((min(orders + 1, len(places)), len(places)), np.complex128)
    for below, diagonal in enumerate(inner):
        step = places[below:] - places[: len(places) - below]
        diagonal[: len(step)] = np.where(step <= orders, apart[np.minimum(step, orders)], 0)
    bands = inner.copy()
    for below in range(len(bands)):
        one, other = places[below:], places[: len(places) - below]
        for start, excess in ends:
            both_there = np.flatnonzero((other >= start) & (one < start + orders))
            bands[below, both_there] -= excess[one[both_there] - start, other[both_there] - start]
    for each in (inner, bands):
        each[0] *= 1 + RIDGE  # or with rounding the equations might not be positive definite
    out = iq.copy()
    out[places] = -solveh_banded(bands, pull[places], lower=True)
    # noise of the lost pulses by the law's residual, given all other pulses; at the ends as if there were others beyond
    white = noise.standard_normal((2, len(places)))
    white = white[0] + 1j * white[1] if iq.real.any() and iq.imag.any() else np.sqrt(2) * white[0]
    out[places] += np.sqrt(np.mean(np.abs(both @ law) ** 2) / 2) * _of_precision(inner, white)
    return out


def _of_precision(bands: NDArray[np.complex128], white: NDArray[np.inexact]) -> NDArray[np.complex128]:
    """White noise made noise whose covariance is the inverse of a matrix, which is given by its lower diagonals."""
    from scipy.linalg import cholesky_banded, solve_banded  # here, for the same reason as above

    root = cholesky_banded(bands, lower=True)
    upper = np.zeros_like(root)  # its conjugate transpose, by its diagonals from the uppermost down
    for above, diagonal in enumerate(root):
        upper[-1 - above, above:] = diagonal[: len(white) - above].conj()
    return np.asarray(solve_banded((0, len(root) - 1), upper, white), np.complex128)
