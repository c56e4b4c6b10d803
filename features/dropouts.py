"""Whether pulses were lost: samples that are exactly 0 where hardly any is nearly 0; and what they would have held."""

import numpy as np
from numpy.typing import NDArray

from .one_thread import one_thread

#: Samples no further from 0 than so many steps of the converter are nearly 0, and zeros are lost pulses where they are
#: more than this share of these. Samples without steps differ by next to nothing, and next to none is nearly 0.
NEAR_STEPS, NEAR_SHARE = 2.1, 0.5

#: They are so many, and not chance, likelier than this: of two channels 25 places lie so near, each about as likely as
#: 0, of one channel 5, so that it takes six of one. Samples that are hardly ever alike, of so many and more, have no
#: such places: one 0 among them is a lost pulse, but for one at an end, where a window or a beginning may be 0.
LEAST_LOST, CHANCE, PLACES, PLACES_OF_ONE, ALIKE, ENOUGH = 3, 1e-4, 25, 5, 0.01, 100

#: More zeros in a row are silence, too long to be filled in: it would break every line.
MOST_IN_A_ROW = 32

#: A pulse is told from so many before and after it at most, by laws fitted to so many at a time and those beside them,
#: each to as many stretches without a lost one as this for every pulse it tells from. With a law of fewer than two
#: nothing is filled in.
MOST_ORDERS, BLOCK, STRETCHES = 32, 8192, 6

#: Share of the mean power that holds a law's coefficients back: next to nothing beside any noise.
RIDGE = 1e-10

#: What is whole of a record that lost so many pulses that no law tells of them, and why nothing is told of it.
NOTHING = slice(0, 0)
BEYOND_FILLING_IN = "lost pulses: so many are exactly 0 that they cannot be filled in"

#: Of what is unexplained in pulses that are filled in, the same for all records of so many pulses.
_SEED = 22

#: Two truths beside each other, as one number.
_TWO_TRUE = np.array([True, True]).view(np.uint16)

#: Fewer sizes that differ are a converter's that hardly steps at all: it may give 0 most of the time.
LEAST_DISTINCT = 8

#: Of so few samples that are not 0 nothing is told whose zeros the others are: a silence, rather than a converter's.
LEAST_HELD = 64

#: A converter's steps that were turned in phase, or whose channels were set right, show about 0 alone: several of the
#: smallest samples have one size, to so much of it, and that is no more than so many times their distance from any
#: other, or the next size is larger by so much. As many places as about steps not turned lie within so many of it.
SAME_SIZE, AS_NEAR, NEXT_SIZE, NEAR_TURNED = 1e-6, 1.5, 1.2, 2.9


