"""A rigid cylinder that beams and rods touch."""

from __future__ import annotations

import math
from typing import Literal

from evolvent.assembly.builder import Builder
from evolvent.base import units
from evolvent.kernels import surfaces
from evolvent.parts.surface_contact import SurfaceContact, add_surface


class CylinderContact(SurfaceContact):
    """A rigid cylinder on a body (or the ground), and the beams or rods that touch it.

    Parameters
    ----------
    body : str
        Body that the cylinder is fixed to, or ground.
    beams : list of str
        Beams with contact points, or rods, whose nodes but the root are the contact points.
    radius : float, m
        To the beams' axes.
    half_length : float, m, optional
        Half the cylinder's length; without limit if left out, as it must be with rods.
    centre : (3,) float, m
        Body axes.
    axis : (3,) float
        Body axes.
    skip : int
        Contact points next to the root that are left out (where the root itself is joined to the cylinder).
    initial_overlap : float
        Depth, in radii, up to which beams may lie below the surface at the start.
    """

    kind: Literal["cylinder-contact"] = "cylinder-contact"
    radius: units.Length
    half_length: units.Length | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the cylinder and its contact points."""
        half = math.inf if self.half_length is None else self.half_length
        add_surface(self, builder, name, surfaces.CYLINDER, "cylinder", self.radius, half, self.axis)
