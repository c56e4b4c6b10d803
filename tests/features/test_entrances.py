"""What every way into the features refuses, and that a frequency's type does not matter."""

from functools import partial

import numpy as np
import pytest
from bladewing.features import body_acceleration, doppler_spectrum, measure, model_inputs, without_acceleration
from bladewing.features.heave import heave
from bladewing.features.steady_comb import steady_comb
from bladewing.features.stft import stft
from bladewing.features.wingbeat import wingbeat

from .signals import PRF_HZ, RADAR, rotors

ENTRANCES = {
    "body_acceleration": body_acceleration,
    "doppler_spectrum": doppler_spectrum,
    "heave": heave,
    "measure": measure,
    "model_inputs": model_inputs,
    "steady_comb": steady_comb,
    "stft": stft,
    "wingbeat": wingbeat,
    "without_acceleration": partial(without_acceleration, acceleration_mps2=np.zeros(())),
}


@pytest.mark.parametrize("entrance", ENTRANCES.values(), ids=list(ENTRANCES))
@pytest.mark.parametrize(
    ("iq", "radar", "match"),
    [
        (np.ones((), complex), {}, "its last axis must hold at least"),
        (np.ones((3, 0), complex), {}, "its last axis must hold at least"),
        (np.ones(900), {}, "must be complex"),
        (np.ma.array(np.ones(900, complex), mask=np.arange(900) == 3), {}, "masked"),
        (np.ones(900, complex), {"prf_hz": 0.0}, "is 0"),
        (np.ones(900, complex), {"carrier_hz": np.nan}, "is nan"),
    ],
    ids=["no axis", "no pulse", "real", "masked", "prf", "carrier"],
)
def test_what_is_no_recording_is_refused(entrance, iq, radar, match):
    with pytest.raises(ValueError, match=match):
        entrance(iq, **RADAR | radar)


def test_frequencies_of_single_precision_lose_no_digit_of_what_is_measured():
    """Both are whole numbers that float32 holds; what is worked out from them must not be rounded to it."""
    iq = rotors([57.7])
    radar = {"carrier_hz": np.float32(9.984e9), "prf_hz": np.float32(PRF_HZ)}
    own = measure(iq, **radar)
    same = measure(iq, **{name: float(value) for name, value in radar.items()})
    assert own.chopping_hz == same.chopping_hz
    assert own.tip_speed_mps == same.tip_speed_mps
    assert stft(iq, **radar).frame_rate_hz == stft(iq, carrier_hz=9.984e9, prf_hz=PRF_HZ).frame_rate_hz
    pull = body_acceleration(iq, **radar)
    assert pull[1] == body_acceleration(iq, **{name: float(value) for name, value in radar.items()})[1]
