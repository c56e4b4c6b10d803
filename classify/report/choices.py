"""The choices of the front: each picture with a small network, the measurements with trees, and each given model.

The networks and the trees are trained here. A choice is defined by its kind ("picture", "features" or "model"), its
name and its ONNX file: that is enough to open the choice in another process.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from bladewing.features import model_inputs
from bladewing.models.session import quiet_session
from bladewing.simulate import Radar, draw_records
from numpy.typing import NDArray

from ..cascade import Cascade
from ..inference import Classifier
from .pictures import PICTURES, Picture, in_blocks, quantised, radar_numbers, spectrum_picture
from .settings import ReportConfig

#: Dwells that are compared [s].
DWELLS_S = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
#: Numbers of bins, and of bits a level, in which stored spectra are tried.
STORED_BINS, STORED_BITS = (64, 128, 256, 512, 1024), (32, 16, 8, 4)
#: Name of the choice that reads the measurements alone: boosted trees trained on the same records as the networks.
FEATURES = "features"

# Small, so that the networks take enough steps to learn something even in a quick run.
_BATCH = 64

Answer = Callable[[NDArray[np.complex64], Radar], NDArray[np.float32]]
OnDone = Callable[[float], None]


@dataclass(frozen=True)
class FrontSet:
    """Inputs by name that the choices are trained on and asked about; the samples themselves are not kept.

    Attributes
    ----------
    inputs : dict of str to (n, ...) float16 or float32
        The pictures, "features", and "radar" (four numbers).
    labels : (n,) int
    snr_db : (n,) float
        NaN where a record has no SNR.
    dwell : (n,) int
        Index in `DWELLS_S`.
    """

    inputs: dict[str, NDArray[np.floating]]
    labels: NDArray[np.int64]
    snr_db: NDArray[np.float64]
    dwell: NDArray[np.int64]


def radar_of(dwell_s: float, reference: Radar) -> Radar:
    """Give the reference radar with another dwell."""
    return Radar(reference.carrier_hz, reference.prf_hz, round(dwell_s * reference.prf_hz))


def stored_name(bins: int) -> str:
    """Give the input's name of the spectrum of this many bins."""
    return f"spectrum of {bins} bins"


def pictures_of(names: Sequence[str]) -> dict[str, Picture]:
    """Give the named pictures, from `PICTURES` and from the spectra of each number in `STORED_BINS`."""
    stored = {
        stored_name(bins): Picture(
            f"Doppler spectrum, {bins} bins",
            (2, bins),
            partial(spectrum_picture, bins=bins),
        )
        for bins in STORED_BINS
    }
    return {name: picture for name, picture in {**PICTURES, **stored}.items() if name in names}


def draw_sets(
    purposes: Mapping[str, int],
    names: Sequence[str],
    reference: Radar,
    *,
    seed: int,
    on_done: OnDone,
    ask: Callable[[str, NDArray[np.complex64], Radar], None],
) -> dict[str, FrontSet]:
    """Draw records of every dwell and keep the named inputs of them.

    Parameters
    ----------
    purposes : mapping of str to int
        Purpose to number of records of each dwell.
    names : sequence of str
        Pictures, and `FEATURES`.
    reference : Radar
    seed : int
    on_done : callable
        Called with the share done.
    ask : callable
        Called in order with every block (purpose, samples, radar), before the samples are dropped.

    Returns
    -------
    dict of str to FrontSet
        Purpose to its set, in which the dwells follow one another.
    """
    pictures = pictures_of(names)
    total = sum(purposes.values()) * sum(DWELLS_S)
    done, sets = 0.0, {}
    for purpose, count in purposes.items():
        kept: dict[str, list[NDArray[np.floating]]] = {name: [] for name in (*names, "radar")}
        labels, snr_db = [], []
        for place, dwell_s in enumerate(DWELLS_S):
            radar = radar_of(dwell_s, reference)
            for at in range(0, count, 300):
                some = min(300, count - at)
                # every dwell draws targets of its own
                records = draw_records(radar, some, seed, purpose=purpose, start=place * count + at)
                for name, picture in pictures.items():
                    # Training inputs may be coarse; test inputs must be exactly what a user would give.
                    dtype = np.float32 if purpose == "test" else np.float16
                    kept[name].append(in_blocks(picture.make, records.iq, radar).astype(dtype, copy=False))
                if FEATURES in names:
                    inputs = model_inputs(
                        records.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=("features",)
                    )
                    kept[FEATURES].append(inputs["features"])
                kept["radar"].append(radar_numbers(radar, some))
                labels.append(records.label_indices)
                snr_db.append(np.asarray(records.truth["snr_db"], np.float64))
                ask(purpose, records.iq, radar)
                done += some * dwell_s
                on_done(done / total)
        sets[purpose] = FrontSet(
            {name: np.concatenate(values) for name, values in kept.items()},
            np.concatenate(labels),
            np.concatenate(snr_db),
            np.repeat(np.arange(len(DWELLS_S)), count),
        )
    return sets


