"""Stages of the features, checked against the same arithmetic in long double, exact invariances and known truth."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from bladewing.features import measure
from bladewing.features.bandwidth import energy_band_mps, noise_threshold_db, threshold_band_hz
from bladewing.features.cadence import CLIP, LEAST_MEAN, cadence_db, cadence_plan
from bladewing.features.chopping import CLIP_DB, cepstrum, noise_shape
from bladewing.features.comb_levels import broad_power, comb_heights, comb_plan
from bladewing.features.inputs import model_inputs
from bladewing.features.notch import notch_mask, residual, strongest_bin
from bladewing.features.samples import unit_scale
from bladewing.features.schema import INPUT_SHAPES
from bladewing.features.spectrum import (
    LEAST_FLOOR,
    SPEED_OF_LIGHT_MPS,
    Spectrum,
    centred_power,
    doppler_spectrum,
    noise_floor,
)
from bladewing.features.window import HANN, KAISER, Window
from numpy.typing import NDArray
from scipy import fft

from .cell import Cell, Outcome, sweep

_CARRIER_HZ, _PRF_HZ = 10e9, 20e3
_WAVELENGTH_M = SPEED_OF_LIGHT_MPS / _CARRIER_HZ

_SCALE_GUARD = "scaled by a power of two to [0.5, 1) first: no digit changes, no square overflows or vanishes"
_COUNTS = (2, 3, 16, 127, 1000, 1021, 8191, 65536)

# Names of the records in `ODD` that contain a rotor, and its chopping frequency [Hz].
_ODD_ROTORS, _ODD_CHOPPING_HZ = ("clipped to one bit", "I only"), 200.0


def cells(quick: bool) -> Iterator[Cell]:
    """Measure every cell of these stages; `quick` leaves out the slow ones."""
    yield from _spectra(quick)
    yield from _shapes(quick)
    yield from _combs()
    yield from _features(quick)


def rotor_record(
    pulses: int = 2000, *, snr_db: float = 20.0, chopping_hz: float = _ODD_CHOPPING_HZ
) -> NDArray[np.complex64]:
    """Make a record: a body line, the comb of a two-bladed rotor about it, and noise of unit power."""
    rng = np.random.default_rng(0)
    t = np.arange(pulses) / _PRF_HZ
    comb = np.exp(1j * 40 * np.cos(np.pi * chopping_hz * t)) + np.exp(-1j * 40 * np.cos(np.pi * chopping_hz * t))
    noise = rng.normal(scale=np.sqrt(0.5), size=(2, pulses))
    signal = np.exp(2j * np.pi * 300 * t) * (3 + comb) * 10 ** (snr_db / 20)
    return (signal + noise[0] + 1j * noise[1]).astype(np.complex64)


#: Records that no ordinary target gives: name to a function of the number of pulses.
ODD: dict[str, Callable[[int], NDArray[np.complex64]]] = {
    "all zero": lambda pulses: np.zeros(pulses, np.complex64),
    "constant": lambda pulses: np.full(pulses, 0.3 - 0.7j, np.complex64),
    "a single sample that is not zero": lambda pulses: (np.arange(pulses) == pulses // 3).astype(np.complex64),
    "one huge spike": lambda pulses: np.where(np.arange(pulses) == pulses // 3, 1e37, rotor_record(pulses)),
    "pure DC under noise 200 dB down": lambda pulses: _noise_on(1e10, pulses),
    "clipped to one bit": lambda pulses: np.sign(rotor_record(pulses).view(np.float32)).view(np.complex64),
    "I only": lambda pulses: rotor_record(pulses).real.astype(np.complex64),
    "largest and smallest floats": lambda pulses: np.where(
        np.arange(pulses) % 2, 3e38 * (1 + 1j), 1e-45 * (1 - 1j)
    ).astype(np.complex64),
}


def _noise_on(level: float, pulses: int) -> NDArray[np.complex64]:
    """Make a constant level and noise of power 2."""
    rng = np.random.default_rng(0)
    return (level + rng.normal(size=pulses) + 1j * rng.normal(size=pulses)).astype(np.complex64)


def _exact_power(iq: NDArray[np.complex64], window: Window) -> NDArray[np.longdouble]:
    """Compute `centred_power` in long double, from the same samples and window."""
    pulses = iq.shape[-1]
    taper = window.taper(pulses).astype(np.longdouble)
    taper /= np.sqrt(np.sum(taper**2))
    lines = fft.fft(iq.astype(np.clongdouble) * taper, n=fft.next_fast_len(pulses))
    return fft.fftshift(lines.real**2 + lines.imag**2)


def _power_error(iq: NDArray[np.complex64], window: Window) -> float:
    """Give the largest error of a bin's power, over the larger of that power and 1e-6 of the mean of all bins."""
    scaled = iq * unit_scale(iq)
    exact = _exact_power(scaled, window)
    away = np.abs(centred_power(scaled, window=window) - exact)
    return float((away / np.maximum(exact, exact.mean() * 1e-6)).max())


