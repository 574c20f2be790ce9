"""Sides of joints: points and directions on bodies, nodes of beams and points; pairs of constrained directions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location
from evolvent.families.joints import joint as kernels
from evolvent.kernels import ancf_beams, axial, sides
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError

Array = np.ndarray

#: Cosine of the angle between two sections above which they are joined as parallel ones.
_PARALLEL = 0.7


class Side(NamedTuple):
    """One side: fields of the family `joints`, its vector at the start, and, of a node, its kind and indices."""

    on: int
    body: int
    iq: int
    iv: int
    local: Array
    u: Array
    node: tuple[int, int] | None  # kind of beam, index of the node's first coordinate


#: No side, in place of the direction of rows that have none.
NOTHING = Side(sides.ON_NOTHING, -1, -1, -1, np.zeros(3), np.zeros(3), None)


class Held(NamedTuple):
    """A row that holds directions: the product of a and b, or that of their difference and `along`."""

    a: Side
    b: Side
    along: Side = NOTHING

    @property
    def kind(self) -> int:
        """Kind of the row."""
        return kernels.DIRECTION if self.along.on == sides.ON_NOTHING else kernels.ALONG

    @property
    def value(self) -> float:
        """Product at the start."""
        if self.kind == kernels.DIRECTION:
            return dot(self.a.u, self.b.u)
        return dot(self.along.u, self.b.u - self.a.u)


def side_of(at: Location) -> Side:
    """The side of a point."""
    if at.family == "bodies":
        return Side(sides.ON_BODY, at.row, -1, -1, at.local, at.x, None)
    node = (at.beam, at.iq) if at.family == "beams" else None
    return Side(sides.ON_COORDINATES, -1, at.iq, at.iv, np.zeros(3), at.x, node)


def point_side(builder: Builder, where: Any, key: str = "a point") -> Side:
    """The side of a reference to a point (`Builder.location`)."""
    return side_of(builder.location(where, key))


def ground_end(builder: Builder, name: str, joint: Any) -> Location:
    """Where `a` of a joint is, which must be on the ground."""
    found = builder.location(joint.a, f"{name}.a")
    if (found.family, found.row) != builder.names["ground"]:
        what = "with a drive" if joint.drive is not None else f"of type {joint.type!r}"
        raise InputError(f"{name}.a is {joint.a!r}; of a joint {what} it must be on the ground")
    return found


def direction_side(builder: Builder, index: int, direction: Array) -> Side:
    """A direction (inertial axes at the start) that is fixed to a body."""
    local = product(builder.poses[index].R.T, direction)
    return Side(sides.ON_BODY, index, -1, -1, local, direction, None)


def slope(builder: Builder, node: Side, which: int) -> Side:
    """A node's slope vector: 1 along the axis, 2 and 3 across."""
    iq, iv = node.iq + 3 * which, node.iv + 3 * which
    return Side(sides.ON_COORDINATES, -1, iq, iv, np.zeros(3), np.array(builder.q[iq : iq + 3]), None)


def node_direction(builder: Builder, node: Side, direction: Array) -> Side:
    """A direction (inertial axes at the start) that follows the slopes of a node of 24-coordinate elements."""
    slopes = np.array(builder.q[node.iq + 3 : node.iq + 12]).reshape(3, 3)
    across = np.cross(slopes[[1, 2, 0]], slopes[[2, 0, 1]])
    local = product(across, np.asarray(direction)) / dot(across[0], slopes[0])
    return Side(sides.ON_NODE, -1, node.iq + 3, node.iv + 3, local, np.array(direction), None)


def is_beam(side: Side) -> bool:
    """Whether a side is a node of 24-coordinate elements."""
    return side.node is not None and side.node[0] == ancf_beams.BEAM


def is_cable(side: Side) -> bool:
    """Whether a side is a node of a cable, without twist."""
    return side.node is not None and side.node[0] != ancf_beams.BEAM


def fixed_direction(builder: Builder, key: str, side: Side, direction: Array) -> Side:
    """A direction that is fixed to a side; refused where the side has none.

    Parameters
    ----------
    key : str, what the direction is needed for, such as "joint.type is 'prismatic'"
    """
    if side.on == sides.ON_BODY:
        return direction_side(builder, side.body, direction)
    if is_beam(side):
        return node_direction(builder, side, direction)
    if is_cable(side):
        axis = slope(builder, side, 1)
        if np.linalg.norm(np.cross(axis.u, direction)) <= 1e-6 * np.linalg.norm(axis.u):
            return axis
        raise InputError(f"{key}, but a node of a cable has no twist, only its own axis is fixed to it; use a Beam")
    raise InputError(f"{key}, but a point mass has no directions; use type 'spherical', or a body in its place")


