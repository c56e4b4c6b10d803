import numpy as np
import pytest
from bladewing.simulate import Radar, draw_records
from bladewing.simulate.bird import MAX_WINGBEAT_HZ, draw_bird, stroke_angles_rad, wing_echo, wing_size, wingbeat_hz
from bladewing.simulate.laws import WIDTH, Draws


@pytest.mark.parametrize(
    # Birds of known size (mass kg, span m, wing area m^2) and the wingbeat their flight shows [Hz].
    ("mass_kg", "span_m", "area_m2", "expected_hz"),
    [(9.9, 2.3, 0.65, 3.3), (0.26, 0.68, 0.063, 6.2), (0.08, 0.38, 0.0194, 9.9), (0.0055, 0.152, 0.0051, 14.0)],
)
def test_pennycuick_gives_known_wingbeats(mass_kg, span_m, area_m2, expected_hz):
    assert wingbeat_hz(mass_kg, span_m, area_m2) == pytest.approx(expected_hz, rel=0.2)


def test_wingbeat_falls_with_size():
    mass = np.geomspace(0.008, 10, 50)
    assert (np.diff(wingbeat_hz(mass, *wing_size(mass))) < 0).all()


def test_every_drawn_bird_beats_below_18_hz():
    truth = draw_records(Radar(9.85e9, 5e3, 64), 300, seed=3, kind="flock").truth
    # each member of a flock, a lone bird as well, beats within 5 % of the bird that was drawn
    assert truth["wingbeat_hz"].max() <= 1.05 * MAX_WINGBEAT_HZ
    assert truth["members"].min() >= 2


SIGHT = np.array([0.6, 0.48, -0.64])


def test_wing_echo_equals_a_dense_row_of_scatterers():
    cycle = np.linspace(0, 2 * np.pi, 61)
    wavelength_m, half_span_m = 0.03, 0.4
    closed = wing_echo(
        cycle, wavelength_m=wavelength_m, half_span_m=half_span_m, sight=SIGHT, feather_weight=0.0, down_stroke=0.0
    )
    inner, outer, sweep = stroke_angles_rad(cycle)
    shares = (np.arange(4000) + 0.5) / 4000
    brute = np.zeros(len(cycle), complex)
    for side in (1, -1):
        first = np.stack([0 * inner, side * np.cos(inner), np.sin(inner)], -1)
        second = np.stack([-np.sin(sweep), side * np.cos(sweep) * np.cos(outer), np.cos(sweep) * np.sin(outer)], -1)
        towards_inner = half_span_m / 2 * (first @ SIGHT)[:, None] * shares
        towards_outer = half_span_m / 2 * ((first @ SIGHT)[:, None] + (second @ SIGHT)[:, None] * shares)
        for towards in (towards_inner, towards_outer):
            brute += np.exp(4j * np.pi / wavelength_m * towards).mean(axis=1)
    np.testing.assert_allclose(closed, brute, atol=2e-4)


def test_wings_repeat_at_the_wingbeat_and_stand_still_in_a_glide():
    period = 200
    cycle = 2 * np.pi * np.arange(3 * period) / period
    kwargs = {"wavelength_m": 0.03, "half_span_m": 0.5, "sight": SIGHT, "down_stroke": 0.5}
    flapping = wing_echo(cycle, **kwargs)
    np.testing.assert_allclose(flapping[:period], flapping[period : 2 * period], atol=2e-3)
    assert np.ptp(abs(flapping)) > 0.1
    glide = wing_echo(cycle, **(kwargs | {"stroke_scale": 0.0}))
    np.testing.assert_allclose(glide, glide[0], atol=1e-6)


def test_wing_tip_doppler_is_far_above_the_wingbeat():
    # A wingbeat of 6 Hz sweeps the tip of a half-metre wing at several metres a second: hundreds of Hz at X band.
    prf_hz, beat_hz = 4e3, 6.0
    cycle = 2 * np.pi * beat_hz * np.arange(4000) / prf_hz
    iq = wing_echo(cycle, wavelength_m=0.0304, half_span_m=0.5, sight=np.array([0.0, 0.0, -1.0]), feather_weight=1.0)
    power = abs(np.fft.fft(iq * np.kaiser(4000, 12))) ** 2
    frequency_hz = abs(np.fft.fftfreq(4000, 1 / prf_hz))
    significant = frequency_hz[power > 1e-3 * power.max()].max()
    assert 315 < significant < 1230


