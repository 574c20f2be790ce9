"""A family from outside the package: a rotary damper, a viscous torque between two bodies."""

from __future__ import annotations

from typing import Any, Literal

from evolvent.compiled.jit import inlined
from evolvent.kernels import calls
from evolvent.kernels.ends import of_bodies
from evolvent.kernels.rotations import cross, dot, turn
from evolvent.kernels.sides import add_torque_tangent
from evolvent.model.family import Family, Kind, record
from evolvent.model.powers import SPRINGS
from evolvent.model.questions import AdjointSupport
from evolvent.model.shares import DAMPING
from evolvent.parts.base import BodyName, Group, Part, unit
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError


@inlined
def measure(k, model):
    """Axis of damper k, inertial; its rate, torque and power go into its record."""
    row, bodies = model.rotary_dampers[k], model.bodies
    n = turn(bodies[row.a].R, row.axis[0], row.axis[1], row.axis[2])
    row.rate = dot(n, bodies[row.b].w) - dot(n, bodies[row.a].w)
    row.torque = row.damping * row.rate
    row.lost = row.torque * row.rate
    return n


@calls.force
def force(interval, model):
    """Torques of all dampers."""
    for k in range(model.rotary_dampers.size):
        row, n = model.rotary_dampers[k], measure(k, model)
        interval.powers[SPRINGS] += row.lost
        for c in range(3):
            model.bodies[row.a].F[3 + c] += row.torque * n[c]
            model.bodies[row.b].F[3 + c] -= row.torque * n[c]


@calls.tangent
def tangent(interval, model, matrix):
    """With turns t_a and t_b the rate changes by (t_a - t_b) . (n x w_b) beside the difference of their rates."""
    for k in range(model.rotary_dampers.size):
        row, n = model.rotary_dampers[k], measure(k, model)
        w = model.bodies[row.b].w
        x, y, z = cross(n[0], n[1], n[2], row.damping * w[0], row.damping * w[1], row.damping * w[2])
        slope = row.damping * interval.step.c_rate
        add_torque_tangent(matrix, model, row.a, row.b, n, row.torque, slope, (x, y, z))


ROTARY_DAMPERS = Family(
    "rotary_dampers",
    record("a b", "damping axis", "rate torque lost", axis=(3,)),
    order=500,
    results={
        "rate": ("rate", "rad s-1", "rate of rotation of b against a about the axis"),
        "torque": ("torque", "N m", "torque of the damper, positive against the rate"),
        "lost": ("dissipation", "W", "power dissipated"),
    },
    kinds=(Kind("a rotary damper", symmetric=True),),
    ends=of_bodies("a", "b"),
    force=force, tangent=tangent, isolated=True, category=DAMPING, smooth=True, stiff=False,
    adjoint=AdjointSupport("its torque follows from the state, with all derivatives", timed=False),
)  # fmt: skip


class RotaryDamper(Part):
    """A viscous torque, `damping` times the rate of body `b` against body `a`, about `axis`, fixed to `a`."""

    kind: Literal["rotary-damper"] = "rotary-damper"
    group = Group.SPRINGS
    symbol = "disc"
    a: BodyName
    b: BodyName
    axis: units.Direction = (0.0, 0.0, 1.0)
    damping: units.RotationalDampingOrZero

    def write(self, builder: Any, name: str) -> None:
        """Write the row."""
        a, b = builder.find(self.a, "bodies"), builder.find(self.b, "bodies")
        if a == b:
            raise InputError(f"{name}.a and {name}.b are one body, {self.a!r}; a damper needs two")
        axis = product(builder.poses[a].R.T, unit(self.axis))
        row = builder.add("rotary_dampers", a=a, b=b, damping=self.damping, axis=axis)
        builder.names[name] = ("rotary_dampers", row)
