"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn-wide 05c197f8a2c5, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.010.
"""

CORRELATION = 0.83
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.55, 5: 6.02, 12: 6.25, 31: 8.92}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 1.3), "wings": ("bird", 2.9), "heaves": ("bird", 1.2), "steps": ("clutter", 1.4)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
