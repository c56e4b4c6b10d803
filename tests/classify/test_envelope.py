import json
import re
from dataclasses import asdict

import pytest
from bladewing.classify.envelope import Envelope
from hypothesis import example, given
from hypothesis import strategies as st

ENVELOPE = Envelope()
C_MPS = 299_792_458.0


@pytest.mark.parametrize(
    ("carrier_hz", "prf_hz", "pulses", "said"),
    [
        (9.39e9, 1e3, 1000, "unambiguous velocity 8.0 m/s is below 10 m/s (wavelength x PRF / 4): "
                            "raise the PRF to 1253 Hz or more"),
        (1.2e9, 10e3, 1000, "carrier 1.2 GHz is outside 2 to 100 GHz, the bands that models are trained for: "
                            "of others nothing is known"),
        (101e9, 100e3, 1000, "carrier 101 GHz is outside 2 to 100 GHz, the bands that models are trained for: "
                             "of others nothing is known"),
        (24.125, 10e3, 1000, "carrier 24.125 Hz is no radar's: give 24.125 GHz as 24.125e9"),
        (9850.0, 10e3, 1000, "carrier 9850 Hz is no radar's: give 9850 MHz as 9850e6"),
        (25e3, 9.85e9, 1000, "carrier 25000 Hz and PRF 9.85e+09 Hz stand in each other's place: exchange them"),
        (3e9, 25.0, 1000, "PRF 25 Hz is below 1000 Hz: give 25 kHz as 25e3, or raise the PRF to 1000 Hz or more"),
        (3e9, 999.0, 1000, "PRF 999 Hz is below 1000 Hz: raise the PRF to 1000 Hz or more"),
        (10e9, 999.0, 1000, "PRF 999 Hz is below 1000 Hz: raise the PRF to 1335 Hz or more"),
        (10e9, 250e3, 1000, "PRF 250000 Hz is above 100000 Hz: sum every 3 pulses into one, "
                            "for a PRF of 83333.3 Hz (PRF / 3)"),
        (10e9, 20e6, 1000, "PRF 2e+07 Hz is above 100000 Hz: of a pulsed or FMCW radar give one range cell, one sample "
                           "a pulse or chirp, and their rate; of CW alone sum every 200 samples into one, "
                           "for a PRF of 100000 Hz (PRF / 200)"),
        (10e9, 5e3, 63, "63 pulses are fewer than 64: take 64 pulses, 0.0128 s, or more (dwell = pulses / PRF)"),
        (10e9, 50e3, 63, "63 pulses are fewer than 64: take 250 pulses, 0.005 s, or more (dwell = pulses / PRF)"),
        (10e9, 20e3, 99, "dwell 4.95 ms is below 5 ms: take 100 pulses, 0.005 s, or more (dwell = pulses / PRF)"),
        (10e9, 20e3, 70_000, "70000 pulses are more than 65536: take dwells of 3.276 s or less (dwell = pulses / PRF)"),
        (3e9, 90e3, 70_000, "70000 pulses are more than 65536: "
                            "take dwells of 0.7281 s or less (dwell = pulses / PRF)"),
        (10e9, 10e3, 60_000, "dwell 6 s is above 5 s: take dwells of 5 s or less (dwell = pulses / PRF)"),
    ],
)  # fmt: skip
def test_the_reason_names_value_rule_and_cure(carrier_hz, prf_hz, pulses, said):
    assert ENVELOPE.reason(carrier_hz, prf_hz, pulses) == said


@pytest.mark.parametrize(
    ("carrier_hz", "prf_hz", "pulses"),
    [
        (2e9, 1e3, 64),
        (100e9, 100e3, 500),
        (10e9, 25e3, 125),
        (10e9, 50e3, 65536),
        (10e9, 20e3, 40_000),
    ],
)
def test_the_limits_themselves_are_inside(carrier_hz, prf_hz, pulses):
    assert ENVELOPE.reason(carrier_hz, prf_hz, pulses) is None


@given(st.floats(7.5e9, 100e9))
def test_the_smallest_unambiguous_velocity_is_inside_whatever_the_last_bit_says(carrier_hz):
    prf_hz = 4 * 10 * carrier_hz / C_MPS
    assert ENVELOPE.reason(carrier_hz, prf_hz, 500) is None


@given(st.floats(2e9, 100e9), st.floats(100, 1e6), st.integers(1, 100_000))
def test_inside_exactly_where_every_rule_holds(carrier_hz, prf_hz, pulses):
    unambiguous_mps = C_MPS / carrier_hz * prf_hz / 4
    margin = min(
        prf_hz / 1e3,
        100e3 / prf_hz,
        pulses / 64,
        65536 / pulses,
        pulses / prf_hz / 5e-3,
        5 * prf_hz / pulses,
        unambiguous_mps / 10,
    )
    reason = ENVELOPE.reason(carrier_hz, prf_hz, pulses)
    if margin > 1 + 1e-6:
        assert reason is None
    elif margin < 1 - 1e-6:
        assert reason is not None


@given(st.floats(2e9, 100e9), st.floats(10, 1e6), st.integers(1, 200_000))
@example(2e9, 1000.75, 5004)  # 5 s are 5003.75 pulses
def test_who_follows_the_cures_gets_inside(carrier_hz, prf_hz, pulses):
    for _ in range(4):
        reason = ENVELOPE.reason(carrier_hz, prf_hz, pulses)
        if reason is None:
            return
        if match := re.search(r"raise the PRF to (\d+) Hz", reason):
            prf_hz = float(match[1])
        elif match := re.search(r"sum every (\d+) pulses into one", reason):
            prf_hz, pulses = prf_hz / int(match[1]), max(1, pulses // int(match[1]))
        elif match := re.search(r"take (\d+) pulses", reason):
            pulses = int(match[1])
        elif match := re.search(r"take dwells of (\S+) s or less", reason):
            pulses = round(float(match[1]) * prf_hz * (1 - 1e-9))
    assert ENVELOPE.reason(carrier_hz, prf_hz, pulses) is None


@given(st.floats(1e3, 1e5), st.integers(1, 499))
def test_the_dwell_in_seconds_is_long_enough_when_rounded_to_pulses(prf_hz, pulses):
    reason = ENVELOPE.reason(2e9, prf_hz, pulses)
    if reason is not None:
        match = re.search(r"take (\d+) pulses, (\S+) s, or more", reason)
        assert match is not None, reason
        assert round(float(match[2]) * prf_hz) >= int(match[1])


def test_json_and_back():
    envelope = Envelope(prf_min_hz=5e3, pulses_min=128)
    assert Envelope.from_json(envelope.to_json()) == envelope
    assert json.loads(envelope.to_json()) == asdict(envelope)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"prf_min_hz": None}, "prf_min_hz is None: it must be a number above 0"),
        ({"prf_min_hz": -1}, "prf_min_hz is -1"),
        ({"pulses_min": "64"}, "pulses_min is '64'"),
        ({"snr_min_db": 3}, "the envelope must hold carrier_max_hz, .* it is"),
    ],
)
def test_a_damaged_envelope_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        Envelope.from_json(json.dumps(asdict(ENVELOPE) | change))


def test_a_missing_limit_is_refused():
    limits = asdict(ENVELOPE)
    del limits["dwell_min_s"]
    with pytest.raises(ValueError, match="the envelope must hold carrier_max_hz"):
        Envelope.from_json(json.dumps(limits))