def relative_coordinate(builder: Builder, kind: int, bodies: tuple[int, int], axis: Array, local: Array) -> Any:
    """Fields of an angle or travel of the second body against the first, in the family `gear_coordinates`.

    Parameters
    ----------
    kind : `axial.ANGLE` or `axial.TRAVEL`; axis : inertial axes at the start
    local : point of the second body that travels, its axes
    """
    first, second = (builder.poses[body] for body in bodies)
    fields = {"kind": kind, "body": bodies[0], "other": bodies[1], "axis": product(first.R.T, axis)}
    if kind == axial.TRAVEL:
        x = second.x + product(second.R, local)
        return {**fields, "local": local, "zero": product(first.R.T, x - first.x)}
    e = across(axis)[0]
    return {**fields, "zero": product(first.R.T, e), "local": product(second.R.T, e)}


def across(e1: Array) -> tuple[Array, Array]:
    """Two unit vectors across another; the second is z where that is possible."""
    z = np.array([0.0, 0.0, 1.0])
    e2 = np.cross(z, e1) if np.linalg.norm(np.cross(z, e1)) > 1e-6 else np.array([1.0, 0.0, 0.0])
    e2 = e2 - dot(e2, e1) * e1
    e2 /= norm(e2)
    return e2, np.cross(e1, e2)


# ------------------------------------------------------------------------------------------------ rotations


def clamped(builder: Builder, key: str, a: Side, b: Side) -> list[Held]:
    """Rows that hold b from turning against a."""
    if a.on == sides.ON_BODY and b.on == sides.ON_BODY:
        return clamped_bodies(builder, a, b, np.array([0.0, 0.0, 1.0]))
    if is_beam(a) and is_beam(b):
        return _clamped_sections(builder, a, b)
    if a.on == sides.ON_BODY and b.node is not None:
        return _clamped_to_body(builder, a.body, b)
    if is_cable(a) and (is_beam(b) or b.on == sides.ON_BODY):
        return [Held(h.b, h.a) for h in clamped(builder, key, b, a)]
    if is_beam(a) and is_cable(b):
        axis = slope(builder, b, 1)
        return [Held(node_direction(builder, a, e), axis) for e in across(axis.u / norm(axis.u))]
    if is_cable(a) and is_cable(b):
        raise InputError(f"{key}, but nodes of two cables have no twist to hold; use type 'spherical', or a Beam")
    raise InputError(f"{key}, but a point mass has no directions; use type 'spherical', or a body in its place")


def clamped_bodies(builder: Builder, a: Side, b: Side, f1: Array) -> list[Held]:
    """Products of three orthogonal directions of two bodies, the first of them f1."""
    f2, f3 = across(f1)
    pairs = ((f1, f2), (f1, f3), (f2, f3))
    return [Held(direction_side(builder, a.body, x), direction_side(builder, b.body, y)) for x, y in pairs]


def _clamped_to_body(builder: Builder, body: int, b: Side) -> list[Held]:
    """Rows that clamp a node of a beam to a body."""
    along = slope(builder, b, 1)
    e1 = along.u / norm(along.u)
    if not is_beam(b):
        return [Held(direction_side(builder, body, e), along) for e in across(e1)]
    # its section: were the axis held, only the shear of half an element would pass moments on
    y, z = slope(builder, b, 2), slope(builder, b, 3)
    e3 = np.cross(e1, y.u) / norm(np.cross(e1, y.u))
    e2 = np.cross(z.u, e1) / norm(np.cross(z.u, e1))
    # by both directions across: a torque on one alone would shear the section
    pairs = ((e1, y), (e1, z), (e3, y), (e2, z))
    return [Held(direction_side(builder, body, e), s) for e, s in pairs]


def all_slopes(builder: Builder, a: Side, b: Side) -> list[Held]:
    """Products of all components of the slopes of a node with axes of the body that holds them."""
    assert b.node is not None
    slopes = [slope(builder, b, i) for i in range(1, ancf_beams.NODE_VECTORS[b.node[0]])]
    return [Held(direction_side(builder, a.body, e), s) for s in slopes for e in np.eye(3)]


def _sections(builder: Builder, node: Side) -> tuple[Side, Side, Array]:
    """Directions across of a node of a beam, and the unit normal of its section."""
    y, z = slope(builder, node, 2), slope(builder, node, 3)
    n = np.cross(y.u, z.u)
    return y, z, n / norm(n)


