"""Time integration of assembled models."""

from evolvent.solvers.drive import METHODS, solve
from evolvent.solvers.solution import Solution

__all__ = ["METHODS", "Solution", "solve"]
