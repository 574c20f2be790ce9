"""Time integration of assembled models."""

from evolvent.solvers.explicit_plan import METHODS, solve
from evolvent.solvers.solution import Solution

__all__ = ["METHODS", "Solution", "solve"]
