from dataclasses import replace

import numpy as np
import pytest
from bladewing.simulate import Radar, clutter
from bladewing.simulate.clutter import (
    GAUSSIAN_GROUND,
    _texture,
    billingsley,
    bragg_mps,
    draw_clutter,
    draw_ground,
    gaussian_ground,
    ground_psd,
    process_velocities,
    shaped_noise,
)
from bladewing.simulate.laws import LAWS, WIDTH, Draws
from bladewing.simulate.receiver import NormalsOf

RADAR = Radar(9.85e9, 2e3, 500)


def normals(records: int, seed: int = 0):
    generators = [np.random.default_rng([seed, i]) for i in range(records)]
    return NormalsOf(generators)(np.arange(records))


@pytest.mark.parametrize(
    # Billingsley's numbers at 9.85 GHz: wind [mph], a [dB], b [s/m].
    ("wind_mph", "a_db", "b_s_per_m"),
    [(5, 4.0, 8.57), (10, -0.6, 6.74), (20, -5.3, 5.56), (30, -8.0, 5.04)],
)
def test_billingsley_gives_the_published_numbers(wind_mph, a_db, b_s_per_m):
    a, b = billingsley(wind_mph, 9.85e9)
    assert 10 * np.log10(a) == pytest.approx(a_db, abs=0.06)
    assert b == pytest.approx(b_s_per_m, abs=0.01)


def test_shaped_noise_has_the_spectrum_asked_for():
    records = 400
    v = process_velocities(RADAR)
    mean_mps, width_mps = 3.0, 1.0
    psd = np.tile(np.exp(-0.5 * ((v - mean_mps) / width_mps) ** 2), (records, 1))
    iq = shaped_noise(normals(records), RADAR, psd, v)
    power = np.mean(abs(iq) ** 2)
    # Correlated over about wavelength / (2 width) = 15 ms: some 16 independent values a record.
    assert power == pytest.approx(1, abs=4 / np.sqrt(16 * records))
    measured = abs(np.fft.fft(iq * np.kaiser(RADAR.pulses, 8), axis=1)) ** 2
    measured = measured.mean(axis=0)
    axis = -np.fft.fftfreq(RADAR.pulses, 1 / RADAR.prf_hz) * RADAR.wavelength_m / 2
    centre = np.sum(axis * measured) / measured.sum()
    spread = np.sqrt(np.sum((axis - centre) ** 2 * measured) / measured.sum())
    assert centre == pytest.approx(mean_mps, abs=0.05)
    assert spread == pytest.approx(width_mps, abs=0.05)


@pytest.mark.parametrize(("width_mps", "rest"), [(0.05, 0.0), (0.05, 0.75), (0.4, 0.2)])
def test_ground_of_a_gaussian_law_has_its_width_and_what_stands_still(width_mps, rest):
    records = 400
    radar = Radar(24e9, 2e3, 2000)
    nothing = np.zeros(records)
    gaussian = (np.full(records, width_mps), np.full(records, rest))
    iq = draw_ground(normals(records), radar, np.full(records, 10.0), nothing, gaussian)
    assert np.mean(iq) == pytest.approx(np.sqrt(rest), abs=0.05)
    moving = iq - np.sqrt(rest)
    power = np.mean(abs(moving) ** 2)
    # correlated over about wavelength / (2 width): 16 or more independent values a record
    assert power == pytest.approx(1 - rest, abs=4.5 * (1 - rest) / np.sqrt(16 * records))
    # the mean square of a derivative is that of the velocity, without a window's leakage; differences at 2 kHz see it
    turns = np.mean(moving[:, 1:] * moving[:, :-1].conj()) / power
    exact = np.exp(-0.5 * (4 * np.pi * width_mps / radar.wavelength_m / radar.prf_hz) ** 2)
    assert turns == pytest.approx(exact, abs=0.004 if width_mps > 0.1 else 4e-5)