def test_wings_are_swept_back_and_least_so_in_the_down_stroke():
    *_, sweep = stroke_angles_rad(np.linspace(0, 2 * np.pi, 100))
    assert (sweep > 0).all()
    assert sweep[:50].mean() < sweep[50:].mean()  # highest at 0: the first half goes down
    ahead = np.array([1.0, 0.0, 0.0])
    kwargs = {"wavelength_m": 1.0, "half_span_m": 0.1, "sight": ahead, "stroke_scale": 0.0, "feather_weight": 0.0}
    still = np.zeros(1)
    # of wings swept back the radar ahead sees the further parts later: their phase lags that of straight ones
    assert np.angle(wing_echo(still, **kwargs)) < np.angle(wing_echo(still, **kwargs, sweep_scale=0.0))
    assert np.angle(wing_echo(still, **kwargs, sweep_scale=-1.0)) > np.angle(wing_echo(still, **kwargs))


def gliders(count):
    """Gliding birds as training draws them, 0.5 s at 4 kHz."""
    return draw_bird(Draws(np.random.default_rng(4).random((count, WIDTH))), Radar(9.85e9, 4e3, 2000), "gliding_bird")


def test_a_glider_that_holds_its_wings_still_shows_no_wingbeat():
    birds = gliders(400)
    still = np.ptp(np.abs(birds.micro), axis=1) < 0.02 * np.abs(birds.micro).mean(axis=1)
    assert 0.1 < still.mean() < 0.5  # of the 40 % that glide all along some still move a little
    # nor does its body heave: the phase is that of a straight path
    phase = np.unwrap(np.angle(birds.body[still].astype(complex)), axis=1)
    times = np.arange(phase.shape[1])
    left = phase - np.polynomial.polynomial.polyval(times, np.polynomial.polynomial.polyfit(times, phase.T, 2))
    assert np.median(np.ptp(left, axis=1)) < 0.05


def test_gliders_begin_to_flap_as_often_as_they_end():
    level = np.abs(gliders(600).micro)
    first, last = (np.ptp(part, axis=1) / level.mean(axis=1) for part in (level[:, :400], level[:, -400:]))
    turning = np.maximum(first, last) > 0.3
    begins, ends = (turning & (one < 0.01) for one in (first, last))
    assert begins.sum() > 10
    assert ends.sum() > 10
    assert 0.4 < begins.sum() / ends.sum() < 2.5


def test_a_flying_bird_rises_and_sinks_at_its_wingbeat_as_its_elevation_shows_it():
    """Up to 2 % of its span, of which the sine of the elevation, -10 to 50 degrees, lies along the line of sight."""
    radar, records = Radar(9.85e9, 5e3, 5000), 200
    target = draw_bird(Draws(np.random.default_rng(6).random((records, WIDTH))), radar, "flapping_bird")
    path = -np.unwrap(np.angle(target.body.astype(complex)), axis=-1) * radar.wavelength_m / (4 * np.pi)
    times = radar.times_s[None, :]
    turns = 2 * np.pi * target.truth["wingbeat_hz"][:, None] * times
    ratio = []
    for own, turn, span in zip(path, turns, target.truth["span_m"], strict=True):
        laws = np.stack([np.ones(radar.pulses), times[0], times[0] ** 2, np.cos(turn), np.sin(turn)], axis=1)
        found, *_ = np.linalg.lstsq(laws, own, rcond=None)
        np.testing.assert_allclose(laws @ found, own, atol=1e-5)
        ratio.append(np.hypot(*found[3:]) / (0.02 * span))
    assert max(ratio) < np.sin(np.deg2rad(50)) + 1e-3
    mean = ((1 - np.cos(np.deg2rad(50))) + (1 - np.cos(np.deg2rad(10)))) / np.deg2rad(60) / 2
    assert np.mean(ratio) == pytest.approx(mean, abs=4 * np.std(ratio) / np.sqrt(records))
