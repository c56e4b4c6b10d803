from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from bladewing.classify import measure_dwells as module
from bladewing.classify.measure_dwells import measure_dwells
from bladewing.classify.workers import in_order
from bladewing.features import measure

from ..features.signals import PULSES, RADAR, rotors, white


@pytest.fixture(scope="module")
def dwells():
    rng = np.random.default_rng(7)
    turning = [10 ** (snr_db / 20) * rotors(rates_hz) for rates_hz, snr_db in (((57.0,), 0), ((56.6, 58.0), 10))]
    heard = [echo + white(rng, PULSES) for echo in (*turning, np.zeros(PULSES))]
    return np.stack([*heard, np.zeros(PULSES), white(rng, PULSES)]).astype(np.complex64)


@pytest.mark.parametrize(("alone_s", "workers"), [(1e-3, None), (1e9, 1)], ids=["shared", "alone"])
def test_dwells_are_measured_alike_by_one_process_and_by_several(dwells, monkeypatch, alone_s, workers):
    asked, said = [], []

    def watched(work, tasks, workers):
        asked.append((len(tasks), workers))
        return in_order(work, tasks, 2 if workers is None else workers)

    monkeypatch.setattr(module, "in_order", watched)
    monkeypatch.setattr(module, "ALONE_S", alone_s)
    monkeypatch.setattr(module, "TASK_S", 1e-3)
    found = measure_dwells(dwells, on_record=said.append, **RADAR, blades=2, beta_rad=0.1)
    together = measure(dwells, **RADAR, blades=2, beta_rad=0.1)
    for field in fields(together):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(together, field.name), field.name)
    assert not found.length_is_lower_bound
    assert said == list(range(1, len(dwells) + 1))
    assert asked == [(len(dwells) - 1, None) if workers is None else (0, 1)]


def test_an_error_of_a_dwell_is_told(dwells, monkeypatch):
    monkeypatch.setattr(module, "ALONE_S", 1e-3)
    with pytest.raises(ValueError, match="blades is 0"):
        measure_dwells(dwells, on_record=lambda _: None, **RADAR, blades=0)


def test_a_clock_that_stands_still_stops_nothing(monkeypatch):
    """Some count in steps of 16 ms, in which a dwell of noise is measured."""
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: 0.0, perf_counter=lambda: 0.0))
    done = []
    iq = white(np.random.default_rng(3), 3, 600).astype(np.complex64)
    assert len(measure_dwells(iq, on_record=done.append, **RADAR).reason) == 3
    assert done == [1, 2, 3]