def lost_pulses(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Find the pulses that hold nothing at all, not even noise.

    Each spoils every line of the spectrum as an impulse would; a few of them, of whatever spacing, look like a rotor's
    flashes.

    Parameters
    ----------
    iq
        Samples of one recording, shape (pulses,), finite.

    Returns
    -------
    ndarray of bool, same shape
        False everywhere where nothing speaks of lost ones: no zeros, no more than a converter of coarse steps gives of
        noise, or nothing else. Zeros of longer silences are no lost pulses.
    """
    zero = _zeros(iq)
    if not zero.any():
        return zero
    lost = _among_steps(iq, zero)
    return lost if lost.any() else _regular(zero)


def _regular(zero: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Zeros as far apart as most are, from end to end: no chance, among those of a converter of coarse steps too.

    A rotor's flashes come so, and what is lost so passes for them.
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
    """Zeros that are more than the steps of a converter give."""
    none = np.zeros(len(iq), bool)
    size = _sizes(iq)
    held, steps = _sorted_steps(size[~zero])
    if _hardly_steps(held, steps):
        return none
    nearly = np.float32(NEAR_STEPS) * np.median(steps)
    near = int(np.searchsorted(held, nearly, side="right"))
    if np.count_nonzero(zero) <= NEAR_SHARE * near:  # what most converters of coarse steps give ends here
        return none
    step = _turned_step(iq, zero)
    if step:
        size, nearly = np.abs(iq), np.float32(NEAR_TURNED * step)
        near = int(np.count_nonzero((size <= nearly) & ~zero))
    lost = _in_short_runs(zero)
    zeros = int(lost.sum())
    if zeros <= NEAR_SHARE * near:
        return none
    # a lost pulse stands among others; zeros of what hardly reaches the converter's first step stand among such
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
    """Sizes of samples that are not 0, rising, and what lies between those that differ."""
    held = np.sort(size)
    steps = np.diff(held)
    return held, steps[steps > 0]


def _hardly_steps(held: NDArray[np.float32], steps: NDArray[np.float32]) -> bool:
    """Whether samples that are not 0 have hardly another size, and 0 is as near to them as they are to one another.

    A converter's noise about another value than 0 has few sizes as well, but is never 0.

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
    """A converter's step where it shows about 0 alone, whichever way its steps were turned; 0 where it does not."""
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
    """Records with the pulses that each has lost filled in, and of those that a silence still breaks what is whole.

    Parameters
    ----------
    iq
        Records, shape (..., pulses), finite.

    Returns
    -------
    records : ndarray of complex64, same shape
        Those that are there are returned as they are.
    stretches : dict of tuple of int to slice
        Of each broken record, by its index, the longest stretch that is not (see `unbroken`), or `NOTHING`.
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
    """How likely so many zeros are, and more, among those and those nearly 0, if each is one by this chance."""
    from scipy.special import bdtrc  # here, because dwells are judged without

    return float(bdtrc(zeros - 1, zeros + near, share))


def _sizes(iq: NDArray[np.complex64]) -> NDArray[np.float32]:
    """The larger part of each sample, in whose steps a converter counts."""
    return np.asarray(np.maximum(np.abs(iq.real), np.abs(iq.imag)))


def _zeros(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Where samples are exactly 0: of both parts at once, in a sixth of the time of a complex comparison."""
    both = np.ascontiguousarray(iq).view(np.float32) == 0
    return np.asarray(both.view(np.uint16) == _TWO_TRUE, np.bool_)


def _runs(zero: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where each run of zeros begins, and its pulses, of a record's."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]])))
    return edges[::2], np.diff(edges)[::2]


def _in_short_runs(zero: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Zeros that are not so many in a row as silence is, of a record's."""
    _, lengths = _runs(zero)
    out = zero.copy()
    out[zero] = np.repeat(lengths, lengths) <= MOST_IN_A_ROW
    return out


def _silences(iq: NDArray[np.complex64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where each run of zeros begins that is too long to be filled in, and its pulses; none of what is 0 throughout."""
    zero = _zeros(iq)
    starts, lengths = _runs(zero)
    long = lengths > MOST_IN_A_ROW
    if lengths.max(initial=0) == len(iq):
        long[:] = False
    elif long.any() and len(iq) - lengths.sum() >= LEAST_HELD and _hardly_steps(*_sorted_steps(_sizes(iq)[~zero])):
        # what hardly steps is often 0: so long in a row by chance, by how often it is elsewhere?
        others = len(iq) - int(lengths[long].sum())
        share = int(lengths[~long].sum()) / others
        if others < LEAST_DISTINCT or others * share**MOST_IN_A_ROW > CHANCE:
            long[:] = False
    return starts[long], lengths[long]


def silent(iq: NDArray[np.complex64]) -> NDArray[np.bool_]:
    """Where samples of one record are of a run of zeros that is too long to be filled in, shape (pulses,)."""
    out = np.zeros(len(iq), bool)
    starts, lengths = _silences(iq)
    for start, length in zip(starts, lengths, strict=True):
        out[start : start + length] = True
    return out


def longest_silence(iq: NDArray[np.complex64]) -> tuple[int, int]:
    """Where the longest run of zeros begins that is too long to be filled in, and its pulses; 0 where there is none."""
    starts, lengths = _silences(iq)
    if not len(lengths):
        return 0, 0
    longest = int(lengths.argmax())
    return int(starts[longest]), int(lengths[longest])


def unbroken(iq: NDArray[np.complex64]) -> slice:
    """The longest stretch of a record that no silence breaks which is too long to be filled in.

    What begins or ends within a record widens all of its lines, and regular silences draw a comb beside each.

    Parameters
    ----------
    iq
        Samples of one record, shape (pulses,), finite.

    Returns
    -------
    slice
        All of it where there is no such silence, or nothing else.
    """
    starts, lengths = _silences(iq)
    begin, end = np.append(0, starts + lengths), np.append(starts, len(iq))
    longest = int((end - begin).argmax())
    return slice(int(begin[longest]), int(end[longest]))


def filled(iq: NDArray[np.complex64], lost: NDArray[np.bool_]) -> NDArray[np.complex64]:
    """Fill in lost pulses from those before and after them.

    By the law by which each pulse of a block follows from those beside it (an autoregressive one, fitted forwards and
    backwards), those that are missing are what leaves the least of it unexplained, exact for a few lines, and beside
    that as much of it as is unexplained elsewhere: without it noise would come and go as pulses are lost. Nor is I or Q
    beyond what it is elsewhere (`keep_within`): a converter that clipped does so there too, and a channel that is the
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
        Where too many are lost for any law, as they were.

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
    """Hold what was filled in, in place, to what I and Q are elsewhere; one channel stays that, to the bit.

    Parameters
    ----------
    iq
        Samples of one record, shape (pulses,), finite.
    filled_in
        Which of them, same shape; not all.
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
    """`filled` of a block that one law holds for."""
    from scipy.linalg import solveh_banded  # here, because whole recordings need no such import

    orders = min(MOST_ORDERS, len(iq) // 2)
    while orders > 1:
        clear = ~np.lib.stride_tricks.sliding_window_view(lost, orders + 1).any(axis=1)
        if clear.sum() >= STRETCHES * orders:
            break
        orders //= 2
    else:
        return iq
    stretches = np.lib.stride_tricks.sliding_window_view(iq, orders + 1)[clear]
    # the last pulse of each from those before it, and the first, conjugated, from those after it
    both = np.concatenate([stretches[:, ::-1], stretches.conj()])
    products = both.conj().T @ both
    products.flat[:: orders + 2] += RIDGE * products.trace().real / (orders + 1)
    law = np.concatenate([[1.0], -np.linalg.solve(products[1:, 1:], products[1:, 0])])
    # what the law leaves unexplained of all pulses that have as many before them, or after them, squared and summed: of
    # pulses so far apart their products, but for the ends, where one of both counts
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
    # of pulses further apart than the law reaches none, and the lower triangle by its diagonals
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
        each[0] *= 1 + RIDGE  # or rounding might undo what holds them
    out = iq.copy()
    out[places] = -solveh_banded(bands, pull[places], lower=True)
    # what is unexplained of those that are missing, given all others; at the ends as if there were others beyond
    white = noise.standard_normal((2, len(places)))
    white = white[0] + 1j * white[1] if iq.real.any() and iq.imag.any() else np.sqrt(2) * white[0]
    out[places] += np.sqrt(np.mean(np.abs(both @ law) ** 2) / 2) * _of_precision(inner, white)
    return out


def _of_precision(bands: NDArray[np.complex128], white: NDArray[np.inexact]) -> NDArray[np.complex128]:
    """White noise made noise whose covariance is the inverse of a matrix, given by its lower diagonals."""
    from scipy.linalg import cholesky_banded, solve_banded  # here, as above

    root = cholesky_banded(bands, lower=True)
    upper = np.zeros_like(root)  # its conjugate transpose, by its diagonals from the uppermost down
    for above, diagonal in enumerate(root):
        upper[-1 - above, above:] = diagonal[: len(white) - above].conj()
    return np.asarray(solve_banded((0, len(root) - 1), upper, white), np.complex128)
