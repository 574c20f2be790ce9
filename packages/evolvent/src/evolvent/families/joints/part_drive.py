"""Joints with a drive: it prescribes the angle of a spinning body, or moves a point on a line or round an involute."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location
from evolvent.families.joints import joint as kernels
from evolvent.families.joints.part_coordinate import check_units
from evolvent.families.joints.part_release import release_fields
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import Side, across, ground_end, side_of
from evolvent.kernels import axial, rigid, sides
from evolvent.parts.base import unit
from evolvent.parts.drive import FreeSpool
from evolvent.parts.drive_kind import DriveKind, DriveRow
from evolvent_base.dense import dot, norm, product
from evolvent_base.errors import InputError

#: Types of joints that a drive may move.
DRIVEN = ("revolute", "point-on-line", "involute")
#: What the axis of a driven body and its point on the driven line may be off those of the joint.
_LEAST_OFF = 1e-6
#: How far from a time a drive is evaluated, relative to that time; jumps of a coordinate and of its rate, beside their
#: sizes, that are round-off and that count.
_BESIDE, ROUND_OFF, _JUMP = 1e-6, 1e-9, 1e-6
Array = np.ndarray


def write_driven(joint: Any, builder: Builder, name: str) -> None:
    """Write the rows of the family `joints` that hold an angle or a point where the drive has it."""
    if joint.drive is None:
        raise InputError(f"{name}.drive is missing; a joint of type {joint.type!r} is moved by a drive")
    if isinstance(joint.drive, FreeSpool):
        raise InputError(f"{name}.drive is a free spool, which prescribes no motion; give another drive")
    if joint.released_by is not None:
        raise InputError(f"{name}.released_by is given, but a drive prescribes a motion; give {name}.until, its end")
    a, b = ground_end(builder, name, joint), builder.location(joint.b, f"{name}.b")
    if joint.type == "revolute":
        body = builder.rows["bodies"][b.row] if b.family == "bodies" else {}
        if body.get("motion") != rigid.SPIN:
            raise InputError(f"{name}.b is {joint.b!r}; a drive turns only a body with motion 'spin'")
        own = product(body["R0"], body["axis"])
        if "axis" in joint.model_fields_set and norm(own - unit(joint.axis)) > _LEAST_OFF:
            axis = [float(x) for x in np.round(own, 9) + 0.0]
            raise InputError(f"{name}.axis is {joint.axis!r}, but {joint.b!r} spins about {axis}; give that axis")
    on_line = joint.type == "point-on-line"
    if b.family == "bodies" and joint.type == "involute":
        raise InputError(f"{name}.b is {joint.b!r}; only a beam's node or a point mass is wound onto a circle")
    check_units(f"{name}.drive", joint.drive, axial.TRAVEL if on_line else axial.ANGLE)
    drive, release = joint.drive.write(builder, name), release_fields(builder, name, joint)
    _check_jumps(joint.drive, builder, name, drive, release["until"], "m" if on_line else "rad")
    path: dict[str, Any] = {"drive": drive.kind, "law": drive.law, "first": drive.first, "last": drive.last, **release}
    builder.names[name] = ("joints", len(builder.rows["joints"]))
    if joint.type == "revolute":
        side = Side(sides.ON_COORDINATES, b.row, body["iq"], body["iv"], np.zeros(3), np.zeros(3), None)
        add_row(builder, kernels.ANGLE, side, side, path=kernels.LINEAR, **path)
    elif on_line:
        _write_line(joint, builder, name, (a, b), path, release)
    else:
        _write_involute(joint, builder, name, (a, b), path)


def _write_line(
    joint: Any, builder: Builder, name: str, ends: tuple[Location, Location], path: dict[str, Any],
    release: dict[str, Any],
) -> None:  # fmt: skip
    """Three rows: along the line by the drive, from where the point starts, and across it."""
    (a, at), d = ends, unit(joint.axis)
    b = side_of(at)
    off = b.u - (b.u if a.alone else a.x)
    apart = norm(off - dot(off, d) * d)
    if apart > _LEAST_OFF * max(1.0, float(np.abs(b.u).max())):
        raise InputError(f"{name}: b is {apart:.6g} m off the line at the start; it must be on it")
    ground = Side(sides.ON_BODY, 0, -1, -1, b.u, b.u, None)
    add_row(builder, kernels.POINT, ground, b, along=d, radius=1.0, path=kernels.LINEAR, **path)
    for other in across(d):
        add_row(builder, kernels.POINT, ground, b, along=other, **release)


def _write_involute(
    joint: Any, builder: Builder, name: str, ends: tuple[Location, Location], path: dict[str, Any]
) -> None:
    """Three rows that hold the end of a thread as it winds onto a circle about a."""
    if joint.drum == 0.0 or joint.length is None:
        key = "length" if joint.drum > 0.0 else "drum"
        raise InputError(f"{name}.{key} is missing; an involute needs the length of its thread and the circle's radius")
    z, e = unit(joint.axis), unit(joint.anchor)
    ground = Side(sides.ON_BODY, 0, -1, -1, np.zeros(3), np.zeros(3), None)
    for along in (e, np.cross(z, e), z):
        add_row(
            builder, kernels.POINT, ground, side_of(ends[1]), along=along, centre=ends[0].x, axis=z, zero=e,
            value=joint.length, radius=joint.drum, path=kernels.INVOLUTE, **path,
        )  # fmt: skip


def _check_jumps(drive: DriveKind, builder: Builder, name: str, row: DriveRow, until: float, unit: str) -> None:
    """Refuse a drive that jumps, or whose rate does, under a constraint: it would take an infinite force."""
    corners = np.array(sorted({0.0, *(time for time in drive.corners() if 0.0 < time < until)}))
    if corners.size == 1:
        return

    def at(time: float) -> Array:
        try:
            return np.array(drive.at(builder, row, time)[:2])
        except InputError:  # not finite there: a run that reaches it reports it
            return np.full(2, np.nan)

    def beside(time: float, step: float) -> tuple[Array, float]:
        """Coordinate and rate at the end of an interval, from two points within it, and how much the rate varies."""
        (x, rate), (_, far) = at(time + step), at(time + 2.0 * step)
        return np.array([x - step * rate, 2.0 * rate - far]), abs(far - rate)

    size = np.fmax.reduce([np.abs(at(time)) for time in 0.5 * (corners[1:] + corners[:-1])])
    gaps = np.diff(corners)
    for time, gap in zip(corners[1:], np.minimum(gaps, np.append(gaps[1:], np.inf)), strict=True):
        step = min(_BESIDE * time, 0.1 * gap)
        (before, varies), (after, varies_after) = beside(time, -step), beside(time, step)
        varies = 10.0 * max(varies, varies_after)
        size = np.fmax.reduce([size, np.abs(before), np.abs(after)])
        least = np.array([ROUND_OFF * (size[0] + time * size[1]) + step * varies, _JUMP * size[1] + varies])
        for k, what in enumerate((f"{name}.drive", f"the rate of {name}.drive")):
            if abs(after[k] - before[k]) > least[k]:
                found = [f"{value if abs(value) > least[k] else 0.0:.6g}" for value in (before[k], after[k])]
                raise InputError(
                    f"{what} jumps from {found[0]} to {found[1]} {unit}{'/s' * k} at t = {time:.6g} s, which needs an "
                    f"infinite force; {drive.remedy}"
                )
