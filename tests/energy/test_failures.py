"""Runs by the energy-momentum method that fail say where, when and what to try, and keep what was computed."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from evolvent import RunFailed, System, elements, law, parts
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time import pace
from evolvent.solvers.time.implicit import energy_momentum
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.newton import correction
from evolvent.solvers.time.implicit.run import ImplicitRun

METHOD = "energy-momentum"


@law
def jumping(extension, rate, t, p):  # type: ignore[no-untyped-def]
    """A dry friction that has no value at rest, where steps become ever smaller."""
    return 10.0 if rate > 0.0 else -10.0


@law
def broken(extension, rate, t, p):  # type: ignore[no-untyped-def]
    return math.nan if t > 0.052 else 10.0 * extension


def ball(law) -> System:  # type: ignore[no-untyped-def]
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.1, 0.0, 0.0), velocity=(2.0, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law), "rope")
    return system


def no_solution(system: System, step: float | None) -> Solution:
    """A run whose Newton's method cannot converge: corrections do not fall below round-off."""
    found = solve_energy(system.assemble(), samples=np.linspace(0.0, 1.0, 11), step=step, newton=1e-40)
    assert found.status == "failed"
    assert found.t.size >= 1
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("step", "wanted"), [(0.01, "use a smaller `step`, or None"), (None, "smaller `tolerance`")])
def test_a_step_without_a_solution(step: float | None, wanted: str) -> None:
    message = no_solution(ball(jumping), step).message
    assert re.search(r"found no solution in the step of \S+ s from t = \S+ s", message)
    assert re.search(r"the largest correction, \S+ of the size of the system, is at 'ball'", message)
    assert "a law of the user's jumps ('rope')" in message
    assert wanted in message
    assert "a greater `newton`" in message


def test_a_force_that_is_not_finite() -> None:
    with pytest.raises(RunFailed, match=r"stopped being finite in the step of .* s, at 'ball'; .*`step`") as caught:
        ball(broken).simulate(until=1.0, every=0.01, method=METHOD, step=0.01)
    reached = caught.value.run.time.values
    assert reached[:6] == pytest.approx(np.arange(6) / 100.0)
    assert reached[6:] == pytest.approx([0.052])  # a tenth of an interval, before the law is NaN


def pressed() -> System:
    """A strip on a cylinder, pressed in its middle."""
    system = System()
    strip = {"section": elements.Rectangle(thickness=0.01, width=0.02), "elements": 4, "formulation": "cable"}
    material = elements.Material(young_modulus=1e8, poisson_ratio=0.0, density=1000.0)
    system.add(parts.Beam(length=0.4, position=(-0.2, 0.4999, 0.0), material=material, **strip), "strip")
    system.add(parts.Contact(a="strip", b="ground", shape=parts.Cylinder(radius=0.5), points=1), "drum")
    system.add(parts.Load(at="strip[2]", force=(0.0, -5.0, 0.0)), "load")
    return system


@pytest.mark.slow
def test_contact_and_node_are_named() -> None:
    message = no_solution(pressed(), 1e-3).message
    assert re.search(r"is at 'strip', node \d of 4, with contact at 'drum'; ", message)
    assert "or a softer contact (`stiffness` of 'drum')" in message


def test_a_run_of_ever_smaller_steps_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fixed steps that are divided again and again, too, and the part is named."""
    monkeypatch.setattr(pace, "LOOK", 0.0)
    monkeypatch.setattr(pace, "MOST_STEPS", 1e5)
    with pytest.raises(RunFailed, match=r"the steps have become so small.* corrects most at 'ball'.*'rope'.*`step`"):
        ball(jumping).simulate(until=1.0, every=0.01, method=METHOD, step=0.01)


def test_redundant_joints_run_and_are_named() -> None:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "body")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("body", (0.0, 0.0, 0.0)), type="clamp"), "first")
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b=("body", (1.0, 0.0, 0.0))), "second")
    result = system.simulate(until=1.0, method=METHOD, step=1e-2)
    assert "6 of 9 constraints are independent, those of 'first', 'second' are redundant" in result.message


def test_a_correction_that_is_no_number_is_not_small() -> None:
    """Of factors that are not finite: the largest of sizes leaves out what is no number."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.1, 0.0, 0.0)), "bob")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", stiffness=100.0, length=1.0), "spring")
    run = ImplicitRun(energy_momentum.plan(system.assemble(), samples=[0.0, 1.0], step=0.01))
    assert run.begin() == ""
    run.advance(2)
    run.work.r[:] = 1.0
    assert math.isfinite(correction(1.0, run.model, run.matrix, run.work))
    run.matrix.values[:] = np.nan
    assert not math.isfinite(correction(1.0, run.model, run.matrix, run.work))
