"""Two small convolutional networks, each reading a signal, most often beside other evidence.

Both have the same architecture: strided convolutions over the signal (a stem, then a trunk), a small branch over each
other input (a spectrum of rates, a vector of measurements), and a common head. Between stem and trunk a learned offset
marks each place on the velocity axis, and the evidence sets a gain and an offset of each feature map. After the trunk
each map is reduced to its means in bands of speed (how much there is of a pattern, and how far from rest) and its
maximum (whether it is there). The inputs are standardised inside, by buffers that `EvidenceNet.standardise_by` fills:
the exported model takes raw inputs.
A network may be trained on kinds, each of which belongs to a class; the scores of the classes follow from those of the
kinds. Three classes alone teach too little of what sets a rotor's comb apart from a turbine's and from a wheel's.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from . import WEIGHT_STEPS
from ._checks import CLASS_COUNT, require_finite

_BRANCH = 64
_RATES = (16, 24, 32)  # channels of the convolutions over a spectrum of rates
_SPEED_BANDS = 4  # bands of the velocity's magnitude over the trunk's places
_HEAD = 128  # hidden units of the head; with 48 it was the bottleneck of the network (docs/ablation.md)
_CLIP = 8.0  # standard deviations; beyond them an input says no more than "very much"
_CHUNK = 1024
_LEAST_EXPONENT = -100  # power of two of a weight's step: an output whose step is not above it is rounded to 0


class Standardise(nn.Module):
    """Subtract a mean and divide by a standard deviation, each a buffer; clip at eight standard deviations.

    Parameters
    ----------
    channels
        Number of channels: axis 1 of the input.
    axes
        Number of axes after the channels.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, channels: int, axes: int) -> None:
        super().__init__()
        shape = (1, channels) + (1,) * axes
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("deviation", torch.ones(shape))

    def standardise_by(self, values: NDArray[np.floating]) -> None:
        """Take mean and standard deviation of each channel from a training set.

        Parameters
        ----------
        values
            Shape (n, channels, ...), finite. A channel that does not vary is only centred.
        """
        axes = (0, *range(2, values.ndim))
        count = values.size // values.shape[1]
        chunks = [values[start : start + _CHUNK] for start in range(0, len(values), _CHUNK)]
        mean = sum(chunk.sum(axes, dtype=np.float64, keepdims=True) for chunk in chunks) / count
        variance = sum(((chunk - mean) ** 2).sum(axes, keepdims=True) for chunk in chunks) / count
        deviation = np.sqrt(variance)
        # What is left of a constant after rounding must not be blown up to order 1.
        deviation = np.where(deviation > 1e-6 * np.abs(mean), deviation, 1.0)
        self.mean.copy_(torch.as_tensor(mean))
        self.deviation.copy_(torch.as_tensor(deviation))

    def forward(self, values: Tensor) -> Tensor:
        """Return the standardised values, of the same shape."""
        return ((values - self.mean) / self.deviation).clamp(-_CLIP, _CLIP)