def network_for(picture: Picture, *, seed: int) -> Any:
    """Make an untrained network for a picture: one architecture for spectra, one for pictures with a time axis."""
    from bladewing.models.cnn import ImageNet, SpectrumNet

    shapes = {"picture": picture.shape, "radar": (4,)}
    return SpectrumNet(shapes, seed=seed) if len(picture.shape) == 2 else ImageNet(shapes, seed=seed)


def network_bytes(net: Any) -> bytes:
    """Give the network as ONNX, without calibration."""
    from bladewing.models.calibration import Calibration
    from bladewing.models.export import export_network

    return export_network(net, net.input_shapes, Calibration())


def train_picture(
    name: str, sets: Mapping[str, FrontSet], config: ReportConfig, *, on_done: OnDone
) -> tuple[Callable[[int], NDArray[np.floating]], float]:
    """Train the network of a picture.

    Parameters
    ----------
    name : str
        Of the picture.
    sets : mapping
        "train", "validate" and "test".
    config : ReportConfig
    on_done : callable
        Called with the share done.

    Returns
    -------
    answer : callable
        From the number of bits that each level of the test pictures is stored in to their probabilities (n, 3).
    seconds : float
        Time that the training took [s].
    """
    from bladewing.models.augment import VelocityMirror
    from bladewing.models.calibration import Calibration
    from bladewing.models.training import TrainingData, TrainingOptions, network_scores, train_network

    picture = pictures_of([name])[name]
    net = network_for(picture, seed=config.seed)
    signal, evidence = net.input_shapes

    def inputs(of: str, bits: int = 32) -> dict[str, NDArray]:
        return {signal: quantised(sets[of].inputs[name], bits), evidence: sets[of].inputs["radar"]}

    result = train_network(
        net,
        TrainingData(inputs("train"), sets["train"].labels),
        (inputs("validate"), sets["validate"].labels),
        TrainingOptions(config.front_epochs, batch=_BATCH),
        seed=config.seed,
        augment=VelocityMirror(signal, 2) if picture.has_velocity else None,
        on_epoch=lambda epoch, epochs, _: on_done(epoch / epochs),
    )

    def answer(bits: int) -> NDArray[np.floating]:
        return Calibration().probabilities(network_scores(net, inputs("test", bits)))

    return answer, result.seconds


def train_features(sets: Mapping[str, FrontSet], config: ReportConfig) -> tuple[NDArray[np.floating], bytes, float]:
    """Train boosted trees on the measurements; give the test records' probabilities, the ONNX file and the time [s]."""
    from bladewing.models.calibration import Calibration
    from bladewing.models.export import export_tabular
    from bladewing.models.tabular import tabular_scores, train_boosted

    started = time.perf_counter()
    x = sets["train"].inputs[FEATURES]
    model = train_boosted(x, sets["train"].labels, seed=config.seed)
    seconds = time.perf_counter() - started
    content = export_tabular(model, x.shape[1], FEATURES, Calibration())
    return Calibration().probabilities(tabular_scores(model, sets["test"].inputs[FEATURES])), content, seconds


def classifier_of(name: str, files: Sequence[bytes]) -> Classifier:
    """Open a model's ONNX file, or the two of a cascade."""
    first, *others = files
    return Cascade((first, name), (others[0], name)) if others else Classifier(first, source=name)


def open_choice(kind: str, name: str, files: Sequence[bytes]) -> Answer:
    """Open a choice and return a function that goes all the way from samples to probabilities.

    Parameters
    ----------
    kind : {"picture", "features", "model"}
    name : str
    files : sequence of bytes
        The ONNX file, or the two of a cascade.

    Returns
    -------
    callable
        From samples (n, pulses) and their radar to probabilities (n, 3).
    """
    if kind == "model":
        classifier = classifier_of(name, files)
        return lambda iq, radar: classifier.predict(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz).probabilities
    session = quiet_session(files[0])
    names = [node.name for node in session.get_inputs()]

    def answer(iq: NDArray[np.complex64], radar: Radar) -> NDArray[np.float32]:
        if kind == "features":
            feed = model_inputs(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=(FEATURES,))
        else:
            picture = in_blocks(PICTURES[name].make, iq, radar)
            feed = dict(zip(names, (picture, radar_numbers(radar, len(iq))), strict=True))
        found: NDArray[np.float32] = session.run(["probabilities"], feed)[0]
        return found

    return answer


def prepared(
    kind: str, name: str, files: Sequence[bytes], iq: NDArray[np.complex64], radar: Radar
) -> Callable[[], object]:
    """Open a choice and return a function that answers these samples; for `memory.peak_bytes`."""
    answer = open_choice(kind, name, files)
    return lambda: answer(iq, radar)
