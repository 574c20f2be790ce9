"""Types of joints between two points: they coincide, slide, or keep a length, with or without rotation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_release import release_fields
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import (
    NOTHING,
    Held,
    Side,
    across,
    all_slopes,
    clamped,
    clamped_bodies,
    fixed_direction,
    hinged,
    point_side,
    relative_coordinate,
    side_of,
)
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.families.threads.part_joint import check_type, fix_end
from evolvent.kernels import axial, gaps, sides
from evolvent.parts.base import unit
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError

_LEAST_OFF = 1e-6
#: Types of which b stays on a line or in a plane through a.
SLIDING = ("prismatic", "cylindrical", "screw", "point-on-line", "in-plane")
#: Types that hold no rotation.
_FREE_TO_TURN = ("spherical", "distance", "point-on-line", "in-plane", "pulley")
#: Types that keep a length, of points that are apart.
_ROPES = ("distance", "pulley")


def write_pair(joint: Any, builder: Builder, name: str, *, meets: bool = False) -> None:
    """Write the joint's scalar constraints into the family `joints`; or fix the end of a thread.

    Parameters
    ----------
    meets : bool, whether other joints already make its points coincide, so that it holds directions alone
    """
    check_type(builder, name, joint, turns=joint.type in _FREE_TO_TURN)
    if fix_end(builder, name, joint):
        return
    a, b = _ends(joint, builder, name)
    swaps = joint.type not in ("point-on-line", "in-plane", "universal", "pulley")
    if swaps and a.on == sides.ON_COORDINATES and b.on == sides.ON_BODY:
        a, b = b, a
    common = {"stiffness": joint.stiffness, "damping": joint.damping, **release_fields(builder, name, joint)}
    terms = add_terms(builder, joint.viscoelastic)
    common |= terms | {"branch": add_branches(builder, terms, 0.0)}
    builder.names[name] = ("joints", len(builder.rows["joints"]))
    apart, axis = norm(b.u - a.u), unit(joint.axis)
    if joint.hold == "all" and (joint.type != "clamp" or a.on != sides.ON_BODY or b.node is None):
        raise InputError(f"{name}.hold is 'all'; it needs a joint of type 'clamp' between a body and a beam's node")
    if joint.type == "distance":
        if apart == 0.0:
            raise InputError(f"{name}: its two points coincide; a joint of type 'distance' needs a distance")
        add_row(builder, kernels.DISTANCE, a, b, value=apart, **common)
    elif joint.type == "pulley":
        _write_pulley(joint, builder, name, (a, b), common)
    elif joint.type in SLIDING:
        _write_slide(joint, builder, name, (a, b), common)
        if joint.type == "screw":
            _write_screw(joint, builder, name, (a, b), common)
    else:
        if apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
            raise InputError(f"{name}: its two points are {apart:.6g} m apart at the start; they must coincide")
        for along in () if meets else np.eye(3):
            add_row(builder, kernels.POINT, a, b, along=along, **common)
    if joint.rotational_stiffness is not None:
        common["stiffness"] = joint.rotational_stiffness
        if (joint.rotational_stiffness > 0.0) != (joint.stiffness > 0.0):
            raise InputError(
                f"{name}.rotational_stiffness is {joint.rotational_stiffness!r}, but {name}.stiffness is "
                f"{float(joint.stiffness)!r}; both must be above 0 (a penalty), or both 0"
            )
    for held in _directions(joint, builder, name, a, b, axis):
        add_row(builder, held.kind, held.a, held.b, direction=held.along, value=held.value, **common)


def _ends(joint: Any, builder: Builder, name: str) -> tuple[Side, Side]:
    """Both ends; a body named alone takes the place of the other end, or `position`."""
    ends = [builder.location(joint.a, f"{name}.a"), builder.location(joint.b, f"{name}.b")]
    if joint.type != "pulley" and ends[0].family == ends[1].family == "bodies" and ends[0].row == ends[1].row:
        raise InputError(f"{name}.a and {name}.b are on one body, {joint.a!r}; a joint needs two parts")
    if ends[0].iq >= 0 and ends[0].iq == ends[1].iq:
        raise InputError(f"{name}.a and {name}.b are both {joint.a!r}; a joint needs two points")
    if joint.type in _ROPES:
        return side_of(ends[0]), side_of(ends[1])
    alone = [end.alone for end in ends]
    if joint.position is not None and not any(alone):
        raise InputError(f"{name}.position is given, but {name}.a and {name}.b already define where the joint is")
    if joint.position is None and all(alone):
        raise InputError(
            f"{name}.a and {name}.b are both bodies named alone, {joint.a!r} and {joint.b!r}; give {name}.position "
            f"(inertial axes, at the start), or a point of one of them, such as {[joint.a, [0, 0, 1]]!r}"
        )
    found = []
    for end, other in zip(ends, reversed(ends), strict=True):
        if end.alone:
            x = other.x if joint.position is None else np.array(joint.position)
            pose = builder.poses[end.row]
            end = end._replace(x=x, local=product(pose.R.T, x - pose.x))
        found.append(side_of(end))
    return found[0], found[1]


def _write_slide(joint: Any, builder: Builder, name: str, ends: tuple[Side, Side], common: dict[str, Any]) -> None:
    """Rows that keep b on a line or in a plane that is fixed to a."""
    (a, b), axis = ends, unit(joint.axis)
    key, off = f"{name}.type is {joint.type!r}", b.u - a.u
    if joint.type == "in-plane":
        off, what = dot(off, axis) * axis, "plane"
    else:
        off, what = off - dot(off, axis) * axis, "line"
    apart = norm(off)
    if joint.type != "prismatic" and apart > _LEAST_OFF * max(1.0, float(np.abs(a.u).max())):
        raise InputError(f"{name}: b is {apart:.6g} m off the {what} at the start; it must be on it")
    for f in (axis,) if joint.type == "in-plane" else across(axis):
        direction = fixed_direction(builder, key, a, f)
        add_row(builder, kernels.ALONG, a, b, direction=direction, value=dot(direction.u, b.u - a.u), **common)


def _write_screw(joint: Any, builder: Builder, name: str, ends: tuple[Side, Side], common: dict[str, Any]) -> None:
    """The row that keeps the travel of b to its angle; whole turns of it are not counted."""
    (a, b), axis = ends, unit(joint.axis)
    if joint.pitch is None or joint.pitch == 0.0:
        raise InputError(f"{name}.pitch is {joint.pitch!r}; a screw joint needs its travel a turn, not 0")
    if any(side.on != sides.ON_BODY for side in (a, b)):
        raise InputError(f"{name}.type is 'screw'; it needs two bodies, not a node of a beam or a point mass")
    for kind, factor in ((axial.TRAVEL, 1.0), (axial.ANGLE, -joint.pitch / (2.0 * math.pi))):
        fields = relative_coordinate(builder, kind, (a.body, b.body), axis, b.local)
        builder.add("gear_coordinates", factor=factor, **fields)
    last = len(builder.rows["gear_coordinates"])
    whole: dict[str, Any] = {"first": last - 2, "last": last, "radius": abs(joint.pitch)}
    add_row(builder, kernels.GEAR, NOTHING, NOTHING, **whole, **common)


def _write_pulley(joint: Any, builder: Builder, name: str, ends: tuple[Side, Side], common: dict[str, Any]) -> None:
    """The row that keeps the length of a cord over a point."""
    if joint.over is None:
        raise InputError(f"{name}.over is missing; the cord of a pulley runs over a point")
    (a, b), over, length = ends, point_side(builder, joint.over, f"{name}.over"), 0.0
    ratio = 1.0 if joint.ratio is None else joint.ratio
    if ratio <= 0.0:
        raise InputError(f"{name}.ratio is {ratio!r}; the parts of the cord of a pulley must be a number above 0")
    for key, end, parts in (("a", a, 1.0), ("b", b, ratio)):
        apart = norm(end.u - over.u)
        if apart == 0.0 or (over.on == sides.ON_BODY and over[:2] == end[:2]):
            what = "coincide at the start" if apart == 0.0 else "are on one body"
            raise InputError(f"{name}.{key} and {name}.over {what}; the cord of a pulley needs a free part there")
        length += parts * apart
    add_row(builder, gaps.PULLEY, a, b, direction=over, radius=ratio, value=length, **common)


def _directions(joint: Any, builder: Builder, name: str, a: Side, b: Side, axis: np.ndarray) -> list[Held]:
    """Directions that the joint holds."""
    key = f"{name}.type is {joint.type!r}"
    if joint.type in ("revolute", "cylindrical", "screw"):
        return hinged(builder, key, a, b, axis)
    if joint.hold == "all":
        return all_slopes(builder, a, b)
    if joint.type in ("clamp", "prismatic"):
        if a.on == sides.ON_BODY and b.on == sides.ON_BODY:
            return clamped_bodies(builder, a, b, axis)
        return clamped(builder, key, a, b)
    if joint.type != "universal":
        return []
    if joint.axis_b is None:
        raise InputError(f"{name}.axis_b is missing; a universal joint has two axes")
    other = unit(joint.axis_b)
    if abs(float(axis @ other)) > 1e-6:
        raise InputError(
            f"{name}.axis_b is {joint.axis_b!r}, which is not perpendicular to {name}.axis, {joint.axis!r}"
        )
    return [Held(fixed_direction(builder, key, a, axis), fixed_direction(builder, key, b, other))]
