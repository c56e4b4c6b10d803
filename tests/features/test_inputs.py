import numpy as np
import pytest
from bladewing.features import FEATURES, INPUT_SHAPES, JOINT_FEATURES, doppler_spectrum, model_inputs, schema_hash
from bladewing.features import inputs as inputs_module
from bladewing.features.change import frames
from bladewing.features.joint import frame_length, stft_image
from bladewing.features.schema import IMAGE_FRAMES
from bladewing.features.vector import lay_out
from bladewing.features.window import HANN
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from scipy.signal import ShortTimeFFT

from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, rotors, white

ALL = tuple(INPUT_SHAPES)


def scene(seed: int = 0) -> np.ndarray:
    return rotors([58.6, 60.1], velocity_mps=-7.0) + 0.3 * white(np.random.default_rng(seed), PULSES)


def features(iq, radar=RADAR) -> dict[str, float]:
    return dict(zip([f.name for f in FEATURES], model_inputs(iq, **radar)["features"], strict=True))


def test_shapes_types_and_ranges():
    iq = np.stack([scene(), white(np.random.default_rng(1), PULSES)]).reshape(2, 1, PULSES)
    inputs = model_inputs(iq, **RADAR, names=ALL)
    for name, shape in INPUT_SHAPES.items():
        assert inputs[name].shape == (2, 1, *shape)
        assert inputs[name].dtype == np.float32
        assert np.isfinite(inputs[name]).all()
    for name, table in (("features", FEATURES), ("joint_features", JOINT_FEATURES)):
        for number, feature in enumerate(table):
            values = inputs[name][..., number]
            assert (values >= np.float32(feature.low)).all(), feature
            assert (values <= np.float32(feature.high)).all(), feature


@settings(max_examples=60, deadline=None)
@given(
    parts=npst.arrays(
        np.float32,
        st.tuples(st.integers(1, 2), st.integers(16, 90), st.just(2)),
        elements=st.floats(-(2.0**100), 2.0**100, width=32),
    ),
    carrier_hz=st.floats(1e8, 3e11),
    prf_hz=st.floats(100, 1e6),
)
def test_any_finite_samples_give_finite_inputs(parts, carrier_hz, prf_hz):
    iq = parts.view(np.complex64)[..., 0]
    for values in model_inputs(iq, carrier_hz=carrier_hz, prf_hz=prf_hz, names=ALL).values():
        assert np.isfinite(values).all()


def test_a_target_120_db_over_the_noise_overflows_nothing():
    loud = rotors([58.6], body=0.0) * 1e6 + white(np.random.default_rng(0), PULSES)
    values = model_inputs(loud, **RADAR, names=ALL)
    assert all(np.isfinite(v).all() for v in values.values())
    named = dict(zip([f.name for f in JOINT_FEATURES], values["joint_features"], strict=True))
    # flashes at 117 Hz: frames of 10.7 ms blur them, but they are there
    assert 1 < named["frame_kurtosis"] < 40


@pytest.mark.parametrize("pulses", [16, 77, 500, 1000, 2048, 3000])
def test_batch_equals_loop_bit_for_bit(pulses):
    iq = np.stack([scene(seed)[:pulses] for seed in range(40)])
    batch = model_inputs(iq, **RADAR)
    for i in range(len(iq)):
        one = model_inputs(iq[i], **RADAR)
        for name in batch:
            np.testing.assert_array_equal(batch[name][i], one[name])


def test_batch_equals_loop():
    iq = np.stack([scene(seed) * 10.0**seed for seed in range(5)])
    batch = model_inputs(iq, **RADAR, names=ALL)
    for i in range(5):
        one = model_inputs(iq[i], **RADAR, names=ALL)
        for name in ALL:
            np.testing.assert_allclose(batch[name][i], one[name], rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("names", [ALL, ("spectrum",)])
def test_blocks_of_any_size_give_the_same(monkeypatch, names):
    iq = np.stack([scene(seed) for seed in range(6)]).reshape(2, 3, PULSES)
    whole = model_inputs(iq, **RADAR, names=names)
    monkeypatch.setattr(inputs_module, "BLOCK_SAMPLES", 4 * PULSES + 1)
    parts = model_inputs(iq, **RADAR, names=names)
    assert list(parts) == list(whole)
    for name in names:
        assert parts[name].shape == (2, 3, *INPUT_SHAPES[name])
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-4, atol=1e-3)


