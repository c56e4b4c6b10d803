from functools import partial

import bladewing.classify
import numpy as np
import pytest
from bladewing.classify import predict
from bladewing.classify.errors import BadInput
from bladewing.classify.fusion import CORRELATION, LOOKS, ODDS
from bladewing.classify.inference import Classifier, Envelope, Prediction
from bladewing.classify.labels import CLASSES, UNKNOWN, decide
from bladewing.classify.predict import Answer, answer
from bladewing.classify.recording import Recording
from bladewing.classify.track import DOUBT, FITTED_DWELL_S, Track, fuse, weights
from bladewing.simulate import Radar, Scene, draw_records
from bladewing.simulate.catalogue import AIRFRAMES
from hypothesis import assume, given
from hypothesis import strategies as st
from rich.console import Console

ACCEPT = (0.6, 0.6, 0.6)


@st.composite
def dwells(draw, least=1, most=12):
    """Probabilities (n, 3), each row a distribution."""
    rows = draw(st.lists(st.tuples(*[st.floats(0.001, 1)] * 3), min_size=least, max_size=most))
    p = np.array(rows)
    return (p / p.sum(axis=1, keepdims=True)).astype(np.float32)


def labelled(p):
    return decide(p, ACCEPT)[0]


def fused(p, labels, *, accept=ACCEPT, **options):
    return fuse(p, labels, rule=partial(decide, accept=accept), **options)


@given(dwells(), st.randoms(use_true_random=False))
def test_order_does_not_matter(p, random):
    order = list(range(len(p)))
    random.shuffle(order)
    one, other = fused(p, labelled(p)), fused(p[order], labelled(p)[order])
    np.testing.assert_allclose(one.probabilities, other.probabilities, atol=1e-6)


@given(dwells(most=1))
def test_one_dwell_is_left_as_it_is(p):
    assume(np.ptp(p) > 1e-3)  # a uniform one says nothing: see below
    track = fused(p, labelled(p))
    np.testing.assert_array_equal(track.probabilities, p[0])
    assert track.label == labelled(p)[0]
    assert track.used == 1


@given(dwells(most=1), st.integers(2, 50), st.floats(0, 0.9))
def test_agreement_sharpens(p, count, correlation):
    best = int(np.argmax(p[0]))
    assume(p[0, best] - np.sort(p[0])[1] > 0.01)
    fewer, more = (
        fused(many, labelled(many), correlation=correlation).probabilities[best]
        for many in (np.repeat(p, number, axis=0) for number in (count, count + 1))
    )
    assert fewer > p[0, best] or p[0, best] > 0.9999
    assert more >= fewer - 1e-6


@given(dwells(), st.floats(0, 1))
def test_a_track_is_a_distribution(p, correlation):
    track = fused(p, labelled(p), correlation=correlation)
    assert track.probabilities.dtype == np.float32
    assert np.all(track.probabilities >= 0)
    assert track.probabilities.sum() == pytest.approx(1, abs=1e-5)
    assert track.label in (*CLASSES, UNKNOWN)
    assert (track.label == UNKNOWN) == bool(track.reason)


@given(dwells(), st.integers(1, 20))
def test_dwells_outside_the_envelope_change_nothing(p, count):
    silent = np.full((count, 3), 1 / 3, dtype=np.float32)
    labels = np.concatenate([labelled(p), np.full(count, UNKNOWN)])
    alone, mixed = fused(p, labelled(p)), fused(np.concatenate([p, silent]), labels)
    np.testing.assert_array_equal(alone.probabilities, mixed.probabilities)
    assert (alone.label, alone.used) == (mixed.label, mixed.used)


def test_independent_evidence_multiplies_and_full_correlation_counts_once():
    p = np.array([[0.5, 0.3, 0.2], [0.6, 0.2, 0.2]])
    product = p[0] * p[1] / np.sum(p[0] * p[1])
    np.testing.assert_allclose(fused(p, labelled(p), correlation=0).probabilities, product, rtol=1e-6)
    twice = p[[0, 0]]
    np.testing.assert_allclose(fused(twice, labelled(twice), correlation=1).probabilities, p[0], rtol=1e-6)


