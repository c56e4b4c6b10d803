"""Letters beside the points of a front, each placed so that nobody takes it for another point's letter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, dist, hypot, radians, sin

from matplotlib.axes import Axes

from .svg import INK

_Place = tuple[float, float]

#: Half width and half height of a letter of 8 point and of a marker of 6 point, both with some margin [point].
_LETTER, _MARKER = (4.3, 5.0), (4.0, 4.0)

#: A letter farther than this from its point gets a line to the point [point].
CLOSE = 10.5

#: A letter without a line must be at least this many times farther from every other lettered point than from its own.
OWN = 1.5

# Directions from a point to its letter [degree], the best first. _FREE: up and left of a point of the front lies no
# other point and not the line that joins them. _TAKEN: directions in which beaten points may lie.
_FREE, _TAKEN = (140, 180, 90, 160, 120, 105, 150, 130, 170), (330, 300, 0, 270)
_SHIFTS = tuple(
    (far * cos(radians(angle)), far * sin(radians(angle)))
    for angles in (_FREE, _TAKEN)
    for far in (10.0, 14.0, 18.0, 22.0, 26.0, 30.0, 36.0, 42.0)
    for angle in angles
)

# Penalty of each place, where a fault counts 1: it grows with the rank; the _TAKEN directions get 0.6 more.
_WEIGHT = {
    shift: 0.003 * rank + 0.6 * (rank >= len(_SHIFTS) * len(_FREE) // len(_FREE + _TAKEN))
    for rank, shift in enumerate(_SHIFTS)
}

_ROUNDS = 8  # enough for the places to stop changing


def write_letters(axes: Axes, x: Sequence[float], y: Sequence[float], texts: Sequence[str]) -> None:
    """Write a letter beside each point of a front, with a line between them if the letter is not close.

    Parameters
    ----------
    axes : Axes
        With all its ticks and labels already set: later ones would move the points after the letters were placed.
    x, y : sequence of float
        The points.
    texts : sequence of str
        Their letters.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    scale = 72.0 / figure.dpi
    points = [(float(a) * scale, float(b) * scale) for a, b in map(axes.transData.transform, zip(x, y, strict=True))]
    left, bottom, right, top = (float(edge) * scale for edge in axes.bbox.extents)
    for at, px, py, text, shift in zip(points, x, y, texts, places(points, (left, bottom, right, top)), strict=True):
        axes.annotate(
            text, (px, py), xytext=shift, textcoords="offset points", ha="center", va="center", color=INK, fontsize=8
        )
        if hypot(*shift) > CLOSE:
            near = 1 - 4.5 / hypot(*shift)  # the line ends short of the letter
            ends = axes.transData.inverted().transform(
                [[(a + part * by) / scale for a, by in zip(at, shift, strict=True)] for part in (0.0, near)]
            )
            axes.plot(ends[:, 0], ends[:, 1], color=INK, linewidth=0.5, zorder=1, scalex=False, scaley=False)


def places(points: Sequence[_Place], frame: tuple[float, float, float, float]) -> list[_Place]:
    """Give the offset of each letter from its point of a front [point].

    The letters take turns: each moves to the best place beside the others until none moves. This is done in both orders
    of the front, and the better result is kept.

    Parameters
    ----------
    points : sequence of tuple of float
        The front, from lower left to upper right.
    frame : tuple of float
        Left, bottom, right and top of the field.
    """

    def price(own: int, shift: _Place, shifts: Mapping[int, _Place]) -> float:
        others = [(points[other], its) for other, its in shifts.items() if other != own]
        return _faults(own, shift, points, others, frame) + _WEIGHT[shift]

    tried = []
    for order in (range(len(points)), range(len(points))[::-1]):
        shifts: dict[int, _Place] = {}
        for _ in range(_ROUNDS):
            before = dict(shifts)
            for own in order:
                shifts[own] = min(_SHIFTS, key=lambda shift, own=own: price(own, shift, shifts))  # type: ignore[misc]
            if shifts == before:
                break
        tried.append((sum(price(own, shift, shifts) for own, shift in shifts.items()), shifts))
    best = min(tried, key=lambda pair: pair[0])[1]
    return [best[own] for own in range(len(points))]


def _faults(
    own: int,
    shift: _Place,
    points: Sequence[_Place],
    others: Sequence[tuple[_Place, _Place]],
    frame: tuple[float, float, float, float],
) -> int:
    """Count the faults of a place: letter or line over something, taken for another point's, or outside the field."""
    point, far = points[own], hypot(*shift)
    at = point[0] + shift[0], point[1] + shift[1]
    spots = _line(point, shift)
    wrong = []
    for other, its in others:
        letter, its_spots = (other[0] + its[0], other[1] + its[1]), _line(other, its)
        wrong += [_over(at, letter, _LETTER), _cross(spots, its_spots)]
        wrong += [any(_over(at, spot) for spot in its_spots), any(_over(letter, spot) for spot in spots)]
    for number, other in enumerate(points):
        if number != own:
            wrong += [_over(at, other, _MARKER), any(dist(spot, other) < _MARKER[0] for spot in spots)]
            wrong += [far <= CLOSE and dist(at, other) < OWN * far]
    left, bottom, right, top = frame
    wrong += [not (left < at[0] - _LETTER[0] and at[0] + _LETTER[0] < right and bottom < at[1] < top)]
    return sum(wrong)


def _over(letter: _Place, other: _Place, half: tuple[float, float] = (0.0, 0.0)) -> bool:
    """Whether a letter overlaps another thing of the given half width and half height."""
    return all(abs(a - b) < mine + its for a, b, mine, its in zip(letter, other, _LETTER, half, strict=True))


def _line(point: _Place, shift: _Place) -> list[_Place]:
    """Give places along the line from a point's marker to its letter; none if no line is drawn."""
    steps = [part / 8 for part in range(2, 9)] if hypot(*shift) > CLOSE else []
    return [(point[0] + step * shift[0], point[1] + step * shift[1]) for step in steps]


def _cross(one: list[_Place], other: list[_Place]) -> bool:
    """Whether two lines cross: the ends of each lie on different sides of the other."""
    if not (one and other):
        return False

    def side(line: list[_Place], at: _Place) -> float:
        (a, b), (c, d) = line[0], line[-1]
        return (c - a) * (at[1] - b) - (d - b) * (at[0] - a)

    return all(side(a, b[0]) * side(a, b[-1]) < 0 for a, b in ((one, other), (other, one)))
