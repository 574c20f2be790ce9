"""Poses of bodies where joints have unfolded what holds the rim of a net, which is folded at the start."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly, Pose
from evolvent.assembly.builder import Builder
from evolvent.families.coordinates.part_poses import Linkage
from evolvent.kernels import axial, rigid
from evolvent.kernels.sides import ON_BODY
from evolvent.model.registry import asked
from evolvent_base.errors import InputError

Array = np.ndarray
#: Keys by which a joint is a penalty, in place of a constraint.
_PENALTY = ("stiffness", "rotational_stiffness", "damping", "viscoelastic")
#: Keys by which a joint is released, as a hold-down is before anything unfolds.
_RELEASE = ("until", "released_by")


def unfolded(builder: Builder, key: str, springs: Sequence[str]) -> list[Pose]:
    """Poses of all bodies after joint springs have moved to their angle or travel 0.

    Parameters
    ----------
    key : str, that names the springs, for messages
    springs : names of joint springs
    """
    if not springs:
        return builder.poses
    before = {name: spec for name, spec in builder.specs.items() if name != builder.part}
    bodies = _moved(before, builder.gravity, key, springs).model.bodies
    return [
        pose._replace(x=row["x"].copy(), R=row["R"].copy()) for pose, row in zip(builder.poses, bodies, strict=True)
    ]


def unfolded_start(assembly: Assembly, name: str) -> Assembly:
    """An assembly that starts with the rim of a net unfolded, and latched where joints have a latch at 0."""
    net, y, s = assembly.parts[name], assembly.y.copy(), assembly.s.copy()
    if not net.unfold:
        return assembly
    before = dict(list(assembly.parts.items())[: list(assembly.parts).index(name)])
    springs = net.springs(before)
    own = _moved(before, assembly.model.info.gravity, f"{name}.unfold", springs)
    for row in own.model.bodies:  # whose coordinates come first, in the order of the parts
        size = {rigid.FREE: 7, rigid.SPIN: 1}.get(row["motion"], 0)
        y[row["iq"] : row["iq"] + size] = own.y[row["iq"] : row["iq"] + size]
    for k, row in enumerate(own.model.coordinates):
        whole = assembly.model.coordinates[k]
        if row["kind"] == axial.ANGLE and row["on"] == ON_BODY:
            s[whole["switch"]] = np.round(row["angle"] / axial.QUARTER)
    for spring in springs:
        row = assembly.model.coordinates[own.names[spring][1]]
        s[int(row["switch"]) + 1] = int(row["latch"] == 0.0)
    return dataclasses.replace(assembly, y=y, s=s)


def _moved(specs: Mapping[str, Any], gravity: Array, key: str, springs: Sequence[str]) -> Assembly:
    """An assembly of the parts before a net whose state has moved, with all joints that stay as constraints."""
    builder = Builder(gravity)
    for name, spec in specs.items():
        if getattr(spec, "kind", "") == "joint":
            if any(getattr(spec, word) is not None for word in _RELEASE):
                continue
            kept = {word: getattr(spec, word) for word in spec.model_fields_set if word not in _PENALTY}
            spec = type(spec)(**kept)
        builder.write(name, spec)
    wanted = dict[int, float]()
    for name in springs:
        family, index = builder.names.get(name, ("", -1))
        if family != "coordinates" or builder.rows[family][index]["on"] != ON_BODY:
            raise InputError(
                f"{key} names {name!r}; it must be a joint spring between bodies or rods that is named before the net"
            )
        wanted[index] = 0.0
    found, consists = builder.build(), asked("parts.consists")
    groups = [
        consists[family](builder.rows[family][index], index)
        for family, index in builder.names.values() if family in consists
    ]  # fmt: skip
    linkage = Linkage(found, groups)
    why = linkage.move(wanted)
    if why:
        raise InputError(f"{key}: the joint springs {_listed(springs)} cannot all be at 0: {why}")
    return dataclasses.replace(found, y=linkage.y)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:3]) + (" and so on" if len(names) > 3 else "")