def test_correlated_dwells_are_never_worth_more_than_the_limit():
    # 1 / 0.25 = 4 dwells: odds of 2 to 1 grow to at most 2^4 to 1, however long the track.
    p = np.tile([0.5, 0.25, 0.25], (10_000, 1))
    uav, bird, _ = fused(p, labelled(p), correlation=0.25).probabilities
    assert uav / bird == pytest.approx(2**4, rel=1e-2)


def test_dwells_that_are_not_sure_add_up_to_an_answer():
    p = np.tile(np.float32([0.55, 0.25, 0.20]), (5, 1))
    assert set(labelled(p)) == {UNKNOWN}
    assert fused(p, labelled(p), correlation=0.72).label == "uav"


def test_contradiction_is_unknown():
    p = np.float32([[0.9, 0.05, 0.05], [0.05, 0.9, 0.05]])
    track = fused(p, labelled(p))
    assert track.label == UNKNOWN
    assert track.reason.startswith("not sure: best ")


@given(dwells(), st.floats(0, 1))
def test_declared_at_the_first_dwell_that_names_a_class_with_its_odds_divided(p, correlation):
    track = fused(p, labelled(p), correlation=correlation)
    safe = []
    for n in range(1, len(p) + 1):
        so_far = fused(p[:n], labelled(p)[:n], correlation=correlation)
        best = float(so_far.probabilities.max())
        needed = 0.6 / 0.4 * DOUBT  # odds
        odds = best / max(1 - best, 1e-9)
        assume(abs(odds / needed - 1) > 1e-4)  # float32 cannot tell
        if odds > needed:
            safe.append((CLASSES[int(so_far.probabilities.argmax())], n))
    assert (track.declared, track.declared_after) == (safe[0] if safe else ("", 0))


def test_declared_is_what_is_named_with_its_own_odds_divided_also_where_another_is_likelier():
    def rule(p):  # as prediction sets may: the bird's own limit is low
        named = np.where(p[:, 1] >= 0.38, "bird", np.where(p[:, 0] >= 0.5, "uav", UNKNOWN))
        return named, [""] * len(p)

    limit = 0.38 / 0.62 * DOUBT  # odds
    birds = np.array([1.1, 0.9]) * limit / (1 + np.array([1.1, 0.9]) * limit)
    sure, unsure = (np.float32([[1 - bird, bird, 0]]) for bird in birds)
    assert fuse(sure, ["bird"], rule=rule).declared == "bird"
    found = fuse(unsure, ["bird"], rule=rule)
    assert (found.label, found.declared) == ("bird", "")


def test_a_declaration_stands_though_later_dwells_disagree():
    p = np.float32([[0.9, 0.05, 0.05]] + [[0.05, 0.05, 0.9]] * 9)
    track = fused(p, labelled(p))
    assert (track.declared, track.declared_after, track.label) == ("uav", 1, "clutter")


def test_silent_dwells_take_their_time_before_a_declaration():
    p = np.float32([[1 / 3] * 3] * 3 + [[0.9, 0.05, 0.05]])
    track = fused(p, [UNKNOWN] * 3 + ["uav"])
    assert (track.declared, track.declared_after, track.used) == ("uav", 4, 1)


def test_stopping_early_keeps_what_calibrated_probabilities_promise():
    # Independent dwells of known densities: the fused probability is the true posterior. Declared at odds of 8 to 1, at
    # least 8 of 9 are right, whenever that was: a posterior probability is a martingale.
    limit = 8 / DOUBT  # odds
    rng = np.random.default_rng(2)
    truth = rng.integers(0, 3, 1500)
    seen = rng.normal(size=(1500, 20, 3)) + 0.5 * np.eye(3)[truth][:, None]
    p = np.exp(0.5 * seen) / np.exp(0.5 * seen).sum(axis=-1, keepdims=True)
    tracks = [fused(one, decide(one, ACCEPT)[0], accept=(limit / (1 + limit),) * 3, correlation=0) for one in p]
    declared = np.array([track.declared_after > 0 for track in tracks])
    right = np.array([track.declared == CLASSES[index] for track, index in zip(tracks, truth, strict=True)])[declared]
    assert declared.mean() > 0.5
    assert right.mean() > 8 / 9 - 4 * np.sqrt(8 / 81 / len(right))
    assert right.mean() < 0.95  # it declares as soon as it may, not later


