"""Time integration of assembled models."""

from evolvent.solvers.drive import METHODS, Solution, solve

__all__ = ["METHODS", "Solution", "solve"]
