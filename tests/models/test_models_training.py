"""Training: reproducible, keeps its best state, learns what can be learnt, standardises its inputs."""

import numpy as np
import pytest
import torch
from bladewing.models import training
from bladewing.models.augment import VelocityMirror
from bladewing.models.calibration import softmax
from bladewing.models.cnn import ImageNet, SpectrumNet, Standardise, _speed_bands
from bladewing.models.tabular import tabular_scores, train_boosted, train_linear
from bladewing.models.training import TrainingData, TrainingOptions, network_scores, train_network
from bladewing.models.training_state import ForeignSnapshot
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.linear_model import LogisticRegression
from threadpoolctl import threadpool_info, threadpool_limits

BINS, FEATURES = 32, 4
SHAPES = {"spectrum": (2, BINS), "features": (FEATURES,)}


def _spectra(count, seed):
    """Classes that differ in shape alone: many lines, one line, none; anywhere on the axis. The features are noise."""
    rng = np.random.default_rng(seed)
    y = rng.integers(0, 3, count)
    spectrum = rng.normal(size=(count, 2, BINS))
    for row, label in enumerate(y):
        shift = rng.integers(BINS)
        spectrum[row, :, (shift + np.arange(0, BINS, (4, BINS)[label])) % BINS if label < 2 else []] += 5
    features = rng.normal(size=(count, FEATURES)).astype(np.float32)
    return {"spectrum": spectrum.astype(np.float32), "features": features}, y


def _images(count, seed):
    """Classes that differ in the direction of their stripes: along one axis, along the other, none."""
    rng = np.random.default_rng(seed)
    y = rng.integers(0, 3, count)
    image = rng.normal(size=(count, 1, 16, 16))
    for row, label in enumerate(y):
        if label < 2:
            np.moveaxis(image[row, 0], label, 0)[rng.integers(4) :: 4] += 2
    return {"image": image.astype(np.float32), "joint_features": np.zeros((count, FEATURES), np.float32)}, y


def _trained(seed=0, epochs=2, **options):
    inputs, y = _spectra(300, 1)
    net = SpectrumNet(SHAPES, seed=seed)
    course = {name: options.pop(name) for name in ("learning_rate", "patience", "bfloat16") if name in options}
    course = TrainingOptions(epochs, batch=64, **course)
    return net, train_network(net, TrainingData(inputs, y), _spectra(100, 2), course, seed=seed, **options)


@pytest.mark.parametrize(
    ("draw", "make"),
    [
        (_spectra, lambda: SpectrumNet(SHAPES, seed=0)),
        (_spectra, lambda: SpectrumNet({"spectrum": (2, BINS)}, seed=0)),
        (_images, lambda: ImageNet({"image": (1, 16, 16), "joint_features": (FEATURES,)}, seed=0)),
    ],
)
def test_a_net_learns_what_its_signal_tells(draw, make):
    net = make()
    inputs, y = draw(600, 1)
    train_network(net, TrainingData(inputs, y), draw(200, 2), TrainingOptions(8, batch=64), seed=0)
    fresh, truth = draw(300, 3)
    accuracy = (network_scores(net, fresh).argmax(axis=1) == truth).mean()
    assert accuracy > 0.9  # chance is 0.33 with a spread of 0.03


def test_a_net_learns_at_what_rate_something_comes_and_goes():
    rng = np.random.default_rng(0)
    y = rng.integers(0, 3, 900)
    cadence = rng.normal(size=(900, 2, 24))
    for place in (0, 1):  # the same pattern at one of three rates: only its place tells
        cadence[np.arange(900), :, 4 + 7 * y + place] += 5
    inputs = {
        "spectrum": rng.normal(size=(900, 2, BINS)).astype(np.float32),
        "cadence": cadence.astype(np.float32),
        "features": rng.normal(size=(900, FEATURES)).astype(np.float32),
    }
    parts = [{name: values[rows] for name, values in inputs.items()} for rows in (slice(0, 600), slice(600, 900))]
    net = SpectrumNet({name: values.shape[1:] for name, values in inputs.items()}, seed=0)
    train_network(net, TrainingData(parts[0], y[:600]), (parts[1], y[600:]), TrainingOptions(8, batch=64), seed=0)
    assert (network_scores(net, parts[1]).argmax(axis=1) == y[600:]).mean() > 0.9


