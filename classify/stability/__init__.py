"""How far every stage's numbers hold: errors against a more precise oracle as one parameter goes to its extreme."""

from .run import run_stability

__all__ = ["run_stability"]
