"""Events that fixed steps land on: each costs one step, also where it misses zero by round-off."""

from __future__ import annotations

import pytest

import evolvent
from evolvent import System, parts
from evolvent.solvers.time.explicit.plan import solve
from evolvent.solvers.time.pace import Stall

HEIGHTS = [0.02 * (k + 1) for k in range(30)]


@pytest.mark.parametrize("count", [1, 2])
def test_an_event_costs_one_step(count: int) -> None:
    """A chain of arms on joints, which are closed again after each step, falls through heights one after the other."""
    system = System(gravity=(0.0, -9.81, 0.0))
    for k in range(count):
        arm = parts.RigidBody(mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.0 + 2.0 * k, 0.0, 0.0))
        system.add(arm, f"arm {k}")
        root = (f"arm {k - 1}", (1.0, 0.0, 0.0)) if k else (0.0, 0.0, 0.0)
        system.add(parts.Joint(a=root, b=(f"arm {k}", (-1.0, 0.0, 0.0))))
    for height in HEIGHTS:
        system.add(parts.Event(law=f"-y - {height}", variables={"y": f"arm {count - 1}.position.y"}))
    for step, steps in ((0.02, 20), (0.005, 80)):
        found = solve(system.assemble(), samples=[0.0, 0.4], method="rk4", step=step)
        events = found.event_kinds.tolist()
        assert len(events) == len({*events}) >= 25
        assert found.statistics["steps"] == steps + len(events)


def test_a_latch_that_misses_its_angle_by_round_off_locks() -> None:
    """It was found again in each step, and no step was longer than the round-off of the time."""
    system = evolvent.load("solar-array")
    for stiffness in (0.2 * (0.95 + 0.1 / 15), 0.2 * (0.95 + 0.4 / 15)):
        own = system.with_values({"hinge 1.stiffness": stiffness})
        found = solve(own.assemble(), samples=[0.0, 7.4], method="rk4", step=1e-3)
        assert found.event_kinds.size == 1
        assert found.statistics["steps"] == 7401


def test_a_run_that_stands_still_says_so() -> None:
    """A pace of no time at all has no number of steps left."""
    still, slow = Stall(7.37, 9000, 0.0, 0.63, 1e300), Stall(7.37, 9000, 1e-9, 0.63, 1e9)
    assert str(still) == "the run stands still at t = 7.37 s: its last 9000 steps have no length"
    assert "would need 1.0e+09 steps" in str(slow)
