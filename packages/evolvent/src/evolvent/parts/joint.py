"""What holds beams, bodies and points together, and drives them: constraints, or penalties in their place."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import axial, gaps, joint as kernels, rigid, sides
from evolvent.parts.applies import Applies, given, left_out, one_of
from evolvent.parts.base import BodyName, Part, PointReference, unit
from evolvent.parts.checks import check_units
from evolvent.parts.drive import RampDrive
from evolvent.parts.drive_kind import DriveKind
from evolvent.parts.joint_sides import (
    NOTHING,
    Held,
    Side,
    across,
    all_slopes,
    clamped,
    clamped_bodies,
    direction_side,
    fixed_direction,
    hinged,
    point_side,
    relative_coordinate,
    side_of,
)
from evolvent.parts.law import PathDrive
from evolvent.parts.release import ReleaseName, release_fields
from evolvent.parts.thread_joint import check_type, fix_end
from evolvent_base import units
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError

__all__ = [
    "Joint", "PrescribedMotion", "PrescribedRotation", "Side", "add_row", "direction_side", "point_side"
]  # fmt: skip

_LEAST_OFF = 1e-6
#: Types of which b stays on a line or in a plane through a.
_SLIDING = ("prismatic", "cylindrical", "screw", "point-on-line", "in-plane")


#: Types that hold no rotation.
_FREE_TO_TURN = ("spherical", "distance", "point-on-line", "in-plane", "pulley")
#: Types that keep a length, of points that are apart.
_ROPES = ("distance", "pulley")
#: Types that let nothing move.
CLAMPS = ("clamp", "fixed")


class Joint(Part):
    """A joint between two points of beams, bodies, point masses or the ground, in their positions at the start.

    Parameters
    ----------
    a, b : point
        Ends: "boom.root", "boom.tip" or "boom[5]" (a beam's node), "hub.left" (a point of a body), ("hub", (x, y, z)),
        "tether.tip" (the end of a thread, which has no rotation), a point mass, or a position on the ground. A body
        named alone, "hub", means its point where the other end is at the start; in a joint of type "distance" or
        "pulley" its origin.
    type : {"spherical", "revolute", "universal", "clamp", "fixed", "prismatic", "cylindrical", "screw", \
"point-on-line", "in-plane", "distance", "pulley"}
        spherical: the points coincide, all rotations are free. revolute: they coincide, with rotation about `axis`.
        universal: with rotations about `axis` of a and `axis_b` of b. clamp, or fixed: without rotation. prismatic: b
        slides along `axis`, without rotation. cylindrical: b slides along `axis` and rotates about it. screw: as
        cylindrical, and b travels by `pitch` a turn against a, both of them bodies. point-on-line, in-plane: b moves on
        the line through a along `axis`, or in the plane through a normal to `axis`, all rotations are free. distance:
        the distance of the points is constant. pulley: a cord from a over the point `over` to b keeps its length; it
        slides there without friction, and pushes where it would have to. Either way a, b and `over` are apart.
    axis : (3,) float
        Axis of the joint, inertial axes at the start; it is fixed to a.
    axis_b : (3,) float, optional
        Second axis of a universal joint, fixed to b, perpendicular to `axis`; inertial axes at the start.
    pitch : float, m, optional
        Travel of a screw a turn, positive of a right-handed thread.
    over : point, optional
        Of a pulley, whose radius is neglected.
    ratio : float, 1, optional
        Parts of the cord of a pulley between `over` and b, as of a tackle; 1 if left out.
    hold : {"section", "all"}
        Which coordinates of a beam's node a clamp constrains: the position and the rotation of the section, or all
        coordinates of the node, including the lengths of the slope vectors.
    position : (3,) float, m, optional
        Position of the joint at the start, inertial axes, where both ends are bodies without a point.
    stiffness : float, N/m and N m
        Above 0, a penalty in place of the constraint.
    rotational_stiffness : float, N m/rad, optional
        Of the penalties that hold directions; `stiffness` if left out.
    damping : float, N s/m and N m s
        Of the penalty.
    until : float, s, optional
        Time at which the joint is released; never if left out.
    released_by : str, optional
        `Event` that releases the joint, or spring of another joint whose latch does so when it locks.

    Notes
    -----
    A node of a cable has no twist: a joint constrains only its position and the direction of its axis. Nodes of two
    beams of 24-coordinate elements may be clamped at any angle; the moment acts on their sections. Constraints may be
    redundant, as in closed loops of hinges: the multipliers are then those of minimum norm (moments divided by the size
    of the system), and the run's message and statistics report the rank. Explicit methods refuse redundant constraints.
    A clamp does not constrain the lengths of the slope vectors, unless `hold` is "all": then shear, the strains of the
    section and the stretch of the axis vanish at the clamp.
    """

    applies: ClassVar[Applies] = {
        "axis": (one_of("type", "revolute", "universal", *_SLIDING),),
        "axis_b": (one_of("type", "universal"),),
        "pitch": (one_of("type", "screw"),),
        "over": (one_of("type", "pulley"),),
        "ratio": (one_of("type", "pulley"),),
        "hold": (one_of("type", *CLAMPS),),
        "position": (one_of("type", "spherical", "revolute", "universal", *CLAMPS, *_SLIDING),),
        "rotational_stiffness": (given("stiffness"),),
        "damping": (given("stiffness"),),
    }
    kind: Literal["joint"] = "joint"
    a: PointReference
    b: PointReference
    type: Literal[
        "spherical", "revolute", "universal", "clamp", "fixed", "prismatic", "cylindrical", "screw", "point-on-line",
        "in-plane", "distance", "pulley",
    ] = "spherical"  # fmt: skip
    axis: units.Direction = (0.0, 0.0, 1.0)
    axis_b: units.Direction | None = None
    pitch: units.Coordinate | None = None
    over: PointReference | None = None
    ratio: units.PositiveNumber | None = None
    hold: Literal["section", "all"] = "section"
    position: units.Position | None = None
    stiffness: units.StiffnessOrZero = 0.0
    rotational_stiffness: units.RotationalStiffnessOrZero | None = None
    damping: units.DampingOrZero = 0.0
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    def _ends(self, builder: Builder, name: str) -> tuple[Side, Side]:
        """Both ends; a body named alone takes the place of the other end, or `position`."""
        ends = [builder.location(self.a, f"{name}.a"), builder.location(self.b, f"{name}.b")]
        if self.type != "pulley" and ends[0].family == ends[1].family == "bodies" and ends[0].row == ends[1].row:
            raise InputError(f"{name}.a and {name}.b are on one body, {self.a!r}; a joint needs two parts")
        if ends[0].iq >= 0 and ends[0].iq == ends[1].iq:
            raise InputError(f"{name}.a and {name}.b are both {self.a!r}; a joint needs two points")
        if self.type in _ROPES:
            if self.position is not None:
                raise InputError(f"{name}.position is given; a joint of type {self.type!r} has no position")
            return side_of(ends[0]), side_of(ends[1])
        alone = [end.alone for end in ends]
        if self.position is not None and not any(alone):
            raise InputError(f"{name}.position is given, but {name}.a and {name}.b already define where the joint is")
        if self.position is None and all(alone):
            raise InputError(
                f"{name}.a and {name}.b are both bodies named alone, {self.a!r} and {self.b!r}; give {name}.position "
                f"(inertial axes, at the start), or a point of one of them, such as {[self.a, [0, 0, 1]]!r}"
            )
        found = []
        for end, other in zip(ends, reversed(ends), strict=True):
            if end.alone:
                x = other.x if self.position is None else np.array(self.position)
                pose = builder.poses[end.row]
                end = end._replace(x=x, local=product(pose.R.T, x - pose.x))
            found.append(side_of(end))
        return found[0], found[1]

    def write(self, builder: Builder, name: str) -> None:
        """Write the joint's scalar constraints into the family `joints`; or fix the end of a thread."""
        check_type(builder, name, self, turns=self.type in _FREE_TO_TURN)
        if fix_end(builder, name, self):
            return
        a, b = self._ends(builder, name)
        swaps = self.type not in ("point-on-line", "in-plane", "universal", "pulley")
        if swaps and a.on == sides.ON_COORDINATES and b.on == sides.ON_BODY:
            a, b = b, a
        common = {"stiffness": self.stiffness, "damping": self.damping, **release_fields(builder, name, self)}
        builder.names[name] = ("joints", len(builder.rows["joints"]))
        for key in ("axis_b", "pitch", "over", "ratio"):
            of = self.applies[key][0].values[0]
            if getattr(self, key) is not None and self.type != of:
                raise InputError(f"{name}.{key} is given, but {name}.type is {self.type!r}, not {of!r}")
        apart, axis = norm(b.u - a.u), unit(self.axis)
        if self.hold == "all" and (self.type not in CLAMPS or a.on != sides.ON_BODY or b.node is None):
            raise InputError(f"{name}.hold is 'all'; it needs a joint of type 'clamp' between a body and a beam's node")
        if self.type == "distance":
            if apart == 0.0:
                raise InputError(f"{name}: its two points coincide; a joint of type 'distance' needs a distance")
            add_row(builder, kernels.DISTANCE, a, b, value=apart, **common)
        elif self.type == "pulley":
            self._write_pulley(builder, name, a, b, common)
        elif self.type in _SLIDING:
            self._write_slide(builder, name, a, b, axis, common)
            if self.type == "screw":
                self._write_screw(builder, name, a, b, axis, common)
        else:
            if apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
                raise InputError(f"{name}: its two points are {apart:.6g} m apart at the start; they must coincide")
            for along in np.eye(3):
                add_row(builder, kernels.POINT, a, b, along=along, **common)
        if self.rotational_stiffness is not None:
            common["stiffness"] = self.rotational_stiffness
            if (self.rotational_stiffness > 0.0) != (self.stiffness > 0.0):
                raise InputError(
                    f"{name}.rotational_stiffness is {self.rotational_stiffness!r}, but {name}.stiffness is "
                    f"{self.stiffness!r}; both must be above 0 (a penalty), or both 0"
                )
        for held in self._directions(builder, name, a, b, axis):
            add_row(builder, held.kind, held.a, held.b, direction=held.along, value=held.value, **common)

    def _write_slide(
        self, builder: Builder, name: str, a: Side, b: Side, axis: np.ndarray, common: dict[str, Any]
    ) -> None:
        """Rows that keep b on a line or in a plane that is fixed to a."""
        key, off = f"{name}.type is {self.type!r}", b.u - a.u
        if self.type == "in-plane":
            off, what = dot(off, axis) * axis, "plane"
        else:
            off, what = off - dot(off, axis) * axis, "line"
        apart = norm(off)
        if self.type != "prismatic" and apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
            raise InputError(f"{name}: b is {apart:.6g} m off the {what} at the start; it must be on it")
        for f in (axis,) if self.type == "in-plane" else across(axis):
            direction = fixed_direction(builder, key, a, f)
            add_row(builder, kernels.ALONG, a, b, direction=direction, value=dot(direction.u, b.u - a.u), **common)

    def _write_screw(
        self, builder: Builder, name: str, a: Side, b: Side, axis: np.ndarray, common: dict[str, Any]
    ) -> None:
        """The row that keeps the travel of b to its angle; whole turns of it are not counted."""
        if self.pitch is None or self.pitch == 0.0:
            raise InputError(f"{name}.pitch is {self.pitch!r}; a screw joint needs its travel a turn, not 0")
        if any(side.on != sides.ON_BODY for side in (a, b)):
            raise InputError(f"{name}.type is 'screw'; it needs two bodies, not a node of a beam or a point mass")
        for kind, factor in ((axial.TRAVEL, 1.0), (axial.ANGLE, -self.pitch / (2.0 * math.pi))):
            fields = relative_coordinate(builder, kind, (a.body, b.body), axis, b.local)
            builder.add("gear_coordinates", factor=factor, **fields)
        last = len(builder.rows["gear_coordinates"])
        whole: dict[str, Any] = {"first": last - 2, "last": last, "radius": abs(self.pitch)}
        add_row(builder, kernels.GEAR, NOTHING, NOTHING, **whole, **common)

    def _write_pulley(self, builder: Builder, name: str, a: Side, b: Side, common: dict[str, Any]) -> None:
        """The row that keeps the length of a cord over a point."""
        if self.over is None:
            raise InputError(f"{name}.over is missing; the cord of a pulley runs over a point")
        over, length, ratio = point_side(builder, self.over, f"{name}.over"), 0.0, self.ratio or 1.0
        for key, end, parts in (("a", a, 1.0), ("b", b, ratio)):
            apart = norm(end.u - over.u)
            if apart == 0.0 or (over.on == sides.ON_BODY and over[:2] == end[:2]):
                what = "coincide at the start" if apart == 0.0 else "are on one body"
                raise InputError(f"{name}.{key} and {name}.over {what}; the cord of a pulley needs a free part there")
            length += parts * apart
        add_row(builder, gaps.PULLEY, a, b, direction=over, radius=ratio, value=length, **common)

    def _directions(self, builder: Builder, name: str, a: Side, b: Side, axis: np.ndarray) -> list[Held]:
        """Directions that the joint holds."""
        key = f"{name}.type is {self.type!r}"
        if self.type in ("revolute", "cylindrical", "screw"):
            return hinged(builder, key, a, b, axis)
        if self.hold == "all":
            return all_slopes(builder, a, b)
        if self.type in (*CLAMPS, "prismatic"):
            if a.on == sides.ON_BODY and b.on == sides.ON_BODY:
                return clamped_bodies(builder, a, b, axis)
            return clamped(builder, key, a, b)
        if self.type != "universal":
            return []
        if self.axis_b is None:
            raise InputError(f"{name}.axis_b is missing; a universal joint has two axes")
        other = unit(self.axis_b)
        if abs(float(axis @ other)) > 1e-6:
            raise InputError(
                f"{name}.axis_b is {self.axis_b!r}, which is not perpendicular to {name}.axis, {self.axis!r}"
            )
        return [Held(fixed_direction(builder, key, a, axis), fixed_direction(builder, key, b, other))]


def add_row(builder: Builder, kind: int, a: Side, b: Side, *, direction: Side = NOTHING, **fields: Any) -> int:
    """One scalar constraint."""
    zero, found = np.zeros(3), (a, b, direction)
    whole = {
        "along": zero, "centre": zero, "axis": zero, "zero": zero, "radius": 0.0, "value": 0.0, "path": kernels.STILL,
        "drive": 0, "law": 0, "first": 0, "last": 0, "stiffness": 0.0, "damping": 0.0, "until": math.inf,
        "event": -1, "switch": -1,
    }  # fmt: skip
    whole |= fields
    return builder.add(
        "joints",
        kind=kind,
        on=[side.on for side in found],
        index=[side.body for side in found],
        iq=[side.iq for side in found],
        iv=[side.iv for side in found],
        local=np.array([side.local for side in found]),
        **({"latest": whole["until"]} | whole),
    )


def _until(time: float | None) -> float:
    return math.inf if time is None else time


def _check_jumps(name: str, drive: DriveKind, until: float, unit: str) -> None:
    """Refuse a drive whose rate jumps under a constraint: it would take an infinite force."""
    if not isinstance(drive, RampDrive):
        return
    before = drive.rate
    for time, duration, rate in drive.steps:
        if duration == 0.0 and rate != before and 0.0 < time < until:
            raise InputError(
                f"{name}.drive jumps from {before:.6g} to {rate:.6g} {unit} at t = {time:.6g} s, which needs "
                "an infinite force; give the step of the RampDrive a duration above 0 s"
            )
        before = rate


class PrescribedRotation(Part):
    """A spinning body turned by a drive: its angle is that of the drive.

    Parameters
    ----------
    body : str
        A body with motion "spin".
    drive : a drive of `evolvent.parts`, rad
        Its rate must not jump.
    until : float, s, optional
        When the body turns free; never if left out.
    """

    kind: Literal["prescribed-rotation"] = "prescribed-rotation"
    body: BodyName
    drive: PathDrive
    until: units.Duration | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the row."""
        index = builder.find(self.body, "bodies")
        body = builder.rows["bodies"][index]
        if body["motion"] != rigid.SPIN:
            raise InputError(f"{name}.body is {self.body!r}; only a body with motion 'spin' can be turned")
        check_units(f"{name}.drive", self.drive, axial.ANGLE)
        drive, until = self.drive.write(builder, name), _until(self.until)
        _check_jumps(name, self.drive, until, "rad/s")
        side = Side(sides.ON_COORDINATES, index, body["iq"], body["iv"], np.zeros(3), np.zeros(3), None)
        path: dict[str, Any] = {
            "path": kernels.LINEAR,
            "drive": drive.kind,
            "law": drive.law,
            "first": drive.first,
            "last": drive.last,
        }
        row = add_row(builder, kernels.ANGLE, side, side, until=until, **path)
        builder.names[name] = ("joints", row)


class PrescribedMotion(Part):
    """A node of a beam, or a point mass, moved along a line or round an involute by a drive.

    Parameters
    ----------
    at : point
        "boom.tip", "boom[5]", or a point mass.
    drive : a drive of `evolvent.parts`
        Along a line, m; round an involute, the angle wound so far, rad. Its rate must not jump.
    direction : (3,) float
        Of the line, inertial axes; the point is held across it as well.
    radius : float, m
        Of the circle of an involute; 0 for a line.
    centre : (3,) float, m
        A point on the circle's axis, inertial axes.
    axis : (3,) float
        Of the circle, inertial axes.
    zero : (3,) float
        From the circle's centre to where the thread begins, inertial axes.
    length : float, m, optional
        Of the thread of an involute.
    until : float, s, optional
        When the point is released; never if left out.
    """

    applies: ClassVar[Applies] = {
        "direction": (left_out("radius"),),
        **{key: (given("radius"),) for key in ("centre", "axis", "zero", "length")},
    }
    kind: Literal["prescribed-motion"] = "prescribed-motion"
    at: PointReference
    drive: PathDrive
    direction: units.Direction = (1.0, 0.0, 0.0)
    radius: units.LengthOrZero = 0.0
    centre: units.Position = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)
    zero: units.Direction = (1.0, 0.0, 0.0)
    length: units.Length | None = None
    until: units.Duration | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write three rows."""
        b = point_side(builder, self.at, f"{name}.at")
        if b.on != sides.ON_COORDINATES:
            raise InputError(f"{name}.at is {self.at!r}; only a beam's node or a point mass can be moved so")
        check_units(f"{name}.drive", self.drive, axial.ANGLE if self.radius > 0.0 else axial.TRAVEL)
        drive, until = self.drive.write(builder, name), _until(self.until)
        _check_jumps(name, self.drive, until, "rad/s" if self.radius > 0.0 else "m/s")
        fields: dict[str, Any] = {"drive": drive.kind, "law": drive.law, "first": drive.first, "last": drive.last}
        fields["until"] = until
        builder.names[name] = ("joints", len(builder.rows["joints"]))
        if self.radius > 0.0:
            if self.length is None:
                raise InputError(f"{name}.length is missing; an involute needs the length of its thread")
            z, e = unit(self.axis), unit(self.zero)
            ground = Side(sides.ON_BODY, 0, -1, -1, np.zeros(3), np.zeros(3), None)
            for along in (e, np.cross(z, e), z):
                add_row(
                    builder, kernels.POINT, ground, b, along=along, centre=np.array(self.centre), axis=z, zero=e,
                    value=self.length, radius=self.radius, path=kernels.INVOLUTE, **fields,
                )  # fmt: skip
            return
        d = unit(self.direction)
        ground = Side(sides.ON_BODY, 0, -1, -1, b.u, b.u, None)
        add_row(builder, kernels.POINT, ground, b, along=d, radius=1.0, path=kernels.LINEAR, **fields)
        for other in across(d):
            add_row(builder, kernels.POINT, ground, b, along=other, until=until)
