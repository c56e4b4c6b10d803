"""One channel made analytic: its empty side tells nothing, however it became empty."""

import numpy as np
import pytest
from bladewing.features import INPUT_SHAPES, doppler_spectrum, model_inputs
from bladewing.features.empty_side import empty_sides, filled_sides, side_noise
from bladewing.features.one_channel import made_analytic
from bladewing.features.window import HANN
from scipy.signal import hilbert

from .signals import PULSES, RADAR, rotors, tone, white

ALL = tuple(INPUT_SHAPES)


def hann_spectrum(iq: np.ndarray):
    return doppler_spectrum(iq.astype(np.complex64), **RADAR, window=HANN)


def filled(iq: np.ndarray) -> np.ndarray:
    iq = iq[None].astype(np.complex64)
    rows, some = filled_sides(iq, hann_spectrum(iq))
    return some[0] if len(rows) else iq[0]


def channel(seed: int, pulses: int = PULSES, strength: float = 100.0) -> np.ndarray:
    """What a CW module's mixer gives: a strong line near zero, one of a mover, noise of unit power."""
    times = np.arange(pulses)
    lines = strength * np.cos(2 * np.pi * 0.0031 * times + 1) + 3 * np.cos(2 * np.pi * 0.11 * times)
    return lines + white(np.random.default_rng(seed), pulses).real * np.sqrt(2)


@pytest.mark.parametrize("pulses", [64, 1000, 4097])
def test_the_noise_is_white_on_one_side_and_nothing_on_the_other(pulses):
    both = side_noise(pulses)
    lower, upper = np.abs(np.fft.fftshift(np.fft.fft(both), axes=-1)) ** 2 / pulses
    assert both.dtype == np.complex64
    np.testing.assert_array_equal(both[0], both[1].conj())
    above = np.fft.fftshift(np.fft.fftfreq(pulses)) > 0
    assert upper[~above].max() < 1e-9
    assert abs(upper[above].mean() - 1) < 4 / np.sqrt(above.sum())  # exponentials of mean 1
    assert lower[above].max() < 1e-9
    assert not both.flags.writeable


@pytest.mark.parametrize("seed", range(4))
def test_records_of_two_channels_are_left_as_they_are(seed):
    noise = white(np.random.default_rng(seed), PULSES)
    for iq in (noise, 100 * tone(3000.0) + noise, 100 * rotors([58.6, 60.1], velocity_mps=-20.0) + noise):
        iq = iq[None].astype(np.complex64)
        assert not len(filled_sides(iq, hann_spectrum(iq))[0])


def test_lines_without_noise_have_no_empty_side():
    for iq in (tone(3000.0), tone(3000.0) + 0.1 * tone(5000.0), np.zeros(PULSES, complex)):
        np.testing.assert_array_equal(filled(iq), iq.astype(np.complex64))


