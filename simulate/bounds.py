"""Upper bounds of an echo's error when an effect is left out: amplitudes, pulse by pulse, in a scene's unit.

A blade's echo is a mean over its radius, so the bounds rest on moments of a phasor. M(n) = |integral of x^n exp(j z x)
over 0..1| is at most 1 / (n + 1), and by integration by parts at most (1 + n M(n-1)) / |z|. Errors of blades and rotors
are added as amplitudes.
"""

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, spherical_jn

from .blades import row_m
from .exact import hub_range_m
from .fidelity import CLOSED_FORM, Fidelity, centre_range_m
from .motion import TWO_PI
from .parts import BirdPart, RotorPart, UavPart
from .radar import Radar
from .render_bird import bird_echo, bird_parts_echo, heave_range_m, members
from .render_uav import rotor_angle_rad, uav_echo, vibration_rad

Amplitude = NDArray[np.float64]

_SPACING_CLASSES = 40  # classes of the slope of the phase along a blade, which its angle to the line of sight sets


def moment_envelope(order: int, z: Amplitude, root_share: float = 0.0, points: int | None = None) -> Amplitude:
    """Upper bound of |mean of (r / tip)^order exp(j phase)| over a blade, shape of `z`.

    Parameters
    ----------
    order : int
        Power of the radius, >= 0.
    z : ndarray
        Phase between root and tip [rad].
    root_share : float
        Radius of the root over that of the tip, 0..1.
    points : int, optional
        Points of a row, whose phases agree again at regular steps of `z`; None for a line. By summation by parts, a
        sum of rising numbers with phases d apart is at most the last of them over |sin(d / 2)|.
    """
    if points:
        whole = np.mean(row_m(root_share, 1.0, points) ** order)
        apart = np.abs(np.sin(z / (2 * max(1, points - 1))))
        return np.minimum(whole, 1 / np.maximum(points * apart, 1e-9))
    inverse = 1 / np.maximum(np.abs(z), 1e-9)
    moments = [np.minimum(1.0, 2 * inverse)]
    for n in range(1, order + 1):
        moments.append(np.minimum(1 / (n + 1), (1 + n * moments[-1]) * inverse))
    width = 1 - root_share
    out = np.zeros_like(inverse)
    for n, moment in enumerate(moments):
        out += comb(order, n) * root_share ** (order - n) * width**n * moment
    return out


def chord(phase_rad: Amplitude) -> Amplitude:
    """Upper bound of |exp(j e) - 1| for phase errors e of at most this size [rad]; 2 beyond half a turn."""
    return 2 * np.sin(np.minimum(np.abs(phase_rad), np.pi) / 2)


