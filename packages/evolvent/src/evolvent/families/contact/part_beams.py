"""Contact points of beams: at surfaces, and on turns of beams."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.contact.part_shapes import NO_NORMAL, OF_BEAMS, check_skip, surface_at
from evolvent.kernels import ancf, ancf_beams, surfaces
from evolvent.parts.base import unit
from evolvent_base.dense import dot, product
from evolvent_base.errors import InputError, counted

Array = np.ndarray


def contact_points(part: Any, builder: Builder, beam: int) -> Iterator[dict[str, Any]]:
    """Fields of the contact points of a beam, evenly spaced in each element, its second node included."""
    row = builder.rows["beams"][beam]
    k = ancf_beams.NODE_VECTORS[row["kind"]]
    vectors = np.array([0, 1, k, k + 1])
    for c in range(row["first_element"], row["first_element"] + row["elements"]):
        element = builder.rows["elements"][c]
        M = builder.pools["M"][element["mass"]]
        mass = float(M[0, 0] + 2.0 * M[0, k] + M[k, k]) / part.points
        for i in range(1, part.points + 1):
            shape = np.empty(8)
            ancf.beam_shape(element["length"], i / part.points, 0.0, 0.0, shape)
            at = {"iq": element["iq"] + 3 * vectors, "iv": element["iv"] + 3 * vectors}
            yield {
                "element": c, **at, "S": shape[[0, 1, 4, 5]], "reach": 1.5 * element["length"],
                "viscous": part.viscosity(mass),
            }  # fmt: skip


def add_surface(part: Any, builder: Builder, name: str) -> None:
    """Write a surface with the contact points of beams; refused where one starts inside."""
    surface = surface_at(part, builder, name, "b", OF_BEAMS, needed=True)
    radius, half, axis = surface.radius, surface.half, unit(surface.axis)
    pose, first = builder.poses[surface.body], len(builder.rows["contact_points"])
    place, along = pose.x + pose.R @ surface.place, pose.R @ axis
    overlap = 1e-3 if part.initial_overlap is None else part.initial_overlap
    for beam in part.a:
        every = list(contact_points(part, builder, builder.find(str(beam), "beams")))
        check_skip(part, name, beam, len(every))
        for fields in every[part.skip :]:
            S, iq = fields["S"], fields["iq"]
            at = sum(S[j] * np.array(builder.q[iq[j] : iq[j] + 3]) for j in range(4)) - place
            u = float(at @ along)
            off = u - radius
            if surface.kind != surfaces.PLANE:
                s = u if surface.kind == surfaces.CYLINDER else min(max(u, -half), half)
                off = float(np.linalg.norm(at - s * along)) - radius
            beside = surface.kind == surfaces.CYLINDER and abs(u) >= half
            if off < -overlap * radius and not beside:
                raise InputError(
                    f"{beam!r} starts inside the {surface.called} {name!r}: a point of it is {-off:.3g} m below its "
                    f"surface"
                )
            if surface.kind != surfaces.PLANE and not beside and off <= (NO_NORMAL - 1.0) * radius:
                raise InputError(
                    f"{beam!r} starts with a point in the middle of the {surface.called} {name!r}, where the force of "
                    f"the contact has no direction; move it out"
                )
            builder.add("contact_points", **fields)
    _add(
        part, builder, name, surface.body, first, under=-1, surface=surface.kind, centre=surface.place, axis=axis,
        radius=radius, half_length=half,
    )  # fmt: skip


def add_turns(part: Any, builder: Builder, name: str) -> None:
    """Write turns that lie on others, and their contact points."""
    for key in ("around", "thickness"):
        if getattr(part, key) is None:
            raise InputError(f"{name}.{key} is missing; turns of a beam need it")
    around = builder.location(part.around, f"{name}.around")
    if around.family != "bodies":
        raise InputError(f"{name}.around is {part.around!r}, which is not a point of a rigid body; give one")
    over, under = (builder.find(str(beam), "beams") for beam in (part.a[0], part.b))
    centre, axis, pose = around.local, unit(part.axis), builder.poses[around.row]
    for beam, owner in {over: part.a[0], under: part.b}.items():
        _thicken(part, builder, name, beam, owner)
    first = len(builder.rows["contact_points"])
    for fields in contact_points(part, builder, over):
        builder.add("contact_points", carrier=-1, **fields | {"viscous": 0.0})
    shift = _shift(part, builder, over, under, pose.x + product(pose.R, centre), product(pose.R, axis))
    _add(
        part, builder, name, around.row, first, under=under, sense=float(part.sense), shift=shift, centre=centre,
        axis=axis, half_length=math.inf if part.width is None else part.width,
    )  # fmt: skip


def _add(part: Any, builder: Builder, name: str, body: int, first: int, **fields: Any) -> None:
    """Write a surface, or turns, on a body, whose contact points are those from `first` on."""
    last = len(builder.rows["contact_points"])
    index = builder.add("contact_surfaces", body=body, first=first, last=last, **fields, **part.law_fields())
    builder.names[name] = ("contact_surfaces", index)


def _thicken(part: Any, builder: Builder, name: str, beam: int, owner: Any) -> None:
    """Write the thickness into a beam's elements."""
    row = builder.rows["beams"][beam]
    found = np.array(part.thickness, dtype=float)
    if found.ndim == 0:
        found = np.full(row["elements"], found)
    if found.shape != (row["elements"],):
        raise InputError(
            f"{name}.thickness has {counted(found.size, 'value')}; it must be one value, or {row['elements']} of them, "
            f"one for each element of {owner!r}"
        )
    for c in range(row["elements"]):
        builder.rows["elements"][row["first_element"] + c]["thickness"] = found[c]


def _shift(part: Any, builder: Builder, over: int, under: int, centre: Array, axis: Array) -> float:
    """Angle from the root of `over` to that of `under` in the sense of winding, above 0 to a whole turn."""
    if over == under:
        return 2.0 * math.pi
    roots = []
    for beam in (over, under):
        at = builder.rows["beams"][beam]["iq"]
        root = np.array(builder.q[at : at + 3]) - centre
        roots.append(root - dot(root, axis) * axis)
    angle = part.sense * math.atan2(dot(np.cross(*roots), axis), dot(*roots))
    return angle if angle > 1e-9 else angle + 2.0 * math.pi
