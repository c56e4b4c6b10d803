"""Tables of the measurements' accuracy. Run: python -m tests.benchmarks.measurement_tables [--draws N] [TABLE ...].

Shares stand with the 95 % interval that the number of draws leaves them (Wilson), variances with that of chi-squared.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
from bladewing.classify.recording import load_recording
from bladewing.features import Measurements, measure
from bladewing.features.stft import PAPER_SETTINGS, flash_bandwidth_hz, flash_period_s, stft
from bladewing.simulate import Radar
from bladewing.simulate.dataset import draw_target, powered
from bladewing.simulate.laws import WIDTH, Draws
from bladewing.simulate.receiver import FAULT_CHANCE, Receiver
from scipy.stats import chi2

from ..features.signals import crowded
from . import records

RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"

#: The paper's six types: blade [m], rates [rpm], rotors, velocity [m/s], beta [rad].
TYPES = {
    1: (0.15, (3500, 3500), 1, 0.0, 0.0),
    2: (0.30, (3500, 3500), 1, 0.0, 0.0),
    3: (0.15, (7000, 7000), 1, 0.0, 0.0),
    4: (0.15, (3395, 3500), 4, 0.0, 0.0),
    5: (0.15, (3395, 3500), 4, -20.0, 0.0),
    6: (0.15, (3395, 3500), 4, 0.0, np.pi / 3),
}


def share(hits: np.ndarray) -> str:
    """Write a share with its 95 % interval."""
    n, p, z2 = len(hits), float(np.mean(hits)), 3.8416
    middle, half = (p + z2 / 2 / n) / (1 + z2 / n), np.sqrt(z2 * (p * (1 - p) / n + z2 / 4 / n**2)) / (1 + z2 / n)
    return f"{p:.3f} [{max(middle - half, 0):.3f} {min(middle + half, 1):.3f}]"


def variance(normalised: np.ndarray) -> str:
    """Write the mean square of normalised errors with its 95 % interval."""
    n, value = len(normalised), float(np.mean(np.square(normalised)))
    return f"{value:.2f} [{n * value / chi2.ppf(0.975, n):.2f} {n * value / chi2.ppf(0.025, n):.2f}]"


def chopping(draws: int) -> None:
    """Chopping frequency against the Cramer-Rao bound, octave errors, and whether the stated deviations are true."""
    print(f"chopping, {draws} draws a row, rates 40-110 Hz, 2 blades of 15 cm, |v| < 30 m/s")
    print(
        " SNR  body ground | within 2 %           octave error          | RMSE/bound  normalised variance   v m/s  ms"
    )
    for snr_db, body_db, ground_db in (
        (-16, 20, None),
        (-16, 40, None),
        (-13, 20, None),
        (-10, 20, None),
        (-10, 40, None),
        (-10, 40, 40),
        (0, 20, None),
        (0, 40, 40),
        (10, 20, None),
        (20, 20, None),
    ):
        rng = np.random.default_rng(2000 + snr_db)
        rows, spent = [], 0.0
        for _ in range(draws):
            rate_hz, velocity_mps = rng.uniform(40, 110), rng.uniform(-30, 30)
            iq = records.record(
                rng,
                np.array([rate_hz]),
                snr_db=snr_db,
                body_db=body_db,
                velocity_mps=velocity_mps,
                ground_db=ground_db,
            )
            start = thread_time()
            found = measure(iq, **records.RADAR)
            spent += thread_time() - start
            bound = records.bound_hz(records.rotors(rng, np.array([rate_hz])), 2 * rate_hz, snr_db)
            off_mps = abs(float(found.body_velocity_mps) - velocity_mps)
            rows.append((float(found.chopping_hz), float(found.chopping_hz_std), 2 * rate_hz, bound, off_mps))
        value, std, truth, bound, off_mps = np.array(rows).T
        given = np.isfinite(value)
        right = given & (np.abs(value / truth - 1) < 0.02)
        error = (value - truth)[right]
        print(
            f"{snr_db:4d} {body_db:5d} {ground_db!s:>6} | {share(right)} {share(given & ~right)} | "
            f"{np.sqrt(np.mean((error / bound[right]) ** 2)):10.2f}  {variance(error / std[right]):18s} "
            f"{np.quantile(off_mps[right], 0.95):7.3f} {1e3 * spent / draws:4.0f}",
            flush=True,
        )


def bandwidth(draws: int) -> None:
    """Bandwidth of the paper's six types by the edge fit and by the paper's rule; their velocity and blade length."""
    print(f"bandwidth, {draws} draws a row, rates jittered by 1 %; errors are medians of |found / eq. 26 - 1|")
    print("type  SNR | found  edge fit %  bias %  normalised variance  rule 20 dB %  length %  95 % of |v| errors m/s")
    for number, (length_m, rpm, count, velocity_mps, beta_rad) in TYPES.items():
        for snr_db in (30, 10, 0, -10):
            rng = np.random.default_rng(number)
            rows = []
            for _ in range(draws):
                rates_hz = np.linspace(*rpm, count) / 60 * rng.uniform(0.99, 1.01)
                shown_m = length_m * np.cos(beta_rad)
                iq = records.record(
                    rng, rates_hz, snr_db=snr_db, body_db=20, velocity_mps=velocity_mps, length_m=shown_m
                )
                theory = 8 * np.pi * rates_hz.max() * shown_m / records.WAVELENGTH_M
                found = measure(iq, **records.RADAR, blades=2, beta_rad=beta_rad)
                rows.append(
                    (
                        float(found.bandwidth_hz) / theory - 1,
                        float(found.bandwidth_hz_std) / theory,
                        float(found.threshold_bandwidth_hz) / theory - 1,
                        float(found.blade_length_m) / length_m - 1,
                        abs(float(found.body_velocity_mps) - velocity_mps),
                    )
                )
            fit, std, rule, length, speed = np.array(rows).T
            given = np.isfinite(fit)
            print(
                f"{number:4d} {snr_db:4d} | {given.mean():5.2f} {100 * np.nanmedian(np.abs(fit)):10.3f} "
                f"{100 * np.nanmedian(fit):8.3f} {variance((fit / std)[given]):>20s} "
                f"{100 * np.median(np.abs(rule)):12.2f} {100 * np.nanmedian(np.abs(length)):9.3f} "
                f"{np.quantile(speed, 0.95):12.3f}",
                flush=True,
            )


#: For each airframe its number of rotors, their highest rate (the lowest is 3395) and their least separation [rpm].
AIRFRAMES_RPM = ((4, 3500, 20), (6, 3720, 15), (8, 3840, 18))


def single_rotors(draws: int) -> None:
    """Rates of four to eight rotors, and how well the smearing index separates them from one rotor."""
    print(f"single rotors, {draws} draws a row; AUC: of the smearing index, against one rotor's")
    print(f"rotors     SNR | {_TOLD_APART}    AUC")
    for (count, highest_rpm, least_rpm), snr_db in product(AIRFRAMES_RPM, (0, 10, 20, 30)):
        rng = np.random.default_rng(snr_db)
        several = list(_measured(rng, snr_db, _hovering(rng, draws, count, highest_rpm, least_rpm)))
        ones = _measured(rng, snr_db, _hovering(rng, draws, 1, highest_rpm))
        index, of_one = (np.nan_to_num([float(m.smearing_index) for _, m, _ in some]) for some in (several, ones))
        area = np.mean(index[:, None] > of_one)
        print(f"{count:6d}  {snr_db:3d} dB | {_told_apart(several)}  {area:.3f}", flush=True)


def drifting(draws: int) -> None:
    """One rotor whose rate changes within the dwell: whether reported as one; its change, rate and tip speed."""
    print(f"one rotor, 40 to 110 Hz, {draws} draws a row: over the dwell its rate changes by so much")
    print("change     SNR | one, resolved       | normalised variance: change  rate              | tips off by")
    tip = 2 * 0.15 * 2 * np.pi / records.WAVELENGTH_M
    for change, snr_db in product((0.0, 0.002, 0.01, 0.03), (-5, 0, 10, 20)):
        rng = np.random.default_rng(int(1000 * change) + snr_db + 5)
        rows = []
        for _ in range(draws):
            rate_hz, signed = rng.uniform(40, 110), change * rng.choice([-1, 1])
            options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-30, 30), "change": signed}
            found = measure(records.record(rng, np.array([rate_hz]), **options), **records.RADAR)
            away = found.chopping_drift_hz_per_s - 2 * rate_hz * signed * records.PRF_HZ / records.PULSES
            rows.append(
                (
                    found.rotor_count == 1 and found.rotors_resolved,
                    away / found.chopping_drift_hz_per_s_std,
                    (found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std,
                    abs(found.bandwidth_hz / (2 * tip * rate_hz) - 1),
                )
            )
        one, drift, rate, band = np.array(rows, float).T
        told = one > 0
        off = np.median(band[told]) if told.any() else np.nan
        print(
            f"{100 * change:4.1f} % {snr_db:4d} dB | {share(told)} | {variance(drift[told])}  {variance(rate[told])} | "
            f"{100 * off:.2f} %",
            flush=True,
        )


def changing(draws: int) -> None:
    """Four rotors at least 20 rpm apart, each rate with its own change: whether resolved; rates and deviations."""
    print(f"four rotors in 3395 to 3500 rpm, at least 20 rpm apart, {draws} draws a row: each changes by up to so much")
    print(f"change     SNR | {_TOLD_APART}")
    for change, snr_db in product((0.0, 0.003, 0.01, 0.02), (0, 10, 20)):
        rng = np.random.default_rng(int(1000 * change) + snr_db + 7)
        measured = _measured(
            rng, snr_db, _hovering(rng, draws, 4), lambda rng, c=change: {"change": c * rng.uniform(-1, 1, 4)}
        )
        print(f"{100 * change:4.1f} % {snr_db:4d} dB | {_told_apart(measured)}", flush=True)


def gains(draws: int) -> None:
    """Rotors whose echo rises and falls over the dwell: whether counted rightly; rates and deviations."""
    print(f"rotors in 3395 to 3500 rpm, at least 20 rpm apart, seen through a gain over the dwell, {draws} draws a row")
    print(f"rotors  gain             SNR | {_TOLD_APART}")
    for count, (name, gain), snr_db in product((1, 4), records.GAINS.items(), (0, 10, 20)):
        rng = np.random.default_rng(100 * count + snr_db + 7)
        measured = _measured(rng, snr_db, _hovering(rng, draws, count), lambda _, gain=gain: {"gain": gain})
        print(f"{count:6d}  {name:13s} {snr_db:4d} dB | {_told_apart(measured)}", flush=True)


def _measured(
    rng: np.random.Generator,
    snr_db: float,
    rates_hz: Iterable[np.ndarray],
    drawn: Callable[[np.random.Generator], dict[str, Any]] = lambda _: {},
) -> Iterator[tuple[np.ndarray, Measurements, float]]:
    """Make and measure a record of each set of rates [Hz], with options from `drawn`; the time taken is in [ms]."""
    for rates in rates_hz:
        options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-30, 30), **drawn(rng)}
        iq = records.record(rng, rates, **options)
        start = thread_time()
        found = measure(iq, **records.RADAR)
        yield rates, found, 1e3 * (thread_time() - start)


def _hovering(rng: np.random.Generator, draws: int, count: int, highest_rpm: float = 3500, least_rpm: float = 20):
    """Draw `draws` sets of `count` rates [Hz] between 3395 rpm and `highest_rpm`, at least `least_rpm` apart."""
    return (records.apart(rng, count, least_rpm, 3395, highest_rpm) / 60 for _ in range(draws))


_TOLD_APART = "all of them, resolved  wrong | within 0.2 %           normalised variance     ms"


def _told_apart(measured: Iterable[tuple[np.ndarray, Measurements, float]]) -> str:
    """Write how often all rotors of a record are resolved, how often wrongly, and how accurate their rates are."""
    told, wrong, near, off, took_ms = [], 0, [], [], []
    for rates_hz, found, own_ms in measured:
        count = len(rates_hz)
        took_ms.append(own_ms)
        told.append(found.rotors_resolved and found.rotor_count == count)
        wrong += bool(found.rotors_resolved and found.rotor_count != count)
        if told[-1]:
            away = found.rotor_rates_hz[:count] - 2 * rates_hz
            near.append(np.abs(away / rates_hz / 2).max() < 2e-3)
            off += list(away / found.rotor_rates_hz_std[:count])
    if not off:
        return f"{share(np.array(told))}   {wrong:3d} | {np.mean(took_ms):59.0f}"
    return (
        f"{share(np.array(told))}   {wrong:3d} | {share(np.array(near))}  {variance(np.array(off))}  "
        f"{np.mean(took_ms):5.0f}"
    )


def crowded_rotors(draws: int) -> None:
    """Four steady rotors whose lines are half as many as the pulses: resolved, rates and deviations."""
    print(f"four rotors at 24 GHz within 6 %, at least 0.4 % apart, 20 dB, four flashes in 80 ms, {draws} draws")
    print(_TOLD_APART)
    rows = []
    for seed in range(draws):
        iq, radar, chopping_hz = crowded(seed)
        start = thread_time()
        found = measure(iq, **radar)
        rows.append((chopping_hz / 2, found, 1e3 * (thread_time() - start)))
    print(_told_apart(rows), flush=True)


def near_rotors(draws: int) -> None:
    """Two rotors closer than the dwell resolves: to be reported as unresolved or as one rate, never as too many."""
    print(f"two rotors so far apart, {draws} draws a row: rates given, resolved, median of the spread")
    for snr_db in (0, 10):
        for apart_rpm in (2, 4, 7, 10, 13, 16, 20):
            rng = np.random.default_rng(apart_rpm)
            rates_hz = ((rng.uniform(3395, 3480) + np.array([0.0, apart_rpm])) / 60 for _ in range(draws))
            rows = [
                (m.rotor_count, m.rotors_resolved, 30 * m.rotor_spread_hz)
                for _, m, _ in _measured(rng, snr_db, rates_hz)
            ]
            count, resolved, spread = np.array(rows, float).T
            print(
                f"SNR {snr_db:3d} dB, {apart_rpm:2d} rpm: one {np.mean(count == 1):.2f} two {np.mean(count == 2):.2f} "
                f"more {np.mean(count > 2):.2f}, resolved {resolved.mean():.2f}, spread {np.nanmedian(spread):.1f} rpm",
                flush=True,
            )


def random_rotors(draws: int) -> None:
    """Rotors of random rates within 3 %, resolvable or not: whether the number is right or reported as unresolved."""
    print(f"rotors of random rates within 3 %, {draws} draws a row: number right, told resolved, right or unresolved")
    for snr_db in (0, 10):
        for count in (1, 2, 4, 6, 8):
            rng = np.random.default_rng(100 * count + snr_db)
            rows = []
            some = (np.sort(57.5 * (1 + 0.03 * (rng.uniform(size=count) - 0.5))) for _ in range(draws))
            for rates_hz, found, _ in _measured(rng, snr_db, some):
                spread = float(found.rotor_spread_hz) / 2 / max(float(np.ptp(rates_hz)), 1e-9)
                rows.append((found.rotor_count == count, bool(found.rotors_resolved), spread))
            right, resolved, spread = np.array(rows, float).T
            print(
                f"SNR {snr_db:3d} dB, {count} rotors: number {right.mean():.2f}, resolved {resolved.mean():.2f}, "
                f"either {share((right > 0) | (resolved == 0))}, spread over true {np.nanmedian(spread):.2f}",
                flush=True,
            )


def helicopter_record(rng: np.random.Generator, snr_db: float, tail_db: float) -> tuple[np.ndarray, float, float]:
    """Make a helicopter's record, its tail rotor at `tail_db` from the main one, and both chopping frequencies [Hz]."""
    length_m, tip_mps = rng.uniform(0.3, 0.5), rng.uniform(60, 110)
    rate_hz, gear = max(tip_mps / (2 * np.pi * length_m), 23.0), rng.uniform(3.8, 6.2)
    tail_m = min(length_m * rng.uniform(0.12, 0.25), 120 / (2 * np.pi * rate_hz * gear))
    tail = 10 ** (tail_db / 20) * records.rotors(rng, np.array([gear * rate_hz]), length_m=tail_m)
    velocity_mps = rng.uniform(-15, 15)
    rates_hz = np.array([rate_hz])
    options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": velocity_mps, "length_m": length_m, "tail": tail}
    return records.record(rng, rates_hz, **options), 2 * rate_hz, 2 * gear * rate_hz


