"""What holds beams, bodies and points together, and drives them: constraints, or penalties in their place."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError, nearest
from evolvent.kernels import flexible, rigid, sides
from evolvent.kernels import joint as kernels
from evolvent.parts.beam import node_of
from evolvent.parts.checks import not_negative, number, positive, unit_vector, vector
from evolvent.parts.drive import DriveKind, RampDrive

KINDS = ("point", "hinge", "clamp", "distance")
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


def place_side(builder: Builder, where: Any) -> Side:
    """The side of a place: a point's or body's name, (body, place in its axes), (beam, node), a place on the ground."""
    if isinstance(where, tuple | list) and len(where) == 2 and builder.names.get(where[0], ("",))[0] == "beams":
        _, kind, iq, iv = node_of(builder, where)
        u = np.array(builder.q[iq : iq + 3])
        return Side(sides.ON_COORDINATES, -1, iq, iv, np.zeros(3), u, (kind, iq))
    row = builder.rows["markers"][builder.marker(where)]
    builder.rows["markers"].pop()
    if row["kind"] == 1:  # a point
        point = builder.rows["points"][row["index"]]
        u = np.array(builder.q[point["iq"] :][:3])
        return Side(sides.ON_COORDINATES, -1, point["iq"], point["iv"], np.zeros(3), u, None)
    pose = builder.poses[row["index"]]
    return Side(sides.ON_BODY, row["index"], -1, -1, row["local"], pose.x + pose.R @ row["local"], None)


def direction_side(builder: Builder, index: int, direction: np.ndarray) -> Side:
    """A direction (inertial axes at the start) that is fixed to a body."""
    local = builder.poses[index].R.T @ direction
    return Side(sides.ON_BODY, index, -1, -1, local, direction, None)


def _slope(builder: Builder, node: Side, which: int) -> Side:
    """A node's slope vector: 1 along the axis, 2 and 3 across."""
    iq, iv = node.iq + 3 * which, node.iv + 3 * which
    return Side(sides.ON_COORDINATES, -1, iq, iv, np.zeros(3), np.array(builder.q[iq : iq + 3]), None)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Joint:
    """A joint between two places: of beams' nodes, bodies, points or the ground.

    Parameters
    ----------
    a, b : str, (str, (3,) float), (str, "root" | "tip" | int) or (3,) float
        A point's or body's name, a body's name with a place in its axes, a beam's name with a node, a place on the
        ground. The joint holds how the two stand at the start.
    kind : {"point", "hinge", "clamp", "distance"}
        Places coincide; so, and turn about `axis` only; so, and do not turn; places keep their distance.
    axis : (3,) float, of a hinge, inertial axes at the start
    stiffness : float, N/m and N m; above 0, a penalty in place of the constraint
    turn_stiffness : float, N m, optional, of the penalties that hold directions; `stiffness` if left out
    damping : float, N s/m and N m s, of the penalty
    until : float, s, when the joint is released

    Notes
    -----
    Of a cable only the direction of its axis can be held; it has no twist. A clamp leaves the length of slopes free.
    """

    a: Any
    b: Any
    kind: str = "point"
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    stiffness: float = 0.0
    turn_stiffness: float | None = None
    damping: float = 0.0
    until: float = math.inf

    def write(self, builder: Builder, name: str) -> None:
        """Write the joint's scalar constraints into the family `joints`."""
        if self.kind not in KINDS:
            raise InputError(f"{name}.kind is {self.kind!r}; {nearest(str(self.kind), KINDS)}")
        _check_until(name, self.until)
        a, b = place_side(builder, self.a), place_side(builder, self.b)
        if a.on == sides.ON_COORDINATES and b.on == sides.ON_BODY:
            a, b = b, a
        common = {
            "stiffness": not_negative(f"{name}.stiffness", self.stiffness),
            "damping": not_negative(f"{name}.damping", self.damping),
            "until": float(self.until),
        }
        first = len(builder.rows["joints"])
        builder.names[name] = ("joints", first)
        if self.kind == "distance":
            length = float(np.linalg.norm(b.u - a.u))
            if length == 0.0:
                raise InputError(f"{name}: its two places coincide; a joint of kind 'distance' needs them apart")
            add_row(builder, kernels.DISTANCE, a, b, value=length, **common)
            return
        apart = float(np.linalg.norm(b.u - a.u))
        if apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
            raise InputError(f"{name}: its two places are {apart:.6g} m apart at the start; they must coincide")
        for along in np.eye(3):
            add_row(builder, kernels.PLACE, a, b, along=along, **common)
        if self.kind == "point":
            return
        axis = unit_vector(f"{name}.axis", self.axis)
        if self.turn_stiffness is not None:
            common["stiffness"] = not_negative(f"{name}.turn_stiffness", self.turn_stiffness)
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
        if a.on == sides.ON_COORDINATES and b.node is not None and a.node is not None:
            raise InputError(f"{name}: a {self.kind} between two beams is not known; join each to a body")
        if b.on == sides.ON_COORDINATES and b.node is None:
            raise InputError(f"{name}: a point has no directions; a {self.kind} needs a body or a beam")
        body = a.body
        if b.node is not None:
            along = _slope(builder, b, 1)
            e1 = along.u / np.linalg.norm(along.u)
            if self.kind == "hinge" and b.node[0] == flexible.CABLE:
                return [(direction_side(builder, body, axis), along)]
            if self.kind == "hinge":  # of its section, as for a clamp below
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
        if self.kind == "clamp":
            held.append((direction_side(builder, body, f2), direction_side(builder, b.body, f3)))
        return held


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
        "feed": 0, "law": 0, "first": 0, "last": 0, "stiffness": 0.0, "damping": 0.0, "until": math.inf,
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


