import numpy as np
import pytest
from bladewing.classify import Classifier
from bladewing.classify.labels import CLASSES, UNKNOWN, decide
from bladewing.classify.predict import answer
from bladewing.classify.recording import Recording
from bladewing.classify.track import CORRELATION, LONGER, WING_ODDS, fuse
from bladewing.simulate import Radar, draw_records
from hypothesis import assume, given
from hypothesis import strategies as st

ACCEPT = (0.6, 0.6, 0.6)


@st.composite
def dwells(draw, least=1, most=12):
    """Probabilities (n, 3), each row a distribution."""
    rows = draw(st.lists(st.tuples(*[st.floats(0.001, 1)] * 3), min_size=least, max_size=most))
    p = np.array(rows)
    return (p / p.sum(axis=1, keepdims=True)).astype(np.float32)


def labelled(p):
    return decide(p, ACCEPT)[0]


@given(dwells(), st.randoms(use_true_random=False))
def test_order_does_not_matter(p, random):
    order = list(range(len(p)))
    random.shuffle(order)
    one, other = fuse(p, labelled(p), accept=ACCEPT), fuse(p[order], labelled(p)[order], accept=ACCEPT)
    np.testing.assert_allclose(one.probabilities, other.probabilities, atol=1e-6)


@given(dwells(most=1))
def test_one_dwell_is_left_as_it_is(p):
    assume(np.ptp(p) > 1e-3)  # a uniform one says nothing: see below
    track = fuse(p, labelled(p), accept=ACCEPT)
    np.testing.assert_array_equal(track.probabilities, p[0])
    assert track.label == labelled(p)[0]
    assert track.used == 1


@given(dwells(most=1), st.integers(2, 50), st.floats(0, 0.9))
def test_agreement_sharpens(p, count, correlation):
    best = int(np.argmax(p[0]))
    assume(p[0, best] - np.sort(p[0])[1] > 0.01)
    many = np.repeat(p, count, axis=0)
    fused = fuse(many, labelled(many), accept=ACCEPT, correlation=correlation).probabilities
    more = fuse(np.repeat(p, count + 1, axis=0), labelled(np.repeat(p, count + 1, axis=0)), accept=ACCEPT,
                correlation=correlation).probabilities  # fmt: skip
    assert fused[best] > p[0, best] or p[0, best] > 0.9999
    assert more[best] >= fused[best] - 1e-6


@given(dwells(), st.floats(0, 1))
def test_a_track_is_a_distribution(p, correlation):
    track = fuse(p, labelled(p), accept=ACCEPT, correlation=correlation)
    assert track.probabilities.dtype == np.float32
    assert np.all(track.probabilities >= 0)
    assert track.probabilities.sum() == pytest.approx(1, abs=1e-5)
    assert track.label in (*CLASSES, UNKNOWN)
    assert (track.label == UNKNOWN) == bool(track.reason)


@given(dwells(), st.integers(1, 20))
def test_dwells_outside_the_envelope_change_nothing(p, count):
    silent = np.full((count, 3), 1 / 3, dtype=np.float32)
    labels = np.concatenate([labelled(p), np.full(count, UNKNOWN)])
    alone, mixed = fuse(p, labelled(p), accept=ACCEPT), fuse(np.concatenate([p, silent]), labels, accept=ACCEPT)
    np.testing.assert_array_equal(alone.probabilities, mixed.probabilities)
    assert (alone.label, alone.used) == (mixed.label, mixed.used)


def test_independent_evidence_multiplies_and_full_correlation_counts_once():
    p = np.array([[0.5, 0.3, 0.2], [0.6, 0.2, 0.2]])
    product = p[0] * p[1] / np.sum(p[0] * p[1])
    np.testing.assert_allclose(fuse(p, labelled(p), correlation=0).probabilities, product, rtol=1e-6)
    twice = p[[0, 0]]
    np.testing.assert_allclose(fuse(twice, labelled(twice), correlation=1).probabilities, p[0], rtol=1e-6)