class UavBounds:
    """Bounds of one UAV at every pulse; each is an ndarray of float64, shape (pulses,).

    Parameters
    ----------
    part : UavPart
        The UAV.
    radar : Radar
        The radar that looks.
    times_s : ndarray of float64, shape (pulses,), optional
        Instants of the pulses [s] if they are not the radar's even ones.
    """

    def __init__(self, part: UavPart, radar: Radar, times_s: NDArray[np.float64] | None = None) -> None:
        self.part, self.radar = part, radar
        self.times_s = radar.times_s if times_s is None else times_s
        self.wavenumber = 2 * TWO_PI / radar.wavelength_m
        self.centre_m = centre_range_m(part, self.times_s, True)

    def of(self, effect: str) -> Amplitude:
        """Bound of the error of leaving out one of `fidelity.UAV_EFFECTS`."""
        bounds = {
            "blade_curvature": self.blade_curvature,
            "hub_curvature": self.hub_curvature,
            "acceleration": self.acceleration,
            "vibration": self.vibration,
            "wander": self.wander,
        }
        return bounds[effect]()

    def _blades(self, rotor: RotorPart) -> list[tuple[float, Amplitude]]:
        """Amplitude and angle of each blade."""
        angle = rotor_angle_rad(rotor, self.times_s, True)
        level = self.part.amplitude(rotor.flash_db)
        return [(level * a, angle + TWO_PI * n / rotor.blades) for n, a in enumerate(rotor.amplitudes)]

    def _phase(self, rotor: RotorPart) -> float:
        """Largest phase of the tip [rad], the paper's Gamma."""
        return self.wavenumber * rotor.blade_length_m * float(np.cos(self.part.beta_rad(rotor)))

    def _moments(self, rotor: RotorPart) -> tuple[float, Callable[[int, Amplitude], Amplitude]]:
        """Root radius over tip radius, and the rotor's `moment_envelope` as a function of order and phase."""
        share = rotor.root_m / rotor.blade_length_m
        return share, partial(moment_envelope, root_share=share, points=rotor.points)

    def blade_curvature(self) -> Amplitude:
        """Eq. (4) in place of (3): the sphere's sag r^2 sin^2 / (2 R) along the blade, to the third order."""
        out = np.zeros(len(self.times_s))
        for rotor in self.part.rotors:
            length, share, moment = rotor.blade_length_m, *self._moments(rotor)
            hub = hub_range_m(self.centre_m, rotor.offset_m, np.deg2rad(rotor.bearing_deg))
            cos_beta = np.cos(self.part.beta_rad(rotor))
            for amplitude, theta in self._blades(rotor):
                c = cos_beta * np.cos(theta)
                sag = self.wavenumber * length**2 * (1 - c**2) / (2 * hub)
                z = self.wavenumber * length * (1 - share) * c
                flat = moment(0, z)
                error = sag * moment(2, z) + sag**2 / 2 * moment(4, z)
                error += (sag**3 / 6 + sag * 2 * length / hub) * flat
                edges = 1 + np.abs(rotor.edge_asymmetry * np.sin(theta))
                out += amplitude * edges * np.minimum(error, 2.0)
        return out

    def hub_curvature(self) -> Amplitude:
        """Eq. (2) in place of (1) for hubs and for the body's scatterers."""
        out = np.zeros(len(self.times_s))
        for rotor in self.part.rotors:
            share, moment = self._moments(rotor)
            flash = np.zeros(len(self.times_s))
            for amplitude, theta in self._blades(rotor):
                z = self._phase(rotor) * (1 - share) * np.cos(theta)
                flash += amplitude * (1 + np.abs(rotor.edge_asymmetry * np.sin(theta))) * moment(0, z)
            out += flash * self._hub_chord(rotor.offset_m, rotor.bearing_deg)
        for point in self.part.body:
            out += self.part.amplitude(point.level_db) * self._hub_chord(point.offset_m, point.bearing_deg)
        return out

    def _hub_chord(self, offset_m: float, bearing_deg: float) -> Amplitude:
        near, far = (
            hub_range_m(self.centre_m, offset_m, np.deg2rad(bearing_deg), far_field=flag) for flag in (False, True)
        )
        return chord(self.wavenumber * (near - far))

    @cached_property
    def level(self) -> Amplitude:
        """Upper bound of the whole echo's amplitude, with every effect."""
        return np.abs(uav_echo(self.part, self.radar, self.times_s, CLOSED_FORM)) + self.blade_curvature()

    def _apart(self, path_rad: Amplitude) -> Amplitude:
        """Error to add where the whole echo is turned by `path_rad`: parts off the line of sight move a little less."""
        total = sum(self.part.amplitude(r.flash_db) * 2 * sum(r.amplitudes) for r in self.part.rotors)
        total += sum(self.part.amplitude(b.level_db) for b in self.part.body)
        return total * np.minimum(2, np.abs(path_rad)) * (self.part.reach_m / self.centre_m.min()) ** 2

    def acceleration(self) -> Amplitude:
        """A constant velocity in place of an accelerated one: the whole echo turns by the path's own error."""
        path = self.wavenumber * np.abs(self.part.acceleration_mps2) * self.times_s**2 / 2
        return self.level * chord(path) + self._apart(path) if path.any() else path

    def vibration(self) -> Amplitude:
        """A still airframe in place of a shaken one: the whole echo turns by the vibration's phase."""
        phase = vibration_rad(self.part, self.times_s)
        return self.level * chord(phase) if phase.any() else phase

    def wander(self) -> Amplitude:
        """A constant rotation rate in place of one that drifts and wanders."""
        return sum(
            (
                self._turned(rotor, self.times_s, wanders=False)
                for rotor in self.part.rotors
                if rotor.drift_hz_per_s or rotor.wander_hz
            ),
            np.zeros(len(self.times_s)),
        )

    def jitter(self, times_s: NDArray[np.float64]) -> Amplitude:
        """Even instants in place of `times_s`: blades turn, and the whole echo follows path and vibration."""
        moved = centre_range_m(self.part, times_s, True) - self.centre_m
        phase = self.wavenumber * moved
        shaken = vibration_rad(self.part, times_s) - vibration_rad(self.part, self.times_s)
        turned = sum((self._turned(rotor, times_s) for rotor in self.part.rotors), np.zeros(len(times_s)))
        return turned + self.level * chord(np.abs(phase) + np.abs(shaken)) + self._apart(phase)

    def _turned(self, rotor: RotorPart, times_s: NDArray[np.float64], *, wanders: bool = True) -> Amplitude:
        """Error of blades at the angles of other instants, or of a steady rate, in place of the true angles."""
        out = np.zeros(len(self.times_s))
        (share, moment), phase = self._moments(rotor), self._phase(rotor)
        hub = hub_range_m(self.centre_m, rotor.offset_m, np.deg2rad(rotor.bearing_deg))
        length = rotor.blade_length_m
        # at short range the sphere's sag shifts the flash, and a turning tip changes its range faster
        faster = hub / np.maximum(hub - length, 1e-3 * length)

        def straight(cosine: Amplitude) -> Amplitude:
            """Least phase along the blade that remains where the sag may cancel its slope."""
            sag = self.wavenumber * length**2 * (1 - cosine**2) / (2 * hub)
            if rotor.points:  # a row's phases agree again at regular steps: none is counted on where there is sag
                return np.asarray(np.where(sag < 0.05, phase * np.abs(cosine), 0) * (1 - share))
            return np.asarray(np.maximum(phase * np.abs(cosine) - 2 * sag, 0) * (1 - share))

        others = rotor_angle_rad(rotor, times_s, wanders) - rotor_angle_rad(rotor, self.times_s, True)
        away = np.abs(others)
        for amplitude, true in self._blades(rotor):
            here, there = np.cos(true), np.cos(true + others)
            # the flash is where the cosine is smallest: at an end of the arc between both, or within it
            least = np.where((here * there <= 0) | (away > 1), 0.0, np.minimum(np.abs(here), np.abs(there)))
            slope = faster * phase * np.sqrt(1 - least**2) * moment(1, straight(least))
            edges = 1 + np.abs(rotor.edge_asymmetry)
            error = away * (edges * slope + np.abs(rotor.edge_asymmetry) * moment(0, straight(least)))
            apart = edges * (moment(0, straight(here)) + moment(0, straight(there)))
            out += amplitude * np.minimum(error, apart)
        return out

    def spacing(self, points: int) -> float:
        """Error energy of this many Gauss points a blade in place of the continuous blade, over all pulses.

        The rule of n points is exact for polynomials of order 2 n - 1. Its error for a phasor comes from the Legendre
        terms from order 2 n on, (2 l + 1) j_l(z / 2): the first counts by a known share, the others by one at most. The
        sphere's sag bends the phase; the error of that is added (`sag_error`).
        """
        total = np.zeros(len(self.times_s))
        for rotor in self.part.rotors:
            if rotor.points or rotor.root_m == rotor.blade_length_m:
                continue
            half = self.wavenumber * (rotor.blade_length_m - rotor.root_m) / 2
            cos_beta = np.cos(self.part.beta_rad(rotor))
            nearest = float(self.centre_m.min()) - rotor.offset_m
            nearness = rotor.blade_length_m / nearest
            sag = half * (rotor.blade_length_m - rotor.root_m) / nearest
            for amplitude, theta in self._blades(rotor):
                cosine = np.abs(cos_beta * np.cos(theta))
                # the sphere's sag makes the phase run faster towards the tip
                steepest = cosine + nearness * (1 - cosine**2)
                classes, missed = _gauss_errors(points, half, float(np.ceil(64 * steepest.max())) / 64, sag)
                which = np.searchsorted(classes, steepest)
                total += amplitude * (1 + np.abs(rotor.edge_asymmetry * np.sin(theta))) * missed[which]
        return float(np.sum(total**2))


