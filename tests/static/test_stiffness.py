"""Stiffness about an equilibrium, where forces turn with bodies or move on them, against differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from evolvent import System, parts
from evolvent.solvers.common.standing import idle_nodes
from evolvent.solvers.static.linear_motion import matrices
from evolvent.solvers.static.work import Work
from helpers import stiffness_by_differences


def geared() -> System:
    """Two wheels on a free base; a gear's forces turn with its bodies."""
    system = System()
    system.add(parts.RigidBody(mass=3.0, inertia=(0.3, 0.4, 0.5)), "base")
    for name, x in (("p", 0.5), ("q", -0.5)):
        system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.02, 0.03), position=(x, 0.0, 0.0)), name)
        system.add(parts.Joint(a="base", b=(name, (0.0, 0.0, 0.0)), type="revolute"), f"axle {name}")
    system.add(parts.Joint(a="axle p", b="axle q", type="gear", ratio=2.0), "gear")
    system.add(parts.Spring(a=("p", (0.1, 0.0, 0.0)), b=("base", (0.5, 0.3, 0.0)), stiffness=20.0, length=0.1))
    return system


def touching(friction: float = 0.0) -> System:
    """Two capsules that cross; a turn of one moves the point on its axis that is nearest to the other."""
    system, axes = System(), ((0.0, 0.0, 1.0), (1.0, 0.2, 0.1))
    for name, y in (("one", 0.0), ("two", 0.19)):
        system.add(parts.RigidBody(mass=1.0, inertia=(0.02, 0.02, 0.03), position=(0.0, y, 0.0)), name)
    a, b = (parts.Capsule(radius=0.1, length=0.5, axis=axis) for axis in axes)
    contact = {"a": "one", "b": "two", "shape_a": a, "shape": b}
    system.add(parts.Contact(**contact, stiffness=1e4, initial_overlap=0.5, friction=friction), "touch")
    return system


def lit() -> System:
    """A thread from one free body to another, in light; the weights of its wound part and of its end act on them."""
    system = System(gravity=(0.3, 0.0, -9.81))
    system.add(parts.RigidBody(mass=3.0, inertia=(0.3, 0.4, 0.5), position=(0.1, 0.0, 0.0)), "hub")
    system.add(parts.RigidBody(mass=1.0, inertia=(0.3, 0.4, 0.5), position=(1.2, 0.1, 0.0)), "end")
    still = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=still), "reel")
    thread = {"length": 2.0, "nodes": 4, "line_density": 0.5, "stiffness": 300.0, "wound_mass": "carried"}
    system.add(parts.Thread(reel="reel", end=("end", (-0.1, 0.0, 0.1)), **thread), "thread")
    light = {"pressure": 0.4, "width": 1.0, "specular": 0.6, "direction": (1.0, 0.5, 0.3)}
    system.add(parts.Radiation(along="thread", **light), "light")
    return system


def sticking() -> System:
    """The same capsules with friction, which stick to one another."""
    return touching(friction=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("build", [geared, touching, sticking, lit], ids=lambda build: build.__name__)
def test_the_stiffness_is_the_derivative_of_the_forces(build: Callable[[], System], rng: np.random.Generator) -> None:
    assembly = build().assemble()
    work = Work(assembly, assembly.y, 0.0, np.zeros(6))
    work.balance.la[:] = rng.standard_normal(work.n_j)
    K = matrices(work)[2].toarray()
    wanted = work.copies[: work.n_v, None] * stiffness_by_differences(work, 1e-4)[0]
    idle = idle_nodes(work.model)  # thread on its spool, which has no stiffness
    K[idle], wanted[idle] = 0.0, 0.0
    assert_allclose(K, wanted, atol=1e-8 * np.abs(wanted).max(), rtol=0.0)
