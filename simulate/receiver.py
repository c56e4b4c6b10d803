"""The receiver: thermal noise, and the faults that real recordings have.

Faults fall on every class alike, so that none of them gives a label away.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .clutter import process_velocities, real_noise, shaped_noise
from .grid import PulseGrid, Sine
from .laws import Draws
from .motion import TWO_PI, turned
from .radar import Radar
from .target import Normals

#: Probability of each fault in a receiver that may have faults.
FAULT_CHANCE = {
    "fading": 0.4,
    "impulses": 0.2,
    "steps": 0.16,
    "limiter": 0.06,
    "high_pass": 0.12,
    "canceller": 0.08,
    "flicker": 0.25,
    "phase_noise": 0.25,
    "mains": 0.25,
    "bursts": 0.25,
    "colour": 0.5,
    "image": 0.3,
    "real_only": 0.03,
    "analytic": 0.14,
    "converter": 0.4,
    "spurs": 0.04,
}

#: Effect that each parameter of a receiver belongs to.
EFFECT_OF = {
    "fading_db": "fading",
    "fading_hz": "fading",
    "impulse_db": "impulses",
    "impulse_pulses": "impulses",
    "impulse_lasts": "impulses",
    "impulse_turns": "impulses",
    "impulse_sweep": "impulses",
    "impulse_count": "impulses",
    "step_db": "steps",
    "step_rad": "steps",
    "step_count": "steps",
    "limit_db": "limiter",
    "spur_db": "spurs",
    "spur_turns": "spurs",
    "spur_count": "spurs",
    "high_pass_hz": "high_pass",
    "canceller_pulses": "canceller",
    "flicker_db": "flicker",
    "phase_noise_rad": "phase_noise",
    "mains_db": "mains",
    "burst_hz": "bursts",
    "burst_share": "bursts",
    "burst_db": "bursts",
    "tilt_db": "colour",
    "hump_db": "colour",
    "hump_turns": "colour",
    "image_db": "image",
    "full_scale_db": "converter",
    "adc_bits": "converter",
}

#: Probability that a receiver has no fault, as in simulated records and good radars. With faults in nearly all records,
#: networks do worse with clear receivers, and no better with faulty ones (docs/ablation.md).
FAULTLESS_CHANCE = 0.5

#: Number of humps of a band that is not flat.
HUMPS = 2

#: Largest share that spoilt stretches take: all those at random times together of the record, each of the evenly spaced
#: ones of the time between two.
SPOILT_SHARE = 0.25

#: Most steady lines of a receiver's own.
SPURS = 3

#: Most steps of a receiver's gain and phase within a record.
MAX_STEPS = 8


class Receiver:
    """One receiver a record, drawn before the target so that it is the same whatever the target is.

    Parameters
    ----------
    draws : Draws
        The records' uniform numbers.
    """

    def __init__(self, draws: Draws) -> None:
        on = {name: draws.chance(chance) for name, chance in FAULT_CHANCE.items()}
        self.fading_db = draws.value("fading_db")
        self.fading_hz = draws.value("fading_hz", 2)
        self.fading_phase = draws.value("phase_rad", 2)
        self.impulse_db = draws.value("impulse_db")
        self.impulse_at = draws.uniform()
        self.impulse_lasts = draws.value("impulse_lasts")
        self.impulse_turns = draws.value("impulse_turns")
        self.impulse_sweep = draws.value("impulse_sweep") * draws.sign()
        self.impulse_count = np.rint(draws.value("impulse_count"))
        self.spur_db = draws.value("spur_db", SPURS)
        self.spur_turns = draws.value("spur_turns", SPURS)
        self.spur_phase = draws.value("phase_rad", SPURS)
        self.spur_count = np.rint(draws.value("spur_count"))
        self.high_pass_hz = draws.value("high_pass_hz")
        self.canceller_pulses = np.rint(draws.value("canceller_pulses"))
        self.flicker_db = draws.value("flicker_db")
        self.phase_noise_rad = draws.value("phase_noise_rad")
        self.mains_hz = np.where(draws.chance(0.5), 50.0, 60.0)
        self.mains_db = draws.value("mains_db")
        self.mains_slope = 1 + 2 * draws.uniform()
        self.mains_phase = draws.value("phase_rad", 12)
        self.tilt_db = draws.value("tilt_db")
        self.hump_db = draws.value("hump_db", HUMPS)
        self.hump_turns = draws.value("hump_turns", HUMPS)
        self.hump_phase = draws.value("phase_rad", HUMPS)
        self.image_db = draws.value("image_db")
        self.conjugate = draws.chance(0.5)
        self.full_scale_db = draws.value("full_scale_db")
        self.bits = np.rint(draws.value("adc_bits"))
        self.gain_db = draws.value("gain_db")
        periods = np.where(draws.chance(0.7), 2.0, 1.0)
        of_mains, any_hz = draws.chance(0.5), draws.value("burst_hz")
        self.burst_share = draws.value("burst_share")
        self.burst_db = draws.value("burst_db")
        self.burst_phase = draws.value("phase_rad")
        self.burst_alike = draws.chance(0.5)
        # identical bursts, a rectifier's ticks, come once or twice a mains period; at any other rate bursts are noise
        self.bursts_of_mains = of_mains | self.burst_alike
        self.burst_hz = np.where(self.bursts_of_mains, periods * self.mains_hz, any_hz)
        faulty = ~draws.chance(FAULTLESS_CHANCE)
        self.impulse_even = draws.chance(0.5)
        self.impulse_pulses = draws.value("impulse_pulses")
        self.step_db = draws.value("step_db")
        self.step_rad = draws.value("step_rad")
        self.step_count = np.rint(draws.value("step_count"))
        self.step_at = draws.uniform(MAX_STEPS)
        self.step_shares = draws.uniform(2 * MAX_STEPS + 2)
        self.limit_db = draws.value("limit_db")
        self.on = {name: chosen & faulty for name, chosen in on.items()}

    def receive(
        self,
        signal: NDArray[np.complex64],
        noise: NDArray[np.complex64],
        radar: Radar,
        normals_of: "Callable[[str], NormalsOf]",
    ) -> NDArray[np.complex64]:
        """Pass the signals through their receivers.

        Parameters
        ----------
        signal : ndarray of complex64, shape (records, pulses)
            What reaches the antenna, in units in which the thermal noise has unit power. Changed in place.
        noise : ndarray of complex64, shape (records, pulses)
            Thermal noise of unit power.
        radar : Radar
            The radar that looks.
        normals_of : callable
            Gives the source of normal numbers for an effect, by its name.

        Returns
        -------
        ndarray of complex64, shape (records, pulses)
        """
        v = process_velocities(radar)
        colour = 1 / np.maximum(np.abs(v), np.abs(v[1])) if len(v) > 1 else np.ones(1)
        iq = signal
        rows = np.flatnonzero(self.on["fading"])
        iq[rows] *= self._fading(radar, rows)
        rows = np.flatnonzero(self.on["phase_noise"])
        if len(rows):
            # an oscillator's close-in noise falls as 1/f^2; small angles, so a real process of that spectrum will do
            side = colour[: len(v) // 2 + 1] ** 2
            side[0] = 0
            angle = real_noise(normals_of("phase_noise")(rows), radar, side)
            angle *= self.phase_noise_rad[rows].astype(np.float32)[:, None]
            iq[rows] *= turned(angle)
        iq = iq + noise
        rows = np.flatnonzero(self.on["impulses"])
        if len(rows):
            self._spoil(iq, rows, normals_of("impulses")(rows))
        rows = np.flatnonzero(self.on["steps"])
        if len(rows):
            iq[rows] *= self._steps(radar, rows)
        for row in np.flatnonzero(self.on["limiter"]):
            limit = np.float32(10 ** (self.limit_db[row] / 20))
            iq[row] *= limit / np.maximum(np.abs(iq[row]), limit)
        rows = np.flatnonzero(self.on["flicker"])
        if len(rows):
            # the law sets the density at 1 % of the PRF; the process has unit power, so scale by the sum of the lines
            corner = 0.02 * radar.unambiguous_mps
            power = 10 ** (self.flicker_db[rows] / 10) * corner * colour.sum() / len(v)
            iq[rows] += np.sqrt(power).astype(np.float32)[:, None] * shaped_noise(
                normals_of("flicker")(rows), radar, colour[None], v
            )
        rows = np.flatnonzero(self.on["spurs"])
        if len(rows):
            iq[rows] += self._spurs(radar, rows)
        rows = np.flatnonzero(self.on["mains"])
        if len(rows):
            iq[rows] += self._mains(radar, rows)
        rows = np.flatnonzero(self.on["bursts"])
        if len(rows):
            iq[rows] += self._bursts(radar, rows, normals_of("bursts")(rows))
        self._filter(iq, radar)
        rows = np.flatnonzero(self.on["image"])
        iq[rows] += (10 ** (self.image_db[rows] / 20)).astype(np.float32)[:, None] * iq[rows].conj()
        rows = np.flatnonzero(self.on["real_only"])
        iq[rows] = iq[rows].real
        self._one_sided(iq, np.flatnonzero(self.on["analytic"]))
        self._convert(iq, np.flatnonzero(self.on["converter"]))
        return iq * (10 ** (self.gain_db / 20)).astype(np.float32)[:, None]

    def _fading(self, radar: Radar, rows: NDArray[np.intp]) -> NDArray[np.float32]:
        """Amplitude factor of the slow rise and fall of all that the antenna sees: glint, multipath, a moving beam."""
        swing = np.broadcast_to(np.log(10) * self.fading_db[rows, None] / 40, (len(rows), self.fading_hz.shape[1]))
        gain = PulseGrid(radar).sines(Sine(swing, self.fading_hz[rows], self.fading_phase[rows]))
        return np.exp(gain, out=gain)

    def _spoil(self, iq: NDArray[np.complex64], rows: NDArray[np.intp], normals: Normals) -> None:
        """Add another emitter's pulses, single or in stretches, at random times or, as of another radar, evenly spaced.

        Single pulses are as short in time as a rotor's flashes can be, and evenly spaced ones as regular; in Doppler
        they are white. A stretch is a tone that sweeps, from hardly at all to the whole band: a packet, another radar's
        chirp. Each has a phase of its own: evenly spaced pulses of one phase would be ticks, and with ticks at any rate
        in training, drones are missed (docs/ablation.md).
        """
        pulses = iq.shape[-1]
        phases = normals(4 * pulses).view(np.complex64)
        phases /= np.abs(phases)
        for row, (phase, other) in zip(rows, phases.reshape(len(rows), 2, pulses), strict=True):
            even, spacing = self.impulse_even[row], max(float(self.impulse_pulses[row]), 1.0)
            most = int((spacing if even else pulses) * SPOILT_SHARE)
            lasts = max(1, min(round(float(self.impulse_lasts[row])), most))
            if even:
                first = np.arange(self.impulse_at[row] * spacing, pulses, spacing).astype(np.intp)
            else:
                count = max(1, min(int(self.impulse_count[row]), int(pulses * SPOILT_SHARE / lasts)))
                first = ((np.angle(other[:count]) / TWO_PI + 0.5) * pulses).astype(np.intp) % pulses
            within = np.arange(lasts)
            turns = within * (self.impulse_turns[row] + self.impulse_sweep[row] * within / (2 * lasts))
            tone = turned((TWO_PI * (turns % 1)).astype(np.float32))  # up to millions of turns: reduced in float64
            stretch = np.float32(10 ** (self.impulse_db[row] / 20)) * phase[: len(first), None] * tone
            spoilt = first[:, None] + within
            heard = spoilt < pulses
            # not +=: two stretches may fall on one pulse
            np.add.at(iq[row], spoilt[heard], np.broadcast_to(stretch, spoilt.shape)[heard])

    def _steps(self, radar: Radar, rows: NDArray[np.intp]) -> NDArray[np.complex64]:
        """Factor whose gain and phase step at random times: a control switches attenuators, an oscillator relocks."""
        out = np.empty((len(rows), radar.pulses), np.complex64)
        for factor, row in zip(out, rows, strict=True):
            at = np.sort(self.step_at[row, : int(self.step_count[row])]) * radar.pulses
            stretch = np.searchsorted(at, np.arange(radar.pulses))
            lost, turned_by = self.step_shares[row].reshape(2, -1)
            neper = -np.log(10) / 20 * self.step_db[row] * lost
            factor[:] = np.exp(neper + 1j * self.step_rad[row] * (2 * turned_by - 1))[stretch]
        return out

    def _spurs(self, radar: Radar, rows: NDArray[np.intp]) -> NDArray[np.complex64]:
        """Steady lines of the receiver's own, or of another mover: several lines alone are no rotor's comb."""
        out = np.zeros((len(rows), radar.pulses), np.complex64)
        for n in range(SPURS):
            level = np.where(n < self.spur_count[rows], 10 ** (self.spur_db[rows, n] / 20), 0.0).astype(np.float32)
            turns = self.spur_turns[rows, n, None] * np.arange(radar.pulses) % 1  # thousands: reduced in float64
            angle = (TWO_PI * turns + self.spur_phase[rows, n, None]).astype(np.float32)
            out += level[:, None] * turned(angle)
        return out

    def _mains(self, radar: Radar, rows: NDArray[np.intp]) -> NDArray[np.float32]:
        """Harmonics of the mains; they are real, so that both sides of the spectrum are alike."""
        order = np.arange(1, self.mains_phase.shape[1] + 1)
        amplitude = order ** -self.mains_slope[rows, None]
        amplitude *= np.sqrt(2 * 10 ** (self.mains_db[rows, None] / 10) / (amplitude**2).sum(axis=1, keepdims=True))
        cosine = self.mains_phase[rows] + TWO_PI / 4
        return PulseGrid(radar).sines(Sine(amplitude, order * self.mains_hz[rows, None], cosine))

    def _bursts(self, radar: Radar, rows: NDArray[np.intp], normals: Normals) -> NDArray[np.complex64]:
        """Bursts at a steady rate: in time they resemble a rotor's flashes.

        Some are noise, which has no structure in Doppler. Others are identical and of constant amplitude, a rectifier's
        ticks, whose comb in Doppler has no end. The shortest burst lasts one pulse.
        """
        white = normals(2 * radar.pulses).view(np.complex64)
        rate_hz = self.burst_hz[rows, None]
        period = radar.prf_hz / rate_hz  # in pulses, as `since` and `lasts` below
        since = (rate_hz * radar.times_s + self.burst_phase[rows, None] / TWO_PI) % 1 * period
        lasts = np.clip(self.burst_share[rows, None] * period, 1.0, period)
        alike = self.burst_alike[rows]
        shape = white[alike] / np.abs(white[alike])  # all bursts of a record have the same shape
        white[alike] = np.sqrt(2) * np.take_along_axis(shape, since[alike].astype(int) % radar.pulses, axis=-1)
        amplitude = np.sqrt(10 ** (self.burst_db[rows, None] / 10) * period / (2 * lasts))
        return white * np.where(since < lasts, amplitude, 0.0).astype(np.float32)

    def _filter(self, iq: NDArray[np.complex64], radar: Radar) -> None:
        """Apply the frequency response in place: a band that is not flat, a high-pass filter, a clutter canceller.

        The band falls towards its edges and has smooth humps anywhere, so that a hump of noise does not pass for a
        rotor's band. A receiver coupled by capacitors lets nothing near velocity zero through. A clutter canceller
        subtracts each pulse from the next, once or twice: |2 sin(pi f / PRF)|, or its square, over the whole band
        (Skolnik, Introduction to Radar Systems, ch. 3), apart from a delay.
        """
        share = (fft.fftfreq(iq.shape[-1]) * 2).astype(np.float32)
        tilt, square = share**2, fft.fftfreq(iq.shape[-1], 1 / radar.prf_hz).astype(np.float32) ** 2
        neper = np.float32(np.log(10) / 20)
        cancelled = np.abs(2 * np.sin(np.float32(np.pi / 2) * share))
        for row in np.flatnonzero(self.on["colour"] | self.on["high_pass"] | self.on["canceller"]):
            spectrum = fft.fft(iq[row])
            if self.on["colour"][row]:
                turns = np.float32(TWO_PI) * self.hump_turns[row].astype(np.float32)[:, None] * share
                level = np.cos(turns + self.hump_phase[row].astype(np.float32)[:, None])
                level *= self.hump_db[row].astype(np.float32)[:, None]
                total = level.sum(axis=0)
                total += np.float32(self.tilt_db[row]) * tilt
                total *= neper
                spectrum *= np.exp(total, out=total)
            if self.on["high_pass"][row]:
                spectrum *= square / (square + np.float32(self.high_pass_hz[row] ** 2))
            if self.on["canceller"][row]:
                spectrum *= cancelled ** (int(self.canceller_pulses[row]) - 1)
            iq[row] = fft.ifft(spectrum, overwrite_x=True)

    def _one_sided(self, iq: NDArray[np.complex64], rows: NDArray[np.intp]) -> None:
        """Make records like real recordings made analytic afterwards: both sides fold onto one, the other is empty."""
        pulses = iq.shape[-1]
        keep = np.zeros(pulses, np.float32)
        keep[1 : (pulses + 1) // 2] = 2
        keep[0] = 1
        if pulses % 2 == 0:
            keep[pulses // 2] = 1
        for row in rows:
            spectrum = np.zeros(pulses, np.complex64)
            side = fft.rfft(iq[row].real)
            spectrum[: len(side)] = side
            folded = fft.ifft(spectrum * keep, overwrite_x=True)
            iq[row] = folded.conj() if self.conjugate[row] else folded

    def _convert(self, iq: NDArray[np.complex64], rows: NDArray[np.intp]) -> None:
        """Clip and quantise as a converter whose full scale is set relative to the record's largest sample."""
        for row in rows:
            largest = max(np.abs(iq[row].real).max(), np.abs(iq[row].imag).max())
            if largest == 0:
                continue
            scale = np.float32(largest * 10 ** (self.full_scale_db[row] / 20))
            step = scale / np.float32(2 ** (self.bits[row] - 1))
            for part in (iq[row].real, iq[row].imag):
                part[:] = np.rint(np.clip(part, -scale, scale) / step) * step


class NormalsOf:
    """Hands out normal numbers from each record's own generator.

    Parameters
    ----------
    generators : list of numpy.random.Generator
        One a record.
    """

    def __init__(self, generators: list[np.random.Generator]) -> None:
        self._generators = generators

    def __call__(self, rows: NDArray[np.intp]) -> Normals:
        """Give the source for these rows: it returns shape (len(rows), count)."""

        def normals(count: int) -> NDArray[np.float32]:
            out = np.empty((len(rows), count), np.float32)
            for line, row in zip(out, rows, strict=True):
                self._generators[row].standard_normal(dtype=np.float32, out=line)
            return out

        return normals