def test_a_net_learns_what_its_measurements_tell():
    rng = np.random.default_rng(0)
    y = rng.integers(0, 3, 600)
    inputs = {
        "spectrum": rng.normal(size=(600, 2, BINS)).astype(np.float32),
        "features": (rng.normal(size=(600, FEATURES)) + 4 * np.eye(FEATURES)[y]).astype(np.float32),
    }
    net = SpectrumNet(SHAPES, seed=0)
    train_network(net, TrainingData(inputs, y), (inputs, y), TrainingOptions(4, batch=64), seed=0)
    assert (network_scores(net, inputs).argmax(axis=1) == y).mean() > 0.9


def test_a_net_learns_how_far_from_rest_a_line_is():
    rng, rest = np.random.default_rng(0), 512  # no end of the axis is within reach of the convolutions
    y = rng.integers(0, 3, 900)
    away = rest * (np.array([0.2, 0.45, 0.7])[y] + rng.uniform(-0.1, 0.1, 900))
    spectrum = rng.normal(size=(900, 2, 2 * rest))
    spectrum[np.arange(900), :, (rest + rng.choice([-1, 1], 900) * away).astype(int)] += 12
    parts = [{"spectrum": spectrum[rows].astype(np.float32)} for rows in (slice(0, 600), slice(600, 900))]
    net = SpectrumNet({"spectrum": (2, 2 * rest)}, seed=0)
    train_network(net, TrainingData(parts[0], y[:600]), (parts[1], y[600:]), TrainingOptions(6, batch=64), seed=0)
    assert (network_scores(net, parts[1]).argmax(axis=1) == y[600:]).mean() > 0.9


def test_evidence_tells_the_maps_nothing_at_first_and_something_once_trained():
    net, (inputs, _) = SpectrumNet(SHAPES, seed=0), _spectra(50, 3)
    gain, shift = net.told.bias.reshape(2, -1)
    assert (gain == 1).all()
    assert not shift.any()
    assert not net.told.weight.any()
    net = _trained()[0]
    before = network_scores(net, inputs)
    with torch.no_grad():
        net.told.weight.zero_()
    assert np.abs(network_scores(net, inputs) - before).max() > 1e-3


@pytest.mark.parametrize("places", range(1, 20))
def test_bands_of_speed_are_alike_on_both_sides_of_rest(places):
    bands = _speed_bands(places)
    torch.testing.assert_close(bands, bands.flip(0))
    torch.testing.assert_close(bands.sum(0), torch.ones(bands.shape[1]))
    assert ((bands > 0).sum(1) == 1).all()
    away = (torch.arange(places) - (places - 1) / 2).abs()
    own = bands.argmax(1)[away.argsort(stable=True)]
    assert (own.diff() >= 0).all()


KINDS = (0, 0, 0, 1, 2, 2)


def _rates(count, seed):
    """Six kinds, each with a pattern at a rate of its own."""
    rng = np.random.default_rng(seed)
    kinds = rng.integers(0, len(KINDS), count)
    cadence = rng.normal(size=(count, 2, 24))
    cadence[np.arange(count), :, 2 + 4 * kinds] += 5
    spectrum = rng.normal(size=(count, 2, BINS))
    return {"spectrum": spectrum.astype(np.float32), "cadence": cadence.astype(np.float32)}, kinds


def test_a_net_that_is_told_kinds_knows_them_and_their_sums_are_the_classes():
    inputs, kinds = _rates(900, 0)
    y = np.array(KINDS)[kinds]
    fresh, told = _rates(300, 1)
    truth = np.array(KINDS)[told]
    net = SpectrumNet({name: values.shape[1:] for name, values in inputs.items()}, seed=0, kinds=KINDS)
    train_network(net, TrainingData(inputs, y, kinds), (fresh, truth), TrainingOptions(8, batch=64), seed=0)
    with torch.inference_mode():
        scores = net.kind_scores(*(torch.from_numpy(fresh[name]) for name in net.input_shapes)).double().numpy()
    assert (scores.argmax(axis=1) == told).mean() > 0.9
    classes = softmax(network_scores(net, fresh))
    assert (classes.argmax(axis=1) == truth).mean() > 0.9
    sums = np.stack([softmax(scores)[:, np.array(KINDS) == label].sum(axis=1) for label in range(3)], axis=1)
    np.testing.assert_allclose(classes, sums, rtol=1e-4)  # also where a class is next to impossible


