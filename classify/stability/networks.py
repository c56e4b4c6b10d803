"""Stages of the models: networks in float32, int8 and ONNX against float64, softmax against mpmath."""

import copy
from collections.abc import Callable, Iterator
from typing import Any

import mpmath
import numpy as np
import torch
from bladewing.features import INPUT_SHAPES, model_inputs
from bladewing.models import LADDER
from bladewing.models.calibration import Calibration, softmax
from bladewing.models.cnn import EvidenceNet, ImageNet, SpectrumNet
from bladewing.models.export import export_network, in_eight_bits
from bladewing.models.session import quiet_session
from bladewing.models.training import network_scores
from bladewing.simulate import Radar, draw_records
from numpy.typing import NDArray

from .cell import Cell, sweep

Inputs = dict[str, NDArray[np.float32]]

_CLIP_GUARD = "standardised inputs are clipped at eight deviations"
_NETS: tuple[tuple[type[EvidenceNet], tuple[str, ...]], ...] = (
    (SpectrumNet, LADDER["spectrum-cnn"].inputs),
    (ImageNet, LADDER["image-cnn"].inputs),
)


def cells(quick: bool) -> Iterator[Cell]:
    """Measure every cell of these stages; `quick` leaves out the second network."""
    yield from _softmax()
    for make, names in _NETS[: 1 if quick else 2]:
        yield from _network(make, names)


def _softmax_error(scores: tuple[float, ...], calibration: Calibration | None = None) -> float:
    found = softmax(np.array(scores)) if calibration is None else calibration.probabilities(np.array(scores))
    scale, bias = (1.0, (0.0,) * 3) if calibration is None else (calibration.scale, calibration.bias)
    with mpmath.workdps(50):
        lifted = [mpmath.mpf(scale) * mpmath.mpf(s) + mpmath.mpf(b) for s, b in zip(scores, bias, strict=True)]
        powers = [mpmath.exp(s - max(lifted)) for s in lifted]
        total = mpmath.fsum(powers)
        return max(float(abs(p / total - mpmath.mpf(float(q)))) for p, q in zip(powers, found, strict=True))


def _softmax() -> Iterator[Cell]:
    measured, guard = "largest error of a probability [1]", "the largest score is taken off first"
    sizes = [0.0, 1e-300, 1.0, 700.0, 1e4, 1e38, 1e300, 1.7e308]
    yield from sweep(
        "softmax", "score", sizes, measured, 1e-12, guard, lambda size: _softmax_error((size, -size, size / 3))
    )
    yield from sweep(
        "calibration",
        "scale",
        [1e-300, 1e-6, 1.0, 1e6, 1e300],
        measured,
        1e-12,
        guard + "; scale and bias must be finite",
        lambda scale: _softmax_error((3.0, -1.0, 2.5), Calibration(scale, (0.3, -0.1, -0.2))),
    )


def _network(make: Any, names: tuple[str, ...]) -> Iterator[Cell]:
    """Measure one network with random weights, standardised on simulated records, in every form in which it runs."""
    radar = Radar(9.85e9, 25e3, 1000)
    inputs = model_inputs(
        draw_records(radar, 48, 0, purpose="bench").iq,
        carrier_hz=radar.carrier_hz,
        prf_hz=radar.prf_hz,
        names=names,
    )
    shapes = {name: INPUT_SHAPES[name] for name in names}
    net: EvidenceNet = make(shapes, seed=0)
    net.standardise_by(inputs)
    exact = copy.deepcopy(net).double().eval()

    def reference(given: Inputs) -> NDArray[np.float64]:
        with torch.inference_mode():
            scores = exact(*(torch.as_tensor(given[name]).double() for name in names))
        return softmax(scores.numpy())

    onnx_bytes = export_network(net, shapes, Calibration())
    forms: dict[str, tuple[float, Callable[[Inputs], NDArray]]] = {
        "float32": (1e-4, lambda given: softmax(network_scores(net, given))),
        "ONNX": (1e-4, _runner(onnx_bytes)),
        # The limit is coarse by design: weights and activations have eight bits.
        "int8": (0.1, _runner(in_eight_bits(onnx_bytes))),
    }
    for form, (limit, run) in forms.items():
        yield from _forms(f"{names[0]} network, {form}", limit, run, reference, inputs)


def _forms(
    stage: str,
    limit: float,
    run: Callable[[Inputs], NDArray],
    reference: Callable[[Inputs], NDArray],
    inputs: Inputs,
) -> Iterator[Cell]:
    measured = "largest error of a probability against float64 [1]"
    yield from sweep(
        stage,
        "inputs times",
        [1e-38, 1e-6, 1.0, 10.0, 1e6, 1e30],
        measured,
        limit,
        _CLIP_GUARD,
        lambda factor: _difference(run, reference, {k: v * np.float32(factor) for k, v in inputs.items()}),
    )
    yield from sweep(
        stage,
        "records at once",
        [1, len(next(iter(inputs.values())))],
        measured,
        limit,
        "only the batch's axis is free",
        lambda count: _difference(run, reference, {k: v[:count] for k, v in inputs.items()}),
        "{:d}".format,
    )


def _difference(run: Callable[[Inputs], NDArray], reference: Callable[[Inputs], NDArray], given: Inputs) -> float:
    return float(np.abs(run(given) - reference(given)).max())


def _runner(onnx_bytes: bytes) -> Callable[[Inputs], NDArray[np.float32]]:
    session = quiet_session(onnx_bytes)
    return lambda given: session.run(["probabilities"], given)[0]
