import numpy as np
import pytest
from bladewing.features.window import BROAD_HANN, HANN, KAISER

PULSES, FINE = 512, 64


def response_db(window):
    """Level of a line so many FINE-ths of a bin away, over its own."""
    response = np.abs(np.fft.rfft(window.taper(PULSES), PULSES * FINE))
    return 20 * np.log10(np.maximum(response / response[0], 1e-12))


@pytest.mark.parametrize("window", [HANN, BROAD_HANN, KAISER])
def test_a_taper_passes_noise_as_it_is_and_time_both_ways(window):
    taper = window.taper(PULSES)
    assert np.sum(taper**2) == pytest.approx(1)
    assert (taper > 0).all(), "no pulse is lost"
    np.testing.assert_allclose(taper, taper[::-1], atol=1e-12)
    assert pytest.approx(PULSES * np.sum(taper**2) / taper.sum() ** 2, rel=4e-3) == window.noise_bandwidth_bins


def test_the_side_lobes_of_the_kaiser_window_lie_under_minus_93_db():
    level_db = response_db(KAISER)
    assert level_db[np.argmax(np.diff(level_db) > 0) :].max() < -93


@pytest.mark.parametrize(("window", "at_five_bins_db"), [(HANN, -53), (BROAD_HANN, -47)])
def test_the_side_lobes_of_hanns_windows_fall_by_18_db_an_octave(window, at_five_bins_db):
    level_db = response_db(window)
    highest = [level_db[bins * FINE : (bins + 1) * FINE].max() for bins in (5, 10, 20, 40, 80)]
    assert highest[0] < at_five_bins_db
    np.testing.assert_allclose(np.diff(highest), -18, atol=2.5)


def test_parts_that_overlap_by_half_weigh_all_pulses_alike_in_hanns_window():
    part = HANN.taper(PULSES) ** 2
    both = part + np.roll(part, PULSES // 2)
    assert both.min() > 0.49 * both.max()
    one = KAISER.taper(PULSES) ** 2
    both = one + np.roll(one, PULSES // 2)
    assert both.min() < 0.15 * both.max()
