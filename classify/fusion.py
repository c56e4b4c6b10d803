"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn 9a6c357e8063, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.006.
"""

CORRELATION = 0.85
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 2.65, 5: 4.48, 12: 4.84, 31: 6.96}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 2.0), "wings": ("bird", 3.2), "heaves": ("bird", 1.7), "steps": ("clutter", 1.0)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
