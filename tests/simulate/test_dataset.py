import numpy as np
import pytest
from bladewing.simulate import CLASSES, KIND_CLASS, KINDS, TRUTH_UNITS, Radar, draw_radar, draw_records, stream
from bladewing.simulate import dataset as dataset_module
from bladewing.simulate.laws import LAWS, WIDTH, Draws
from bladewing.simulate.target import Target

RADAR = Radar(9.85e9, 12e3, 257)


def test_same_seed_same_bits_whatever_the_batch(monkeypatch):
    whole = draw_records(RADAR, 60, seed=7)
    parts = [draw_records(RADAR, n, seed=7, start=s) for s, n in ((0, 1), (1, 22), (23, 37))]
    np.testing.assert_array_equal(whole.iq, np.concatenate([p.iq for p in parts]))
    np.testing.assert_array_equal(whole.labels, np.concatenate([p.labels for p in parts]))
    for name in whole.truth:
        np.testing.assert_array_equal(whole.truth[name], np.concatenate([p.truth[name] for p in parts]))
    monkeypatch.setattr(dataset_module, "_CHUNK_SAMPLES", 3 * RADAR.pulses)
    np.testing.assert_array_equal(whole.iq, draw_records(RADAR, 60, seed=7).iq)


@pytest.mark.parametrize("kind", list(KIND_CLASS))
def test_each_kind_alone_renders_the_same_bits_in_any_batch(kind):
    whole = draw_records(RADAR, 9, seed=5, kind=kind)
    assert np.isfinite(whole.iq).all()
    assert set(whole.labels) == {KIND_CLASS[kind]}
    for i in range(9):
        np.testing.assert_array_equal(whole.iq[i], draw_records(RADAR, 1, seed=5, start=i, kind=kind).iq[0])


def test_other_seeds_and_purposes_are_other_records_of_other_radars():
    base = draw_records(RADAR, 6, seed=1)
    for other in (draw_records(RADAR, 6, seed=2), draw_records(RADAR, 6, seed=1, purpose="test")):
        assert not (base.iq == other.iq).any()
    drawn = [draw_radar(*of, group) for of in ((1, "train"), (2, "train"), (1, "test")) for group in range(40)]
    assert len(set(drawn)) == 3 * 40


def test_classes_are_balanced_and_kinds_follow_their_shares():
    records = draw_records(Radar(9.85e9, 5e3, 16), 3000, seed=0)
    for label in CLASSES:
        assert (records.labels == label).sum() == 1000
    for label, kinds in KINDS.items():
        total = sum(kinds.values())
        for kind, weight in kinds.items():
            share = weight / total
            count = (records.truth["kind"] == kind).sum()
            assert abs(count - 1000 * share) < 4.5 * np.sqrt(1000 * share * (1 - share)), (label, kind)


def test_truth_has_every_column_and_says_nothing_where_there_is_nothing():
    records = draw_records(RADAR, 60, seed=0)
    assert set(records.truth) == {"kind", *TRUTH_UNITS}
    uav = records.labels == "uav"
    assert np.isfinite(records.truth["chopping_hz"][uav]).all()
    assert np.isnan(records.truth["wingbeat_hz"][uav]).all()
    assert np.isnan(records.truth["snr_db"][records.truth["kind"] == "noise"]).all()


def test_truth_of_a_uav_is_consistent():
    truth = draw_records(RADAR, 200, seed=0, kind="quadcopter").truth
    ratio = truth["chopping_hz"] / truth["rotation_hz"]
    assert (np.isclose(ratio, truth["blades"]) | np.isclose(ratio, 1)).all()
    np.testing.assert_array_equal(truth["rotors"], 4)
    assert (truth["tip_mps"] > 20).all()
    assert (truth["tip_mps"] < 210).all()


def test_receiver_and_background_do_not_depend_on_the_target():
    # What gives the label away must not: the same record with another target has the same surroundings.
    with_uav = draw_records(RADAR, 40, seed=9, kind="quadcopter").truth
    with_noise = draw_records(RADAR, 40, seed=9, kind="noise").truth
    np.testing.assert_array_equal(with_uav["background_db"], with_noise["background_db"])


