import numpy as np
import pytest
from bladewing.classify.report.draw_examples import CLIPPED_DB
from bladewing.classify.report.examples import draw_examples, show_examples
from bladewing.simulate import Radar, Records

RADAR = Radar(carrier_hz=9.85e9, prf_hz=25e3, pulses=2000)


def moving_at(velocity_mps: float) -> Records:
    """One record of a point that recedes at a constant velocity, 30 dB over the noise of a sample."""
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((2, RADAR.pulses)) * np.sqrt(0.5)
    doppler_hz = -2.0 * velocity_mps / RADAR.wavelength_m
    iq = 10**1.5 * np.exp(2j * np.pi * doppler_hz * RADAR.times_s) + noise[0] + 1j * noise[1]
    truth = {"kind": np.array(["vehicle"]), "snr_db": np.array([np.nan])}
    return Records(RADAR, iq.astype(np.complex64)[None], np.array(["clutter"]), truth)


@pytest.mark.parametrize("velocity_mps", [-60.0, -3.0, 0.0, 12.0, 100.0])
def test_a_line_stands_at_its_velocity_in_both_pictures(velocity_mps: float) -> None:
    (one,) = show_examples(moving_at(velocity_mps), ("uav", "bird", "clutter"))
    assert (one["class"], one["kind"], one["snr_db"]) == ("clutter", "vehicle", None)
    spectrum, picture = one["spectrum"], one["picture"]
    assert len(spectrum["velocity_mps"]) == len(spectrum["level_db"])
    line = spectrum["velocity_mps"][int(np.argmax(spectrum["level_db"]))]
    # each picture to half a pool and half a bin: a bin is wavelength / (2 dwell), and 1 / 512 of the STFT's axis
    pool_mps = spectrum["velocity_mps"][1] - spectrum["velocity_mps"][0]
    assert line == pytest.approx(velocity_mps, abs=pool_mps / 2 + RADAR.wavelength_m / (4 * RADAR.dwell_s))
    level = np.array(picture["level_db"])
    first, last = picture["velocity_mps"]
    row_mps, bin_mps = (last - first) / level.shape[0], 2 * RADAR.unambiguous_mps / 512
    # levels are whole decibels: the rows that share the highest one lie about the line
    row = np.flatnonzero(level.mean(axis=1) > level.mean(axis=1).max() - 0.5).mean()
    assert first + (row + 0.5) * row_mps == pytest.approx(velocity_mps, abs=row_mps / 2 + bin_mps)
    assert first < velocity_mps < last


def test_records_of_fitting_snr_are_preferred() -> None:
    some = moving_at(5.0)
    truth = {"kind": np.array(["rain", "sea", "person"]), "snr_db": np.array([-15.0, 40.0, 12.0])}
    several = Records(RADAR, np.repeat(some.iq, 3, axis=0), np.repeat(some.labels, 3), truth)
    (one,) = show_examples(several, ("uav", "bird", "clutter"))
    assert (one["kind"], one["snr_db"]) == ("person", 12.0)


def test_of_fitting_records_those_without_a_background_are_preferred() -> None:
    some = moving_at(5.0)
    truth = {"kind": np.array(["rain", "sea", "person"]), "snr_db": np.array([15.0, 40.0, 12.0])}
    truth["background_db"] = np.array([10.0, np.nan, np.nan])
    several = Records(RADAR, np.repeat(some.iq, 3, axis=0), np.repeat(some.labels, 3), truth)
    (one,) = show_examples(several, ("uav", "bird", "clutter"))
    assert one["kind"] == "person"


def test_one_record_of_each_class_is_drawn_long_enough_to_see_it_move() -> None:
    shown = draw_examples(0, ("uav", "bird", "clutter"))
    assert [one["class"] for one in shown] == ["uav", "bird", "clutter"]
    assert {one["dwell_s"] for one in shown} == {0.3}
    assert shown[0]["measured"]["chopping_hz"], "the comb of the UAV's rotors is drawn in"
    # the body is a narrow line, no slab: most of what is shown is not clipped
    for one in shown:
        level = np.array(one["picture"]["level_db"])
        assert (level >= CLIPPED_DB).mean() < 0.2
