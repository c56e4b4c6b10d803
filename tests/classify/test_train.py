import json

import numpy as np
import pytest
from bladewing.classify import Classifier
from bladewing.classify.errors import BadInput
from bladewing.classify.inference import COVERAGES
from bladewing.classify.train import _figures, run_training
from bladewing.classify.training_config import TrainingConfig, training_config
from bladewing.simulate import Radar, draw_records


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    out = tmp_path_factory.mktemp("trained")
    config = out / "tiny.toml"
    config.write_text("records = 2400\nepochs = 5\nbatch = 64\niterations = 20\n")
    return out, run_training(out, config=config, progress=False)


def test_training_writes_every_model_and_its_account(trained):
    out, account = trained
    assert {path.stem for path in out.glob("*.onnx")} == set(TrainingConfig().models) == set(account["models"])
    assert json.loads((out / "train.json").read_text()) == account
    for name, model in account["models"].items():
        assert model["bytes"] == (out / f"{name}.onnx").stat().st_size
        # chance is 1/3; even this little training is far from it (600 test records: 0.019 standard error)
        assert model["test"]["balanced_accuracy"] > 0.42, name
    assert not list(out.glob(".bladewing*"))


@pytest.mark.parametrize("name", TrainingConfig().models)
def test_trained_models_answer_through_the_classifier(trained, name):
    out, account = trained
    clf = Classifier.load(out / f"{name}.onnx")
    assert json.loads(clf.metadata["training"])["records"] == 2400
    assert list(clf.accept) == account["models"][name]["accept"]
    assert account["models"][name]["cost_ffts"] > 1
    chosen = Classifier.load(out / f"{name}.onnx", max_false_alarm=0.1)  # 600 calibration records hold 400 others
    assert chosen.operating_point.false_alarm == 0.1
    assert chosen.accept[1:] == clf.accept[1:]
    sets = json.loads(clf.metadata["prediction_sets"])
    assert [row[0] for row in sets] == list(COVERAGES)
    assert all(0 < limit < 1 for row in sets for limit in row[1:])  # 200 calibration records of a class hold 0.99
    assert Classifier.load(out / f"{name}.onnx", coverage=0.9).coverage == 0.9
    covered = account["models"][name]["test"]["coverage"]
    for wanted, share in zip(COVERAGES, covered, strict=True):
        # 200 records of a class on either side
        assert abs(share - wanted) < 5 * np.sqrt(wanted * (1 - wanted) * 2 / 600) + 1 / 200
    radar = Radar(9.85e9, 25e3, 2000)
    loud = draw_records(radar, 90, 0, purpose="test", kind="quadcopter")
    answer = clf.predict(loud.iq[loud.truth["snr_db"] > 5], carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    noise = draw_records(radar, 40, 0, purpose="test", kind="noise")
    other = clf.predict(noise.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    np.testing.assert_allclose(answer.probabilities.sum(axis=-1), 1, atol=1e-5)
    assert answer.probabilities[:, 0].mean() > other.probabilities[:, 0].mean() + 0.1


def test_an_interrupted_training_leaves_the_old_files(trained, tmp_path, monkeypatch):
    for name in ("features-linear.onnx", "train.json"):
        (tmp_path / name).write_bytes(b"old")
    from bladewing.models import tabular

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(tabular, "train_boosted", interrupted)
    config = tmp_path / "tiny.toml"
    config.write_text('records = 600\nmodels = ["features-linear", "features-boosted"]\n')
    with pytest.raises(KeyboardInterrupt):
        run_training(tmp_path, config=config, progress=False)
    assert (tmp_path / "features-linear.onnx").read_bytes() == b"old"
    assert (tmp_path / "train.json").read_bytes() == b"old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["features-linear.onnx", "tiny.toml", "train.json"]


def test_figures_against_brute_force():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 3, 3000)
    probabilities = rng.dirichlet(np.ones(3), 3000)
    probabilities[np.arange(3000), labels] += 1
    probabilities /= 2
    figures = _figures(probabilities, labels, np.array([0.7, 0.6, 0.5]), 0.01)
    threshold = sorted(probabilities[labels != 0, 0])[int(np.ceil(0.99 * ((labels != 0).sum() - 1)))]
    assert figures["uav_detection"] == pytest.approx(np.mean(probabilities[labels == 0, 0] > threshold), abs=1e-4)
    winner = probabilities.argmax(1)
    named = probabilities.max(1) >= np.array([0.7, 0.6, 0.5])[winner]
    assert figures["named_share"] == pytest.approx(named.mean(), abs=1e-4)
    wrong = [p[0] >= 0.7 and p.argmax() == 0 for p in probabilities[labels != 0]]
    assert figures["false_uav"] == pytest.approx(np.mean(wrong), abs=1e-4)
    assert figures["named_accuracy"] == pytest.approx((winner == labels)[named].mean(), abs=1e-4)


def test_options_come_before_the_file_and_the_file_before_quick(tmp_path):
    file = tmp_path / "run.toml"
    file.write_text("records = 5000\nseed = 3\n")
    assert training_config(file, records=7000).records == 7000
    config = training_config(file, quick=True)
    assert (config.records, config.seed, config.epochs) == (5000, 3, 3)
    assert training_config() == TrainingConfig()


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("epochz = 3", r"unknown field 'epochz': the fields are records, seed"),
        ("epochs = 0", r"epochs is 0: it should be greater than or equal to 1"),
        ('records = "many"', r"records is 'many'"),
        ("precision = 1.5", r"precision is 1.5"),
        ('models = ["magic"]', r"models holds 'magic': it may hold features-linear"),
        ("models = []", r"models is \[\]"),
        ("records = = 3", "not TOML"),
    ],
)
def test_wrong_settings_get_one_line_that_names_them(tmp_path, text, match):
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(BadInput, match=match) as caught:
        training_config(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


def test_a_missing_settings_file_is_named(tmp_path):
    with pytest.raises(BadInput, match=r"nowhere\.toml: cannot be read"):
        training_config(tmp_path / "nowhere.toml")


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(BadInput, match="cannot be made a folder"):
        run_training(tmp_path / "out", quick=True, progress=False)
