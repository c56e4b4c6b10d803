import numpy as np
import pytest
from bladewing.simulate import Radar


def test_paper_radar_has_the_dwell_and_the_span_of_table_i():
    radar = Radar(carrier_hz=9.85e9, prf_hz=35e3, pulses=3000)
    assert radar.dwell_s == pytest.approx(0.0857, abs=5e-5)
    assert radar.wavelength_m == pytest.approx(0.030436, abs=1e-6)
    # The fastest Doppler that 35 kHz holds is 17.5 kHz, a radial speed of 17.5 kHz x wavelength / 2.
    assert radar.unambiguous_mps == pytest.approx(17.5e3 * radar.wavelength_m / 2)
    np.testing.assert_allclose(np.diff(radar.times_s), 1 / 35e3)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("carrier_hz", 0.0),
        ("carrier_hz", np.nan),
        ("carrier_hz", 9.85),
        ("prf_hz", -1.0),
        ("prf_hz", np.inf),
        ("pulses", 0),
        ("pulses", 1.5),
        ("pulses", 64.0),
        ("pulses", True),
    ],
)
def test_impossible_radars_are_refused_by_name(field, value):
    good = {"carrier_hz": 1e10, "prf_hz": 1e4, "pulses": 100}
    with pytest.raises(ValueError, match=field):
        Radar(**(good | {field: value}))


def test_numbers_of_single_precision_do_not_make_the_radar_one():
    """Phases of a range of kilometres need all digits of the wavelength."""
    radar = Radar(np.float32(9.984e9), np.float32(35e3), np.int16(3000))
    assert radar == Radar(float(np.float32(9.984e9)), 35e3, 3000)
    assert (type(radar.wavelength_m), type(radar.dwell_s), type(radar.pulses)) == (float, float, int)
