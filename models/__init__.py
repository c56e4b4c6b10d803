"""Models: arrays in, scores and self-contained ONNX bytes out; nothing here knows a radar or a file.

Six models stand on a ladder from a few microseconds to a few tens of microseconds a record, so that a report
can say what each step buys (`LADDER`). Their outputs are always in the order uav, bird, clutter.

Modules
-------
tabular
    Logistic regression and boosted trees on a vector of measurements.
cnn
    Small convolutional networks on the velocity spectrum or on the joint image, each beside its vector of measurements.
training, augment
    The loop that trains a network, and the mirrored radial velocity it may train on.
calibration
    From scores to probabilities that mean what they say, and the thresholds below which the answer is "unknown".
export, seal
    ONNX with the calibration inside, and the seal that shows any later change of a byte.

Importing this package or `seal` imports no training library.
"""

LADDER: dict[str, tuple[str, ...]] = {
    "features-linear": ("features",),
    "features-boosted": ("features",),
    "spectrum-cnn": ("spectrum", "features"),
    "spectrum-cnn-wide": ("spectrum", "features"),
    "joint-boosted": ("joint_features",),
    "image-cnn": ("image", "joint_features"),
}
"""Model names (the stem of the file) and the inputs that each one reads."""

DEFAULT_MODEL = "spectrum-cnn"
"""The model that is used where none is named."""
