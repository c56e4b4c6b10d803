"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn-wide 64b13458a591, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.009.
"""

CORRELATION = 0.78
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.68, 5: 4.44, 12: 4.89, 31: 7.79}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 1.1), "wings": ("bird", 1.7), "heaves": ("bird", 1.4), "steps": ("clutter", 0.9)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
