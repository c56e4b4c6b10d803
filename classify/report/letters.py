"""Letters beside the points of a front, each where it is read as that point's and no other's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, dist, hypot, radians, sin

from matplotlib.axes import Axes

from .svg import INK

_Place = tuple[float, float]

#: Half the width and the height of a letter of 8 point, and of a marker of 6, with some air [point].
_LETTER, _MARKER = (4.3, 5.0), (4.0, 4.0)

#: A line leads to a letter that is farther from its point [point].
CLOSE = 10.5

#: Every other lettered point is at least so many times farther from a letter without such a line.
OWN = 1.5

# The best first. Up and left of a point of the front there is no other point, nor the line that joins them.
_FREE, _TAKEN = (140, 180, 90, 160, 120, 105, 150, 130, 170), (330, 300, 0, 270)
_SHIFTS = tuple(
    (far * cos(radians(angle)), far * sin(radians(angle)))
    for angles in (_FREE, _TAKEN)
    for far in (10.0, 14.0, 18.0, 22.0, 26.0, 30.0, 36.0, 42.0)
    for angle in angles
)

# What a worse place weighs beside a fault, each by its rank and those among the beaten points besides.
_WEIGHT = {
    shift: 0.003 * rank + 0.6 * (rank >= len(_SHIFTS) * len(_FREE) // len(_FREE + _TAKEN))
    for rank, shift in enumerate(_SHIFTS)
}

_ROUNDS = 8  # enough to come to rest


def write_letters(axes: Axes, x: Sequence[float], y: Sequence[float], texts: Sequence[str]) -> None:
    """Write a letter beside each point of a front, with a line to it where it might be taken for another's.

    Parameters
    ----------
    axes : Axes
        With all its ticks and labels: what comes later would move the points, and the letters with them.
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
            near = 1 - 4.5 / hypot(*shift)  # it ends short of the letter
            ends = axes.transData.inverted().transform(
                [[(a + part * by) / scale for a, by in zip(at, shift, strict=True)] for part in (0.0, near)]
            )
            axes.plot(ends[:, 0], ends[:, 1], color=INK, linewidth=0.5, zorder=1, scalex=False, scaley=False)


def places(points: Sequence[_Place], frame: tuple[float, float, float, float]) -> list[_Place]:
    """Where the letter of each point of a front stands, from the point itself [point].

    Each in turn takes the best place beside the others', until none finds a better one; from both ends of the front.

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
    """How often a letter with its line would lie over something, be taken for another's, or leave the field."""
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
    """Whether a letter lies over another thing of that half width and height."""
    return all(abs(a - b) < mine + its for a, b, mine, its in zip(letter, other, _LETTER, half, strict=True))


def _line(point: _Place, shift: _Place) -> list[_Place]:
    """Places along the line from a point's marker to its letter; none where no line is drawn."""
    steps = [part / 8 for part in range(2, 9)] if hypot(*shift) > CLOSE else []
    return [(point[0] + step * shift[0], point[1] + step * shift[1]) for step in steps]


def _cross(one: list[_Place], other: list[_Place]) -> bool:
    """Whether two lines cross: each has the ends of the other on both of its sides."""
    if not (one and other):
        return False

    def side(line: list[_Place], at: _Place) -> float:
        (a, b), (c, d) = line[0], line[-1]
        return (c - a) * (at[1] - b) - (d - b) * (at[0] - a)

    return all(side(a, b[0]) * side(a, b[-1]) < 0 for a, b in ((one, other), (other, one)))