@pytest.mark.parametrize("kinds", [(0, 1, 1), (0, 2, 1), (1, 2, 2)])
def test_kinds_must_hold_every_class_in_order(kinds):
    with pytest.raises(ValueError, match="every class, 0 to 2, in rising order"):
        SpectrumNet(SHAPES, seed=0, kinds=kinds)


def test_scores_of_classes_stay_finite_where_one_is_impossible():
    net = SpectrumNet({"spectrum": (2, BINS)}, seed=0, kinds=KINDS)
    scores = net.class_scores(torch.tensor([[300.0, 0, 0, 0, 0, 0], [0, 0, 0, -300.0, 0, 0]]))
    assert torch.isfinite(scores).all()
    assert scores.argmax(1).tolist() == [0, 0]


def test_a_teacher_that_knows_what_a_record_leaves_open_makes_up_for_labels_that_err(monkeypatch):
    monkeypatch.setattr(training, "SMOOTHING", 0.0)
    inputs, truth = _spectra(400, 1)
    rng = np.random.default_rng(4)
    shares = np.full((400, 3), 0.25)
    shares[np.arange(400), truth] = 0.5
    drawn = (rng.random(400)[:, None] > shares.cumsum(axis=1)[:, :2]).sum(axis=1)
    fresh, labels = _spectra(300, 3)
    off = []
    for teacher in (None, shares):
        net = SpectrumNet(SHAPES, seed=0)
        train_network(
            net, TrainingData(inputs, drawn, teacher=teacher), (fresh, labels), TrainingOptions(8, batch=64), seed=0
        )
        found = softmax(network_scores(net, fresh))
        off.append(np.abs(found[np.arange(300), labels] - 0.5).mean())
    assert off[1] < 0.7 * off[0]


def test_a_pupil_learns_kinds_that_its_labels_no_longer_tell():
    inputs, kinds = _rates(900, 0)
    y, rng = np.array(KINDS)[kinds], np.random.default_rng(2)
    mixed = np.array([rng.choice(np.flatnonzero(np.array(KINDS) == label)) for label in y])  # the class is right
    fresh, told = _rates(300, 1)
    found = []
    for teacher in (None, np.eye(len(KINDS))[kinds]):
        net = SpectrumNet({name: values.shape[1:] for name, values in inputs.items()}, seed=0, kinds=KINDS)
        lessons = TrainingData(inputs, y, mixed, teacher)
        train_network(net, lessons, (fresh, np.array(KINDS)[told]), TrainingOptions(8, batch=64), seed=0)
        with torch.inference_mode():
            scores = net.kind_scores(*map(torch.as_tensor, fresh.values()))
        found.append((scores.numpy().argmax(axis=1) == told).mean())
    assert found[1] > 0.9 > 0.75 > found[0]


def test_training_is_the_same_to_the_bit_for_a_seed_and_differs_for_another():
    mirror = VelocityMirror("spectrum", 2)
    torch.manual_seed(1)
    first, once = _trained(seed=5, augment=mirror)
    torch.manual_seed(2)
    state = torch.random.get_rng_state()
    second, twice = _trained(seed=5, augment=mirror)
    assert torch.equal(torch.random.get_rng_state(), state)  # the caller's generator is left alone
    other, _ = _trained(seed=6, augment=mirror)
    assert [e["validation_loss"] for e in once.epochs] == [e["validation_loss"] for e in twice.epochs]
    for name, values in first.state_dict().items():
        assert torch.equal(values, second.state_dict()[name]), name
    assert not torch.equal(first.head[0].weight, other.head[0].weight)


@pytest.mark.parametrize(("wide", "held"), [(10**9, 1), (1, 2)])
def test_few_threads_work_however_many_there_are_and_all_are_given_back(wide, held, monkeypatch):
    threads, seen = torch.get_num_threads(), []
    monkeypatch.setattr(training, "WIDE", wide)
    try:
        torch.set_num_threads(3)
        net, _ = _trained(on_epoch=lambda *_: seen.append(torch.get_num_threads()))
        network_scores(net, _spectra(10, 4)[0])
        assert set(seen) == {held}
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(threads)


