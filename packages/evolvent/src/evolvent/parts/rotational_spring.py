"""Rotational spring, damper, stops, latch and friction between a body and a beam's node, or between two bodies."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import model_validator

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location
from evolvent.kernels import ancf_beams, axial
from evolvent.kernels.sides import ON_BODY, ON_COORDINATES
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import BodyName, JointName, PointReference, unit
from evolvent.parts.joint_coordinate import COORDINATE_APPLIES, CoordinateSpring, Ends
from evolvent_base import units
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError

#: What the angle at the start may be off the one that `zero` gives, rad.
_LEAST_OFF = 1e-6


class _Second(NamedTuple):
    """The second direction: fields of the family `coordinates`, and the zero direction (inertial axes) and angle."""

    on: int
    other: int
    iq: int
    iv: int
    local: np.ndarray
    zero: np.ndarray
    angle: float


class RotationalSpring(CoordinateSpring):
    """Spring, damper, friction, stops and latch about an axis; a `Joint` of the same two parts constrains the rest.

    Parameters
    ----------
    joint : str, optional
        A revolute or cylindrical `Joint` that defines ends and axis, in place of `a`, `b` and `axis`.
    a : str
        A body, or ground; the axis is fixed to it.
    b : point
        The other body, such as "panel", or the node of a beam, such as "boom.root". The angle is that of `b` as seen
        from `a`, right-handed about the axis.
    axis : (3,) float
        Inertial axes at the start.
    angle : float, rad, optional
        Angle at the start, of any number of turns: 180 deg and -180 deg are different states of a folded panel. If left
        out, 0 between bodies, and for a beam's node the angle from `zero`.
    zero : (3,) float, optional
        For a beam's node, the direction of angle 0, inertial axes at the start; if left out, the direction of the beam
        rotated back by `angle`.
    stiffness, damping : float, N m/rad and N m s/rad
        Of the spring; of the damper, or of viscous friction.
    rest : float, rad
        Angle at which the torque of the spring is zero.
    friction_torque : float, N m
        Coulomb friction: the torque at which the joint slips.
    bristle_stiffness : float, N m/rad, optional
        Stiffness of stiction; by default the joint slips after 1e-4 rad.
    low, high : float, rad, optional
        Stops; none if left out.
    stop : float, N m/rad
        Stiffness of the stops.
    latch : float, rad, optional
        Angle at which the hinge locks permanently; a hinge that starts at this angle is locked.
    latch_stiffness, latch_damping : float, N m/rad and N m s/rad
        Stiffness and damping of the latch.

    Notes
    -----
    The angle is continuous over any number of turns. `body` and `node` are accepted for `a` and `b`. For a node of a
    cable the angle is that of its axis, for a node of a beam that of its section.
    """

    friction_key: ClassVar[str] = "friction_torque"
    applies: ClassVar[Applies] = {
        **COORDINATE_APPLIES,
        "zero": (left_out("joint"),),
        "bristle_stiffness": (given("friction_torque"),),
    }
    kind: Literal["rotational-spring"] = "rotational-spring"
    joint: JointName | None = None
    a: BodyName | None = None
    b: PointReference | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)
    angle: units.Angle | None = None
    zero: units.Direction | None = None
    stiffness: units.RotationalStiffnessOrZero = 0.0
    damping: units.RotationalDampingOrZero = 0.0
    rest: units.Angle = 0.0
    friction_torque: units.TorqueOrZero = 0.0
    bristle_stiffness: units.RotationalStiffnessOrZero | None = None
    low: units.Angle | None = None
    high: units.Angle | None = None
    stop: units.RotationalStiffnessOrZero = 0.0
    latch: units.Angle | None = None
    latch_stiffness: units.RotationalStiffnessOrZero = 0.0
    latch_damping: units.RotationalDampingOrZero = 0.0

    @model_validator(mode="before")
    @classmethod
    def _read_former_names(cls, values: Any) -> Any:
        """Read `body` and `node` as `a` and `b`."""
        if not isinstance(values, dict):
            return values
        former = {"body": "a", "node": "b"}
        return {key if former.get(key, key) in values else former[key]: value for key, value in values.items()}

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `coordinates`."""
        self.check(name, "rad", "N m/rad")
        ends = self.ends(builder, name, ("revolute", "cylindrical", "screw"))
        place, axis = ends.location, ends.axis
        if place.family == "points":
            raise InputError(f"{name}.b is {ends.b!r}, a point mass, which has no angle; give a body or a beam's node")
        second = self._body(builder, name, ends) if place.family == "bodies" else self._node(builder, name, ends)
        R = builder.poses[ends.body].R
        fields = second._asdict() | {"zero": product(R.T, second.zero), "anchor": second.angle, "before": second.angle}
        self.add_row(builder, name, axial.ANGLE, ends.body, product(R.T, axis), second.angle, fields)

    def _body(self, builder: Builder, name: str, ends: Ends) -> _Second:
        """The second direction of a body: across the axis, at the angle that the start has."""
        other, axis = ends.location.row, ends.axis
        if other == ends.body:
            raise InputError(f"{name}.a and {name}.b are one body, {ends.a!r}; a hinge needs two parts")
        if self.zero is not None:
            raise InputError(f"{name}.zero is given, but {name}.b is a body; give {name}.angle, its angle at the start")
        angle = 0.0 if self.angle is None else self.angle
        zero = _across(axis)
        u = math.cos(angle) * zero + math.sin(angle) * np.cross(axis, zero)
        return _Second(ON_BODY, other, -1, -1, product(builder.poses[other].R.T, u), zero, angle)

    def _node(self, builder: Builder, name: str, ends: Ends) -> _Second:
        """The second direction of a beam's node: the slope along it, or one across it."""
        place: Location = ends.location
        axis = ends.axis
        slope = np.array(builder.q[place.iq + 3 : place.iq + 6])
        zero = unit(slope if self.zero is None else self.zero)
        if abs(zero @ axis) > 1e-6:
            raise InputError(f"{name}.zero is {tuple(zero.tolist())!r}; it must be across the axis")
        zero = zero - dot(zero, axis) * axis
        zero /= norm(zero)
        if self.zero is None and self.angle is not None:
            zero = math.cos(self.angle) * zero - math.sin(self.angle) * np.cross(axis, zero)
        which = 1
        if place.beam == ancf_beams.BEAM:
            across = np.array(builder.q[place.iq + 6 : place.iq + 12]).reshape(2, 3)
            which = 2 + int(np.argmin(np.abs(product(across, axis)) / np.linalg.norm(across, axis=1)))
            quarter = np.cross(axis, zero)
            zero = quarter if dot(across[which - 2], np.cross(axis, slope)) > 0.0 else -quarter
            slope = across[which - 2]
        angle = math.atan2(dot(slope, np.cross(axis, zero)), dot(slope, zero))
        if self.angle is not None:
            off = math.remainder(angle - self.angle, 2.0 * math.pi)
            if abs(off) > _LEAST_OFF:
                raise InputError(
                    f"{name}.angle is {self.angle:.9g} rad, but {name}.b is at {angle:.9g} rad from {name}.zero "
                    f"(plus or minus whole turns); give that, or leave out one of the two"
                )
            angle = self.angle + off
        iq, iv = place.iq + 3 * which, place.iv + 3 * which
        return _Second(ON_COORDINATES, -1, iq, iv, np.zeros(3), zero, angle)


def _across(axis: np.ndarray) -> np.ndarray:
    """A unit vector across another."""
    e = np.zeros(3)
    e[int(np.argmin(np.abs(axis)))] = 1.0
    return unit(np.cross(axis, e))
