"""Shapes by which parts touch: as what kernels take, on the body or point where they stand."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import body_gaps, surfaces
from evolvent.parts.shapes import Box, Capsule, Cylinder, Plane, Sphere
from evolvent_base.errors import InputError, counted

Array = np.ndarray
#: Distance of two centres beside the radius below which a contact has no normal.
NO_NORMAL = 1e-12
#: Shapes that beams touch, those that nodes of parts touch, and those of two bodies.
OF_BEAMS = (Sphere, Capsule, Cylinder, Plane)
OF_NODES = (*OF_BEAMS, Box)
OF_A, OF_B = (Sphere, Capsule, Box), (Sphere, Capsule, Plane, Box)


class Surface(NamedTuple):
    """A shape of a body: half length 0 of a sphere and of a plane, whose axis is its normal.

    `radius` is that of the shape with the clearance of what touches it, of a plane the clearance alone, 0 between
    bodies. Of a box between bodies it is that of its edges, and `sides` are its half sides, less this radius. `extent`
    (m) is what depths are compared with, `share` that of the points of a kind which can touch at the same time,
    `weight` that of the part's stiffness, `called` what messages call it.
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
    weight: float = 1.0
    called: str = ""


def surface_at(part: Any, builder: Builder, name: str, key: str, allowed: tuple[type, ...],
               needed: bool = False) -> Surface:  # fmt: skip
    """The shape at an end of a contact, `a` or `b`; of one that is left out that of its body.

    needed : whether a plane needs a clearance
    """
    where, own = (part.a[0], "shape_a") if key == "a" else (part.b, "shape")
    at, words = builder.location(where, f"{name}.{key}"), [f"a {one.__name__.lower()}" for one in allowed]
    if at.family != "bodies":
        raise InputError(f"{name}.{key} is {where!r}, which is not a point of a rigid body; give one, such as 'ball'")
    listed, shape = f"{', '.join(words[:-1])} or {words[-1]}", getattr(part, own)
    if shape is None:
        shape = getattr(builder.specs.get(where), "shape", None) if isinstance(where, str) else None
        if type(shape) not in allowed:
            raise InputError(
                f"{name}.{own} is left out, and {where!r} is not a body whose `shape` is {listed}; give one of these"
            )
    word = type(shape).__name__.lower()
    if type(shape) not in allowed:
        raise InputError(f"{name}.{own} is a {word}; it must be {listed}")
    found = Surface(at.row, at.local, surfaces.CAPSULE, called=word)
    if isinstance(shape, Plane):
        if needed and part.clearance == 0.0:
            raise InputError(
                f"{name}.clearance is 0; at a plane it must be above 0: half the thickness of {part.a[0]!r}"
            )
        return found._replace(kind=surfaces.PLANE, radius=part.clearance, axis=shape.normal)
    if isinstance(shape, Box):
        sides = 0.5 * np.array(shape.size)
        return found._replace(kind=body_gaps.BOX, sides=sides, radius=part.clearance, extent=float(sides.min()))
    radius = shape.radius + part.clearance
    if isinstance(shape, Sphere):
        return found._replace(radius=radius, extent=radius)
    if isinstance(shape, Cylinder):
        return found._replace(kind=surfaces.CYLINDER, radius=radius, half=0.5 * shape.span, axis=shape.axis)
    return found._replace(radius=radius, half=0.5 * shape.length, axis=shape.axis, extent=radius)


def check_skip(part: Any, name: str, owner: Any, count: int) -> None:
    """Refuse a contact that leaves out all contact points of a beam or rod."""
    if part.skip >= count:
        raise InputError(f"{name}.skip is {part.skip}; {owner!r} has {counted(count, 'contact point')}, give less")