@pytest.mark.parametrize("conjugate", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_an_empty_side_gets_the_noise_of_the_other_and_that_one_stays(seed, conjugate):
    iq = hilbert(channel(seed))
    iq = iq.conj() if conjugate else iq
    before, after = hann_spectrum(iq), hann_spectrum(filled(iq))
    empty = empty_sides(before)
    np.testing.assert_array_equal(empty, [not conjugate, conjugate])
    one, other = after.side_floors
    assert 0.7 < one / other < 1.4  # of 64 blocks' quartiles each
    kept = slice(1900, 2900) if not conjugate else slice(100, 1100)
    np.testing.assert_allclose(
        (after.relative_power * after.floor)[kept], (before.relative_power * before.floor)[kept], rtol=1e-3, atol=1e-4
    )


def test_an_empty_side_is_filled_in_every_input_that_shows_levels():
    iq = hilbert(white(np.random.default_rng(3), 3, PULSES).real)
    made = model_inputs(iq, **RADAR, names=("spectrum", "image"))
    inputs = {
        "levels": made["spectrum"][:, 0],
        "parts of the dwell": made["spectrum"][:, 3:],  # not below the floor, where half of the noise is
        "frames": made["image"][:, 0].swapaxes(-1, -2),
    }
    for name, levels_db in inputs.items():
        middle, width = levels_db.shape[-1] // 2, levels_db.shape[-1] // 8
        # past the notch about rest and within the unambiguous velocities
        one, other = levels_db[..., middle - 2 * width : middle - width], levels_db[..., middle + width :][..., :width]
        assert one.mean() == pytest.approx(other.mean(), abs=1), name
        assert min(one.std(), other.std()) > 0.3, name


def test_how_the_other_side_was_taken_away_hardly_matters():
    """Of each dwell alone, or of a recording that was then cut, whose strong lines leak to the other side."""
    inner = slice(PULSES, 2 * PULSES)
    for seed in range(4):
        whole = channel(seed, 3 * PULSES, strength=1000.0)
        alone, cut = hilbert(whole[inner]), hilbert(whole)[inner]
        one, other = (hann_spectrum(filled(iq)).level_db for iq in (alone, cut))
        side = slice(PULSES // 2 - 60, PULSES // 2 - 20)
        assert np.abs(one - other)[side].mean() < 1.5


@pytest.mark.parametrize("gain", [2.0**-100, 2.0**-30, 2.0**100])
def test_the_gain_changes_no_digit(gain):
    iq = hilbert(channel(0)).astype(np.complex64)
    one, other = (model_inputs(record, **RADAR, names=ALL) for record in (iq, iq * np.float32(gain)))
    for name in ALL:
        np.testing.assert_array_equal(one[name], other[name])


def test_a_record_is_read_the_same_among_others():
    noise = white(np.random.default_rng(2), PULSES)
    some = [hilbert(channel(0)), hilbert(channel(1)).conj(), noise, channel(2), 1j * channel(3)]
    batch = np.stack(some).astype(np.complex64)
    together = model_inputs(batch, **RADAR, names=ALL)
    for number, iq in enumerate(batch):
        alone = model_inputs(iq, **RADAR, names=ALL)
        for name in ALL:
            np.testing.assert_array_equal(together[name][number], alone[name])


def test_a_mirrored_record_is_a_mirror_image():
    iq = hilbert(channel(3)).astype(np.complex64)
    one, other = (model_inputs(record, **RADAR, names=("levels", "cadence")) for record in (iq, iq.conj()))
    np.testing.assert_allclose(one["levels"], other["levels"][..., ::-1], atol=0.02)
    np.testing.assert_allclose(one["cadence"], other["cadence"], atol=0.02)


@pytest.mark.parametrize("of", [np.real, np.imag])
def test_one_channel_is_read_as_if_made_analytic(of):
    """As it came, both sides alike, a mover was a pair of lines and noise a comb: ten times as many false UAVs."""
    noisy = white(np.random.default_rng(5), PULSES) + 3 * tone(3000.0)
    one = of(noisy).astype(np.complex64)
    apart = [model_inputs(iq, **RADAR, names=("levels",))["levels"][0] for iq in (one, hilbert(of(noisy)))]
    assert np.abs(apart[0] - apart[1]).mean() < 0.1  # the transform of the one goes round, not of the other


@pytest.mark.parametrize("both", [1 + 1j, 1 - 1j, -1 + 1j])
def test_one_channel_in_both_parts_is_read_as_that_channel_whichever_sign_they_have(both):
    iq = (white(np.random.default_rng(7), PULSES) + 3 * tone(3000.0)).real.astype(np.complex64)
    wanted = made_analytic(iq)
    assert wanted.imag.any()
    np.testing.assert_array_equal(made_analytic(iq * np.complex64(both)), both.real * wanted)


def test_what_is_silent_of_one_channel_stays_so():
    """The tails of what was beside it stood there, and nothing found the silence any more."""
    channel = white(np.random.default_rng(9), 2 * PULSES).real.astype(np.complex64).reshape(2, PULSES)
    channel[0, 500:600] = channel[1, :100] = 0
    made = made_analytic(channel)
    for given, found in zip(channel, made, strict=True):
        np.testing.assert_array_equal(found == 0, given == 0)
        np.testing.assert_array_equal(made_analytic(given), found)


def test_one_channel_at_the_ends_of_float32_is_made_analytic_without_infinities():
    """What is a quarter of a turn behind a jump stands higher than the jump."""
    jumps = 3.4e38 * np.sign(white(np.random.default_rng(8), 4000).real).repeat(5)
    assert np.isfinite(made_analytic(jumps.astype(np.complex64))).all()


def test_a_line_without_noise_is_no_channel_of_two():
    for iq in (rotors([58.6]).real, np.ones(PULSES)):
        levels = model_inputs(iq.astype(np.complex64), **RADAR, names=("levels",))["levels"]
        np.testing.assert_allclose(levels, levels[..., ::-1], atol=1.0)


def test_what_fills_a_side_stays_within_float32():
    rows = np.stack([white(np.random.default_rng(seed), PULSES).real for seed in range(4)])
    for top in (1e38, 3.3e38):
        iq = (rows / np.abs(rows).max() * top).astype(np.complex64)
        assert all(np.isfinite(values).all() for values in model_inputs(iq, **RADAR, names=ALL).values())