def test_in_bfloat16_only_the_steps_are_coarser():
    """The weights keep their precision, and so does what they are judged by."""
    full, exact = _trained(epochs=4)
    net, coarse = _trained(epochs=4, bfloat16=True)
    weights = {name: values for name, values in net.state_dict().items() if values.is_floating_point()}
    assert {values.dtype for values in weights.values()} == {torch.float32}
    assert not torch.equal(weights["head.0.weight"], weights["head.0.weight"].bfloat16().float())
    assert not torch.equal(weights["head.0.weight"], full.state_dict()["head.0.weight"])
    inputs, y = _spectra(100, 2)
    scores = torch.from_numpy(network_scores(net, inputs))
    loss = float(torch.nn.functional.cross_entropy(scores, torch.as_tensor(y)))
    assert coarse.epochs[coarse.best_epoch - 1]["validation_loss"] == pytest.approx(loss, rel=1e-5)
    losses = [[epoch["train_loss"] for epoch in result.epochs] for result in (exact, coarse)]
    np.testing.assert_allclose(losses[1], losses[0], rtol=0.05)


def _interrupted(after, **options):
    """Train until an interruption after an epoch; what was kept last."""
    kept = []

    def stop(epoch, epochs, metrics):
        if epoch == after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _trained(on_snapshot=kept.append, on_epoch=stop, **options)
    return kept[-1]


def _without_seconds(result):
    return [{name: value for name, value in epoch.items() if name != "seconds"} for epoch in result.epochs]


@pytest.mark.parametrize(("after", "bfloat16"), [(1, False), (2, False), (3, False), (4, False), (2, True)])
def test_an_interrupted_training_goes_on_to_the_same_bits(after, bfloat16):
    options = {"seed": 5, "epochs": 4, "augment": VelocityMirror("spectrum", 2)}
    options["bfloat16"] = bfloat16
    whole, result = _trained(**options)
    snapshot = _interrupted(after, **options)
    torch.manual_seed(99)
    later = []
    net, resumed = _trained(snapshot=snapshot, on_snapshot=later.append, **options)
    assert len(later) == 4 - after
    assert _without_seconds(resumed) == _without_seconds(result)
    assert resumed.best_epoch == result.best_epoch
    seconds = [epoch["seconds"] for epoch in resumed.epochs]
    assert seconds == sorted(seconds)
    for name, values in whole.state_dict().items():
        assert torch.equal(values, net.state_dict()[name]), name


def test_an_interruption_after_each_epoch_changes_nothing():
    snapshot = None
    for after in (1, 2, 3):
        snapshot = _interrupted(after, epochs=4, snapshot=snapshot)
    whole, _ = _trained(epochs=4)
    net, _ = _trained(epochs=4, snapshot=snapshot)
    for name, values in whole.state_dict().items():
        assert torch.equal(values, net.state_dict()[name]), name


def test_a_snapshot_is_left_alone_by_the_epochs_after_it():
    kept = []
    _trained(epochs=3, on_snapshot=lambda snapshot: kept.append((snapshot, {k: v.copy() for k, v in snapshot.items()})))
    for snapshot, copy in kept:
        for name, values in snapshot.items():
            np.testing.assert_array_equal(values, copy[name])
            assert values.dtype.kind in "fiu", name


def test_the_learning_rate_of_each_epoch_is_that_of_the_schedule():
    _, result = _trained(epochs=5, learning_rate=0.01)
    rates = [epoch["learning_rate"] for epoch in result.epochs]
    assert max(rates) == rates[0] > 0.009  # a fifth of the steps up to the peak, then down to nothing
    assert rates == sorted(rates, reverse=True)
    assert 0 < rates[-1] < 1e-6


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 5, 6, 9])
def test_the_shortest_trainings_have_a_schedule_too(steps):
    inputs, y = _spectra(12, 1)
    net = SpectrumNet(SHAPES, seed=0)
    result = train_network(
        net, TrainingData(inputs, y), (inputs, y), TrainingOptions(steps, batch=12, learning_rate=0.01), seed=0
    )
    rates = [epoch["learning_rate"] for epoch in result.epochs]
    assert all(0 < rate <= 0.01 for rate in rates)
    assert steps == 1 or max(rates) > 0.009


