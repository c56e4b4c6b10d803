"""Rotors that each change in their own way: told apart, with true deviations; steady ones and near ones as before."""

from dataclasses import replace

import bladewing.features.rotor.changing as changing
import bladewing.features.rotor.family as family_module
import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.lines import middle_times
from bladewing.features.rotor.changing_fit import ChangingFit, Start, fit_changing
from bladewing.features.rotor.comb_fit import ridges
from bladewing.features.rotor.periodogram import prepared
from bladewing.features.rotor.slow_lines import band_basis, remove_bands
from bladewing.features.rotor.turning import DEGREES, even_change, polynomials
from bladewing.features.rotor.turning_lines import TurningLines
from bladewing.features.spectrum import doppler_spectrum

from ...benchmarks import records
from ..signals import family_of, moving_at, white

PULSES = records.PULSES
TIME = middle_times(PULSES)


def several(
    seed: int, count: int, change: float, *, snr_db: float, least_hz: float = 0.35, high_hz: float = 58.3
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A record of rotors, their chopping frequencies, and by how much each changes over the dwell."""
    rng = np.random.default_rng(seed)
    rates_hz = records.apart(rng, count, least_hz, 56.5, high_hz)
    changes = rng.uniform(0.3, 1.0, count) * change * rng.choice([-1, 1], count)
    options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-25, 25)}
    return records.record(rng, rates_hz, change=changes, **options), 2 * rates_hz, changes


def helicopter(
    seed: int, gear: float, change: float, *, main: float = 1.0, tail: float = 1.0, tail_m: float
) -> tuple[np.ndarray, float, float]:
    """A record of both rotors, 20 dB at an amplitude of 1, the main one's rate [Hz], and the change of both."""
    rng = np.random.default_rng(seed)
    main_hz, signed = rng.uniform(35, 45), change * rng.choice([-1, 1])
    blades = main * records.rotors(rng, np.array([main_hz]), length_m=0.4, change=signed)
    blades = blades + tail * records.rotors(rng, np.array([gear * main_hz]), length_m=tail_m, change=signed)
    iq = 10 * (blades + 3) * moving_at(6.0)
    return (iq + white(rng, PULSES)).astype(np.complex64), main_hz, signed


def lines_of(body, rotors, orders):
    """Lines of each rotor, one after the other."""
    comb = np.repeat(np.arange(len(rotors)), [len(own) for own in orders])
    return TurningLines(body, rotors, comb, np.concatenate(orders))


@pytest.mark.parametrize("bands", [(), ((0.0, 9.5), (0.07, 3.0))])
def test_lines_that_turn_with_rotors_are_the_closed_form(bands):
    """What they add up to, what they see, and their products without what bands hold."""
    rng = np.random.default_rng(2)
    orders = [np.arange(-70, 71), np.concatenate([np.arange(-12, -2), np.arange(5, 31)])]
    rotors = [(1 / 300, rng.normal(0, 2, len(DEGREES))), (1 / 190, rng.normal(0, 2, len(DEGREES)))]
    body = 0.07 * TIME + 1e-6 * TIME**2
    exact = [
        np.exp(2j * np.pi * (own[:, None] * rate * (TIME + ahead @ polynomials(TIME, PULSES)) + body))
        for own, (rate, ahead) in zip(orders, rotors, strict=True)
    ]
    exact, lines = np.concatenate(exact), lines_of(body, rotors, orders)
    np.testing.assert_allclose(lines.sums(np.eye(len(exact))), exact, atol=3e-5)
    records = white(rng, 3, PULSES)
    np.testing.assert_allclose(lines.means(records), exact.conj() @ records.T / PULSES, atol=1e-6)
    left = remove_bands(exact, bands)
    np.testing.assert_allclose(lines.products(band_basis(PULSES, bands)), left.conj() @ left.T / PULSES, atol=3e-6)


@pytest.mark.parametrize("bands", [(), ((0.05, 4.0),), ((0.0, 9.5), (0.004, 3.0), (-0.2, 4.0))])
def test_bands_are_taken_out_of_many_records_as_out_of_one(bands):
    rows = white(np.random.default_rng(3), 4, PULSES)
    one_by_one = np.stack([remove_bands(row, bands) for row in rows])
    np.testing.assert_allclose(remove_bands(rows, bands), one_by_one, atol=1e-12)


def test_combs_are_fitted_whatever_way_each_changes():
    """Lines of chance that turn with two rotors a tenth of a bin apart at the first order, about a body that pulls."""
    rng = np.random.default_rng(4)
    orders = np.arange(-30, 31)
    rates_hz, centre = np.array([114.0, 115.2]), 0.031
    truth = np.zeros((2, len(DEGREES)))
    truth[:, 1:4] = [[1.7, -0.4, 0.1], [-2.2, 0.3, 0.2]]
    samples, body = 1e-2 * white(rng, PULSES), centre * TIME + 0.15 * polynomials(TIME, PULSES)[1]
    for rate_hz, ahead in zip(rates_hz, truth, strict=True):
        own = white(rng, len(orders))
        samples = samples + lines_of(body, [(rate_hz / records.PRF_HZ, ahead)], [orders]).sums(own[None])[0]
    data, _ = family_of(white(rng, PULSES).astype(np.complex64))
    data = replace(data, samples=samples * 100, strong=replace(data.strong, bands=()))
    starts = [
        Start((rate_hz + 0.05) / records.PRF_HZ, 30, even_change(change, PULSES))
        for rate_hz, change in zip(rates_hz, (0.005, -0.01), strict=True)
    ]
    found = fit_changing(
        data, starts, centre + 1e-6, degrees=len(DEGREES), steps=12, level_about=lambda f: np.ones(np.shape(f))
    )
    fits, rest = found
    for fit, rate_hz, ahead in zip(fits, rates_hz, truth, strict=True):
        assert fit.spacing * records.PRF_HZ == pytest.approx(rate_hz, abs=2e-4)
        np.testing.assert_allclose(fit.ahead, ahead, atol=0.01)
    assert fits[0].centre == pytest.approx(centre, abs=1e-7)
    assert np.mean(np.abs(rest) ** 2) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(("count", "change"), [(2, 0.003), (2, 0.015), (4, 0.003), (4, 0.01)])
def test_rotors_that_each_change_are_told_apart(count, change):
    """Fitted as steady ones none of these was: strong lines show that they are not straight."""
    told = 0
    for seed in range(5):
        iq, chopping_hz, changes = several(seed, count, change, snr_db=20.0)
        found = measure(iq, **records.RADAR)
        if found.rotors_resolved and found.rotor_count == count:
            told += 1
            np.testing.assert_allclose(found.rotor_rates_hz[:count], chopping_hz, rtol=5e-4)
            drifts, stds = found.rotor_drifts_hz_per_s[:count], found.rotor_drifts_hz_per_s_std[:count]
            exact = chopping_hz * changes * records.PRF_HZ / PULSES
            assert np.all(np.abs(drifts - exact) < 6 * stds)
            assert stds.max() < 0.1 * np.abs(exact).max()
            assert np.isnan(found.rotor_drifts_hz_per_s[count:]).all()
            assert found.chopping_drift_hz_per_s == pytest.approx(drifts.mean())
    assert told >= 4


def test_deviations_of_their_rates_and_changes_are_true():
    off, drift_off = [], []
    for seed in range(40):
        iq, chopping_hz, changes = several(seed, 2, 0.01, snr_db=12.0)
        _, family = family_of(iq)
        fits = family.rotors.fits
        if len(fits) == 2 and isinstance(fits[0], ChangingFit):
            off += list((family.rotors.rates * records.PRF_HZ - chopping_hz) / (family.rotors.stds * records.PRF_HZ))
            drifts, stds = family.drifts * PULSES
            drift_off += list((drifts - changes) / stds)
    assert len(off) >= 60
    # the mean square of so many normal errors is off by a root of 2 in so many
    for errors in (off, drift_off):
        assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=4 * np.sqrt(2 / len(errors)))