def _floor_error(iq: NDArray[np.complex64], window: Window) -> float:
    """Give the error of the noise floor [dB]."""
    spectrum = doppler_spectrum(iq, carrier_hz=_CARRIER_HZ, prf_hz=_PRF_HZ, window=window)
    exact = _exact_power(iq * unit_scale(iq), window)
    level = max(float(noise_floor(exact, window)), float(exact.mean()) * float(LEAST_FLOOR))  # type: ignore[arg-type]
    natural = np.longdouble(level) / unit_scale(iq)[0].astype(np.longdouble) ** 2
    return float(abs(10 * np.log10(np.longdouble(spectrum.floor) / natural)))


def _through_either(error: Callable[[NDArray[np.complex64], Window], float], iq: NDArray[np.complex64]) -> float:
    """Give the larger of the errors with the two windows."""
    return max(error(iq, window) for window in (HANN, KAISER))


def _spectra(quick: bool) -> Iterator[Cell]:
    error = "largest error of a bin over max(its power, 1e-6 of the mean) [1]"
    counts = [*_COUNTS, *([] if quick else [1 << 20])]
    amplitudes = [1e-45, 1e-42, 1e-38, 1e-30, 1.0, 1e30, 1e36]
    for stage, measured, limit, work in (
        ("spectrum", error, 0.02, partial(_through_either, _power_error)),
        ("noise floor", "error [dB]", 0.05, partial(_through_either, _floor_error)),
    ):
        yield from _sweeps(stage, measured, limit, work, counts, amplitudes)


def _sweeps(
    stage: str,
    measured: str,
    limit: float,
    work: Callable[[NDArray[np.complex64]], Outcome],
    counts: list[int],
    amplitudes: list[float],
) -> Iterator[Cell]:
    ordinary = rotor_record()
    yield from sweep(
        stage, "amplitude", amplitudes, measured, limit, _SCALE_GUARD,
        lambda a: work(_scaled(ordinary, a)),
    )  # fmt: skip
    yield from sweep(
        stage, "pulses", counts, measured, limit, "a transform of the next fast length, for any count",
        lambda n: work(rotor_record(int(n))), "{:d}".format,
    )  # fmt: skip
    yield from sweep(
        stage, "SNR", [-100.0, -20.0, 0.0, 60.0, 100.0], measured, limit, _SCALE_GUARD,
        lambda snr: work(rotor_record(snr_db=snr)), "{:g} dB".format,
    )  # fmt: skip
    yield from sweep(
        stage, "SNR beyond what is followed", [140.0, 200.0], measured, limit,
        "the floor is held 90 dB under the record's power: it never falls to what rounding leaves",
        lambda snr: work(rotor_record(snr_db=snr)), "{:g} dB".format,
    )  # fmt: skip


def _scaled(iq: NDArray[np.complex64], gain: float) -> NDArray[np.complex64]:
    """Scale a record so that its largest real or imaginary part is `gain`."""
    largest = float(np.abs(iq.view(np.float32)).max())
    return (iq.astype(np.complex128) * (gain / largest)).astype(np.complex64)


def _long(spectrum: Spectrum) -> Spectrum:
    """Give the same spectrum in long double, for stages that keep the type of their input."""
    return replace(spectrum, relative_power=spectrum.relative_power.astype(np.longdouble))


