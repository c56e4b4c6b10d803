"""A comb that stays is found with its chopping frequency; one that does not, or that is a wheel's, is not."""

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features import steady_comb as module
from bladewing.features.rotor.comb import OVER_BODY, find_comb
from bladewing.features.rotor.periodogram import prepare
from bladewing.features.steady_comb import DWELL_S, DWELLS, LEAST, steady_comb

from .signals import white

RADAR = {"carrier_hz": 9.85e9, "prf_hz": 10e3}
WAVELENGTH_M = 299_792_458 / RADAR["carrier_hz"]
DWELL = round(DWELL_S * RADAR["prf_hz"])
PULSES = 25 * DWELL
TIME_S = np.arange(PULSES) / RADAR["prf_hz"]


def comb(chopping_hz=160.0, *, orders=range(-20, 21), velocity_mps=3.0, snr_db=3.0, seed=0, pulses=PULSES):
    """Lines of equal power and random phases about a body, in noise of unit power; the spacing may be a course."""
    rng = np.random.default_rng(seed)
    turns = np.cumsum(np.broadcast_to(chopping_hz, PULSES)[:pulses]) / RADAR["prf_hz"]
    lines = sum(np.exp(2j * np.pi * (n * turns + rng.random())) for n in orders if n)
    lines *= np.sqrt(10 ** (snr_db / 10) / len(orders))
    body = 2.0 + lines
    return body * np.exp(-4j * np.pi / WAVELENGTH_M * velocity_mps * TIME_S[:pulses]) + white(rng, pulses)


def test_a_rotor_is_found_though_its_rate_moves_and_none_where_it_does_not_stay():
    never = np.repeat(160 * 1.3 ** np.random.default_rng(1).permutation(np.arange(-12, 13) / 3), DWELL)
    wheel = np.arange(-16, 17)  # from rest to twice the body's velocity
    speed_mps = 16 * 160 * WAVELENGTH_M / 2
    seldom = np.concatenate([comb(pulses=3 * DWELL), white(np.random.default_rng(3), PULSES - 3 * DWELL)])
    records = {
        "steady": (comb(), True),
        "wanders": (comb(160 * (1 + 0.02 * np.sin(2 * np.pi * 0.7 * TIME_S)), seed=1), True),
        "at -9 dB": (comb(snr_db=-9.0, seed=2), True),
        "approaches": (comb(velocity_mps=-20.0, seed=3), True),
        "another in every dwell": (comb(never, seed=4), False),
        "in two dwells": (seldom, False),
        "a wheel": (comb(orders=wheel, velocity_mps=speed_mps, seed=5), False),
        "as slow as wings": (comb(40.0, orders=range(-8, 9), seed=6), False),
        "noise": (white(np.random.default_rng(7), PULSES), False),
        "a line": (comb(orders=[0], seed=8), False),
        "zeros": (np.zeros(PULSES), False),
        "one value": (np.full(PULSES, 6.2 + 14.9j), False),
    }
    given = np.stack([iq for iq, _ in records.values()]).astype(np.complex64)
    found = steady_comb(given, **RADAR)
    assert dict(zip(records, np.isfinite(found.chopping_hz), strict=True)) == {
        name: stays for name, (_, stays) in records.items()
    }
    here = np.isfinite(found.chopping_hz)
    np.testing.assert_allclose(found.chopping_hz[here], 160, rtol=0.03)
    # each alone, at any gain
    for row, (iq, _) in enumerate(records.values()):
        most = max(abs(iq).max(), 1e-30)
        for gain, rel in ((1e-12, 1e-6), (3.3e38 / most, 1e-6), (1e-40 / most, 1e-2)):  # 17 bits are left of the last
            alone = steady_comb((iq * gain).astype(np.complex64), **RADAR)
            assert alone.chopping_hz == pytest.approx(found.chopping_hz[row], rel=rel, nan_ok=True)


def test_another_radars_pulses_are_no_comb_that_stays():
    """One pulse in 60.7, 25 dB over the noise: of one phase they are a comb in every dwell."""
    rng = np.random.default_rng(5)
    iq = white(rng, 8 * 2000)
    iq[np.arange(11, len(iq), 60.7).astype(int)] += 18 * np.exp(2j)
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3}
    assert np.isnan(steady_comb(iq.astype(np.complex64), **radar).chopping_hz)
    found = [find_comb(prepare(dwell, **radar))[0] for dwell in iq.astype(np.complex64).reshape(8, 2000)]
    assert sum(comb is not None for comb in found) >= LEAST


def test_a_wheel_has_a_comb_in_every_dwell():
    """So that it is the reach of its lines, and nothing else, that speaks against a rotor."""
    speed_mps = 16 * 160 * WAVELENGTH_M / 2
    iq = comb(orders=np.arange(-16, 17), velocity_mps=speed_mps, seed=5)[: 8 * DWELL].reshape(8, DWELL)
    found = measure(iq.astype(np.complex64), **RADAR)
    assert sum("lines as wheels have" in reason for reason in found.reason) >= LEAST
    further = comb(orders=np.arange(-24, 25), velocity_mps=speed_mps / OVER_BODY, seed=5).astype(np.complex64)
    assert steady_comb(further, **RADAR).chopping_hz == pytest.approx(160, rel=0.03)


@pytest.mark.parametrize(("dwells", "stays"), [(2.9, False), (3, True), (5.5, True), (20, True)])
def test_dwells_of_short_recordings(dwells, stays):
    found = steady_comb(comb(snr_db=10.0, pulses=round(dwells * DWELL)), **RADAR)
    assert np.isfinite(found.chopping_hz) == stays


def test_no_more_dwells_are_looked_at_than_it_takes(monkeypatch):
    looked = []
    look = module._rotor_hz
    monkeypatch.setattr(module, "_rotor_hz", lambda iq, *radar: (looked.append(iq), look(iq, *radar))[1])
    assert np.isfinite(steady_comb(comb(snr_db=10.0), **RADAR).chopping_hz)
    assert len(looked) == LEAST
    looked.clear()
    assert np.isnan(steady_comb(white(np.random.default_rng(2), PULSES).astype(np.complex64), **RADAR).chopping_hz)
    assert len(looked) == DWELLS


def test_a_slow_radar_shows_no_comb():
    assert np.isnan(steady_comb(comb().astype(np.complex64), carrier_hz=9.85e9, prf_hz=10.0).chopping_hz)


def test_no_recording_and_real_samples():
    assert steady_comb(np.zeros((0, PULSES), np.complex64), **RADAR).chopping_hz.shape == (0,)
    with pytest.raises(ValueError, match="must be complex"):
        steady_comb(comb().real, **RADAR)


def test_not_in_noise():
    noise = white(np.random.default_rng(11), 100, PULSES).astype(np.complex64)
    assert np.isfinite(steady_comb(noise, **RADAR).chopping_hz).sum() == 0
