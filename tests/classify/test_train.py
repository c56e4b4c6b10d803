import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bladewing.classify import Classifier, train, training_costs, workers
from bladewing.classify.cli import main
from bladewing.classify.errors import BadInput
from bladewing.classify.gather import Gathered, TrainingSets, gather
from bladewing.classify.labels import CLASSES
from bladewing.classify.model_file import COVERAGES
from bladewing.classify.parts import TRAIN_PARTS
from bladewing.classify.train import run_training
from bladewing.classify.train_network import CLASS_OF_KIND, kinds_of, train_net
from bladewing.classify.training_account import figures
from bladewing.classify.training_config import TrainingConfig, training_config
from bladewing.features import INPUT_SHAPES
from bladewing.models import TEACHER, tabular, training
from bladewing.models.operating import least_named
from bladewing.simulate import Radar, draw_records
from bladewing.simulate.dataset import KIND_CLASS

from .conftest import interrupt


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    out = tmp_path_factory.mktemp("trained")
    config = out / "tiny.toml"
    config.write_text("records = 3200\nepochs = 2\nbatch = 64\niterations = 20\n")
    with pytest.MonkeyPatch.context() as patch:
        # to start several for each set takes longer than to draw it
        patch.setattr(workers, "workers_at_hand", lambda: 1)
        return out, run_training(out, config=config, progress=False)


def test_training_writes_every_model_and_its_account(trained):
    out, account = trained
    assert {path.stem for path in out.glob("*.onnx")} == set(TrainingConfig().models) == set(account["models"])
    assert json.loads((out / "train.json").read_text()) == account
    for name, model in account["models"].items():
        assert model["bytes"] == (out / f"{name}.onnx").stat().st_size
        # chance is 1/3; even this little training is far from it (800 test records: 0.018 standard error)
        assert model["test"]["balanced_accuracy"] > 0.42, name
    assert not list(out.glob(".bladewing*"))


def test_every_record_has_the_kind_that_was_drawn_and_its_class_and_ground_alone_is_no_noise():
    drawn = gather(0, "train", 240, names=("levels",), workers=1)
    kinds = kinds_of(drawn)
    background = (drawn.truth["kind"] == "noise") & np.isfinite(drawn.truth["background_db"])
    assert 0 < background.sum() < (drawn.truth["kind"] == "noise").sum()
    as_drawn = np.where(background, "ground", drawn.truth["kind"])
    np.testing.assert_array_equal(np.array(list(KIND_CLASS))[kinds], as_drawn)
    np.testing.assert_array_equal(np.array(CLASS_OF_KIND)[kinds], drawn.labels)
    assert len(np.unique(kinds)) > len(CLASS_OF_KIND) / 2


def test_the_cascade_goes_from_the_cheapest_model_to_the_best(trained):
    out, account = trained
    models, cascade = account["models"], account["cascade"]
    first, second = (models[name] for name in cascade["stages"])
    assert first["cost_ffts"] == min(model["cost_ffts"] for model in models.values())
    chosen_on = gather(account["settings"]["seed"], "calibrate", account["records"]["calibrate"], workers=1)
    accuracy = {
        name: figures(
            Classifier.load(out / f"{name}.onnx").from_inputs(chosen_on.inputs),
            chosen_on.labels,
            np.array(model["accept"]),  # without effect here
            account["false_alarm"],
        )["balanced_accuracy"]
        for name, model in models.items()
    }
    assert accuracy[cascade["stages"][1]] == max(accuracy.values())
    assert 0 < cascade["asked"] <= 1
    assert first["cost_ffts"] * 0.8 < cascade["cost_ffts"]
    # it is never far behind the second, as what the first is sure of is mostly right
    assert cascade["test"]["balanced_accuracy"] > second["test"]["balanced_accuracy"] - 0.05