def _notched(iq: NDArray[np.complex64]) -> tuple[Spectrum, NDArray[np.bool_]]:
    """Give a record's spectrum and the mask of the bins outside the notches."""
    spectrum = doppler_spectrum(iq, carrier_hz=_CARRIER_HZ, prf_hz=_PRF_HZ, window=HANN)
    return spectrum, notch_mask(spectrum, strongest_bin(spectrum))


def _exact_cepstrum(spectrum: Spectrum, mask: NDArray[np.bool_]) -> NDArray[np.longdouble]:
    """Compute `cepstrum` in long double, from the same powers."""
    power = np.maximum(spectrum.relative_power.astype(np.longdouble), np.longdouble(1))
    level = np.minimum(10 * np.log10(power), CLIP_DB) * mask
    level -= mask * (level.sum() / max(1, np.count_nonzero(mask)))
    return np.abs(fft.rfft(level)) / noise_shape(spectrum.pulses, spectrum.bins, spectrum.window)


def _cepstrum_error(iq: NDArray[np.complex64]) -> float:
    spectrum, mask = _notched(iq)
    found, exact = cepstrum(spectrum, mask), _exact_cepstrum(spectrum, mask)
    return float(np.abs(found - exact).max() / max(float(exact.max()), 1e-30))


def _cadence_error(iq: NDArray[np.complex64]) -> float:
    """Compare `cadence_db` with the same steps in long double, as powers."""
    spectrum, mask = _notched(iq)
    plan = cadence_plan(spectrum.pulses, spectrum.prf_hz, spectrum.window)
    power = np.abs(fft.ifft(spectrum.transform.astype(np.clongdouble) * mask))[plan.span] ** 2 * plan.per_taper
    power /= max(power.mean(), np.longdouble(LEAST_MEAN) * spectrum.transform_floor, np.longdouble(1e-36))
    power = np.minimum(power, np.longdouble(CLIP))
    lines = np.abs(fft.rfft((power - power.mean()) * plan.hann)) ** 2
    means = np.array([lines[first : first + count].mean() for first, count in zip(*plan.spans, strict=True)])
    found = 10 ** (cadence_db(spectrum, mask)[0, plan.seen].astype(np.float64) / 10)
    return float(np.abs(found - np.maximum(means, 1e-2)).max(initial=0.0) / max(1.0, means.max(initial=0.0)))


def _comb_heights_error(iq: NDArray[np.complex64]) -> float:
    """Compare `comb_heights` with long double on the same powers; noise has a standard deviation of about 0.5 there."""
    spectrum, mask = _notched(iq)
    plan = comb_plan(spectrum.bins, spectrum.pulses, _CARRIER_HZ, _PRF_HZ)
    if plan is None:
        return 0.0
    kept, power = mask[plan.band], broad_power(spectrum, plan.band)
    exact = comb_heights(power.astype(np.longdouble), kept.astype(np.longdouble), plan)
    return float(np.abs(comb_heights(power, kept.astype(np.float32), plan) - exact).max() / max(1.0, exact.max()))


def _band_error(iq: NDArray[np.complex64]) -> float:
    """Compare the edges of the energy band and of the threshold band with long double [bins]."""
    edges = []
    spectrum, mask = _notched(iq)
    for one in (spectrum, _long(spectrum)):
        excess = residual(one, mask)
        threshold = threshold_band_hz(one, noise_threshold_db(one.bins), mask)
        edges.append(np.array([*energy_band_mps(one, excess)[:2], *threshold], np.float64))
    step_hz = _PRF_HZ / spectrum.bins
    steps = np.array([step_hz * _WAVELENGTH_M / 2] * 2 + [step_hz] * 2)
    return float(np.abs((edges[0] - edges[1]) / steps).max())


