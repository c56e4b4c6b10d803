"""Draw the README's picture: python docs/classes.py writes docs/classes.png."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from bladewing.features import doppler_spectrum
from bladewing.features.change import frame_power
from bladewing.features.fast import to_db
from bladewing.simulate import Radar, draw_records

RADAR = Radar(carrier_hz=9.85e9, prf_hz=10e3, pulses=3000)
# (kind, seed): records of the "bench" streams that show what the kind is about
SHOWN = (("quadcopter", 188), ("flapping_bird", 36), ("vehicle", 17))
FRAME, FRAMES, SPAN_DB = 160, 300, 45

figure, axes = plt.subplots(2, 3, figsize=(11, 5.6), height_ratios=(1.5, 1), sharey="row", layout="constrained")
for column, (kind, seed) in enumerate(SHOWN):
    records = draw_records(RADAR, 1, seed, purpose="bench", kind=kind)
    spectrum = doppler_spectrum(records.iq[0], carrier_hz=RADAR.carrier_hz, prf_hz=RADAR.prf_hz)
    image = to_db(frame_power(records.iq[0], spectrum, FRAME, FRAMES)).T
    velocity = spectrum.velocity_mps
    top, bottom = axes[:, column]
    extent = (0, 1e3 * RADAR.dwell_s, velocity[-1], velocity[0])
    shown = top.imshow(image[::-1], aspect="auto", origin="lower", extent=extent, vmin=0, vmax=SPAN_DB, cmap="cividis")
    top.set_title(
        f"{records.labels[0]}: {kind.replace('_', ' ')}, SNR {records.truth['snr_db'][0]:.0f} dB", fontsize=11
    )
    top.set_xlabel("time [ms]")
    bottom.plot(velocity, spectrum.level_db, linewidth=0.7, color="#0072B2")
    bottom.set(xlabel="radial velocity [m/s]", ylim=(-12, 80), xlim=(velocity[-1], velocity[0]))
    bottom.grid(alpha=0.3)
figure.colorbar(shown, ax=axes[0, -1], label="dB over noise", ticks=(0, 15, 30, 45))
axes[0, 0].set_ylabel("radial velocity [m/s]")
axes[1, 0].set_ylabel("dB over noise")
figure.savefig(Path(__file__).with_name("classes.png"), dpi=110)
