"""The fit of the fusion's table, on made-up tracks whose right answer is known."""

import numpy as np
import pytest
from bladewing.classify import fusion

from ..benchmarks.fusion_fit import LENGTHS, WHOLE, Model, checked, written

COUNT = 1500
TELLING = 5  # the length of the looks that alone tell anything


@pytest.fixture(scope="module")
def tracks():
    rng = np.random.default_rng(8)
    label = rng.integers(0, 3, COUNT)
    own = rng.normal(size=(COUNT, 1, 3))  # what all looks at a target share, right or wrong
    out = {"label": label}
    for length in LENGTHS:
        count = WHOLE // length
        seen = 0.6 * (np.eye(3)[label][:, None] + own if length == TELLING else 2 * own)
        logs = seen + 0.6 * rng.normal(size=(COUNT, count, 3))
        p = np.exp(logs)
        out[f"p{length}"] = (p / p.sum(axis=-1, keepdims=True)).astype(np.float32)
        out[f"label{length}"] = np.full((COUNT, count), "uav")
    out["comb"] = rng.random(COUNT) < np.where(label == 0, 0.2, 0.01)
    out["wings"] = rng.random(COUNT) < np.where(label == 1, 0.6, 0.06)
    out["heaves"] = rng.random(COUNT) < 0.3
    out["steps"] = rng.random(COUNT) < np.where(label == 2, 0.4, 0.1)
    return out


def test_the_fit_finds_what_tells(tracks):
    model = Model().fit(tracks)
    correlation, weights, odds = model.read(model.values)
    assert 0.3 < correlation < 1
    assert max(weights, key=weights.get) == TELLING
    assert weights[TELLING] > 3 * sum(weight for length, weight in weights.items() if length != TELLING)
    # likelihood ratios of a find are 20, 10, 1 and 4; the one of no information takes up what missing wings would say
    assert odds["comb"] == pytest.approx(20, rel=0.35)
    assert odds["wings"] == pytest.approx(10, rel=0.35)
    assert odds["steps"] == pytest.approx(4, rel=0.35)
    assert 0.5 < odds["heaves"] < 1.2


def test_the_fit_computes_what_the_product_does(tracks):
    checked(tracks)


def test_what_is_written_is_python_and_holds_the_values(tracks):
    model = Model().fit(tracks)
    correlation, weights, odds = model.read(model.values)
    table: dict = {}
    exec(written(model, "a model", tracks), table)
    assert table["CORRELATION"] == pytest.approx(correlation, abs=0.005)
    assert table["LOOKS"] == pytest.approx(weights, abs=0.005)
    assert {name: factor for name, (_, factor) in table["ODDS"].items()} == pytest.approx(odds, abs=0.05)
    assert {name: whose for name, (whose, _) in table["ODDS"].items()} == {k: v[0] for k, v in fusion.ODDS.items()}
    assert {name for name in table if name.isupper()} == {name for name in vars(fusion) if name.isupper()}
