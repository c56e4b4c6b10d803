"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn 6662b2c9d04f, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.014.
"""

CORRELATION = 0.79
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.83, 5: 5.27, 12: 4.15, 31: 5.20}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 1.7), "wings": ("bird", 3.0), "heaves": ("bird", 4.3), "steps": ("clutter", 1.8)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
