"""The comb levels: noise is even, a comb stands at its spacing, weak rotors show before the cepstrum sees them."""

import numpy as np
import pytest
from bladewing.features import doppler_spectrum, model_inputs
from bladewing.features.axis import UNSEEN_DB
from bladewing.features.comb_levels import (
    ENDS,
    HEIGHT_DEVIATION,
    MEAN_HEIGHT,
    REACH_MPS,
    WEAK_SNR,
    _covariance_series,
    broad_power,
    comb_edges_hz,
    comb_levels_db,
    comb_plan,
    line_nats,
)
from bladewing.features.evidence import LINE_CAP, MISSING_SHARE
from bladewing.features.notch import notch_mask, strongest_bin
from bladewing.features.schema import COMB_BINS, FEATURES
from bladewing.features.spectrum import centred_power
from bladewing.features.window import BROAD_HANN, HANN
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, special

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, cell_of, rotors, tone, white

EDGES_HZ = comb_edges_hz()


def combs(iq, **radar):
    return model_inputs(iq, **(RADAR | radar), names=("combs",))["combs"][..., 0, :]


def plan_of(pulses, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ):
    bins = doppler_spectrum(np.zeros(pulses, np.complex64), carrier_hz=carrier_hz, prf_hz=prf_hz).bins
    return comb_plan(bins, pulses, carrier_hz, prf_hz)


def test_evidence_is_the_likelihood_ratio_of_a_line_that_may_be_missing():
    power = np.array([0.0, 0.5, 1.0, 3.0, 8.0])
    line = np.exp(-power / (1 + WEAK_SNR)) / (1 + WEAK_SNR)
    noise = np.exp(-power)
    wanted = np.log(((1 - MISSING_SHARE) * line + MISSING_SHARE * noise) / noise)
    np.testing.assert_allclose(line_nats(power.copy()), wanted, rtol=1e-12)
    assert line_nats(np.array([1e9])) == LINE_CAP


def test_the_series_holds_the_variance_of_the_evidence_and_its_covariance_for_likeness():
    """Of two exponentials that correlate by r (Kibble's law), by brute force on their joint density."""
    series = _covariance_series()
    mean, square = (
        integrate.quad(lambda x, k=k: float(line_nats(np.array([x]))[0]) ** k * np.exp(-x), 0, 60, limit=400)[0]
        for k in (1, 2)
    )
    assert series.sum() == pytest.approx(square - mean**2, rel=0.02)
    likeness = 0.4
    x, w = np.polynomial.legendre.leggauss(400)
    x, w = 15 * (x + 1), 15 * w
    one, other = np.meshgrid(x, x)
    away = 2 * np.sqrt(likeness * one * other) / (1 - likeness)
    joint = np.exp(away - (one + other) / (1 - likeness)) * special.ive(0, away) / (1 - likeness)
    nats = line_nats(x.copy())
    found = nats @ (w[:, None] * w * joint) @ nats - mean**2
    assert found == pytest.approx(np.sum(series * likeness ** np.arange(1, len(series) + 1)), rel=0.02)


@pytest.mark.parametrize("pulses", [1200, 2048, PULSES])
def test_noise_is_alike_at_all_spacings_that_lie_apart(pulses):
    """Of one peak alone: a level is above what a Rayleigh magnitude gives as often as that says."""
    records = 400
    plan = plan_of(pulses)
    iq = white(np.random.default_rng(0), records, pulses)
    nats = line_nats(centred_power(iq.astype(np.complex64), window=BROAD_HANN)[:, plan.band])
    heights = np.abs(np.fft.rfft(nats - nats.mean(), plan.length)) * plan.per_noise / np.sqrt(nats.shape[1])
    apart = heights[:, plan.lags[0, 0] :: 3]
    assert np.mean(apart) == pytest.approx(MEAN_HEIGHT, rel=0.03)
    assert np.std(apart) == pytest.approx(HEIGHT_DEVIATION, rel=0.05)
    each = np.abs(apart.mean(axis=0) - MEAN_HEIGHT)
    assert np.mean(each < 4 * HEIGHT_DEVIATION / np.sqrt(records)) > 0.97


