import numpy as np
import pytest
from bladewing.features import doppler_spectrum
from bladewing.features.axis import LIMIT_MPS, UNSEEN_DB, axis_edges_mps, axis_velocities_mps, pooling
from bladewing.features.fast import LOWEST_DB
from bladewing.features.window import HANN
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from .signals import white

C = 299_792_458.0


def test_the_axis_is_symmetric_and_rises():
    edges = axis_edges_mps(256)
    np.testing.assert_allclose(edges, -edges[::-1], atol=1e-12)
    assert (np.diff(edges) > 0).all()
    assert edges[-1] == pytest.approx(LIMIT_MPS)


@settings(max_examples=60, deadline=None)
@given(
    carrier_hz=st.floats(2e9, 100e9),
    span_mps=st.floats(10, 400),
    pulses=st.integers(64, 4000),
    share=st.floats(-0.95, 0.95),
)
def test_a_line_lands_on_its_velocity_for_every_radar(carrier_hz, span_mps, pulses, share):
    prf_hz = 4 * span_mps * carrier_hz / C
    velocity_mps = share * span_mps
    assume(abs(velocity_mps) < 195)
    phase = -4 * np.pi * velocity_mps * np.arange(pulses) / prf_hz * carrier_hz / C
    spectrum = doppler_spectrum(np.exp(1j * phase), carrier_hz=carrier_hz, prf_hz=prf_hz)
    level = pooling(spectrum.bins, carrier_hz, prf_hz, 256).mean_db(spectrum.relative_power)
    found = axis_velocities_mps(256)[level.argmax()]
    edges = axis_edges_mps(256)
    width = np.diff(edges)[level.argmax()]
    resolution = 2 * span_mps / pulses
    assert abs(found - velocity_mps) <= width + 1.5 * resolution


@settings(max_examples=60, deadline=None)
@given(bins=st.integers(16, 5000), carrier_hz=st.floats(2e9, 100e9), prf_hz=st.floats(1e3, 1e5))
def test_every_group_is_within_the_spectrum_and_in_order(bins, carrier_hz, prf_hz):
    pool = pooling(bins, carrier_hz, prf_hz, 256)
    assert (np.diff(pool.starts) >= 0).all()
    first, counts = pool.spans
    assert len(first) == len(counts) == pool.seen.stop - pool.seen.start == 2 * len(pool.starts)
    assert (counts >= 1).all()
    assert (first >= 0).all()
    assert (first + counts <= bins).all()
    # every bin of frequency below the limits of radar and axis is in one of a side at least
    held = {bin_ for a, n in zip(first, counts, strict=True) for bin_ in range(a, a + n)}
    assert held == set(range(min(held), max(held) + 1))
    assert min(held) + max(held) == 2 * (bins // 2)


def test_bins_beyond_the_unambiguous_span_are_marked_unseen():
    carrier_hz, prf_hz = 10e9, 2e3  # +-15 m/s
    pool = pooling(400, carrier_hz, prf_hz, 256)
    level = pool.mean_db(np.ones(400, np.float32))
    centres = axis_velocities_mps(256)
    np.testing.assert_array_equal(level == UNSEEN_DB, abs(centres) > C / carrier_hz * prf_hz / 4)


def test_noise_lies_at_zero_db_in_mean_and_peak():
    rng = np.random.default_rng(0)
    spectrum = doppler_spectrum(white(rng, 200, 2048), carrier_hz=10e9, prf_hz=25e3, window=HANN)
    pool = pooling(spectrum.bins, 10e9, 25e3, 256)
    mean, peak = (10 ** (pool.mean_and_peak_db(spectrum.relative_power)[..., pool.seen] / 10)).mean(axis=0)
    # 200 records; the floor's own error (0.4 dB) is common to all bins, and Gumbel's mean suits few bins roughly
    assert abs(10 * np.log10(np.median(mean))) < 0.5
    assert abs(10 * np.log10(np.median(peak))) < 0.5


@pytest.mark.parametrize(("bins", "prf_hz"), [(65, 2e3), (500, 25e3), (512, 25e3), (1024, 90e3), (5000, 25e3)])
def test_the_mean_level_is_the_mean_of_the_bins(bins, prf_hz):
    power = np.random.default_rng(bins).exponential(size=(3, 30, bins)).astype(np.float32) * np.logspace(0, 8, bins)
    pool = pooling(bins, 10e9, prf_hz, 256)
    unit = np.float32([[[2.0]], [[3.0]], [[1.0]]])
    from_floor = pool.mean_db(power.astype(np.float32), 1 / unit, from_floor=True)
    plain = pool.mean_db((power / unit).astype(np.float32))
    assert from_floor.shape == (3, 30, 256)
    np.testing.assert_allclose(from_floor, np.maximum(plain, 0), atol=1e-4)
    rows = [np.mean((power / unit)[..., s : s + int(n)], axis=-1) for s, n in zip(*pool.spans, strict=True)]
    expected = np.maximum(10 * np.log10(np.stack(rows, axis=-1)), LOWEST_DB)
    np.testing.assert_allclose(plain[..., pool.seen], expected, atol=1e-4)


@settings(max_examples=60, deadline=None)
@given(bins=st.integers(16, 3000), carrier_hz=st.floats(2e9, 100e9), prf_hz=st.floats(1e3, 1e5), rows=st.integers(1, 5))
def test_a_mirrored_spectrum_is_mirrored_on_the_axis(bins, carrier_hz, prf_hz, rows):
    power = np.random.default_rng(bins).exponential(size=(rows, bins)).astype(np.float32)
    mirrored = power[:, (2 * (bins // 2) - np.arange(bins)) % bins]
    pool = pooling(bins, carrier_hz, prf_hz, 256)
    one, other = pool.mean_and_peak_db(mirrored), pool.mean_and_peak_db(power)[..., ::-1]
    np.testing.assert_array_equal(pool.mean_db(mirrored), one[:, 0])
    np.testing.assert_array_equal(one, other)
