"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn d6103684ab5d, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.012.
"""

CORRELATION = 0.82
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.99, 5: 3.67, 12: 3.41, 31: 6.37}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 3.1), "wings": ("bird", 2.4), "heaves": ("bird", 1.9), "steps": ("clutter", 1.2)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