def test_training_stops_where_the_validation_loss_no_longer_falls():
    def worsen(epoch, epochs, metrics):
        if epoch >= 2:
            with torch.no_grad():
                net.head[-1].weight.mul_(-10.0)

    net = SpectrumNet(SHAPES, seed=0)
    inputs, y = _spectra(300, 1)
    snapshots = []
    lessons, course = TrainingData(inputs, y), TrainingOptions(9, batch=64, patience=3)
    options = {"seed": 0, "on_epoch": worsen, "on_snapshot": snapshots.append}
    result = train_network(net, lessons, _spectra(100, 2), course, **options)
    assert result.stopped_early
    assert len(result.epochs) == result.best_epoch + 3 < 9
    losses = [epoch["validation_loss"] for epoch in result.epochs]
    assert min(losses) == losses[result.best_epoch - 1]
    # interrupted just then, it has nothing left to do
    again = SpectrumNet(SHAPES, seed=0)
    stopped = train_network(again, lessons, _spectra(100, 2), course, snapshot=snapshots[-1], **options)
    assert stopped.stopped_early
    assert _without_seconds(stopped) == _without_seconds(result)
    for name, values in net.state_dict().items():
        assert torch.equal(values, again.state_dict()[name]), name
    _, never = _trained(epochs=4, patience=0)
    assert len(never.epochs) == 4
    assert not never.stopped_early


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: {}, "no history of 1 to 2 epochs"),
        (lambda s: {k: v for k, v in s.items() if k != "history/seconds"}, "no history of 1 to 2 epochs"),
        (lambda s: s | {"history/seconds": np.zeros(2)}, "no history of 1 to 2 epochs"),
        (lambda s: s | {"best_epoch": np.array(7)}, "no history of 1 to 2 epochs"),
        (lambda s: {k: v for k, v in s.items() if "head.0.bias" not in k}, r"best/head\.0\.bias is missing"),
        (lambda s: s | {"generator/cuda": np.zeros(16, np.uint8)}, r"cuda is \(\(16,\), 'uint8'\); .* none"),
        (lambda s: s | {"network/head.0.bias": np.zeros(3, np.float32)}, r"head\.0\.bias is \(\(3,\)"),
        (lambda s: s | {"optimiser/0/step": np.array(1.0)}, "step is .*'float64'"),
    ],
)
def test_a_snapshot_of_another_training_is_refused(change, message):
    snapshot = _interrupted(1)
    with pytest.raises(ForeignSnapshot, match=message):
        _trained(snapshot=change(dict(snapshot)))


def test_the_best_state_is_kept_when_the_last_epochs_are_ruined():
    seen = []

    def ruin(epoch, epochs, metrics):
        seen.append((epoch, epochs))
        if epoch == 2:
            with torch.no_grad():
                for parameter in net.parameters():
                    parameter.add_(50 * torch.randn(parameter.shape, generator=torch.Generator().manual_seed(0)))

    net = SpectrumNet(SHAPES, seed=0)
    inputs, y = _spectra(300, 1)
    validation = _spectra(100, 2)
    result = train_network(
        net, TrainingData(inputs, y), validation, TrainingOptions(4, batch=64), seed=0, on_epoch=ruin
    )
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert result.best_epoch <= 2
    losses = [epoch["validation_loss"] for epoch in result.epochs]
    assert max(losses[2:]) > 2 * min(losses)
    kept = torch.nn.functional.cross_entropy(
        torch.from_numpy(network_scores(net, validation[0])), torch.from_numpy(validation[1])
    )
    assert float(kept) == pytest.approx(min(losses), rel=1e-6)  # other convolutions than in training
    assert not net.training


def test_training_measures_its_records_and_not_those_of_the_validation():
    net, _ = _trained(epochs=1)
    fresh = SpectrumNet(SHAPES, seed=0)
    fresh.standardise_by(_spectra(300, 1)[0])
    for name, values in fresh.standardise.state_dict().items():
        assert torch.equal(net.standardise.state_dict()[name], values), name


