"""From slow-time IQ to spectra, measurements and model inputs: arrays in, arrays out."""

from .inputs import model_inputs
from .schema import FEATURES, INPUT_SHAPES, JOINT_FEATURES, Feature, schema_hash
from .spectrum import Spectrum, doppler_spectrum

__all__ = [
    "FEATURES",
    "INPUT_SHAPES",
    "JOINT_FEATURES",
    "Feature",
    "Spectrum",
    "doppler_spectrum",
    "model_inputs",
    "schema_hash",
]
