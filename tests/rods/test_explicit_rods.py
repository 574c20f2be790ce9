"""Explicit methods for rods: products with diagonal stiffness matrices, and projections of constrained bodies alone."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.assembly import needs
from evolvent.equations.projection import project
from evolvent.equations.rhs import rhs
from evolvent.kernels.impulse import prepare
from rods.building import RUBBER, STRIP

Array = np.ndarray


def jointed() -> System:
    """A rod with spherical joints at its root and to a body at its tip; a third joint holds the body."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Rod(length=1.0, section=STRIP, material=RUBBER, elements=4), "rod")
    system.add(parts.RigidBody(mass=0.3, inertia=(1e-3, 2e-3, 3e-3), position=(1.1, 0.0, 0.0)), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"), "root")
    system.add(parts.Joint(a="rod.tip", b=("body", (-0.1, 0.0, 0.0))), "tip")
    system.add(parts.Joint(a=(1.2, 0.0, 0.0), b=("body", (0.1, 0.0, 0.0))), "end")
    return system


def disturbed(y: Array, bodies: Array, which: list[int], size: float) -> Array:
    """A state with random changes of the positions, attitudes and velocities of some bodies."""
    rng, found = np.random.default_rng(3), y.copy()
    for b in which:
        q, v = int(bodies["iq"][b]), int(bodies["iv"][b])
        found[q : q + 7] += size * rng.normal(size=7)
        found[v : v + 6] += size * rng.normal(size=6)
    return found


def test_a_diagonal_stiffness_gives_the_same_rates_as_a_full_one() -> None:
    assembly = jointed().assemble()
    model, rates = assembly.model, []
    assert np.all(model.rod_elements["uncoupled"] == 1)
    y = disturbed(assembly.y, model.bodies, [*range(1, 6)], 1e-3)
    needs.load(model, rhs)
    for diagonal in (1, 0):
        model.rod_elements["uncoupled"] = diagonal
        rates.append(np.empty_like(y))
        rhs(0.0, y, assembly.s, model, rates[-1])
    assert np.all(np.isfinite(rates[0]))
    assert rates[0].tobytes() == rates[1].tobytes()


def test_a_projection_moves_only_bodies_with_constraints() -> None:
    """Gaps and rates of the constraints vanish; the body has two joints."""
    assembly = jointed().assemble()
    model, s = assembly.model, assembly.s
    nodes, body = [*range(model.bodies.size - 6, model.bodies.size - 1)], model.bodies.size - 1
    held = [nodes[0], nodes[-1], body]
    y = disturbed(assembly.y, model.bodies, held, 1e-3)
    found = y.copy()
    needs.load(model, project, prepare)
    assert project(0.0, found, s, model) == 1
    for b in nodes[1:-1]:
        for key, count in (("iq", 7), ("iv", 6)):
            at = int(model.bodies[key][b])
            assert found[at : at + count].tobytes() == y[at : at + count].tobytes()
    for state, gap, rate in ((y, 1e-4, 1e-4), (found, 0.0, 0.0)):
        prepare(0.0, state, s, model)
        gaps, rates = (np.abs(model.constraints[name]).max() for name in ("gap", "rate"))
        assert gaps > gap if gap else gaps < 1e-9
        assert rates > rate if rate else rates == pytest.approx(0.0, abs=1e-12)