def _shapes(quick: bool) -> Iterator[Cell]:
    counts = [*_COUNTS[2:], *([] if quick else [1 << 20])]
    for stage, measured, limit, guard, work in (
        (
            "cepstrum",
            "largest error over the highest peak [1]",
            1e-4,
            "levels held to -20..30 dB, each period over what noise gives there",
            _cepstrum_error,
        ),
        (
            "cadence",
            "largest error over the strongest rate, or over noise [1]",
            1e-3,
            "the window is undone where 3 % of it are left; a lone line's rounding stays under the floor",
            _cadence_error,
        ),
        (
            "comb levels",
            "largest error over the highest peak, or over 1 [1]",
            1e-4,
            "the evidence of a line is capped, and block means are taken off before the transform",
            _comb_heights_error,
        ),
        (
            "bandwidth",
            "error of the edges [bins]",
            1.0,
            "energies add up in float64, in blocks; no band without energy",
            _band_error,
        ),
    ):
        yield from _shape_sweeps(stage, measured, limit, guard, work, counts)


def _shape_sweeps(
    stage: str,
    measured: str,
    limit: float,
    guard: str,
    work: Callable[[NDArray[np.complex64]], float],
    counts: list[int],
) -> Iterator[Cell]:
    snrs = [-100.0, 0.0, 60.0, 200.0]
    yield from sweep(
        stage, "pulses", counts, measured, limit, guard,
        lambda n: work(rotor_record(int(n))), "{:d}".format,
    )  # fmt: skip
    yield from sweep(
        stage, "SNR", snrs, measured, limit, guard,
        lambda snr: work(rotor_record(snr_db=snr)), "{:g} dB".format,
    )  # fmt: skip
    yield from sweep(
        stage, "amplitude", [1e-45, 1e-38, 1.0, 1e36], measured, limit, _SCALE_GUARD,
        lambda a: work(_scaled(rotor_record(), a)),
    )  # fmt: skip


def _comb_error(iq: NDArray[np.complex64], chopping_hz: float, carrier_hz: float = _CARRIER_HZ) -> Outcome:
    """Give the relative error of the measured chopping frequency, or the reason why there is none."""
    found = measure(iq, carrier_hz=carrier_hz, prf_hz=_PRF_HZ)
    if np.isfinite(found.chopping_hz):
        return abs(float(found.chopping_hz) / chopping_hz - 1)
    return np.nan, str(found.reason)


def _combs() -> Iterator[Cell]:
    stage, measured = "comb estimator", "error of the chopping frequency, relative [1]"
    rates = [0.0, 0.1, 600.0, 6100.0, 30_000.0, 1e5, 1e6]
    yield from sweep(
        stage, "rotation rate", rates, measured, 0.01,
        "sought from 18 to 1600 Hz and 3 bins; what lies outside gets a reason",
        lambda rpm: _comb_error(rotor_record(chopping_hz=rpm / 30), max(rpm / 30, 1e-9)), "{:g} rpm".format,
        silent=(0.0, 0.1, 600.0, 1e6),
    )  # fmt: skip
    yield from sweep(
        stage, "SNR", [-100.0, -40.0, 0.0, 60.0, 140.0, 200.0], measured, 0.01,
        "judged against chance; without a comb there is a reason, never a number",
        lambda snr: _comb_error(rotor_record(snr_db=snr, chopping_hz=210.0), 210.0), "{:g} dB".format,
        silent=(-100.0, -40.0),
    )  # fmt: skip
    yield from sweep(
        stage, "pulses", [2, 3, 17, 127, 1021, 8191], measured, 0.01,
        "judged against chance; too few pulses get a reason",
        lambda n: _comb_error(rotor_record(int(n), chopping_hz=210.0), 210.0), "{:d}".format,
        silent=(2, 3, 17, 127),
    )  # fmt: skip
    yield from sweep(
        stage, "amplitude", [1e-45, 1e-42, 1e-38, 1.0, 1e36], measured, 0.01, _SCALE_GUARD,
        lambda a: _comb_error(_scaled(rotor_record(chopping_hz=210.0), a), 210.0), silent=(1e-45,),
    )  # fmt: skip
    yield from sweep(
        stage, "carrier", [0.1e9, 1e9, 300e9], measured, 0.01, "lines are sought in cycles a sample",
        lambda f: _comb_error(rotor_record(chopping_hz=210.0), 210.0, f), lambda f: f"{f / 1e9:g} GHz",
        silent=(300e9,),
    )  # fmt: skip
    yield from sweep(
        stage, "record", list(ODD), measured, 0.01,
        "no comb, no number: a reason; of a rotor behind one bit or one channel its lines, or every so many-th",
        _odd_comb, str, silent=ODD,
    )  # fmt: skip


