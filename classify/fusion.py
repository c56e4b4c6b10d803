"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn 9ca5ab003dbb, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.013.
"""

CORRELATION = 0.82
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.88, 5: 4.50, 12: 5.81, 31: 5.68}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

ODDS = {"comb": ("uav", 2.5), "wings": ("bird", 2.8), "heaves": ("bird", 4.1), "steps": ("clutter", 2.7)}
"""What the whole track shows: whose odds it multiplies, and by what. A comb that stays, a wingbeat, a body that heaves
as wings lift it, one that sways as a walker's does."""