@pytest.mark.parametrize("pulses", [16, 64, 700, 1023, 2047, 2048])
def test_bins_with_those_beside_them_are_the_spectrum_through_the_broad_window(pulses):
    """To a thousandth of the noise; where zeros make a dwell one that transforms fast, to a percent of it."""
    iq = white(np.random.default_rng(8), 50, pulses).astype(np.complex64)
    spectrum = doppler_spectrum(iq, **RADAR, window=HANN)
    for band in (slice(None, None), slice(1, spectrum.bins - 1), slice(5, spectrum.bins // 2)):
        whole = slice(*band.indices(spectrum.bins)[:2])
        wanted = centred_power(iq, window=BROAD_HANN)[:, whole] / spectrum.transform_floor[:, None]
        found = broad_power(spectrum, whole)
        away = np.sqrt(np.mean((found - wanted) ** 2) / np.mean(wanted**2))
        assert away < (2.5 + 4 * (spectrum.bins - pulses)) / pulses


@pytest.mark.parametrize("rate_hz", [47.0, 58.6, 91.0])
def test_a_comb_stands_at_its_spacing(rate_hz):
    iq = rotors([rate_hz], velocity_mps=-7.0) * 0.5 + white(np.random.default_rng(1), PULSES)
    found, cell = combs(iq), cell_of(2 * rate_hz, EDGES_HZ)
    at_spacing = found[cell - 1 : cell + 2].max()
    # multiples of its period are periods as well: lower rates are as loud, higher ones are not
    assert at_spacing > max(12, found.max() - 1.5)
    assert found[cell + 3 :].max() < at_spacing - 1


def test_rotors_stand_out_where_the_cepstral_peak_does_not():
    strength = [feature.name for feature in FEATURES].index("chopping_strength")

    def told(iq):
        inputs = model_inputs(iq, **RADAR, names=("features", "combs"))
        return inputs["features"][:, strength], inputs["combs"].max(axis=(1, 2))

    rng = np.random.default_rng(2)
    count = 150
    blades = np.stack([rotors([rate], body=1.0) for rate in rng.uniform(45, 75, count)])
    noise = told(white(rng, count, PULSES))
    uav = told(blades * 10 ** (-12.5 / 20) + white(rng, count, PULSES))
    found = [np.mean(seen > np.quantile(empty, 0.98)) for seen, empty in zip(uav, noise, strict=True)]
    assert found[0] < 0.5
    assert found[1] > 0.8


def test_what_is_alike_over_a_wide_part_is_no_comb():
    """A hump of noise, as of rain or a flock, twenty times the floor."""
    rng = np.random.default_rng(3)
    colour = np.fft.fftfreq(PULSES, 1 / PRF_HZ)
    hump = np.fft.ifft(np.fft.fft(white(rng, 60, PULSES)) * np.exp(-((colour / 400) ** 2)))
    hump *= np.sqrt(20 / np.mean(np.abs(np.fft.fft(hump)[:, np.abs(colour) < 200]) ** 2) * PULSES)
    found = combs(hump + white(rng, 60, PULSES)).max(axis=-1)
    comb = combs(np.stack([rotors([r]) for r in rng.uniform(45, 75, 60)]) + white(rng, 60, PULSES)).max(axis=-1)
    assert np.median(found) < np.quantile(comb, 0.05) - 3


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32), rate_hz=st.floats(30, 100), angle=st.floats(0, 6.28), gain=st.floats(1e-9, 1e9))
def test_neither_the_sign_of_the_velocity_nor_phase_nor_gain_matters(seed, rate_hz, angle, gain):
    iq = 0.4 * rotors([rate_hz], velocity_mps=5.0) + white(np.random.default_rng(seed), PULSES)
    reference = combs(iq)
    for changed in (iq.conj(), gain * iq * np.exp(1j * angle)):
        np.testing.assert_allclose(combs(changed), reference, atol=0.02)


def test_a_scene_of_other_wavelength_and_the_same_doppler_is_the_same():
    iq = rotors([58.6]) + white(np.random.default_rng(4), PULSES)
    slow = combs(iq, carrier_hz=CARRIER_HZ / 2, prf_hz=PRF_HZ / 2)
    octave = np.log(2) / np.log(EDGES_HZ[1] / EDGES_HZ[0])
    assert abs(int(combs(iq).argmax()) - int(slow.argmax()) - octave) <= 1.5


