"""A model by its place on the front, or by a budget of time."""

import json
from importlib import resources

import numpy as np
import pytest
from bladewing.classify import BadInput, Classifier, ladder, model_file
from bladewing.classify.cli import main
from bladewing.classify.ladder import COST_KEY, by_budget, by_place, front
from bladewing.classify.model_file import model_names
from bladewing.models import TEACHER


def account(**models: tuple[float, float]) -> dict:
    return {
        name: {"cost_ffts": cost, "test": {"balanced_accuracy": accuracy}} for name, (cost, accuracy) in models.items()
    }


LADDER = account(tiny=(5, 0.5), worse=(9, 0.45), small=(10, 0.6), middle=(19, 0.7), dear=(50, 0.7), great=(80, 0.8))


def test_only_models_that_no_other_beats_stand_on_the_front():
    assert front(LADDER) == [("tiny", 5), ("small", 10), ("middle", 19), ("great", 80)]


def test_places():
    # balanced: at least half way from 0.5 to 0.8
    assert [by_place(place, LADDER) for place in ladder.PLACES] == ["tiny", "middle", "great"]
    assert {by_place(place, account(only=(3, 0.4))) for place in ladder.PLACES} == {"only"}


@pytest.mark.parametrize(("budget_us", "name"), [(10, "tiny"), (38, "middle"), (37.9, "small"), (1e6, "great")])
def test_a_budget_buys_the_most_accurate_model_within_it(budget_us, name):
    assert by_budget(budget_us, LADDER, fft_us=2.0) == name


def test_a_budget_that_buys_nothing_names_the_cheapest():
    with pytest.raises(BadInput, match=r"budget 9\.9 us: the cheapest model, tiny, takes 10 us here"):
        by_budget(9.9, LADDER, fft_us=2.0)


@pytest.mark.parametrize("fft_us", [2.07, 2.0, 6.04])
def test_what_a_refused_budget_asks_for_buys_the_cheapest_even_if_it_is_a_little_slower_then(fft_us):
    with pytest.raises(BadInput) as said:
        by_budget(0.1, LADDER, fft_us=fft_us)
    allowed = float(str(said.value).rsplit(maxsplit=1)[-1])
    assert by_budget(allowed, LADDER, fft_us=1.04 * fft_us) == "tiny"


def test_models_without_costs_are_refused_by_one_line():
    with pytest.raises(BadInput, match="holds no 'cost_ffts': name a model"):
        by_place("fast", {"old": {"test": {"balanced_accuracy": 0.5}}})


def test_the_classifier_loads_by_place_and_by_budget(monkeypatch):
    shipped = account(**{"spectrum-cnn-fast": (40, 0.5), "spectrum-cnn": (50, 0.7)})
    monkeypatch.setattr(model_file, "shipped_account", lambda: shipped)
    monkeypatch.setattr(model_file, "measured_fft_us", lambda: 2.0)
    assert Classifier.load("fast").name == "spectrum-cnn-fast"
    assert Classifier.load("best").name == "spectrum-cnn"
    assert Classifier.load(budget_us=99).name == "spectrum-cnn-fast"
    assert Classifier.load(budget_us=100).name == "spectrum-cnn"
    for wrong, rule in [({"budget_us": -1}, "budget_us is -1"), ({"name_or_path": "fast", "budget_us": 9}, "one of")]:
        with pytest.raises(BadInput, match=rule):
            Classifier.load(**wrong)


def test_predict_says_what_a_budget_buys(monkeypatch, sigmf_pair, capsys):
    monkeypatch.setattr(model_file, "measured_fft_us", lambda: 1.0)
    account = ladder.shipped_account()
    fast = by_place("fast", account)
    for enough, name in ((int(account[fast][COST_KEY]) + 1, fast), (1000, by_place("best", account))):
        assert main(["predict", str(sigmf_pair()), "--budget-us", str(enough)]) == 0
        said = f"bladewing: note: the budget of {enough} us buys the model {name} now: name it for the same answers"
        assert capsys.readouterr().err == f"{said} again\n"


def test_the_bare_fft_has_a_time():
    assert np.isfinite(ladder.measured_fft_us())
    assert ladder.measured_fft_us() > 0


def test_every_place_of_the_shipped_ladder_loads():
    loaded = [Classifier.load(place).metadata for place in ladder.PLACES]
    assert {said["product"] for said in loaded} == {"bladewing"}
    # as README says
    assert [said["name"] for said in loaded] == ["spectrum-cnn-fast", "spectrum-cnn", "spectrum-cnn-wide"]


def test_the_package_holds_what_is_on_the_front_and_nothing_else():
    folder = resources.files("bladewing.models.pretrained")
    told = json.loads(folder.joinpath("train.json").read_text(encoding="utf-8"))
    on_front = {name for name, _ in front(told["models"])} | set(told[ladder.CASCADE][ladder.STAGES_KEY])
    assert set(model_names()) == on_front
    assert TEACHER in told["models"]
    assert TEACHER not in on_front
    assert set(ladder.shipped_account()) == on_front | {ladder.CASCADE}
    assert sum(len(folder.joinpath(f"{name}.onnx").read_bytes()) for name in model_names()) <= 1_000_000
