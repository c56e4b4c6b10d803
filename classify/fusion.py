"""How much each piece of a track counts: fitted, and written by `python -m tests.benchmarks.fusion_fit`.

To spectrum-cnn 9ca5ab003dbb, on 3840 simulated tracks of 2.5 s and every SNR: calibration error 0.017.
"""

CORRELATION = 0.82
"""Between the evidence of two dwells of one target: n of them count as n / (1 + (n - 1) CORRELATION)."""

LOOKS = {1: 1.00, 2: 1.88, 5: 4.48, 12: 5.76, 31: 5.52}
"""Weight of the mean of the looks at so many dwells in a row, as one; of dwells of 80 ms."""

WING_ODDS, HEAVE_ODDS, STEP_ODDS = 2.8, 4.1, 2.7
"""What is multiplied in the whole track: the odds of a bird by a wingbeat, and by a body that heaves as wings lift it;
the odds of clutter by one that sways as a walker's does."""
