"""Runs by the energy-momentum method: `evolvent.solvers.time.implicit.plan` with that method."""

from __future__ import annotations

from typing import Any

from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.implicit import plan as implicit

#: Name of the method.
NAME = implicit.ENERGY_MOMENTUM


def plan(assembly: Assembly, **options: Any) -> implicit.ImplicitPlan:
    """Check and prepare a run; options as of `implicit.plan`."""
    return implicit.plan(assembly, method=NAME, **options)


def solve_energy(assembly: Assembly, **options: Any) -> Solution:
    """Integrate an assembled model; options as of `implicit.solve_implicit`."""
    return implicit.solve_implicit(assembly, method=NAME, **options)