def test_correlated_dwells_are_never_worth_more_than_the_limit():
    # 1 / 0.25 = 4 dwells: odds of 2 to 1 grow to at most 2^4 to 1, however long the track.
    p = np.tile([0.5, 0.25, 0.25], (10_000, 1))
    uav, bird, _ = fuse(p, labelled(p), correlation=0.25).probabilities
    assert uav / bird == pytest.approx(2**4, rel=1e-2)


def test_dwells_that_are_not_sure_add_up_to_an_answer():
    p = np.tile(np.float32([0.55, 0.25, 0.20]), (5, 1))
    assert set(labelled(p)) == {UNKNOWN}
    assert fuse(p, labelled(p), accept=ACCEPT).label == "uav"


def test_contradiction_is_unknown():
    p = np.float32([[0.9, 0.05, 0.05], [0.05, 0.9, 0.05]])
    track = fuse(p, labelled(p), accept=ACCEPT)
    assert track.label == UNKNOWN
    assert track.reason.startswith("not sure: best ")


@given(dwells(), st.floats(0, 1))
def test_declared_at_the_first_dwell_that_names_a_class_at_half_the_odds(p, correlation):
    track = fuse(p, labelled(p), accept=ACCEPT, correlation=correlation)
    safe = []
    for n in range(1, len(p) + 1):
        so_far = fuse(p[:n], labelled(p)[:n], accept=ACCEPT, correlation=correlation)
        best = float(so_far.probabilities.max())
        needed = 0.6 / 0.4 * 2  # odds
        assume(abs(best / (1 - best) / needed - 1) > 1e-4)  # float32 cannot tell
        if best / (1 - best) > needed:
            safe.append((CLASSES[int(so_far.probabilities.argmax())], n))
    assert (track.declared, track.declared_after) == (safe[0] if safe else ("", 0))


def test_a_declaration_stands_though_later_dwells_disagree():
    p = np.float32([[0.9, 0.05, 0.05]] + [[0.05, 0.05, 0.9]] * 9)
    track = fuse(p, labelled(p), accept=ACCEPT)
    assert (track.declared, track.declared_after, track.label) == ("uav", 1, "clutter")


def test_silent_dwells_take_their_time_before_a_declaration():
    p = np.float32([[1 / 3] * 3] * 3 + [[0.9, 0.05, 0.05]])
    track = fuse(p, [UNKNOWN] * 3 + ["uav"], accept=ACCEPT)
    assert (track.declared, track.declared_after, track.used) == ("uav", 4, 1)


def test_stopping_early_keeps_what_calibrated_probabilities_promise():
    # Independent dwells of known densities: the fused probability is the true posterior. Declared at odds of 8 to 1, at
    # least 8 of 9 are right, whenever that was: a posterior probability is a martingale.
    rng = np.random.default_rng(2)
    truth = rng.integers(0, 3, 1500)
    seen = rng.normal(size=(1500, 20, 3)) + 0.5 * np.eye(3)[truth][:, None]
    p = np.exp(0.5 * seen) / np.exp(0.5 * seen).sum(axis=-1, keepdims=True)
    tracks = [fuse(one, decide(one, ACCEPT)[0], accept=(0.8,) * 3, correlation=0) for one in p]
    declared = np.array([track.declared_after > 0 for track in tracks])
    right = np.array([track.declared == CLASSES[index] for track, index in zip(tracks, truth, strict=True)])[declared]
    assert declared.mean() > 0.5
    assert right.mean() > 8 / 9 - 4 * np.sqrt(8 / 81 / len(right))
    assert right.mean() < 0.95  # it declares as soon as it may, not later


