"""Numerical stability of every stage: errors against a more precise reference as one parameter goes to its extremes."""

from .run import run_stability

__all__ = ["run_stability"]