def helicopters(draws: int) -> None:
    """Both combs and the gear ratio of helicopters, and false gear ratios of airframes without a gear."""
    print(f"helicopters, {draws} draws a row, main 60-110 m/s, gear 3.8-6.2; all three within 1 %")
    print(" SNR  tail dB | found  within 1 %  wrong | normalised variance: main  tail  ratio")
    for tail_db in (-8, -14):
        for snr_db in (-10, -5, 0, 10, 20):
            rng = np.random.default_rng(3000 + snr_db)
            found, errors = 0, []
            for _ in range(draws):
                iq, main_hz, tail_hz = helicopter_record(rng, snr_db, tail_db)
                m = measure(iq, **records.RADAR)
                found += bool(np.isfinite(m.gear_ratio))
                pairs = (
                    ("main_chopping_hz", main_hz),
                    ("tail_chopping_hz", tail_hz),
                    ("gear_ratio", tail_hz / main_hz),
                )
                error = [
                    (float(getattr(m, name)) - true, float(getattr(m, f"{name}_std")), true) for name, true in pairs
                ]
                if all(abs(off / true) < 0.01 for off, _, true in error):
                    errors.append([off / std for off, std, _ in error])
            spreads = np.mean(np.square(errors), axis=0) if errors else np.full(3, np.nan)
            print(
                f"{snr_db:4d} {tail_db:8d} | {found / draws:5.2f} {len(errors) / draws:11.2f} "
                f"{(found - len(errors)) / draws:6.3f} | {spreads[0]:25.2f} {spreads[1]:5.2f} {spreads[2]:6.2f}",
                flush=True,
            )
    print(f"gears where there is none, {draws} draws a row, rotation 25-90 Hz")
    spreads = {"one rotor": (1, 0.0), "two, 18 %": (2, 0.18), "four, 3 %": (4, 0.03), "four, 18 %": (4, 0.18)}
    spreads |= {"six, 18 %": (6, 0.18), "one, unequal blades": (1, 0.0)}
    for name, (count, spread) in spreads.items():
        for snr_db in (0, 20):
            rng = np.random.default_rng(11)
            combs, gears = 0, 0
            for _ in range(draws):
                rate_hz = rng.uniform(25, 90)
                rates_hz = rate_hz * (1 + spread * (rng.uniform(size=count) - 0.5))
                length_m = min(0.4, rng.uniform(50, 110) / (2 * np.pi * rate_hz))
                unequal = {"amplitudes": np.exp(rng.uniform(0.05, 1) * rng.standard_normal(rng.integers(2, 5)))}
                options = {"snr_db": snr_db, "body_db": 20, "velocity_mps": rng.uniform(-15, 15), "length_m": length_m}
                iq = records.record(rng, rates_hz, **options, **(unequal if "unequal" in name else {}))
                m = measure(iq, **records.RADAR)
                combs += bool(np.isfinite(m.chopping_hz))
                gears += bool(np.isfinite(m.gear_ratio))
            print(f"{name:20s} {snr_db:3d} dB: combs {combs / draws:.2f}, gears {gears / draws:.3f}", flush=True)


