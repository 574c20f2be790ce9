"""Captures that a fixed step does not resolve are reported: latches, and nodes that come back to a spool."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.analysis.closure import unresolved_captures
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.implicit.plan import solve_implicit

J, STIFFNESS = 0.5, 400.0
METHODS = ("energy-momentum", "generalized-alpha")


def panel(damping: float) -> System:
    """A panel on a spring that reaches a stiff latch."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=J), "panel")
    system.add(
        parts.JointSpring(
            a="ground", b="panel", stiffness=0.5, rest=1.0, latch=1.0, latch_stiffness=STIFFNESS, latch_damping=damping
        ),
        "hinge",
    )
    return system


def ran(system: System, method: str, **options: float) -> Solution:
    """A run over 3 s."""
    found = solve_implicit(system.assemble(), samples=np.linspace(0.0, 3.0, 31), method=method, **options)
    assert found.success, found.message
    return found


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_the_time_of_a_capture_follows_from_its_first_step(method: str, damping: float) -> None:
    """A quarter of the period, or the time in which the damper takes the rate; at any step of energy-momentum.

    Generalized-alpha gains energy from the damped latch at long steps, and its run fails.
    """
    exact = 1.0 / (2.0 / math.pi * math.sqrt(STIFFNESS / J) + damping / J)
    for step in (0.1, 0.01, 0.001) if method == METHODS[0] or damping == 0.0 else (0.001,):
        (one,) = ran(panel(damping), method, step=step).captures
        assert one.duration == pytest.approx(exact, rel=0.12)


@pytest.mark.parametrize("method", METHODS)
def test_a_capture_within_a_step_is_reported(method: str) -> None:
    text = unresolved_captures(ran(panel(0.0), method, step=0.1))
    assert "'hinge' captures at t = 1.57" in text
    assert "less than the step of 0.1 s" in text
    assert "use a `step` of at most 0.0" in text
    assert unresolved_captures(ran(panel(0.0), method, step=0.005)) == ""
    assert unresolved_captures(ran(panel(0.0), method, tolerance=1e-4)) == ""


@pytest.mark.parametrize("method", METHODS)
def test_the_warning_is_that_of_the_result(method: str) -> None:
    run = panel(0.0).simulate(until=3.0, every=0.1, method=method, step=0.1)
    assert "'hinge' captures" in run.attrs["warning"]
    kept = panel(0.0).simulate(until=3.0, every=0.1, method=method, step=0.1, keep=["steps"])
    assert kept.attrs["warning"] == run.attrs["warning"]


@pytest.mark.parametrize("segments", ["springs", "inextensible"])
def test_a_node_that_comes_back_within_a_step_is_reported(segments: str) -> None:
    """The last link, a thousandth of a segment, swings at sqrt(T/(m b))."""
    system, W = System(), 3.0
    system.add(parts.RigidBody(motion="driven", rate=W, axis=(0.0, 0.0, 1.0)), "hub")
    system.add(parts.Reel(body="hub", centre=(0.3, 0.0, 0.0), radius=0.1,
                          drive=parts.ConstantDrive(rate=-0.5, angle=2.6)), "reel")  # fmt: skip
    stiffness = {"stiffness": 1e4, "damping": 10.0} if segments == "springs" else {}
    system.add(parts.Thread(reel="reel", segments=segments, length=0.5, line_density=0.1, tip_mass=0.2, nodes=2,
                            **stiffness), "thread")  # fmt: skip
    text = unresolved_captures(ran(system, METHODS[0], step=0.01))
    assert "'thread' takes up a node at t = 0.195 s in about 0.00" in text
    assert unresolved_captures(ran(system, METHODS[0], step=5e-4)) == ""


@pytest.mark.parametrize("method", METHODS)
def test_two_latches_at_almost_the_same_time(method: str) -> None:
    """The first step after a latch ends on the other one."""
    system = panel(20.0)
    system.add(parts.RigidBody(motion="spin", inertia=J * (1.0 + 1e-3)), "other")
    hinge = system.parts["hinge"]
    system.add(hinge.model_copy(update={"b": "other"}), "other hinge")
    one, two = ran(system, method, step=0.001).captures
    assert 0.0 < two.time - one.time < 0.001
    assert two.duration == pytest.approx(one.duration, rel=0.1)