def test_a_training_that_never_gives_a_number_says_so():
    net = SpectrumNet(SHAPES, seed=0)
    inputs, y = _spectra(64, 1)
    with pytest.raises(FloatingPointError, match="learning_rate inf is too high"):
        train_network(
            net,
            TrainingData(inputs, y),
            _spectra(64, 2),
            TrainingOptions(1, batch=32, learning_rate=float("inf")),
            seed=0,
        )


def test_half_precision_in_memory_gives_what_its_values_give_in_full():
    inputs, y = _spectra(128, 1)
    half = {name: values.astype(np.float16) for name, values in inputs.items()}
    full = {name: values.astype(np.float32) for name, values in half.items()}
    states = []
    for given_inputs in (half, full):
        net = SpectrumNet(SHAPES, seed=0)
        train_network(net, TrainingData(given_inputs, y), (given_inputs, y), TrainingOptions(1, batch=32), seed=0)
        states.append(network_scores(net, given_inputs))
    assert np.array_equal(*states)


@settings(max_examples=20, deadline=None)
@given(
    scale=st.lists(st.floats(0.01, 100), min_size=2, max_size=2),
    shift=st.lists(st.floats(-10, 10), min_size=2, max_size=2),
)
def test_scaled_inputs_measured_anew_give_the_same_scores(scale, shift):
    inputs, _ = _spectra(64, 1)
    net = SpectrumNet(SHAPES, seed=0)
    net.standardise_by(inputs)
    scores = network_scores(net, inputs)
    column = np.array([scale]).T
    moved = {
        "spectrum": (inputs["spectrum"] * column + column * np.array([shift]).T).astype(np.float32),
        "features": inputs["features"] * np.float32(scale[0]),
    }
    if not np.allclose(scale, 1, atol=0.2):
        assert np.abs(network_scores(net, moved) - scores).max() > 1e-3  # the old buffers are the wrong ones
    net.standardise_by(moved)
    assert network_scores(net, moved) == pytest.approx(scores, abs=1e-4)


@settings(deadline=None)
@given(level=st.floats(-1000, 1000, width=32), count=st.integers(1, 3000))
def test_a_constant_input_is_only_centred(level, count):
    layer = Standardise(2, 0)
    values = np.stack([np.full(count, level), np.arange(count) % 2], axis=1).astype(np.float32)
    layer.standardise_by(values)
    result = layer(torch.from_numpy(values))
    assert torch.isfinite(result).all()
    assert result[:, 0].abs().max() < 1e-3


def test_an_outlier_is_clipped_to_very_much():
    layer = Standardise(1, 0)
    layer.standardise_by(np.array([[-1.0], [1.0]], np.float32))
    assert layer(torch.tensor([[3.0], [1e30]])).tolist() == [[3.0], [8.0]]


def test_the_linear_model_is_fitted_on_one_thread(monkeypatch):
    seen = []
    fit = LogisticRegression.fit

    def watched(model, *data):
        seen.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        return fit(model, *data)

    monkeypatch.setattr(LogisticRegression, "fit", watched)
    with threadpool_limits(2, user_api="blas"):
        rng = np.random.default_rng(0)
        train_linear(rng.normal(size=(90, 4)).astype(np.float32), np.arange(90) % 3, seed=0)
    assert seen
    assert set(seen) == {1}


@pytest.mark.parametrize("train", [train_linear, train_boosted])
def test_tabular_models_learn_and_repeat_themselves(train):
    rng = np.random.default_rng(0)
    y = rng.integers(0, 3, 900)
    x = (rng.normal(size=(900, 5)) + 2 * np.eye(5)[y]).astype(np.float32)
    x[:, 4] = 7  # a constant column
    calls = []
    model = train(x[:600], y[:600], seed=3, progress=lambda done, most: calls.append((done, most)))
    scores = tabular_scores(model, x[600:])
    assert np.isfinite(scores).all()
    assert (scores.argmax(axis=1) == y[600:]).mean() > 0.8
    assert np.array_equal(scores, tabular_scores(train(x[:600], y[:600], seed=3), x[600:]))
    assert calls
    assert calls[-1][0] <= calls[-1][1]


