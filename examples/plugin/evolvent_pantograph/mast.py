r"""Pantograph: a mast of scissor cells, opened by torsional springs at the pins in the middle of the bars.

A cell is two bars of length L, pinned in their middle; the ends of neighbouring cells are pinned to one another. The
mast lies along x and floats in space. With the angle theta between each bar and y, all n cells have the pitch
L sin(theta), and the mast has one degree of freedom:

    kinetic energy  (m L^2 cos^2(theta) n (n^2 - 1)/12 + n I) theta'^2
    elastic energy  n k (2 theta - rest)^2 / 2, until the springs lock

with the mass m of a bar and its moment of inertia I about its middle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from evolvent import InputError, System, parts
from evolvent.analysis.definition import SystemDefinition
from evolvent.results.observe import View
from evolvent.systems.structure import Simulate
from evolvent_base import units
from evolvent_base.schema import Section


class Bar(Section):
    """One of the bars, which are all alike."""

    length: units.Length = Field(0.5, description="between the pins at its ends")
    width: units.Length = Field(0.01, description="of its square section")
    mass: units.Mass = Field(0.1, description="of the bar")


class Spring(Section):
    """The torsional spring in the middle of every cell."""

    stiffness: units.RotationalStiffnessOrZero = Field(0.2, description="of the spring")
    damping: units.RotationalDampingOrZero = Field(0.0, description="of the damper beside it")
    rest: units.Angle = Field(math.pi, description="angle between the bars at which it has no torque")
    latch: units.Angle | None = Field(math.radians(150.0), description="angle between the bars at which it locks")
    latch_stiffness: units.RotationalStiffnessOrZero = Field(100.0, description="of the lock")
    latch_damping: units.RotationalDampingOrZero = Field(0.2, description="of the lock")

    def of_joint(self) -> dict[str, Any]:
        """Keys of a `JointSpring`, which takes those of a latch only where it has one."""
        keys = self.model_dump()
        return keys if self.latch is not None else {key: keys[key] for key in ("stiffness", "damping", "rest")}


class PantographCase(Section):
    """A case of the system `pantograph`."""

    system: Literal["pantograph"] = "pantograph"
    cells: Annotated[int, units.Whole(least=1, most=100)] = Field(4, description="number of cells")
    half_angle: units.Angle = Field(
        math.radians(10.0), description="between each bar and the folded mast, at the start"
    )
    bar: Bar = Bar()
    spring: Spring = Spring()
    simulate: Simulate = Simulate(until=0.3)


class Pantograph(SystemDefinition):
    """A mast of scissor cells that springs open."""

    Case = PantographCase
    cases = {  # noqa: RUF012  (a mapping that nobody changes)
        "pantograph": "# A mast of four scissor cells springs open\n"
        "system: pantograph\ncells: 4\nhalf_angle: 10 deg\nsimulate: {until: 0.3 s, every: 1 ms, tolerance: 1e-7}\n"
    }

    def build(self, case: PantographCase, *, laws: Mapping[str, Any] | None = None) -> System:
        """The bars, pins and springs."""
        if laws:
            raise InputError("laws are given, but a pantograph uses no law of the user's")
        if not 0.0 < case.half_angle < 0.5 * math.pi:
            raise InputError(f"half_angle is {case.half_angle:g} rad; it must be between 0 and pi/2 rad")
        system, half = System(), 0.5 * case.bar.length
        for k in range(case.cells):
            middle = (k - 0.5 * (case.cells - 1)) * case.bar.length * math.sin(case.half_angle)
            for name, sign in (("a", -1.0), ("b", 1.0)):
                turn = 0.5 * (0.5 * math.pi + sign * case.half_angle)
                bar = parts.RigidBody(
                    mass=case.bar.mass,
                    shape=parts.Box(size=(case.bar.length, case.bar.width, case.bar.width)),
                    position=(middle, 0.0, 0.0),
                    orientation=(math.cos(turn), 0.0, 0.0, math.sin(turn)),
                )
                system.add(bar, f"bar {k + 1}{name}")
            a, b = f"bar {k + 1}a", f"bar {k + 1}b"
            system.add(
                parts.Joint(a=(a, (0.0, 0.0, 0.0)), b=b, type="revolute", axis=(0.0, 0.0, 1.0)), f"middle {k + 1}"
            )
            spring = parts.JointSpring(a=a, b=b, start=2.0 * case.half_angle, **case.spring.of_joint())
            system.add(spring, f"spring {k + 1}")
            if k == 0:
                continue
            last_a, last_b = f"bar {k}a", f"bar {k}b"
            upper = parts.Joint(a=(last_a, (half, 0.0, 0.0)), b=b, type="revolute", axis=(0.0, 0.0, 1.0))
            system.add(upper, f"upper {k}")
            # the lower pin holds x and y alone, by two distances: the others already hold z and the directions
            for side in (1.0, -1.0):
                near = (last_b, (-0.8 * half, 0.2 * side * half, 0.0))
                pin = parts.Joint(a=near, b=(a, (-half, 0.0, 0.0)), type="distance")
                system.add(pin, f"lower {k}{'l' if side > 0.0 else 'r'}")
        return system

    def derived(self, case: PantographCase, solution: Any) -> dict[str, Any]:
        """Half angle of the first cell, and length of the mast between the pins at its ends."""
        view = View(solution)
        first, second, last = (view.pose(view.index(f"bar {name}")) for name in ("1a", "1b", f"{case.cells}a"))
        one, other = first.R[:, :, 0], second.R[:, :, 0]  # along the bars, inertial axes
        sine, cosine = np.einsum("ti,ti->t", np.cross(one, other), [[0.0, 0.0, 1.0]]), np.einsum("ti,ti->t", one, other)
        half_angle = 0.5 * np.unwrap(np.arctan2(sine, cosine))
        length = np.linalg.norm(last.x - first.x, axis=1) + case.bar.length * np.sin(half_angle)
        return {
            "half_angle": (("time",), half_angle, "rad", "half the angle between the bars of the first cell"),
            "mast_length": (("time",), length, "m", "length of the mast between the pins at its ends"),
        }
