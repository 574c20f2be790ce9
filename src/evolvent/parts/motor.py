"""Motor on the coordinate of a joint."""

from __future__ import annotations

import math
from typing import Any, Literal

from evolvent.assembly.builder import Builder
from evolvent.base import units
from evolvent.base.errors import InputError
from evolvent.kernels import coordinate_laws
from evolvent.parts.base import CoordinateName, Part
from evolvent.parts.checks import check_units
from evolvent.parts.drive import FreeSpool
from evolvent.parts.find_coordinate import find_coordinate
from evolvent.parts.law import Constants, MotorLaw, Parameters, PathDrive, write_law
from evolvent.parts.profile import TorqueOrForceProfile, write_profile
from evolvent.parts.release import ReleaseName, release_fields


class Motor(Part):
    """A motor that drives the angle of a revolute joint (torque, N m) or the travel of a prismatic one (force, N).

    Parameters
    ----------
    joint : str
        A `RotationalSpring` or `TranslationalSpring`, whose coordinate is driven, or a revolute or prismatic `Joint`,
        whose coordinate is then 0 at the start.
    torque : profile, N m or N
        Function of time: a table of rows [time, value], or one of the keys ramp, sine, pulse, constant, expression.
    law : expression or function
        Torque in place of a profile: an expression of the coordinate x (rad or m), its rate v and t (s), or a function
        under ``@evolvent.motor_law``: ``law(t, x, v, parameters) -> torque``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of an expression.
    motion : a drive of `evolvent.parts`, rad or m
        Reference r for the coordinate x, with the torque of a PD law: position_gain (r - x) + velocity_gain (r' - v).
    position_gain, velocity_gain : float, N m/rad and N m s/rad, or N/m and N s/m
        Gains of the PD law.
    limit : float, N m or N, optional
        Largest absolute value of the torque or force.
    rate_limit : float, rad/s or m/s, optional
        With `motion`: largest absolute value of the commanded rate r' + position_gain/velocity_gain (r - x).
    until : float, s, optional
        Time at which the motor is switched off; never if left out.
    released_by : str, optional
        `Event` that switches the motor off, or spring whose latch does so when it locks.

    Notes
    -----
    Give one of `torque`, `law` and `motion`. The torque acts between the two parts of the joint; a positive torque
    increases the coordinate. Its work counts as work of drives. A motor that is switched off has no torque: it leaves
    the coordinate free.
    """

    kind: Literal["motor"] = "motor"
    joint: CoordinateName
    torque: TorqueOrForceProfile | None = None
    law: MotorLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    motion: PathDrive | None = None
    position_gain: units.CoordinateStiffnessOrZero = 0.0
    velocity_gain: units.CoordinateDampingOrZero = 0.0
    limit: units.TorqueOrForceLimit | None = None
    rate_limit: units.RateLimit | None = None
    until: units.Duration | None = None
    released_by: ReleaseName | None = None

    def _check(self, name: str) -> None:
        """Refuse keys that do not go together."""
        ways = [key for key in ("torque", "law", "motion") if getattr(self, key) is not None]
        if len(ways) != 1:
            found = f"has {' and '.join(ways)}" if ways else "has no torque"
            raise InputError(f"{name} {found}; give one of {name}.torque, {name}.law and {name}.motion")
        if self.motion is None:
            for key in ("position_gain", "velocity_gain", "rate_limit"):
                if getattr(self, key):
                    raise InputError(f"{name}.{key} belongs to {name}.motion, but {name}.{ways[0]} is given")
        elif isinstance(self.motion, FreeSpool):
            raise InputError(f"{name}.motion is a free spool, which prescribes no motion; give another drive")
        elif self.position_gain == 0.0 and self.velocity_gain == 0.0:
            raise InputError(f"{name}.position_gain and {name}.velocity_gain are 0; one of them must be above 0")
        elif self.rate_limit is not None and self.velocity_gain == 0.0:
            raise InputError(f"{name}.velocity_gain is 0; {name}.rate_limit needs it above 0")
        if self.law is None:
            for key in ("parameters", "constants"):
                if getattr(self, key):
                    raise InputError(f"{name}.{key} belongs to {name}.law, but {name}.{ways[0]} is given")

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `motors`."""
        self._check(name)
        hinge = find_coordinate(builder, f"{name}.joint", self.joint)
        for key in ("torque", "motion", "position_gain", "velocity_gain", "limit", "rate_limit"):
            check_units(f"{name}.{key}", getattr(self, key), builder.rows["coordinates"][hinge]["kind"])
        row: dict[str, Any] = {"drive": 0, "law": 0}
        if self.torque is not None:
            first, last = builder.parameters(write_profile(builder, f"{name}.torque", self.torque))
            row |= {"kind": coordinate_laws.BY_PROFILE, "first": first, "last": last}
        elif self.law is not None:
            row |= {"kind": coordinate_laws.BY_LAW}
            row |= write_law(builder, name, self.law, "motor", self.parameters, self.constants)
        elif self.motion is not None:
            drive = self.motion.write(builder, f"{name}.motion")
            row |= {"kind": coordinate_laws.BY_MOTION, "drive": drive.kind, "law": drive.law}
            row |= {"first": drive.first, "last": drive.last}
        index = builder.add(
            "motors",
            coordinate=hinge,
            position_gain=self.position_gain,
            velocity_gain=self.velocity_gain,
            limit=math.inf if self.limit is None else self.limit,
            rate_limit=math.inf if self.rate_limit is None else self.rate_limit,
            **row,
            **release_fields(builder, name, self),
        )
        builder.names[name] = ("motors", index)
