"""What the paper measures on a dwell, by its rules and by ours, and what its theory says of the scene."""

from dataclasses import dataclass

import numpy as np
from bladewing.features.bandwidth import threshold_band_hz
from bladewing.features.chopping import cepstral_chopping
from bladewing.features.notch import body_line, notch_mask, parabola_offset
from bladewing.features.samples import unit_scale
from bladewing.features.spectrum import centred_power, doppler_spectrum, noise_floor
from bladewing.features.window import KAISER
from bladewing.simulate.analytic import rotor_lines
from bladewing.simulate.render import Rendering
from bladewing.simulate.scene import Scene
from scipy.fft import next_fast_len

#: QUIET_BAND_HZ: the paper's threshold is relative to the mean amplitude of this band [Hz]. SIMULATED_DB: the threshold
#: on simulated data [dB].
QUIET_BAND_HZ, SIMULATED_DB = (8e3, 10e3), 30.0

#: The first lines are sought from LOBE_BINS above the body [bins], where they rise LINE_DB over the noise floor [dB],
#: in a transform ZERO_PADDING times as long as the dwell.
LOBE_BINS, LINE_DB, ZERO_PADDING = 4.0, 15.0, 8


@dataclass(frozen=True)
class PaperMeasures:
    """What is measured on one dwell [Hz]; NaN where nothing is found."""

    bandwidth_hz: float
    chopping_hz: float
    cepstral_hz: float
    shift_hz: float


def by_the_papers_rules(rendering: Rendering, threshold_db: float) -> PaperMeasures:
    """Measure a dwell by the paper's rules, and the chopping frequency by the cepstrum too.

    Parameters
    ----------
    rendering : Rendering
        The dwell.
    threshold_db : float
        Threshold over the mean amplitude in `QUIET_BAND_HZ` [dB].
    """
    radar = rendering.radar
    spectrum = doppler_spectrum(rendering.iq, carrier_hz=radar.carrier_hz, prf_hz=radar.prf_hz)
    frequency = spectrum.frequency_hz
    quiet = (frequency > QUIET_BAND_HZ[0]) & (frequency < QUIET_BAND_HZ[1])
    mean_amplitude = np.sqrt(spectrum.relative_power[quiet]).mean()
    low, high = threshold_band_hz(spectrum, float(20 * np.log10(mean_amplitude)) + threshold_db)
    body = body_line(spectrum)
    chopping = cepstral_chopping(spectrum, notch_mask(spectrum, body.index))
    shift = -2 * float(body.velocity_mps) / radar.wavelength_m
    return PaperMeasures(float(high - low), first_lines_hz(rendering), float(chopping.frequency_hz), shift)


def first_lines_hz(rendering: Rendering) -> float:
    """Distance of the first two lines on the positive side of the body [Hz]: the paper's chopping frequency; or NaN."""
    radar, iq = rendering.radar, rendering.iq
    bins = ZERO_PADDING * next_fast_len(radar.pulses)
    power = centred_power(iq * unit_scale(iq), bins, window=KAISER)
    level = 10 * np.log10(power / noise_floor(power, KAISER) + 1e-12)
    lobe = int(LOBE_BINS * bins / radar.pulses)
    side = level[int(level.argmax()) + lobe :]
    peaks = 1 + np.flatnonzero((side[1:-1] > side[:-2]) & (side[1:-1] >= side[2:]) & (side[1:-1] > LINE_DB))
    if len(peaks) < 2:
        return float("nan")
    # the window's lobe is close to a Gaussian, whose logarithm is a parabola
    first, second = (peak + parabola_offset(*side[peak - 1 : peak + 2]) for peak in peaks[:2])
    return float((second - first) * radar.prf_hz / bins)


def theory(scene: Scene) -> tuple[float, float, float]:
    """Bandwidth (eq. 26), chopping frequency (eq. 25) of the mean rate, and shift of a scene's first UAV [Hz]."""
    (part, *_), wavelength = scene.uavs, scene.sight.wavelength_m
    first = part.rotors[0]
    alike = [r for r in part.rotors if r.blade_length_m == first.blade_length_m]  # not a helicopter's tail
    beta = np.cos(np.deg2rad(part.beta_deg))
    fastest = max(abs(r.rotation_hz) * r.blade_length_m for r in part.rotors)
    chopping = float(np.mean([abs(r.rotation_hz) for r in alike])) * first.blades
    return round(float(8 * np.pi / wavelength * fastest * beta), 6), chopping, 0.0 - 2 * part.velocity_mps / wavelength


def strongest_line_db(scene: Scene) -> float:
    """How far the strongest blade line stands under the body, by eq. (24) [dB]."""
    part, strongest = scene.uavs[0], -np.inf
    for rotor in part.rotors:
        lines = rotor_lines(
            rotation_hz=rotor.rotation_hz,
            wavelength_m=scene.sight.wavelength_m,
            blade_length_m=rotor.blade_length_m,
            beta_rad=float(np.deg2rad(part.beta_deg)),
            root_m=rotor.root_m,
            blade_amplitudes=rotor.amplitudes,
        )
        moving = np.abs(lines.amplitude[lines.orders != 0]).max()
        strongest = max(strongest, 20 * np.log10(moving) + rotor.flash_db)
    return max(point.level_db for point in part.body) - float(strongest)
