"""Contact points of rigid bodies - spheres, capsules, boxes and planes - and nodes that are bodies."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.contact.part_shapes import NO_NORMAL, OF_A, OF_B, OF_NODES, Surface, check_skip, surface_at
from evolvent.kernels import body_gaps, surfaces
from evolvent.model.questions import TouchPoint
from evolvent.model.registry import families
from evolvent.parts.base import unit
from evolvent_base.errors import InputError, counted

#: Share of the corners of a box that can touch at the same time, of the edges along a capsule, and of pairs of edges.
_CORNERS, _ALONG, _CROSSINGS = 0.5, 0.5, 8.0 / 144.0
#: Radius of the edges of a box that meet those of another one, if not given, of its smallest side.
_ROUNDING = 0.1


def add_nodes(part: Any, builder: Builder, name: str) -> None:
    """Write a surface that the nodes of parts touch."""
    points = {owner: _nodes_of(part, builder, name, str(owner)) for owner in part.a}
    thin = any(point.radius == 0.0 for own in points.values() for point in own)
    surface = surface_at(part, builder, name, "b", OF_NODES, needed=thin)
    if surface.kind == surfaces.CYLINDER:
        if math.isfinite(surface.half):
            kind = builder.specs[str(part.a[0])].kind
            raise InputError(
                f"{name}.shape is a cylinder with a length, but {name}.a holds the {kind} {part.a[0]!r}, for which "
                f"a cylinder has no ends; leave the length out, or use a capsule"
            )
        surface = surface._replace(kind=surfaces.CAPSULE)
    pairs = []
    for owner, own in points.items():
        _check_spacing(name, owner, own, surface)
        for one in own:
            sphere = Surface(one.body, one.place, surfaces.CAPSULE, radius=one.radius, weight=one.weight)
            pairs.append((sphere, surface))
    _add(part, builder, name, pairs, 1e-3 if thin else 0.1)


def _nodes_of(part: Any, builder: Builder, name: str, owner: str) -> list[TouchPoint]:
    """Points by which a part touches, less those that are skipped."""
    touches = families()[builder.names[owner][0]].parts.touches
    assert touches is not None
    found = list(touches(builder, owner))
    check_skip(part, name, owner, len(found))
    return found[part.skip :]


def _check_spacing(name: str, owner: Any, points: list[TouchPoint], surface: Surface) -> None:
    """Refuse a surface that passes between the points that touch it."""
    if surface.kind == surfaces.PLANE:
        return
    size = surface.radius + (float(np.median(surface.sides)) if surface.kind == body_gaps.BOX else 0.0)
    wide, spacing = 2.0 * (size + points[0].radius), points[0].spacing
    if wide < spacing:
        raise InputError(
            f"{name}.shape is a {surface.called} that is {wide:.3g} m wide with the thickness of {owner!r}, but nodes "
            f"by which {owner!r} touches it are {spacing:.3g} m apart; use more elements"
        )


def add_bodies(part: Any, builder: Builder, name: str) -> None:
    """Write the points at which two bodies may touch."""
    a, b = surface_at(part, builder, name, "a", OF_A), surface_at(part, builder, name, "b", OF_B)
    if a.body == b.body:
        raise InputError(
            f"{name!r} is a contact of a body with itself: a is {part.a[0]!r} and b is {part.b!r}; give points of two "
            f"bodies"
        )
    a, b = _rounded(part, name, a, b)
    if a.kind == body_gaps.BOX and b.kind == surfaces.CAPSULE:
        raise InputError(
            f"{name}.shape is a {b.called} and {name}.shape_a a box; give the box as b, and the other one as a"
        )
    _add(part, builder, name, _pairs(a, b), 0.1, viscous=0.0)


def _rounded(part: Any, name: str, a: Surface, b: Surface) -> tuple[Surface, Surface]:
    """Both shapes, boxes with the radius of their edges."""
    boxes = [side for side in (a, b) if side.kind == body_gaps.BOX]
    if part.rounding is not None and not boxes:
        raise InputError(f"{name}.rounding is given, but neither shape is a box, whose edges it rounds; leave it out")
    found = []
    for side in (a, b):
        if side.kind == body_gaps.BOX:
            radius = part.rounding
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


def _add(
    part: Any, builder: Builder, name: str, pairs: Sequence[tuple[Surface, Surface]], overlap: float,
    viscous: float | None = None,
) -> None:  # fmt: skip
    """Write contact points of a part, each between a sphere or capsule and any surface of another body.

    At the start they may overlap by `part.initial_overlap` extents of the first surface (of the second for a point),
    by `overlap` if it is left out; `viscous` follows from the first body's mass if left out.
    """
    allowed = overlap if part.initial_overlap is None else part.initial_overlap
    first = len(builder.rows["body_contacts"])
    for a, b in pairs:
        depth, radius = -start_gap(builder, a, b), a.extent or a.radius or b.radius
        if depth > allowed * radius:
            raise InputError(
                f"{name!r} starts with its bodies {depth:.3g} m inside each other, "
                f"{counted(depth / radius, 'radius', 'radii')}; move them apart, or allow it by `initial_overlap`, now "
                f"{allowed:g}"
            )
        if b.kind not in (surfaces.PLANE, body_gaps.BOX) and depth >= (1.0 - NO_NORMAL) * (a.radius + b.radius) > 0.0:
            raise InputError(
                f"{name!r} starts with the centre or axis of one body on that of the other, where the force of the "
                f"contact has no direction; move them apart"
            )
        slides = part.viscosity(float(builder.rows["bodies"][a.body]["mass"])) if viscous is None else viscous
        builder.add(
            "body_contacts", a=a.body, b=b.body, first=first, surface=b.kind, place_a=a.place, axis_a=unit(a.axis),
            half_a=a.half, place_b=b.place, axis_b=unit(b.axis), half_b=b.half, sides=b.sides, radius_a=a.radius,
            radius=a.radius + b.radius, extent=radius, share=a.share, viscous=slides,
            **part.law_fields(a.weight),
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
