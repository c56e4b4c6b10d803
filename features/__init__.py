"""From slow-time IQ to spectra, measurements and model inputs: arrays in, arrays out."""

from .acceleration import body_acceleration, without_acceleration
from .inputs import model_inputs
from .measure import measure
from .measurements import Measurements
from .schema import FEATURES, INPUT_SHAPES, JOINT_FEATURES, Feature, schema_hash
from .spectrum import Spectrum, doppler_spectrum

__all__ = [
    "FEATURES",
    "INPUT_SHAPES",
    "JOINT_FEATURES",
    "Feature",
    "Measurements",
    "Spectrum",
    "body_acceleration",
    "doppler_spectrum",
    "measure",
    "model_inputs",
    "schema_hash",
    "without_acceleration",
]