def test_boosting_stops_early_where_there_is_nothing_to_learn_and_uses_all_trees_where_there_is():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(600, 3)).astype(np.float32)
    noise = train_boosted(x, rng.integers(0, 3, 600), seed=0)
    assert noise.n_iter_ < 40
    told = train_boosted(x, np.digitize(x[:, 0] + 0.5 * x[:, 1], [-0.5, 0.5]), seed=0, iterations=25)
    assert told.n_iter_ == 25


def test_the_mirror_turns_some_records_whole_and_leaves_the_others():
    batch = {
        "spectrum": torch.arange(400.0 * 2 * 6).reshape(400, 2, 6) + 1,
        "features": torch.arange(400.0 * 3).reshape(400, 3) + 1,
    }
    result = VelocityMirror("spectrum", 2)(batch, torch.Generator().manual_seed(0))
    turned = (result["spectrum"] != batch["spectrum"]).any(dim=(1, 2))
    assert 140 < int(turned.sum()) < 260  # six standard deviations of 200 +- 10
    assert torch.equal(result["spectrum"][turned], batch["spectrum"][turned].flip(2))
    assert result["features"] is batch["features"]


def _refuse_network(change):
    inputs, y = _spectra(60, 1)
    lessons, validation, course = {"inputs": inputs, "labels": y}, (dict(inputs), y), {"epochs": 1}
    for name, value in change(inputs, y).items():
        if name == "validation":
            validation = value
        else:
            (lessons if name in ("inputs", "labels", "kinds", "teacher") else course)[name] = value
    train_network(SpectrumNet(SHAPES, seed=0), TrainingData(**lessons), validation, TrainingOptions(**course), seed=0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda x, y: {"inputs": {"spectrum": x["spectrum"]}}, "input 'features' is missing"),
        (lambda x, y: {"inputs": x | {"features": x["features"][:, 1:]}}, r"has shape \(60, 3\); it must be \(n, 4,"),
        (lambda x, y: {"inputs": x | {"features": x["features"][1:]}}, r"\[59, 60\] records"),
        (lambda x, y: {"inputs": x | {"features": x["features"] * np.float32("nan")}}, r"'features'\[0, 0\] is nan"),
        (lambda x, y: {"labels": y[1:]}, r"labels has shape \(59,\)"),
        (lambda x, y: {"labels": y % 2}, "each needs 2"),
        (lambda x, y: {"validation": (x, y + 1)}, "validation labels holds the label 3"),
        (lambda x, y: {"epochs": 0}, "epochs is 0"),
        (lambda x, y: {"kinds": y[1:]}, r"kinds is int64 of shape \(59,\)"),
        (lambda x, y: {"kinds": y + 0.5}, "kinds is float64"),
        (lambda x, y: {"kinds": y + 1}, "kinds holds 3; each must be 0 to 2"),
        (lambda x, y: {"kinds": 2 - y}, "it must be of the class of its label"),
        (lambda x, y: {"teacher": np.full((59, 3), 1 / 3)}, r"teacher has shape \(59, 3\); it must be \(60, 3\)"),
        (lambda x, y: {"teacher": np.full((60, 3), np.nan)}, r"teacher\[0, 0\] is nan"),
        (lambda x, y: {"teacher": np.full((60, 3), 0.5)}, r"teacher\[0\] is \[0.5, 0.5, 0.5\]"),
        (lambda x, y: {"teacher": np.tile([1.5, -0.5, 0.0], (60, 1))}, r"teacher\[0\] is \[1.5, -0.5, 0.0\]"),
    ],
)
def test_bad_input_of_a_network_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        _refuse_network(change)


@pytest.mark.parametrize("train", [train_linear, train_boosted])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda x, y: (x[0], y), r"x has shape \(2,\)"),
        (lambda x, y: (x.astype(float), y), "x is float64; it must be float32"),
        (lambda x, y: (np.where(x == x[3, 1], np.float32("inf"), x), y), r"x\[3, 1\] is inf"),
        (lambda x, y: (x, y[:-1]), r"y has shape \(59,\)"),
        (lambda x, y: (x, y % 2), "each needs 2"),
    ],
)
def test_bad_input_of_a_tabular_model_is_named(train, change, message):
    x = np.random.default_rng(0).normal(size=(60, 2)).astype(np.float32)
    with pytest.raises(ValueError, match=message):
        train(*change(x, np.arange(60) % 3), seed=0)