def test_the_spectrum_is_the_levels_their_change_and_those_of_each_part():
    given = model_inputs(np.stack([scene(0), scene(1)]), **RADAR, names=("levels", "spectrum"))
    levels, change, parts = np.split(given["spectrum"], (2, 3), axis=-2)
    np.testing.assert_array_equal(levels, given["levels"])
    np.testing.assert_allclose(change[..., 0, :], parts.std(axis=-2), atol=1e-4)
    # flashes at 117 Hz: each part of 21 ms holds some, so all are near the level of the whole
    seen = levels[:, 0] > 10
    assert np.abs((parts.mean(axis=-2) - levels[:, 0])[seen]).mean() < 4


def test_only_what_is_asked_for_is_computed():
    assert set(model_inputs(scene(), **RADAR, names=("image",))) == {"image"}
    with pytest.raises(ValueError, match="'cepstrogram' is unknown"):
        model_inputs(scene(), **RADAR, names=("cepstrogram",))
    with pytest.raises(ValueError, match="at least 16 pulses"):
        model_inputs(np.ones(15, complex), **RADAR)


@pytest.mark.parametrize("gain", [1e-25, 3.7, -1.0, 1j, 1e25])
def test_gain_and_phase_do_not_matter(gain):
    reference, changed = (model_inputs(scene() * g, **RADAR, names=ALL) for g in (1.0, gain))
    for name in ALL:
        np.testing.assert_allclose(changed[name], reference[name], rtol=1e-3, atol=5e-3)


@pytest.mark.parametrize("pulses", [16, 77, 499, 500, 2048])
def test_conjugation_mirrors_the_velocity_axis_and_leaves_the_measurements(pulses):
    """A receding copy of an approaching target, of every strength: no feature tells them apart."""
    rng = np.random.default_rng(pulses)
    count = 40
    turns = np.arange(pulses)
    line = 10 ** rng.uniform(-2, 2, (count, 1)) * np.exp(2j * np.pi * rng.uniform(-0.5, 0.5, (count, 1)) * turns)
    rotor = np.stack([rotors([rate])[:pulses] for rate in rng.uniform(30, 100, count)])
    iq = white(rng, count, pulses) + line + 10 ** rng.uniform(-2, 1, (count, 1)) * rotor
    one, other = (model_inputs(x, **RADAR, names=("features", "spectrum")) for x in (iq, iq.conj()))
    np.testing.assert_allclose(other["spectrum"], one["spectrum"][..., ::-1], atol=0.01)
    off = np.abs(other["features"] - one["features"]) / (FEATURES.high - FEATURES.low) > 1e-4
    assert not off.any(), [(FEATURES[i].name, int(off[:, i].sum())) for i in np.flatnonzero(off.any(axis=0))]


def test_carrier_and_prf_scaled_together_give_the_same_velocities():
    iq = scene()
    reference = model_inputs(iq, **RADAR, names=("spectrum", "image"))
    scaled = model_inputs(iq, carrier_hz=2.5 * CARRIER_HZ, prf_hz=2.5 * PRF_HZ, names=("spectrum", "image"))
    for name in reference:
        np.testing.assert_allclose(scaled[name], reference[name], atol=1e-3)


def test_features_of_a_quadcopter_say_what_it_is():
    values = features(scene())
    assert values["body_speed_mps"] == pytest.approx(7.0, abs=0.1)
    assert 10 ** values["chopping_log"] == pytest.approx(2 * 59.35, rel=0.02)
    assert values["chopping_strength"] > 5
    assert values["notch_residual_share"] < 0.2  # the body holds nine tenths of the power
    assert values["symmetry"] > 0.5


