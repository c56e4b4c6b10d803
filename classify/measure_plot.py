"""One dwell's spectrum as SVG, with the comb, the band and the notch drawn on it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from bladewing.features.measurements import Measurements
from bladewing.features.notch import NOTCH_MPS
from bladewing.features.spectrum import doppler_spectrum

from .errors import one_line
from .recording import Recording

#: Colours of what is drawn behind the spectrum.
_LEGEND = (("#dbe9f6", "band"), ("#f3d9b1", "notch"), ("#c0392b", "comb"), ("#1e8449", "2nd comb"))

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _BOTTOM, _TOP = 960, 470, 56, 12, 44, 80

#: Centre of the plot area.
_MIDDLE_X, _MIDDLE_Y = (_LEFT + _WIDTH - _RIGHT) / 2, (_TOP + _HEIGHT - _BOTTOM) / 2

_MINUS = "\u2212"

#: Most characters of a name that fit above the plot.
_LONGEST_NAME = 100

#: Lowest level of the plot: lower levels are drawn at this one [dB].
_BOTTOM_DB = -10.0

#: Width of the span that is shown over that of the band; where no band is measured, the whole span is shown.
_MARGIN = 1.6


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below a value."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least))


@dataclass(frozen=True)
class _Frame:
    """The plot area, from `low` to `high` [Hz] and `bottom_db` to `top_db`."""

    low: float
    high: float
    bottom_db: float
    top_db: float

    def x(self, hz: float) -> float:
        return _LEFT + (hz - self.low) / (self.high - self.low) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, db: float) -> float:
        return _TOP + (self.top_db - db) / (self.top_db - self.bottom_db) * (_HEIGHT - _TOP - _BOTTOM)

    @property
    def base(self) -> float:
        """Its lower edge, in the coordinates of the SVG."""
        return self.y(self.bottom_db)

    def band(self, first_hz: float, last_hz: float, colour: str, title: str) -> Iterator[str]:
        """Colour the span between two frequencies, as far as it is shown."""
        a, b = self.x(max(first_hz, self.low)), self.x(min(last_hz, self.high))
        if b > a:
            yield (
                f'<rect x="{a:.1f}" y="{_TOP}" width="{b - a:.1f}" height="{self.base - _TOP:.1f}" fill="{colour}">'
                f"<title>{title}</title></rect>"
            )

    def comb(self, body_hz: float, spacing_hz: float, half_hz: float, colour: str, length: int) -> Iterator[str]:
        """Mark the places of a comb's lines up to `half_hz` from the body."""
        reach = int(half_hz / spacing_hz + 1e-6)
        for order in range(-reach, reach + 1):
            hz = body_hz + order * spacing_hz
            if self.low <= hz <= self.high:
                yield (
                    f'<path d="M{self.x(hz):.1f} {self.base:.1f}v-{length}" stroke="{colour}" stroke-width="1.2"/>'
                    f'<path d="M{self.x(hz):.1f} {_TOP}V{self.base:.1f}" stroke="{colour}" stroke-width="0.5" '
                    'opacity="0.6"/>'
                )

    def axes(self, per_mps: float) -> Iterator[str]:
        """Axes of the Doppler frequency, below, and of the velocity, above, which falls where the frequency rises."""
        for per_unit, edge, tick, label_y in ((1.0, self.base, 4, self.base + 20), (-per_mps, _TOP, -4, _TOP - 8)):
            first, last = sorted((self.low / per_unit, self.high / per_unit))
            step = _round_step((last - first) / 10)
            for value in np.arange(np.ceil(first / step), np.floor(last / step) + 1) * step:
                at = self.x(value * per_unit)
                yield f'<path d="M{at:.1f} {edge:.1f}v{tick}" stroke="#222" stroke-width="0.8"/>'
                said = f"{value + 0.0:.6g}".replace("-", _MINUS)
                yield f'<text x="{at:.1f}" y="{label_y:.1f}" text-anchor="middle">{said}</text>'

    def levels(self) -> Iterator[str]:
        """A line every 20 dB from the noise floor up, or every 10 where the plot ends less than 40 dB above it."""
        for db in np.arange(0, self.top_db + 1, 20 if self.top_db >= 40 else 10):
            yield f'<path d="M{_LEFT} {self.y(db):.1f}H{_WIDTH - _RIGHT}" stroke="#ccc" stroke-width="0.5"/>'
            yield f'<text x="{_LEFT - 6}" y="{self.y(db) + 4:.1f}" text-anchor="end">{db:.0f}</text>'