def mean_log(p):
    return np.log(np.maximum(p, 1e-6).astype(float)).mean(axis=0)


@given(dwells(least=30, most=30), dwells(least=15, most=15), dwells(least=6, most=6), dwells(least=2, most=2))
def test_longer_looks_count_by_their_weight_from_when_they_are_there(p, two, five, twelve):
    assume(min(np.ptp(x, axis=1).min() for x in (p, two, five, twelve)) > 1e-5)  # uniform ones say nothing
    looks = {2: two, 5: five, 12: twelve}
    longer = {length: (x, labelled(x)) for length, x in looks.items()}
    for n in (1, 2, 4, 5, 11, 12, 30):
        found = fused(p[:n], labelled(p)[:n], longer=longer).probabilities
        means = {1: mean_log(p[:n])} | {k: mean_log(x[: n // k]) for k, x in looks.items() if n >= k}
        mean = sum(LOOKS[k] * x for k, x in means.items()) / sum(LOOKS[k] for k in means)
        odds = np.exp(n / (1 + (n - 1) * CORRELATION) * (mean - mean.max()))
        assert found == pytest.approx(odds / odds.sum(), abs=1e-5)


@pytest.mark.parametrize("length", [1, 7])
def test_a_length_without_a_weight_is_refused(length):
    p = np.tile(np.float32([0.5, 0.3, 0.2]), (10, 1))
    with pytest.raises(ValueError, match=f"looks at {length} dwells have no weight: their length must be one of 2, 5"):
        fused(p, labelled(p), longer={length: (p, labelled(p))})


def test_looks_count_by_their_duration():
    fitted = weights(FITTED_DWELL_S)
    assert fitted == pytest.approx(LOOKS)
    # five dwells of a fifth of the length are one dwell, and one of five times the length is five
    assert weights(FITTED_DWELL_S / 5)[5] == pytest.approx(LOOKS[1])
    assert weights(5 * FITTED_DWELL_S)[1] == pytest.approx(LOOKS[5])
    between = weights(FITTED_DWELL_S * 2**0.5)
    assert between[1] == pytest.approx((LOOKS[1] + LOOKS[2]) / 2)
    assert between[31] == LOOKS[31]
    p = np.array([[0.7, 0.2, 0.1], [0.6, 0.3, 0.1]])
    looks = np.array([[0.1, 0.8, 0.1]])
    # of no more than the fitted dwell, dwells and looks count alike
    for dwell_s, counts in ((FITTED_DWELL_S / 2, [1, 1]), (0.5, [weights(0.5)[1], weights(0.5)[2]])):
        mean = np.average([np.log(p).mean(axis=0), np.log(looks[0])], axis=0, weights=counts)
        expected = np.exp(2 / (1 + CORRELATION) * mean)
        found = fused(p, labelled(p), longer={2: (looks, labelled(looks))}, dwell_s=dwell_s)
        assert found.probabilities == pytest.approx(expected / expected.sum(), rel=1e-5)


def test_a_silent_longer_look_changes_nothing():
    p = np.tile(np.float32([0.55, 0.25, 0.2]), (5, 1))
    alone = fused(p, labelled(p))
    silent = fused(p, labelled(p), longer={5: (np.full((1, 3), 1 / 3), [UNKNOWN])})
    np.testing.assert_array_equal(alone.probabilities, silent.probabilities)


def test_a_longer_look_at_a_silent_dwell_is_left_out():
    # what is cut into silence shows edges that no target has
    p = np.tile(np.float32([0.55, 0.25, 0.2]), (10, 1))
    p[7] = 1 / 3
    said = np.where(np.arange(10) == 7, UNKNOWN, "uav")
    looks = np.float32([[0.1, 0.8, 0.1], [0.8, 0.1, 0.1]])
    both = fused(p, said, longer={5: (looks, ["bird", "uav"])})
    first = fused(p, said, longer={5: (looks[:1], ["bird"])})
    np.testing.assert_array_equal(both.probabilities, first.probabilities)
    assert first.probabilities[1] > fused(p, said).probabilities[1]


@pytest.mark.parametrize("count", [0, 1, 7])
def test_unknown_when_no_dwell_could_be_judged(count):
    track = fused(np.full((count, 3), 1 / 3), np.full(count, UNKNOWN))
    assert (track.label, track.used) == (UNKNOWN, 0)
    np.testing.assert_array_equal(track.probabilities, np.float32([1 / 3] * 3))
    assert track.reason == "no dwell could be judged"


def test_one_certain_dwell_cannot_rule_a_class_out():
    p = np.float32([[0, 0, 1]] + [[0.9, 0.05, 0.05]] * 20)
    assert fused(p, labelled(p)).label == "uav"


@pytest.mark.parametrize(
    ("p", "labels", "correlation", "message"),
    [
        (np.ones((2, 2)), ["uav"] * 2, 0.5, r"\(2, 2\)"),
        (np.ones((2, 3)), ["uav"], 0.5, r"labels \(1,\)"),
        (np.ones((2, 3)), ["uav"] * 2, 1.5, "correlation is 1.5: it must be in 0 to 1"),
    ],
)
def test_bad_arguments(p, labels, correlation, message):
    with pytest.raises(ValueError, match=message):
        fused(p, labels, correlation=correlation)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dwell_s": -1.0}, "dwell_s is -1"),
        ({"dwell_s": float("nan")}, "dwell_s is nan"),
        ({"shown": ["nothing"]}, "shown holds 'nothing': it may hold comb, wings, heaves, steps"),
        ({"longer": {2: (np.full((1, 3), np.nan), ["uav"])}}, "probabilities of look 0 are not finite"),
        ({"longer": {2: ([[1.5, -0.3, -0.2]], ["uav"])}}, r"probabilities of look 0 are \[ 1\.5 .*: .* sum to 1"),
        ({"longer": {2: ([[0.5, 0.3, 0.3]], ["uav"])}}, "look 0 are .*: they must be 0 or more and sum to 1"),
    ],
)
def test_what_a_track_cannot_be_fused_with_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        fused(np.full((2, 3), [0.8, 0.1, 0.1]), ["uav"] * 2, **options)


def test_reason_shows_that_the_probability_is_below_the_limit():
    labels, reasons = decide(np.array([[0.48, 0.32, 0.2], [0.6199, 0.2, 0.1801], [0.62, 0.2, 0.18]]), (0.62,) * 3)
    assert list(labels) == [UNKNOWN, UNKNOWN, "uav"]
    assert reasons == ["not sure: best uav 0.48 < 0.62", "not sure: best uav 0.6199 < 0.6200", ""]


@pytest.mark.parametrize(
    ("shown", "name", "factor"),
    [
        *(([name], whose, factor) for name, (whose, factor) in ODDS.items()),
        (["wings", "heaves"], "bird", ODDS["wings"][1] * ODDS["heaves"][1]),
    ],
)
def test_what_the_whole_track_shows_multiplies_odds_at_the_end_alone(shown, name, factor):
    # ahead also with its odds divided, which reach the limits with what is found and not without
    p, best = [[0.6 if other == name else 0.2 for other in CLASSES]] * 4, CLASSES.index(name)
    ahead = fused(p, ["unknown"] * 4, accept=(1.0,) * 3, shown=()).probabilities[best]
    between = np.sqrt(max(factor, 1.01)) / DOUBT * ahead / (1 - ahead)
    accept = (between / (1 + between),) * 3
    plain, more = (fused(p, ["unknown"] * 4, accept=accept, shown=found) for found in ((), shown))
    odds = [track.probabilities / (1 - track.probabilities) for track in (plain, more)]
    assert odds[1][best] == pytest.approx(factor * odds[0][best], rel=1e-5)
    others = [k for k in range(3) if k != best]
    ratios = [track.probabilities[others[0]] / track.probabilities[others[1]] for track in (plain, more)]
    assert ratios[1] == pytest.approx(ratios[0], rel=1e-5)
    told = (name, 4) if factor > 1 else ("", 0)  # what the network has said already counts nothing
    assert (plain.declared, more.declared, more.declared_after) == ("", *told)


class Asked:
    """A classifier that is never sure, and what it was asked."""

    decide = staticmethod(lambda p, pulses=None: decide(p, ACCEPT))

    def __init__(self, envelope):
        self.envelope, self.looks = envelope, []

    def predict(self, iq, *, carrier_hz, prf_hz):
        self.looks.append(iq)
        p = np.tile(np.float32([0.4, 0.3, 0.3]), (len(iq), 1))
        return Prediction(decide(p, ACCEPT)[0], p, np.full(len(iq), ""), np.zeros(len(iq)))


def recorded(pulses):
    """Noise at a PRF of 4 kHz."""
    return Recording("x", np.random.default_rng(3).normal(size=(pulses, 2)).view(complex)[:, 0], 10e9, 4e3)


@pytest.mark.parametrize(("count", "lengths"), [(1, [1]), (2, [1, 2]), (13, [1, 2, 5, 12]), (31, [1, 2, 5, 12, 31])])
def test_as_many_looks_of_each_length_as_the_recording_holds(count, lengths):
    asked = Asked(Envelope())
    recording = recorded(count * 80 + 30)
    given = answer(recording, asked, dwell_s=0.02)
    assert [looks.shape for looks in asked.looks] == [(count // length, length * 80) for length in lengths]
    for looks in asked.looks:  # they begin with the recording and follow one another
        np.testing.assert_array_equal(looks.ravel(), recording.iq[: looks.size])
    assert given.track.used == count


def test_looks_of_a_recording_count_by_their_duration(monkeypatch):
    given = []
    monkeypatch.setattr(predict, "fuse", lambda *p, dwell_s, **more: given.append(dwell_s) or fuse(*p, **more))
    for dwell_s in (0.02, 0.25, 5.0):
        answer(recorded(4000), Asked(Envelope()), dwell_s=dwell_s)
    assert given == pytest.approx([0.02, 0.25, 1.0])  # a recording shorter than a dwell is one


def test_what_only_a_long_look_shows_is_sought_in_the_first_five_seconds(monkeypatch):
    sought = []
    monkeypatch.setattr(predict, "long_look", lambda iq, *_: sought.append(iq) or {})
    answer(recorded(28_000), Asked(Envelope()))
    np.testing.assert_array_equal(sought, [recorded(28_000).iq[:20_000]])


@pytest.mark.parametrize(("velocity_mps", "rate_hz", "steps"), [(-1.6, 3.2, True), (7.0, 5.0, False)])
def test_a_body_that_goes_to_and_fro_is_reported_and_counts(velocity_mps, rate_hz, steps, capsys):
    time_s = np.arange(10_000) / 4e3
    path = velocity_mps * time_s + 6e-3 * np.sin(2 * np.pi * rate_hz * time_s)
    noise = np.random.default_rng(4).normal(scale=0.2, size=(10_000, 2)).view(complex)[:, 0]
    recording = Recording("x", np.exp(-4j * np.pi * 10e9 / 299_792_458 * path) + noise, 10e9, 4e3)
    given = answer(recording, Asked(Envelope()))
    name = "steps" if steps else "heaves"
    assert given.shown == {name: pytest.approx(rate_hz, abs=0.05)}
    closing = list(given.json_objects())[-1]["track"]
    assert (closing["heave_hz"], closing["steps"]) == (round(given.shown[name], 3), steps)
    _, bird, clutter = given.track.probabilities  # alike in every look
    given.print(Console())
    said = capsys.readouterr().out
    what, whose = ("sways as a walker's", "clutter") if steps else ("heaves as a bird's", "a bird")
    odds = ODDS[name][1]
    assert f"body {what} at {rate_hz} Hz: the odds of {whose} are multiplied by {odds:g}" in said
    assert (clutter / bird if steps else bird / clutter) == pytest.approx(odds, rel=1e-5)


def test_a_comb_that_stays_is_reported_and_counts(capsys):
    uav = AIRFRAMES["type1"].fields | {"name": "drone", "velocity_mps": 12.0}
    radar = {"carrier_hz": 9.85e9, "prf_hz": 25e3, "pulses": 25_000}
    iq = Scene.build({"radar": radar, "uav": [uav]}).render(3).iq
    given = answer(Recording("x", iq, radar["carrier_hz"], radar["prf_hz"]), Asked(Envelope()))
    truth_hz = 2 * uav["rotors"][0]["rotation_hz"]
    assert given.shown == {"comb": pytest.approx(truth_hz, rel=0.001)}
    assert list(given.json_objects())[-1]["track"]["comb_hz"] == round(given.shown["comb"], 3)
    uav, bird, _ = given.track.probabilities
    factor = (0.4 / 0.3) ** (given.track.used / (1 + (given.track.used - 1) * CORRELATION))
    assert uav / bird == pytest.approx(factor * ODDS["comb"][1], rel=1e-4)
    given.print(Console())
    assert f"Hz stays: the odds of a UAV are multiplied by {ODDS['comb'][1]:g}" in capsys.readouterr().out


def test_a_flapping_bird_shows_its_wingbeat_in_the_track_and_a_short_one_none():
    radar = Radar(9.85e9, 10e3, 25_000)
    records = draw_records(radar, 12, 3, purpose="bench", kind="flapping_bird")
    clear = np.flatnonzero(records.truth["snr_db"] > 5)
    found = [
        (answer(Recording("x", records.iq[row], radar.carrier_hz, radar.prf_hz), Classifier.load()), row)
        for row in clear
    ]
    beats = [(one.shown["wings"], records.truth["wingbeat_hz"][row]) for one, row in found if "wings" in one.shown]
    assert beats
    for beat_hz, truth_hz in beats:
        assert beat_hz == pytest.approx(truth_hz, abs=0.3)
    short = Recording("x", records.iq[clear[0]][:8000], radar.carrier_hz, radar.prf_hz)
    assert "wings" not in answer(short, Classifier.load()).shown


def test_frames_with_gaps_between_them_make_a_track():
    """As an FMCW radar sends chirps: 13 ms of them every 50 ms."""
    uav = AIRFRAMES["type1"].fields | {"name": "drone", "velocity_mps": 12.0}
    radar = {"carrier_hz": 9.85e9, "prf_hz": 20e3, "pulses": 20_000}
    drone, nothing = (Scene.build({"radar": radar, **parts}).render(3).iq for parts in ({"uav": [uav]}, {}))
    clf = Classifier.load()
    for iq, label in ((drone, "uav"), (nothing, "clutter")):
        frames = iq.reshape(-1, 1000)[:, :256]
        p = clf.predict(frames, carrier_hz=9.85e9, prf_hz=20e3)
        track = bladewing.classify.fuse(p.probabilities, p.labels, rule=clf.decide, dwell_s=frames.shape[1] / 20e3)
        assert (track.label, track.declared, track.used) == (label, label, len(frames))
        assert track.probabilities.max() > p.probabilities.mean(axis=0).max()


def test_dwells_that_are_refused_alike_share_a_line_and_those_between_them_have_their_own(capsys):
    reasons = np.array(["no signal", "no signal", "", "no signal", "not sure", "not sure", "not sure"])
    p = np.tile(np.float32([0.4, 0.3, 0.3]), (7, 1))
    p[5:] = 0.5, 0.3, 0.2  # refused alike, but not as sure of it
    labels = np.where(reasons == "", "uav", "unknown")
    ends_s = np.arange(8) / 10
    dwells = Prediction(labels, p, reasons, np.zeros(7))
    Answer("x", ends_s[:-1], ends_s[1:], dwells, fuse(p, labels, rule=partial(decide, accept=ACCEPT))).print(Console())
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[2:7]]
    assert [row[:3] + row[6:] for row in rows] == [
        ["0.000", "0.200", "unknown", "2", "dwells:", "no", "signal"],
        ["0.200", "0.300", "uav"],
        ["0.300", "0.400", "unknown", "no", "signal"],
        ["0.400", "0.500", "unknown", "not", "sure"],
        ["0.500", "0.700", "unknown", "2", "dwells:", "not", "sure"],
    ]


def answered(track, start_s=0.0):
    """Two dwells of half a second that say UAV, and a track of them."""
    start_s = start_s + np.array([0.0, 0.5])
    dwells = Prediction(np.array(["uav"] * 2), np.tile([0.8, 0.1, 0.1], (2, 1)), np.full(2, ""), np.zeros(2))
    return Answer("x", start_s, start_s + 0.5, dwells, track)


@pytest.mark.parametrize("label", ["uav", "clutter", "unknown"])
def test_a_label_that_is_not_what_was_declared_is_not_left_without_a_word(label, capsys):
    answered(Track(label, np.array([0.8, 0.1, 0.1]), "", 2, "uav", 1)).print(Console())
    said = capsys.readouterr().out
    assert "declared uav after 0.5 s" in said
    assert ("do not bear out" in said) == (label != "uav")


@pytest.mark.parametrize("after", [1, 2])
def test_a_declaration_is_timed_from_the_beginning_of_a_recording_that_goes_on_from_another(after):
    track = Track("uav", np.array([0.8, 0.1, 0.1]), "", 2, "uav", after)
    assert answered(track, start_s=100.0).declared_s == 0.5 * after


def test_a_recording_outside_the_envelope_is_refused_before_its_dwells_are_read(monkeypatch):
    def read(*_):
        raise AssertionError("dwells were read")

    monkeypatch.setattr("bladewing.classify.inference.mended", read)
    recording = Recording("x", np.ones(40_000, np.complex64), 9.85e9, 250.0)
    given = answer(recording, Classifier.load(), dwell_s=0.008)
    assert len(given.dwells.reasons) == 20_000
    assert set(given.dwells.reasons) == {given.dwells.reasons[0]}
    assert "raise the PRF to 1315 Hz or more" in given.dwells.reasons[0]
    assert given.dwells.reasons.strides == (0,)  # one text for all of them, however many


def test_a_model_is_loaded_before_it_is_asked():
    with pytest.raises(BadInput, match=r"classifier is 'fast': .*Classifier\.load\('fast'\)"):
        answer(Recording("x", np.ones(400, np.complex64), 9.85e9, 25e3), "fast")


def test_dwells_of_milliseconds_are_refused_in_python_as_on_the_command_line(uav_model):
    recording, classifier = recorded(40_000), Classifier.load(uav_model)
    p = np.float32([[0.8, 0.1, 0.1]])
    for ask in (
        recording.dwells,
        lambda dwell_s: answer(recording, classifier, dwell_s=dwell_s),
        lambda dwell_s: fused(p, ["uav"], dwell_s=dwell_s),
    ):
        with pytest.raises(BadInput, match=r"^dwell_s is 80: it must be at most 5 \[s\]: 80 ms are 0\.08$"):
            ask(80)


def test_the_longest_dwell_may_be_a_part_of_a_pulse_longer(uav_model):
    """5 s at 1000.7 Hz are 5003.5 pulses, and dwells are of whole ones: 5004."""
    recording = Recording("x", np.ones(6000, np.complex64), 3e9, 1000.7)
    assert answer(recording, Classifier.load(uav_model), dwell_s=5.0).stop_s[0] > 5.0


def test_a_recording_whose_prf_is_plainly_in_kilohertz_is_refused_as_measure_does(uav_model):
    recording = Recording("x", np.ones(2000, np.complex64), 9.85e9, 25.0)
    with pytest.raises(BadInput, match=r"^x: PRF 25 Hz is below 1000 Hz: give 25 kHz as 25e3$"):
        answer(recording, Classifier.load(uav_model))


def test_a_track_says_how_many_of_its_dwells_were_named(capsys):
    p = np.float32([[0.9, 0.05, 0.05], [0.1, 0.8, 0.1], [0.5, 0.3, 0.2], [1 / 3] * 3])
    labels, reasons = np.array(["uav", "bird", UNKNOWN, UNKNOWN]), np.array(["", "", "not sure", "no signal"])
    track = fused(p, labels)
    given = Answer("x", np.arange(4.0), np.arange(1.0, 5.0), Prediction(labels, p, reasons, np.zeros(4)), track)
    given.print(Console(width=200))
    assert "from 4 dwells: 2 named, 1 unsure, 1 not judged" in capsys.readouterr().out
    *_, closing = given.json_objects()
    assert closing["track"]["reason"] == track.reason != ""
    assert (closing["track"]["dwells"], closing["track"]["used"]) == (4, 3)


@pytest.mark.parametrize("given", [(["uav"], [[0.8, 0.1, 0.1]]), ([0.8, 0.1, 0.1], ["uav"]), ([[0.8, 0.2]], ["uav"])])
def test_labels_in_the_place_of_probabilities_are_told_as_such(given):
    said = r"^probabilities (\S+ )*must be numbers of shape \(dwells, 3\): labels come second$"
    with pytest.raises(BadInput, match=said):
        fused(*given)


def test_labels_of_other_dwells_are_refused():
    with pytest.raises(BadInput, match=r"^labels \(2,\) must have shape \(1,\), one for each dwell$"):
        fused([[0.8, 0.1, 0.1]], ["uav", "uav"])


def test_a_track_of_few_pulses_is_named_by_the_thresholds_of_as_many():
    """By those of all lengths 82 to 89 in 100 of its birds and 81 to 88 of its clutter were right, not nine in ten."""
    classifier, radar = Classifier.load(), {"carrier_hz": 24e9, "prf_hz": 16e3}  # at which all pulses count
    for dwells, pulses in ((3, 600), (3, 1500)):
        iq = draw_records(Radar(**radar, pulses=pulses), 60, seed=1).iq
        each = pulses // dwells / radar["prf_hz"]
        tracks = [answer(Recording("short", one, **radar), classifier, dwell_s=each).track for one in iq]
        said = np.stack([track.probabilities for track in tracks])
        by_pulses, by_all = (classifier.decide(said, given)[0] for given in (pulses, None))
        assert (by_pulses != by_all).any()
        np.testing.assert_array_equal([t.label for t in tracks], by_pulses if pulses == 600 else by_all)


def test_a_recording_of_one_dwell_is_named_by_the_thresholds_of_its_pulses():
    classifier, radar = Classifier.load(), {"carrier_hz": 9.85e9, "prf_hz": 25e3}
    pulses = 160
    iq = draw_records(Radar(**radar, pulses=pulses), 60, seed=1).iq
    alone = classifier.predict(iq, **radar)
    sure, _ = classifier.decide(alone.probabilities)
    assert (sure != alone.labels).any()  # as a track of many dwells some would be named
    for record, label, reason in zip(iq, alone.labels, alone.reasons, strict=True):
        track = answer(Recording("short", record, **radar), classifier).track
        assert (track.label, track.reason) == (label, reason)
    silent = np.concatenate([iq[sure != alone.labels][0], np.zeros(pulses)]).astype(np.complex64)
    given = answer(Recording("half", silent, **radar), classifier, dwell_s=pulses / radar["prf_hz"])
    assert (given.track.label, given.track.used) == (given.dwells.labels[0], 1)
