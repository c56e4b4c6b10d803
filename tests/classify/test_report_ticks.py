"""Numbers on the axes of the report's figures."""

import pytest
from bladewing.classify.report.ticks import log_ticks, percent_ticks
from matplotlib.figure import Figure


def numbers(low: float, high: float, *, share: bool = False) -> list[str]:
    """What is written on an axis between two ends."""
    axes = Figure().add_subplot()
    if share:
        axes.set_ylim(low, high)
        percent_ticks(axes.yaxis)
    else:
        axes.set_yscale("log")
        axes.set_ylim(low, high)
        log_ticks(axes.yaxis, (low, high))
    return axes.yaxis.get_major_formatter().format_ticks(
        [tick for tick in axes.yaxis.get_majorticklocs() if low <= tick <= high]
    )


@pytest.mark.parametrize(
    ("low", "high"), [(2.1, 2.9), (5.1, 9.9), (55, 85), (126.3, 169.8), (30, 300), (110, 9900), (0.3, 3e5), (1, 10)]
)
def test_every_logarithmic_axis_has_numbers_and_not_too_many(low, high):
    written = numbers(low, high)
    assert 2 <= len(written) <= 7
    assert len(set(written)) == len(written)


def test_decades_are_numbered_alone_where_there_are_enough():
    assert numbers(0.9, 1100) == ["1", "10", "100", "1000"]
    assert [one[0] for one in numbers(250, 12000)] == ["3", "1", "3", "1"]


def test_shares_are_whole_where_there_is_room():
    assert numbers(0.463, 0.66, share=True) == ["50 %", "55 %", "60 %", "65 %"]
    assert numbers(0.0, 1.02, share=True)[-1] == "100 %"
    assert "." in numbers(0.9, 0.9049, share=True)[1]
