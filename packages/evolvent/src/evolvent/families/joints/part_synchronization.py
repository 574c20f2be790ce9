"""Joints of type synchronization: cables that synchronize the hinges of an array, or the stages of a telescope."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.joints.part_coordinate import check_units, find_coordinate
from evolvent.kernels import axial
from evolvent_base.dense import product
from evolvent_base.errors import InputError

#: What the cosine of the angle between two axes may be off 1 where they are one: round-off.
SAME_AXIS = 1e-12


def _is_one(builder: Builder, first: dict[str, Any], second: dict[str, Any]) -> bool:
    """Whether two rows of the family `coordinates` are of one angle or travel: of the same ends about the same axis."""
    if any(first[key] != second[key] for key in ("kind", "on", "iq", "iv")):
        return False
    if {first["body"], first["other"]} != {second["body"], second["other"]}:
        return False
    if first["kind"] == axial.TRAVEL and (first["body"] != second["body"] or any(first["local"] != second["local"])):
        return False
    axes = [product(builder.poses[row["body"]].R, row["axis"]) for row in (first, second)]
    return abs(float(np.dot(*axes))) > 1.0 - SAME_AXIS


def write_synchronization(joint: Any, builder: Builder, name: str) -> None:
    """Write a row of the family `synchronizations` for each loop."""
    joints = joint.joints or ()
    count = len(joints)
    if count < 2:
        raise InputError(f"{name}.joints is {list(joints)!r}; a synchronization needs two joints or more")
    if len(set(joints)) < count:
        twice = next(hinge for hinge in joints if joints.count(hinge) > 1)
        raise InputError(f"{name}.joints names {twice!r} twice")
    ratios = joint.ratios if joint.ratios is not None else (1.0,) * count
    if len(ratios) != count:
        raise InputError(f"{name}.ratios has {len(ratios)} numbers; {name}.joints has {count}")
    if 0.0 in ratios:
        raise InputError(f"{name}.ratios is {list(ratios)!r}; none of them can be 0")
    if joint.stiffness == 0.0 and joint.damping == 0.0:
        raise InputError(f"{name}.stiffness is 0.0; a cable needs a stiffness above 0")
    found = [find_coordinate(builder, f"{name}.joints", hinge) for hinge in joints]
    rows = [builder.rows["coordinates"][k] for k in found]
    if len({row["kind"] for row in rows}) > 1:
        raise InputError(f"{name}.joints has both angles and travels; they must all be of one kind")
    for i, j in itertools.combinations(range(count), 2):
        if _is_one(builder, rows[i], rows[j]):
            raise InputError(
                f"{name}.joints names {joints[i]!r} and {joints[j]!r}, which have one coordinate; leave one of them out"
            )
    for key in ("stiffness", "damping"):
        check_units(f"{name}.{key}", getattr(joint, key), rows[0]["kind"])
    first = len(builder.rows["synchronizations"])
    for i, j in itertools.pairwise(range(count)):
        builder.add(
            "synchronizations",
            a=found[i],
            b=found[j],
            ratio_a=ratios[i],
            ratio_b=ratios[j],
            offset=ratios[j] * rows[j]["angle"] - ratios[i] * rows[i]["angle"],
            stiffness=joint.stiffness,
            damping=joint.damping,
        )
    builder.names[name] = ("synchronizations", first)
