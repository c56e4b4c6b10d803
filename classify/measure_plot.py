"""One dwell's spectrum as SVG, with the comb, the band and the notch drawn on it."""

from pathlib import Path

import numpy as np
from bladewing.features.measurements import Measurements
from bladewing.features.notch import NOTCH_MPS
from bladewing.features.spectrum import doppler_spectrum

from .errors import one_line
from .recording import Recording

#: Colours of what is drawn behind the spectrum.
_LEGEND = (("#dbe9f6", "band"), ("#f3d9b1", "notch"), ("#c0392b", "comb"), ("#1e8449", "2nd comb"))

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 960, 470, 56, 44, 80

#: Letters of a name that fit above the picture.
_LONGEST_NAME = 100

#: Width of what is shown over that of the band; all where no band is measured.
_MARGIN = 1.6


def _round_step(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not below a value."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least))


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
    from xml.sax.saxutils import escape

    spectrum = doppler_spectrum(iq, carrier_hz=recording.carrier_hz, prf_hz=recording.prf_hz)
    level = spectrum.level_db
    frequency = spectrum.frequency_hz
    per_mps = 2 / spectrum.wavelength_m
    body_hz = -float(values.body_velocity_mps[index]) * per_mps
    chopping_hz, width_hz = float(values.chopping_hz[index]), float(values.bandwidth_hz[index])
    low, high = float(frequency[0]), float(frequency[-1])
    if np.isfinite(width_hz):  # and what is at rest
        reach_hz = _MARGIN * width_hz / 2
        low = max(low, min(body_hz - reach_hz, -2 * NOTCH_MPS * per_mps))
        high = min(high, max(body_hz + reach_hz, 2 * NOTCH_MPS * per_mps))
    shown = (frequency >= low) & (frequency <= high)
    frequency, level = frequency[shown], level[shown]
    bottom_db = -10.0
    top_db = max(10 * np.ceil(float(level.max()) / 10 + 0.2), bottom_db + 20)  # of silence too

    def x(hz: float) -> float:
        return _LEFT + (hz - low) / (high - low) * (_WIDTH - _LEFT - 12)

    def y(db: float) -> float:
        return _TOP + (top_db - db) / (top_db - bottom_db) * (_HEIGHT - _TOP - _BOTTOM)

    base = y(bottom_db)
    parts: list[str] = []

    def band(first_hz: float, last_hz: float, colour: str, title: str) -> None:
        a, b = x(max(first_hz, low)), x(min(last_hz, high))
        if b > a:
            parts.append(
                f'<rect x="{a:.1f}" y="{_TOP}" width="{b - a:.1f}" height="{base - _TOP:.1f}" fill="{colour}">'
                f"<title>{title}</title></rect>"
            )

    if np.isfinite(width_hz):
        band(body_hz - width_hz / 2, body_hz + width_hz / 2, _LEGEND[0][0], f"band {width_hz:.0f} Hz")
    for centre_hz in {0.0, body_hz} if np.isfinite(body_hz) else {0.0}:
        band(centre_hz - NOTCH_MPS * per_mps, centre_hz + NOTCH_MPS * per_mps, _LEGEND[1][0], "notch")

    def comb(spacing_hz: float, half_hz: float, colour: str, length: int) -> None:
        reach = int(half_hz / spacing_hz + 1e-6)
        for order in range(-reach, reach + 1):
            hz = body_hz + order * spacing_hz
            if low <= hz <= high:
                parts.append(
                    f'<path d="M{x(hz):.1f} {base:.1f}v{length}" stroke="{colour}" stroke-width="1.2"/>'
                    f'<path d="M{x(hz):.1f} {_TOP}V{base:.1f}" stroke="{colour}" stroke-width="0.5" opacity="0.35"/>'
                )

    # a helicopter's second comb is drawn over the first, as far out
    both_hz = [float(values.main_chopping_hz[index]), float(values.tail_chopping_hz[index])]
    if np.isfinite(chopping_hz):
        half_hz = float(values.comb_order[index]) * chopping_hz
        comb(chopping_hz, half_hz, _LEGEND[2][0], 6)
        for other_hz in both_hz:
            if np.isfinite(other_hz) and abs(other_hz / chopping_hz - 1) > 0.1:
                comb(other_hz, half_hz, _LEGEND[3][0], 10)
    for db in np.arange(0, top_db + 1, 20):
        parts.append(f'<path d="M{_LEFT} {y(db):.1f}H{_WIDTH - 12}" stroke="#ccc" stroke-width="0.5"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{y(db) + 4:.1f}" text-anchor="end">{db:.0f}</text>')
    points = " ".join(f"{x(f):.1f},{y(max(db, bottom_db)):.1f}" for f, db in zip(frequency, level, strict=True))
    parts.append(f'<polyline points="{points}" fill="none" stroke="#1f4e79" stroke-width="0.9"/>')
    # Doppler below, and above the velocity, which falls where it rises
    for per_unit, edge, tick, label_y in ((1.0, base, 4, base + 20), (-per_mps, _TOP, -4, _TOP - 8)):
        first, last = sorted((low / per_unit, high / per_unit))
        step = _round_step((last - first) / 10)
        for value in np.arange(np.ceil(first / step), np.floor(last / step) + 1) * step:
            at = x(value * per_unit)
            parts.append(f'<path d="M{at:.1f} {edge:.1f}v{tick}" stroke="#222" stroke-width="0.8"/>')
            parts.append(f'<text x="{at:.1f}" y="{label_y:.1f}" text-anchor="middle">{value + 0.0:.6g}</text>')
    drawn = (np.isfinite(width_hz), True, np.isfinite(chopping_hz), np.isfinite(both_hz).all())
    legend = [entry for entry, shown in zip(_LEGEND, drawn, strict=True) if shown]
    for number, (colour, words) in enumerate(legend):
        left = _WIDTH - 12 - 76 * (len(legend) - number)
        parts.append(f'<rect x="{left}" y="30" width="12" height="12" fill="{colour}" stroke="#888"/>')
        parts.append(f'<text x="{left + 18}" y="40">{words}</text>')
    wide = "no band" if np.isnan(width_hz) else f"band {width_hz:.0f} Hz"
    said = str(values.reason[index]) or f"comb every {chopping_hz:.2f} Hz, {wide}"
    if np.isfinite(both_hz).all():
        said += f"; main {both_hz[0]:.2f} Hz, tail {both_hz[1]:.2f} Hz, ratio {values.gear_ratio[index]:.3f}"
    # the folder would push the words off the picture, and so would the middle of a long name
    name = one_line(Path(recording.name).name)
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
        + f'\n<text x="{_WIDTH / 2}" y="{_HEIGHT - 6}" text-anchor="middle">Doppler frequency [Hz]</text>\n'
        f'<text x="{_WIDTH / 2}" y="{_TOP - 24}" text-anchor="middle">radial velocity [m/s]</text>\n'
        f'<text transform="translate(14 {_HEIGHT / 2}) rotate(-90)" text-anchor="middle">level over noise [dB]</text>\n'
        "</svg>\n"
    )
