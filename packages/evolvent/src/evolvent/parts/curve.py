"""Stress-free shapes of beams and rods: arcs and helices of a constant curvature, and plane curves."""

from __future__ import annotations

from typing import Annotated, Any, Protocol

import numpy as np

from evolvent.elements import rods
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import OneOf, Section

__all__ = ["Parabola"]

Array = np.ndarray
#: Newton's iterations for the place on a parabola at an arc length; five are enough for round-off.
_ITERATIONS = 50


class Curve(Section):
    """A plane curve by arc length, which bends towards y of the section."""

    def plane(self, arc: Array) -> tuple[Array, Array]:
        """Positions (n, 2), m, along and across the tangent at the root, and angles (n,), rad, from that tangent."""
        raise NotImplementedError(f"{type(self).__name__} has no plane()")

    def curvature(self, arc: Array) -> Array:
        """Curvature (n,), 1/m, towards y, at arc lengths from the root (n,), m."""
        raise NotImplementedError(f"{type(self).__name__} has no curvature()")


class Parabola(Curve):
    """A parabola, such as the rib of a reflector.

    Parameters
    ----------
    focal_length : float, m
        f of y = x^2/(4 f).
    offset : float, m
        Place x of the root; 0 puts it at the vertex.

    Notes
    -----
    The arc from the vertex to x = 2 f u is f (u sqrt(1 + u^2) + asinh u), the slope of the tangent there u, and the
    curvature 1/(2 f (1 + u^2)^(3/2)).
    """

    focal_length: units.Length
    offset: units.Coordinate = 0.0

    def plane(self, arc: Array) -> tuple[Array, Array]:
        """As of `Curve`."""
        f, root = self.focal_length, self.offset / (2.0 * self.focal_length)

        def length(u: Array) -> Array:
            return f * (u * np.sqrt(1.0 + u * u) + np.arcsinh(u))

        signed = length(np.array(root)) + arc
        wanted = np.abs(signed)
        u = wanted / (2.0 * f)  # beyond the solution; the arc is convex in u, so that Newton's method goes down to it
        for _ in range(_ITERATIONS):
            step = (length(u) - wanted) / (2.0 * f * np.sqrt(1.0 + u * u))
            u = u - step
            if np.abs(step).max() <= 1e-15 * (1.0 + u.max()):
                break
        u = np.copysign(u, signed)
        x, y, angle = 2.0 * f * (u - root), f * (u * u - root * root), np.arctan(root)
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * x + s * y, c * y - s * x], axis=-1), np.arctan(u) - angle

    @property
    def root_angle(self) -> float:
        """Angle of the tangent at the root from that at the vertex, rad."""
        return float(np.arctan(self.offset / (2.0 * self.focal_length)))

    def curvature(self, arc: Array) -> Array:
        """As of `Curve`."""
        found: Array = np.cos(self.plane(arc)[1] + self.root_angle) ** 3 / (2.0 * self.focal_length)
        return found


AnyCurve = Annotated[Curve, OneOf({"parabola": Parabola})]


class Curved(Protocol):
    """A part with a stress-free shape of its own."""

    @property
    def curvature(self) -> units.Triple:
        """Twist per length and curvatures about y and z, 1/m."""

    @property
    def shape(self) -> Curve | None:
        """A shape in place of `curvature`."""

    @property
    def nodes(self) -> Any:
        """Nodes at the start, where they are stated."""

    @property
    def rest(self) -> str:
        """'start': without stress as it starts."""

    @property
    def arc(self) -> Array:
        """Lengths from the root to the nodes, m."""


def is_curved(part: Curved) -> bool:
    """Whether the keys `curvature` or `shape` give a stress-free shape that is not straight."""
    return part.shape is not None or any(part.curvature)


def check_curve(name: str, part: Curved) -> None:
    """Refuse two stress-free shapes: by `shape` and `curvature`, or by one of them and the nodes at the start."""
    if part.shape is not None and any(part.curvature):
        raise InputError(f"{name}.shape and {name}.curvature are both given; leave one of them out")
    if is_curved(part) and part.nodes is not None and part.rest == "start":
        key = "curvature" if part.shape is None else "shape"
        raise InputError(
            f"{name}.rest is 'start' and {name}.{key} is given as well; with {name}.nodes leave one of them out"
        )


def stress_free(part: Curved) -> tuple[Array, Array]:
    """Nodes of the stress-free shape: positions (n, 3), m, and axes (n, 3, 3) as columns, in the axes of the root."""
    arc = np.asarray(part.arc)
    if not is_curved(part):
        return np.outer(arc, [1.0, 0.0, 0.0]), np.tile(np.eye(3), (arc.size, 1, 1))
    if part.shape is None:
        each = [rods.advanced(np.array(part.curvature), float(s)) for s in arc]
        return np.array([x for x, _ in each]), np.array([R for _, R in each])
    flat, angle = part.shape.plane(arc)
    places = np.concatenate([flat, np.zeros((arc.size, 1))], axis=1)
    R = np.tile(np.eye(3), (arc.size, 1, 1))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0] = np.sin(angle)
    R[:, 0, 1] = -R[:, 1, 0]
    return places, R