def test_the_receiver_is_the_same_whatever_the_target(monkeypatch):
    seen = []
    receive = dataset_module.Receiver.receive

    def watched(self, *arguments):
        seen.append(vars(self))
        return receive(self, *arguments)

    monkeypatch.setattr(dataset_module.Receiver, "receive", watched)
    for kind in ("octocopter", "flock", "sea"):
        draw_records(RADAR, 20, seed=4, kind=kind)
    for name, values in seen[0].items():
        if name != "on":
            np.testing.assert_array_equal(values, seen[1][name])
            np.testing.assert_array_equal(values, seen[2][name])
    for fault, present in seen[0]["on"].items():
        np.testing.assert_array_equal(present, seen[2]["on"][fault])


def test_powers_are_those_drawn():
    rng = np.random.default_rng(0)
    micro, body = (rng.normal(size=(5, 999)) + 1j * rng.normal(size=(5, 999)) for _ in range(2))
    snr_db = np.array([-20.0, -3, 0, 10, 30])
    target = Target(micro.astype(np.complex64), body_db=np.full(5, 12.0), body=0 * body.astype(np.complex64))
    power = np.mean(abs(dataset_module.powered(target, snr_db)) ** 2, axis=1)
    np.testing.assert_allclose(10 * np.log10(power), snr_db, atol=1e-3)
    target = Target(0 * micro.astype(np.complex64), body.astype(np.complex64), np.full(5, 12.0))
    power = np.mean(abs(dataset_module.powered(target, snr_db)) ** 2, axis=1)
    np.testing.assert_allclose(10 * np.log10(power), snr_db + 12, atol=1e-3)


def parts_of(monkeypatch, kind):
    """Power of what reaches the receiver and of the thermal noise, a record, and the truth about it."""
    powers = []
    for part in (0, 1):
        monkeypatch.setattr(dataset_module.Receiver, "receive", lambda _, *given, part=part: given[part])
        records = draw_records(Radar(9.85e9, 5e3, 4000), 150, seed=3, kind=kind)
        powers.append(np.mean(np.abs(records.iq.astype(complex)) ** 2, axis=1))
    return *powers, records.truth


def test_the_background_stands_as_far_over_the_noise_as_truth_says(monkeypatch):
    signal, noise, truth = parts_of(monkeypatch, "noise")
    there = np.isfinite(truth["background_db"])
    assert (signal[~there] == 0).all()
    off_db = 10 * np.log10((signal / noise)[there]) - truth["background_db"][there]
    # half of them are a return at rest, the others fluctuate; the noise's own power scatters by 0.07 dB
    assert np.quantile(np.abs(off_db), 0.4) < 0.1
    assert np.abs(np.median(off_db)) < 0.1


def test_an_echo_stands_as_far_over_the_noise_as_truth_says_also_where_that_is_quiet(monkeypatch):
    signal, noise, truth = parts_of(monkeypatch, "rain")
    alone = ~np.isfinite(truth["background_db"])
    assert (truth["quiet_db"][alone] > 0).any()
    np.testing.assert_allclose(10 * np.log10((signal / noise)[alone]), truth["snr_db"][alone], atol=0.4)


def test_a_stream_is_its_groups():
    together = list(stream(3, "train", 60, start=5))
    assert sum(len(r) for r in together) == 60
    at = 5
    for records in together:
        group = at // dataset_module.RADAR_GROUP
        assert records.radar == draw_radar(3, "train", group)
        alone = draw_records(records.radar, len(records), 3, start=at)
        np.testing.assert_array_equal(records.iq, alone.iq)
        at += len(records)


