"""Contact between two rigid bodies: spheres, capsules and planes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.base import units
from evolvent.base.errors import InputError, counted
from evolvent.kernels import surfaces
from evolvent.parts.base import PointReference, unit
from evolvent.parts.contact import ContactLaw
from evolvent.parts.shapes import Capsule, ContactShape, Plane, RoundShape, Sphere

Array = np.ndarray


class Surface(NamedTuple):
    """A shape of a body: half length 0 of a sphere and of a plane, radius 0 of a plane, whose axis is its normal."""

    body: int
    place: Array
    kind: int
    radius: float = 0.0
    half: float = 0.0
    axis: Any = (0.0, 0.0, 1.0)


class BodyContact(ContactLaw):
    """Contact of two rigid bodies: a sphere or capsule of one with a sphere, a capsule or a plane of the other.

    Two capsules touch at one point, where their axes are closest. This point is not unique where the axes are parallel:
    replace one capsule by spheres along its axis, with a contact for each. A capsule touches a plane at two points, its
    ends.

    Parameters
    ----------
    law : {"hunt-crossley", "conservative"}
        Law of the normal force as a function of the penetration depth.
    a, b : str, (str, (3,) float) or (3,) float
        Centres of the shapes, or a point of the plane: points of bodies, such as "ball", "arm.tip" or
        ("arm", (0, 0, 1)), or positions on the ground.
    shape_a : sphere or capsule, optional
        Shape centred at `a`; the `shape` of its body if left out, which must then be a sphere or a capsule.
    shape_b : sphere, capsule or plane, optional
        Shape at `b`, likewise.
    initial_overlap : float
        Depth, in radii of `shape_a`, up to which the shapes may overlap at the start.
    """

    kind: Literal["body-contact"] = "body-contact"
    law: Literal["hunt-crossley", "conservative"] = "hunt-crossley"
    a: PointReference
    b: PointReference
    shape_a: RoundShape | None = None
    shape_b: ContactShape | None = None
    initial_overlap: units.NumberOrZero = 0.1

    def write(self, builder: Builder, name: str) -> None:
        """Write the points at which the bodies may touch."""
        a, b = (self._surface(builder, name, key) for key in ("a", "b"))
        if a.body == b.body:
            raise InputError(
                f"{name!r} is a contact of a body with itself: a is {self.a!r} and b is {self.b!r}; give points of two "
                f"bodies"
            )
        ends = [a]
        if b.kind == surfaces.PLANE and a.half > 0.0:
            axis = a.half * unit(a.axis)
            ends = [a._replace(place=a.place + side * axis, half=0.0) for side in (-1.0, 1.0)]
        add_body_contacts(self, builder, name, [(end, b) for end in ends])

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
            return Surface(at.row, at.local, surfaces.CAPSULE, shape.radius)
        if isinstance(shape, Capsule):
            return Surface(at.row, at.local, surfaces.CAPSULE, shape.radius, 0.5 * shape.length, shape.axis)
        if isinstance(shape, Plane):
            return Surface(at.row, at.local, surfaces.PLANE, axis=shape.normal)
        allowed = "a sphere or a capsule" if key == "a" else "a sphere, a capsule or a plane"
        raise InputError(
            f"{name}.shape_{key} is left out, and {where!r} is not a body whose `shape` is a sphere or a capsule; give "
            f"{allowed}"
        )


def add_body_contacts(
    part: ContactLaw,
    builder: Builder,
    name: str,
    pairs: Sequence[tuple[Surface, Surface]],
) -> None:
    """Write contact points of a part, each between a sphere or capsule and any surface of another body.

    At the start they may overlap by `part.initial_overlap` radii of the first surface (of the second for a point).
    """
    allowed = float(getattr(part, "initial_overlap", 0.0))
    first = len(builder.rows["body_contacts"])
    for a, b in pairs:
        depth, radius = -start_gap(builder, a, b), a.radius if a.radius > 0.0 else b.radius
        if depth > allowed * radius:
            raise InputError(
                f"{name!r} starts with its bodies {depth:.3g} m inside each other, "
                f"{counted(depth / radius, 'radius', 'radii')}; move "
                f"them apart, or allow it by `initial_overlap`, now {allowed:g}"
            )
        builder.add(
            "body_contacts", a=a.body, b=b.body, first=first, surface=b.kind, place_a=a.place, axis_a=unit(a.axis),
            half_a=a.half, place_b=b.place, axis_b=unit(b.axis), half_b=b.half, radius_a=a.radius,
            radius=a.radius + b.radius, viscous=part.viscosity(float(builder.rows["bodies"][a.body]["mass"])),
            **part.law_fields(),
        )  # fmt: skip
    builder.names[name] = ("body_contacts", first)


def start_gap(builder: Builder, a: Surface, b: Surface) -> float:
    """Gap of two surfaces as the bodies stand at the start, m."""
    poses = builder.poses[a.body], builder.poses[b.body]
    d = poses[0].x + poses[0].R @ a.place - poses[1].x - poses[1].R @ b.place
    e, g = (pose.R @ unit(side.axis) for pose, side in zip(poses, (a, b), strict=True))
    if b.kind == surfaces.PLANE:
        return float(d @ g) - a.radius - b.radius
    s, t = surfaces.closest_positions(d @ e, d @ g, e @ g, a.half, b.half)
    return float(np.linalg.norm(d + s * e - t * g)) - a.radius - b.radius
