"""Models: arrays in, scores and self-contained ONNX bytes out; nothing here knows a radar or a file.

The models form a ladder of rising cost (`LADDER`), from tens of microseconds a record, so that a report can say what
each step gains. Their outputs are always in the order uav, bird, clutter.

Modules
-------
tabular
    Logistic regression and boosted trees on a vector of measurements.
cnn
    Small convolutional networks on the velocity spectrum or on the joint image, most beside a vector of measurements.
training, training_state, augment
    The loop that trains a network, its state between two epochs as plain arrays, and the augmentation that mirrors the
    radial velocity.
muon
    The optimiser of matrices and kernels.
calibration
    Calibrated probabilities from scores, and the thresholds below which the answer is "unknown".
operating
    The threshold for a false-alarm rate, and the detection probability that remains.
export, seal
    ONNX with the calibration inside, and the seal that shows any later change of a byte.
session
    Opens a model's onnxruntime session.

Importing this package, `seal` or `session` imports no training library.
"""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Rung:
    """A model of the ladder.

    Parameters
    ----------
    learner
        What is trained: logistic regression, boosted trees or a convolutional network.
    inputs
        Names of its inputs; of a network's inputs the signal comes first.
    widen
        Factor on the channels of a network.
    """

    learner: Literal["linear", "boosted", "network"]
    inputs: tuple[str, ...]
    widen: float = 1.0


_ALL_EVIDENCE = ("spectrum", "cadence", "combs", "features")

LADDER: dict[str, Rung] = {
    "features-linear": Rung("linear", ("features",)),
    "features-boosted": Rung("boosted", ("features",)),
    "spectrum-cnn-fast": Rung("network", ("levels", "cadence", "combs")),
    "spectrum-cnn": Rung("network", _ALL_EVIDENCE),
    "spectrum-cnn-wide": Rung("network", _ALL_EVIDENCE, widen=2),
    "spectrum-cnn-teacher": Rung("network", _ALL_EVIDENCE, widen=3),
    "joint-boosted": Rung("boosted", ("joint_features",)),
    "image-cnn": Rung("network", ("image", "joint_features")),
}
"""Model name (the stem of its file) to its rung."""

TEACHER = "spectrum-cnn-teacher"
"""The teacher: where it is trained in the same run, the other networks learn from its answers besides the labels."""

DEFAULT_MODEL = "spectrum-cnn-wide"
"""The model that is used where none is named."""

KIND_SCORES = "kind_scores"
"""Name of the output with the raw scores of the kinds, which networks that tell kinds apart give beside the scores."""

WEIGHT_STEPS = 127
"""Largest multiple of the quantisation step, to either side of 0, of a network's weights that take a byte each."""