def spectrum_svg(iq: np.ndarray, recording: Recording, values: Measurements, index: int, start_s: float) -> str:
    """Draw a spectrum and what was measured in it.

    Parameters
    ----------
    iq
        One dwell, shape (pulses,).
    recording
        Where it comes from.
    values
        The recording's measurements, shape (dwells,).
    index
        Which dwell.
    start_s
        When it starts [s].
    """
    spectrum = doppler_spectrum(iq, carrier_hz=recording.carrier_hz, prf_hz=recording.prf_hz)
    level, frequency = spectrum.level_db, spectrum.frequency_hz
    per_mps = 2 / spectrum.wavelength_m
    body_hz = -float(values.body_velocity_mps[index]) * per_mps
    chopping_hz, width_hz = float(values.chopping_hz[index]), float(values.bandwidth_hz[index])
    both_hz = [float(values.main_chopping_hz[index]), float(values.tail_chopping_hz[index])]
    rates_hz = [float(rate_hz) for rate_hz in values.rotor_rates_hz[index] if np.isfinite(rate_hz)]
    if len(rates_hz) < 2 or not values.rotors_resolved[index]:
        rates_hz = [chopping_hz]
    low, high = float(frequency[0]), float(frequency[-1])
    if np.isfinite(width_hz):  # the notch at rest is shown as well
        reach_hz = _MARGIN * width_hz / 2
        low = max(low, min(body_hz - reach_hz, -2 * NOTCH_MPS * per_mps))
        high = min(high, max(body_hz + reach_hz, 2 * NOTCH_MPS * per_mps))
    shown = (frequency >= low) & (frequency <= high)
    frequency, level = frequency[shown], level[shown]
    # 20 dB high at least, also for silence
    frame = _Frame(low, high, _BOTTOM_DB, max(10 * np.ceil(float(level.max()) / 10 + 0.2), _BOTTOM_DB + 20))
    parts: list[str] = []
    if np.isfinite(width_hz):
        band = body_hz - width_hz / 2, body_hz + width_hz / 2
        parts += frame.band(*band, _LEGEND[0][0], f"band {width_hz:.0f} Hz")
    for centre_hz in {0.0, body_hz} if np.isfinite(body_hz) else {0.0}:
        notch = centre_hz - NOTCH_MPS * per_mps, centre_hz + NOTCH_MPS * per_mps
        parts += frame.band(*notch, _LEGEND[1][0], "notch")
    if np.isfinite(chopping_hz):
        half_hz = float(values.comb_order[index]) * chopping_hz
        for rate_hz in rates_hz:
            parts += frame.comb(body_hz, rate_hz, half_hz, _LEGEND[2][0], 6)
        for other_hz in both_hz:  # a helicopter's second comb is drawn over the first, as far out
            if np.isfinite(other_hz) and abs(other_hz / chopping_hz - 1) > 0.1:
                parts += frame.comb(body_hz, other_hz, half_hz, _LEGEND[3][0], 10)
    parts += frame.levels()
    at = zip(frequency, level, strict=True)
    points = " ".join(f"{frame.x(hz):.1f},{frame.y(max(db, _BOTTOM_DB)):.1f}" for hz, db in at)
    parts.append(f'<polyline points="{points}" fill="none" stroke="#1f4e79" stroke-width="0.9"/>')
    parts += frame.axes(per_mps)
    parts += _legend((np.isfinite(width_hz), True, np.isfinite(chopping_hz), bool(np.isfinite(both_hz).all())))
    wide = "no band" if np.isnan(width_hz) else f"band {width_hz:.0f} Hz"
    combs = f"comb every {chopping_hz:.2f} Hz"
    if len(rates_hz) > 1:
        combs = f"combs of {len(rates_hz)} rotors, every {rates_hz[0]:.2f} to {rates_hz[-1]:.2f} Hz"
    said = str(values.reason[index]) or f"{combs}, {wide}"
    if level.max() <= _BOTTOM_DB:  # the whole spectrum is below the plot
        why = escape(one_line(said))
        parts.append(f'<text x="{_MIDDLE_X}" y="{_MIDDLE_Y - 20}" font-size="16" text-anchor="middle">{why}</text>')
    if np.isfinite(both_hz).all():
        said += f"; main {both_hz[0]:.2f} Hz, tail {both_hz[1]:.2f} Hz, ratio {values.gear_ratio[index]:.3f}"
    return _picture(recording.name, start_s, said, parts)


def _legend(drawn: Sequence[bool]) -> Iterator[str]:
    """The legend of the colours that are drawn."""
    entries = [entry for entry, shown in zip(_LEGEND, drawn, strict=True) if shown]
    for number, (colour, words) in enumerate(entries):
        left = _WIDTH - _RIGHT - 76 * (len(entries) - number)
        yield f'<rect x="{left}" y="30" width="12" height="12" fill="{colour}" stroke="#888"/>'
        yield f'<text x="{left + 18}" y="40">{words}</text>'


def _picture(recording: str, start_s: float, said: str, parts: Sequence[str]) -> str:
    """The whole SVG: the parts under a title and a line of words."""
    # the folder would push the words off the picture, and so would the middle of a long name
    name = one_line(Path(recording).name)
    if len(name) > _LONGEST_NAME:
        name = f"{name[: _LONGEST_NAME // 2]}...{name[-_LONGEST_NAME // 2 :]}"
    title, words = escape(f"{name} at {start_s:.3f} s"), escape(one_line(said))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" '
        f'height="{_HEIGHT}" font-family="sans-serif" font-size="11" fill="#222">\n'
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="white"/>\n'
        f'<text x="{_LEFT}" y="20" font-size="13">{title}</text>\n'
        f'<text x="{_LEFT}" y="38" font-size="12">{words}</text>\n'
        + "\n".join(parts)
        + f'\n<text x="{_MIDDLE_X}" y="{_HEIGHT - 6}" text-anchor="middle">Doppler frequency [Hz]</text>\n'
        f'<text x="{_MIDDLE_X}" y="{_TOP - 24}" text-anchor="middle">radial velocity [m/s]</text>\n'
        f'<text transform="translate(14 {_MIDDLE_Y}) rotate(-90)" text-anchor="middle">level over noise [dB]</text>\n'
        "</svg>\n"
    )
