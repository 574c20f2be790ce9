"""Time integration of assembled models."""

from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.explicit.plan import METHODS, solve

__all__ = ["METHODS", "Solution", "solve"]