@pytest.mark.parametrize(("count", "snr_db"), [(2, 0.0), (4, 20.0), (6, 10.0)])
def test_steady_rotors_are_not_taken_to_change(count, snr_db):
    for seed in range(4):
        iq, _, _ = several(seed, count, 0.0, snr_db=snr_db, high_hz=59.4)
        _, family = family_of(iq)
        assert len(family.rotors.rates) == count
        assert not any(isinstance(fit, ChangingFit) for fit in family.rotors.fits)
        drifts, stds = family.drifts
        assert drifts.shape == (count,)
        assert np.all(np.abs(drifts) < 5 * stds)


def test_rotors_told_apart_as_steady_ones_are_fitted_anew_where_they_change():
    """At 5 dB a change of 0.5 % leaves them apart, and the rates off by several of their deviations."""
    plain, anew = [], 0
    for seed in range(8):
        iq, chopping_hz, _ = several(seed, 3, 0.006, snr_db=5.0, least_hz=0.5)
        _, family = family_of(iq)
        if family.rotors.resolved and len(family.rotors.rates) == 3:
            plain += list((family.rotors.rates * records.PRF_HZ - chopping_hz) / (family.rotors.stds * records.PRF_HZ))
            anew += isinstance(family.rotors.fits[0], ChangingFit)
    assert anew >= 5
    assert np.mean(np.square(plain)) < 2.5


