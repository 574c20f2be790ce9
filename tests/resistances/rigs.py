"""A wheel on a joint with a resistance, and what can be read off its runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import System, parts
from evolvent.parts.base import Part
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

Array = np.ndarray
INERTIA = 0.4
#: Ways to integrate.
METHODS: dict[str, tuple[Any, dict[str, Any]]] = {
    "rk4": (solve, {"method": "rk4", "step": 1e-3}),
    "alpha": (solve_implicit, {"tolerance": 1e-7, "spectral_radius": 0.9}),
    "energy": (solve_energy, {"tolerance": 1e-7, "spectral_radius": 1.0}),
}
IMPLICIT = ("alpha", "energy")


def run(system: System, times: Any, method: str, **options: Any) -> Solution:
    """A run that succeeds; a `step` takes the place of the tolerance."""
    function, own = METHODS[method]
    given = own | options
    if "step" in options:
        given.pop("tolerance", None)
    found: Solution = function(system.assemble(), samples=times, **given)
    assert found.success, found.message
    return found


def seen(solution: Solution, name: str) -> dict[str, Array]:
    """Named results of a part."""
    return {key: variable.values for key, variable in observe(solution)[name].variables.items()}


def wheel(part: Part | None, *, rate: float = 0.0, **spring: Any) -> System:
    """A body that spins about an axis on the ground, with a spring and another part, "it", on its coordinate."""
    system, axis = System(), (0.6, 0.0, 0.8)
    system.add(parts.RigidBody(motion="spin", inertia=INERTIA, axis=axis, rate=rate), "wheel")
    system.add(parts.JointSpring(a="ground", b="wheel", axis=axis, **spring), "hinge")
    if part is not None:
        system.add(part, "it")
    return system


def turned(part: Part, amplitude: float, **spring: Any) -> System:
    """A wheel that a drive turns by amplitude sin(2 pi t), with a spring and another part, "it", on its coordinate."""
    found = wheel(part, rate=2.0 * np.pi * amplitude, **spring)
    drive = parts.ExpressionDrive(expression=f"{amplitude!r}*sin(2*pi*t)")
    found.add(parts.Joint(a="ground", b="wheel", type="revolute", drive=drive), "drive")
    return found
