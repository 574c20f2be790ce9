"""Spring-damper between two points."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.families.springs.part_table import ForceTable, write_table
from evolvent.kernels import markers
from evolvent.parts.applies import OF_LAW, Applies, given, left_out
from evolvent.parts.base import Group, Part, PointReference, unit
from evolvent.parts.law import Constants, Parameters, SpringLaw, refuse_without_law, write_law
from evolvent_base import units
from evolvent_base.dense import norm
from evolvent_base.errors import InputError


class Spring(Part):
    """A spring-damper along the line between two points of bodies, point masses, beams or the ground.

    Parameters
    ----------
    a, b : point
        Ends: "hub" (its origin), "hub.left" (a point of it), ("hub", (x, y, z)), a point mass, a node of a beam
        ("boom.tip", "boom[5]"), the end of a thread ("tether.tip"), or a position on the ground.
    stiffness : float, N/m
        Along the line.
    damping : float, N s/m
        Along the line.
    length : float, m, optional
        Natural length; the distance at the start if left out.
    viscoelastic : mapping, optional
        Relaxation of the spring by a Prony series, as of a material.
    slack : bool
        Whether the spring only pulls, as a lanyard or a bungee: it has no force while it is shorter than its natural
        length, nor while its damper would push. A viscoelastic one is slack while it is shorter than the length at
        which its relaxed tension is zero, and recovers meanwhile.
    table : rows [extension, tension], m and N, optional
        Measured line of the spring, in place of stiffness: tension over the extension from `length`, below 0 where it
        pushes; straight lines between the rows, and the tension of the first and the last row beyond them.
    law : optional
        Tension (N) in place of stiffness and damping: an expression of the extension x (m), its rate v (m/s) and t (s),
        or a function under ``@evolvent.law``: ``law(extension, rate, t, parameters) -> tension``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of an expression.
    lateral_stiffness, lateral_damping : float, N/m and N s/m
        Against displacement of `b` across the axis of the spring's mount; `a` must then be on the ground.
    axis : (3,) float, optional
        Of that mount, inertial axes; from `a` to `b` at the start if left out.
    """

    applies: ClassVar[Applies] = {
        **OF_LAW,
        "table": (left_out("law", "stiffness"),),
        "slack": (left_out("law", "table", "lateral_stiffness", "lateral_damping"),),
        "viscoelastic": (given("stiffness"), left_out("law", "table", "lateral_stiffness", "lateral_damping")),
        "axis": (given("lateral_stiffness", "lateral_damping"),),
    }
    kind: Literal["spring"] = "spring"
    group = Group.SPRINGS
    a: PointReference
    b: PointReference
    stiffness: units.StiffnessOrZero = 0.0
    damping: units.DampingOrZero = 0.0
    length: units.LengthOrZero | None = None
    viscoelastic: Viscoelastic | None = None
    slack: bool = False
    table: ForceTable | None = None
    law: SpringLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    lateral_stiffness: units.StiffnessOrZero = 0.0
    lateral_damping: units.DampingOrZero = 0.0
    axis: units.Direction | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the spring into the family `springs`."""
        if self.a == self.b:
            raise InputError(f"{name}.a and {name}.b are the same point, {self.a!r}; give two points")
        a, b = (builder.marker(getattr(self, key), f"{name}.{key}", nodes=True) for key in ("a", "b"))
        apart = builder.marker_state(b)[0] - builder.marker_state(a)[0]
        if self.length and self.stiffness > 0.0 and not self.slack and not np.any(apart):
            raise InputError(
                f"{name}.a and {name}.b are at the same place at the start, where the force of the spring, "
                f"{self.stiffness * self.length:.6g} N, has no direction; move one of them, or give {name}.length 0"
            )
        axis = np.zeros(3)
        if self.lateral_stiffness > 0.0 or self.lateral_damping > 0.0:
            marker = builder.rows["markers"][a]
            if marker["kind"] != markers.ON_BODY or marker["index"] != builder.names["ground"][1]:
                raise InputError(f"{name}.a is {self.a!r}; a spring with lateral stiffness must be on the ground")
            if self.axis is None and not np.any(apart):
                raise InputError(f"{name}.axis is missing; the spring's ends coincide at the start")
            axis = unit(apart if self.axis is None else self.axis)
        law = {"law": 0, "first": 0, "last": 0}
        if self.law is None:
            refuse_without_law(name, self)
        if self.table is not None:
            for key in ("law", "stiffness", "slack", "viscoelastic"):
                if getattr(self, key):
                    raise InputError(f"{name}.table and {name}.{key} are both given; leave one of them out")
            law = write_table(builder, name, self.table, self.damping)
        elif self.law is not None:
            law = write_law(builder, name, self.law, "spring", self.parameters, self.constants)
        length = norm(apart) if self.length is None else self.length
        if self.slack:
            self._check_slack(name, length)
        for key in ("law", "lateral_stiffness", "lateral_damping"):
            if self.viscoelastic is not None and getattr(self, key):
                raise InputError(f"{name}.viscoelastic and {name}.{key} are both given; leave one of them out")
        terms = add_terms(builder, self.viscoelastic)
        index = builder.add(
            "springs",
            a=a,
            b=b,
            stiffness=self.stiffness,
            damping=0.0 if self.table is not None else self.damping,
            length=length,
            slack=int(self.slack),
            lateral_stiffness=self.lateral_stiffness,
            lateral_damping=self.lateral_damping,
            axis=axis,
            **law,
            **terms,
            branch=self._branches(builder, terms, norm(apart) - length),
        )
        builder.names[name] = ("springs", index)

    def _branches(self, builder: Builder, terms: dict[str, int], extension: float) -> int:
        """Branches of the strain: the extension, of a spring that only pulls its part above 0."""
        return add_branches(builder, terms, max(extension, 0.0) if self.slack else extension, dashpot=self.slack)

    def _check_slack(self, name: str, length: float) -> None:
        """Refuse what cannot go slack."""
        if self.law is not None:
            raise InputError(f"{name}.slack is true beside {name}.law; a law says itself where the tension is zero")
        for key in ("lateral_stiffness", "lateral_damping"):
            if getattr(self, key) > 0.0:
                raise InputError(f"{name}.slack is true beside {name}.{key}; what only pulls has no lateral force")
        if self.stiffness == 0.0:
            raise InputError(f"{name}.slack is true; it needs {name}.stiffness above 0")
        if length == 0.0:
            raise InputError(f"{name}.slack is true, but {name}.length is 0, below which no spring is; leave one out")
