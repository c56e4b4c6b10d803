"""Figures of one record per class: STFT picture and spectrum side by side, on one velocity axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes

from .svg import MUTED, NARROW_IN, SERIES, Panel, drawing, panel
from .words import number, percent, size, spoken

# Level at which the colours end [dB over the median]: on a scale up to the body's level the micro-motion would vanish.
CLIPPED_DB = 45.0
# Style of the comb's teeth, short strokes at the right edge.
_TEETH: dict[str, Any] = {"color": SERIES[3], "linestyle": "none", "marker": 0, "markersize": 6, "markeredgewidth": 0.8}


def examples(report: Mapping[str, Any]) -> list[Panel]:
    """Draw one panel per class: the STFT picture left, the spectrum right."""
    panels = []
    for one in report["examples"]:
        with drawing(height_in=3.0) as (figure, unused):
            unused.remove()
            rcParams["axes.grid"] = False
            left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.25, 1.0))
            picture, spectrum = one["picture"], one["spectrum"]
            _show(left, picture)
            right.plot(spectrum["level_db"], spectrum["velocity_mps"], color=SERIES[2], linewidth=0.7)
            found = one["measured"]
            for low, high in found["notches_mps"]:
                right.axhspan(low, high, color=MUTED, alpha=0.22, linewidth=0)
            for edge in found["band_mps"] or ():
                right.axhline(edge, color=SERIES[4], linewidth=0.9, linestyle=(0, (4, 2)))
            if found["chopping_mps"] and found["body_mps"] is not None:
                # a tooth at every order of the comb, to both sides of the body
                teeth = [
                    found["body_mps"] + order * found["chopping_mps"]
                    for order in range(-found["orders"], found["orders"] + 1)
                ]
                right.plot([1.0] * len(teeth), teeth, transform=right.get_yaxis_transform(), **_TEETH)
            right.set_xlabel("dB over noise")
            right.set_ylim(*picture["velocity_mps"])
            right.grid(visible=True)
            snr = "no micro-motion" if one["snr_db"] is None else f"SNR {one['snr_db']:.0f} dB"
            title = f"{one['class']}: {spoken(one['kind'])}, {snr}"
            top = max(spectrum["level_db"])
            at = spectrum["velocity_mps"][spectrum["level_db"].index(top)]
            seen = found["reason"]
            if found["chopping_hz"] is not None:
                band = "no band" if found["band_hz"] is None else f"band {number(found['band_hz'])} Hz"
                seen = f"a comb every {number(found['chopping_hz'])} Hz, {band}"
            alt = (
                f"STFT picture and spectrum of a {title}, dwell {number(1e3 * one['dwell_s'])} ms; the strongest line "
                f"stands {number(top)} dB over the noise at {number(at)} m/s. Measured: {seen}."
            )
            panels.append(panel(figure, name=f"example-{one['class']}", title=title, alt=alt))
    return panels


def stft_pictures(report: Mapping[str, Any]) -> list[Panel]:
    """Draw the paper's four STFTs of one record."""
    panels = []
    for one in report["stft_pictures"]["pictures"]:
        with drawing(height_in=2.6, width_in=NARROW_IN) as (figure, axes):
            rcParams["axes.grid"] = False
            axes.grid(visible=False)
            _show(axes, one)
            title = f"Window {one['window']}, overlap {percent(one['overlap'])}".replace(".0", "")
            alt = f"STFT of the paper's quadcopter, {title.lower()}: {one['frames']} frames, {size(one['bytes'])}."
            panels.append(panel(figure, name=f"stft-{one['window']}-{100 * one['overlap']:.0f}", title=title, alt=alt))
    return panels


def _show(axes: Axes, picture: Mapping[str, Any]) -> None:
    """Draw an STFT picture with its axes."""
    axes.imshow(
        np.asarray(picture["level_db"], float),
        origin="lower",
        aspect="auto",
        cmap="cividis",
        vmin=0.0,
        vmax=CLIPPED_DB,
        extent=(1e3 * picture["time_s"][0], 1e3 * picture["time_s"][1], *picture["velocity_mps"]),
        interpolation="nearest",
    )
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("radial velocity [m/s]")