@pytest.mark.parametrize(("snr_db", "apart"), [(10.0, 0.001), (20.0, 0.0)])
def test_rotors_that_change_alike_have_true_deviations_as_well(snr_db, apart):
    """Resampled alike they were several steady ones, off by several deviations where not quite alike."""
    off = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        rates_hz = rng.uniform(48, 58) + np.array([0.0, 0.5])
        change = 0.01 * rng.choice([-1, 1]) + np.array([0.0, apart])
        options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-20, 20)}
        found = measure(records.record(rng, rates_hz, change=change, **options), **records.RADAR)
        if found.rotors_resolved and found.rotor_count == 2:
            off += list((found.rotor_rates_hz[:2] - 2 * rates_hz) / found.rotor_rates_hz_std[:2])
    assert len(off) >= 20
    assert np.mean(np.square(off)) == pytest.approx(1.0, abs=4 * np.sqrt(2 / len(off)))


def test_main_and_tail_rotor_that_change_with_one_gear_have_true_deviations():
    """Fitted without the tail's lines, the main rotor's rate was off by 4 to 70 deviations, its drift by 3."""
    off = []
    for seed in range(8):
        iq, main_hz, change = helicopter(500 + seed, 4.73, 0.01, tail=0.7, tail_m=0.08)
        found = measure(iq, **records.RADAR)
        drift_hz_per_s = 2 * main_hz * change * records.PRF_HZ / PULSES
        off.append(
            [
                (found.main_chopping_hz - 2 * main_hz) / found.main_chopping_hz_std,
                (found.tail_chopping_hz - 2 * 4.73 * main_hz) / found.tail_chopping_hz_std,
                (found.chopping_drift_hz_per_s - drift_hz_per_s) / found.chopping_drift_hz_per_s_std,
            ]
        )
    told = np.array(off)[np.isfinite(off).all(axis=1)]
    assert len(told) >= 7
    assert np.abs(told).max() < 5
    assert np.median(np.abs(told), axis=0).max() < 1.5


def test_a_helicopter_whose_tail_is_louder_is_one_as_it_changes():
    """The change is told from the tail's comb; the main rotor's is then the slower one."""
    found = []
    for seed in range(6):
        iq, _, _ = helicopter(600 + seed, 4.37, 0.03, main=0.6, tail_m=0.09)
        found.append(measure(iq, **records.RADAR).gear_ratio)
    assert np.sum(np.abs(np.array(found) / 4.37 - 1) < 0.01) >= 5


@pytest.mark.parametrize("seed", [4, 5])
def test_backwards_a_change_is_as_sure(seed):
    """The noise that a deviation is stated at was what the step before the last one left."""
    rng = np.random.default_rng(seed)
    rates_hz = rng.uniform(45, 60, 1) + 0.35 * rng.uniform(-0.2, 0.2, 1)
    iq = records.record(rng, rates_hz, snr_db=15, change=-0.03, body_db=10, velocity_mps=rng.uniform(-20, 20))
    found, back = measure(np.stack([iq, iq[::-1]]), **records.RADAR).chopping_hz_std
    assert back == pytest.approx(found, rel=0.1)


def test_a_rate_stays_that_of_the_comb_found_where_the_change_was_told_from_every_second_line():
    rng = np.random.default_rng(700)
    rate_hz = rng.uniform(35, 60)
    options = {"snr_db": 15.0, "body_db": 10, "velocity_mps": 5.0, "amplitudes": (1.0, 0.2), "change": -0.015}
    found = measure(records.record(rng, np.array([rate_hz]), **options), **records.RADAR)
    assert found.chopping_hz == pytest.approx(rate_hz, rel=1e-3)
    assert found.comb_order * found.chopping_hz < found.bandwidth_hz