def _odd_comb(name: str) -> Outcome:
    found = measure(ODD[name](1000), carrier_hz=_CARRIER_HZ, prf_hz=_PRF_HZ)
    if np.isnan(found.chopping_hz):
        return np.nan, str(found.reason)
    whole = float(found.chopping_hz) / _ODD_CHOPPING_HZ
    return abs(whole / max(round(whole), 1) - 1) if name in _ODD_ROTORS else np.inf


def _inputs(
    iq: NDArray[np.complex64], carrier_hz: float = _CARRIER_HZ, prf_hz: float = _PRF_HZ
) -> dict[str, NDArray[np.float32]]:
    return model_inputs(iq, carrier_hz=carrier_hz, prf_hz=prf_hz, names=tuple(INPUT_SHAPES))


def _difference(one: dict[str, NDArray[np.float32]], other: dict[str, NDArray[np.float32]]) -> float:
    return max(float(np.abs(one[name] - other[name]).max()) for name in one)


def _finite(inputs: dict[str, NDArray[np.float32]]) -> float:
    """Count the input values that are not finite; 0 is right."""
    return float(sum(np.count_nonzero(~np.isfinite(values)) for values in inputs.values()))


def _features(quick: bool) -> Iterator[Cell]:
    stage, invariant = "features", "largest change of a model input [its unit]"
    ordinary = rotor_record()
    reference = _inputs(ordinary)
    yield from sweep(
        stage, "gain", [-120, -60, -1, 1, 60, 120], invariant, 0.0, _SCALE_GUARD,
        lambda power: _difference(_inputs(np.ldexp(ordinary.view(np.float32), power).view(np.complex64)), reference),
        lambda power: f"2^{power:d}",
    )  # fmt: skip
    yield from sweep(
        stage, "gain", [1e-30, 1e-3, 1e3, 1e30], invariant, 0.05, _SCALE_GUARD,
        lambda gain: _difference(_inputs((ordinary * np.float64(gain)).astype(np.complex64)), reference), "{:g}".format,
    )  # fmt: skip
    swapped = ordinary.imag + 1j * ordinary.real
    yield from sweep(
        stage, "I and Q swapped", [0], "largest change of an unsigned feature [its unit]", 1.0,
        "velocity mirrors, no feature is signed",
        lambda _: float(np.abs(_inputs(swapped.astype(np.complex64))["features"] - reference["features"]).max()),
        lambda _: "-",
    )  # fmt: skip
    wrong = "inputs that are not finite [count]"
    yield from sweep(
        stage, "record", list(ODD), wrong, 0.0, "floor held 90 dB under the record; no value is 0 in its column",
        lambda name: _finite(_inputs(ODD[name](1000))), str,
    )  # fmt: skip
    yield from sweep(
        stage, "pulses", [2, 15, 16, 17, 127, 8191, *([] if quick else [1 << 20])], wrong, 0.0,
        "fewer than 16 pulses are refused", lambda n: _finite(_inputs(rotor_record(int(n)))), "{:d}".format,
        silent=(2, 15),
    )  # fmt: skip
    yield from sweep(
        stage, "carrier", [0.1e9, 2e9, 100e9, 300e9], wrong, 0.0, "levels outside the span hold their own mark",
        lambda f: _finite(_inputs(ordinary, f)), lambda f: f"{f / 1e9:g} GHz",
    )  # fmt: skip
    yield from sweep(
        stage, "dwell of 2000 pulses", [1e-4, 1.0, 60.0], wrong, 0.0, "each column held in the schema's range",
        lambda dwell: _finite(_inputs(ordinary, prf_hz=2000 / dwell)), "{:g} s".format,
    )  # fmt: skip
    yield from sweep(
        stage, "SNR", [-100.0, 200.0], wrong, 0.0, "each column held in the schema's range",
        lambda snr: _finite(_inputs(rotor_record(snr_db=snr))), "{:g} dB".format,
    )  # fmt: skip
