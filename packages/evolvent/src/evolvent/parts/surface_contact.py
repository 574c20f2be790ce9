"""Contact of beams with rigid spheres, capsules and planes."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import contact_laws, surfaces
from evolvent.parts.base import BeamNames, BodyName, unit
from evolvent.parts.body_contact import NO_NORMAL, Surface, add_body_contacts
from evolvent.parts.contact import Contact
from evolvent_base import units
from evolvent_base.errors import InputError

#: Default of `sliding_damping`. Vibration of cables that slide round drums, else undamped, grows by 3 1/s at most
#: with it, and by 480 to 930 1/s without.
SLIDING_DAMPING = 0.1


def add_surface(
    part: Any, builder: Builder, name: str, surface: int, called: str, radius: float, half: float, axis: Any
) -> None:
    """Write a surface with the contact points of a part's beams; refused where one starts inside.

    Parameters
    ----------
    part : with the keys `body`, `beams`, `centre`, `skip` and `initial_overlap`
    surface : int, of `kernels.surfaces`; called : str, what messages call it
    radius, half : float, m, to the beams' axes, and half the length
    axis : (3,) float, body axes
    """
    rods = [beam for beam in part.beams if builder.names.get(beam, ("",))[0] == "rods"]
    if rods:
        _add_to_rods(part, builder, name, rods, Surface(-1, np.array(part.centre), surface, radius, half, axis))
        return
    body, centre, axis = builder.find(part.body, "bodies"), np.array(part.centre), unit(axis)
    pose, first = builder.poses[body], len(builder.rows["contact_points"])
    place, along = pose.x + pose.R @ centre, pose.R @ axis
    for beam in part.beams:
        for fields in part.contact_points(builder, builder.find(beam, "beams"))[part.skip :]:
            S, iq = fields["S"], fields["iq"]
            at = sum(S[j] * np.array(builder.q[iq[j] : iq[j] + 3]) for j in range(4)) - place
            u = float(at @ along)
            off = u - radius
            if surface != surfaces.PLANE:
                s = u if surface == surfaces.CYLINDER else min(max(u, -half), half)
                off = float(np.linalg.norm(at - s * along)) - radius
            beside = surface == surfaces.CYLINDER and abs(u) >= half
            if off < -part.initial_overlap * radius and not beside:
                raise InputError(
                    f"{beam!r} starts inside the {called} {name!r}: a point of it is {-off:.3g} m below its surface"
                )
            if surface != surfaces.PLANE and not beside and off <= (NO_NORMAL - 1.0) * radius:
                raise InputError(
                    f"{beam!r} starts with a point in the middle of the {called} {name!r}, where the force of the "
                    f"contact has no direction; move it out"
                )
            builder.add("contact_points", **fields)
    index = builder.add(
        "contact_surfaces", body=body, first=first, last=len(builder.rows["contact_points"]), under=-1, surface=surface,
        centre=centre, axis=axis, radius=radius, half_length=half, **part.law_fields(),
    )  # fmt: skip
    builder.names[name] = ("contact_surfaces", index)


def _add_to_rods(part: Any, builder: Builder, name: str, rods: list[str], surface: Surface) -> None:
    """Write a surface that the nodes of rods touch."""
    other = next((beam for beam in part.beams if beam not in rods), None)
    if other is not None:
        raise InputError(
            f"{name}.beams holds the rod {rods[0]!r} and {other!r}, which is no rod; give each its own contact"
        )
    if surface.kind == surfaces.CYLINDER:
        if math.isfinite(surface.half):
            raise InputError(
                f"{name}.half_length is given, but {name}.beams holds the rod {rods[0]!r}, for which a cylinder has no "
                f"ends; leave it out, or use a capsule-contact"
            )
        surface = surface._replace(kind=surfaces.CAPSULE)
    if part.law == "paper":
        raise InputError(f"{name}.law is 'paper', which rods do not support; use 'hunt-crossley' or 'conservative'")
    surface = surface._replace(body=builder.find(part.body, "bodies"))
    pairs = []
    for rod in rods:
        elements = builder.rows["rods"][builder.names[rod][1]]["elements"]
        for i in range(1 + part.skip, elements + 1):
            at = builder.location(f"{rod}[{i}]")
            pairs.append((Surface(at.row, at.local, surfaces.CAPSULE), surface))
    add_body_contacts(part, builder, name, pairs)


class SurfaceContact(Contact):
    """Contact of beams with a rigid surface: the keys that all surfaces share.

    Parameters
    ----------
    body : str
        Body to which the surface is fixed, or ground.
    beams : list of str
        Beams with contact points, or rods, whose nodes but the root are the contact points.
    centre : (3,) float, m
        Body axes.
    skip : int
        Contact points next to the root that are left out (where the root itself is joined to the surface).
    initial_overlap : float
        Depth, in radii, up to which beams may lie below the surface at the start.
    sliding_damping : float
        Share of critical damping, of the mass of a contact point on `stiffness`, by which its normal motion is damped
        where it has friction: without any, a beam that slides vibrates at the frequency of its contact points.
    """

    body: BodyName
    beams: BeamNames
    centre: units.Position = (0.0, 0.0, 0.0)
    skip: Annotated[int, units.Whole(least=0, most=100_000)] = 0
    initial_overlap: units.NumberOrZero = 1e-3
    sliding_damping: units.Fraction = SLIDING_DAMPING

    def viscosity(self, mass: float) -> float:
        """`viscous` of `contact_laws.sliding_damper`, kg^(1/2), of a contact point; 0 without friction."""
        return float(contact_laws.sliding_viscosity(self.sliding_damping, mass)) if self.friction > 0.0 else 0.0


class CylinderContact(SurfaceContact):
    """A rigid cylinder on a body (or the ground), and the beams or rods that touch it.

    The keys that all surfaces share are those of `SurfaceContact`.

    Parameters
    ----------
    radius : float, m
        To the beams' axes.
    half_length : float, m, optional
        Half the cylinder's length; without limit if left out, as it must be with rods.
    axis : (3,) float
        Body axes.
    """

    kind: Literal["cylinder-contact"] = "cylinder-contact"
    radius: units.Length
    half_length: units.Length | None = None
    axis: units.Direction = (0.0, 0.0, 1.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the cylinder and its contact points."""
        half = math.inf if self.half_length is None else self.half_length
        add_surface(self, builder, name, surfaces.CYLINDER, "cylinder", self.radius, half, self.axis)