@given(dwells(least=2 * LONGER, most=3 * LONGER), dwells(least=1, most=3))
def test_a_longer_look_counts_from_when_it_is_there(p, looks):
    longer = looks, labelled(looks)
    for n in (LONGER - 1, LONGER, 2 * LONGER):
        given_looks = fuse(p[:n], labelled(p)[:n], longer=longer, accept=ACCEPT).probabilities
        known = looks[: n // LONGER]
        mean = np.log(p[:n].astype(float)).mean(axis=0)
        if len(known):
            mean = (mean + np.log(np.maximum(known, 1e-6).astype(float)).mean(axis=0)) / 2
        odds = np.exp(n / (1 + (n - 1) * CORRELATION) * (mean - mean.max()))
        silent = np.ptp(np.concatenate([p[:n], known]), axis=1).min() < 1e-5
        assert silent or given_looks == pytest.approx(odds / odds.sum(), abs=1e-5)


def test_a_silent_longer_look_changes_nothing():
    p = np.tile(np.float32([0.55, 0.25, 0.2]), (LONGER, 1))
    alone = fuse(p, labelled(p), accept=ACCEPT)
    silent = fuse(p, labelled(p), longer=(np.full((1, 3), 1 / 3), [UNKNOWN]), accept=ACCEPT)
    np.testing.assert_array_equal(alone.probabilities, silent.probabilities)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_unknown_when_no_dwell_could_be_judged(count):
    track = fuse(np.full((count, 3), 1 / 3), np.full(count, UNKNOWN), accept=ACCEPT)
    assert (track.label, track.used) == (UNKNOWN, 0)
    np.testing.assert_array_equal(track.probabilities, np.float32([1 / 3] * 3))
    assert track.reason == "no dwell could be judged"


def test_one_certain_dwell_cannot_rule_a_class_out():
    p = np.float32([[0, 0, 1]] + [[0.9, 0.05, 0.05]] * 20)
    assert fuse(p, labelled(p), accept=ACCEPT).label == "uav"


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
        fuse(p, labels, correlation=correlation)


def test_reason_shows_that_the_probability_is_below_the_limit():
    labels, reasons = decide(np.array([[0.48, 0.32, 0.2], [0.6199, 0.2, 0.1801], [0.62, 0.2, 0.18]]), (0.62,) * 3)
    assert list(labels) == [UNKNOWN, UNKNOWN, "uav"]
    assert reasons == ["not sure: best uav 0.48 < 0.62", "not sure: best uav 0.6199 < 0.6200", ""]


def test_a_wingbeat_multiplies_the_odds_of_a_bird_at_the_end_alone():
    p = [[0.5, 0.3, 0.2]] * 4
    plain, winged = fuse(p, ["unknown"] * 4), fuse(p, ["unknown"] * 4, wings=True)
    odds = [track.probabilities / (1 - track.probabilities) for track in (plain, winged)]
    assert odds[1][1] == pytest.approx(WING_ODDS * odds[0][1], rel=1e-5)
    assert winged.probabilities[0] / winged.probabilities[2] == pytest.approx(
        plain.probabilities[0] / plain.probabilities[2], rel=1e-5
    )
    assert winged.label == "bird"


def test_a_flapping_bird_shows_its_wingbeat_in_the_track_and_a_short_one_none():
    radar = Radar(9.85e9, 10e3, 25_000)
    records = draw_records(radar, 12, 3, purpose="bench", kind="flapping_bird")
    clear = np.flatnonzero(records.truth["snr_db"] > 5)
    found = [
        (answer(Recording("x", records.iq[row], radar.carrier_hz, radar.prf_hz), Classifier.load()), row)
        for row in clear
    ]
    beats = [(one.wingbeat_hz, records.truth["wingbeat_hz"][row]) for one, row in found if one.wingbeat_hz is not None]
    assert beats
    for beat_hz, truth_hz in beats:
        assert beat_hz == pytest.approx(truth_hz, abs=0.3)
    short = Recording("x", records.iq[clear[0]][:8000], radar.carrier_hz, radar.prf_hz)
    assert answer(short, Classifier.load()).wingbeat_hz is None
