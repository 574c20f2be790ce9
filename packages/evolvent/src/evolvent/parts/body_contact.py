"""Contact between two rigid bodies: spheres, capsules, boxes and planes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import body_gaps, surfaces
from evolvent.parts.base import PointReference, unit
from evolvent.parts.contact import ContactLaw
from evolvent.parts.shapes import Box, Capsule, ContactShape, Plane, SolidContactShape, Sphere
from evolvent_base import units
from evolvent_base.errors import InputError, counted

Array = np.ndarray
#: Distance of two centres beside the radius below which a contact has no normal.
NO_NORMAL = 1e-12
#: Share of the corners of a box that can touch at the same time, of the edges along a capsule, and of pairs of edges.
_CORNERS, _ALONG, _CROSSINGS = 0.5, 0.5, 8.0 / 144.0
#: Radius of the edges of a box that meet those of another one, if not given, of its smallest side.
_ROUNDING = 0.1


class Surface(NamedTuple):
    """A shape of a body: half length 0 of a sphere and of a plane, radius 0 of a plane, whose axis is its normal.

    Of a box `radius` is that of its edges, and `sides` are its half sides, less this radius. `extent` (m) is what
    depths are compared with, `share` that of the points of a kind which can touch at the same time.
    """

    body: int
    place: Array
    kind: int
    radius: float = 0.0
    half: float = 0.0
    axis: Any = (0.0, 0.0, 1.0)
    sides: Any = (0.0, 0.0, 0.0)
    extent: float = 0.0
    share: float = 1.0


class BodyContact(ContactLaw):
    """Contact of two rigid bodies: a sphere, capsule or box of one with a sphere, capsule, plane or box of the other.

    Two capsules touch at one point, where their axes are closest. This point is not unique where the axes are parallel:
    replace one capsule by spheres along its axis, with a contact for each. A capsule touches a plane at two points, its
    ends. A box touches a plane with its eight corners, a sphere and the ends of a capsule with its faces, edges and
    corners, the side of a capsule with its edges, and another box with corners on faces and edges that cross; the
    `stiffness` is that of each of these points. Edges of two boxes that are within 10 degrees of parallel do not touch
    one another.

    Parameters
    ----------
    law : {"hunt-crossley", "conservative"}
        Law of the normal force as a function of the penetration depth.
    a, b : str, (str, (3,) float) or (3,) float
        Centres of the shapes, or a point of the plane: points of bodies, such as "ball", "arm.tip" or
        ("arm", (0, 0, 1)), or positions on the ground.
    shape_a : sphere, capsule or box, optional
        Shape centred at `a`; the `shape` of its body if left out, which must then be one of these. A box along the
        axes of its body, which needs a plane or a box as `shape_b`.
    shape_b : sphere, capsule, plane or box, optional
        Shape at `b`, likewise.
    rounding : float, m, optional
        Radius of the edges and corners of boxes, within their size. Left out, a tenth of the smallest side between two
        boxes, which need one, else 0. Edges of two boxes are not seen deeper than both radii.
    initial_overlap : float
        Depth, in radii of `shape_a` (of a box, half its smallest side), up to which the shapes may overlap at the
        start.
    """

    kind: Literal["body-contact"] = "body-contact"
    law: Literal["hunt-crossley", "conservative"] = "hunt-crossley"
    a: PointReference
    b: PointReference
    shape_a: SolidContactShape | None = None
    shape_b: ContactShape | None = None
    rounding: units.LengthOrZero | None = None
    initial_overlap: units.NumberOrZero = 0.1

    def write(self, builder: Builder, name: str) -> None:
        """Write the points at which the bodies may touch."""
        a, b = (self._surface(builder, name, key) for key in ("a", "b"))
        if a.body == b.body:
            raise InputError(
                f"{name!r} is a contact of a body with itself: a is {self.a!r} and b is {self.b!r}; give points of two "
                f"bodies"
            )
        a, b = self._rounded(name, a, b)
        if a.kind == body_gaps.BOX and b.kind == surfaces.CAPSULE:
            raise InputError(
                f"{name}.shape_b is a {'capsule' if b.half > 0.0 else 'sphere'} and {name}.shape_a a box; give the box "
                f"as b, and the other one as a"
            )
        add_body_contacts(self, builder, name, _pairs(a, b))

    def _rounded(self, name: str, a: Surface, b: Surface) -> tuple[Surface, Surface]:
        """Both shapes, boxes with the radius of their edges."""
        boxes = [side for side in (a, b) if side.kind == body_gaps.BOX]
        if self.rounding is not None and not boxes:
            raise InputError(
                f"{name}.rounding is given, but neither shape is a box, whose edges it rounds; leave it out"
            )
        found = []
        for side in (a, b):
            if side.kind == body_gaps.BOX:
                radius = self.rounding
                if radius is None:
                    radius = 2.0 * _ROUNDING * side.extent if len(boxes) == 2 else 0.0
                if radius == 0.0 and len(boxes) == 2:
                    raise InputError(
                        f"{name}.rounding is 0; it must be above 0 between two boxes, or left out, for which it is a "
                        f"tenth of the smallest side"
                    )
                if radius >= side.extent:
                    raise InputError(
                        f"{name}.rounding is {radius:g} m; it must be below half the smallest side of a box, "
                        f"{side.extent:g} m"
                    )
                side = side._replace(radius=radius, sides=side.sides - radius)
            found.append(side)
        return found[0], found[1]

    def _surface(self, builder: Builder, name: str, key: str) -> Surface:
        """The shape of one side."""
        where, shape = getattr(self, key), getattr(self, f"shape_{key}")
        at = builder.location(where, f"{name}.{key}")
        if at.family != "bodies":
            raise InputError(
                f"{name}.{key} is {where!r}, which is not a point of a rigid body; give one, such as 'ball'"
            )
        if shape is None:
            shape = getattr(builder.specs.get(where), "shape", None) if isinstance(where, str) else None
        if isinstance(shape, Sphere):
            return Surface(at.row, at.local, surfaces.CAPSULE, shape.radius, extent=shape.radius)
        if isinstance(shape, Capsule):
            half = 0.5 * shape.length
            return Surface(at.row, at.local, surfaces.CAPSULE, shape.radius, half, shape.axis, extent=shape.radius)
        if isinstance(shape, Box):
            sides = 0.5 * np.array(shape.size)
            return Surface(at.row, at.local, body_gaps.BOX, sides=sides, extent=float(sides.min()))
        if isinstance(shape, Plane):
            return Surface(at.row, at.local, surfaces.PLANE, axis=shape.normal)
        allowed = "a sphere, a capsule or a box" if key == "a" else "a sphere, a capsule, a plane or a box"
        raise InputError(
            f"{name}.shape_{key} is left out, and {where!r} is not a body whose `shape` is a sphere, a capsule or "
            f"a box; give {allowed}"
        )


def _pairs(a: Surface, b: Surface) -> list[tuple[Surface, Surface]]:
    """Places at which two shapes may touch: a point or segment of one, and what it touches of the other."""
    if b.kind == surfaces.CAPSULE:
        return [(a, b)]
    found = [(point, b) for point in _points(a)]
    if b.kind == surfaces.PLANE:
        return found
    if a.kind == surfaces.CAPSULE:
        return found + [(a._replace(share=_ALONG), edge) for edge in (_edges(b) if a.half > 0.0 else ())]
    found += [(point, a) for point in _points(b)]
    end = a.radius + b.radius  # beyond which corners touch
    for first, second in itertools.product(_edges(a), _edges(b)):
        if min(first.half, second.half) > end:
            first = first._replace(half=first.half - end, share=_CROSSINGS)
            found.append((first, second._replace(kind=body_gaps.EDGES, half=second.half - end)))
    return found


def _points(shape: Surface) -> list[Surface]:
    """Spheres by which a shape touches a face: itself, the ends of a capsule, the corners of a box."""
    point = shape._replace(kind=surfaces.CAPSULE, half=0.0)
    if shape.kind == body_gaps.BOX:
        corners = itertools.product((-1.0, 1.0), repeat=3)
        return [point._replace(place=shape.place + shape.sides * signs, share=_CORNERS) for signs in corners]
    axis = shape.half * unit(shape.axis)
    ends = (-1.0, 1.0) if shape.half > 0.0 else (0.0,)
    return [point._replace(place=shape.place + side * axis) for side in ends]


def _edges(box: Surface) -> list[Surface]:
    """The twelve edges of a box, as capsules."""
    found = []
    for i in range(3):
        for signs in itertools.product((-1.0, 1.0), repeat=2):
            place = box.place + box.sides * np.insert(signs, i, 0.0)
            found.append(
                box._replace(kind=surfaces.CAPSULE, place=place, half=float(box.sides[i]), axis=tuple(np.eye(3)[i]))
            )
    return found


def add_body_contacts(
    part: ContactLaw,
    builder: Builder,
    name: str,
    pairs: Sequence[tuple[Surface, Surface]],
) -> None:
    """Write contact points of a part, each between a sphere or capsule and any surface of another body.

    At the start they may overlap by `part.initial_overlap` extents of the first surface (of the second for a point).
    """
    allowed = float(getattr(part, "initial_overlap", 0.0))
    first = len(builder.rows["body_contacts"])
    for a, b in pairs:
        depth, radius = -start_gap(builder, a, b), a.extent or a.radius or b.radius
        if depth > allowed * radius:
            raise InputError(
                f"{name!r} starts with its bodies {depth:.3g} m inside each other, "
                f"{counted(depth / radius, 'radius', 'radii')}; move "
                f"them apart, or allow it by `initial_overlap`, now {allowed:g}"
            )
        if b.kind not in (surfaces.PLANE, body_gaps.BOX) and depth >= (1.0 - NO_NORMAL) * (a.radius + b.radius) > 0.0:
            raise InputError(
                f"{name!r} starts with the centre or axis of one body on that of the other, where the force of the "
                f"contact has no direction; move them apart"
            )
        builder.add(
            "body_contacts", a=a.body, b=b.body, first=first, surface=b.kind, place_a=a.place, axis_a=unit(a.axis),
            half_a=a.half, place_b=b.place, axis_b=unit(b.axis), half_b=b.half, sides=b.sides, radius_a=a.radius,
            radius=a.radius + b.radius, extent=radius, share=a.share,
            viscous=part.viscosity(float(builder.rows["bodies"][a.body]["mass"])), **part.law_fields(),
        )  # fmt: skip
    builder.names[name] = ("body_contacts", first)


def start_gap(builder: Builder, a: Surface, b: Surface) -> float:
    """Gap of two surfaces as the bodies stand at the start, m."""
    poses = builder.poses[a.body], builder.poses[b.body]
    d = poses[0].x + poses[0].R @ a.place - poses[1].x - poses[1].R @ b.place
    e, g = (pose.R @ unit(side.axis) for pose, side in zip(poses, (a, b), strict=True))
    if b.kind == surfaces.PLANE:
        return float(d @ g) - a.radius - b.radius
    if b.kind == body_gaps.BOX:
        return float(body_gaps.box_distance(*(d @ poses[1].R), *b.sides)[0]) - a.radius - b.radius
    s, t = body_gaps.closest_positions(d @ e, d @ g, e @ g, a.half, b.half)
    gap = float(np.linalg.norm(d + s * e - t * g)) - a.radius - b.radius
    return gap + (body_gaps.fade(e @ g, a.radius + b.radius) if b.kind == body_gaps.EDGES else 0.0)