@pytest.mark.parametrize("name", TrainingConfig().models)
def test_trained_models_answer_through_the_classifier(trained, name):
    out, account = trained
    clf = Classifier.load(out / f"{name}.onnx")
    assert json.loads(clf.metadata["training"])["records"] == 3200
    assert list(clf.accept) == account["models"][name]["accept"]
    assert account["models"][name]["cost_ffts"] > 1
    chosen = Classifier.load(out / f"{name}.onnx", max_false_alarm=0.1)  # 800 calibration records hold 530 others
    assert chosen.operating_point.false_alarm == 0.1
    assert chosen.accept[1:] == clf.accept[1:]
    sets = json.loads(clf.metadata["prediction_sets"])
    assert [row[0] for row in sets] == list(COVERAGES)
    assert all(0 < limit < 1 for row in sets for limit in row[1:])  # 266 calibration records of a class hold 0.99
    assert Classifier.load(out / f"{name}.onnx", coverage=0.9).coverage == 0.9
    covered = account["models"][name]["test"]["coverage"]
    for wanted, share in zip(COVERAGES, covered, strict=True):
        # 266 records of a class on either side
        assert abs(share - wanted) < 5 * np.sqrt(wanted * (1 - wanted) * 2 / 800) + 1 / 266
    radar = Radar(9.85e9, 25e3, 2000)
    loud = draw_records(radar, 90, 0, purpose="test", kind="quadcopter")
    answer = clf.predict(loud.iq[loud.truth["snr_db"] > 5], carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    noise = draw_records(radar, 40, 0, purpose="test", kind="noise")
    other = clf.predict(noise.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    np.testing.assert_allclose(answer.probabilities.sum(axis=-1), 1, atol=1e-5)
    assert answer.probabilities[:, 0].mean() > other.probabilities[:, 0].mean() + 0.1


def test_an_interrupted_training_leaves_the_old_files_and_says_how_it_goes_on(tmp_path, monkeypatch, capsys):
    for name in ("features-linear.onnx", "train.json"):
        (tmp_path / name).write_bytes(b"old")

    monkeypatch.setattr(train, "_gather", _few_sets)
    monkeypatch.setattr(tabular, "train_boosted", interrupt)
    config = tmp_path / "tiny.toml"
    config.write_text('records = 600\nmodels = ["features-linear", "features-boosted"]\n')
    assert main(["train", "--out", str(tmp_path), "--config", str(config)]) == 130
    said = f"what is done is kept in {tmp_path / 'train-parts'}: the same command goes on"
    assert capsys.readouterr().err.splitlines()[-1] == f"bladewing: stopped: interrupted: {said}"
    assert (tmp_path / "features-linear.onnx").read_bytes() == b"old"
    assert (tmp_path / "train.json").read_bytes() == b"old"
    left = ["features-linear.onnx", "tiny.toml", "train-parts", "train.json"]
    assert sorted(p.name for p in tmp_path.iterdir()) == left
    (kept,) = (tmp_path / "train-parts").glob("*/features-*")
    assert kept.name == "features-linear.npz"


SETTINGS = TrainingConfig(
    records=600, epochs=3, batch=64, precision=0.5, false_alarm=0.1, models=("features-linear", "spectrum-cnn")
)


def _few_sets(*_):
    """Inputs that cost nothing to draw, shifted by class."""
    rng = np.random.default_rng(0)

    def gathered(count):
        labels = np.arange(count) % 3
        inputs = {}
        for name in ("features", "spectrum", "cadence", "combs"):
            values = rng.normal(size=(count, *INPUT_SHAPES[name]))
            inputs[name] = (values + 0.3 * labels.reshape(-1, *[1] * (values.ndim - 1))).astype(np.float32)
        kinds = np.array([next(kind for kind, of in KIND_CLASS.items() if of == CLASSES[label]) for label in labels])
        truth = {"kind": kinds, "background_db": np.full(count, np.nan), "pulses": np.full(count, 500)}
        truth |= {"carrier_hz": np.full(count, 10e9), "prf_hz": np.full(count, 10e3)}
        return Gathered(inputs, labels, truth)

    return TrainingSets(gathered(192), gathered(96), gathered(300), gathered(300))


def _run(out, *, after=None, then=None, **changed):
    """Train on few sets; after an epoch of a network do what is asked for."""
    real = training.train_network

    def train_network(*args, on_epoch, **options):
        return real(*args, on_epoch=lambda epoch, *_: then() if epoch == after else None, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train, "_gather", _few_sets)
        patch.setattr(train, "add_costs", lambda *_: None)
        patch.setattr(train, "training_config", lambda *_, **__: SETTINGS.model_copy(update=changed))
        patch.setattr(training, "train_network", train_network)
        patch.setattr(training, "WIDE", 10**9)  # two threads of the teacher's wait for each other on a busy machine
        return run_training(out, progress=False)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Models of a training that nothing interrupts."""
    out = tmp_path_factory.mktemp("whole")
    assert not _run(out)["resumed"]
    assert sorted(path.name for path in out.iterdir()) == ["features-linear.onnx", "spectrum-cnn.onnx", "train.json"]
    return out


def test_a_killed_and_interrupted_training_goes_on_to_the_same_files(whole, tmp_path, monkeypatch):
    code = (
        "import sys, time; from pathlib import Path; from tests.classify.test_train import _run;"
        "_run(Path(sys.argv[1]), after=1, then=lambda: time.sleep(300))"
    )
    root = Path(__file__).parents[2]
    with subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], cwd=root) as process:
        while process.poll() is None and not list(tmp_path.glob("train-parts/*/spectrum-cnn-epochs.npz")):
            time.sleep(0.01)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.iterdir()] == ["train-parts"]
    monkeypatch.setattr(tabular, "train_linear", lambda *_, **__: pytest.fail("what was trained is trained again"))
    for after in (2, 3):  # the first epoch is not done again, else it would be the third that never comes
        with pytest.raises(KeyboardInterrupt):
            _run(tmp_path, after=after, then=interrupt)
    account = _run(tmp_path)
    assert account["resumed"]
    for path in whole.glob("*.onnx"):
        assert (tmp_path / path.name).read_bytes() == path.read_bytes(), path.name
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in whole.iterdir()}
    straight = json.loads((whole / "train.json").read_text())
    first, second = (one["models"]["spectrum-cnn"]["epochs"] for one in (straight, account))
    figures = ("learning_rate", "train_loss", "validation_loss", "validation_accuracy")
    assert len(first) == 3
    assert [[epoch[name] for name in figures] for epoch in first] == [[e[name] for name in figures] for e in second]


def _stopped_once(out, part, *, after, models):
    """Train until a network's epoch at which a part lies there, stop, and go on to the end."""

    def once_it_lies_there():
        if list(out.glob(f"train-parts/*/{part}.npz")):
            interrupt()

    with pytest.raises(KeyboardInterrupt):
        _run(out, after=after, then=once_it_lies_there, models=models)
    left = {path.stem for path in out.glob("train-parts/*/*.npz")}
    _run(out, models=models)
    return left


def _same_models(names, *folders):
    for name in names:
        files = [folder / f"{name}.onnx" for folder in folders]
        assert files[0].read_bytes() == files[1].read_bytes(), name


def test_a_pupil_learns_from_its_teacher_after_it_and_an_interruption_changes_nothing(whole, tmp_path):
    names = ("spectrum-cnn", "spectrum-cnn-teacher")
    outs = tmp_path / "straight", tmp_path / "interrupted"
    for out in outs:
        out.mkdir()
    straight = _run(outs[0], models=names)["models"]
    assert list(straight) == list(names)
    assert [straight[name]["teacher"] for name in names] == ["spectrum-cnn-teacher", ""]
    assert [len(straight[name]["epochs"]) for name in names] == [2 * SETTINGS.epochs, SETTINGS.epochs]
    taught = (outs[0] / "spectrum-cnn.onnx").read_bytes()
    assert taught != (whole / "spectrum-cnn.onnx").read_bytes()
    assert "spectrum-cnn-teacher" in _stopped_once(outs[1], "spectrum-cnn-epochs", after=2, models=names)
    _same_models(names, *outs)


def test_the_teacher_has_costs_and_stands_in_no_cascade(whole, monkeypatch):
    sets, linear = _few_sets(), (whole / "features-linear.onnx").read_bytes()
    # the classes lie apart so evenly here that the line, which is called dear, is the more accurate
    prices = {"features-linear": 9.0, "spectrum-cnn": 5.0, TEACHER: 5.0, "cascade": 7.0}
    monkeypatch.setattr(training_costs, "costs_ffts", lambda asked: {name: prices[name] for name in asked})
    stages = {}
    for name in ("spectrum-cnn", TEACHER):
        files = {"features-linear.onnx": linear, f"{name}.onnx": (whole / "spectrum-cnn.onnx").read_bytes()}
        models = {"features-linear": {}, name: {}}
        cascade = training_costs.add_costs(files, models, sets.calibrate, sets.test, SETTINGS.false_alarm)
        stages[name] = cascade["stages"] if cascade else None
        assert models[name] == {"cost_ffts": prices[name]}
    assert stages == {"spectrum-cnn": ["spectrum-cnn", "features-linear"], TEACHER: None}


def test_what_a_model_tells_of_kinds_adds_up_to_its_classes_and_noise_is_one_of_them(whole):
    model = Classifier.load(whole / "spectrum-cnn.onnx")
    inputs = _few_sets().test.inputs
    shares, told = model.kind_shares(inputs).astype(float), model._answer(inputs)
    classes = np.stack([shares[:, np.array(CLASS_OF_KIND) == label].sum(axis=1) for label in range(3)], axis=1)
    scale, bias = (json.loads(model.metadata["calibration"])[key] for key in ("scale", "bias"))
    powers = classes**scale * np.exp(bias)
    np.testing.assert_allclose(told[:, :3], powers / powers.sum(axis=1, keepdims=True), rtol=1e-4)
    own = list(KIND_CLASS).index("noise")
    np.testing.assert_allclose(told[:, 3], told[:, 2] * shares[:, own] / classes[:, 2], rtol=1e-4)
    for row in range(0, 300, 37):
        alone = model._answer({name: values[row : row + 1] for name, values in inputs.items()})
        np.testing.assert_array_equal(alone[0, 3], told[row, 3])


def test_a_resumed_networks_seconds_hold_those_before_the_interruption(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        _run(tmp_path, after=2, then=interrupt)
    (file,) = tmp_path.glob("train-parts/*/spectrum-cnn-epochs.npz")
    with np.load(file) as kept:
        arrays = dict(kept)
    arrays["history/seconds"] += 1000
    np.savez(file, **arrays)
    assert _run(tmp_path)["models"]["spectrum-cnn"]["seconds"] > 1000


@pytest.mark.parametrize(("changed", "records"), [({"seed": 1}, train.TASK_RECORDS), ({}, 2 * train.TASK_RECORDS)])
def test_other_settings_and_runs_of_other_lengths_do_not_take_what_was_kept(tmp_path, changed, records):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train, "TASK_RECORDS", records)
        with pytest.raises(KeyboardInterrupt):
            _run(tmp_path, after=2, then=interrupt, **changed)
    for after in (1, 2):
        with pytest.raises(KeyboardInterrupt):  # its first epoch comes, so nothing of the other was taken
            _run(tmp_path, after=after, then=interrupt)
    assert len(list(tmp_path.glob("train-parts/*/spectrum-cnn-epochs.npz"))) == 2


def test_what_is_kept_is_of_the_same_simulator_inputs_and_libraries(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr(train, "Parts", lambda _, of: kept.append(of) or interrupt())
    for changed in ("simulator_digest", "inputs_digest", "schema_hash", "_versions", None, None):
        with monkeypatch.context() as patch:
            if changed:
                patch.setattr(train, changed, lambda: "another")
            with pytest.raises(KeyboardInterrupt):
                run_training(tmp_path, records=600, progress=False)
    assert [kept.count(of) for of in kept] == [1, 1, 1, 1, 2, 2]


@pytest.mark.parametrize("name", ["features-linear", "spectrum-cnn-epochs"])
def test_what_is_damaged_or_foreign_is_refused_in_one_line(tmp_path, name):
    with pytest.raises(KeyboardInterrupt):
        _run(tmp_path, after=1, then=interrupt)
    (file,) = tmp_path.glob(f"train-parts/*/{name}.npz")
    kept = file.read_bytes()
    file.write_bytes(kept[: len(kept) // 2])
    with pytest.raises(BadInput, match=rf"{name}\.npz: not what this run kept: .*: remove it and start again$"):
        _run(tmp_path)
    np.savez(file, of_another=np.arange(3))
    with pytest.raises(BadInput, match=rf"{name}\.npz: not what this run kept"):
        _run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["train-parts"]


def test_a_network_that_no_longer_gains_stops_and_says_so():
    settings = SETTINGS.model_copy(update={"epochs": 60, "patience": 1})
    _, _, detail = train_net("spectrum-cnn", settings, _few_sets(), lambda _: None, None)
    assert detail["stopped_early"]
    assert len(detail["epochs"]) == detail["best_epoch"] + 1 < 60


def test_epochs_without_a_number_are_told_and_do_not_cost_the_network(monkeypatch):
    real = training.train_network

    def ruined_at_last(*given, **options):
        result = real(*given, **options)
        return replace(result, epochs=(*result.epochs, dict.fromkeys(result.epochs[0], float("nan"))))

    monkeypatch.setattr(training, "train_network", ruined_at_last)
    _, _, detail = train_net("spectrum-cnn", SETTINGS, _few_sets(), lambda _: None, None)
    assert set(detail["epochs"][-1].values()) == {None}
    json.dumps(detail, allow_nan=False)


def test_a_training_that_never_gives_a_number_is_bad_input(tmp_path):
    with pytest.raises(BadInput, match=r"spectrum-cnn: .*learning_rate inf is too high: choose a smaller one$"):
        _run(tmp_path, learning_rate=float("inf"))
    assert not (tmp_path / "spectrum-cnn.onnx").exists()


@pytest.mark.parametrize(("others", "tied"), [(200, 0), (201, 0), (350, 0), (401, 0), (3333, 0), (400, 60), (10, 0)])
def test_the_threshold_of_a_rate_keeps_to_it_on_its_own_records(others, tied):
    probabilities = np.random.default_rng(others).dirichlet(np.ones(3), others + 50).astype(np.float32)
    probabilities[:tied, 0] = 0.999
    labels = np.repeat([1, 0], [others, 50])
    threshold = least_named(probabilities[labels != 0, 0], 0.01)
    false = np.sum(probabilities[labels != 0, 0] >= threshold)
    assert false <= 0.01 * others
    assert tied or false == int(0.01 * others)


def test_figures_against_brute_force():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 3, 3000)
    probabilities = rng.dirichlet(np.ones(3), 3000)
    probabilities[np.arange(3000), labels] += 1
    probabilities /= 2
    found = figures(probabilities, labels, np.array([0.7, 0.6, 0.5]), 0.01)
    threshold = sorted(probabilities[labels != 0, 0])[-int(0.01 * (labels != 0).sum()) - 1]
    assert found["uav_detection"] == pytest.approx(np.mean(probabilities[labels == 0, 0] > threshold), abs=1e-4)
    winner = probabilities.argmax(1)
    named = probabilities.max(1) >= np.array([0.7, 0.6, 0.5])[winner]
    assert found["named_share"] == pytest.approx(named.mean(), abs=1e-4)
    wrong = [p[0] >= 0.7 and p.argmax() == 0 for p in probabilities[labels != 0]]
    assert found["false_uav"] == pytest.approx(np.mean(wrong), abs=1e-4)
    assert found["named_accuracy"] == pytest.approx((winner == labels)[named].mean(), abs=1e-4)


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
        ('learning_rate = "0.01"', r"learning_rate is '0.01'"),
        ("seed = true", r"seed is True"),
        ("seed = 4294967296", r"seed is 4294967296: it should be less than 4294967296"),
        ('models = ["spectrum-cnn", "spectrum-cnn"]', r"models holds 'spectrum-cnn' twice: name each once"),
        ('models = ["magic"]', r"models holds 'magic': it may hold features-linear"),
        ("models = []", r"models is \[\]"),
        ("records = = 3", "not TOML"),
        ('models = "spectrum-cnn"', r"models is 'spectrum-cnn': it must be a list: write \[\.\.\.\] about it"),
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


def test_a_folder_that_holds_models_of_another_training_is_refused(tmp_path):
    (tmp_path / "image-cnn.onnx").write_bytes(b"of another run")
    config = tmp_path / "one.toml"
    config.write_text('records = 600\nmodels = ["features-linear"]\n')
    with pytest.raises(BadInput, match=r"holds image-cnn\.onnx of another training, which this one does not make"):
        run_training(tmp_path, config=config, progress=False)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["image-cnn.onnx", "one.toml"]


@pytest.fixture
def line_alone(tmp_path, monkeypatch):
    """Settings of a training that costs next to nothing: a line on few sets, whose price is not measured."""
    monkeypatch.setattr(train, "_gather", _few_sets)
    monkeypatch.setattr(train, "add_costs", lambda _, models, *__: models["features-linear"].update(cost_ffts=1.0))
    config = tmp_path / "one.toml"
    config.write_text('records = 600\nmodels = ["features-linear"]\n')
    return config


def test_a_run_that_another_one_overtook_writes_nothing_and_keeps_what_it_did(tmp_path, line_alone, monkeypatch):
    costs = train.add_costs

    def overtaken(*arguments):
        (tmp_path / "image-cnn.onnx").write_bytes(b"of another run")
        return costs(*arguments)

    monkeypatch.setattr(train, "add_costs", overtaken)
    with pytest.raises(BadInput, match=r"holds image-cnn\.onnx of another training"):
        run_training(tmp_path, config=line_alone, progress=False)
    assert not list(tmp_path.glob("features-linear*"))
    assert list((tmp_path / TRAIN_PARTS).iterdir())


def test_a_training_says_what_another_left_unfinished_beside_it(tmp_path, line_alone, capsys):
    left = tmp_path / TRAIN_PARTS / "of-another-run"
    left.mkdir(parents=True)
    (left / "some.npz").write_bytes(bytes(2_500_000))
    run_training(tmp_path, config=line_alone, progress=True)
    said = capsys.readouterr().err
    assert f"{tmp_path / TRAIN_PARTS} holds an unfinished run" in said
    assert "2.5 MB" in said
    assert left.exists()


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(BadInput, match="cannot be made a folder"):
        run_training(tmp_path / "out", quick=True, progress=False)
