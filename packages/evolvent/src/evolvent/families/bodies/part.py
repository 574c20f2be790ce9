"""Rigid body: driven, spinning about a fixed axis, or free in six degrees of freedom."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location, is_name, split_reference
from evolvent.families.beams.nodes import node_rate
from evolvent.families.joints.part import Joint
from evolvent.kernels import rigid
from evolvent.kernels.rotations import rotation_about_axis, rotation_from_quaternion
from evolvent.parts.applies import Applies, given, left_out, one_of
from evolvent.parts.base import Group, Part, PointReference, unit
from evolvent.parts.drive import FreeSpool, LineDrive, RampDrive
from evolvent.parts.shapes import AnyShape
from evolvent_base import units
from evolvent_base.dense import dot, product
from evolvent_base.errors import InputError

MOTIONS = {"driven": rigid.DRIVEN, "spin": rigid.SPIN, "free": rigid.FREE}


def _check_names(points: dict[str, units.Triple]) -> dict[str, units.Triple]:
    for name in points:
        if not is_name(name):
            message = f"the name {name!r} must start with a letter and hold letters, digits, '-', '_' and blanks"
            raise PydanticCustomError("name", "{message}", {"message": message})
    return points


class RigidBody(Part):
    """A rigid body; its axes start from its centre of mass.

    Parameters
    ----------
    motion : {"free", "spin", "driven"}
        Free in six degrees of freedom, free to turn about `axis` through its fixed origin, or turning about `axis` at
        the constant `rate` whatever acts on it (a `rate` of 0 holds it fixed).
    mass : float, kg
        Of a free body; of `density` and `shape` if left out.
    inertia : float, (3,) or (3, 3) float, kg m^2
        Moment of inertia about every axis, principal moments, or the tensor in body axes; of `shape` with uniform
        density if left out.
    shape : box, cylinder, sphere or capsule, optional
        Shape of the body in drawings and in a `Contact`, centred at its centre of mass.
    density : float, kg/m^3, optional
        Of the shape, in place of mass and inertia.
    points : mapping of names to (3,) float, m
        Points of the body, body axes; the point left of a body hub goes by the reference hub.left.
    at : point, optional
        Node of a beam or rod, such as "boom.tip" or "boom[5]", to which a free body is clamped. The body starts with
        the velocity and angular velocity of the node.
    position : (3,) float, m
        Of the centre of mass at the start, inertial axes; for a body with `at` the position of the node if left out.
    velocity : (3,) float, m/s
        Of the centre of mass at the start, inertial axes (free bodies).
    orientation : (4,) float, or mapping
        Quaternion from body to inertial axes at the start, scalar part first; or ``{axis: [0, 0, 1], angle: 90 deg}``;
        or Euler angles, ``{euler: [10 deg, 0, 5 deg], order: xyz}``, turns about the inertial axes one after another
        (extrinsic), with capital letters (``XYZ``) about the body's axes (intrinsic).
    angular_velocity : (3,) float, rad/s
        At the start, body axes (free bodies).
    axis : (3,) float
        Body axes (spinning and driven bodies).
    rate : float, rad/s
        About `axis` (spinning and driven bodies).
    drive : a drive of `evolvent.parts`, optional
        Displacement of a driven body along `direction` from `position`, m, such as that of a shaker table. Its rate
        must not jump.
    direction : (3,) float, optional
        Direction of `drive`, inertial axes; x if left out.

    Notes
    -----
    The state of a free body is position, quaternion, velocity (inertial) and angular velocity (body axes); of a
    spinning body its angle, unwrapped, and rate.
    """

    applies: ClassVar[Applies] = {
        "density": (left_out("mass", "inertia"),),
        "mass": (left_out("density"),),
        "inertia": (left_out("density"),),
        "at": (one_of("motion", "free"),),
        "velocity": (one_of("motion", "free"), left_out("at")),
        "angular_velocity": (one_of("motion", "free"), left_out("at")),
        "axis": (one_of("motion", "spin", "driven"),),
        "rate": (one_of("motion", "spin", "driven"),),
        "drive": (one_of("motion", "driven"),),
        "direction": (one_of("motion", "driven"), given("drive")),
    }
    kind: Literal["rigid-body"] = "rigid-body"
    group = Group.BODIES
    motion: Literal["free", "spin", "driven"] = "free"
    mass: units.MassOrZero | None = None
    inertia: units.InertiaTensor | None = None
    shape: AnyShape | None = None
    density: units.Density | None = None
    points: Annotated[dict[str, units.Position], AfterValidator(_check_names)] = {}  # noqa: RUF012  (pydantic copies it)
    at: PointReference | None = None
    position: units.Position = (0.0, 0.0, 0.0)
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    orientation: units.Quaternion = (1.0, 0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)
    rate: units.AngularRate = 0.0
    drive: LineDrive | None = None
    direction: units.Direction | None = None

    def mass_properties(self, name: str = "body") -> tuple[float, np.ndarray]:
        """Mass (kg) and inertia (3, 3) in body axes (kg m2), given or of the shape; zero where neither says.

        Raises
        ------
        InputError
            If what is given contradicts itself, or no body has such an inertia.
        """
        mass, shape = self.mass, self.shape
        if shape is not None and not np.isfinite(shape.volume):
            raise InputError(f"{name}.shape.cylinder.length is missing; only in a contact a cylinder may have no ends")
        if self.density is not None:
            if shape is None:
                raise InputError(f"{name}.density is given without {name}.shape, which it needs for the mass")
            for key in ("mass", "inertia"):
                if getattr(self, key) is not None:
                    raise InputError(f"{name}.density and {name}.{key} are both given; leave one of them out")
            mass = self.density * shape.volume
        if self.inertia is not None:
            tensor = self.inertia_tensor(name)
        elif shape is not None and mass is not None:
            tensor = mass * shape.inertia_per_mass()
        else:
            tensor = np.zeros((3, 3))
        return 0.0 if mass is None else mass, tensor

    def inertia_tensor(self, name: str = "body") -> np.ndarray:
        """The given inertia as a (3, 3) tensor in body axes."""
        tensor = np.array(self.inertia, dtype=float)
        if tensor.shape in ((), (3,)):
            tensor = np.diag(np.broadcast_to(tensor, 3).astype(float))
        given = f"{name}.inertia is {self.inertia!r}"
        if not np.allclose(tensor, tensor.T, rtol=1e-9, atol=0.0):
            raise InputError(f"{given}; the tensor must be symmetric")
        moments = np.linalg.eigvalsh(tensor)
        if moments[0] < 0.0 or (self.motion == "free" and moments[0] <= 0.0):
            raise InputError(f"{given}; its principal moments must be above 0")
        if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
            raise InputError(f"{given}; no body has it: one principal moment exceeds the sum of the others")
        return tensor

    def _path(self, builder: Builder, name: str) -> tuple[dict[str, Any], tuple[float, float]]:
        """Fields of the drive that carries the body, and the drive's value and rate at the start."""
        if self.drive is None:
            if self.direction is not None:
                raise InputError(f"{name}.direction is given without {name}.drive, to which it belongs")
            return {}, (0.0, 0.0)
        if self.motion != "driven":
            raise InputError(f"{name}.drive needs a driven body, but {name}.motion is {self.motion!r}; use 'driven'")
        if isinstance(self.drive, FreeSpool):
            raise InputError(f"{name}.drive is a free spool, which prescribes no motion; give another drive")
        row = self.drive.write(builder, f"{name}.drive")
        jumps = isinstance(self.drive, RampDrive) and any(duration == 0.0 for _, duration, _ in self.drive.steps)
        if jumps:
            raise InputError(f"{name}.drive.steps has a step of zero duration, at which the rate jumps; give it a "
                             f"duration above 0 s")  # fmt: skip
        direction = np.array([1.0, 0.0, 0.0]) if self.direction is None else unit(self.direction)
        fields = {"path": 1 + row.kind, "path_first": row.first, "path_last": row.last, "path_law": row.law}
        value, rate, _ = self.drive.at(builder, row, 0.0)
        return {**fields, "direction": direction}, (value, rate)

    def write(self, builder: Builder, name: str) -> None:
        """Write the body into the family `bodies`."""
        path, begin = self._path(builder, name)
        motion = MOTIONS[self.motion]
        mass, tensor = self.mass_properties(name)
        node = self._node(builder, name)
        axis, q4, x = unit(self.axis), unit(self.orientation), np.array(self.position)
        if node is not None and "position" not in self.model_fields_set:
            x = node.x
        spin_inertia = dot(axis, product(tensor, axis))
        R = np.empty((3, 3))
        rotation_from_quaternion(*q4, R)
        if motion == rigid.FREE:
            if mass == 0.0:
                state = "missing" if self.mass is None else "0"
                raise InputError(f"{name}.mass is {state}; a free body needs a mass above 0, or a density and a shape")
            if spin_inertia == 0.0:
                raise InputError(f"{name}.inertia is missing; a free body needs it, or a shape")
            velocity, w = np.array(self.velocity), np.array(self.angular_velocity)
            if node is not None:
                turn = node_rate(builder, node) if node.family == "beams" else builder.poses[node.row].w
                velocity, w = node.v + np.cross(turn, x - node.x), product(R.T, turn)
            q, v = builder.coordinates([*x, *q4], [*velocity, *w])
            pose = Pose(x, R, velocity, product(R, w))
        else:
            if motion == rigid.SPIN and spin_inertia <= 0.0:
                given = "missing" if self.inertia is None else repr(self.inertia)
                raise InputError(f"{name}.inertia is {given}; about the axis of a spinning body it must be above 0")
            q, v = (-1, -1) if motion == rigid.DRIVEN else builder.coordinates([0.0], [self.rate])
            turned = np.empty((3, 3))
            rotation_about_axis(axis, 0.0, R, turned)
            direction = path.get("direction", np.zeros(3))
            pose = Pose(x + begin[0] * direction, turned, begin[1] * direction, product(turned, axis) * self.rate)
        builder.poses.append(pose)
        index = builder.add(
            "bodies",
            motion=motion,
            iq=q,
            iv=v,
            mass=mass,
            inertia=tensor,
            axis=axis,
            R0=R,
            x0=x,
            rate=self.rate,
            spin_inertia=spin_inertia,
            **path,
        )
        builder.names[name] = ("bodies", index)
        builder.body_points[name] = dict(self.points)
        if node is not None:
            Joint(a=(name, tuple(product(R.T, node.x - x))), b=self.at, type="clamp").write(builder, name)
            builder.names[name] = ("bodies", index)

    def _node(self, builder: Builder, name: str) -> Location | None:
        """The node that the body is clamped to."""
        if self.at is None:
            return None
        found = builder.location(self.at, f"{name}.at")
        part = split_reference(self.at)[0] if isinstance(self.at, str) else ""
        if found.family != "beams" and builder.names.get(part, ("",))[0] != "rods":
            raise InputError(
                f"{name}.at is {self.at!r}; it must be a node of a beam or rod; for other points add a Joint"
            )
        if self.motion != "free":
            raise InputError(f"{name}.motion is {self.motion!r}; a body with {name}.at must be 'free'")
        for key in ("velocity", "angular_velocity"):
            if key in self.model_fields_set:
                raise InputError(f"{name}.{key} and {name}.at are both given; the body moves with the node")
        return found
