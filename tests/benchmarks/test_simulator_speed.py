"""What a simulated record costs, in units of the cost of drawing its noise.

A quadcopter record is what a user renders: four two-blade rotors with rates, phases and places of their own, a body on
its path, and complex noise; 256 records of 2048 pulses at X band. "Plain" means the paper's blades: equal, uniform, at
constant rates. "Full" adds unequal blades, unlike edges, a root, drift and wander of the rates, acceleration and
vibration.
"""

import tracemalloc
from itertools import pairwise

import numpy as np
from bladewing.simulate import Radar, Rotor, RotorMotion, body_echo, draw_records, rotors_echo
from numpy.random import Generator, Philox, SeedSequence

from .ratios import cpu_seconds, table

RECORDS = 256
RADAR = Radar(9.85e9, 25e3, 2048)
POINTS = 60


def quadcopters(records: int, *, full: bool, rotors: int = 4) -> list[Rotor]:
    rng = np.random.default_rng(0)

    def uniform(low: float, high: float) -> np.ndarray:
        return rng.uniform(low, high, records)

    length, beta = uniform(0.08, 0.2), uniform(0, 1.2)
    out = []
    for _ in range(rotors):
        rate, phase, hub = uniform(60, 120), uniform(-np.pi, np.pi), np.exp(1j * uniform(-np.pi, np.pi))
        if full:
            motion = RotorMotion(rate, phase, uniform(-5, 5), uniform(0.1, 1), uniform(0.5, 20), uniform(-3, 3))
            unequal = rng.uniform(0.5, 1, (records, 2))
            out.append(Rotor(motion, length, beta, 0.2 * length, unequal, uniform(-0.9, 0.9), hub))
        else:
            out.append(Rotor(RotorMotion(rate, phase), length, beta, hub=hub))
    return out


def draw_noise(generators: list[Generator], iq: np.ndarray) -> None:
    """Draw complex noise of unit power, each record from its own random stream."""
    parts = iq.view(np.float32)
    for generator, row in zip(generators, parts, strict=True):
        generator.standard_normal(dtype=np.float32, out=row)
    parts *= np.float32(np.sqrt(0.5))


def test_a_quadcopter_record_against_its_noise():
    generators = [Generator(Philox(SeedSequence(0, spawn_key=(4, i)))) for i in range(RECORDS)]
    plain, full = (quadcopters(RECORDS, full=full) for full in (False, True))
    velocity = np.linspace(-25, 25, RECORDS)
    iq = np.empty((RECORDS, RADAR.pulses), np.complex64)

    def record_plain() -> None:
        draw_noise(generators, iq)
        rotors_echo(RADAR, plain, RECORDS, velocity_mps=velocity, out=iq)
        body_echo(RADAR, RECORDS, velocity_mps=velocity, amplitude=5.0, out=iq)

    def record_full() -> None:
        path = {
            "velocity_mps": velocity,
            "acceleration_mps2": velocity / 10,
            "vibration_rad": 0.1,
            "vibration_hz": 90.0,
        }
        draw_noise(generators, iq)
        rotors_echo(RADAR, full, RECORDS, **path, out=iq)
        body_echo(RADAR, RECORDS, **path, amplitude=5.0, out=iq)

    spent = cpu_seconds(
        {
            "noise": lambda: draw_noise(generators, iq),
            "plain": record_plain,
            "full": record_full,
            "training quadcopter": lambda: draw_records(RADAR, RECORDS, 0, purpose="bench", kind="quadcopter"),
            "training record": lambda: draw_records(RADAR, RECORDS, 0, purpose="bench"),
        }
    )
    names = {
        "noise": ("drawing the complex noise", "1"),
        "plain": ("quadcopter record, plain", "at most 2.5"),
        "full": ("quadcopter record, full", "at most 2.5"),
        "training quadcopter": ("random training quadcopter with its background and receiver's faults", ""),
        "training record": ("random training record of any kind", ""),
    }
    rows = [
        (what, f"{spent[name] / spent['noise']:.2f}", goal, f"{spent[name] / RECORDS * 1e6:.0f}")
        for name, (what, goal) in names.items()
    ]
    table("Simulator against noise: 256 records of 2048 pulses", ("", "x noise", "goal", "us a record"), rows)


