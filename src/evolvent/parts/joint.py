"""What holds beams, bodies and points together, and drives them: constraints, or penalties in their place."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import flexible, rigid, sides
from evolvent.kernels import joint as kernels
from evolvent.parts.base import BodyName, Part, Place, unit
from evolvent.parts.drive import DriveKind, RampDrive
from evolvent.parts.law import PathDrive
from evolvent.references import Location

_LEAST_OFF = 1e-6


class Side(NamedTuple):
    """One side: fields of the family `joints`, its vector at the start, and, of a node, its kind and places."""

    on: int
    body: int
    iq: int
    iv: int
    local: np.ndarray
    u: np.ndarray
    node: tuple[int, int] | None  # kind of beam, place of the node's first coordinate


def place_side(builder: Builder, where: Any, key: str = "a place") -> Side:
    """The side of a reference to a place (`Builder.place`)."""
    return _side(builder.place(where, key))


def _side(at: Location) -> Side:
    if at.family == "bodies":
        return Side(sides.ON_BODY, at.row, -1, -1, at.local, at.x, None)
    node = (at.beam, at.iq) if at.family == "beams" else None
    return Side(sides.ON_COORDINATES, -1, at.iq, at.iv, np.zeros(3), at.x, node)


def direction_side(builder: Builder, index: int, direction: np.ndarray) -> Side:
    """A direction (inertial axes at the start) that is fixed to a body."""
    local = builder.poses[index].R.T @ direction
    return Side(sides.ON_BODY, index, -1, -1, local, direction, None)


def _slope(builder: Builder, node: Side, which: int) -> Side:
    """A node's slope vector: 1 along the axis, 2 and 3 across."""
    iq, iv = node.iq + 3 * which, node.iv + 3 * which
    return Side(sides.ON_COORDINATES, -1, iq, iv, np.zeros(3), np.array(builder.q[iq : iq + 3]), None)


