"""Joints at the end of a thread: a spherical joint fixes the end, as `Thread.end` does."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import split_reference
from evolvent.kernels import markers
from evolvent.parts.base import kind_of
from evolvent_base.dense import norm, product
from evolvent_base.errors import InputError

#: Distance of two points that are joined, beside the size of their coordinates.
_LEAST_OFF = 1e-6


def tip_of(builder: Builder, where: Any) -> str | None:
    """Name of the thread whose end a point is; None of other points."""
    if not isinstance(where, str):
        return None
    name, on = split_reference(where)
    return name if on == "tip" and builder.names.get(name, ("",))[0] == "threads" else None


def carry_point(builder: Builder, name: str, point: Any) -> bool:
    """Fix a thread's end to a point mass that is given with `at`; False at other points.

    An end that another part acts on already needs rows of its own.
    """
    thread = tip_of(builder, point.at)
    if thread is None:
        return False
    row, spec = builder.rows["threads"][builder.names[thread][1]], builder.specs[thread]
    if row["end"] >= 0 or spec.end is not None:
        return False
    spec.check_tip(builder, thread, point.at, f"{name}.at")
    x, v = builder.q[row["iq"] :][:3], builder.v[row["iv"] :][:3]
    q, rate = builder.coordinates(x, v)
    index = builder.add("points", iq=q, iv=rate, mass=point.mass, compliance=1.0 / point.mass)
    builder.names[name] = ("points", index)
    spec.fix_tip(builder, thread, builder.add("markers", kind=markers.ON_POINT, index=index, local=np.zeros(3)), v)
    return True


def check_type(builder: Builder, name: str, joint: Any, *, turns: bool) -> None:
    """Refuse a joint that holds an axis of a thread's end, or unless it `turns` freely a rotation, which it has not."""
    for key in ("a", "b"):
        where = getattr(joint, key)
        if tip_of(builder, where) is None:
            continue
        if not turns:
            raise InputError(
                f"{name}.type is {joint.type!r}, but {name}.{key} is {where!r}, the end of a thread, which has no "
                f"rotation; use type 'spherical', or join a body to it"
            )
        if key == "a" and joint.type in ("point-on-line", "in-plane"):
            raise InputError(
                f"{name}.type is {joint.type!r}, but {name}.a is {where!r}, the end of a thread, to which no axis can "
                f"be fixed; give it as {name}.b"
            )


def fix_end(builder: Builder, name: str, joint: Any) -> bool:
    """Fix a thread's end to the other point of a spherical joint; False where the joint needs rows of its own.

    These are penalties, joints that are released, those with a node of a beam, and those of an end that another part
    acts on already.
    """
    if joint.type != "spherical" or joint.stiffness > 0.0 or joint.until is not None or joint.released_by is not None:
        return False
    key = "a" if tip_of(builder, joint.a) is not None else "b"
    thread, other = tip_of(builder, getattr(joint, key)), "b" if key == "a" else "a"
    if thread is None or tip_of(builder, getattr(joint, other)) is not None:
        return False
    index = builder.names[thread][1]
    row, spec = builder.rows["threads"][index], builder.specs[thread]
    place = builder.location(getattr(joint, other), f"{name}.{other}")
    if row["end"] >= 0 or place.family == "beams" or kind_of(type(spec)) != "thread":
        return False
    spec.check_tip(builder, thread, getattr(joint, key), f"{name}.{key}")
    x = np.array(builder.q[row["iq"] :][:3])
    if place.family == "bodies" and place.row == row["body"]:
        raise InputError(f"{name}.{other} is {getattr(joint, other)!r}, on the body of {spec.reel!r} itself; give a "
                         f"point of another part")  # fmt: skip
    if place.alone:
        pose = builder.poses[place.row]
        v = pose.v + np.cross(pose.w, x - pose.x)
        place = place._replace(x=x, v=v, local=product(pose.R.T, x - pose.x))
    apart = norm(place.x - x)
    if apart > _LEAST_OFF * max(1.0, float(np.abs(x).max())):
        raise InputError(f"{name}: its two points are {apart:.6g} m apart at the start; they must coincide")
    kind = markers.ON_BODY if place.family == "bodies" else markers.ON_POINT
    spec.fix_tip(builder, thread, builder.add("markers", kind=kind, index=place.row, local=place.local), place.v)
    builder.names[name] = ("thread_ends", index)
    return True
