"""Tangents of contacts of boxes against central differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, parts
from implicit.test_body_contact import moved, tangent_error

BOX = parts.Box(size=(0.6, 0.4, 0.2))
BAR = parts.Box(size=(0.8, 0.1, 0.1))
BALL = parts.Sphere(radius=0.1)
TURNED = (np.cos(0.3), 0.0, 0.0, np.sin(0.3))
DIAGONAL = (np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0, 0.0)
CROSSED = tuple(float(x) for x in np.outer((np.cos(0.6), np.sin(0.6)), DIAGONAL[:2]).ravel()[[0, 1, 3, 2]])
#: Shapes, where the first one is, how it stands, and how the second one does.
PAIRS: dict[str, tuple] = {
    "sphere on a face": (BALL, BOX, (0.05, 0.03, 0.195), TURNED),
    "sphere on an edge": (BALL, BOX, (0.35, 0.03, 0.172), TURNED),
    "sphere on a corner": (BALL, BOX, (0.34, 0.24, 0.157), TURNED),
    "corners on a plane": (BOX, parts.Plane(normal=(0.0, 0.0, 1.0)), (0.0, 0.0, 0.095), TURNED),
    "box on a box": (parts.Box(size=(0.2, 0.2, 0.2)), BOX, (0.05, 0.03, 0.195), TURNED),
    "edge on an edge": (BAR, BAR, (0.02, 0.03, 0.121), DIAGONAL, CROSSED),
}


def touching(pair: str, **law: Any) -> System:
    """Two free bodies that overlap by some millimetres."""
    a, b, place, turned, *other = PAIRS[pair]
    system, given = System(), {"mass": 2.0, "inertia": (0.2, 0.25, 0.3), "angular_velocity": (0.1, 0.2, -0.1)}
    system.add(parts.RigidBody(position=place, orientation=turned, **given), "p")
    system.add(parts.RigidBody(orientation=other[0] if other else (1.0, 0.0, 0.0, 0.0), **given), "q")
    law = {"stiffness": 3e3, "exponent": 1.5, "bristle_stiffness": 400.0, "initial_overlap": 0.5} | law
    if not isinstance(b, parts.Plane):
        law["rounding"] = 0.02
    system.add(parts.Contact(a="p", b="q", shape_a=a, shape=b, **law), "touch")
    return system


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize(("mu", "size"), [(0.0, 1e-3), (0.3, 1e-3), (30.0, 3e-4)])
def test_of_a_state(pair: str, mu: float, size: float) -> None:
    """Frictionless, slipping and sticking, damped, under generalized-alpha: what contacts add is exact."""
    assembly = touching(pair, friction=mu, damping=0.3, bristle_damping=2.0).assemble()
    equations = moved(assembly, size, 0.05)._replace(c_mass=0.0)
    found, exact, rows = [], [], assembly.model.body_contacts
    for stiffness in (3e3, 0.0):
        rows["stiffness"] = stiffness
        found.append(equations.tangent(np.zeros(0)))
        exact.append(equations.differences(np.zeros(0), np.ones(12), 1e-6 if mu == 0.0 else 1e-7))
        assert np.any(rows["force"] > 0.0) == (stiffness > 0.0)
    difference = exact[0] - exact[1]
    np.testing.assert_allclose(found[0] - found[1], difference, rtol=0.0, atol=3e-9 * np.abs(difference).max())


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_over_a_step(pair: str, law: str, mu: float) -> None:
    assert tangent_error(touching(pair, friction=mu, law=law), 5e-4, np.zeros(12)) < (1e-3 if mu == 0.0 else 0.02)