def test_a_third_of_the_ground_moves_by_a_gaussian_law_of_any_width():
    records = 4000
    draws = Draws(np.random.default_rng(5).random((records, WIDTH)))
    width, rest = gaussian_ground(draws)
    found = np.isfinite(width)
    share = GAUSSIAN_GROUND
    assert found.mean() == pytest.approx(share, abs=4.5 * np.sqrt(share * (1 - share) / records))
    law = LAWS["ground_width_mps"]
    place = np.log(width[found] / law.low) / np.log(law.high / law.low)
    assert np.mean(place) == pytest.approx(0.5, abs=4.5 / np.sqrt(12 * found.sum()))
    assert ((rest > 0.003) & (rest < 0.997)).all()


def test_ground_of_billingsleys_law_is_the_same_whatever_else_was_drawn():
    wind, phase = np.full(3, 12.0), np.zeros(3)
    usual = draw_ground(normals(3), RADAR, wind, phase)
    width = np.array([np.nan, 0.1, np.nan])
    mixed = draw_ground(normals(3), RADAR, wind, phase, (width, np.full(3, 0.5)))
    np.testing.assert_array_equal(mixed[[0, 2]], usual[[0, 2]])
    assert not np.array_equal(mixed[1], usual[1])


@pytest.mark.parametrize("prf_hz", [25.0, 40.0, 300.0])
def test_ground_beyond_the_unambiguous_span_folds_back_into_it(prf_hz):
    """Against the law summed over lines far beyond the span."""
    radar, wind_mph = Radar(1e10, prf_hz, 64), 35.0
    v, span = process_velocities(radar), 2 * radar.unambiguous_mps
    psd, _ = ground_psd(radar, np.array([wind_mph]), v)
    _, b = billingsley(wind_mph, radar.carrier_hz)
    width, fine = abs(v[1]), np.linspace(-0.5, 0.5, 201)
    places = v[:, None, None] + span * np.arange(-200, 201)[:, None] + width * fine
    brute = np.trapezoid(np.exp(-b * np.abs(places)), dx=1 / 200).sum(axis=1)
    np.testing.assert_allclose(psd[0] / psd.sum(), brute / brute.sum(), rtol=1e-5)


def test_ground_rests_and_moves_in_billingsleys_shares():
    records, wind = 600, 20.0
    iq = draw_ground(normals(records), RADAR, np.full(records, wind), np.zeros(records))
    a, b = billingsley(wind, RADAR.carrier_hz)
    rest = a / (a + 1)
    assert np.mean(iq).real == pytest.approx(np.sqrt(rest), abs=0.05)
    moving = iq - np.sqrt(rest)
    assert np.mean(abs(moving) ** 2) == pytest.approx(1 - rest, rel=0.15)
    # exp(-b|v|) falls to half its power within v = ln(2) / b
    v = process_velocities(RADAR)
    spectrum = abs(np.fft.fft(moving, n=len(v), axis=1)) ** 2
    inside = spectrum[:, abs(v) <= np.log(2) / b].sum() / spectrum.sum()
    assert inside == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("shape", [0.3, 1.0, 6.0])
def test_the_sea_has_a_gamma_texture_and_a_k_distributed_intensity(shape):
    records = 4000
    rng = np.random.default_rng(int(10 * shape))
    radar = Radar(9.39e9, 1e3, 80)
    draws = Draws(rng.random((records, WIDTH)))
    amplitude = _texture(draws, radar, np.full(records, shape))
    for pulse in (0, 41, 79):
        texture = amplitude[:, pulse].astype(float) ** 2
        # gamma of unit mean: variance 1 / nu; its fourth central moment is (3 + 6 / nu) / nu^2
        assert texture.mean() == pytest.approx(1, abs=4.5 * np.sqrt(1 / shape / records))
        spread = np.sqrt(((3 + 6 / shape) / shape**2 - 1 / shape**2) / records)
        assert texture.var() == pytest.approx(1 / shape, abs=4.5 * spread + 0.01 / shape)
    speckle = rng.exponential(size=records)
    intensity = speckle * amplitude[:, 0].astype(float) ** 2
    # K distribution: <I^2> / <I>^2 = 2 (1 + 1 / nu), within the sampling error of a heavy tail
    ratio = np.mean(intensity**2) / np.mean(intensity) ** 2
    assert ratio == pytest.approx(2 * (1 + 1 / shape), rel=0.35)


