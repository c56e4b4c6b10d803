"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn 3f57b783be58, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.012.
"""

CORRELATION = 0.82
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.28, 5: 6.01, 12: 6.50, 31: 8.79}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 1.9), "wings": ("bird", 2.4), "heaves": ("bird", 2.0), "steps": ("clutter", 1.6)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
