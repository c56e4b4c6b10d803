"""Beginnings of the reasons why a dwell could not have shown a rotor, or a rotor that it shows is not measured."""

from .dropouts import BEYOND_FILLING_IN

LOW_PRF = "PRF too low"
SHORT_DWELL = "dwell too short"
NO_SIGNAL = "no signal"
NO_DIGITS = "no digits left"
TOLD_NO_FURTHER = "no comb: lines are told apart"

#: All of them.
BLIND = (LOW_PRF, SHORT_DWELL, NO_SIGNAL, NO_DIGITS, TOLD_NO_FURTHER, BEYOND_FILLING_IN)