class Joint(Part):
    """A joint between two places of beams, bodies, points or the ground, which holds how they stand at the start.

    Parameters
    ----------
    a, b : place
        Ends: "boom.root", "boom.tip" or "boom[5]" (a beam's node), "hub.left" (a point of a body), ("hub", (x, y, z)),
        a point mass, or a position on the ground. A body named alone, "hub", means its point where the other end is at
        the start; in a joint of type "distance" its origin.
    type : {"spherical", "revolute", "clamp", "distance"}
        The places coincide; and turn about `axis` only; and do not turn; or they keep their distance.
    axis : (3,) float
        Of a revolute joint, inertial axes at the start.
    hold : {"section", "all"}
        What a clamp holds of a beam's node: the directions of its section, or all of the node's coordinates, lengths of
        slopes and the direction of the axis included.
    position : (3,) float, m, optional
        Where the joint is at the start, inertial axes, where both ends are bodies named alone.
    stiffness : float, N/m and N m
        Above 0, a penalty in place of the constraint.
    turn_stiffness : float, N m/rad, optional
        Of the penalties that hold directions; `stiffness` if left out.
    damping : float, N s/m and N m s
        Of the penalty.
    until : float, s, optional
        When the joint is released; never if left out.

    Notes
    -----
    Of a cable only the direction of its axis can be held; it has no twist. A clamp leaves the length of slopes free,
    unless `hold` is "all": at the clamp the section can then neither shear nor grow thicker, nor the axis stretch.
    """

    kind: Literal["joint"] = "joint"
    a: Place
    b: Place
    type: Literal["spherical", "revolute", "clamp", "distance"] = "spherical"
    axis: units.Direction = (0.0, 0.0, 1.0)
    hold: Literal["section", "all"] = "section"
    position: units.Position | None = None
    stiffness: units.StiffnessOrZero = 0.0
    turn_stiffness: units.RotationalStiffnessOrZero | None = None
    damping: units.DampingOrZero = 0.0
    until: units.Duration | None = None

    def _ends(self, builder: Builder, name: str) -> tuple[Side, Side]:
        """Both ends; a body named alone takes the place of the other end, or `position`."""
        ends = [builder.place(self.a, f"{name}.a"), builder.place(self.b, f"{name}.b")]
        if ends[0].family == "bodies" and ends[1].family == "bodies" and ends[0].row == ends[1].row:
            raise InputError(f"{name}.a and {name}.b are on one body, {self.a!r}; a joint needs two parts")
        if self.type == "distance":
            if self.position is not None:
                raise InputError(f"{name}.position is given; a joint of type 'distance' has no position")
            return _side(ends[0]), _side(ends[1])
        alone = [end.alone for end in ends]
        if self.position is not None and not any(alone):
            raise InputError(f"{name}.position is given, but {name}.a and {name}.b already say where the joint is")
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
                end = end._replace(x=x, local=pose.R.T @ (x - pose.x))
            found.append(_side(end))
        return found[0], found[1]

    def write(self, builder: Builder, name: str) -> None:
        """Write the joint's scalar constraints into the family `joints`."""
        a, b = self._ends(builder, name)
        if a.on == sides.ON_COORDINATES and b.on == sides.ON_BODY:
            a, b = b, a
        if self.hold == "all" and (self.type != "clamp" or a.on != sides.ON_BODY or b.node is None):
            raise InputError(
                f"{name}.hold is 'all'; that takes a joint of type 'clamp' between a body and a beam's node"
            )
        common = {"stiffness": self.stiffness, "damping": self.damping, "until": _until(self.until)}
        first = len(builder.rows["joints"])
        builder.names[name] = ("joints", first)
        if self.type == "distance":
            length = float(np.linalg.norm(b.u - a.u))
            if length == 0.0:
                raise InputError(f"{name}: its two places coincide; a joint of type 'distance' needs them apart")
            add_row(builder, kernels.DISTANCE, a, b, value=length, **common)
            return
        apart = float(np.linalg.norm(b.u - a.u))
        if apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
            raise InputError(f"{name}: its two places are {apart:.6g} m apart at the start; they must coincide")
        for along in np.eye(3):
            add_row(builder, kernels.PLACE, a, b, along=along, **common)
        if self.type == "spherical":
            return
        axis = unit(self.axis)
        if self.turn_stiffness is not None:
            common["stiffness"] = self.turn_stiffness
            if (common["stiffness"] > 0.0) != (self.stiffness > 0.0):
                raise InputError(
                    f"{name}.turn_stiffness is {self.turn_stiffness!r}, but {name}.stiffness is {self.stiffness!r}; "
                    f"both must be above 0 (a penalty), or both 0"
                )
        pairs = self._directions(builder, name, a, b, axis)
        for one, other in pairs:
            add_row(builder, kernels.DIRECTION, one, other, value=float(one.u @ other.u), **common)

    def _directions(self, builder: Builder, name: str, a: Side, b: Side, axis: np.ndarray) -> list[tuple[Side, Side]]:
        """Pairs of directions whose products the joint keeps."""
        if a.node is not None and b.node is not None:
            raise InputError(
                f"{name}.type is {self.type!r}, which two beams do not take yet; join each of them to a body, or take "
                f"type 'spherical'"
            )
        if a.on == sides.ON_COORDINATES or (b.on == sides.ON_COORDINATES and b.node is None):
            raise InputError(
                f"{name}.type is {self.type!r}, but a point mass has no directions; take type 'spherical', or a body "
                f"in its place"
            )
        body = a.body
        if self.hold == "all":
            return self._all_directions(builder, a, b)
        if b.node is not None:
            along = _slope(builder, b, 1)
            e1 = along.u / np.linalg.norm(along.u)
            if self.type == "revolute" and b.node[0] == flexible.CABLE:
                return [(direction_side(builder, body, axis), along)]
            if self.type == "revolute":  # of its section, as for a clamp below
                across = [_slope(builder, b, i) for i in (2, 3)]
                parallel = max(across, key=lambda s: abs(float(s.u @ axis)) / float(np.linalg.norm(s.u)))
                if abs(float(parallel.u @ axis)) > 0.99 * float(np.linalg.norm(parallel.u)):
                    held = [(direction_side(builder, body, f), parallel) for f in _across(axis)]
                    return [*held, (direction_side(builder, body, axis), across[0 if parallel is across[1] else 1])]
                # across an oblique axis both directions hold the same turn; the beam's axis holds the other one
                return [(direction_side(builder, body, axis), s) for s in (*across, along)]
            e2, e3 = _across(e1)
            if b.node[0] == flexible.BEAM:
                # its section: were the axis held, only the shear of half an element would pass moments on
                y, z = _slope(builder, b, 2), _slope(builder, b, 3)
                e3 = np.cross(e1, y.u) / np.linalg.norm(np.cross(e1, y.u))
                e2 = np.cross(z.u, e1) / np.linalg.norm(np.cross(z.u, e1))
                return [  # by both directions across: a torque on one alone would shear the section
                    (direction_side(builder, body, e1), y),
                    (direction_side(builder, body, e1), z),
                    (direction_side(builder, body, e3), y),
                    (direction_side(builder, body, e2), z),
                ]
            return [(direction_side(builder, body, e2), along), (direction_side(builder, body, e3), along)]
        f2, f3 = _across(axis)
        held = [(direction_side(builder, body, axis), direction_side(builder, b.body, f)) for f in (f2, f3)]
        if self.type == "clamp":
            held.append((direction_side(builder, body, f2), direction_side(builder, b.body, f3)))
        return held

    def _all_directions(self, builder: Builder, a: Side, b: Side) -> list[tuple[Side, Side]]:
        """Products of all components of a node's slopes with axes of the body that holds them."""
        kind = flexible.BEAM if b.node is None else b.node[0]
        slopes = [_slope(builder, b, i) for i in range(1, flexible.NODE_VECTORS[kind])]
        return [(direction_side(builder, a.body, e), slope) for slope in slopes for e in np.eye(3)]


