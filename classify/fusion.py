"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn b71945a9e8d4, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.010.
"""

CORRELATION = 0.83
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.86, 5: 6.05, 12: 5.17, 31: 2.05}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

WING_ODDS, HEAVE_ODDS, STEP_ODDS = 3.5, 3.6, 2.5
"""What is multiplied in the whole track: the odds of a bird by a wingbeat, and by a body that heaves as wings lift it;
the odds of clutter by one that sways as a walker's does."""
