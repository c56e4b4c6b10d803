"""What model inputs cost, in units of what no spectrum can do without: one FFT of the dwell, complex64."""

from collections.abc import Callable
from functools import partial

import pytest
from bladewing.features import model_inputs
from bladewing.simulate import Radar, draw_records
from scipy import fft

from .ratios import cpu_seconds, table

RADAR = Radar(9.85e9, 25e3, 2048)
INPUTS = {
    "features and spectrum": ("features", "spectrum"),
    "features": ("features",),
    "spectrum": ("spectrum",),
    "joint features and image": ("joint_features", "image"),
}


@pytest.mark.parametrize("records", [1, 64])
def test_model_inputs_against_one_fft(records):
    iq = draw_records(RADAR, records, 0, purpose="bench").iq
    axes = {"carrier_hz": RADAR.carrier_hz, "prf_hz": RADAR.prf_hz}
    repeats = 200 // records + 1

    def again(call: Callable[[], object], times: int) -> Callable[[], None]:
        def calls() -> None:
            for _ in range(times):
                call()

        return calls

    candidates = {"one FFT": again(lambda: fft.fft(iq), 10 * repeats)}
    for title, names in INPUTS.items():
        candidates[title] = again(partial(model_inputs, iq, **axes, names=names), repeats)
    spent = cpu_seconds(candidates)
    each = {name: seconds / repeats / records for name, seconds in spent.items()}
    each["one FFT"] /= 10
    rows = [(name, f"{cost / each['one FFT']:.1f}", f"{cost * 1e6:.0f}") for name, cost in each.items()]
    table(f"Features of {records}: batches of {records} x 2048 pulses", ("", "x FFT", "us a record"), rows)
