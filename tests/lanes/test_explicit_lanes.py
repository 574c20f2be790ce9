"""Copies side by side: each has the bits that it has alone, also where events and slack springs part them."""

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.compiled.lane_types import LANE, WIDTH, lane_dtype, lane_zeros
from evolvent.solvers.time.explicit import lanes
from evolvent.solvers.time.explicit.plan import plan
from evolvent.solvers.time.explicit.run import ExplicitRun

CORNERS = ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))


def suspended(stiffness: float, *, slack: bool = False):
    """A body that hangs on four springs, off its place of rest; it jumps up where they only pull."""
    velocity, length = (0.0, 3.0 if slack else 0.0, 0.0), 1.4 if slack else 1.1
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(
        parts.RigidBody(
            mass=2.0,
            inertia=(0.1, 0.2, 0.3),
            position=(0.02, -1.0, 0.01),
            velocity=velocity,
            angular_velocity=(0.3, 0.0, 0.1),
        ),
        "body",
    )
    for k, (x, z) in enumerate(CORNERS):
        b = ("body", (0.2 * x, 0.0, 0.2 * z))
        spring = parts.Spring(a=(x, 0.0, z), b=b, stiffness=stiffness, damping=0.4, length=length, slack=slack)
        system.add(spring, f"spring {k + 1}")
    return system.assemble()


def side_by_side(assemblies, steps, **options):
    """Solutions of copies alone and side by side, and what the lanes counted."""
    alone = [plan(one, **options).run() for one in assemblies]
    together = lanes.run_together([plan(one, **options) for one in assemblies])
    for one, other in zip(alone, together, strict=True):
        assert (other.status, other.message) == (one.status, one.message)
        np.testing.assert_array_equal(other.t, one.t)
        np.testing.assert_array_equal(other.y, one.y)
        np.testing.assert_array_equal(other.s, one.s)
        np.testing.assert_array_equal(other.event_times, one.event_times)
        assert {n: other.statistics[n] for n in ("steps", "events", "step")} == {
            n: one.statistics[n] for n in ("steps", "events", "step")
        }
    found = lanes.Lanes([ExplicitRun(plan(one, **options)) for one in assemblies])
    found.advance(range(len(assemblies)), steps)
    return found.counts


OPTIONS = {"samples": np.linspace(0.0, 0.5, 6), "step": 1e-3}


@pytest.mark.slow
@pytest.mark.parametrize("count", [WIDTH, WIDTH + 3, 3])
def test_copies_have_the_bits_that_they_have_alone(count):
    counts = side_by_side([suspended(300.0 + 5.0 * k) for k in range(count)], 100, **OPTIONS)
    assert counts["side by side"] == 100 * count
    assert counts["parted"] == 0


@pytest.mark.slow
def test_copies_that_branches_part_come_back():
    counts = side_by_side([suspended(150.0 + 20.0 * k, slack=True) for k in range(WIDTH)], 450, **OPTIONS)
    assert counts["parted"] > 0
    assert counts["side by side"] > 100


@pytest.mark.slow
def test_why_copies_go_alone():
    def reason(assemblies, **options):
        return lanes.reason_alone([ExplicitRun(plan(one, **OPTIONS | options)) for one in assemblies])

    alike = [suspended(300.0 + k) for k in range(3)]
    assert reason(alike) == ""
    assert reason(alike[:2]) == "they are fewer than 3"
    assert reason(alike, method="dopri5", step=None) == "the steps of dopri5 adapt, each copy's to itself"
    runs = [ExplicitRun(plan(one, **OPTIONS)) for one in alike[:2]]
    runs.append(ExplicitRun(plan(alike[2], **OPTIONS | {"step": 5e-4})))
    assert lanes.reason_alone(runs) == "their methods or steps differ"


def test_memory_of_lanes_is_aligned():
    own = np.dtype([("index", np.int64), ("length", np.float64), ("R", np.float64, (3, 3))])
    found = lane_dtype(own)
    assert found["index"] == np.int64
    assert found["length"] == LANE
    assert found["R"].shape == (3, 3)
    assert found.fields["length"][1] % LANE.itemsize == found.fields["R"][1] % LANE.itemsize == 0
    assert found.itemsize % LANE.itemsize == 0
    assert lane_zeros((2, 3), found).ctypes.data % LANE.itemsize == 0
    assert lane_dtype(np.dtype([("a", np.int64), ("b", np.int64)])) == np.dtype([("a", np.int64), ("b", np.int64)])