@lru_cache(maxsize=512)
def _gauss_errors(points: int, half_phase_rad: float, steepest: float, sag_rad: float) -> tuple[Amplitude, Amplitude]:
    """Upper ends of classes of the phase's slope up to `steepest`, finest there, and the Gauss rule's error in each.

    The error is that for a straight phase plus that for its bend. Cached, because the rotors of an airframe are often
    alike.
    """
    classes = steepest * (1 - np.linspace(1, 0, _SPACING_CLASSES + 1)[1:] ** 2)
    half_phase = half_phase_rad * classes
    bent = np.maximum.accumulate(sag_error(points, 2 * half_phase, sag_rad))
    return classes, np.minimum(gauss_error(points, half_phase) + bent, 2.0)


def sag_error(points: int, phase_rad: Amplitude, sag_rad: float) -> Amplitude:
    """Upper bound of the error that a phase bent by a sag adds to a Gauss rule for exp(j phase) over a blade.

    The rule's error is a known share of the phasor's derivative of order 2 n. That derivative is a sum over powers of
    the slope, at most `phase_rad` along the blade, and of half the second derivative, `sag_rad`. The term of the slope
    alone is left out here: `gauss_error` bounds it.
    """
    bends = np.arange(1, points + 1)
    order = 2 * points
    share = 4 * gammaln(points + 1) - 2 * gammaln(order + 1) - np.log(order + 1)
    ways = share - gammaln(bends + 1) - gammaln(order - 2 * bends + 1) + bends * np.log(max(sag_rad, 1e-300))
    slopes = (order - 2 * bends) * np.log(np.maximum(phase_rad, 1e-300))[:, None]
    return np.asarray(np.exp(np.minimum(ways + slopes, 1.0)).sum(axis=1).clip(max=2.0))


