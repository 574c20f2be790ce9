"""Several parts that are added at once: a panel on a hinge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent.elements.rods import quaternion
from evolvent.parts.base import BodyName, unit
from evolvent.parts.shapes import SIDE
from evolvent_base import units
from evolvent_base.dense import dot
from evolvent_base.schema import Section

#: What `direction` may be off the right angle to `axis`: the cosine.
_LEAST_OFF = 1e-6


class HingedPanel(Section):
    """A panel on a hinge of another body: a rigid body, its revolute joint, and a spring that opens it."""

    body: BodyName = Field(description="the body that carries the panel, or ground")
    hinge: units.Position = Field(description="middle of the hinge line at the start, inertial axes")
    size: Annotated[units.Triple, units.Vector(quantity=SIDE)] = Field(
        description="length from the hinge to the far edge, width along the hinge, thickness"
    )
    mass: units.Mass = Field(description="of the panel, uniform")
    direction: units.Direction = Field((1.0, 0.0, 0.0), description="from the hinge to the far edge at the start")
    axis: units.Direction = Field((0.0, 0.0, 1.0), description="of the hinge, perpendicular to direction")
    stiffness: units.RotationalStiffnessOrZero = Field(0.0, description="of the hinge's spring")
    opens: units.Angle = Field(0.0, description="about the axis, from the start to where the spring is at rest")

    def refusals(self) -> Iterator[str]:
        """Directions that are not perpendicular, and a spring that does nothing."""
        if abs(dot(unit(self.direction), unit(self.axis))) > _LEAST_OFF:
            yield f"axis is {list(self.axis)!r}; it must be perpendicular to direction, {list(self.direction)!r}"
        if self.opens and not self.stiffness:
            yield "opens is given, but stiffness is 0; the spring that opens the hinge needs a stiffness"

    def parts(self, name: str) -> dict[str, dict[str, Any]]:
        """The parts, as a case file holds them.

        Parameters
        ----------
        name : str, of the panel; joint and spring are called after it
        """
        e, a = unit(self.direction), unit(self.axis)
        length = self.size[0]
        turn = quaternion(np.column_stack([e, a, np.cross(e, a)]))
        panel: dict[str, Any] = {
            "kind": "rigid-body",
            "mass": f"{self.mass:.9g} kg",
            "shape": {"box": {"size": _vector(self.size, "m")}},
            "position": _vector(np.array(self.hinge) + 0.5 * length * e, "m"),
            "orientation": [float(f"{x:.12g}") + 0.0 for x in turn],
            "points": {"hinge": _vector((-0.5 * length, 0.0, 0.0), "m")},
        }
        body = _vector(self.hinge, "m") if self.body == "ground" else self.body
        joint: dict[str, Any] = {
            "kind": "joint",
            "a": body,
            "b": f"{name}.hinge",
            "type": "revolute",
            "axis": _vector(self.axis, ""),
        }
        found = {name: panel, f"{name} hinge": joint}
        if self.stiffness:
            spring = {"kind": "joint-spring", "joint": f"{name} hinge"}
            spring["stiffness"] = f"{self.stiffness:.9g} N m/rad"
            found[f"{name} spring"] = spring | ({"rest": f"{self.opens:.9g} rad"} if self.opens else {})
        return found


def _vector(values: Sequence[float] | np.ndarray, unit_of: str) -> list[Any]:
    """A vector as a case file holds it: its last value has the unit."""
    plain = [float(f"{float(x):.9g}") + 0.0 for x in values]
    return [*plain[:-1], f"{plain[-1]:.9g} {unit_of}" if unit_of else plain[-1]]
