"""Figures of one record a class: spectrum and STFT picture beside each other, on one velocity axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import rcParams

from .svg import SERIES, Panel, drawing, panel
from .words import number, spoken


def examples(report: Mapping[str, Any]) -> list[Panel]:
    """One panel a class: the STFT picture left, the spectrum right."""
    panels = []
    for one in report["examples"]:
        with drawing(height_in=3.0) as (figure, unused):
            unused.remove()
            rcParams["axes.grid"] = False
            left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.25, 1.0))
            picture, spectrum = one["picture"], one["spectrum"]
            first_ms, last_ms = (1e3 * edge for edge in picture["time_s"])
            left.imshow(
                np.asarray(picture["level_db"], float),
                origin="lower",
                aspect="auto",
                cmap="cividis",
                vmin=0.0,
                extent=(first_ms, last_ms, *picture["velocity_mps"]),
                interpolation="nearest",
            )
            left.set_xlabel("time [ms]")
            left.set_ylabel("radial velocity [m/s]")
            right.plot(spectrum["level_db"], spectrum["velocity_mps"], color=SERIES[2], linewidth=0.7)
            right.set_xlabel("dB over noise")
            right.set_ylim(*picture["velocity_mps"])
            right.grid(visible=True)
            snr = "no micro-motion" if one["snr_db"] is None else f"SNR {one['snr_db']:.0f} dB"
            title = f"{one['class']}: {spoken(one['kind'])}, {snr}"
            top = max(spectrum["level_db"])
            at = spectrum["velocity_mps"][spectrum["level_db"].index(top)]
            alt = (
                f"STFT picture and spectrum of a {title}, dwell {number(1e3 * one['dwell_s'])} ms; the strongest line "
                f"stands {number(top)} dB over the noise at {number(at)} m/s."
            )
            panels.append(panel(figure, name=f"example-{one['class']}", title=title, alt=alt))
    return panels