def receivers(draws: int) -> None:
    """Tip speeds of fixed wings as training draws them, through receivers with one fault each."""
    print(f"tips through receivers of one fault, {draws} draws a row, fixed wings at 0 to 30 dB, chopping within 2 %")
    print("fault         tips | error %: 5th, 25th, median, 75th, 95th | median and share over 4 of error / deviation")
    for fault in ("none", *FAULT_CHANCE):
        iq, tip_mps, chopping_hz = _through(fault, draws)
        found = measure(iq, **records.RADAR)
        right = np.isfinite(found.tip_speed_mps) & (np.abs(found.chopping_hz / chopping_hz - 1) < 0.02)
        error = (found.tip_speed_mps / tip_mps - 1)[right]
        if not len(error):
            print(f"{fault:12s}     0 | no tip")
            continue
        normalised = np.abs(error * tip_mps[right] / found.tip_speed_mps_std[right])
        marks = " ".join(f"{100 * mark:6.1f}" for mark in np.quantile(error, [0.05, 0.25, 0.5, 0.75, 0.95]))
        print(
            f"{fault:12s} {right.sum():5d} | {marks} | {np.median(normalised):5.2f} {np.mean(normalised > 4):5.2f}",
            flush=True,
        )


def _through(fault: str, draws: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make fixed wings behind receivers of one fault, or none: samples, tip speeds in sight [m/s], chopping [Hz]."""
    rng, faults = np.random.default_rng(11), np.random.default_rng(12)
    radar = Radar(records.CARRIER_HZ, records.PRF_HZ, records.PULSES)
    cursor = Draws(rng.random((draws, WIDTH)))
    receiver = Receiver(cursor)
    receiver.on = {name: np.full(draws, name == fault) for name in FAULT_CHANCE}
    noise = records.white(rng, draws, records.PULSES).astype(np.complex64)
    target = draw_target(cursor, radar, "fixed_wing", lambda _: partial(_normals, rng, draws), np.arange(draws))
    signal = powered(target, rng.uniform(0, 30, draws))
    iq = receiver.receive(signal, noise, radar, lambda _: lambda rows: partial(_normals, faults, len(rows)))
    return iq, target.truth["tip_mps"] * np.cos(target.truth["beta_rad"]), target.truth["chopping_hz"]


def _normals(rng: np.random.Generator, rows: int, count: int) -> np.ndarray:
    return rng.standard_normal((rows, count), np.float32)


def false_alarms(draws: int) -> None:
    """Rotors reported in records that hold none."""
    print(f"false alarms, {draws} draws a row")
    scenes: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
        "noise": lambda rng: records.white(rng, records.PULSES),
        "noise, 1000 pulses": lambda rng: records.white(rng, 1000),
        "a line 40 dB up": lambda rng: (
            100 * np.exp(2j * np.pi * rng.uniform(-0.4, 0.4) * np.arange(records.PULSES))
            + records.white(rng, records.PULSES)
        ),
        "ground 40 dB up": lambda rng: 100 * records.ground(rng, rng.uniform(2, 8)) + records.white(rng, 3000),
        "clicks, 2 a record": lambda rng: (
            records.white(rng, 3000) + 20 * (rng.uniform(size=3000) < 1 / 1500) * records.white(rng, 3000)
        ),
    }
    for name, scene in scenes.items():
        rng = np.random.default_rng(7)
        start, hits = thread_time(), []
        for _ in range(draws):
            hits.append(bool(np.isfinite(measure(scene(rng), **records.RADAR).chopping_hz)))
        print(f"{name:20s} {share(np.array(hits))} {1e3 * (thread_time() - start) / draws:5.0f} ms", flush=True)


def joint(draws: int) -> None:
    """Chopping frequency and bandwidth from the spectrum against those from the STFT, on the same records."""
    print(f"spectrum against STFT, {draws} draws a row, one rotor, rates 40-110 Hz, 2 blades of 15 cm, |v| < 30 m/s")
    print("errors: median; right: within 2 %; band 13: the rule at 13 dB in place of the paper's 20; ms a record")
    print(" SNR  method          | right  chopping %  band %  band 13 %     ms   KiB")
    for snr_db in (20, 10, 0, -10):
        rng = np.random.default_rng(3000 + snr_db)
        truth, batch = [], []
        for _ in range(draws):
            rate_hz, velocity_mps = rng.uniform(40, 110), rng.uniform(-30, 30)
            truth.append((2 * rate_hz, 8 * np.pi * rate_hz * 0.15 / records.WAVELENGTH_M))
            batch.append(records.record(rng, np.array([rate_hz]), snr_db=snr_db, body_db=20, velocity_mps=velocity_mps))
        chopping_hz, band_hz = np.array(truth).T

        def line(name, found_hz, bands_hz, start, kib, snr_db=snr_db, chopping_hz=chopping_hz, band_hz=band_hz):
            spent = thread_time() - start
            error = np.abs(np.asarray(found_hz) / chopping_hz - 1)
            widths = [100 * np.nanmedian(np.abs(np.asarray(width) / band_hz - 1)) for width in bands_hz]
            print(
                f"{snr_db:4d}  {name:15s} | {np.mean(error < 0.02):5.2f} {100 * np.nanmedian(error):11.4f} "
                f"{widths[0]:7.1f} {widths[-1] if len(widths) > 1 else np.nan:10.1f} "
                f"{1e3 * spent / draws:6.1f} {kib:5.0f}",
                flush=True,
            )

        start = thread_time()
        found = [measure(iq, **records.RADAR) for iq in batch]
        widths = [float(f.bandwidth_hz) for f in found]
        line("measure()", [float(f.chopping_hz) for f in found], [widths], start, 4 * records.PULSES / 1024)
        for window_s, overlap in PAPER_SETTINGS:
            start, periods, paper, low = thread_time(), [], [], []
            for iq in batch:
                frames = stft(iq, **records.RADAR, window_s=window_s, overlap=overlap)
                periods.append(float(flash_period_s(frames)))
                paper.append(float(flash_bandwidth_hz(frames)))
                low.append(float(flash_bandwidth_hz(frames, 13.0)))
            size = frames.power.nbytes / 1024
            line(f"{1e3 * window_s:3.0f} ms, {100 * overlap:.0f} %", 1 / np.array(periods), [paper, low], start, size)


def recordings(_draws: int) -> None:
    """What `measure` finds in the measured recordings, in dwells of 80 ms."""
    print("recordings, dwells of 80 ms; medians of the dwells with a rotor")
    for path in sorted(RECORDINGS.glob("*.sigmf-meta")):
        recording = load_recording(path)
        pulses = round(0.08 * recording.prf_hz)
        count = len(recording.iq) // pulses
        dwells = recording.iq[: count * pulses].reshape(count, pulses)
        start = thread_time()
        found = measure(dwells, carrier_hz=recording.carrier_hz, prf_hz=recording.prf_hz)
        spent = thread_time() - start
        held = np.isfinite(found.chopping_hz)
        text = f"{path.stem[:36]:36s} rotor in {held.sum():3d} of {count} dwells, {1e3 * spent / count:.0f} ms"
        if held.any():
            text += f", lines {np.median(found.chopping_hz[held]):.1f} Hz"
            tips = found.tip_speed_mps[np.isfinite(found.tip_speed_mps)]
            text += f", edge {np.median(tips):.1f} m/s" if len(tips) else ", no edge"
        print(text, flush=True)


TABLES = {
    "chopping": chopping,
    "bandwidth": bandwidth,
    "rotors": single_rotors,
    "crowded-rotors": crowded_rotors,
    "near-rotors": near_rotors,
    "drifting": drifting,
    "changing": changing,
    "gains": gains,
    "receivers": receivers,
    "random-rotors": random_rotors,
    "helicopters": helicopters,
    "false-alarms": false_alarms,
    "joint": joint,
    "recordings": recordings,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*TABLES, []], help="all of them by default")
    parser.add_argument("--draws", type=int, default=100, help="records a row")
    given = parser.parse_args()
    for name in given.tables or TABLES:
        TABLES[name](given.draws)
        print()