@pytest.mark.parametrize("pulses", [700, PULSES])
def test_it_is_what_its_definition_says(pulses):
    """Every step again in float64, spacing by spacing."""
    iq = 0.5 * rotors([58.6, 61.0], velocity_mps=4.0)[:pulses] + white(np.random.default_rng(5), pulses)
    spectrum = doppler_spectrum(iq, **RADAR, window=HANN)
    mask = notch_mask(spectrum, strongest_bin(spectrum))
    plan = plan_of(pulses)
    assert np.abs(spectrum.velocity_mps[plan.band]).max() <= REACH_MPS
    np.testing.assert_allclose(spectrum.velocity_mps[plan.band].sum(), 0, atol=1e-6)  # as far to both sides
    taper = HANN.taper(pulses) * (1 + np.cos(2 * np.pi * np.arange(pulses) / spectrum.bins) / 2)
    broad = np.fft.fftshift(np.fft.fft(taper / np.sqrt(np.sum(taper**2)) * iq.astype(np.complex64), spectrum.bins))
    nats = line_nats(np.abs(broad[plan.band]) ** 2 / float(spectrum.transform_floor))
    kept = mask[plan.band]
    for block in np.split(np.arange(len(nats)), plan.blocks):
        nats[block] = np.where(kept[block], nats[block] - nats[block][kept[block]].mean(), 0)
    heights = np.abs(np.fft.rfft(nats, plan.length)) * plan.per_noise / np.sqrt(kept.sum()) - MEAN_HEIGHT
    found = comb_levels_db(spectrum, mask)[0]
    hz_a_place = PRF_HZ * plan.length / spectrum.bins
    levels = {}
    for place in np.arange(4, plan.length, 1) / 2:
        rate_hz = hz_a_place / place
        multiples = [round(n * place) for n in range(1, ENDS[-1] + 1)]  # half to even, as NumPy rounds
        peaks = [heights[lag] for lag in multiples if lag < len(heights)]
        sums = [sum(peaks[:end]) / np.sqrt(min(end, len(peaks))) for end in ENDS]
        levels[rate_hz] = max([0.0, *sums]) / HEIGHT_DEVIATION
    checked = 0
    for number in range(COMB_BINS):
        inside = [level for rate, level in levels.items() if EDGES_HZ[number] < rate <= EDGES_HZ[number + 1]]
        edge = number in (0, COMB_BINS - 1) or UNSEEN_DB in found[number - 1 : number + 2]
        if not edge and inside:
            assert found[number] == pytest.approx(10 * np.log10(max([1.0, *inside])), abs=0.02)
            checked += 1
    assert checked > 15


@pytest.mark.parametrize("iq", [np.zeros(PULSES, complex), np.full(PULSES, 2 - 1j)])
def test_silence_or_a_constant_is_no_comb(iq):
    assert combs(iq).max() <= 0


def test_a_lone_line_is_no_comb_up_to_80_db_over_the_noise_of_a_bin():
    """Beyond that the side lobes of the window show past the notch, without any noise too."""
    noise = white(np.random.default_rng(3), 60, PULSES)
    alone = combs(noise).max(axis=-1)
    with_line = combs(noise + 10 ** (80 / 20) * np.sqrt(1.5 / PULSES) * tone(1234.5)).max(axis=-1)
    assert np.median(with_line) < np.median(alone) + 0.7
    assert with_line.max() < np.quantile(alone, 0.95) + 1.5


@pytest.mark.parametrize(("pulses", "prf_hz"), [(16, 1e5), (64, 1e3), (500, 1e5), (65536, 2e4)])
def test_rates_that_the_dwell_does_not_tell_are_marked(pulses, prf_hz):
    found = combs(white(np.random.default_rng(7), 5, pulses), prf_hz=prf_hz)
    plan = plan_of(pulses, prf_hz=prf_hz)
    told = np.zeros(COMB_BINS, bool)
    if plan is not None:
        told[::-1][plan.seen] = True
        middle_hz = np.sqrt(EDGES_HZ[:-1] * EDGES_HZ[1:])[told]
        assert middle_hz.min() >= 3.4 * prf_hz / pulses  # nearer lines are one
    np.testing.assert_array_equal((found == UNSEEN_DB).all(axis=0), ~told)
    np.testing.assert_array_equal((found >= 0).all(axis=0), told)


def test_a_batch_is_what_its_records_are():
    iq = 0.3 * rotors([58.6]) + white(np.random.default_rng(8), 5, PULSES)
    np.testing.assert_array_equal(combs(iq), np.stack([combs(one) for one in iq]))