def _clamped_sections(builder: Builder, a: Side, b: Side) -> list[Held]:
    """Rows that clamp two nodes of beams to one another.

    Notes
    -----
    Moments act on the sections, as at a body. For sections that are not parallel, three products of vectors of both
    constrain the three rotations: those of c, the common line of the sections, and of p, perpendicular to it. Where the
    sections are parallel, these products do not constrain a tilt; the difference of the vectors along the normal does,
    without a load on the axis. A torque acts on both directions of the section in equal parts, or on one where the
    shape of the section is constrained.
    """
    ya, za, na = _sections(builder, a)
    _, _, nb = _sections(builder, b)
    if abs(float(na @ nb)) > _PARALLEL:
        same_y, same_z = node_direction(builder, b, ya.u), node_direction(builder, b, za.u)
        own_y, own_z = node_direction(builder, a, ya.u), node_direction(builder, a, za.u)
        normal = node_direction(builder, a, na)
        return [
            Held(own_y, same_y, normal), Held(own_z, same_z, normal), Held(own_y, same_z), Held(own_z, same_y)
        ]  # fmt: skip
    c = np.cross(na, nb) / norm(np.cross(na, nb))
    ca, pa = node_direction(builder, a, c), node_direction(builder, a, np.cross(na, c))
    cb, pb = node_direction(builder, b, c), node_direction(builder, b, np.cross(nb, c))
    return [Held(pa, pb), Held(ca, pb), Held(pa, cb), Held(ca, pa), Held(cb, pb)]


def hinged(builder: Builder, key: str, a: Side, b: Side, axis: Array) -> list[Held]:
    """Rows that let b turn against a about an axis (inertial axes at the start) only."""
    if a.on == sides.ON_BODY and b.on == sides.ON_BODY:
        held = direction_side(builder, a.body, axis)
        return [Held(held, direction_side(builder, b.body, f)) for f in across(axis)]
    if is_beam(a) and is_beam(b):
        return _hinged_sections(builder, a, b, axis)
    if a.on == sides.ON_BODY and b.node is not None:
        return _hinged_to_body(builder, a.body, b, axis)
    if is_cable(a) and (is_beam(b) or b.on == sides.ON_BODY):
        return [Held(h.b, h.a) for h in hinged(builder, key, b, a, axis)]
    if is_beam(a) and is_cable(b):
        return [Held(node_direction(builder, a, axis), slope(builder, b, 1))]
    if is_cable(a) and is_cable(b):
        raise InputError(f"{key}, but nodes of two cables have no twist to hold; use type 'spherical', or a Beam")
    raise InputError(f"{key}, but a point mass has no directions; use type 'spherical', or a body in its place")


def _hinged_to_body(builder: Builder, body: int, b: Side, axis: Array) -> list[Held]:
    """Rows that hold a node of a beam on a hinge of a body."""
    along = slope(builder, b, 1)
    held = direction_side(builder, body, axis)
    if is_cable(b):
        return [Held(held, along)]
    both = [slope(builder, b, i) for i in (2, 3)]
    parallel = max(both, key=lambda s: abs(float(s.u @ axis)) / float(np.linalg.norm(s.u)))
    if abs(float(parallel.u @ axis)) > 0.99 * float(np.linalg.norm(parallel.u)):
        rows = [Held(direction_side(builder, body, f), parallel) for f in across(axis)]
        return [*rows, Held(held, both[0 if parallel is both[1] else 1])]
    # across an oblique axis both directions hold the same turn; the beam's axis holds the other one
    return [Held(held, s) for s in (*both, along)]


def _hinged_sections(builder: Builder, a: Side, b: Side, axis: Array) -> list[Held]:
    """Rows that hold two nodes of beams on a common hinge.

    Notes
    -----
    Both have a vector along the axis. The component of their difference perpendicular to it vanishes, so that only
    these two are loaded; the shape of the sections is constrained. Where the axis is normal to a section, the section
    stays perpendicular to the vector of the other node.
    """
    own, other = node_direction(builder, a, axis), node_direction(builder, b, axis)
    found = []
    for one, turned in ((a, other), (b, own)):
        y, z, n = _sections(builder, one)
        if abs(float(axis @ n)) > _PARALLEL:
            own_y, own_z = node_direction(builder, one, y.u), node_direction(builder, one, z.u)
            rows = [Held(own_y, turned), Held(own_z, turned)]
            return rows if one is a else [Held(row.b, row.a) for row in rows]
        found.append(Held(node_direction(builder, one, y.u), node_direction(builder, one, z.u)))
    return [Held(own, other, node_direction(builder, a, f)) for f in across(axis)] + found
