"""Bearing of a hinge or a slide: friction by the reactions of the joint."""

from __future__ import annotations

import functools
from typing import Any, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.coordinates.part import JointSpring
from evolvent.families.joints.part import Joint
from evolvent.families.joints.part_coordinate import PRESLIDING, add_coordinate, check_units, nearest_joint
from evolvent.families.joints.part_sides import relative_coordinate
from evolvent.kernels import axial, sides
from evolvent.parts.base import CoordinateName, Group, Part, unit
from evolvent_base import units
from evolvent_base.errors import InputError

#: Kinds of coordinates of the types of joints with a bearing, and the keys that belong to one of them alone.
KINDS = {"revolute": axial.ANGLE, "prismatic": axial.TRAVEL}
_OWN_KEYS = {"revolute": ("journal_radius", "thrust_radius"), "prismatic": ("width",)}
#: Acceleration by which the default stiffness of stiction is found, m/s2.
STANDARD_GRAVITY = 9.80665


class Bearing(Part):
    """Friction of a hinge or a slide that depends on the force and the moment which its joint carries.

    Parameters
    ----------
    joint : str
        A revolute or prismatic `Joint` between two bodies, or a spring on it.
    coefficient : float
        Coefficient of friction while it slides.
    static_coefficient : float, optional
        Coefficient up to which it sticks, at least `coefficient`, which it is if left out.
    journal_radius : float, m
        Of a hinge: radius at which forces across the axis rub.
    thrust_radius : float, m
        Of a hinge: mean radius of the face on which forces along the axis rub.
    span : float, m, optional
        Distance of both ends of the bearing along the axis, about the joint's position, which carry moments across
        the axis. If left out, these moments add no friction.
    width : float, m, optional
        Of a slide: distance of the two rails, which carry moments about the axis. If left out, these add no friction.
    preload : float, N
        Force by which the bearing is clamped without a load: along the axis of a hinge, across that of a slide.
    bristle_stiffness : float, N m/rad or N/m, optional
        Stiffness of stiction; by default it slides after 1e-4 rad or 1e-5 m under the weight, on Earth, of all bodies
        and points.

    Notes
    -----
    With the radial force Fr at the joint's position, the moment across the axis M, and the axis n, the ends of the
    bearing carry N1 = abs(Fr/2 + n x M/span) and N2 = abs(Fr/2 - n x M/span). The torque of a hinge that slides is
    coefficient (journal_radius (N1 + N2) + thrust_radius (abs(Fn) + preload)), Fn the axial force; the force of a
    slide is coefficient (N1 + N2 + 2 abs(Mn)/width + preload), Mn the moment about the axis. A slide's bearing moves
    with b of its joint.

    The forces are those of the same instant: friction and reactions are found together, so that what locks itself does
    so. Of redundant constraints they are those of minimum norm.
    """

    kind: Literal["bearing"] = "bearing"
    group = Group.SPRINGS
    joint: CoordinateName
    coefficient: units.PositiveNumber
    static_coefficient: units.PositiveNumber | None = None
    journal_radius: units.LengthOrZero = 0.0
    thrust_radius: units.LengthOrZero = 0.0
    span: units.Length | None = None
    width: units.Length | None = None
    preload: units.ForceOrZero = 0.0
    bristle_stiffness: units.CoordinateStiffness | None = None

    def _joint(self, builder: Builder, name: str) -> tuple[str, Joint]:
        """The joint whose reactions count, by name."""
        spec = builder.specs.get(self.joint)
        own = spec.joint if isinstance(spec, JointSpring) and spec.joint is not None else self.joint
        joint = builder.specs.get(own)
        if isinstance(joint, Joint) and joint.type in KINDS:
            return own, joint
        key = f"{name}.joint is {self.joint!r}"
        if isinstance(spec, JointSpring) and spec.joint is None:
            raise InputError(f"{key}, a {type(spec).__name__} without a joint, so without reactions; name a joint")
        if isinstance(joint, Joint):
            where = "a joint" if own == self.joint else "on a joint"
            raise InputError(
                f"{key}, {where} of type {joint.type!r}; a bearing needs one of type 'revolute' or 'prismatic'"
            )
        known = [one for one, part in builder.specs.items() if isinstance(part, Joint) and part.type in KINDS]
        what = f"a {type(spec).__name__}" if spec is not None else "no part"
        raise InputError(
            f"{key}, {what}; a bearing needs a joint of type 'revolute' or 'prismatic'; "
            f"{nearest_joint(self.joint, known)}"
        )

    def _check(self, builder: Builder, name: str, own: str, type_: str) -> None:
        """Refuse keys that do not go together or not with the joint, and a second bearing of a joint."""
        static = self.static_coefficient
        if static is not None and static < self.coefficient:
            raise InputError(
                f"{name}.static_coefficient is {static!r}, below {name}.coefficient, {self.coefficient!r}; it must be "
                f"at least that"
            )
        for other, keys in _OWN_KEYS.items():
            for key in keys if other != type_ else ():
                if key in self.model_fields_set:
                    raise InputError(
                        f"{name}.{key} belongs to a joint of type {other!r}, but {own!r} is of type {type_!r}"
                    )
        if type_ == "revolute" and self.journal_radius == 0.0 and self.thrust_radius == 0.0:
            raise InputError(f"{name} has no radius; give {name}.journal_radius, {name}.thrust_radius, or both")
        if self.preload > 0.0 and type_ == "revolute" and self.thrust_radius == 0.0:
            raise InputError(f"{name}.preload acts along the axis of a hinge; it needs {name}.thrust_radius")
        check_units(f"{name}.bristle_stiffness", self.bristle_stiffness, KINDS[type_])
        first = builder.names[own][1]
        for row, other in zip(builder.rows["bearings"], _names(builder), strict=True):
            if row["first"] == first:
                raise InputError(
                    f"{other!r} and {name!r} are both bearings of the joint {own!r}, whose reactions count once; leave "
                    f"one of them out"
                )

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `bearings`, and its coordinate."""
        own, joint = self._joint(builder, name)
        self._check(builder, name, own, joint.type)
        first = builder.names[own][1]
        rows = [k for k, part in enumerate(builder.writers("joints")) if part == own]
        row, kind = builder.rows["joints"][first], KINDS[joint.type]
        if any(on != sides.ON_BODY for on in row["on"][:2]):
            raise InputError(
                f"{name}.joint is {self.joint!r}, on a beam or a point; a bearing needs a joint between two bodies"
            )
        fields = relative_coordinate(
            builder, kind, (int(row["index"][0]), int(row["index"][1])), unit(joint.axis), np.array(row["local"][1])
        )
        body, axis = fields.pop("body"), fields.pop("axis")
        both = {"on": sides.ON_BODY, "iq": -1, "iv": -1, "stiffness": 0.0, "damping": 0.0, "rest": 0.0, "friction": 0.0}
        both |= {"stop": 0.0, "latch_stiffness": 0.0, "latch_damping": 0.0}
        coordinate = add_coordinate(builder, fields.pop("kind"), body, axis, 0.0, fields | both)
        hinge = kind == axial.ANGLE
        index = builder.add(
            "bearings",
            coordinate=coordinate,
            first=first,
            last=first + len(rows),
            coefficient=self.coefficient,
            static=self.coefficient if self.static_coefficient is None else self.static_coefficient,
            radial=self.journal_radius if hinge else 1.0,
            axial=self.thrust_radius if hinge else 0.0,
            twist=0.0 if self.width is None else 2.0 / self.width,
            constant=self.preload * (self.thrust_radius if hinge else 1.0),
            arm=0.0 if self.span is None else 1.0 / self.span,
            stick=self.bristle_stiffness or 0.0,
        )
        builder.names[name] = ("bearings", index)
        if self.bristle_stiffness is None:
            builder.at_end.append(functools.partial(_stiffen, name=name, index=index, kind=kind))


def _names(builder: Builder) -> list[str]:
    """Names of the bearings so far."""
    return [name for name, (family, _) in builder.names.items() if family == "bearings"]


def _stiffen(builder: Builder, *, name: str, index: int, kind: int) -> None:
    """Give a bearing its default stiffness once every part is there."""
    rows: dict[str, list[dict[str, Any]]] = builder.rows
    mass = sum(float(row["mass"]) for family in ("bodies", "points") for row in rows[family])
    row = rows["bearings"][index]
    load = max(row["radial"], row["axial"]) * mass * STANDARD_GRAVITY + row["constant"]
    row["stick"] = row["coefficient"] * load / PRESLIDING[kind]
    if row["stick"] <= 0.0:
        raise InputError(
            f"{name}.bristle_stiffness has no default, since no body has a mass; give it, the limit of friction by the "
            f"angle or travel at which it slides"
        )