def gauss_error(points: int, half_phase_rad: Amplitude) -> Amplitude:
    """Upper bound of the error of a Gauss rule for the mean of exp(j z x / 2) over -1..1.

    z / 2 is `half_phase_rad`, in rising order; the bound grows with it, up to 2.
    """
    first = 2 * points
    # C(4n, 2n) / C(2n, n)^2: the leading coefficients of the Legendre polynomials of order 2n and n
    share = np.exp(gammaln(4 * points + 1) - 4 * gammaln(2 * points + 1) + 4 * gammaln(points + 1)) / (2 * points + 1)
    orders = np.arange(first, first + 24 + 6 * int(np.cbrt(first)), 2)
    terms = (2 * orders + 1) * np.abs(spherical_jn(orders, half_phase_rad[:, None]))
    terms[:, 0] *= share
    # beyond the order the terms no longer fall: the rule misses the phasor altogether there
    error = np.where(half_phase_rad > first, 2.0, np.minimum(terms.sum(axis=1), 2.0))
    return np.maximum.accumulate(error)


def bird_bound(part: BirdPart, radar: Radar, effect: str, times_s: Amplitude | None = None) -> Amplitude:
    """Bound of leaving out one of `fidelity.BIRD_EFFECTS`, shape (pulses,), at even instants or at `times_s`."""
    times = radar.times_s if times_s is None else times_s
    wavenumber = 2 * TWO_PI / radar.wavelength_m
    if effect == "acceleration":
        echo = bird_echo(part, radar, times, Fidelity(frozenset({"heave"})))
        return np.abs(echo) * chord(wavenumber * part.acceleration_mps2 * times**2 / 2)
    out = np.zeros(len(times))
    for bird in members(part):
        heave = heave_range_m(part, times, bird)
        out += np.abs(bird_parts_echo(part, radar, times, bird)) * chord(wavenumber * heave)
    return out
