"""Models: arrays in, scores and self-contained ONNX bytes out; nothing here knows a radar or a file.

The models stand on a ladder from tens of microseconds a record upwards, so that a report can say what each step buys
(`LADDER`). Their outputs are always in the order uav, bird, clutter.

Modules
-------
tabular
    Logistic regression and boosted trees on a vector of measurements.
cnn
    Small convolutional networks on the velocity spectrum or on the joint image, most beside a vector of measurements.
training, training_state, augment
    The loop that trains a network, where it stands between two epochs as plain arrays, and the mirrored radial velocity
    it may train on.
muon
    The optimiser of matrices and kernels.
calibration
    From scores to probabilities that mean what they say, and the thresholds below which the answer is "unknown".
operating
    The threshold for a false-alarm rate, and what detection remains.
export, seal
    ONNX with the calibration inside, and the seal that shows any later change of a byte.
session
    How a model's session is opened.

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
        Names of what it reads; a network's signal first.
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
"""Name of a model (the stem of its file) to what it is."""

TEACHER = "spectrum-cnn-teacher"
"""The network whose answers the others learn from besides the labels, where it is trained in the same run."""

DEFAULT_MODEL = "spectrum-cnn-wide"
"""The model that is used where none is named."""

KIND_SCORES = "kind_scores"
"""What a network that knows kinds calls their raw scores, beside those of the classes."""

WEIGHT_STEPS = 127
"""Steps of a network's weights that are stored in a byte each, to either side of 0."""
