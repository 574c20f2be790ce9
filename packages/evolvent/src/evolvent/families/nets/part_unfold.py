"""Poses of bodies where joints have unfolded what holds the rim of a net, which is folded at the start."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from evolvent.assembly.assembled import Assembly, Pose
from evolvent.assembly.builder import Builder
from evolvent.elements.rods import quaternion
from evolvent.families.joints.part_coordinate import owner_of
from evolvent.kernels import axial, rigid
from evolvent.model.registry import asked
from evolvent_base.errors import InputError

Array = np.ndarray


def unfolded(builder: Builder, key: str, springs: Sequence[str]) -> list[Pose]:
    """Poses of all bodies after joint springs have moved to their angle or travel 0.

    Parameters
    ----------
    key : str, that names the springs, for messages
    springs : names of joint springs

    Notes
    -----
    What is beyond a joint moves with its second end: the parts that other joints connect with it. A joint that is
    beyond another one moves first, about its axis at the start.
    """
    moves: list[tuple[list[int], Array, Array, Array]] = []
    for name in springs:
        family, index = builder.names.get(name, ("", -1))
        joint = getattr(builder.specs.get(name), "joint", None)
        if family != "coordinates" or joint is None:
            raise InputError(
                f"{key} names {name!r}; it must be a joint spring with the key `joint` that is named before the net"
            )
        row, spec = builder.rows["coordinates"][index], builder.specs[name]
        ends = spec.ends(builder, name, row["kind"])
        bodies = [k for part in _beyond(builder, key, joint, ends) for k in _bodies(builder, part)]
        turn, shift = np.eye(3), np.zeros(3)
        if row["kind"] == axial.ANGLE:
            turn = scipy.spatial.transform.Rotation.from_rotvec(-row["angle"] * ends.axis).as_matrix()
        else:
            shift = -row["angle"] * ends.axis
        moves.append((bodies, ends.location.x, turn, shift))
    poses = list(builder.poses)
    for bodies, pivot, turn, shift in sorted(moves, key=lambda one: len(one[0])):
        for k in bodies:
            x = pivot + turn @ (poses[k].x - pivot) + shift
            poses[k] = poses[k]._replace(x=x, R=turn @ poses[k].R)
    return poses


def unfolded_start(assembly: Assembly, name: str) -> Assembly:
    """An assembly that starts with the rim of a net unfolded, and latched where joints have a latch at 0."""
    net, y, s = assembly.parts[name], assembly.y.copy(), assembly.s.copy()
    if not net.unfold:
        return assembly
    builder = Builder(assembly.model.info.gravity)
    for part, spec in assembly.parts.items():
        if part == name:
            break
        builder.write(part, spec)
    for row, pose in zip(builder.rows["bodies"], net.poses(builder, name), strict=True):
        if row["motion"] == rigid.FREE:
            y[row["iq"] : row["iq"] + 7] = [*pose.x, *quaternion(pose.R)]
    for spring in net.springs(builder):
        row = assembly.model.coordinates[builder.names[spring][1]]
        quarters, latched = int(row["switch"]), int(row["switch"]) + 1
        s[quarters], s[latched] = 0, int(row["latch"] == 0.0)
    return dataclasses.replace(assembly, y=y, s=s)


def _beyond(builder: Builder, key: str, joint: str, ends: Any) -> list[str]:
    """Parts beyond the second end of a joint."""
    near: dict[str, set[str]] = {}
    for name, spec in builder.specs.items():
        if getattr(spec, "kind", "") == "joint" and name != joint and spec.a is not None and spec.b is not None:
            a, b = owner_of(spec.a), owner_of(spec.b)
            near.setdefault(a, set()).add(b)
            near.setdefault(b, set()).add(a)
    found, waiting = list[str](), [owner_of(ends.b)]
    while waiting:
        part = waiting.pop()
        if part in ("ground", ends.a):
            raise InputError(
                f"{key}: what is beyond the joint {joint!r} is joined with {part!r} by other joints too, so that it "
                f"cannot turn alone; give springs of joints that no others close"
            )
        if part not in found:
            found.append(part)
            waiting += sorted(near.get(part, ()))
    return found


def _bodies(builder: Builder, part: str) -> range:
    """Bodies of a part."""
    family, index = builder.names[part]
    if family == "bodies":
        return range(index, index + 1)
    consists = asked("parts.consists").get(family)
    return range(0) if consists is None else consists(builder.rows[family][index], index)
