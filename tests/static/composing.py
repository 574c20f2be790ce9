"""Beams under joints and loads, shared by the tests of statics and modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import System, parts
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle
from evolvent.families.beams.beam_strains import evaluate_beams
from evolvent.solvers import Solution

Array = np.ndarray
STEEL = Material(young_modulus=2e11, poisson_ratio=0.3, density=7800.0)
STRIP = Rectangle(thickness=1e-3, width=2e-2)
EI = STEEL.E * STRIP.properties(0.3).Iz


def beam(
    formulation: str,
    count: int,
    ends: tuple[str, ...] = ("clamp",),
    *,
    section: Any = STRIP,
    material: Material = STEEL,
    length: float = 1.0,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    more: Callable[[System], None] = lambda system: None,
    **fields: Any,
) -> Assembly:
    """A beam called "beam" along x, its root and tip joined to the ground by joints of the given kinds."""
    system = System(gravity=gravity)
    system.add(
        parts.Beam(
            length=length, section=section, material=material, elements=count, formulation=formulation, **fields
        ),
        "beam",
    )
    places = np.asarray(system._parts["beam"].start_nodes())[[0, -1], 0]
    for kind, end, place in zip(ends, ("root", "tip"), places, strict=False):
        system.add(parts.Joint(a=tuple(place), b=f"beam.{end}", type=kind), end)
    more(system)
    return system.assemble()


def nodes(assembly: Assembly, state: Array | Solution, name: str = "beam") -> Array:
    """(nodes, vectors, 3) coordinates of a beam."""
    y = state.y[-1] if isinstance(state, Solution) else state
    row = assembly.model.beams[assembly.index(name, "beams")]
    vectors = (2, 4)[row["kind"]]
    return y[row["iq"] : row["iq"] + 3 * vectors * row["nodes"]].reshape(-1, vectors, 3)


def sections(assembly: Assembly, state: Array | Solution) -> Any:
    """Records of all elements of beams, evaluated in a state."""
    model, y = assembly.model.copy(), state.y[-1] if isinstance(state, Solution) else state
    needs.load(model, evaluate_beams)
    evaluate_beams(np.ascontiguousarray(y), model)
    return model.elements


def tip_force(*force: float) -> Callable[[System], None]:
    def add(system: System) -> None:
        system.add(parts.Load(at="beam.tip", force=force), "load")

    return add


def solved(solution: Solution) -> Solution:
    assert solution.success, solution.message
    return solution
