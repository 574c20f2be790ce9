"""The coordinate of a joint that a part names, such as a motor."""

from __future__ import annotations

from typing import Any

from evolvent.assembly.builder import Builder
from evolvent.parts.joint import Joint
from evolvent.parts.joint_coordinate import CoordinateSpring, nearest_joint
from evolvent.parts.rotational_spring import RotationalSpring
from evolvent.parts.translational_spring import TranslationalSpring
from evolvent_base.errors import InputError


def find_coordinate(builder: Builder, key: str, name: str) -> int:
    """Row of the family `coordinates` of a spring, or a new one of a joint, which counts from 0 at the start.

    Parameters
    ----------
    key : str, that holds the name, for messages
    """
    family, index = builder.names.get(name, ("", -1))
    if family == "coordinates":
        return index
    spec = builder.specs.get(name)
    if not isinstance(spec, Joint):
        known = [n for n, part in builder.specs.items() if isinstance(part, Joint | CoordinateSpring)]
        what = f"a {type(spec).__name__}" if spec is not None else "no part"
        raise InputError(
            f"{key} is {name!r}, {what}, which has no coordinate; name a RotationalSpring, a TranslationalSpring, or a "
            f"revolute or prismatic Joint; {nearest_joint(name, known)}"
        )
    kinds: dict[str, Any] = {"revolute": RotationalSpring, "prismatic": TranslationalSpring}
    if spec.type not in kinds:
        raise InputError(
            f"{key} is {name!r}, a joint of type {spec.type!r}, which has no single coordinate; name a revolute or "
            f"prismatic joint, or a RotationalSpring or TranslationalSpring on one of its axes"
        )
    kinds[spec.type](joint=name).write(builder, own := f"{name} (coordinate)")
    return builder.names.pop(own)[1]