class _Convolution(nn.Sequential):
    """Convolution, batch normalisation, rectifier."""

    def __init__(self, inputs: int, outputs: int, kernel: tuple[int, int], stride: tuple[int, int]) -> None:
        padding = (kernel[0] // 2, kernel[1] // 2)
        super().__init__(
            nn.Conv2d(inputs, outputs, kernel, stride, padding, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
        )
        self.outputs = outputs


class _Residual(nn.Module):
    """Residual block: a convolution added to its input, then a rectifier."""

    def __init__(self, channels: int, kernel: tuple[int, int]) -> None:
        super().__init__()
        padding = (kernel[0] // 2, kernel[1] // 2)
        self.change = nn.Sequential(
            nn.Conv2d(channels, channels, kernel, padding=padding, bias=False), nn.BatchNorm2d(channels)
        )

    def forward(self, values: Tensor) -> Tensor:
        """Return the changed values, of the same shape."""
        return torch.relu(values + self.change(values))


def _left_by(layers: Iterable[nn.Module], places: int) -> tuple[int, int]:
    """Number of maps after layers, and what they leave of `places` along an axis: each stride halves, rounding up."""
    strided = [layer for layer in layers if isinstance(layer, _Convolution)]
    return strided[-1].outputs, -(-places // 2 ** len(strided))


def _branch(shape: tuple[int, ...]) -> nn.Sequential:
    """Layers from evidence to `_BRANCH` numbers: dense for measurements (F,), convolutions for rates (C, B).

    The output of the convolutions is flattened, not averaged, which keeps the place of each rate on the axis: a wing's
    rates are not a rotor's.
    """
    if len(shape) == 1:
        return nn.Sequential(nn.Linear(shape[0], _BRANCH), nn.ReLU())
    convolutions = [
        _Convolution(inputs, outputs, (1, kernel), (1, 2))
        for inputs, outputs, kernel in zip((shape[0], *_RATES[:-1]), _RATES, (7, 5, 5), strict=True)
    ]
    maps, left = _left_by(convolutions, shape[1])
    dense = nn.Linear(maps * left, _BRANCH)
    return nn.Sequential(nn.Unflatten(1, (shape[0], 1)), *convolutions, nn.Flatten(), dense, nn.ReLU())


def _speed_bands(places: int) -> Tensor:
    """Matrix that averages values along a velocity axis in bands of speed, shape (places, bands)."""
    away = torch.arange(places) - (places - 1) / 2
    bands = min(_SPEED_BANDS, (places + 1) // 2)
    own = nn.functional.one_hot((away.abs() / (places / 2) * bands).long(), bands).float()
    return own / own.sum(0)


CLASSES_ALONE = tuple(range(CLASS_COUNT))
"""The kinds of a network that tells only the classes apart: each class is its own kind."""


class EvidenceNet(nn.Module):
    """Network from a signal and other evidence to three scores; the architecture that both networks share.

    Parameters
    ----------
    shapes
        The inputs, name to shape of one record: the signal (C, ...) first, then the evidence, if any: a spectrum of
        rates (C, B), measurements (F,).
    stem, trunk
        Layers over the signal (n, C, H, W), before and after the offsets of place and the evidence are applied.
        Velocity lies along W of a signal of one axis (H is 1), along H of an image.
    kinds
        Class of each kind that the network tells apart, 0 to 2, in rising order.

    Raises
    ------
    ValueError
        Where the kinds are not in rising order, or a class has no kind.
    """

    bands: Tensor

    def __init__(
        self,
        shapes: Mapping[str, tuple[int, ...]],
        stem: nn.Sequential,
        trunk: nn.Sequential,
        kinds: Sequence[int] = CLASSES_ALONE,
    ) -> None:
        super().__init__()
        self.input_shapes, self.kinds = dict(shapes), tuple(kinds)
        if list(self.kinds) != sorted(self.kinds) or set(self.kinds) != set(CLASSES_ALONE):
            raise ValueError(f"kinds is {self.kinds}: it must hold every class, 0 to 2, in rising order")
        signal, *evidence = self.input_shapes.values()
        self.standardise = nn.ModuleDict(
            {name: Standardise(shape[0], len(shape) - 1) for name, shape in self.input_shapes.items()}
        )
        self.flat = len(signal) == 2  # one axis: a height of 1 is put in, since 2-D convolutions run faster than 1-D
        self.stem, self.trunk = stem, trunk
        self.branches = nn.ModuleList(_branch(shape) for shape in evidence)
        maps, places = _left_by(stem, signal[1])
        self.place = nn.Parameter(torch.zeros(maps * places))  # one axis, as every offset has
        self.along = (1, maps, 1, places) if self.flat else (1, maps, places, 1)
        told = _BRANCH * len(evidence)
        self.told = nn.Linear(told, 2 * maps) if told else None
        if self.told is not None:  # start with gain 1 and offset 0
            nn.init.zeros_(self.told.weight)
            nn.init.ones_(self.told.bias[:maps])
            nn.init.zeros_(self.told.bias[maps:])
        width, left = _left_by(trunk, places)
        self.register_buffer("bands", _speed_bands(left))
        seen = (self.bands.shape[1] + 1) * width + told
        # no dropout: of hundreds of thousands of drawn records none is memorised, and dropout costs accuracy
        self.head = nn.Sequential(nn.Linear(seen, _HEAD), nn.ReLU(), nn.Linear(_HEAD, len(self.kinds)))

    def standardise_by(self, inputs: Mapping[str, NDArray[np.floating]]) -> None:
        """Fill the buffers that standardise the inputs from a training set.

        Parameters
        ----------
        inputs
            Input name to array (n, *shape), as `input_shapes` says; finite.

        Raises
        ------
        ValueError
            Where an input is missing, has another shape, or holds NaN or infinity.
        """
        self.require(inputs)
        for name, module in self.standardise.items():
            assert isinstance(module, Standardise)
            module.standardise_by(inputs[name])

    def require(self, inputs: Mapping[str, NDArray[np.floating]]) -> int:
        """Refuse inputs that the network cannot read.

        Parameters
        ----------
        inputs
            Input name to array (n, *shape).

        Returns
        -------
        int
            Number of records n.

        Raises
        ------
        ValueError
            Where an input is missing, has another shape, or holds NaN or infinity.
        """
        counts = set()
        for name, shape in self.input_shapes.items():
            if name not in inputs:
                raise ValueError(f"input {name!r} is missing; the network reads {', '.join(self.input_shapes)}")
            if inputs[name].shape[1:] != shape or not len(inputs[name]):
                raise ValueError(
                    f"input {name!r} has shape {inputs[name].shape}; it must be (n, {str(shape)[1:]}, n > 0"
                )
            require_finite(inputs[name], f"input {name!r}")
            counts.add(len(inputs[name]))
        if len(counts) != 1:
            raise ValueError(f"inputs hold {sorted(counts)} records; they must hold the same number")
        return counts.pop()

    def compact(self) -> None:
        """Fold each batch normalisation into its convolution and round the weights, for good: see `rounded`.

        The network computes in float32 as before, and its weights can be stored in a byte each without further change.
        Call it after training and before calibration, so that every figure is that of the network which is stored.
        """
        self.eval()
        with torch.no_grad():
            for part in self.modules():
                if isinstance(part, nn.Sequential):
                    for place in range(len(part) - 1):
                        convolution, normalisation = part[place], part[place + 1]
                        if isinstance(convolution, nn.Conv2d) and isinstance(normalisation, nn.BatchNorm2d):
                            part[place] = fuse_conv_bn_eval(convolution, normalisation)
                            part[place + 1] = nn.Identity()
            for weights in self.parameters():
                weights.copy_(rounded(weights))

    def forward(self, signal: Tensor, *evidence: Tensor) -> Tensor:
        """Return the scores of the classes.

        Parameters
        ----------
        signal
            First input, raw, shape (n, C, B) or (n, C, H, W).
        evidence
            The other inputs, raw, shape (n, C, B) or (n, F), as many as the network reads.

        Returns
        -------
        Tensor
            Shape (n, 3), in the order uav, bird, clutter.
        """
        return self.class_scores(self.kind_scores(signal, *evidence))

    def class_scores(self, kind_scores: Tensor) -> Tensor:
        """Return the scores of the classes, shape (n, 3): a class has the probability of its kinds together."""
        if self.kinds == CLASSES_ALONE:
            return kind_scores
        # record by record: a logarithm of all at once rounds a record by its place in the batch
        parts = kind_scores.split([self.kinds.count(label) for label in CLASSES_ALONE], 1)
        return torch.cat([part.logsumexp(1, keepdim=True) for part in parts], 1)

    def kind_scores(self, signal: Tensor, *evidence: Tensor) -> Tensor:
        """Return the scores of the kinds, shape (n, kinds); the inputs as in `forward`."""
        signal_name, *names = self.input_shapes
        planes = self.standardise[signal_name](signal)
        beside = [
            branch(self.standardise[name](values))
            for name, branch, values in zip(names, self.branches, evidence, strict=True)
        ]
        maps = self.stem(planes.unsqueeze(2) if self.flat else planes) + self.place.view(self.along)
        if self.told is not None:
            gain, shift = self.told(torch.cat(beside, dim=1)).unflatten(1, (2, -1, 1, 1)).unbind(1)
            maps = maps * gain + shift
        maps = self.trunk(maps)
        along = maps.squeeze(2) if self.flat else maps.mean(3)
        return self.head(torch.cat([(along @ self.bands).flatten(1), maps.amax((2, 3)), *beside], dim=1))


def rounded(weights: Tensor) -> Tensor:
    """Round a layer's weights so that each can be stored in a byte, or its offsets to half precision.

    Parameters
    ----------
    weights
        Finite, outputs on axis 0; a tensor of one axis holds offsets.

    Returns
    -------
    Tensor
        Same shape. The weights of each output are multiples, -`WEIGHT_STEPS` to `WEIGHT_STEPS`, of a step with a
        mantissa of eleven bits.
    """
    if weights.ndim == 1:
        return weights.half().float()
    rows = weights.reshape(len(weights), -1)
    # a mantissa of eleven bits, as in half precision, makes each multiple exact; the exponent may be much lower
    mantissa, exponent = torch.frexp(rows.abs().amax(1, keepdim=True) / WEIGHT_STEPS)
    step = torch.where(exponent > _LEAST_EXPONENT, torch.ldexp((mantissa * 2048).round() / 2048, exponent), 0.0)
    whole = (rows / torch.where(step > 0, step, torch.ones(()))).round().clamp(-WEIGHT_STEPS, WEIGHT_STEPS)
    return (whole * step).reshape(weights.shape)


class SpectrumNet(EvidenceNet):
    """1-D network over the velocity spectrum, alone or beside other evidence.

    About 159 000 parameters and 1.1 million multiplications a record of 10 x 256 beside rates of 2 x 96 and 1 x 64 and
    measurements; three times as wide, 491 000 and 7.3 million.

    Parameters
    ----------
    shapes
        The inputs, name to shape of one record: the spectrum's channels and velocity bins (C, B) first, then the
        evidence, if any, as for `EvidenceNet`.
    seed
        Draws the first weights; the global generator of torch is left as it was.
    widen
        Factor on the channels of the spectrum's layers, 0.5, 1, 2 or 3.
    kinds
        As in `EvidenceNet`.
    """

    def __init__(
        self,
        shapes: Mapping[str, tuple[int, ...]],
        *,
        seed: int,
        widen: float = 1,
        kinds: Sequence[int] = CLASSES_ALONE,
    ) -> None:
        first, second, third, last = (round(widen * channels) for channels in (16, 24, 32, 48))
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            stem = nn.Sequential(
                _Convolution(next(iter(shapes.values()))[0], first, (1, 7), (1, 2)),
                _Convolution(first, second, (1, 5), (1, 2)),
                _Convolution(second, third, (1, 5), (1, 2)),
            )
            trunk = nn.Sequential(
                _Residual(third, (1, 5)), _Convolution(third, last, (1, 5), (1, 2)), _Residual(last, (1, 5))
            )
            super().__init__(shapes, stem, trunk, kinds)


class ImageNet(EvidenceNet):
    """2-D network over a joint image, alone or beside other evidence.

    About 65 000 parameters and 1.1 million multiplications a record of 1 x 64 x 32 beside measurements.

    Parameters
    ----------
    shapes
        The inputs, name to shape of one record: the image's channels, height and width (C, H, W) first, then the
        evidence, if any, as for `EvidenceNet`.
    seed
        Draws the first weights; the global generator of torch is left as it was.
    kinds
        As in `EvidenceNet`.
    """

    def __init__(
        self, shapes: Mapping[str, tuple[int, ...]], *, seed: int, kinds: Sequence[int] = CLASSES_ALONE
    ) -> None:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            stem = nn.Sequential(
                _Convolution(next(iter(shapes.values()))[0], 8, (5, 5), (2, 2)), _Convolution(8, 16, (3, 3), (2, 2))
            )
            trunk = nn.Sequential(
                _Residual(16, (3, 3)),
                _Convolution(16, 32, (3, 3), (2, 2)),
                _Residual(32, (3, 3)),
                _Convolution(32, 48, (3, 3), (2, 2)),
            )
            super().__init__(shapes, stem, trunk, kinds)