def test_the_texture_is_slow():
    radar = Radar(9.39e9, 1e3, 1000)
    draws = Draws(np.random.default_rng(0).random((500, WIDTH)))
    power = _texture(draws, radar, np.full(500, 2.0)).astype(float) ** 2
    near = np.corrcoef(power[:, 500], power[:, 510])[0, 1]  # 10 ms
    far = np.corrcoef(power[:, 0], power[:, -1])[0, 1]  # 1 s
    assert near > 0.98
    assert far < 0.6


def test_the_ends_of_a_process_do_not_meet():
    # A periodic process would hide leakage: first and last sample must be as unlike as distant ones.
    v = process_velocities(RADAR)
    psd = np.tile(np.exp(-0.5 * (v / 0.3) ** 2), (400, 1))
    iq = shaped_noise(normals(400), RADAR, psd, v)
    near = np.mean(iq[:, 0] * iq[:, 1].conj()).real
    ends = np.mean(iq[:, 0] * iq[:, -1].conj()).real
    assert near > 0.8
    assert abs(ends) < 0.3


def test_ripples_are_driven_by_gravity_at_long_waves_and_by_tension_at_short_ones():
    assert bragg_mps(1.0) == pytest.approx(np.sqrt(9.81 / (4 * np.pi)), rel=1e-3)
    # the slowest of all ripples, 23 cm/s at 1.7 cm (Lamb, art. 267), is what a radar of 3.4 cm sees
    speeds = [bragg_mps(wavelength_m) for wavelength_m in np.linspace(0.003, 0.3, 3000)]
    assert min(speeds) == pytest.approx(0.231, abs=0.002)
    assert np.linspace(0.003, 0.3, 3000)[int(np.argmin(speeds))] == pytest.approx(0.0342, rel=0.03)
    assert bragg_mps(299792458 / 94e9) == pytest.approx(0.54, abs=0.01)


def test_the_sea_is_its_own_line_those_of_its_ripples_and_at_times_breaking_waves(monkeypatch):
    """Fixed at 1 m/s and narrow, each line stands apart: shares of the power at each are what was drawn."""
    shapes = []
    monkeypatch.setattr(clutter, "shaped_noise", lambda *given: shapes.append(given[2]) or np.zeros(1, np.complex64))
    for name, value in {"sea_velocity_mps": 1.0, "sea_width_mps": 0.02}.items():
        monkeypatch.setitem(LAWS, name, replace(LAWS[name], low=value, high=value))
    count, radar = 2000, Radar(9.85e9, 1e3, 1500)
    draws = Draws(np.random.default_rng(4).random((count, WIDTH)))
    draw_clutter(draws, radar, "sea", normals(1))
    (psd,) = shapes
    v, ripple = process_velocities(radar), bragg_mps(radar.wavelength_m)
    own = psd[:, abs(v - 1) < 0.08].sum(axis=1)
    for sign in (-1, 1):  # of up to 0.3 of the sea's own power, each as much as it likes
        share = psd[:, abs(v - sign * ripple) < ripple].sum(axis=1)
        assert share.max() < 0.305
        assert share.mean() == pytest.approx(0.15, abs=4 * 0.3 / np.sqrt(12 * count))
    # waves break in 35 of 100, as strong as the sea at most, at one to three times its speed
    breaking = psd[:, v > 1.1].sum(axis=1)
    seen = breaking > 0.02
    assert seen.mean() == pytest.approx(0.35 * 0.95 * 0.98, abs=0.05)
    assert breaking.max() < 1.001
    assert breaking[seen].mean() == pytest.approx(0.51, abs=4 * 0.3 / np.sqrt(seen.sum()))
    fastest = v[np.where(psd > 1e-3, v, 0).argmax(axis=1)][seen]
    assert 2.8 < fastest.max() < 3.0 + 4 * 0.04
    assert np.mean(fastest) == pytest.approx(2.15, abs=0.1)
    assert np.all(own > 0.99)
