"""Tangent of contacts under the energy-momentum method, against central differences of the residual."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.algebra import sparse_lu
from evolvent.equations import energy_momentum as flow
from evolvent.solvers.time.implicit.energy_momentum import plan

Array = np.ndarray
N = 6


def laid(law: str, exponent: float, friction: float, depth: float) -> System:
    """A strip bent round a turning drum, its points `depth` below the surface."""
    radius = 0.5 - depth
    angle = np.linspace(2.4, 0.7, N + 1)
    nodes = np.zeros((N + 1, 2, 3))
    nodes[:, 0, :2] = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    nodes[:, 1, :2] = np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.3), "drum")
    section = elements.Rectangle(thickness=0.01, width=0.02)
    material = elements.Material(young_modulus=1e6, poisson_ratio=0.0, density=1000.0)
    given = {"section": section, "material": material, "elements": N, "formulation": "cable"}
    system.add(parts.Beam(length=float(radius * (angle[0] - angle[-1])), nodes=nodes, **given), "strip")
    contact = {"law": law, "stiffness": 1e3, "exponent": exponent, "damping": 3.0, "initial_overlap": 0.1}
    contact |= {"friction": friction, "bristle_stiffness": 200.0, "bristle_damping": 0.5}
    system.add(parts.Contact(a="strip", b="drum", shape=parts.Cylinder(radius=0.5), **contact), "cylinder")
    return system


@pytest.mark.parametrize("law", ["hunt-crossley", "conservative"])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("friction", [0.0, 0.02, 5.0])
@pytest.mark.parametrize("depth", [3e-3, -3e-3])
def test_tangent_of_contacts(law: str, exponent: float, friction: float, depth: float) -> None:
    """Points that stay in contact and points that arrive, damped; frictionless, slipping and sticking."""
    of = plan(laid(law, exponent, friction, depth).assemble(), samples=[0.0, 1.0], step=0.02)
    model, work = of.assembly.model, of.workspace()
    step, rng = work.step, np.random.default_rng(1)
    step.step.h = 0.02
    flow.measure(0, model, step)
    inwards = np.zeros((N + 1, 2, 3))
    inwards[:, 0] = -0.01 * step.y0[: 6 * (N + 1)].reshape(N + 1, 2, 3)[:, 0]
    inwards[:, 0] += [2e-3, 1e-3, 1e-3]  # slides
    start = inwards.ravel() + 1e-4 * rng.standard_normal(inwards.size)

    def residual(dq: Array) -> Array:
        step.dq[:] = dq
        flow.residual(model, step)
        return step.r.copy()

    residual(start)
    force = model.contact_points["force"]
    assert np.count_nonzero(force > 0.0) > N
    allowed = 1e-4 if friction == 0.0 else 0.1  # with friction the turn of the tangent plane is left out
    flow.tangent(1.0, model, step, of.matrix)
    assert sparse_lu.factor(of.matrix) == 0
    for _ in range(3):
        direction, eps = rng.standard_normal(start.size), 1e-7
        x = (residual(start + eps * direction) - residual(start - eps * direction)) / eps  # twice the derivative
        sparse_lu.solve(of.matrix, x)
        assert np.abs(x - direction).max() < allowed * np.abs(direction).max()