def point_scatterers(rotors: list[Rotor], record: int, points: int) -> np.ndarray:
    """Compute the paper's sum for one record: each blade is a row of points, with phases in float64."""
    out = np.zeros(RADAR.pulses, complex)
    for rotor in rotors:
        values = [np.atleast_1d(x) for x in (rotor.motion.rotation_hz, rotor.motion.phase_rad, rotor.hub)]
        rate, phase, hub = (x[record] for x in values)
        length, beta = np.asarray(rotor.blade_length_m)[record], np.asarray(rotor.beta_rad)[record]
        radii = length * (np.arange(points) + 0.5) / points
        angle = phase + 2 * np.pi * rate * RADAR.times_s
        for turn in (0, np.pi):
            displacement = radii[:, None] * (np.cos(beta) * np.cos(angle + turn))
            out += hub * np.exp(4j * np.pi / RADAR.wavelength_m * displacement).mean(axis=0)
    return out


def test_the_closed_form_against_point_scatterers():
    rotors, some = quadcopters(RECORDS, full=False), 4
    closed = rotors_echo(RADAR, rotors, RECORDS)

    def error_db(echo: np.ndarray, record: int) -> float:
        dense = point_scatterers(rotors, record, 1500)
        return 10 * np.log10(np.mean(abs(echo - dense) ** 2) / np.mean(abs(dense) ** 2))

    closed_db = max(error_db(closed[i], i) for i in range(some))
    points_db = max(error_db(point_scatterers(rotors, i, POINTS), i) for i in range(some))
    spent = cpu_seconds(
        {
            "closed": lambda: rotors_echo(RADAR, rotors, RECORDS),
            "points": lambda: [point_scatterers(rotors, i, POINTS) for i in range(some)],
        },
        rounds=5,
    )
    ratio = (spent["points"] / some) / (spent["closed"] / RECORDS)
    rows = [
        (f"{POINTS} point scatterers a blade", f"{points_db:.0f}", "1", ""),
        ("closed form", f"{closed_db:.0f}", f"{ratio:.0f}", "at least 300"),
    ]
    table("Closed form against points: four rotors of two blades", ("", "error dB", "x faster", "goal"), rows)
    assert closed_db < -40


def test_the_cost_grows_linearly():
    def echo(pulses: int, rotors: int, records: int):
        radar, drawn = Radar(9.85e9, 25e3, pulses), quadcopters(records, full=True, rotors=rotors)
        return lambda: rotors_echo(radar, drawn, records)

    pulses, rotors = (512, 2048, 8192, 32768), (1, 2, 4, 8)
    by_pulses = cpu_seconds({str(p): echo(p, 4, 32 * 2048 // p * 4) for p in pulses})
    by_rotors = cpu_seconds({str(r): echo(2048, r, 128) for r in rotors})
    rows = [(f"{p} pulses, 4 rotors", f"{by_pulses[str(p)] / by_pulses['2048']:.2f}") for p in pulses]
    table("Cost a pulse: quadcopters of as many samples in all", ("", "against 2048 pulses"), rows)
    growth = [(by_rotors[str(b)] - by_rotors[str(a)]) / (b - a) for a, b in pairwise(rotors)]
    rows = [(f"{a} to {b} rotors", f"{g / growth[0]:.2f}") for (a, b), g in zip(pairwise(rotors), growth, strict=True)]
    table("Cost of a further rotor: 2048 pulses", ("", "against the second"), rows)


def test_memory_beside_the_output_is_flat():
    def beside_mib(records: int) -> float:
        tracemalloc.start()
        iq = draw_records(RADAR, records, 0, purpose="bench").iq
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return (peak - iq.nbytes) / 2**20

    spent = {records: beside_mib(records) for records in (64, 256, 1024)}
    rows = [(str(records), f"{mib:.0f}") for records, mib in spent.items()]
    table("Memory of draw_records: beside its output", ("records of 2048 pulses", "MiB"), rows)
    # One chunk holds 256 of these records; with more records only the columns of the truth grow.
    assert spent[1024] < 1.2 * spent[256]