def test_radars_stay_inside_the_envelope():
    radars = [draw_radar(0, "train", g) for g in range(1200)]
    assert all(2e9 <= r.carrier_hz <= 100e9 for r in radars)
    assert all(1e3 <= r.prf_hz <= 1e5 for r in radars)
    assert all(64 <= r.pulses <= (8192 if r.dwell_s <= 1.001 else 65536) or r.pulses == 65536 for r in radars)
    assert all(r.unambiguous_mps > 9.99 for r in radars)
    assert all(0.00499 < r.dwell_s < 5.001 for r in radars)
    # one radar in 8 dwells for 1 to 5 s, as long as 65 536 pulses last
    long = sum(r.dwell_s > 1.001 or r.pulses > 8192 for r in radars)
    assert abs(long - 144) < 4.5 * np.sqrt(0.12 * 0.88 * 1200)
    assert max(r.dwell_s for r in radars) > 3
    # the long dwells make a record on the mean no dearer than two and a half times what it is without their length
    assert np.mean([r.pulses for r in radars]) < 2.5 * np.mean([min(r.pulses, 8192) for r in radars])


@pytest.mark.parametrize(("prf_hz", "dwell_s"), [(2e3, 0.005), (1e3, 5.0), (13e3, 5.0), (1e5, 0.6)])
def test_any_dwell_from_5_ms_to_5_s_is_drawn_and_stays_physical(prf_hz, dwell_s):
    radar = Radar(9.85e9, prf_hz, round(prf_hz * dwell_s))
    records = draw_records(radar, 9, seed=2)
    assert np.isfinite(records.iq).all()
    assert (np.mean(abs(records.iq) ** 2, axis=1) > 0).all()
    draws = Draws(np.random.default_rng(0).random((4000, 2)))
    # over the dwell a rotor's rate changes by 30 % at most, and a vehicle's speed by 4 m/s
    for law, most in (("drift_per_s", 0.3), ("road_acceleration_mps2", 4.0)):
        assert abs(draws.change(law, radar.dwell_s)).max() * radar.dwell_s <= most * 1.0001


@pytest.mark.parametrize("call", [{"purpose": "holiday"}, {"kind": "ufo"}, {"start": -1}, {"seed": -2}])
def test_wrong_arguments_are_named(call):
    with pytest.raises(ValueError, match=next(iter(call))):
        draw_records(RADAR, 1, **({"seed": 0} | call))


def test_every_law_is_a_range_with_a_source():
    for name, law in LAWS.items():
        assert law.low < law.high, name
        assert law.kind in ("uniform", "log", "rising")
        assert law.kind != "log" or law.low > 0, name
        assert law.source, name
        ends = law(np.array([0.0, 1.0]))
        np.testing.assert_allclose(ends, [law.low, law.high])


def test_drawing_more_than_a_record_owns_is_an_error():
    draws = Draws(np.zeros((2, WIDTH)))
    draws.uniform(WIDTH)
    with pytest.raises(RuntimeError, match="WIDTH"):
        draws.uniform()


@pytest.mark.parametrize("wrong", [{"count": -1}, {"seed": -1}, {"start": -1}])
def test_a_stream_of_less_than_nothing_is_refused(wrong):
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} is -1: it must be a whole number of at least 0"):
        next(stream(**({"seed": 1, "purpose": "train", "count": 1} | wrong)))
    with pytest.raises(ValueError, match="group is -1: it must be a whole number of at least 0"):
        draw_radar(1, "train", -1)


@pytest.mark.parametrize("seed", [1.5, True, "1", None])
def test_a_seed_that_is_no_whole_number_is_refused(seed):
    with pytest.raises(ValueError, match=f"seed is {seed!r}: it must be a whole number of at least 0"):
        draw_records(Radar(9.85e9, 25e3, 256), 1, seed)


def test_a_purpose_that_is_none_is_told_by_all_that_draw():
    with pytest.raises(ValueError, match="purpose is 'tset': it must be one of train"):
        draw_radar(1, "tset", 0)
    with pytest.raises(ValueError, match="purpose is 'tset': it must be one of train"):
        next(stream(1, "tset", 3))
