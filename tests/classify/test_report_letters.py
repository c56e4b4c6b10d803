"""Letters of a front are read as their own points' and no other's."""

from itertools import combinations
from math import dist, hypot

import numpy as np
import pytest
from bladewing.classify.report.letters import CLOSE, OWN, places

FRAME = (0.0, 0.0, 230.0, 210.0)


@pytest.mark.parametrize(("across", "up"), [(14.0, 12.0), (9.0, 6.0), (3.0, 9.0), (12.0, 1.0)])
@pytest.mark.parametrize("start", [(20.0, 100.0), (60.0, 80.0)])
def test_each_letter_is_nearest_its_own_point_or_has_a_line_to_it(
    across: float, up: float, start: tuple[float, float]
) -> None:
    rng = np.random.default_rng(0)
    steps = np.cumsum(rng.uniform(0.5, 1.5, (8, 2)) * (across, up), axis=0) + start
    points = [(float(a), float(b)) for a, b in steps]
    shifts = places(points, FRAME)
    letters = [(a + c, b + d) for (a, b), (c, d) in zip(points, shifts, strict=True)]
    for own, (letter, shift) in enumerate(zip(letters, shifts, strict=True)):
        others = [dist(letter, point) for number, point in enumerate(points) if number != own]
        assert hypot(*shift) > CLOSE or min(others) >= OWN * hypot(*shift)
        assert min(others) > 5, "it lies over another point"
    for (a, b), (c, d) in combinations(letters, 2):
        assert abs(a - c) > 7 or abs(b - d) > 8, "two letters lie over each other"


def test_a_point_alone_has_its_letter_beside_it() -> None:
    assert hypot(*places([(100.0, 100.0)], FRAME)[0]) <= CLOSE
    assert places([], FRAME) == []
