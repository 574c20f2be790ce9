"""Rigid facets of a sheet that folds, and the hinges between them."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.elements.laminates import WallProperties
from evolvent.families.bodies.part import RigidBody
from evolvent.families.coordinates.part import JointSpring
from evolvent.families.coordinates.part_seam import Seam
from evolvent.families.joints.part import Joint
from evolvent.families.joints.part_pairs import write_pair
from evolvent.results.observe.variables import Variable, turned
from evolvent_base import units

Array = np.ndarray


class Facet(RigidBody):
    """A rigid body that is drawn as a polygon.

    Parameters
    ----------
    corners : (n, 3) float, m, body axes, counterclockwise about axis 3
    thickness : float, m
    """

    corners: tuple[units.Position, ...] = ()
    thickness: units.LengthOrZero = 0.0

    def observe(self, view: Any, name: str, found: Any) -> None:
        """Draw the polygon, in quadrilaterals from its first corner."""
        pose = view.pose(view.index(name))
        corners = pose.x[:, None] + np.stack([turned(pose.R, np.array(own)) for own in self.corners], axis=1)
        found.along("corner_position", "corner", corners, "m", "positions of the corners, inertial axes")
        normals = np.broadcast_to(pose.R[:, None, :, 2], corners.shape)
        found.along("corner_normal", "corner", normals, "1", "normal of the facet at its corners, inertial axes")
        n = len(self.corners)
        faces = [[0, k, k + 1, k + 2 if k + 2 < n else 0] for k in range(1, n - 1, 2)]
        text = "corners of the quadrilaterals of the facet"
        found.coordinates["facet_corners"] = Variable(("part", "of_four"), np.array(faces), "1", text)
        entry = {"points": "corner_position", "normals": "corner_normal", "faces": "facet_corners"}
        found.drawn = [{"quads": {**entry, "thickness": self.thickness}}]


class Hinge(Joint):
    """A joint of two facets, which the edges of these show."""

    symbol = ""


class NodeHinge(Joint):
    """A joint of two nodes of facets which others round their vertex already hold together: it holds directions alone.

    With its positions as well the joints round a vertex would repeat one another.
    """

    symbol = ""

    def write(self, builder: Builder, name: str) -> None:
        """Write the rows of directions."""
        self._check(name)
        write_pair(self, builder, name, meets=True)


class Fold(Seam):
    """A seam of two facets.

    Parameters
    ----------
    met : list of int, numbers of its nodes which others round their vertex already hold together
    """

    met: tuple[int, ...] = ()

    def _joint(self, k: int, **keys: Any) -> Joint:
        """The joint of a node."""
        return NodeHinge(**keys) if k in self.met else super()._joint(k, **keys)


class HingeSpring(JointSpring):
    """A spring of a hinge."""

    symbol = ""


def inertia_of(corners: Array, wall: WallProperties) -> tuple[float, Array, Array]:
    """Mass (kg), centre (2,) and inertia (3, 3) about it of a polygon (n, 2), m, in its axes and normal."""
    x, after = corners - corners[0], np.roll(corners - corners[0], -1, axis=0)
    cross = x[:, 0] * after[:, 1] - x[:, 1] * after[:, 0]
    area = 0.5 * float(cross.sum())
    centre = (x + after).T @ cross / (6.0 * area)
    second = np.einsum("n,nij->ij", cross, _moments(x, after)) - area * np.outer(centre, centre)
    inertia = np.zeros((3, 3))
    inertia[:2, :2] = wall.mass * (np.trace(second) * np.eye(2) - second) + wall.inertia * area * np.eye(2)
    inertia[2, 2] = inertia[0, 0] + inertia[1, 1]
    return wall.mass * area, corners[0] + centre, inertia


def _moments(a: Array, b: Array) -> Array:
    """Second moments (n, 2, 2) of triangles between the origin and a, b (n, 2), over twice their area."""
    both = np.einsum("ni,nj->nij", a, b)
    own = np.einsum("ni,nj->nij", a, a) + np.einsum("ni,nj->nij", b, b)
    return np.asarray((2.0 * own + both + np.swapaxes(both, 1, 2)) / 24.0)
