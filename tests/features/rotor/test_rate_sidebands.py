"""Rates that wander faster than any fit follows: their sidebands are told from lines of unlike blades."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.lines import LinesSeen, energy
from bladewing.features.rotor.comb_fit import CombFit
from bladewing.features.rotor.periodogram import prepare
from bladewing.features.rotor.rate_sidebands import Between, wanders
from bladewing.simulate import rotor_echo
from scipy.signal import lfilter

from ..signals import PRF_HZ, PULSES, RADAR, WAVELENGTH_M, moving_at, white

TIME_S = (np.arange(PULSES) - (PULSES - 1) / 2) / PRF_HZ
SPACING, ORDERS = 20.3 / PULSES, np.arange(-18, 19)


def comb_of(rng):
    """A comb of random amplitudes, its lines over time, and their derivatives by the rotor's angle."""
    amplitudes = (rng.standard_normal(len(ORDERS)) + 1j * rng.standard_normal(len(ORDERS))) * (ORDERS != 0)
    fit = CombFit(SPACING, 0.0, 1e-9, 1e-9, ORDERS, amplitudes, np.full(len(ORDERS), 1e3))
    waves = np.exp(2j * np.pi * SPACING * np.outer(ORDERS, TIME_S * PRF_HZ))
    return fit, amplitudes @ waves, (1j * ORDERS * amplitudes) @ waves


def read(fit, left, place):
    return Between.of(prepare(left, **RADAR), fit, LinesSeen(left[None]), lambda f: np.ones(len(f)), place)


@pytest.mark.parametrize("away", [2.5, 5.0, 20.3 / 2])
def test_small_turns_are_explained_to_their_square(away):
    rng = np.random.default_rng(int(away))
    fit, _, by_angle = comb_of(rng)
    angle = np.cos(2 * np.pi * away / PULSES * TIME_S * PRF_HZ + rng.uniform(0, 2 * np.pi))
    noise = white(rng, PULSES).astype(np.complex64)  # so that no place is taken for a strong line's
    place = np.concatenate([fit.orders - away / 20.3, fit.orders + away / 20.3])
    between = read(fit, noise, place)
    # the angle's own spectrum leaks: what remains is of other lines' sidebands, a side lobe of the window
    seen = LinesSeen((1e-3 * angle * by_angle)[None]).means(fit.centre + fit.spacing * between.place)[0]
    told = Between(fit, between.place, seen, np.ones(len(seen)))
    assert energy(seen - told.sidebands()) < 0.02 * energy(seen)


def test_of_noise_they_explain_two_of_all_degrees_of_freedom():
    rng = np.random.default_rng(3)
    fit, *_ = comb_of(rng)
    place = np.concatenate([fit.orders - 0.25, fit.orders + 0.25])
    held = [energy(read(fit, white(rng, PULSES).astype(np.complex64), place).sidebands()) for _ in range(200)]
    assert np.mean(held) == pytest.approx(1, abs=4 / np.sqrt(200))  # exponentially distributed
    assert np.std(held) == pytest.approx(1, abs=4 * np.sqrt(8 / 200))


def test_a_rate_wanders_where_it_does_and_not_where_it_is_steady():
    rng = np.random.default_rng(6)
    fit, steady, by_angle = comb_of(rng)
    level, noise = lambda frequency: np.ones(len(frequency)), white(rng, PULSES)
    unlike = sum(np.exp(2j * np.pi * (SPACING * n * TIME_S * PRF_HZ + rng.uniform())) for n in ORDERS + 0.5)
    angle = 0.02 * np.cos(2 * np.pi * 3 / PULSES * TIME_S * PRF_HZ + 1)
    for left, told in ((noise, False), (noise + unlike, False), (noise + angle * by_angle, True)):
        data = prepare((steady + left).astype(np.complex64), **RADAR)
        assert wanders(data, fit, LinesSeen(left[None]), level) == told


def test_lines_of_unlike_blades_are_not_explained():
    rng = np.random.default_rng(4)
    fit, *_ = comb_of(rng)
    place = np.concatenate([fit.orders - 1 / 3, fit.orders + 1 / 3])
    weak = rng.standard_normal(len(place)) + 1j * rng.standard_normal(len(place))
    between = Between(fit, place, weak, np.ones(len(place)))
    assert between.powers_without_sidebands.sum() > 0.85 * between.powers.sum()


def at_rates(rng, offset, rate_hz):
    """A two-blade rotor whose rate is off its mean by these shares, about a body of 6 dB."""
    angle_rad = 2 * np.pi * rate_hz * np.cumsum(1 + offset) / PRF_HZ + rng.uniform(0, 2 * np.pi)
    echo = rotor_echo(angle_rad, wavelength_m=WAVELENGTH_M, blade_length_m=0.15)
    echo = (echo / np.sqrt(np.mean(np.abs(echo) ** 2)) + 2) * moving_at(rng.uniform(-20, 20))
    return (echo + 0.1 * white(rng, PULSES)).astype(np.complex64)


def wandering(rng, wander):
    """Shares of a rate that wanders by so much, rms, with a correlation of 50 ms."""
    step = 1 / (0.05 * PRF_HZ)
    start = [wander * rng.standard_normal()]
    kicks = rng.standard_normal(PULSES) * wander * np.sqrt(2 * step)
    return lfilter([1], [1, step - 1], kicks, zi=start)[0]


def swinging(rng, swing):
    """Shares of a rate that swings by so much, rms, at three frequencies about one cycle a dwell."""
    return sum(
        swing / np.sqrt(1.5) * np.cos(2 * np.pi * (rng.uniform(8, 14) * TIME_S + rng.uniform())) for _ in range(3)
    )


@pytest.mark.parametrize("wander", [0.002, 0.004])
def test_a_rate_that_wanders_shows_no_blades_that_are_not_there(wander):
    """Once 15 of 17 rotation rates told were a third to a half of the true one."""
    wrong = combs = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        rate_hz = rng.uniform(60, 110)
        found = measure(at_rates(rng, wandering(rng, wander), rate_hz), **RADAR)
        combs += bool(np.isfinite(found.chopping_hz))
        wrong += bool(abs(found.rotation_hz / rate_hz - 1) > 0.02)
    assert combs >= 9
    assert wrong == 0


def test_nor_is_its_change_a_gain():
    """Out of step for a part of the dwell, lines of a steady comb are weak there: dividing that out made more lines."""
    wrong = []
    for seed in range(12, 20):
        rng = np.random.default_rng(seed)
        rate_hz = rng.uniform(60, 110)
        found = measure(at_rates(rng, swinging(rng, 0.003), rate_hz), **RADAR)
        wrong += [seed] * bool(abs(found.rotation_hz / rate_hz - 1) > 0.02)
    assert not wrong
