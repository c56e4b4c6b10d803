"""Time to measure the dwells of a long recording on all processors, compared with one process."""

import time
from dataclasses import fields

import numpy as np
from bladewing.classify import measure_dwells as module
from bladewing.classify.workers import workers_at_hand
from bladewing.features import Measurements

from .ratios import table
from .records import RADAR, record

DWELLS = 300


def test_dwells_on_all_processors_against_one_process(monkeypatch):
    rng = np.random.default_rng(5)
    iq = np.stack([record(rng, rng.uniform(50, 70, 1), snr_db=10, body_db=20, velocity_mps=7) for _ in range(DWELLS)])
    seconds, found = [], []
    for alone_s in (np.inf, module.ALONE_S):
        monkeypatch.setattr(module, "ALONE_S", alone_s)
        started = time.perf_counter()
        found.append(module.measure_dwells(iq, on_record=lambda _: None, **RADAR))
        seconds.append(time.perf_counter() - started)
    for field in fields(Measurements):
        one, other = (getattr(each, field.name) for each in found)
        np.testing.assert_array_equal(other, one, field.name)
    names = ("one process", f"{workers_at_hand()} processors, {module.ALONE_S:g} s alone first")
    rows = [(name, f"{s / seconds[0]:.2f}", f"{s / DWELLS * 1e3:.1f}") for name, s in zip(names, seconds, strict=True)]
    table(f"Measure: {DWELLS} dwells of one rotor", ("", "x one process", "ms a dwell"), rows)
