"""What a user would pick instead: a ResNet-18 on spectrogram pictures, MiniRocket on the spectrum, the paper's rule.

Each is prepared as its users would: samples are turned into what it reads, it is trained on records, and gives scores.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import onnxruntime
import torch
from bladewing.features.bandwidth import threshold_band_hz
from bladewing.features.inputs import model_inputs
from bladewing.features.spectrum import doppler_spectrum
from bladewing.models.export import _quiet_converters
from bladewing.simulate import Radar
from numpy.typing import NDArray
from scipy import fft
from torch import Tensor, nn

Samples = NDArray[np.complex64]
Arrays = NDArray[np.float32]

#: WINDOW [samples], OVERLAP: the spectrogram's, the paper's first setting; SIDE: the picture's side [pixels].
WINDOW, OVERLAP, SIDE = 80, 0.9, 64

#: The paper's threshold over the floor for measured data [dB].
RULE_DB = 20.0


@dataclass(frozen=True)
class Baseline:
    """A pipeline: its name, a function from one radar's samples to what it reads, and a training; scores are (n, 3)."""

    words: str
    read: Callable[[Samples, Radar], Arrays]
    train: Callable[[Arrays, NDArray[np.int64], int], Callable[[Arrays], NDArray[np.floating]]]


def spectrogram(iq: Samples, radar: Radar) -> Arrays:
    """Make pictures of SIDE x SIDE levels [dB over their own median] for any radar: frequency over the PRF, time."""
    window = min(WINDOW, iq.shape[-1] // 2)
    hop = max(1, round(window * (1 - OVERLAP)))
    frames = np.lib.stride_tricks.sliding_window_view(iq, window, axis=-1)[:, ::hop]
    power = np.abs(fft.fftshift(fft.fft(frames * np.hanning(window).astype(np.float32), axis=-1), axes=-1)) ** 2
    level = 10 * np.log10(np.maximum(power, 1e-6 * power.mean(axis=(1, 2), keepdims=True) + 1e-30))
    level -= np.median(level, axis=(1, 2), keepdims=True)
    picture = nn.functional.interpolate(torch.from_numpy(level.astype(np.float32))[:, None], (SIDE, SIDE), mode="area")
    return picture.numpy()


class _Block(nn.Module):
    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.change = nn.Sequential(
            nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(),
            nn.Conv2d(outputs, outputs, 3, 1, 1, bias=False),
            nn.BatchNorm2d(outputs),
        )
        same = inputs == outputs and stride == 1
        self.around = (
            nn.Identity()
            if same
            else nn.Sequential(nn.Conv2d(inputs, outputs, 1, stride, bias=False), nn.BatchNorm2d(outputs))
        )

    def forward(self, values: Tensor) -> Tensor:
        return torch.relu(self.change(values) + self.around(values))


def resnet18() -> nn.Sequential:
    """The 18-layer residual network of He et al. (2016), for pictures of one channel and three classes."""
    stages = [_Block(64, 64, 1), _Block(64, 64, 1)]
    for width in (128, 256, 512):
        stages += [_Block(width // 2, width, 2), _Block(width, width, 1)]
    return nn.Sequential(
        nn.Conv2d(1, 64, 7, 2, 3, bias=False),
        nn.BatchNorm2d(64),
        nn.ReLU(),
        nn.MaxPool2d(3, 2, 1),
        *stages,
        nn.AdaptiveAvgPool2d(1),
        nn.Flatten(),
        nn.Linear(512, 3),
    )


def train_resnet(pictures: Arrays, labels: NDArray[np.int64], epochs: int) -> Callable[[Arrays], NDArray[np.floating]]:
    """Train with AdamW on a one-cycle schedule, and answer through onnxruntime."""
    torch.manual_seed(0)
    net = resnet18()
    x, y = torch.from_numpy(pictures / 20), torch.from_numpy(labels)
    batch = 128
    steps = epochs * (len(x) // batch)
    optimiser = torch.optim.AdamW(net.parameters(), weight_decay=0.05)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-3, total_steps=steps)
    net.train()
    for _ in range(epochs):
        order = torch.randperm(len(x))
        for start in range(0, len(x) - batch + 1, batch):
            rows = order[start : start + batch]
            optimiser.zero_grad()
            turned = x[rows].flip(2) if torch.rand(()) < 0.5 else x[rows]
            nn.functional.cross_entropy(net(turned), y[rows]).backward()
            optimiser.step()
            schedule.step()
    with _quiet_converters():
        program = torch.onnx.export(
            net.eval(), (x[:2],), dynamo=True, dynamic_shapes=({0: torch.export.Dim("n")},), verbose=False
        )
    assert program is not None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(program.model_proto.SerializeToString(), options)
    (reads,) = (node.name for node in session.get_inputs())

    def answer(given: Arrays) -> NDArray[np.floating]:
        parts = [given[start : start + 64] / np.float32(20) for start in range(0, len(given), 64)]
        return np.concatenate([session.run(None, {reads: part})[0] for part in parts])

    return answer


def levels(iq: Samples, radar: Radar) -> Arrays:
    """Give the product's own spectrum on the velocity axis, the best input that MiniRocket could be given."""
    return model_inputs(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz, names=("spectrum",))["spectrum"]


def train_minirocket(series: Arrays, labels: NDArray[np.int64], _: int) -> Callable[[Arrays], NDArray[np.floating]]:
    """MiniRocket (Dempster et al. 2021) with its 10 000 features and a ridge classifier, as its authors advise."""
    from aeon.transformations.collection.convolution_based import MiniRocket
    from sklearn.linear_model import RidgeClassifierCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    model = make_pipeline(
        MiniRocket(random_state=0, n_jobs=1),
        StandardScaler(with_mean=False),
        RidgeClassifierCV(alphas=np.logspace(-2, 4, 7)),
    )
    model.fit(series, labels)
    return model.decision_function


def rule_values(iq: Samples, radar: Radar) -> Arrays:
    """Read off a spectrum what the paper does: the band over its threshold [m/s] and the spacing of two lines [Hz].

    The band is that of the threshold rule. The lines are the first two local maxima over the threshold on the positive
    side of the strongest line.
    """
    spectrum = doppler_spectrum(iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    low_hz, high_hz = threshold_band_hz(spectrum, RULE_DB)
    power = spectrum.relative_power
    line = np.zeros(power.shape, bool)
    line[:, 1:-1] = (power[:, 1:-1] > power[:, :-2]) & (power[:, 1:-1] >= power[:, 2:])
    line &= power > 10 ** (RULE_DB / 10)
    body = power.argmax(axis=1)
    distance_hz = np.zeros(len(power))
    for row, (marks, first) in enumerate(zip(line, body, strict=True)):
        right = np.flatnonzero(marks[first + 1 :])[:2]
        if len(right) == 2:
            distance_hz[row] = (right[1] - right[0]) * radar.prf_hz / spectrum.bins
    width_mps = (high_hz - low_hz) * spectrum.wavelength_m / 2
    return np.stack([width_mps, distance_hz], axis=1).astype(np.float32)


def train_rule(values: Arrays, labels: NDArray[np.int64], _: int) -> Callable[[Arrays], NDArray[np.floating]]:
    """Train thresholds on band and line spacing: the paper names none, so a tree of up to eight leaves is fitted."""
    from sklearn.tree import DecisionTreeClassifier

    return DecisionTreeClassifier(max_leaf_nodes=8, random_state=0).fit(values, labels).predict_proba


BASELINES = {
    "resnet18": Baseline("ResNet-18 on spectrograms", spectrogram, train_resnet),
    **({"minirocket": Baseline("MiniRocket on the spectrum", levels, train_minirocket)} if find_spec("aeon") else {}),
    "rule": Baseline("the paper's thresholds", rule_values, train_rule),
}