class SphereContact(SurfaceContact):
    """Contact of beams with a rigid sphere on a body or on the ground.

    The keys that all surfaces share are those of `SurfaceContact`.

    Parameters
    ----------
    radius : float, m
        Distance from the centre to the axis of a touching beam: radius of the sphere plus half the beam's thickness.
    """

    kind: Literal["sphere-contact"] = "sphere-contact"
    radius: units.Length

    def write(self, builder: Builder, name: str) -> None:
        """Write the sphere and its contact points."""
        add_surface(self, builder, name, surfaces.CAPSULE, "sphere", self.radius, 0.0, (0.0, 0.0, 1.0))


class CapsuleContact(SurfaceContact):
    """Contact of beams with a rigid capsule, a cylinder with hemispherical ends, on a body or on the ground.

    The keys that all surfaces share are those of `SurfaceContact`.

    Parameters
    ----------
    radius : float, m
        Distance from the capsule's axis to the axis of a touching beam: radius of the capsule plus half the beam's
        thickness.
    length : float, m
        Length of the cylinder, between the centres of the hemispheres.
    centre : (3,) float, m
        Of the capsule, body axes.
    axis : (3,) float
        Body axes.
    """

    kind: Literal["capsule-contact"] = "capsule-contact"
    radius: units.Length
    length: units.Length
    axis: units.Direction = (0.0, 0.0, 1.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the capsule and its contact points."""
        add_surface(self, builder, name, surfaces.CAPSULE, "capsule", self.radius, 0.5 * self.length, self.axis)


class PlaneContact(SurfaceContact):
    """Contact of beams with a rigid plane on a body or on the ground.

    The keys that all surfaces share are those of `SurfaceContact`.

    Parameters
    ----------
    normal : (3,) float
        Normal of the plane, towards the side of the beams, body axes.
    clearance : float, m
        Distance of the beams' axes from the plane at which they touch it: half their thickness.
    centre : (3,) float, m
        A point of the plane, body axes.
    initial_overlap : float
        Depth, in units of `clearance`, up to which beams may lie below the surface at the start.
    size : float, m
        Diameter of the disc about `centre` that represents the plane in drawings; the plane itself is infinite.
    """

    kind: Literal["plane-contact"] = "plane-contact"
    normal: units.Direction
    clearance: units.Length
    size: units.Length = 1.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the plane and its contact points."""
        add_surface(self, builder, name, surfaces.PLANE, "plane", self.clearance, 0.0, self.normal)
