"""Spring, damper, stops, latch and friction on the coordinate of a joint: an angle or a travel."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.joints.part_coordinate import (
    PRESLIDING,
    TYPES,
    Ends,
    check_units,
    ends_of_joint,
    joint_of,
    rotation,
    translation,
)
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.kernels import axial
from evolvent.parts.applies import Applies, given, left_out, refuse_unfit
from evolvent.parts.base import BodyName, Group, JointName, Part, PointReference, unit
from evolvent_base import units
from evolvent_base.errors import InputError

#: Kinds of coordinates by the words of the key `motion`.
MOTIONS = {"rotation": axial.ANGLE, "translation": axial.TRAVEL}


class JointSpring(Part):
    """Spring, damper, friction, stops and latch about or along an axis; a `Joint` of the same parts holds the rest.

    Parameters
    ----------
    joint : str, optional
        A `Joint` that defines ends and axis, in place of `a`, `b` and `axis`.
    a : str
        A body, or ground; the axis is fixed to it.
    b : point
        What turns or travels: another body, such as "panel", a point of it, such as "slider.pin", the node of a beam,
        such as "boom.root", or, of a translation, a point mass. The angle is that of `b` as seen from `a`,
        right-handed about the axis; a travel is that of `b` along it.
    axis : (3,) float
        Inertial axes at the start. No force acts perpendicular to the axis of a translation.
    motion : {"rotation", "translation"}, optional
        Which coordinate. If left out, that of a revolute or prismatic joint, and else the rotation.
    start : float, rad or m, optional
        Angle or travel at the start. An angle may be of any number of turns: 180 deg and -180 deg are different states
        of a folded panel. If left out, 0, and for a beam's node the angle from `zero`.
    zero : (3,) float, optional
        For a beam's node, the direction of angle 0, inertial axes at the start; if left out, the direction of the beam
        rotated back by `start`.
    stiffness, damping : float, N m/rad and N m s/rad, or N/m and N s/m
        Of the spring; of the damper, or of viscous friction.
    rest : float, rad or m
        Angle or travel at which the spring has no torque or force.
    viscoelastic : mapping, optional
        Relaxation of the spring by a Prony series, as of a material.
    friction : float, N m or N
        Coulomb friction: the torque or force at which the joint slips.
    bristle_stiffness : float, N m/rad or N/m, optional
        Stiffness of stiction; by default the joint slips after 1e-4 rad or 1e-5 m.
    low, high : float, rad or m, optional
        Stops; none if left out.
    stop : float, N m/rad or N/m
        Stiffness of the stops.
    latch : float, rad or m, optional
        Angle or travel at which the joint locks permanently; a joint that starts there is locked.
    latch_stiffness, latch_damping : float, N m/rad and N m s/rad, or N/m and N s/m
        Stiffness and damping of the latch.

    Notes
    -----
    An angle is continuous over any number of turns. For a node of a cable it is that of its axis, for a node of a beam
    that of its section.
    """

    applies: ClassVar[Applies] = {
        "joint": (left_out("a", "b"),),
        **{key: (left_out("joint"),) for key in ("a", "b", "axis")},
        "bristle_stiffness": (given("friction"),),
        "viscoelastic": (given("stiffness"),),
        "stop": (given("low", "high"),),
        "latch_stiffness": (given("latch"),),
        "latch_damping": (given("latch"),),
    }
    kind: Literal["joint-spring"] = "joint-spring"
    group = Group.SPRINGS
    symbol = "hinge"
    joint: JointName | None = None
    a: BodyName | None = None
    b: PointReference | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)
    motion: Literal["rotation", "translation"] | None = None
    start: units.AngleOrTravel | None = None
    zero: units.Direction | None = None
    stiffness: units.CoordinateStiffnessOrZero = 0.0
    damping: units.CoordinateDampingOrZero = 0.0
    rest: units.AngleOrTravel = 0.0
    viscoelastic: Viscoelastic | None = None
    friction: units.TorqueOrForceOrZero = 0.0
    bristle_stiffness: units.CoordinateStiffnessOrZero | None = None
    low: units.AngleOrTravel | None = None
    high: units.AngleOrTravel | None = None
    stop: units.CoordinateStiffnessOrZero = 0.0
    latch: units.AngleOrTravel | None = None
    latch_stiffness: units.CoordinateStiffnessOrZero = 0.0
    latch_damping: units.CoordinateDampingOrZero = 0.0

    @classmethod
    def acts_on_travel(cls, content: Mapping[str, Any], travels: Callable[[Any], bool]) -> bool:
        """Whether it is of a travel: as `motion` says, or its joint."""
        motion = content.get("motion")
        return travels(content.get("joint")) if motion is None else motion == "translation"

    def _check(self, name: str, kind: int) -> None:
        """Refuse stops, latches and friction without what they need, and units of the other kind of coordinate."""
        unit_of, stiffness = ("rad", "N m/rad") if kind == axial.ANGLE else ("m", "N/m")
        for key in type(self).model_fields:
            check_units(f"{name}.{key}", getattr(self, key), kind)
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(
                f"{name}.low is {float(self.low)!r} {unit_of}, above {name}.high, {float(self.high)!r} {unit_of}"
            )
        if (self.low is not None or self.high is not None) and self.stop == 0.0:
            raise InputError(f"{name}.stop is {float(self.stop)!r}; stops need a stiffness above 0 {stiffness}")
        if self.latch is not None and self.latch_stiffness == 0.0:
            raise InputError(
                f"{name}.latch_stiffness is {float(self.latch_stiffness)!r}; a latch needs one above 0 {stiffness}"
            )
        if self.bristle_stiffness == 0.0:
            raise InputError(f"{name}.bristle_stiffness is 0.0; friction needs one above 0 {stiffness}")
        if kind == axial.TRAVEL and self.zero is not None:
            raise InputError(f"{name}.zero is given, but {name} acts on a travel; give {name}.start, its value")

    def ends(self, builder: Builder, name: str, kind: int) -> Ends:
        """Ends and axis, its own or those of the joint that it names."""
        if self.joint is None:
            for key in ("a", "b"):
                if getattr(self, key) is None:
                    raise InputError(f"{name}.{key} is missing; give {name}.a and {name}.b, or {name}.joint")
            index = builder.find(str(self.a), "bodies")
            return Ends(self.a, self.b, index, builder.location(self.b, f"{name}.b"), unit(self.axis))
        if "axis" in self.model_fields_set:  # also where it is that of the default
            raise InputError(f"{name}.axis and {name}.joint, {self.joint!r}, are both given; leave one of them out")
        types = TYPES[kind] if self.motion is not None else dict.fromkeys(sum(TYPES.values(), ()))
        return ends_of_joint(builder, f"{name}.joint", self.joint, tuple(types))

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `coordinates`."""
        refuse_unfit(name, self)
        joint = joint_of(builder, self.joint)
        own = "translation" if joint is not None and joint.type == TYPES[axial.TRAVEL][0] else "rotation"
        kind = MOTIONS[self.motion or own]
        self._check(name, kind)
        ends = self.ends(builder, name, kind)
        if kind == axial.ANGLE:
            found = rotation(builder, name, ends, self.start, self.zero)
        else:
            found = translation(builder, name, ends, self.start or 0.0)
        keys = ("stiffness", "damping", "rest", "friction", "stop", "latch_stiffness", "latch_damping")
        stick = self.bristle_stiffness
        terms = add_terms(builder, self.viscoelastic)
        branch = add_branches(builder, terms, np.array([found.start - self.rest]))
        row = found.write(
            builder,
            {key: getattr(self, key) for key in keys} | terms | {"branch": branch},
            low=-math.inf if self.low is None else self.low,
            high=math.inf if self.high is None else self.high,
            latch=math.inf if self.latch is None else self.latch,
            stick=self.friction / PRESLIDING[kind] if stick is None else stick,
        )
        builder.names[name] = ("coordinates", row)