def _across(e1: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across another; the second is z where that is possible."""
    z = np.array([0.0, 0.0, 1.0])
    e2 = np.cross(z, e1) if np.linalg.norm(np.cross(z, e1)) > 1e-6 else np.array([1.0, 0.0, 0.0])
    e2 = e2 - (e2 @ e1) * e1
    e2 /= np.linalg.norm(e2)
    return e2, np.cross(e1, e2)


def add_row(builder: Builder, kind: int, a: Side, b: Side, **fields: Any) -> int:
    """One scalar constraint."""
    zero = np.zeros(3)
    whole = {
        "along": zero, "centre": zero, "axis": zero, "zero": zero, "radius": 0.0, "value": 0.0, "path": kernels.STILL,
        "drive": 0, "law": 0, "first": 0, "last": 0, "stiffness": 0.0, "damping": 0.0, "until": math.inf,
    }  # fmt: skip
    return builder.add(
        "joints",
        kind=kind,
        on=(a.on, b.on),
        index=(a.body, b.body),
        iq=(a.iq, b.iq),
        iv=(a.iv, b.iv),
        local=np.array([a.local, b.local]),
        **{**whole, **fields},
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
        drive, until = self.drive.write(builder, name), _until(self.until)
        _check_jumps(name, self.drive, until, "rad/s")
        side = Side(sides.ON_COORDINATES, index, body["iq"], body["iv"], np.zeros(3), np.zeros(3), None)
        path = {"path": kernels.LINEAR, "drive": drive.kind, "law": drive.law, "first": drive.first, "last": drive.last}
        row = add_row(builder, kernels.ANGLE, side, side, until=until, **path)
        builder.names[name] = ("joints", row)


class PrescribedMotion(Part):
    """A node of a beam, or a point mass, moved along a line or round an involute by a drive.

    Parameters
    ----------
    at : place
        "boom.tip", "boom[5]", or a point mass.
    drive : a drive of `evolvent.parts`
        Along a line, m; round an involute, the angle wound so far, rad. Its rate must not jump.
    direction : (3,) float
        Of the line, inertial axes; the place is held across it as well.
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
        When the place is released; never if left out.
    """

    kind: Literal["prescribed-motion"] = "prescribed-motion"
    at: Place
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
        b = place_side(builder, self.at, f"{name}.at")
        if b.on != sides.ON_COORDINATES:
            raise InputError(f"{name}.at is {self.at!r}; only a beam's node or a point mass can be moved so")
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
                    builder, kernels.PLACE, ground, b, along=along, centre=np.array(self.centre), axis=z, zero=e,
                    value=self.length, radius=self.radius, path=kernels.INVOLUTE, **fields,
                )  # fmt: skip
            return
        d = unit(self.direction)
        ground = Side(sides.ON_BODY, 0, -1, -1, b.u, b.u, None)
        add_row(builder, kernels.PLACE, ground, b, along=d, radius=1.0, path=kernels.LINEAR, **fields)
        for across in _across(d):
            add_row(builder, kernels.PLACE, ground, b, along=across, until=until)
