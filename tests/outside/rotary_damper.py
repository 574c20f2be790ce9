"""A family from outside the package: a rotary damper, a viscous torque between two bodies about an axis of the first."""

from __future__ import annotations

from typing import Any, Literal

from evolvent.base import units
from evolvent.base.errors import InputError
from evolvent.compiled.jit import inlined
from evolvent.elements.dense import product
from evolvent.kernels import calls
from evolvent.kernels.ends import of_bodies
from evolvent.kernels.rotations import cross, dot, turn
from evolvent.kernels.sides import turn_columns
from evolvent.kernels.sparse import add_entry
from evolvent.model.family import Family, Kind, record
from evolvent.model.powers import SPRINGS
from evolvent.model.questions import AdjointSupport
from evolvent.model.shares import DAMPING
from evolvent.parts.base import BodyName, Part, unit


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
    rows, bodies = model.rotary_dampers, model.bodies
    for k in range(rows.size):
        n = measure(k, model)
        interval.powers[SPRINGS] += rows[k].lost
        for c in range(3):
            bodies[rows[k].a].F[3 + c] += rows[k].torque * n[c]
            bodies[rows[k].b].F[3 + c] -= rows[k].torque * n[c]


@calls.tangent
def tangent(interval, model, matrix):
    """With turns t_a, t_b the rate changes by (t_a - t_b) . (n x w_b), and the torque T n on b by T (t_b - t_a) x n."""
    for k in range(model.rotary_dampers.size):
        row, n = model.rotary_dampers[k], measure(k, model)
        w, damping = model.bodies[row.b].w, row.damping
        m = cross(n[0], n[1], n[2], w[0], w[1], w[2])
        for side in range(2):
            at, rows = turn_columns(model, row.b if side else row.a, model.J[0])
            for other in range(2):
                to, columns = turn_columns(model, row.b if other else row.a, model.J[1])
                for r in range(rows):
                    p = (model.J[0, 0, r], model.J[0, 1, r], model.J[0, 2, r])
                    for c in range(columns):
                        e, sign = (model.J[1, 0, c], model.J[1, 1, c], model.J[1, 2, c]), 1.0 if other else -1.0
                        value = damping * sign * (interval.step.c_rate * dot(e, n) - dot(e, m)) * dot(p, n)
                        turned = sign * row.torque * dot(p, cross(e[0], e[1], e[2], n[0], n[1], n[2])) if side else 0.0
                        add_entry(matrix, at + r, to + c, (value if side else -value) - turned)


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
    force=force, tangent=tangent, category=DAMPING, smooth=True, stiff=False,
    adjoint=AdjointSupport("its torque follows from the state, with all derivatives", timed=False),
)  # fmt: skip


class RotaryDamper(Part):
    """A viscous torque, `damping` (N m s/rad) times the rate of body `b` against body `a`, about `axis`, fixed to `a`."""

    kind: Literal["rotary-damper"] = "rotary-damper"
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
        builder.names[name] = (
            "rotary_dampers",
            builder.add("rotary_dampers", a=a, b=b, damping=self.damping, axis=axis),
        )
