"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn-wide 9284c88d8c40, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.009.
"""

CORRELATION = 0.77
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.91, 5: 4.62, 12: 5.46, 31: 8.35}
"""Weight of the mean log-probability of all looks of a length, by the dwells of 80 ms that one look spans."""

ODDS = {"comb": ("uav", 1.1), "wings": ("bird", 1.6), "heaves": ("bird", 1.3), "steps": ("clutter", 1.0)}
"""What the whole track shows: the class whose odds it multiplies, and the factor. "comb": a comb that stays; "wings": a
wingbeat; "heaves": a body that heaves as wings lift it; "steps": a body that sways as a walker's does."""