def test_where_one_side_lies_in_the_other_no_changing_rotors_are_told_apart(monkeypatch):
    iq, _, _ = several(3, 2, 0.01, snr_db=20.0)
    spectrum = np.fft.fft(iq)
    spectrum[PULSES // 2 :] = 0
    monkeypatch.setattr(family_module, "separate_rotors", None)  # would be called
    assert not measure(np.fft.ifft(spectrum).astype(np.complex64), **records.RADAR).rotors_resolved


def test_without_a_notch_nothing_is_said_on_the_way(capfd):
    rng = np.random.default_rng(5)
    iq = 30.0 * (np.arange(PULSES) % 300 == 0) + white(rng, PULSES)
    measure(iq.astype(np.complex64), **records.RADAR)
    data = prepared(iq.astype(np.complex64), doppler_spectrum(iq, **records.RADAR))
    data = replace(data, strong=replace(data.strong, bands=()))
    starts = [Start(1 / 300, 30, even_change(0.001, PULSES))]
    fit_changing(data, starts, 0.0, degrees=2, steps=2, level_about=lambda f: np.ones(np.shape(f)))
    assert capfd.readouterr() == ("", "")


def test_rotors_nearer_than_the_dwell_tells_apart_are_not_told_apart_if_they_change():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rates_hz = rng.uniform(56, 58) + np.array([0.0, 0.06])
        iq = records.record(rng, rates_hz, snr_db=20, body_db=20, velocity_mps=3.0, change=[0.004, -0.002])
        found = measure(iq, **records.RADAR)
        assert not (found.rotors_resolved and found.rotor_count > 1)


def test_too_many_lines_are_not_fitted(monkeypatch):
    iq, _, _ = several(1, 2, 0.01, snr_db=20.0)
    assert measure(iq, **records.RADAR).rotors_resolved
    monkeypatch.setattr(changing, "most_lines", lambda pulses: 60)
    assert not measure(iq, **records.RADAR).rotors_resolved


def test_strong_lines_that_lie_in_one_another_are_not_large_ones_that_cancel():
    """Let go, those of the inner orders came out ten times too large and more: the flashes of further rotors."""
    largest = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rates_hz = records.apart(rng, 4, 0.5, 56.5, 58.4)
        iq = records.record(rng, rates_hz, snr_db=20, body_db=20, velocity_mps=5.0)
        data, family = family_of(iq)
        starts = [Start(2 * rate_hz / records.PRF_HZ, 33, np.zeros(len(DEGREES))) for rate_hz in rates_hz]
        fits, _ = fit_changing(
            data,
            starts,
            family.rotors.fits[0].centre,
            degrees=2,
            steps=10,
            level_about=data.level_of(family.rotors.rest),
        )
        largest += [np.abs(fit.amplitudes).max() / np.median(np.abs(fit.amplitudes)) for fit in fits]
    assert np.max(largest) < 5


def test_lines_that_lie_in_one_another_are_held_back_however_strong():
    snr, together = np.array([1.0, 1e4, 1e4, 1e4]), np.array([1, 1, 2, 1])
    alone, strong, shared, taken_out = ridges(snr, together, np.array([True, True, True, False]))
    assert alone == pytest.approx(1.0, rel=0.01)
    assert strong < 2e-6
    assert shared == pytest.approx(1e-4, rel=0.02)
    assert taken_out == pytest.approx(1e-4, rel=0.02)


def test_steady_rotors_near_the_noise_are_seldom_sought_among_changes(monkeypatch):
    # they are not told apart, and most leave nothing that a change of their rates would explain; to seek it is dear
    class SoughtError(Exception):
        pass

    def sought(*_):
        raise SoughtError

    monkeypatch.setattr(family_module, "ChangingSeparation", sought)

    def is_sought(seed, change, snr_db):
        try:
            family_of(several(seed, 4, change, snr_db=snr_db)[0])
        except SoughtError:
            return True
        return False

    assert sum(is_sought(seed, 0.0, -8) for seed in range(16)) <= 6
    assert all(is_sought(seed, 0.02, 10) for seed in range(4))