def _check_until(name: str, until: Any) -> None:
    if isinstance(until, str) or not until > 0.0:
        raise InputError(f"{name}.until is {until!r}; it must be a time above 0 s")


def _check_jumps(name: str, feed: DriveKind, until: float, unit: str) -> None:
    """Refuse a feed whose rate jumps under a constraint: it would take an infinite force."""
    if not isinstance(feed, RampDrive):
        return
    before = feed.rate
    for time, duration, rate in feed.steps:
        if duration == 0.0 and rate != before and 0.0 < time < until:
            raise InputError(
                f"{name}.feed jumps from {before:.6g} to {rate:.6g} {unit} at t = {time:.6g} s, for which what is held "
                f"to it needs an infinite force; give the step of the RampDrive a duration above 0 s"
            )
        before = rate


@dataclasses.dataclass(frozen=True, kw_only=True)
class Turn:
    """A spinning body turned by a feed law: its angle is that of the feed.

    Parameters
    ----------
    body : str, with motion "spin"
    feed : a feed of `evolvent.parts`, rad; its rate must not jump
    until : float, s, when the body turns free
    """

    body: str
    feed: DriveKind
    until: float = math.inf

    def write(self, builder: Builder, name: str) -> None:
        """Write the row."""
        index = builder.find(self.body, "bodies")
        body = builder.rows["bodies"][index]
        if body["motion"] != rigid.SPIN:
            raise InputError(f"{name}.body is {self.body!r}; only a body with motion 'spin' can be turned")
        feed = self.feed.write(builder, name)
        _check_until(name, self.until)
        _check_jumps(name, self.feed, float(self.until), "rad/s")
        side = Side(sides.ON_COORDINATES, index, body["iq"], body["iv"], np.zeros(3), np.zeros(3), None)
        path = {"path": kernels.LINEAR, "feed": feed.kind, "law": feed.law, "first": feed.first, "last": feed.last}
        row = add_row(builder, kernels.ANGLE, side, side, until=float(self.until), **path)
        builder.names[name] = ("joints", row)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Carry:
    """A place (a beam's node or a point) carried along a line or round an involute by a feed law.

    Parameters
    ----------
    what : as the ends of a `Joint`
    feed : a feed of `evolvent.parts`
        Along a line, m; round an involute, the angle wound so far, rad. Its rate must not jump.
    direction : (3,) float, of the line, inertial axes; the place is held across it as well
    radius, centre, axis, zero, length : float and (3,) float, optional
        Of an involute (`radius` above 0): the circle's radius (m), a point and the direction of its axis, the direction
        from its centre to where the thread begins, and the thread's length (m).
    until : float, s, when the place is released
    """

    what: Any
    feed: DriveKind
    direction: Sequence[float] = (1.0, 0.0, 0.0)
    radius: float = 0.0
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    zero: Sequence[float] = (1.0, 0.0, 0.0)
    length: float = 0.0
    until: float = math.inf

    def write(self, builder: Builder, name: str) -> None:
        """Write three rows."""
        b = place_side(builder, self.what)
        if b.on != sides.ON_COORDINATES:
            raise InputError(f"{name}.what is {self.what!r}; only a beam's node or a point can be carried")
        feed = self.feed.write(builder, name)
        _check_until(name, self.until)
        _check_jumps(name, self.feed, float(self.until), "rad/s" if self.radius > 0.0 else "m/s")
        fields: dict[str, Any] = {"feed": feed.kind, "law": feed.law, "first": feed.first, "last": feed.last}
        fields["until"] = float(self.until)
        builder.names[name] = ("joints", len(builder.rows["joints"]))
        if self.radius > 0.0:
            z = unit_vector(f"{name}.axis", self.axis)
            e = unit_vector(f"{name}.zero", self.zero)
            centre = vector(f"{name}.centre", self.centre)
            length = positive(f"{name}.length", self.length)
            ground = Side(sides.ON_BODY, 0, -1, -1, np.zeros(3), np.zeros(3), None)
            for along in (e, np.cross(z, e), z):
                add_row(
                    builder, kernels.PLACE, ground, b, along=along, centre=centre, axis=z, zero=e, value=length,
                    radius=number(f"{name}.radius", self.radius), path=kernels.INVOLUTE, **fields,
                )  # fmt: skip
            return
        d = unit_vector(f"{name}.direction", self.direction)
        ground = Side(sides.ON_BODY, 0, -1, -1, b.u, b.u, None)
        add_row(builder, kernels.PLACE, ground, b, along=d, radius=1.0, path=kernels.LINEAR, **fields)
        for across in _across(d):
            add_row(builder, kernels.PLACE, ground, b, along=across, until=float(self.until))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hinge:
    """Spring, damper, stops and latch at the hinge by which a beam's end stands on a body.

    Parameters
    ----------
    body : str
    beam : (str, "root" | "tip" | int), the node
    axis : (3,) float, of the angle, inertial axes at the start
    zero : (3,) float, direction from which it counts, inertial axes at the start; the beam's own if left out
    stiffness, damping, rest : float, N m/rad, N m s/rad and rad
    low, high : float, rad, stops; stop : float, N m/rad, their stiffness
    latch : float, rad, optional, angle at which the hinge locks for good
    latch_stiffness, latch_damping : float, N m/rad and N m s/rad, of the lock

    Notes
    -----
    Of a cable the angle is that of its axis, of a beam that of its section, a quarter turn from the slope across it:
    what turns the axis passes moments on by the shear of half an element alone.
    """

    body: str
    beam: Any
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    zero: Sequence[float] | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    rest: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    stop: float = 0.0
    latch: float | None = None
    latch_stiffness: float = 0.0
    latch_damping: float = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the hinge."""
        index = builder.names["ground"][1] if self.body == "ground" else builder.find(self.body, "bodies")
        _, kind, iq, iv = node_of(builder, self.beam)
        R = builder.poses[index].R
        axis = unit_vector(f"{name}.axis", self.axis)
        slope = np.array(builder.q[iq + 3 : iq + 6])
        zero = slope / np.linalg.norm(slope) if self.zero is None else unit_vector(f"{name}.zero", self.zero)
        if abs(zero @ axis) > 1e-6:
            raise InputError(f"{name}.zero is {tuple(zero)!r}; it must be across the axis")
        zero = zero - (zero @ axis) * axis
        zero /= np.linalg.norm(zero)
        if self.low > self.high:
            raise InputError(f"{name}.low is {self.low!r} rad, above {name}.high, {self.high!r} rad")
        if (math.isfinite(self.low) or math.isfinite(self.high)) and self.stop <= 0.0:
            raise InputError(f"{name}.stop is {self.stop!r}; stops need a stiffness above 0 N m/rad")
        if self.latch is not None and self.latch_stiffness <= 0.0:
            raise InputError(f"{name}.latch_stiffness is {self.latch_stiffness!r}; a latch needs one above 0 N m/rad")
        which = 1
        if kind == flexible.BEAM:
            across = np.array(builder.q[iq + 6 : iq + 12]).reshape(2, 3)
            which = 2 + int(np.argmin(np.abs(across @ axis) / np.linalg.norm(across, axis=1)))
            quarter = np.cross(axis, zero)
            zero = quarter if across[which - 2] @ np.cross(axis, slope) > 0.0 else -quarter
            slope = across[which - 2]
        angle = math.atan2(slope @ np.cross(axis, zero), slope @ zero)
        latch = math.inf if self.latch is None else float(self.latch)
        found = builder.add(
            "hinges",
            body=index,
            iq=iq + 3 * which,
            iv=iv + 3 * which,
            axis=R.T @ axis,
            zero=R.T @ zero,
            stiffness=not_negative(f"{name}.stiffness", self.stiffness),
            damping=not_negative(f"{name}.damping", self.damping),
            rest=number(f"{name}.rest", self.rest),
            low=float(self.low),
            high=float(self.high),
            stop=not_negative(f"{name}.stop", self.stop),
            latch=latch,
            latch_stiffness=not_negative(f"{name}.latch_stiffness", self.latch_stiffness),
            latch_damping=not_negative(f"{name}.latch_damping", self.latch_damping),
            side=1.0 if angle > latch else -1.0,
        )
        builder.names[name] = ("hinges", found)
