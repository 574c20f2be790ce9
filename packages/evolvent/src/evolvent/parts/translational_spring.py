"""Spring, damper, stops, latch and friction along an axis of a body."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import axial
from evolvent.kernels.sides import ON_BODY, ON_COORDINATES
from evolvent.parts.applies import Applies, given
from evolvent.parts.base import BodyName, JointName, PointReference
from evolvent.parts.joint_coordinate import COORDINATE_APPLIES, CoordinateSpring
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError


class TranslationalSpring(CoordinateSpring):
    """Spring, damper, friction, stops and latch along an axis fixed to a body, such as that of a prismatic joint.

    Parameters
    ----------
    joint : str, optional
        A prismatic or cylindrical `Joint` that defines ends and axis, in place of `a`, `b` and `axis`.
    a : str
        A body, or ground; the axis is fixed to it.
    b : point
        Point whose travel is measured: a point of another body, such as "slider" or "slider.pin", a point mass, or a
        beam's node.
    axis : (3,) float
        Inertial axes at the start. No force acts perpendicular to it.
    travel : float, m
        Travel of `b` along the axis at the start.
    stiffness, damping : float, N/m and N s/m
        Of the spring; of the damper, or of viscous friction.
    rest : float, m
        Travel at which the force of the spring is zero.
    friction_force : float, N
        Coulomb friction: the force at which the joint slips.
    bristle_stiffness : float, N/m, optional
        Stiffness of stiction; by default the joint slips after 1e-5 m.
    low, high : float, m, optional
        Stops; none if left out.
    stop : float, N/m
        Stiffness of the stops.
    latch : float, m, optional
        Travel at which the joint locks permanently; a joint that starts there is locked.
    latch_stiffness, latch_damping : float, N/m and N s/m
        Stiffness and damping of the latch.
    """

    friction_key: ClassVar[str] = "friction_force"
    applies: ClassVar[Applies] = {
        **COORDINATE_APPLIES,
        "bristle_stiffness": (given("friction_force"),),
    }
    kind: Literal["translational-spring"] = "translational-spring"
    joint: JointName | None = None
    a: BodyName | None = None
    b: PointReference | None = None
    axis: units.Direction = (1.0, 0.0, 0.0)
    travel: units.Coordinate = 0.0
    stiffness: units.StiffnessOrZero = 0.0
    damping: units.DampingOrZero = 0.0
    rest: units.Coordinate = 0.0
    friction_force: units.ForceOrZero = 0.0
    bristle_stiffness: units.StiffnessOrZero | None = None
    low: units.Coordinate | None = None
    high: units.Coordinate | None = None
    stop: units.StiffnessOrZero = 0.0
    latch: units.Coordinate | None = None
    latch_stiffness: units.StiffnessOrZero = 0.0
    latch_damping: units.DampingOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `coordinates`."""
        self.check(name, "m", "N/m")
        ends = self.ends(builder, name, ("prismatic", "cylindrical", "screw"))
        place = ends.location
        on_body = place.family == "bodies"
        if on_body and place.row == ends.body:
            raise InputError(f"{name}.a and {name}.b are on one body, {ends.a!r}; a travel needs two parts")
        pose = builder.poses[ends.body]
        fields = {
            "on": ON_BODY if on_body else ON_COORDINATES,
            "other": place.row if on_body else -1,
            "iq": -1 if on_body else place.iq,
            "iv": -1 if on_body else place.iv,
            "local": np.asarray(place.local, dtype=float),
            "zero": product(pose.R.T, place.x - self.travel * ends.axis - pose.x),
        }
        self.add_row(builder, name, axial.TRAVEL, ends.body, product(pose.R.T, ends.axis), self.travel, fields)