def test_features_of_noise_say_nothing():
    rng = np.random.default_rng(0)
    rows = model_inputs(white(rng, 100, 2048), carrier_hz=10e9, prf_hz=25e3)["features"]
    table = dict(zip([f.name for f in FEATURES], rows.T, strict=True))
    assert np.median(abs(table["notch_residual_db"])) < 0.5
    assert np.median(table["ripple_db"]) == pytest.approx(5.57, abs=0.3)  # of the log of an exponential
    assert np.quantile(table["bandwidth_speed_mps"], 0.9) == 0
    assert abs(np.median(table["symmetry"])) < 0.1


def test_image_equals_scipys_short_time_fft():
    iq = scene().astype(np.complex64)
    spectrum = doppler_spectrum(iq, **RADAR, window=HANN)
    length = frame_length(PULSES)
    starts = np.rint(np.linspace(0, PULSES - length, IMAGE_FRAMES)).astype(int)
    hop = int(np.gcd.reduce(starts[1:]))
    hann = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    hann /= np.sqrt(np.sum(hann**2))
    stft = ShortTimeFFT(hann, hop, PRF_HZ, fft_mode="centered", mfft=length, phase_shift=None)
    slices = stft.stft(iq.astype(complex), p0=0)
    from bladewing.features.change import frame_power

    ours = frame_power(iq, spectrum, length, IMAGE_FRAMES) * float(spectrum.floor)
    first = length // 2  # scipy centres its slice p at sample p * hop
    for number, start in enumerate(starts):
        position, rest = divmod(start + first, hop)
        if rest or position >= slices.shape[1]:
            continue
        theirs = abs(slices[:, position]) ** 2
        np.testing.assert_allclose(ours[number], theirs, rtol=2e-3, atol=2e-6 * theirs.max())
    assert stft_image(iq, spectrum).shape == INPUT_SHAPES["image"][1:]


@given(pulses=st.integers(16, 500), count=st.integers(2, 40), share=st.floats(0.01, 1))
def test_frames_cover_the_record_from_end_to_end(pulses, count, share):
    length = max(1, int(pulses * share))
    iq = np.arange(pulses).astype(np.complex64)
    cut = frames(iq, length, count)
    assert cut.shape == (count, length)
    assert cut[0, 0] == 0
    assert cut[-1, -1] == pulses - 1
    assert (np.diff(cut.real, axis=-1) == 1).all()
    assert np.ptp(np.diff(cut[:, 0].real)) <= 1


def test_lay_out_holds_values_in_their_ranges():
    columns = {f.name: np.array([np.nan, np.inf, -np.inf]) for f in FEATURES}
    out = lay_out(columns, FEATURES, (3,))
    for number, feature in enumerate(FEATURES):
        assert out[0, number] == np.clip(0, np.float32(feature.low), np.float32(feature.high))
        assert out[1, number] == np.float32(feature.high)
        assert out[2, number] == np.float32(feature.low)


def test_schema_names_are_unique_and_have_a_hash():
    names = [f.name for f in FEATURES + JOINT_FEATURES]
    radar = {"velocity_step_log", "unambiguous_log", "dwell_log", "pulses_log"}
    assert len([n for n in names if n not in radar]) == len(set(names) - radar)
    assert len(schema_hash()) == 64


def test_real_samples_are_refused():
    # they would pass for a spectrum with two like sides
    with pytest.raises(ValueError, match="iq holds float32: its samples must be complex"):
        model_inputs(np.ones(64, np.float32), carrier_hz=10e9, prf_hz=20e3)


@pytest.mark.parametrize("name", ALL)
def test_no_records_give_no_rows(name):
    for lead in ((0,), (2, 0)):
        found = model_inputs(np.zeros((*lead, 2048), np.complex64), **RADAR, names=(name,))[name]
        assert found.shape == (*lead, *INPUT_SHAPES[name])


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("value", [np.nan, np.inf, complex(0, -np.inf)])
def test_samples_that_are_not_finite_are_refused(name, value):
    iq = white(np.random.default_rng(0), 3, 500).astype(np.complex64)
    iq[1, 77] = value
    with pytest.raises(ValueError, match="values that are not finite: interpolate them"):
        model_inputs(iq, **RADAR, names=(name,))
